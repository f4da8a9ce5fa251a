//! The window that shows error against time: the points of a [`Sweep`], and what they are.

use super::panel;
use super::state::Viewer;
use super::sweep::{Asked, RAYS, RUNS, Sweep};
use crate::report::ticks;
use crate::report::words::words;
use eframe::egui::{
    self, Align2, Color32, FontId, Pos2, Rect, RichText, Sense, Shape, Stroke, StrokeKind, TextEdit, Ui, pos2, vec2,
};
use hbao::measure::trade::TradeRow;
use hbao::settings::{Marker, Method, Settings};
use serde_json::json;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The size of the plot, in points.
const SIZE: [f32; 2] = [512.0, 320.0];
/// The room for the labels at the left and below, in points.
const MARGIN: [f32; 2] = [38.0, 34.0];
/// The room for the legend at the right, in points.
const LEGEND: f32 = 108.0;
/// How near to a point the pointer must be, in points.
const NEAR: f32 = 10.0;

/// Shows the window, if it is open.
pub(super) fn show(viewer: &mut Viewer, context: &egui::Context) {
    if !viewer.sweep_shown {
        return;
    }
    let mut shown = true;
    // Beside the panel, so that the window with the costs has room at the left.
    let corner = context.content_rect().right_top() + vec2(-panel::WIDTH - 12.0, 12.0);
    let window = egui::Window::new("Error against time").resizable(false).pivot(Align2::RIGHT_TOP).default_pos(corner);
    window.open(&mut shown).show(context, |ui| {
        ui.set_width(SIZE[0]);
        controls(viewer, ui);
        plot(viewer, ui);
        command(viewer, ui);
    });
    // A key may have closed it as well.
    viewer.sweep_shown &= shown;
}

/// What would be measured now.
fn asked(viewer: &Viewer) -> Asked {
    Asked {
        name: viewer.name.clone(),
        scene: viewer.scene.clone(),
        eye: viewer.eye.clone(),
        view: viewer.eye.view(),
        size: viewer.size,
        backend: viewer.backend,
        sides: viewer.sides.clone(),
        tab: viewer.tab,
    }
}

/// The button that starts and cancels, and how far the measurement is.
fn controls(viewer: &mut Viewer, ui: &mut Ui) {
    let (width, height) = asked(viewer).reduced();
    let side = ["A", "B"][viewer.tab];
    ui.label(format!(
        "Some 60 combinations of settings with the radius, attenuation and strength of {side}, and A and B themselves, \
         with one depth sample a pixel, at {width}x{height}: RMSE against ray-traced visibility ({RAYS} rays a pixel) over \
         the time of ambient occlusion and blur (median of {RUNS}, disturbed by whatever else runs)."
    ));
    let running = viewer.sweep.as_ref().is_some_and(|sweep| !sweep.state().ended);
    ui.horizontal(|ui| {
        if running {
            let cancel = ui.button("cancel").on_hover_text("What was measured stays");
            viewer.note("sweep cancel", cancel.rect);
            if let (true, Some(sweep)) = (cancel.clicked(), &viewer.sweep) {
                sweep.cancel();
            }
        } else {
            let start = ui.button("measure").on_hover_text("It takes some seconds to a minute, in the background");
            viewer.note("sweep start", start.rect);
            if start.clicked() {
                // The earlier one has ended, and gives way here.
                match Sweep::start(asked(viewer), ui.ctx()) {
                    Ok(sweep) => viewer.sweep = Some(sweep),
                    Err(error) => viewer.message = Some(error.to_string()),
                }
            }
        }
        let Some(sweep) = &viewer.sweep else { return };
        let state = sweep.state();
        if !state.ended {
            let share = state.done as f32 / state.total.max(1) as f32;
            let text = match sweep.is_cancelled() {
                true => "ending ...".into(),
                false => format!("{} of {} {}", state.done, state.total, state.step),
            };
            ui.add(egui::ProgressBar::new(share).desired_width(320.0).text(text));
        } else if let Some(error) = &state.error {
            ui.label(RichText::new(error).color(Color32::from_rgb(255, 150, 130)));
        } else {
            let (width, height) = sweep.asked.reduced();
            let cancelled = if sweep.is_cancelled() { ", cancelled" } else { "" };
            let count = state.rows.len();
            let text = format!("{count} points, {width}x{height}{cancelled}; noise of the truth {:.4}.", state.noise);
            ui.label(text);
            if is_stale(viewer, &sweep.asked) {
                ui.label(RichText::new("Of an earlier view.").color(Color32::from_rgb(255, 210, 120)));
            }
        }
    });
}

/// Whether what was measured belongs to another scene, camera or radius than the window shows now.
fn is_stale(viewer: &Viewer, asked: &Asked) -> bool {
    let radius = |settings: &Settings| (settings.radius, settings.attenuation);
    !Arc::ptr_eq(&viewer.scene, &asked.scene)
        || viewer.eye.view() != asked.view
        || radius(&viewer.sides[viewer.tab]) != radius(&asked.sides[asked.tab])
}

