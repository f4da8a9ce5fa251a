//! The summary that the page begins with: what was measured, on what, how the claims fared, and what follows.

use super::Report;
use super::claims::{found_in, tally};
use super::parts::{anchor, contents};
use super::prose::unbroken;
use crate::report::claim::Claim;
use crate::report::findings::Finding;
use maud::{Markup, html};

pub(super) fn summary(report: &Report) -> Markup {
    html! {
        header #summary {
            h1 { "The screen-space ambient occlusion of 2008, measured" }
            p {
                "Figures, tables and claims of Bavoil, Sainz and Dimitrov (SIGGRAPH 2008 talk), Bavoil and Sainz (ShaderX7 6.2, \
                 'the chapter') and Kajalin (ShaderX7 6.1), regenerated. Every number on this page is from the run that made it, or \
                 stands in a column of 2008. A is visibility: 1 is open, 0 is closed. Errors are against rays on the triangles."
            }
            (tally(&report.claims))
            dl.about { @for (name, value) in &report.about { dt { (name) } dd { (value) } } }
            @if !report.missing.is_empty() {
                details.missing {
                    summary { "Left out of this run: " (report.missing.len()) }
                    ul { @for line in &report.missing { li { (unbroken(line)) } } }
                }
            }
        }
        @for finding in &report.findings { (answered(finding, &report.claims)) }
    }
}

fn answered(finding: &Finding, claims: &[Claim]) -> Markup {
    let decided = || finding.claims.iter().filter_map(|id| claims.iter().find(|claim| claim.id == *id));
    html! {
        section.finding id=(anchor(&finding.figure)) {
            h3 { (finding.figure.title) }
            p.answer { (unbroken(&finding.answer)) }
            p { (unbroken(&finding.figure.text)) }
            ul.decided {
                @for claim in decided() {
                    li class=(claim.verdict().class()) {
                        a href={ "#claim-" (claim.id) } { (claim.says) } " "
                        span class={ "verdict " (claim.verdict().class()) } { (claim.verdict().name()) }
                        ul { @for found in &claim.found { (found_in(found)) } }
                    }
                }
            }
            (contents(&finding.figure))
        }
    }
}
