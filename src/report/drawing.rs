//! Draws the report's own drawings as SVG. They are legible in grey, because series differ in the shapes of their
//! marks.

use super::spots::{self, Spot};
use super::ticks;
use hbao::Error;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

const SIZE: (u32, u32) = (720, 440);
const DARK: RGBColor = RGBColor(40, 40, 40);
const LIGHT: RGBColor = RGBColor(190, 190, 190);

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// The name of a line and its points.
pub(super) type Series = (String, Vec<(f64, f64)>);

/// The axes' names and scale.
pub(super) struct Axes {
    pub(super) x: &'static str,
    pub(super) y: &'static str,
    /// Whether both axes are logarithmic.
    pub(super) logarithmic: bool,
}

fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend, plotters::coord::Shift>) -> Drawn,
) -> Result<String, Error> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let drawn = root.fill(&WHITE).map_err(Into::into).and_then(|()| draw(&root));
        let presented = drawn.and_then(|()| root.present().map_err(Into::into));
        presented.map_err(|e| Error::Context(format!("a drawing cannot be made: {e}")))?;
    }
    Ok(text)
}

/// Draws lines through points, with a legend. Each point tells its values.
pub(super) fn lines(series: &[Series], axes: &Axes) -> Result<String, Error> {
    let all = || series.iter().flat_map(|(_, points)| points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        all().map(of).fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)))
    };
    let ((left, right), (low, high)) = (range(|p| p.0), range(|p| p.1));
    let mut spots = Vec::new();
    let drawn = svg(SIZE, |root| {
        spots = if axes.logarithmic {
            let along = |low: f64, high: f64| (low..high).log_scale().with_key_points(ticks::logarithmic(low, high));
            chart(root, series, axes, along(left / 1.3, right * 1.3), along(low / 1.5, high * 6.0))?
        } else {
            chart(root, series, axes, left..right, 0.0..high.max(1e-3) * 1.3)?
        };
        Ok(())
    })?;
    Ok(spots::add(&drawn, &spots))
}

fn chart<'a, X, Y>(
    root: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
    series: &[Series],
    axes: &Axes,
    x: X,
    y: Y,
) -> Result<Vec<Spot>, Box<dyn std::error::Error>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut chart =
        ChartBuilder::on(root).margin(12).x_label_area_size(48).y_label_area_size(64).build_cartesian_2d(x, y)?;
    let label = |value: &f64| ticks::label(*value);
    chart
        .configure_mesh()
        .x_labels(6)
        .x_desc(axes.x)
        .y_desc(axes.y)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .draw()?;
    for (i, (name, points)) in series.iter().enumerate() {
        let line = DARK.mix(0.55).stroke_width(1);
        chart.draw_series(LineSeries::new(points.iter().copied(), line))?;
        let marks = points.iter().map(|&at| EmptyElement::at(at) + mark(i, (0, 0)));
        chart.draw_series(marks)?.label(name).legend(move |at| mark(i, (at.0 + 9, at.1)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.9))
        .border_style(LIGHT)
        .label_font(("sans-serif", 13))
        .draw()?;
    let all = series.iter().flat_map(|(name, points)| points.iter().map(move |point| (name, point)));
    let tell = |(name, point): (&String, &(f64, f64))| Spot {
        at: chart.backend_coord(point),
        text: format!("{name}: {} at {} {}", told(point.1), told(point.0), axes.x),
    };
    Ok(all.map(tell).collect())
}

/// Writes a value as precisely as a reader may want it.
fn told(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Makes the mark of the i-th series.
fn mark<'a>(i: usize, at: (i32, i32)) -> DynElement<'static, SVGBackend<'a>, (i32, i32)> {
    let of = |outline: &[(i32, i32)]| outline.iter().map(|(x, y)| (at.0 + x, at.1 + y)).collect::<Vec<_>>();
    let (square, triangle) = ([(-4, -4), (4, -4), (4, 4), (-4, 4), (-4, -4)], [(0, -5), (5, 4), (-5, 4), (0, -5)]);
    match i % 5 {
        0 => Polygon::new(of(&square), DARK.filled()).into_dyn(),
        1 => PathElement::new(of(&square), DARK.stroke_width(1)).into_dyn(),
        2 => Polygon::new(of(&triangle), DARK.filled()).into_dyn(),
        3 => PathElement::new(of(&triangle), DARK.stroke_width(1)).into_dyn(),
        _ => Circle::new(at, 4, DARK.filled()).into_dyn(),
    }
}

/// Draws the texels that each direction of a pixel reads. They are given as offsets (x, y) from that pixel, which is
/// drawn in the middle. The first direction is at `turn` radians.
pub(super) fn texels(directions: &[Vec<(f64, f64)>], turn: f64) -> Result<String, Error> {
    let reach = directions.iter().flatten().map(|(x, y)| x.abs().max(y.abs())).fold(3.0, f64::max) + 1.5;
    svg((420, 420), |root| {
        let mut chart = ChartBuilder::on(root)
            .margin(6)
            .build_cartesian_2d::<RangedCoordf64, RangedCoordf64>((-reach..reach).into(), (-reach..reach).into())?;
        let (low, high) = ((-reach).ceil() as i32, reach.floor() as i32);
        for i in low..=high {
            let edge = f64::from(i) - 0.5;
            for line in [[(edge, -reach), (edge, reach)], [(-reach, edge), (reach, edge)]] {
                chart.draw_series([PathElement::new(line, RGBColor(232, 232, 232).stroke_width(1))])?;
            }
        }
        for (k, samples) in directions.iter().enumerate() {
            let angle = turn + std::f64::consts::TAU * k as f64 / directions.len() as f64;
            let end = (reach * angle.cos(), reach * angle.sin());
            chart.draw_series([PathElement::new([(0.0, 0.0), end], LIGHT.stroke_width(1))])?;
            chart.draw_series(
                samples
                    .iter()
                    .map(|&(x, y)| Rectangle::new([(x - 0.5, y - 0.5), (x + 0.5, y + 0.5)], DARK.mix(0.75).filled())),
            )?;
        }
        chart.draw_series([Rectangle::new([(-0.5, -0.5), (0.5, 0.5)], DARK.stroke_width(2))])?;
        Ok(())
    })
}
