//! The image in the window: its two sides, their difference, the magnifier, and the pointer that moves the camera.

use super::anatomy;
use super::label::{divide, label};
use super::state::{Compare, UPRIGHT, Viewer, color_image};
use super::truth;
use crate::picture::Pixels;
use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};
use hbao::image::Image;
use std::f64::consts::PI;

/// Half the width of the divider's handle, in points.
const HANDLE: f32 = 6.0;
/// How many texels the magnifier shows on each side of the one under the pointer.
const AROUND: i64 = 5;
/// The size of a magnified texel, in points.
const CELL: f32 = 14.0;
/// By how much a point of the wheel makes the distance shorter.
const PER_POINT: f64 = 0.002;

/// Shows the image. Returns whether the pointer moves the camera.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) -> bool {
    let area = place(viewer, ui);
    let response = ui.interact(area, ui.scope_id().with("image"), Sense::click_and_drag());
    viewer.note("image", area);
    if response.clicked() || response.drag_started() {
        // The keys are the image's again, not a field's.
        ui.memory_mut(|memory| memory.stop_text_input());
    }
    let split = viewer.compare == Compare::Split || truth::splits(viewer);
    let handled = split && divider(viewer, ui, &response, area);
    let moving = !handled && moved(viewer, ui, &response, area);
    paint(viewer, ui, area);
    let painter = ui.painter().with_clip_rect(area);
    truth::paint(viewer, &painter, area);
    if let (true, Some(at)) = (response.clicked() && !handled, response.interact_pointer_pos()) {
        anatomy::choose(viewer, area, at);
    }
    anatomy::paint(viewer, &painter, area);
    if viewer.magnified
        && let Some(pointer) = response.hover_pos()
    {
        magnifier(viewer, ui, area, pointer);
    }
    moving
}

/// The rectangle of the image, whole pixels wide and high, and its size.
fn place(viewer: &mut Viewer, ui: &Ui) -> Rect {
    let (room, scale) = (ui.available_rect_before_wrap(), ui.ctx().pixels_per_point());
    let [left, top] = [room.min.x, room.min.y].map(|x| (x * scale).ceil());
    let [right, bottom] = [room.max.x, room.max.y].map(|x| (x * scale).floor());
    let (width, height) = ((right - left).max(1.0), (bottom - top).max(1.0));
    viewer.size = (width as u32, height as u32);
    Rect::from_min_size(pos2(left, top) / scale, vec2(width, height) / scale)
}

/// Moves the camera as the pointer says. Returns whether it did.
fn moved(viewer: &mut Viewer, ui: &Ui, response: &egui::Response, area: Rect) -> bool {
    let by = response.drag_delta();
    let [x, y] = [by.x, -by.y].map(|part| f64::from(part / area.height()));
    let shift = ui.input(|input| input.modifiers.shift);
    let dragged = |button| response.dragged_by(button) && by != Vec2::ZERO;
    let mut moving = true;
    if dragged(egui::PointerButton::Primary) && shift {
        viewer.eye.look(PI / 2.0 * x, PI / 2.0 * y);
    } else if dragged(egui::PointerButton::Primary) {
        viewer.eye.orbit(PI * x, PI * y);
    } else if dragged(egui::PointerButton::Secondary) || dragged(egui::PointerButton::Middle) {
        viewer.eye.pan(x, y);
    } else {
        moving = false;
    }
    let wheel = f64::from(ui.input(|input| input.smooth_scroll_delta().y));
    if response.hovered() && wheel != 0.0 {
        viewer.eye.zoom((-PER_POINT * wheel).exp());
        moving = true;
    }
    moving
}

