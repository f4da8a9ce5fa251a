//! A sheet on which a diagram is drawn as SVG. Places are given in the diagram's own plane, with y up. What leaves the
//! frame is cut off, and labels are moved until none covers another.
//!
//! The SVG has no identifiers and no links, so that many of them can stand in one page, and brings its own paper, so
//! that it is legible on light and dark backgrounds.

use glam::{DVec2, dvec2};
use maud::html;
use std::f64::consts::TAU;

const STYLE: &str = include_str!("style.css");

/// The size of the text, as in the style sheet.
const TEXT: f64 = 14.0;
/// The width of a character, as a part of the size of the text. It is that of a wide font.
const CHARACTER: f64 = 0.6;
/// The least distance of labels from the frame and from each other, in pixels.
const MARGIN: f64 = 5.0;

/// A label that is placed when the drawing is finished.
struct Label {
    at: DVec2,
    text: String,
    towards: f64,
}

/// A rectangle, given by its middle and half its size.
#[derive(Clone, Copy)]
struct Area {
    middle: DVec2,
    half: DVec2,
}

impl Area {
    fn holds(self, point: DVec2, margin: f64) -> bool {
        (point - self.middle).abs().cmplt(self.half + margin).all()
    }

    fn meets(self, other: Area, margin: f64) -> bool {
        (other.middle - self.middle).abs().cmplt(self.half + other.half + margin).all()
    }
}

/// The sheet.
pub(super) struct Canvas {
    size: DVec2,
    /// The place of the plane's origin on the sheet, in pixels from the upper left corner.
    origin: DVec2,
    /// The number of pixels of one unit of the plane.
    scale: f64,
    shapes: String,
    labels: Vec<Label>,
    /// Points of lines, and marks, both in pixels. Labels avoid them.
    lines: Vec<DVec2>,
    marks: Vec<DVec2>,
}

impl Canvas {
    /// Makes a sheet of so many pixels that shows at least the plane's rectangle from `low` to `high`.
    pub(super) fn new(width: f64, height: f64, low: DVec2, high: DVec2) -> Canvas {
        let size = dvec2(width, height);
        let scale = (size / (high - low)).min_element();
        let middle = (low + high) / 2.0;
        let origin = size / 2.0 - scale * dvec2(middle.x, -middle.y);
        let shapes = html! { rect class="dg-paper" width=(width) height=(height) {} }.into_string();
        Canvas { size, origin, scale, shapes, labels: Vec::new(), lines: Vec::new(), marks: Vec::new() }
    }

    /// Returns the length of so many pixels in the plane.
    pub(super) fn pixels(&self, count: f64) -> f64 {
        count / self.scale
    }

    /// Returns the lower left and the upper right corner of what the sheet shows.
    pub(super) fn corners(&self) -> [DVec2; 2] {
        [dvec2(0.0, self.size.y), dvec2(self.size.x, 0.0)].map(|corner| {
            let from_origin = (corner - self.origin) / self.scale;
            dvec2(from_origin.x, -from_origin.y)
        })
    }

    fn place(&self, at: DVec2) -> DVec2 {
        self.origin + self.scale * dvec2(at.x, -at.y)
    }

    /// Draws a line through points.
    pub(super) fn path(&mut self, class: &str, points: &[DVec2]) {
        let mut data = String::new();
        let mut end = None;
        for two in points.windows(2) {
            let Some([from, to]) = clipped(self.place(two[0]), self.place(two[1]), self.size) else { continue };
            if end != Some(from) {
                data += &format!("M{:.1} {:.1}", from.x, from.y);
            }
            data += &format!("L{:.1} {:.1}", to.x, to.y);
            end = Some(to);
            let count = (from.distance(to) / 6.0).ceil();
            self.lines.extend((0..=count as u32).map(|i| from.lerp(to, f64::from(i) / count.max(1.0))));
        }
        if !data.is_empty() {
            self.shapes += &html! { path class=(class) d=(data) {} }.into_string();
        }
    }

    /// Draws a line from one point to another.
    pub(super) fn line(&mut self, class: &str, from: DVec2, to: DVec2) {
        self.path(class, &[from, to]);
    }

