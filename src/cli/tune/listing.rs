//! Lists the combinations of settings that `hbao tune` considered, as a table and as JSON.

use super::words::{described, why};
use crate::report::fields::{object, settings_fields};
use hbao::measure::table::{Column, Table};
use hbao::measure::tune::choice::Goal;
use hbao::measure::tune::{Requirements, Tried, Tuned};

/// The largest number of rows in the table.
const SHOWN: usize = 11;

/// Makes the table of the answer, which has a star, and of the combinations that came nearest to it.
pub(super) fn table(tuned: &Tuned, goal: Goal, requirements: &Requirements) -> Table {
    let edges = requirements.edge_pixels != [0; 3];
    let columns = [
        Column::left("", 2),
        Column::left("settings", 52),
        Column::right("ms", 9),
        Column::right("of runs", 18),
        Column::right("RMSE", 9),
        Column::left("verdict", 0).after_gap(2),
    ];
    Table::new(columns).filled(tuned.nearest(goal, SHOWN).into_iter().map(|i| {
        let tried = &tuned.tried[i];
        let (low, high) = spread(tried);
        vec![
            if tuned.best == Some(i) { "*" } else { "" }.into(),
            described(&tried.settings, edges),
            format!("{:.2}", tried.ms().unwrap_or(f64::NAN)),
            if tried.times.is_empty() { "2 in a row".into() } else { format!("{low:.2} to {high:.2}") },
            format!("{:.4}", tried.rmse().unwrap_or(f64::NAN)),
            why(tried.verdict, goal).into(),
        ]
    }))
}

/// Returns the times of the fastest and of the slowest run.
fn spread(tried: &Tried) -> (f64, f64) {
    tried.times.iter().fold((f64::INFINITY, 0.0), |(low, high), &ms| (low.min(ms), high.max(ms)))
}

/// Returns a combination that was considered, as JSON.
pub(super) fn json(tried: &Tried, requirements: &Requirements) -> serde_json::Value {
    let (s, e) = (&tried.settings, tried.errors.as_ref());
    let timed = !tried.times.is_empty();
    let (low, high) = spread(tried);
    let mut fields = settings_fields(s);
    fields.extend([
        ("exit_share", requirements.reach(s).ok().map(|reach| reach.exits).into()),
        ("jitter", s.jitter.name().into()),
        ("edges", s.edges.name().into()),
        ("ssao_depth", s.ssao_depth.name().into()),
        ("ssao_normals", s.ssao_normals.name().into()),
        ("ssao_curve", s.curve().name().into()),
        ("ms", tried.ms().into()),
        ("runs", tried.times.len().into()),
        ("ms_min", timed.then_some(low).into()),
        ("ms_max", timed.then_some(high).into()),
        ("rmse", tried.rmse().into()),
        ("mae", e.map(|e| e.mae).into()),
        ("bias", e.map(|e| e.bias).into()),
        ("max", e.map(|e| e.max).into()),
        ("flip", e.and_then(|e| e.flip).into()),
        ("verdict", tried.verdict.name().into()),
    ]);
    object(fields)
}