/// The divider's handle. Returns whether it is being dragged.
///
/// A quick pointer leaves the handle within the frame in which the button is pressed, and the drag is then the image's
/// for egui. Where the button was pressed decides.
fn divider(viewer: &mut Viewer, ui: &Ui, image: &egui::Response, area: Rect) -> bool {
    let x = area.left() + viewer.divider * area.width();
    let handle = Rect::from_x_y_ranges(x - HANDLE..=x + HANDLE, area.y_range());
    let response = ui
        .interact(handle, ui.scope_id().with("divider"), Sense::drag())
        .on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    viewer.note("divider", handle);
    if image.drag_started_by(egui::PointerButton::Primary) {
        viewer.divider_left = ui.input(|input| input.pointer.press_origin()).is_some_and(|at| handle.contains(at));
    }
    let of_image = viewer.divider_left && image.dragged_by(egui::PointerButton::Primary);
    viewer.divider_left = of_image;
    let pointer = ui.input(|input| input.pointer.interact_pos());
    let dragged = response.dragged() || of_image;
    if let (true, Some(pointer)) = (dragged, pointer) {
        viewer.divider = ((pointer.x - area.left()) / area.width()).clamp(0.02, 0.98);
    }
    dragged
}

/// Paints the image, and in a split view the divider.
fn paint(viewer: &mut Viewer, ui: &Ui, area: Rect) {
    let painter = ui.painter().with_clip_rect(area);
    painter.rect_filled(area, 0.0, Color32::from_gray(24));
    let Some(first) = viewer.textures.first().map(|texture| texture.id()) else { return };
    let second = viewer.textures.get(1).map(|texture| texture.id());
    match (viewer.compare, second) {
        (Compare::Split, Some(second)) => {
            let x = area.left() + viewer.divider * area.width();
            painter.image(first, area, UPRIGHT, Color32::WHITE);
            let right = Rect::from_min_max(pos2(x, area.top()), area.max);
            painter.with_clip_rect(right).image(second, area, UPRIGHT, Color32::WHITE);
            divide(&painter, x, area, ["A", "B"]);
        }
        (Compare::Difference, Some(_)) => {
            if let Some(texture) = difference(viewer, ui.ctx()) {
                painter.image(texture, area, UPRIGHT, Color32::WHITE);
            }
            if let Some(text) = in_numbers(viewer) {
                label(&painter, area.left_top() + vec2(8.0, 8.0), Align2::LEFT_TOP, &text);
            }
        }
        _ => {
            painter.image(first, area, UPRIGHT, Color32::WHITE);
        }
    }
}

/// The images of the two sides, if both are there.
fn both(viewer: &Viewer) -> Option<[&Image<[u8; 3]>; 2]> {
    match viewer.drawn.as_ref()?.sides.as_slice() {
        [a, b] if a.shown.texels.len() == b.shown.texels.len() => Some([&a.shown, &b.shown]),
        _ => None,
    }
}

/// The texture of the difference, which is made when the image or the gain has changed.
fn difference(viewer: &mut Viewer, context: &egui::Context) -> Option<egui::TextureId> {
    let gain = viewer.gain;
    if let Some((of, texture)) = &viewer.difference
        && *of == gain
    {
        return Some(texture.id());
    }
    let [a, b] = both(viewer)?;
    let amplified = |(&a, &b): (&[u8; 3], &[u8; 3])| {
        [0, 1, 2].map(|channel: usize| (gain * f32::from(a[channel].abs_diff(b[channel]))).min(255.0) as u8)
    };
    let texels = a.texels.iter().zip(&b.texels).map(amplified).collect();
    let image = color_image(&Image { width: a.width, height: a.height, texels });
    let texture = context.load_texture("difference", image, egui::TextureOptions::NEAREST);
    let id = texture.id();
    viewer.difference = Some((gain, texture));
    Some(id)
}

/// How far A and B are apart.
fn in_numbers(viewer: &Viewer) -> Option<String> {
    let Some([a, b]) = both(viewer) else {
        return Some("A and B have different sizes here: they cannot be compared".into());
    };
    let apart =
        || a.texels.as_flattened().iter().zip(b.texels.as_flattened()).map(|(a, b)| f64::from(a.abs_diff(*b)) / 255.0);
    let count = (3 * a.texels.len()).max(1) as f64;
    let rmse = (apart().map(|x| x * x).sum::<f64>() / count).sqrt();
    let most = apart().fold(0.0, f64::max);
    Some(format!("A - B: RMSE {rmse:.4}, at most {most:.3}, shown x {:.0}", viewer.gain))
}

