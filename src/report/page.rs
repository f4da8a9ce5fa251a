//! The report as one page of HTML that needs no other file.

use super::claim::{Claim, Verdict};
use super::figure::{Figure, Picture};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use hbao::measure::table::Table;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The whole report.
pub(super) struct Report {
    /// Names and values that describe the run: the program, the machine and the options.
    pub(super) about: Vec<(&'static str, String)>,
    /// One line for each thing that the report leaves out.
    pub(super) missing: Vec<String>,
    pub(super) claims: Vec<Claim>,
    /// Tables and plots of what was measured, together with the papers' own tables.
    pub(super) measures: Vec<Figure>,
    /// The papers' figures, rendered again.
    pub(super) figures: Vec<Figure>,
}

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Writes the report as a page of HTML.
pub(super) fn html(report: &Report) -> String {
    let count = |verdict| report.claims.iter().filter(|claim| claim.verdict() == verdict).count();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "hbao: the screen-space ambient occlusion of 2008, measured" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "The screen-space ambient occlusion of 2008, measured" }
                p {
                    "Figures, tables and claims of Bavoil, Sainz and Dimitrov (SIGGRAPH 2008 talk), Bavoil and Sainz \
                     (ShaderX7 6.2) and Kajalin (ShaderX7 6.1), regenerated. Every number on this page is from the run \
                     that made it, or stands in a column of 2008."
                }
                dl.about { @for (name, value) in &report.about { dt { (name) } dd { (value) } } }
                @if !report.missing.is_empty() {
                    section.missing {
                        h2 { "Left out" }
                        ul { @for line in &report.missing { li { (line) } } }
                    }
                }
                nav {
                    a href="#claims" { "Claims" }
                    @for figure in report.measures.iter().chain(&report.figures) {
                        a href={ "#" (anchor(figure)) } { (label(figure)) }
                    }
                }
                h2 #claims { "Claims" }
                p {
                    (count(Verdict::Holds)) " hold, " (count(Verdict::InPart)) " hold in part, "
                    (count(Verdict::DoesNotHold)) " do not hold"
                    @if count(Verdict::NotMeasured) > 0 { ", " (count(Verdict::NotMeasured)) " were not measured" }
                    ". A rule is about each row of what was found: a claim holds where all rows hold, does not hold where \
                     none does even in part, and holds in part otherwise."
                }
                (claims(&report.claims))
                h2 { "Tables" }
                @for figure in &report.measures { (section(figure)) }
                h2 { "Figures" }
                p.hint {
                    "Pictures of one figure can be laid over each other: move the slider, or blink. Ambient occlusion is \
                     shown as visibility: white is open. Where the command knows the scene, a caption ends with what makes the same image."
                }
                @for figure in &report.figures { (section(figure)) }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

fn anchor(figure: &Figure) -> String {
    format!("figure-{}", figure.id)
}

fn label(figure: &Figure) -> String {
    if figure.id.starts_with(|c: char| c.is_ascii_digit()) {
        format!("Figure {}", figure.id)
    } else {
        figure.title.clone()
    }
}

fn claims(claims: &[Claim]) -> Markup {
    html! {
        table.claims {
            thead { tr { th { "The papers say" } th { "Found" } th { "Rule" } th { "Verdict" } } }
            tbody {
                @for claim in claims {
                    tr id={ "claim-" (claim.id) } {
                        td { p { (claim.says) } p.source { (claim.source) } }
                        td {
                            ul { @for found in &claim.found {
                                li class=(found.verdict.class()) { b { (found.scene) } ": " (found.text) }
                            } }
                            @if let Some(why) = claim.unmeasured.as_ref().filter(|_| claim.found.is_empty()) { p.source { (why) } }
                            @if !claim.note.is_empty() { p.source { (claim.note) } }
                        }
                        td.rule { (claim.rule) }
                        td class={ "verdict " (claim.verdict().class()) } { (claim.verdict().name()) }
                    }
                }
            }
        }
    }
}

fn section(figure: &Figure) -> Markup {
    let several = figure.pictures.len() > 1 && figure.pictures.windows(2).any(|two| two[0].size == two[1].size);
    html! {
        section id=(anchor(figure)) {
            h3 { @if label(figure) != figure.title { (label(figure)) ". " } (figure.title) }
            p { (figure.text) }
            @for table in &figure.tables { (table_of(table)) }
            @if !figure.drawings.is_empty() {
                div.drawings {
                    @for drawing in &figure.drawings {
                        figure { (PreEscaped(&drawing.svg)) figcaption { (drawing.caption) } }
                    }
                }
            }
            @if !figure.pictures.is_empty() {
                div.pictures {
                    @for picture in &figure.pictures { (picture_of(picture)) }
                }
            }
            @if several { div.compare {} }
        }
    }
}

fn picture_of(picture: &Picture) -> Markup {
    let source = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&picture.png));
    let (width, height) = picture.size;
    html! {
        figure class=[(picture.enlarged > 1).then_some("enlarged")] {
            img src=(source) alt=(picture.caption) width=(width * picture.enlarged) height=(height * picture.enlarged);
            figcaption {
                (picture.caption)
                @if let Some(command) = &picture.command { " " code { (command) } }
            }
        }
    }
}

fn table_of(table: &Table) -> Markup {
    html! {
        table.figures {
            caption { (table.caption) }
            thead { tr { @for column in &table.columns { th { (column.heading) } } } }
            tbody {
                @for row in &table.rows {
                    tr { @for (i, cell) in row.iter().enumerate() {
                        @if i == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                    } }
                }
            }
        }
        @for note in &table.notes { p.note { (note) } }
    }
}