    /// Fills the area inside an outline.
    pub(super) fn area(&mut self, class: &str, outline: &[DVec2]) {
        let mut corners: Vec<DVec2> = outline.iter().map(|&at| self.place(at)).collect();
        // One edge of the frame after the other cuts off what lies beyond it.
        for (axis, limit, sign) in [(0, 0.0, 1.0), (0, self.size.x, -1.0), (1, 0.0, 1.0), (1, self.size.y, -1.0)] {
            let inside = |p: DVec2| sign * (p[axis] - limit);
            let mut kept = Vec::new();
            for (i, &a) in corners.iter().enumerate() {
                let b = corners[(i + 1) % corners.len()];
                let (from, to) = (inside(a), inside(b));
                if from >= 0.0 {
                    kept.push(a);
                }
                if (from >= 0.0) != (to >= 0.0) {
                    kept.push(a.lerp(b, from / (from - to)));
                }
            }
            corners = kept;
        }
        let points: Vec<String> = corners.iter().map(|p| format!("{:.1},{:.1}", p.x, p.y)).collect();
        if points.len() > 2 {
            self.shapes += &html! { polygon class=(class) points=(points.join(" ")) {} }.into_string();
        }
    }

    /// Draws a line that ends in an arrowhead.
    pub(super) fn arrow(&mut self, class: &str, from: DVec2, to: DVec2) {
        self.line(class, from, to);
        let along = (to - from).normalize_or_zero() * self.pixels(10.0);
        let back = to - along;
        let side = along.perp() * 0.4;
        let mark = class.split(' ').next().unwrap_or_default().replace("dg-ink", "dg-mark");
        let mark =
            ["blue", "red", "green"].iter().fold(mark, |m, c| m.replace(&format!("dg-{c}"), &format!("dg-mark-{c}")));
        self.area(&mark, &[to, back + side, back - side]);
    }

    /// Draws an arc about a point, from one angle to another, in radians from the x axis.
    pub(super) fn arc(&mut self, class: &str, about: DVec2, radius: f64, from: f64, to: f64) {
        let count = ((to - from).abs() / 0.05).ceil().max(2.0) as u32;
        let angle = |i: u32| from + (to - from) * f64::from(i) / f64::from(count);
        let points: Vec<DVec2> = (0..=count).map(|i| about + radius * DVec2::from_angle(angle(i))).collect();
        self.path(class, &points);
    }

    /// Draws a circle.
    pub(super) fn circle(&mut self, class: &str, about: DVec2, radius: f64) {
        self.arc(class, about, radius, 0.0, TAU);
    }

    /// Draws a dot of so many pixels. Dots outside the frame are left out.
    pub(super) fn dot(&mut self, class: &str, at: DVec2, radius: f64) {
        let at = self.place(at);
        if at.cmpge(DVec2::ZERO).all() && at.cmple(self.size).all() {
            self.marks.push(at);
            let [x, y] = [at.x, at.y].map(|c| format!("{c:.1}"));
            self.shapes += &html! { circle class=(class) cx=(x) cy=(y) r=(radius) {} }.into_string();
        }
    }

    /// Writes a label near a point, if possible in the direction `towards`, in degrees from the x axis.
    pub(super) fn label(&mut self, at: DVec2, towards: f64, text: impl Into<String>) {
        self.labels.push(Label { at: self.place(at), text: text.into(), towards: towards.to_radians() });
    }

