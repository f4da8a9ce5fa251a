//! Text over the image.

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, pos2};

/// Light text on a dark ground, which can be read on every image. Returns where it stands.
pub(super) fn label(painter: &Painter, at: Pos2, align: Align2, text: &str) -> Rect {
    let text = painter.layout_no_wrap(text.into(), FontId::proportional(15.0), Color32::WHITE);
    let rect = align.anchor_size(at, text.size());
    painter.rect_filled(rect.expand(4.0), 3.0, Color32::from_black_alpha(190));
    painter.galley(rect.min, text, Color32::WHITE);
    rect
}

/// The divider between two images, with the names of both.
pub(super) fn divide(painter: &Painter, x: f32, area: Rect, [left, right]: [&str; 2]) {
    painter.vline(x, area.y_range(), Stroke::new(3.0, Color32::BLACK));
    painter.vline(x, area.y_range(), Stroke::new(1.0, Color32::WHITE));
    for (name, align, at) in [(left, Align2::RIGHT_TOP, x - 8.0), (right, Align2::LEFT_TOP, x + 8.0)] {
        label(painter, pos2(at, area.top() + 8.0), align, name);
    }
}
