//! The tables of `hbao trade`: the time and the error of each combination of settings, and the error decomposed by its
//! causes.

use super::cells::{optional, percent};
use crate::report::fields::trade_fields;
use crate::report::words::words;
use hbao::Settings;
use hbao::measure::decomposition::Decomposition;
use hbao::measure::table::{Column, Table};
use hbao::measure::trade::TradeRow;

/// Makes the table of the time and the errors of a sweep. The first column has a star if no other combination is better
/// in both time and RMSE. The column `exits` has the share of texels at which the method exits early. The columns
/// `best S` and `its RMSE` have the strength with which the RMSE would be the least, and that RMSE. `flip_places` is
/// the number of decimal places of FLIP.
pub(crate) fn sweep(rows: &[TradeRow], flip_places: usize) -> Table {
    let columns = [
        Column::left("", 2),
        Column::left("method", 12),
        Column::left("samples", 32),
        Column::right("exits", 7),
        Column::right("ms", 9),
        Column::right("AO ms", 9),
        Column::right("RMSE", 9),
        Column::right("MAE", 9),
        Column::right("bias", 9),
        Column::right("max", 8),
        Column::right("FLIP", 8),
        Column::right("best S", 8),
        Column::right("its RMSE", 10),
        Column::right("edge RMSE", 11),
    ];
    Table::new(columns).filled(rows.iter().map(|row| {
        let e = &row.errors;
        vec![
            if row.pareto { "*" } else { "" }.into(),
            row.settings.method.name().into(),
            words(&row.settings),
            percent(row.reach.exits),
            format!("{:.2}", row.ms),
            format!("{:.2}", row.ao_ms),
            format!("{:.4}", e.rmse),
            format!("{:.4}", e.mae),
            format!("{:+.4}", e.bias),
            format!("{:.3}", e.max),
            optional(e.flip, flip_places),
            optional(row.best_strength.map(|best| best.strength), 2),
            optional(row.best_strength.map(|best| best.rmse), 4),
            optional(row.edge_errors.map(|edge| edge.rmse), 4),
        ]
    }))
}

/// Makes a table of all fields of the rows of a sweep, for a CSV file.
pub(crate) fn all_fields(rows: &[TradeRow]) -> Table {
    let rows: Vec<_> = rows.iter().map(trade_fields).collect();
    let names = rows.first().into_iter().flatten().map(|(name, _)| *name).collect::<Vec<_>>();
    // Strings are written without the quotes that they have in JSON.
    let cell = |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), String::from);
    Table::headed(names).filled(rows.iter().map(|row| row.iter().map(|(_, value)| cell(value)).collect()))
}

/// One combination of settings, and its decomposed error.
pub(crate) type Decomposed = (Settings, Decomposition);

/// Makes the table of the RMSE and the bias of each part of the error.
pub(crate) fn parts(all: &[Decomposed]) -> Table {
    let columns = [
        Column::left("method", 12).after_gap(2),
        Column::left("samples", 20),
        Column::right("model", 18),
        Column::right("sampling", 18),
        Column::right("filtering", 18),
        Column::right("quantisation", 18),
        Column::right("total", 18),
        Column::right("cross", 11),
    ];
    Table::new(columns).filled(all.iter().map(|(settings, parts)| {
        let errors = [parts.model, parts.sampling, parts.filtering, parts.quantisation, parts.total];
        let errors = errors.map(|part| format!("{:.4} {:+.4}", part.rmse, part.bias));
        let names = [settings.method.name().into(), words(settings)];
        names.into_iter().chain(errors).chain([format!("{:+.5}", parts.cross)]).collect()
    }))
}

/// Returns the number of pixels at which the error is decomposed.
pub(crate) fn decomposed_pixels(all: &[Decomposed]) -> usize {
    all.first().map_or(0, |(_, parts)| parts.pixels)
}