/// The axes: time is logarithmic.
struct Axes {
    area: Rect,
    ms: RangeInclusive<f64>,
    rmse: f64,
}

impl Axes {
    fn of(rows: &[TradeRow], area: Rect) -> Axes {
        let times = rows.iter().map(|row| row.ms).filter(|ms| *ms > 0.0);
        let (fast, slow) = times.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), ms| (low.min(ms), high.max(ms)));
        let (fast, slow) = if fast <= slow { (fast / 1.3, slow * 1.3) } else { (0.1, 100.0) };
        let worst = rows.iter().map(|row| row.errors.rmse).fold(0.0, f64::max);
        Axes { area, ms: fast..=slow, rmse: if worst > 0.0 { worst * 1.08 } else { 0.3 } }
    }

    /// The place of a time and an error. What takes no time stands at the left end.
    fn at(&self, ms: f64, rmse: f64) -> Pos2 {
        let (low, high) = (self.ms.start().ln(), self.ms.end().ln());
        let share = ((ms.max(*self.ms.start()).ln() - low) / (high - low)) as f32;
        let up = (rmse / self.rmse) as f32;
        pos2(self.area.left() + share * self.area.width(), self.area.bottom() - up * self.area.height())
    }

    fn draw(&self, painter: &egui::Painter) {
        let (line, grey) = (Stroke::new(1.0, Color32::from_gray(46)), Color32::from_gray(190));
        let font = FontId::proportional(11.0);
        for ms in ticks::logarithmic(*self.ms.start(), *self.ms.end()) {
            let x = self.at(ms, 0.0).x;
            painter.vline(x, self.area.y_range(), line);
            painter.text(pos2(x, self.area.bottom() + 3.0), Align2::CENTER_TOP, ticks::label(ms), font.clone(), grey);
        }
        let steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
        let step = steps.into_iter().find(|step| self.rmse / step < 8.0).unwrap_or(1.0);
        for rmse in (0..).map(|count| f64::from(count) * step).take_while(|rmse| *rmse <= self.rmse) {
            let y = self.at(1.0, rmse).y;
            painter.hline(self.area.x_range(), y, line);
            let text = format!("{rmse:.2}");
            painter.text(pos2(self.area.left() - 5.0, y), Align2::RIGHT_CENTER, text, font.clone(), grey);
        }
        painter.rect_stroke(self.area, 0.0, Stroke::new(1.0, Color32::from_gray(90)), StrokeKind::Middle);
        let below = pos2(self.area.right(), self.area.bottom() + 17.0);
        painter.text(below, Align2::RIGHT_TOP, "milliseconds (logarithmic)", font.clone(), grey);
        painter.text(self.area.left_bottom() + vec2(6.0, -5.0), Align2::LEFT_BOTTOM, "RMSE", font, grey);
    }
}

/// Draws the mark of a method.
fn mark(painter: &egui::Painter, method: Method, at: Pos2, colour: Color32) {
    let Marker { outline, filled } = method.facts().marker;
    let points: Vec<Pos2> = outline.iter().map(|&(x, y)| at + 0.8 * vec2(x as f32, y as f32)).collect();
    if filled {
        painter.add(Shape::convex_polygon(points, colour, Stroke::NONE));
    } else {
        painter.add(Shape::line(points, Stroke::new(1.3, colour)));
    }
}

