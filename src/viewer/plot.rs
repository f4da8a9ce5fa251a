//! Draws the slice of a pixel: the surface, the tangent, the horizon and the samples, as Figures 6.2.5 to 6.2.9 of the
//! chapter do.

use super::knobs::short;
use super::section::{Cut, Kind};
use eframe::egui::{
    self, Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Sense, Shape, Stroke, StrokeKind, Ui, pos2, vec2,
};
use glam::{DVec2, dvec2};

pub(super) const RED: Color32 = Color32::from_rgb(255, 96, 80);
pub(super) const BLUE: Color32 = Color32::from_rgb(100, 180, 255);
const ORANGE: Color32 = Color32::from_rgb(255, 180, 40);
const GREY: Color32 = Color32::from_gray(150);
const GREEN: Color32 = Color32::from_rgb(120, 220, 120);

/// What is shown of the slice, in units of R: from the left and the bottom to the right and the top.
const SHEET: [DVec2; 2] = [dvec2(-0.75, -0.65), dvec2(1.55, 1.15)];

/// Draws the mark of a sample. `size` is half its width, in points.
pub(super) fn mark(painter: &Painter, at: Pos2, size: f32, kind: Kind) {
    match kind {
        Kind::Occludes => {
            painter.circle(at, size, RED, Stroke::new(1.0, Color32::BLACK));
        }
        Kind::Open => {
            painter.circle_stroke(at, size, Stroke::new(3.0, Color32::BLACK));
            painter.circle_stroke(at, size, Stroke::new(1.5, BLUE));
        }
        Kind::Beyond => {
            for (width, colour) in [(3.5, Color32::BLACK), (1.8, ORANGE)] {
                for [a, b] in [[vec2(-size, -size), vec2(size, size)], [vec2(-size, size), vec2(size, -size)]] {
                    painter.line_segment([at + a, at + b], Stroke::new(width, colour));
                }
            }
        }
        Kind::Ignored => {
            let square = Rect::from_center_size(at, vec2(1.3, 1.3) * size);
            painter.rect(square, 0.0, GREY, Stroke::new(1.0, Color32::BLACK), StrokeKind::Outside);
        }
    }
}

/// A row that says what a mark means.
pub(super) fn legend(ui: &mut Ui, kind: Kind, text: &str) {
    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 16.0), Sense::hover());
    mark(ui.painter(), rect.center(), 4.5, kind);
    ui.label(text);
}

/// A row that says what a line means.
pub(super) fn legend_line(ui: &mut Ui, colour: Color32, text: &str) {
    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 16.0), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.0, colour));
    ui.label(text);
}

/// Writes an angle, given by its sine, in degrees.
pub(super) fn degrees(sine: f64) -> String {
    format!("{}°", rounded(sine.clamp(-1.0, 1.0).asin().to_degrees(), 1))
}

/// Writes a number with so many places, without the sign of a zero.
pub(super) fn rounded(value: f64, places: usize) -> String {
    let text = format!("{value:.places$}");
    if text.parse() == Ok(0.0) { text.trim_start_matches('-').into() } else { text }
}

