//! The table of contents.

use super::Report;
use super::parts::{anchor, number};
use crate::report::figure::Figure;
use maud::{Markup, html};

pub(super) fn list(report: &Report) -> Markup {
    html! {
        ul.contents {
            li {
                a href="#summary" { "Summary" }
                ul { @for finding in &report.findings { (link(&finding.figure)) } }
            }
            li { a href="#figures" { "Figures" } ul { @for figure in &report.figures { (link(figure)) } } }
            li { a href="#equations" { "Equations" } }
            li {
                a href="#claims" { "Claims" }
                ul { @for claim in &report.claims {
                    li class=(claim.verdict().class()) {
                        a href={ "#claim-" (claim.id) } title=(claim.verdict().name()) { (claim.id.replace('-', " ")) }
                    }
                } }
            }
            li { a href="#tables" { "Tables" } ul { @for figure in &report.measures { (link(figure)) } } }
            li { a href="#extremes" { "Extremes" } }
        }
    }
}

fn link(figure: &Figure) -> Markup {
    html! {
        li { a href={ "#" (anchor(figure)) } { @if let Some(number) = number(figure) { (number) " " } (figure.title) } }
    }
}
