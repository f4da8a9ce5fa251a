//! The window that shows what the images cost: a graph of the times of passes over the last frames, memory on the GPU,
//! and samples.

use super::costs::{Costs, FRAMES, Frame, bytes};
use super::state::Viewer;
use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, RichText, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

/// The size of a graph, in points.
const WIDTH: f32 = 330.0;
const HEIGHT: f32 = 96.0;

/// The colours of passes, in the order in which the passes run. They are told apart in grey by their order.
const COLOURS: [Color32; 9] = [
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(0, 114, 178),
    Color32::from_rgb(230, 159, 0),
    Color32::from_rgb(213, 94, 0),
    Color32::from_rgb(0, 158, 115),
    Color32::from_rgb(240, 228, 66),
    Color32::from_rgb(204, 121, 167),
    Color32::from_rgb(150, 150, 150),
    Color32::from_rgb(150, 110, 70),
];

/// Returns the colour of a pass.
pub(super) fn colour(costs: &Costs, pass: &str) -> Color32 {
    let at = costs.passes.iter().position(|known| *known == pass).unwrap_or(0);
    COLOURS[at % COLOURS.len()]
}

/// Shows the window with the graph, while passes are timed.
pub(super) fn show(viewer: &mut Viewer, context: &egui::Context) {
    if !viewer.timed || viewer.drawn.is_none() {
        return;
    }
    let mut shown = true;
    let window = egui::Window::new("Costs").resizable(false).default_width(WIDTH);
    let corner = context.content_rect().left_bottom() + vec2(12.0, -36.0);
    window.pivot(Align2::LEFT_BOTTOM).default_pos(corner).open(&mut shown).show(context, |ui| {
        ui.set_width(WIDTH);
        held(viewer, ui);
        for side in [0, 1] {
            if viewer.costs.frames.iter().any(|frame| frame.sides.iter().any(|(of, _)| *of == side)) {
                graph(viewer, ui, side);
            }
        }
        legend(&viewer.costs, ui);
        ui.horizontal(|ui| {
            ui.label("Times by");
            for (by_gpu, name, help) in [
                (false, "clock", "The system's clock, from one glFinish to the next"),
                (true, "GPU", "The driver's timer, where it has one; otherwise the clock"),
            ] {
                let button = ui.selectable_value(&mut viewer.costs.by_gpu, by_gpu, name).on_hover_text(help);
                viewer.note(format!("times by {name}"), button.rect);
            }
        });
    });
    viewer.timed = shown;
}

/// Shows the memory and the samples of each side.
fn held(viewer: &Viewer, ui: &mut Ui) {
    let Some(drawn) = &viewer.drawn else { return };
    let names: &[&str] = match (drawn.sides.len(), viewer.tab) {
        (1, 0) => &["A"],
        (1, _) => &["B"],
        _ => &["A", "B"],
    };
    let help = "What the textures, renderbuffers and triangles of this image take on the GPU, as their formats and sizes \
                say. A driver may take more";
    for ((name, side), settings) in names.iter().zip(&drawn.sides).zip(&drawn.job.sides) {
        let samples = settings.method.samples(settings);
        let (textures, triangles) = (bytes(side.texture_bytes), bytes(side.triangle_bytes));
        let text = format!("{name}: textures {textures}, triangles {triangles}, {samples} samples a pixel");
        ui.label(RichText::new(text).size(11.5)).on_hover_text(help);
    }
}

/// Names the colours of the passes in the graphs.
fn legend(costs: &Costs, ui: &mut Ui) {
    let times = || costs.frames.iter().flat_map(|frame| &frame.sides).flat_map(|(_, times)| times);
    let shown = costs.passes.iter().filter(|pass| times().any(|time| time.name == **pass));
    egui::Grid::new("colours of passes").spacing([14.0, 1.0]).show(ui, |ui| {
        for (at, pass) in shown.enumerate() {
            ui.horizontal(|ui| {
                swatch(ui, colour(costs, pass));
                ui.label(RichText::new(*pass).size(11.5));
            });
            if at % 3 == 2 {
                ui.end_row();
            }
        }
    });
}

