//! The claims of the papers, and what was found for each.

use super::prose::unbroken;
use crate::report::claim::{Claim, Found, Verdict};
use maud::{Markup, html};

/// The verdicts, in the order in which the page counts them, with the words for one
/// claim and for several.
const COUNTED: [(Verdict, [&str; 2]); 4] = [
    (Verdict::Holds, ["holds", "hold"]),
    (Verdict::InPart, ["holds in part", "hold in part"]),
    (Verdict::DoesNotHold, ["does not hold", "do not hold"]),
    (Verdict::NotMeasured, ["was not measured", "were not measured"]),
];

/// Shows how many claims have each verdict, as a bar and in words.
pub(super) fn tally(claims: &[Claim]) -> Markup {
    let count = |verdict| claims.iter().filter(|claim| claim.verdict() == verdict).count();
    let counts = COUNTED.map(|(verdict, words)| (verdict, words, count(verdict)));
    let counts = || counts.iter().filter(|(.., count)| *count > 0);
    html! {
        div.bar aria-hidden="true" {
            @for (verdict, _, count) in counts() { span class=(verdict.class()) style={ "flex-grow: " (count) } {} }
        }
        p.tally {
            "Of " a href="#claims" { (claims.len()) " claims" } ", "
            @for (i, (verdict, words, count)) in counts().enumerate() {
                @if i > 0 { ", " }
                span class={ "verdict " (verdict.class()) } { (count) " " (if *count == 1 { words[0] } else { words[1] }) }
            }
            "."
        }
    }
}

pub(super) fn section(claims: &[Claim]) -> Markup {
    html! {
        h2 #claims { "Claims" }
        (tally(claims))
        p {
            "The rule is applied to each row of what was found. A claim holds if all its rows hold. It does not hold if no row \
             holds even in part. Otherwise it holds in part."
        }
        table.claims {
            thead { tr { th { "The papers say" } th { "Found" } th { "Rule" } th { "Verdict" } } }
            tbody { @for claim in claims { (row(claim)) } }
        }
    }
}

fn row(claim: &Claim) -> Markup {
    let verdict = claim.verdict();
    html! {
        tr id={ "claim-" (claim.id) } {
            td { p { (unbroken(claim.says)) } p.source { (claim.source) } }
            td {
                ul { @for found in &claim.found { (found_in(found)) } }
                @if let Some(why) = claim.unmeasured.as_ref().filter(|_| claim.found.is_empty()) { p.source { (unbroken(why)) } }
                @if !claim.note.is_empty() { p.source { (unbroken(&claim.note)) } }
            }
            td.rule { (unbroken(&claim.rule)) }
            td class={ "verdict " (verdict.class()) } { (verdict.name()) }
        }
    }
}

/// Says what was found in one scene.
pub(super) fn found_in(found: &Found) -> Markup {
    html! { li class=(found.verdict.class()) { b { (found.scene) } ": " (unbroken(&found.text)) } }
}