    /// Returns the SVG.
    pub(super) fn finish(mut self) -> String {
        let mut placed: Vec<Area> = Vec::new();
        let mut texts = String::new();
        for label in std::mem::take(&mut self.labels) {
            let area = self.free(&label, &placed);
            placed.push(area);
            // A label that lies far from its point is tied to it.
            let near = label.at.clamp(area.middle - area.half, area.middle + area.half);
            if near.distance(label.at) > 22.0 {
                let end = label.at.lerp(near, 0.12);
                let data = format!("M{:.1} {:.1}L{:.1} {:.1}", end.x, end.y, near.x, near.y);
                self.shapes += &html! { path class="dg-thin" d=(data) {} }.into_string();
            }
            let [x, y] = [area.middle.x, area.middle.y + 0.36 * TEXT].map(|c| format!("{c:.1}"));
            texts += &html! { text class="dg-text" x=(x) y=(y) { (label.text) } }.into_string();
        }
        let DVec2 { x, y } = self.size;
        let frame = html! { rect class="dg-frame" x="0.5" y="0.5" width=(x - 1.0) height=(y - 1.0) {} }.into_string();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"diagram\" width=\"{x}\" height=\"{y}\" \
             viewBox=\"0 0 {x} {y}\"><style>{STYLE}</style>{}{frame}{texts}</svg>\n",
            self.shapes
        )
    }

    /// Returns the best place for a label beside those that are placed.
    fn free(&self, label: &Label, placed: &[Area]) -> Area {
        let half = dvec2(label.text.chars().count() as f64 * TEXT * CHARACTER, TEXT * 1.15) / 2.0;
        let mut best = (f64::INFINITY, Area { middle: self.size / 2.0, half });
        for ring in 0..24 {
            let distance = 7.0 + 9.0 * f64::from(ring);
            for turn in 0..24 {
                let angle = label.towards + TAU * f64::from(turn) / 24.0;
                let away = DVec2::from_angle(-angle);
                // The side of the label that faces the point lies at the distance.
                let limit = self.size - half - MARGIN;
                let wanted = label.at + away * distance + half * away;
                let middle = wanted.clamp(half + MARGIN, limit.max(half + MARGIN));
                let area = Area { middle, half };
                let count = |points: &[DVec2], margin| points.iter().filter(|&&p| area.holds(p, margin)).count() as f64;
                let covered = placed.iter().filter(|other| area.meets(**other, MARGIN)).count() as f64;
                let turned = f64::from(turn.min(24 - turn));
                let cost = 1e4 * covered
                    + 150.0 * count(&self.marks, 4.0)
                    + 7.0 * count(&self.lines, 1.0)
                    + middle.distance(wanted)
                    + 1.2 * distance
                    + 1.5 * turned;
                if cost < best.0 {
                    best = (cost, area);
                }
            }
        }
        best.1
    }
}

/// Returns the part of a line that lies between the sheet's corners (0, 0) and `size`.
fn clipped(from: DVec2, to: DVec2, size: DVec2) -> Option<[DVec2; 2]> {
    let way = to - from;
    let (mut start, mut end) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        for (room, speed) in [(from[axis], -way[axis]), (size[axis] - from[axis], way[axis])] {
            if speed == 0.0 && room < 0.0 {
                return None;
            }
            if speed > 0.0 {
                end = end.min(room / speed);
            } else if speed < 0.0 {
                start = start.max(room / speed);
            }
        }
    }
    // Whole lines keep their exact ends, so that the next one joins them.
    let at = |t: f64| {
        if t == 0.0 {
            from
        } else if t == 1.0 {
            to
        } else {
            from + t * way
        }
    };
    (start <= end).then(|| [at(start), at(end)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_at_the_frame() {
        let size = dvec2(10.0, 10.0);
        assert_eq!(clipped(dvec2(1.0, 2.0), dvec2(3.0, 4.0), size), Some([dvec2(1.0, 2.0), dvec2(3.0, 4.0)]));
        assert_eq!(clipped(dvec2(-5.0, 5.0), dvec2(15.0, 5.0), size), Some([dvec2(0.0, 5.0), dvec2(10.0, 5.0)]));
        assert_eq!(clipped(dvec2(-5.0, -1.0), dvec2(15.0, -1.0), size), None);
        assert_eq!(clipped(dvec2(-2.0, 5.0), dvec2(-2.0, 6.0), size), None);
        assert_eq!(clipped(dvec2(-3.0, 9.0), dvec2(3.0, 15.0), size), None);
    }

    #[test]
    fn labels_do_not_cover_each_other_even_where_all_name_one_point() {
        let mut canvas = Canvas::new(400.0, 300.0, dvec2(-1.0, -1.0), dvec2(1.0, 1.0));
        for i in 0..12 {
            canvas.label(DVec2::ONE, 0.0, format!("label {i}"));
        }
        let labels: Vec<Label> = std::mem::take(&mut canvas.labels);
        let mut placed: Vec<Area> = Vec::new();
        for label in &labels {
            let area = canvas.free(label, &placed);
            assert!((area.middle - area.half).cmpge(DVec2::ZERO).all());
            assert!((area.middle + area.half).cmple(canvas.size).all());
            assert!(placed.iter().all(|other| !area.meets(*other, 0.0)), "{}", label.text);
            placed.push(area);
        }
    }
}