/// Draws the slice, and returns where.
pub(super) fn show(ui: &mut Ui, cut: &Cut, radius: f64) -> Rect {
    let width = ui.available_width();
    let height = width * ((SHEET[1].y - SHEET[0].y) / (SHEET[1].x - SHEET[0].x)) as f32;
    let (rect, _) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 2.0, Color32::from_gray(18));
    let unit = f64::from(width) / (SHEET[1].x - SHEET[0].x);
    let at = |point: DVec2| {
        let [right, down] = [(point.x - SHEET[0].x) * unit, (SHEET[1].y - point.y) * unit];
        rect.min + vec2(right as f32, down as f32)
    };
    surface(&painter, cut, &at);
    let axis = Stroke::new(1.0, Color32::from_gray(90));
    painter.hline(rect.x_range(), at(DVec2::ZERO).y, axis);
    painter.vline(at(DVec2::ZERO).x, rect.y_range(), axis);
    painter.circle_stroke(at(DVec2::ZERO), unit as f32, Stroke::new(1.0, Color32::from_gray(140)));

    let slice = &cut.slice;
    let [t, h] = [slice.sin_t, slice.sin_h()].map(|sine| sine.clamp(-1.0, 1.0).asin());
    if h > t {
        let arc = (0..=24).map(|i| at(DVec2::from_angle(t + (h - t) * f64::from(i) / 24.0)));
        let wedge = [at(DVec2::ZERO)].into_iter().chain(arc).collect();
        painter.add(Shape::convex_polygon(wedge, Color32::from_rgba_unmultiplied(255, 96, 80, 38), Stroke::NONE));
    }
    let far = |angle: f64| at(1.35 * DVec2::from_angle(angle));
    painter.line_segment([at(DVec2::ZERO), far(t)], Stroke::new(2.0, BLUE));
    painter.line_segment([at(DVec2::ZERO), far(h)], Stroke::new(2.0, RED));
    for (point, sample) in &cut.samples {
        mark(&painter, at(*point), 4.5, Kind::of(sample.fate));
        let number = at(*point) + vec2(6.0, -6.0);
        painter.text(number, Align2::LEFT_BOTTOM, sample.index, FontId::proportional(11.0), Color32::WHITE);
    }
    painter.circle_filled(at(DVec2::ZERO), 4.0, Color32::WHITE);

    let font = FontId::proportional(12.0);
    let mut taken = Rect::NOTHING;
    let mut text = |place: Pos2, align, text: String, colour| {
        let galley = painter.layout_no_wrap(text, font.clone(), colour);
        let mut place = align_in(rect, align, place, galley.size());
        if place.expand(2.0).intersects(taken) {
            place = place.translate(vec2(taken.left() - 6.0 - place.right(), 0.0));
        }
        taken = place;
        painter.rect_filled(place.expand(1.5), 2.0, Color32::from_black_alpha(170));
        painter.galley(place.min, galley, colour);
    };
    text(at(DVec2::ZERO) + vec2(-6.0, 6.0), Align2::RIGHT_TOP, "P".into(), Color32::WHITE);
    text(
        at(DVec2::from_angle(-0.35)) + vec2(3.0, 0.0),
        Align2::LEFT_TOP,
        format!("R = {}", short(radius)),
        Color32::from_gray(190),
    );
    text(far(t) + vec2(4.0, 0.0), Align2::LEFT_CENTER, format!("t = {}", degrees(slice.sin_t)), BLUE);
    text(far(h) + vec2(4.0, 0.0), Align2::LEFT_CENTER, format!("h = {}", degrees(slice.sin_h())), RED);
    text(rect.left_top() + vec2(4.0, 3.0), Align2::LEFT_TOP, "towards the eye".into(), Color32::from_gray(190));
    text(
        rect.right_bottom() - vec2(4.0, 3.0),
        Align2::RIGHT_BOTTOM,
        "along the direction".into(),
        Color32::from_gray(190),
    );
    rect
}

/// Where a text of this size stands, moved into the sheet if it would leave it.
fn align_in(sheet: Rect, align: Align2, place: Pos2, size: egui::Vec2) -> Rect {
    let rect = align.anchor_size(place, size);
    let inside = sheet.shrink(3.0);
    let low = rect.min.max(inside.min).min(pos2(inside.max.x - size.x, inside.max.y - size.y));
    Rect::from_min_size(low, size)
}

/// Fills what lies behind the surface, as seen from the eye, and draws the surface.
fn surface(painter: &Painter, cut: &Cut, at: &dyn Fn(DVec2) -> Pos2) {
    for part in &cut.surface {
        let mut mesh = Mesh::default();
        for (i, points) in part.iter().enumerate() {
            points.iter().for_each(|&point| mesh.colored_vertex(at(point), Color32::from_gray(62)));
            let first = 2 * i as u32;
            if i + 1 < part.len() {
                mesh.add_triangle(first, first + 1, first + 2);
                mesh.add_triangle(first + 1, first + 2, first + 3);
            }
        }
        painter.add(Shape::mesh(mesh));
    }
    for part in &cut.surface {
        let line = part.iter().map(|[point, _]| at(*point)).collect();
        painter.add(Shape::line(line, Stroke::new(1.5, GREEN)));
    }
}

/// The colour of the line of the surface.
pub(super) const SURFACE: Color32 = GREEN;