/// Shows the texels about the pointer, and their numbers.
fn magnifier(viewer: &Viewer, ui: &Ui, area: Rect, pointer: Pos2) {
    let Some(drawn) = &viewer.drawn else { return };
    let share = (pointer - area.min) / area.size();
    let names: &[&str] = if drawn.sides.len() == 2 { &["A", "B"] } else { &[""] };
    let side = CELL * (2 * AROUND + 1) as f32;
    let size = vec2(side * names.len() as f32 + 12.0 * (names.len() + 1) as f32, side + 52.0);
    // It stands aside of the pointer, on the side where there is room.
    let aside = |at: f32, size: f32, end: f32| if at + 24.0 + size < end { at + 24.0 } else { at - 24.0 - size };
    let corner = pos2(aside(pointer.x, size.x, area.right()), aside(pointer.y, size.y, area.bottom()));
    let corner = corner.max(area.min);
    let painter = ui.ctx().layer_painter(egui::LayerId::new(egui::Order::Tooltip, ui.scope_id().with("magnifier")));
    painter.rect_filled(Rect::from_min_size(corner, size), 4.0, Color32::from_black_alpha(230));
    for (at, (name, image)) in names.iter().zip(&drawn.sides).enumerate() {
        let shown = &image.shown;
        let [x, y] = [(share.x, shown.width), (1.0 - share.y, shown.height)]
            .map(|(share, size)| ((share * size as f32) as i64).clamp(0, size as i64 - 1));
        let from = corner + vec2(12.0 + at as f32 * (side + 12.0), 44.0);
        for row in -AROUND..=AROUND {
            for column in -AROUND..=AROUND {
                let Some(colour) = texel(shown, x + column, y - row) else { continue };
                let cell = from + vec2((column + AROUND) as f32, (row + AROUND) as f32) * CELL;
                let [r, g, b] = colour;
                painter.rect_filled(Rect::from_min_size(cell, Vec2::splat(CELL)), 0.0, Color32::from_rgb(r, g, b));
            }
        }
        let middle = Rect::from_min_size(from + Vec2::splat(AROUND as f32 * CELL), Vec2::splat(CELL));
        painter.rect_stroke(middle, 0.0, Stroke::new(1.5, Color32::from_rgb(255, 80, 60)), StrokeKind::Outside);
        let text = format!("{name} {}", value(&image.pixels, shown.width, x, y));
        painter.text(from - vec2(0.0, 20.0), Align2::LEFT_TOP, text.trim(), FontId::monospace(12.0), Color32::WHITE);
        if at == 0 {
            let traced = viewer.truth.refined.as_ref().map(|refined| &refined.visibility);
            let traced = traced.filter(|truth| (truth.width, truth.height) == (shown.width, shown.height));
            let traced = traced.map(|truth| format!(", truth {:.4}", truth.at(x as usize, y as usize)));
            let top = shown.height as i64 - 1 - y;
            let place = format!("x {x}, y {top}{}", traced.unwrap_or_else(|| " from the top left".into()));
            painter.text(
                from - vec2(0.0, 38.0),
                Align2::LEFT_TOP,
                place,
                FontId::proportional(12.0),
                Color32::LIGHT_GRAY,
            );
        }
    }
}

/// The colour of a texel, if there is one at this place.
fn texel(image: &Image<[u8; 3]>, x: i64, y: i64) -> Option<[u8; 3]> {
    let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
    if x < image.width && y < image.height { Some(image.texels[y * image.width + x]) } else { None }
}

/// The numbers of a texel that exists.
fn value(pixels: &Pixels, width: usize, x: i64, y: i64) -> String {
    pixels.in_words(y as usize * width + x as usize).unwrap_or_default()
}
