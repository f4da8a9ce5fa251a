//! Polygons into triangles. A fan from the first corner, as most readers have it, is wrong where a face is concave.

use earcut::Earcut;
use glam::{DVec2, DVec3};
use std::collections::HashSet;

/// Cuts the faces of a model into triangles; keeps its memory from one face to the next.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

impl Triangulator {
    pub(super) fn new() -> Triangulator {
        Triangulator { earcut: Earcut::new(), flat: Vec::new(), cut: Vec::new() }
    }

    /// The triangles of one face, as indices into its corners, wound as the face is. A face without area, or one
    /// that crosses itself so badly that no ear is found or none is looked for, becomes a fan. Fewer than three corners give nothing.
    pub(super) fn triangles(&mut self, corners: &[DVec3]) -> &[u32] {
        self.cut.clear();
        match corners.len() {
            0..3 => {}
            3 => self.cut.extend([0, 1, 2]),
            4 => {
                self.flatten(corners);
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| DVec2::from_array(self.flat[i]));
                // The diagonal from the first corner, unless a reflex corner lies off it.
                let first = (b - a).perp_dot(c - a).min((c - a).perp_dot(d - a));
                let second = (c - b).perp_dot(d - b).min((d - b).perp_dot(a - b));
                let split = if first >= 0.0 || first >= second { [0, 1, 2, 0, 2, 3] } else { [1, 2, 3, 1, 3, 0] };
                self.cut.extend(split);
            }
            n => {
                if !returns_often(corners) {
                    self.flatten(corners);
                    self.earcut.earcut_slice(&self.flat, &[], &mut self.cut);
                }
                if self.cut.is_empty() {
                    self.cut.extend((1..n as u32 - 1).flat_map(|i| [0, i, i + 1]));
                }
            }
        }
        &self.cut
    }

    /// Projects the corners along the axis the face looks along most, turned so that the face is counter-clockwise:
    /// then the ears are too.
    fn flatten(&mut self, corners: &[DVec3]) {
        // Newell's normal: also right for faces that are concave or not quite flat. Relative to the first corner, so
        // that a small face far from the origin keeps its digits.
        let origin = corners[0];
        let next = corners.iter().skip(1).chain(corners.first());
        let normal: DVec3 = corners.iter().zip(next).map(|(&a, &b)| (a - origin).cross(b - origin)).sum();
        let size = normal.abs();
        let (across, up, along) = if size.x >= size.y && size.x >= size.z {
            (DVec3::Y, DVec3::Z, normal.x)
        } else if size.y >= size.z {
            (DVec3::Z, DVec3::X, normal.y)
        } else {
            (DVec3::X, DVec3::Y, normal.z)
        };
        let across = if along < 0.0 { -across } else { across };
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&p| [(p - origin).dot(across), (p - origin).dot(up)]));
    }
}

/// Whether a large face is at each of its points more than twice on average, which no outline is, not even one that leads
/// into its holes and back. earcut would take minutes for tens of thousands of such corners.
fn returns_often(corners: &[DVec3]) -> bool {
    const SMALL: usize = 256;
    if corners.len() <= SMALL {
        return false;
    }
    let points: HashSet<[u64; 3]> = corners.iter().map(|p| (p + 0.0).to_array().map(f64::to_bits)).collect();
    2 * points.len() < corners.len()
}
