//! Sections of the page, and the pictures, drawings and tables in them.

use super::prose::unbroken;
use crate::report::figure::{Drawing, Figure, Picture};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use hbao::measure::table::{Align, Table};
use maud::{Markup, PreEscaped, html};

pub(super) fn anchor(figure: &Figure) -> String {
    format!("figure-{}", figure.id)
}

/// Returns the number that the figure has in its paper, if it has one.
pub(super) fn number(figure: &Figure) -> Option<&str> {
    figure.id.starts_with(|c: char| c.is_ascii_digit()).then_some(&*figure.id)
}

pub(super) fn section(figure: &Figure) -> Markup {
    html! {
        section id=(anchor(figure)) {
            h3 { @if let Some(number) = number(figure) { "Figure " (number) ". " } (figure.title) }
            p { (unbroken(&figure.text)) }
            (contents(figure))
        }
    }
}

/// Shows what a figure holds, without its title and text.
pub(super) fn contents(figure: &Figure) -> Markup {
    let several = figure.pictures.windows(2).any(|two| two[0].size == two[1].size);
    html! {
        @if !figure.drawings.is_empty() {
            div.drawings { @for drawing in &figure.drawings { (drawing_of(drawing)) } }
        }
        @for table in &figure.tables { (table_of(table)) }
        @if !figure.pictures.is_empty() {
            div.pictures { @for picture in &figure.pictures { (picture_of(picture)) } }
        }
        @if several { div.compare {} }
    }
}

/// Writes a text that may be a command line.
fn text_or_command(text: &str) -> Markup {
    html! { @if text.starts_with("hbao ") { code { (text) } } @else { (unbroken(text)) } }
}

fn drawing_of(drawing: &Drawing) -> Markup {
    html! {
        figure.drawing {
            div.scroll tabindex="0" { (PreEscaped(&drawing.svg)) }
            figcaption { (text_or_command(&drawing.caption)) }
        }
    }
}

/// Shows a picture. Its link leads to itself, and the style sheet spreads over the window what is led to.
fn picture_of(picture: &Picture) -> Markup {
    let source = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&picture.png));
    let (width, height) = (picture.size.0 * picture.enlarged, picture.size.1 * picture.enlarged);
    let name = picture.file.trim_end_matches(".png");
    html! {
        figure id={ "at-" (name) } class={ "picture" @if picture.enlarged > 1 { " enlarged" } } {
            div.place style={ "max-width: " (width) "px; aspect-ratio: " (width) " / " (height) } {
                div.sheet id={ "full-" (name) } {
                    a.close href={ "#at-" (name) } { "close" }
                    a.open href={ "#full-" (name) } title="at full size" {
                        img src=(source) alt=(picture.caption) width=(width) height=(height);
                    }
                }
            }
            figcaption {
                span.caption { (unbroken(&picture.caption)) }
                @if let Some(command) = &picture.command { " " code { (command) } }
            }
        }
    }
}

/// The longest text of a cell that stays on one line, in characters.
const SHORT: usize = 26;

fn table_of(table: &Table) -> Markup {
    let columns = table.columns.len();
    let left = |i: usize| (table.columns.get(i).map(|column| column.align) == Some(Align::Left)).then_some("left");
    html! {
        div.scroll tabindex="0" {
            table.figures {
                caption { span { (table.caption) } }
                thead { tr { @for (i, column) in table.columns.iter().enumerate() { th scope="col" class=[left(i)] { (column.heading) } } } }
                tbody {
                    @for row in &table.rows {
                        // The last cell of a row that ends early, such as a refusal, takes the columns that are left.
                        @let rest = (row.len() < columns).then(|| columns - row.len() + 1);
                        tr { @for (i, cell) in row.iter().enumerate() {
                            @let rest = rest.filter(|_| i > 0 && i + 1 == row.len());
                            @if i == 0 { th scope="row" { (cell) } }
                            @else if rest.is_some() || cell.chars().count() > SHORT {
                                td.text colspan=[rest] { (unbroken(cell)) }
                            }
                            @else { td class=[left(i)] { (cell) } }
                        } }
                    }
                }
            }
        }
        @for note in &table.notes { p.note { (text_or_command(note)) } }
    }
}
