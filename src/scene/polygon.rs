//! Divides polygons into triangles by ear clipping. Most readers make a fan of triangles from the first corner instead,
//! which is wrong for concave faces.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// The most corners of a face. Faces with more are refused.
pub(super) const MOST_CORNERS: usize = 1 << 16;

/// The most corners of a face that is divided by ear clipping. The time that earcut takes grows with up to the cube of
/// the number of corners if the outline crosses itself or returns to nearly the same points: it is 20 ms for 512 such
/// corners, and minutes for 16,000. With this limit a file costs at most some 10 microseconds for each of its bytes,
/// however many such faces it holds.
const MOST_EARS: usize = 512;

/// Divides the faces of a model into triangles. It keeps its memory from one face to the next.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

impl Triangulator {
    pub(super) fn new() -> Triangulator {
        Triangulator { earcut: Earcut::new(), flat: Vec::new(), cut: Vec::new() }
    }

    /// Divides one face into triangles, three indices into `corners` for each, wound as the face is. Fewer than three
    /// corners give no triangle.
    ///
    /// A face of more than [`MOST_EARS`] corners is divided as if it were convex. So is a face in which earcut finds no
    /// ear, because it has no area or crosses itself too badly.
    pub(super) fn triangles(&mut self, corners: &[DVec3]) -> &[u32] {
        self.cut.clear();
        match corners.len() {
            0..3 => {}
            3 => self.cut.extend([0, 1, 2]),
            4 => {
                self.flatten(corners);
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| DVec2::from_array(self.flat[i]));
                // The quadrilateral is divided along the diagonal from its first corner, unless that runs outside,
                // which it does if the second or the fourth corner is reflex.
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

    /// Divides a face of `n` corners as if it were convex. The first, middle and last corner of a run of corners make a
    /// triangle; the two halves of the run are then divided in the same way. This is done instead of a fan because the
    /// bounding boxes of a fan's triangles all overlap at its centre, so that a bounding volume hierarchy about them
    /// would be as deep as there are triangles.
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

    /// Projects the corners along the coordinate axis that is closest to the face's normal. The projection is mirrored
    /// if needed to make the face counter-clockwise; earcut's triangles are then wound as the face is.
    fn flatten(&mut self, corners: &[DVec3]) {
        // Newell's method gives the right normal for faces that are concave or not quite flat, too. Positions are taken
        // relative to the first corner, so that a small face far from the origin keeps its precision.
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
