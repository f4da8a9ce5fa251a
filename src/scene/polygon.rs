//! Polygons into triangles. A fan from the first corner, as most readers have it, is wrong where a face is concave.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Corners of the largest face in which ears are looked for. earcut takes up to the cube of their number where an
/// outline crosses itself or returns to nearly the same points: 20 ms for 512 such corners, minutes for 16,000. Up to
/// here a file costs at most some 10 microseconds for each of its bytes, however many such faces it holds.
const MOST_EARS: usize = 512;

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

    /// The triangles of one face, as indices into its corners, wound as the face is. A face of more than [`MOST_EARS`]
    /// corners is cut in half again and again, which is right where it is convex; so is a face without area, or one
    /// that crosses itself so badly that no ear is found. Fewer than three corners give nothing.
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
                if n <= MOST_EARS {
                    self.flatten(corners);
                    self.earcut.earcut_slice(&self.flat, &[], &mut self.cut);
                }
                if self.cut.is_empty() {
                    self.halve(n as u32);
                }
            }
        }
        &self.cut
    }

    /// Cuts a face of `n` corners as if it were convex. In a fan all triangles would lie upon each other, and a
    /// hierarchy of boxes about them be as deep as they are many.
    fn halve(&mut self, n: u32) {
        let mut open = vec![(0, n - 1)];
        while let Some((first, last)) = open.pop() {
            if last - first >= 2 {
                let middle = u32::midpoint(first, last);
                self.cut.extend([first, middle, last]);
                open.extend([(middle, last), (first, middle)]);
            }
        }
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
