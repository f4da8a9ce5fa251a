//! The report as one page of HTML that needs no other file. It is legible without scripts; with them, pictures can be
//! laid over each other.

mod claims;
mod contents;
mod equations;
mod parts;
mod prose;
mod summary;

use super::claim::Claim;
use super::figure::Figure;
use super::findings::Finding;
use maud::{DOCTYPE, PreEscaped, html};

/// The whole report.
pub(super) struct Report {
    /// Names and values that describe the run: the program, the machine and the options.
    pub(super) about: Vec<(&'static str, String)>,
    /// The answers that the page begins with.
    pub(super) findings: Vec<Finding>,
    /// One line for each thing that the report leaves out.
    pub(super) missing: Vec<String>,
    pub(super) claims: Vec<Claim>,
    /// Tables and plots of what was measured, together with the papers' own tables.
    pub(super) measures: Vec<Figure>,
    /// The papers' figures, rendered again.
    pub(super) figures: Vec<Figure>,
    /// Tables and pictures of numbers at their extremes.
    pub(super) extremes: Vec<Figure>,
}

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// Writes the report as a page of HTML.
pub(super) fn html(report: &Report) -> String {
    let list = || contents::list(report);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "hbao: the screen-space ambient occlusion of 2008, measured" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                // The contents are written twice, since no style sheet opens a <details> where there is room for it.
                nav.beside aria-label="Contents" { (list()) }
                nav.above aria-label="Contents" { details { summary { "Contents" } (list()) } }
                main {
                    (summary::summary(report))
                    h2 #figures { "Figures" }
                    p.hint {
                        "Ambient occlusion is shown as visibility: white is open. A click on a picture opens it at full size. \
                         Where the command knows the scene, a caption ends with what makes the same image. Where scripts run, two \
                         pictures of a figure can be laid over each other: move the slider, or blink."
                    }
                    @for figure in &report.figures { (parts::section(figure)) }
                    (equations::section())
                    (claims::section(&report.claims))
                    h2 #tables { "Tables" }
                    @for figure in &report.measures { (parts::section(figure)) }
                    h2 #extremes { "Extremes" }
                    @for figure in &report.extremes { (parts::section(figure)) }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}