/// Draws the passes of one side over the last frames, on top of each other, with a line for the whole frame.
fn graph(viewer: &mut Viewer, ui: &mut Ui, side: usize) {
    let (area, response) = ui.allocate_exact_size(vec2(WIDTH, HEIGHT), Sense::hover());
    viewer.note(["graph A", "graph B"][side], area);
    let costs = &viewer.costs;
    let passes = |frame: &Frame| -> Vec<(&'static str, f64)> {
        let of = frame.sides.iter().find(|(of, _)| *of == side);
        of.into_iter().flat_map(|(_, times)| times).map(|time| (time.name, costs.ms(time))).collect()
    };
    let frames: Vec<&Frame> =
        costs.frames.iter().filter(|frame| frame.sides.iter().any(|(of, _)| *of == side)).collect();
    // Both graphs have the same height for the same time.
    let most = costs.frames.iter().map(|frame| frame.ms).fold(0.1, f64::max);
    let painter = ui.painter().with_clip_rect(area);
    painter.rect_filled(area, 2.0, Color32::from_gray(18));
    let width = area.width() / frames.len().clamp(FRAMES / 4, FRAMES) as f32;
    let height = |ms: f64| (ms / most) as f32 * (area.height() - 16.0);
    let left = |at: usize| area.right() - (frames.len() - at) as f32 * width;
    for (at, frame) in frames.iter().enumerate() {
        let mut from = area.bottom();
        // A frame of fewer pixels is paler.
        let pale = if frame.divisor > 1 { 0.45 } else { 1.0 };
        for (pass, ms) in passes(frame) {
            let bar = Rect::from_min_max(pos2(left(at), from - height(ms)), pos2(left(at) + width, from));
            painter.rect_filled(bar, 0.0, colour(costs, pass).gamma_multiply(pale));
            from = bar.top();
        }
    }
    let top = |(at, frame): (usize, &&Frame)| pos2(left(at) + width / 2.0, area.bottom() - height(frame.ms));
    painter.line(frames.iter().enumerate().map(top).collect(), Stroke::new(1.0, Color32::WHITE));
    painter.rect_stroke(area, 2.0, Stroke::new(1.0, Color32::from_gray(70)), StrokeKind::Inside);
    let text = |at: Pos2, align, text: String| {
        painter.text(at, align, text, FontId::proportional(11.0), Color32::from_gray(210));
    };
    let last = frames.last().map_or(0.0, |frame| passes(frame).iter().map(|(_, ms)| ms).sum());
    text(area.left_top() + vec2(5.0, 2.0), Align2::LEFT_TOP, format!("{}: {last:.1} ms", ["A", "B"][side]));
    let what = format!("white: the whole frame; top: {most:.1} ms");
    text(area.right_top() + vec2(-5.0, 2.0), Align2::RIGHT_TOP, what);

    let hovered = response.hover_pos().map(|at| ((at.x - left(0)) / width).floor());
    let Some(frame) = hovered.filter(|at| *at >= 0.0).and_then(|at| frames.get(at as usize)) else { return };
    response.clone().on_hover_ui_at_pointer(|ui| {
        let divided = if frame.divisor > 1 { format!(", 1/{} of the size", frame.divisor) } else { String::new() };
        ui.strong(format!("frame {:.2} ms{divided}", frame.ms));
        for (pass, ms) in passes(frame) {
            ui.horizontal(|ui| {
                swatch(ui, colour(costs, pass));
                ui.label(format!("{pass} {ms:.2} ms"));
            });
        }
    });
}

/// A small square of a pass's colour.
pub(super) fn swatch(ui: &mut Ui, colour: Color32) {
    let (area, _) = ui.allocate_exact_size(egui::Vec2::splat(10.0), Sense::hover());
    ui.painter().rect_filled(area, 1.0, colour);
}