/// Draws the points; tells what the one under the pointer is, and takes its settings at a click.
fn plot(viewer: &mut Viewer, ui: &mut Ui) {
    let (all, response) = ui.allocate_exact_size(vec2(SIZE[0], SIZE[1]), Sense::click());
    let area = Rect::from_min_max(all.min + vec2(MARGIN[0], 4.0), all.max - vec2(LEGEND, MARGIN[1]));
    let painter = ui.painter().with_clip_rect(all);
    painter.rect_filled(area, 0.0, Color32::from_gray(16));
    let Some((rows, asked)) = viewer.sweep.as_ref().map(|sweep| (sweep.state().rows.clone(), sweep.asked.clone()))
    else {
        Axes::of(&[], area).draw(&painter);
        let text = "Nothing has been measured yet.";
        painter.text(area.center(), Align2::CENTER_CENTER, text, FontId::proportional(14.0), Color32::from_gray(170));
        return;
    };
    let axes = Axes::of(&rows, area);
    axes.draw(&painter);
    let places: Vec<Pos2> = rows.iter().map(|row| axes.at(row.ms, row.errors.rmse)).collect();
    for (at, place) in places.iter().enumerate() {
        viewer.note(format!("sweep point {at}"), Rect::from_center_size(*place, vec2(2.0, 2.0)));
    }

    let mut front: Vec<usize> = (0..rows.len()).filter(|&at| rows[at].pareto).collect();
    front.sort_by(|&a, &b| rows[a].ms.total_cmp(&rows[b].ms));
    let line: Vec<Pos2> = front.iter().map(|&at| places[at]).collect();
    painter.add(Shape::line(line, Stroke::new(1.5, Color32::from_rgb(0, 158, 115))));
    for (row, place) in rows.iter().zip(&places) {
        let colour = if row.pareto { Color32::from_rgb(90, 220, 170) } else { Color32::from_gray(150) };
        mark(&painter, row.settings.method, *place, colour);
    }
    // A and B stand where their present settings are, if these were measured.
    let sides = viewer.sides.each_ref().map(|side| asked.measured(side));
    for (side, name) in ["A", "B"].into_iter().enumerate() {
        let Some(at) = rows.iter().position(|row| row.settings == sides[side]) else { continue };
        painter.circle_stroke(places[at], 9.0, Stroke::new(1.5, Color32::from_rgb(255, 190, 60)));
        let both = side == 1 && sides[0] == sides[1];
        let beside = places[at] + vec2(if both { 22.0 } else { 12.0 }, -10.0);
        let colour = Color32::from_rgb(255, 190, 60);
        painter.text(beside, Align2::LEFT_CENTER, name, FontId::proportional(14.0), colour);
    }
    legend(&painter, &rows, area);

    let near = |pointer: Pos2| {
        let nearest =
            (0..rows.len()).min_by(|&a, &b| places[a].distance(pointer).total_cmp(&places[b].distance(pointer)));
        nearest.filter(|&at| places[at].distance(pointer) < NEAR)
    };
    let Some(at) = response.hover_pos().and_then(near) else { return };
    let row = &rows[at];
    painter.circle_stroke(places[at], 7.0, Stroke::new(1.5, Color32::WHITE));
    if response.clicked() {
        // All rows have the radius that was asked for, as it was written.
        let radius = asked.sides[asked.tab].radius;
        // All were measured with one depth sample per pixel, which is no property of a point.
        let msaa = viewer.settings().msaa;
        viewer.sides[viewer.tab] = Settings { radius, msaa, ..row.settings.clone() };
        viewer.said = format!("{} has the settings of the point.", ["A", "B"][viewer.tab]);
    }
    let side = ["A", "B"][viewer.tab];
    response.on_hover_ui_at_pointer(|ui| {
        let words = words(&row.settings).split_whitespace().collect::<Vec<_>>().join(" ");
        ui.strong(format!("{} {}", row.settings.method.name(), words));
        ui.label(format!("{:.2} ms, {:.2} ms without the blur", row.ms, row.ao_ms));
        ui.label(format!("RMSE {:.4}, bias {:+.4}", row.errors.rmse, row.errors.bias));
        if row.reach.exits > 0.0 {
            ui.label(format!("exits early at {:.0} % of the surface", 100.0 * row.reach.exits));
        }
        ui.label(format!("A click gives these settings to {side}."));
    });
}

/// Names the marks of the methods, at the right of the plot.
fn legend(painter: &egui::Painter, rows: &[TradeRow], area: Rect) {
    let methods: Vec<Method> =
        Method::ALL.iter().copied().filter(|method| rows.iter().any(|row| row.settings.method == *method)).collect();
    let text = |at: Pos2, name: &str| {
        painter.text(at, Align2::LEFT_CENTER, name, FontId::proportional(11.0), Color32::from_gray(210));
    };
    let corner = area.right_top() + vec2(16.0, 12.0);
    for (row, method) in methods.iter().enumerate() {
        let at = corner + vec2(0.0, 15.0 * row as f32);
        mark(painter, *method, at, Color32::from_gray(190));
        text(at + vec2(12.0, 0.0), method.name());
    }
    let at = corner + vec2(0.0, 15.0 * methods.len() as f32);
    let line = [at - vec2(7.0, 0.0), at + vec2(7.0, 0.0)];
    painter.line_segment(line, Stroke::new(1.5, Color32::from_rgb(0, 158, 115)));
    text(at + vec2(12.0, 0.0), "Pareto front");
}

/// The command that makes the table.
fn command(viewer: &mut Viewer, ui: &mut Ui) {
    let mut command = match &viewer.sweep {
        Some(sweep) => sweep.asked.command(),
        None => asked(viewer).command(),
    };
    ui.horizontal_top(|ui| {
        let copy = ui.button("copy").on_hover_text("Copies the command that measures the same and writes its tables");
        viewer.note("sweep copy", copy.rect);
        if copy.clicked() {
            ui.ctx().copy_text(command.clone());
            viewer.said = "The command of the measurement was copied.".into();
        }
        let field = TextEdit::multiline(&mut command).font(FontId::proportional(11.0)).desired_rows(2);
        ui.add(field.desired_width(f32::INFINITY).interactive(false));
    });
}

/// How far a measurement is, and its points, for the log.
pub(super) fn in_json(sweep: &Sweep) -> serde_json::Value {
    let state = sweep.state();
    let point = |row: &TradeRow| json!([row.settings.to_toml(), row.ms, row.errors.rmse, row.pareto]);
    json!({
        "done": [state.done, state.total],
        "step": state.step,
        "ended": state.ended,
        "error": state.error,
        "command": sweep.asked.command(),
        "points": state.rows.iter().map(point).collect::<Vec<_>>(),
    })
}
