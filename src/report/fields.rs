//! Converts settings and their measurements to the fields of a file. JSON objects and the rows of a CSV file are made
//! of fields.

use hbao::Settings;
use hbao::measure::trade::TradeRow;
use hbao::measure::{blur_width, directions_rays_steps};
use serde_json::Value;

/// A field of a file: its name and its value.
pub(crate) type Field = (&'static str, Value);

/// Returns the fields that describe settings, in their order.
pub(crate) fn settings_fields(s: &Settings) -> Vec<Field> {
    let [directions, rays, steps] = directions_rays_steps(s.method, s);
    vec![
        ("method", s.method.name().into()),
        ("directions", directions.into()),
        ("steps", steps.into()),
        ("rays", rays.max(1).into()),
        ("strength", s.strength.into()),
        ("exit", s.exit.name().into()),
        ("zenith", s.zenith.name().into()),
        ("spacing", s.spacing.into()),
        ("quadrature", s.quadrature.name().into()),
        ("half_res", s.half_res.into()),
        ("blur", blur_width(s).into()),
        ("blur_kernel", s.blur_kernel.name().into()),
        ("msaa", s.msaa.into()),
        ("ao_format", s.ao_format.name().into()),
        ("normal_format", s.normal_format.name().into()),
        ("depth_format", s.depth_format.name().into()),
    ]
}

/// Returns the fields of a row of a sweep, in their order.
pub(crate) fn trade_fields(row: &TradeRow) -> Vec<Field> {
    let (e, edge) = (&row.errors, &row.edge_errors);
    let mut all = settings_fields(&row.settings);
    all.extend([
        ("exit_share", row.reach.exits.into()),
        ("ms", row.ms.into()),
        ("ao_ms", row.ao_ms.into()),
        ("rmse", e.rmse.into()),
        ("mae", e.mae.into()),
        ("bias", e.bias.into()),
        ("max", e.max.into()),
        ("flip", e.flip.into()),
        ("best_strength", row.best_strength.map(|best| best.strength).into()),
        ("rmse_at_best_strength", row.best_strength.map(|best| best.rmse).into()),
        ("edge_rmse", edge.map(|e| e.rmse).into()),
        ("edge_mae", edge.map(|e| e.mae).into()),
        ("edge_bias", edge.map(|e| e.bias).into()),
        ("edge_max", edge.map(|e| e.max).into()),
        ("edge_flip", edge.and_then(|e| e.flip).into()),
        ("pareto", row.pareto.into()),
    ]);
    all
}

/// Makes a JSON object of fields.
pub(crate) fn object(fields: Vec<Field>) -> Value {
    Value::Object(fields.into_iter().map(|(name, value)| (name.to_string(), value)).collect())
}
