//! Draws a plot with time on one axis and error on the other, as SVG. It is legible in grey, because methods differ in
//! the shapes of their marks.

use super::spots::{self, Spot};
use super::ticks;
use super::words::words;
use hbao::Error;
use hbao::measure::trade::TradeRow;
use hbao::settings::{Marker, Method};
use plotters::prelude::*;

const SIZE: (u32, u32) = (800, 560);
const DARK: RGBColor = RGBColor(40, 40, 40);

/// Draws the RMSE of each row over its milliseconds. A line joins the rows of the Pareto front, and each mark tells its
/// row.
pub(crate) fn trade(rows: &[TradeRow], title: &str) -> Result<String, Error> {
    let mut text = String::new();
    let spots = draw(rows, title, &mut text);
    let spots = spots.map_err(|e| Error::Context(format!("the plot cannot be drawn: {e}")))?;
    Ok(spots::add(&text, &spots))
}

fn draw(rows: &[TradeRow], title: &str, text: &mut String) -> Result<Vec<Spot>, Box<dyn std::error::Error>> {
    // The time axis is logarithmic, so a row that takes no time cannot be drawn.
    let rows: Vec<&TradeRow> = rows.iter().filter(|row| row.ms > 0.0).collect();
    let range = |f: &dyn Fn(&TradeRow) -> f64| {
        let values = rows.iter().map(|row| f(row));
        values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)))
    };
    let ((fast, slow), (_, worst)) = (range(&|row| row.ms), range(&|row| row.errors.rmse));
    if rows.is_empty() {
        return Err("no row took any time".into());
    }
    let (left, right) = (fast / 1.3, slow * 1.3);
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(
            (left..right).log_scale().with_key_points(ticks::logarithmic(left, right)),
            0.0..worst * 1.08,
        )?;
    chart
        .configure_mesh()
        .x_desc("ambient occlusion and blur, milliseconds (logarithmic)")
        .y_desc("RMSE against ray-traced visibility")
        .x_label_formatter(&|ms| ticks::label(*ms))
        .y_label_formatter(&|rmse| format!("{rmse:.2}"))
        .axis_desc_style(("sans-serif", 16))
        .label_style(("sans-serif", 14))
        .light_line_style(RGBColor(238, 238, 238))
        .bold_line_style(RGBColor(210, 210, 210))
        .draw()?;
    let mut front: Vec<(f64, f64)> =
        rows.iter().filter(|row| row.pareto).map(|row| (row.ms, row.errors.rmse)).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart
        .draw_series(LineSeries::new(front, RGBColor(150, 150, 150).stroke_width(2)))?
        .label("Pareto front")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], RGBColor(150, 150, 150).stroke_width(2)));
    for name in Method::NAMES {
        let of: Vec<&&TradeRow> = rows.iter().filter(|row| row.settings.method.name() == *name).collect();
        let Some(method) = of.first().map(|row| row.settings.method) else { continue };
        let Marker { outline, filled } = method.facts().marker;
        let style = if filled { DARK.filled() } else { DARK.stroke_width(1) };
        let points = of.iter().map(|row| {
            let at = EmptyElement::at((row.ms, row.errors.rmse));
            let shape = outline;
            at + if filled { Polygon::new(shape, style).into_dyn() } else { PathElement::new(shape, style).into_dyn() }
        });
        chart.draw_series(points)?.label(*name).legend(move |(x, y)| {
            let Marker { outline, filled } = method.facts().marker;
            let shape: Vec<(i32, i32)> = outline.iter().map(|(dx, dy)| (x + 9 + dx, y + dy)).collect();
            if filled {
                Polygon::new(shape, DARK.filled()).into_dyn()
            } else {
                PathElement::new(shape, DARK.stroke_width(1)).into_dyn()
            }
        });
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.9))
        .border_style(RGBColor(180, 180, 180))
        .label_font(("sans-serif", 14))
        .draw()?;
    let tell = |row: &&TradeRow| {
        let (name, words) = (row.settings.method.name(), words(&row.settings));
        let text = format!("{name} {}: RMSE {:.4}, {:.2} ms", words.trim_end(), row.errors.rmse, row.ms);
        Spot { at: chart.backend_coord(&(row.ms, row.errors.rmse)), text }
    };
    let spots = rows.iter().map(tell).collect();
    drop(chart);
    root.present()?;
    drop(root);
    Ok(spots)
}
