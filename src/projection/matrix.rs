//! Reads the projection matrix of an engine.

use super::{Extents, Hand, Projection};
use crate::Error;

/// What a projection matrix says. The matrix leads from eye space to clip space: x and y of the picture go from -w to
/// w, left to right and bottom to top.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ProjectionMatrix {
    /// The projection, in left-handed eye space, to which the matrix's own eye space is turned if it is right-handed.
    pub projection: Projection,
    /// The hand of the eye space that the matrix leads from. A perspective matrix tells it by the sign of w; `None` for
    /// an orthographic matrix, which does not tell it.
    pub hand: Option<Hand>,
    /// The matrix's third row, which makes the depth buffer, as a and b: in perspective the depth z/w in clip space of
    /// a point at the distance z in front of the eye is a + b / z; in an orthographic view it is a + b z for the z of
    /// the matrix's own eye space. It does not matter here whether z/w is from -1 or from 0 on, whether it is reversed,
    /// and whether the far plane is infinitely far.
    pub depth: [f64; 2],
}

/// Entries that should be 0 may differ from it by this share of the entry that they are compared with. Matrices that
/// were multiplied or inverted in float32 have such errors.
const ROUNDING: f64 = 1e-6;

impl Projection {
    /// Returns the projection of a projection matrix that an engine has. [`ProjectionMatrix::read`] says which matrices
    /// it takes, and tells more of them.
    ///
    /// # Errors
    /// The same as for [`ProjectionMatrix::read`].
    pub fn from_matrix(columns: &[f32; 16]) -> Result<Projection, Error> {
        Ok(ProjectionMatrix::read(columns)?.projection)
    }
}

impl ProjectionMatrix {
    /// Reads a projection matrix, stored column by column as OpenGL has it, so that the fourth column is
    /// `columns[12..16]`. It may be a perspective or an orthographic one, centred or not, of left-handed or
    /// right-handed eye space, with any convention of depth.
    ///
    /// # Errors
    /// [`Error::Usage`] for a matrix with other than finite numbers, and for one that is no projection of a view: one
    /// that mixes x with y or x or y with depth (shear, rotation, oblique clipping), mirrors the picture, moves the
    /// eye, or has no extent.
    pub fn read(columns: &[f32; 16]) -> Result<ProjectionMatrix, Error> {
        let refuse = |what: &str| Err(Error::Usage(format!("the projection matrix {columns:?} {what}")));
        if !columns.iter().all(|entry| entry.is_finite()) {
            return refuse("has entries that are not finite numbers");
        }
        // The entry in this row and column, counted from 0.
        let m = |row: usize, column: usize| f64::from(columns[4 * column + row]);
        let row = |row: usize| [0, 1, 2, 3].map(|column| m(row, column));
        let small = |entry: f64, beside: f64| entry.abs() <= ROUNDING * beside.abs();
        let [x, y, z, w] = [0, 1, 2, 3].map(row);

        // The row of w is (0, 0, +-k, 0) in perspective and (0, 0, 0, k) otherwise, nearly always with k = 1.
        let perspective = w[2] != 0.0 && !small(w[2], w[3]);
        let k = if perspective { w[2].abs() } else { w[3] };
        // The rows of z and w in perspective are (0, 0, a, b) and (0, 0, +-1, 0).
        if perspective && k != 1.0 && z[3].abs() == 1.0 {
            return refuse(
                "looks transposed or inverse: give the matrix from eye space to clip space, column by column; if it is \
                 multiplied by a factor, divide it by that",
            );
        }
        if k <= 0.0 || !small(w[0], k) || !small(w[1], k) {
            return refuse("is no projection: its fourth row must be 0, 0, -1, 0 or 0, 0, 1, 0 or 0, 0, 0, 1");
        }
        if !small(x[1], x[0]) || !small(y[0], y[1]) {
            return refuse("mixes x and y, as shear and rotation do: take them out of it");
        }
        if x[0] <= 0.0 || y[1] <= 0.0 {
            return refuse("mirrors the picture or has no extent: its first two diagonal entries must be above 0");
        }
        if !small(z[0], z[2].abs().max(z[3].abs())) || !small(z[1], z[2].abs().max(z[3].abs())) {
            return refuse("mixes x or y into depth, as oblique clipping does: take it out of it");
        }
        // From here on `forward` is 1 if z points forward, -1 if it points backward.
        let forward = if perspective { w[2].signum() } else { 1.0 };
        let half = [k / x[0], k / y[1]];
        let (aside, other) = if perspective { (2, 3) } else { (3, 2) };
        if perspective {
            // A visible point has a z of at least the near plane's, which is about z[3].
            if !small(w[3], z[3]) || !small(x[3], z[3]) || !small(y[3], z[3]) {
                return refuse("moves the eye: the last entries of its first, second and fourth row must be 0");
            }
        } else if !small(x[other], x[0]) || !small(y[other], y[1]) {
            return refuse("shears x or y along z: take the shear out of it");
        }
        // In perspective x/w = (x[0] x + x[2] z) / (k z forward), which is 0 in the middle of the picture.
        let middle = [-x[aside] * forward / x[0], -y[aside] * forward / y[1]];
        let extents = Extents::new(middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]);
        let extents = Extents { half, middle, ..extents };
        let projection = if perspective { Projection::Perspective(extents) } else { Projection::Orthographic(extents) };
        projection.check()?;
        Ok(ProjectionMatrix {
            projection,
            hand: perspective.then_some(if forward > 0.0 { Hand::Left } else { Hand::Right }),
            depth: if perspective { [z[2] * forward / k, z[3] / k] } else { [z[3] / k, z[2] / k] },
        })
    }

    /// Returns the distance in front of the eye of a point with the depth `ndc` = z/w in clip space, from 0 or from -1
    /// to 1. It is infinite at an infinitely far plane. `hand` is the hand of the matrix's eye space; it is read
    /// only if the matrix does not tell it.
    #[must_use]
    pub fn z(&self, ndc: f64, hand: Hand) -> f64 {
        let [a, b] = self.depth;
        if self.projection.is_perspective() {
            let z = b / (ndc - a);
            return if z.is_infinite() { f64::INFINITY } else { z };
        }
        let z = (ndc - a) / b;
        if hand == Hand::Left { z } else { -z }
    }
}

#[cfg(test)]
mod tests {
    use super::Hand::{Left, Right};
    use super::*;

    const NEAR: f64 = 0.25;
    const FAR: f64 = 80.0;

    /// The ends of z/w in clip space, at the near plane and at the far plane, and the far plane.
    const DEPTHS: [([f64; 2], f64); 6] = [
        ([-1.0, 1.0], FAR),
        ([1.0, -1.0], FAR),
        ([0.0, 1.0], FAR),
        ([1.0, 0.0], FAR),
        ([0.0, 1.0], f64::INFINITY),
        ([1.0, 0.0], f64::INFINITY),
    ];

    /// The matrix as the textbooks have it: glFrustum or glOrtho for [-1, 1] and right-handed.
    fn matrix(
        perspective: bool,
        [left, right, bottom, top]: [f64; 4],
        hand: Hand,
        ([at_near, at_far], far): ([f64; 2], f64),
    ) -> [f32; 16] {
        let forward = if hand == Left { 1.0 } else { -1.0 };
        let mut m = [0.0; 16];
        m[0] = 2.0 / (right - left);
        m[5] = 2.0 / (top - bottom);
        let aside = [(right + left) / (right - left), (top + bottom) / (top - bottom)];
        if perspective {
            // z/w = a + b / z goes from at_near to at_far.
            let b = (at_near - at_far) / (1.0 / NEAR - 1.0 / far);
            let a = at_far - b / far;
            (m[8], m[9], m[10], m[11]) = (-forward * aside[0], -forward * aside[1], forward * a, forward);
            m[14] = b;
        } else {
            let slope = (at_far - at_near) / (far - NEAR);
            (m[10], m[12], m[13]) = (forward * slope, -aside[0], -aside[1]);
            (m[14], m[15]) = (at_near - slope * NEAR, 1.0);
        }
        m.map(|entry| entry as f32)
    }

    #[test]
    fn matrices_of_both_hands_and_of_every_convention_of_depth_give_the_same_projection() {
        for edges in [[-0.8, 0.8, -0.5, 0.5], [-0.2, 1.1, 0.1, 0.9], [3.0, 4.0, -7.0, -6.5]] {
            for perspective in [true, false] {
                for hand in [Left, Right] {
                    for depths in DEPTHS.into_iter().filter(|(_, far)| perspective || far.is_finite()) {
                        let columns = matrix(perspective, edges, hand, depths);
                        let read = ProjectionMatrix::read(&columns).unwrap();
                        let text = format!("{edges:?} {perspective} {hand:?} {depths:?}: {read:?}");
                        assert_eq!(read.projection.is_perspective(), perspective, "{text}");
                        assert_eq!(read.hand, perspective.then_some(hand), "{text}");
                        let ([half_x, half_y], [x, y]) =
                            (read.projection.half_extents(), read.projection.middle_at(1.0));
                        let found = [x - half_x, x + half_x, y - half_y, y + half_y];
                        assert!(found.iter().zip(edges).all(|(a, b)| (a - b).abs() < 2e-6), "{text}");
                        // The depths at the planes lead back to the planes.
                        let ([at_near, at_far], far) = depths;
                        assert!((read.z(at_near, hand) / NEAR - 1.0).abs() < 1e-3, "{text}");
                        let behind = read.z(at_far, hand);
                        assert!(behind == far || (behind / far - 1.0).abs() < 1e-3, "{text}: {behind}");
                        // A factor of the whole matrix changes nothing.
                        let scaled = ProjectionMatrix::read(&columns.map(|entry| 2.0 * entry)).unwrap();
                        assert_eq!(scaled, read, "{text}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_matrix_gives_the_projection_that_its_field_of_view_gives() {
        let symmetric = Projection::perspective(1.0, 1.5);
        let [x, y] = symmetric.half_extents();
        let read = Projection::from_matrix(&matrix(true, [-x, x, -y, y], Right, DEPTHS[3])).unwrap();
        let error = |a: f64, b: f64| (a / b - 1.0).abs();
        assert!(error(read.half_extents()[0], x) < 1e-7 && error(read.half_extents()[1], y) < 1e-7);
        assert_eq!(read.middle_at(1.0), [0.0; 2]);
    }

    #[test]
    fn what_is_no_projection_is_refused_in_one_line_that_says_why() {
        let good = matrix(true, [-0.8, 0.8, -0.5, 0.5], Right, DEPTHS[0]);
        let flat = matrix(false, [-0.8, 0.8, -0.5, 0.5], Right, DEPTHS[0]);
        let with = |matrix: [f32; 16], entry: usize, value: f32| {
            let mut matrix = matrix;
            matrix[entry] = value;
            matrix
        };
        let transposed = |m: [f32; 16]| std::array::from_fn(|i| m[4 * (i % 4) + i / 4]);
        let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
        ProjectionMatrix::read(&identity).unwrap();
        for (matrix, part) in [
            (with(good, 0, f32::NAN), "not finite"),
            (with(good, 10, f32::NAN), "not finite"),
            (with(good, 5, f32::INFINITY), "not finite"),
            ([0.0; 16], "no projection"),
            (with(good, 3, 0.1), "no projection"),
            (with(good, 7, -0.1), "no projection"),
            (with(flat, 15, -1.0), "no projection"),
            (with(good, 4, 0.1), "mixes x and y"),
            (with(good, 1, -0.1), "mixes x and y"),
            (with(flat, 4, 0.1), "mixes x and y"),
            (with(flat, 8, 0.1), "along z"),
            (with(flat, 9, 0.1), "along z"),
            (with(good, 2, 0.1), "into depth"),
            (with(flat, 6, 0.1), "into depth"),
            (with(good, 12, 0.1), "moves the eye"),
            (with(good, 13, 0.1), "moves the eye"),
            (with(good, 15, 1.0), "moves the eye"),
            (with(good, 5, -2.0), "mirrors"),
            (with(good, 0, 0.0), "mirrors"),
            (with(good, 8, 3000.0), "the view's axis"),
            (transposed(good), "looks transposed or inverse"),
            (transposed(matrix(true, [-0.2, 1.1, 0.1, 0.9], Left, DEPTHS[5])), "transposed"),
            (transposed(matrix(false, [-0.2, 1.1, 0.1, 0.9], Left, DEPTHS[0])), "projection matrix"),
        ] {
            let error = ProjectionMatrix::read(&matrix).unwrap_err();
            let message = error.to_string();
            assert!(error.is_usage() && message.lines().count() == 1 && message.contains(part), "{part}: {message}");
        }
        // What rounding leaves is not refused.
        ProjectionMatrix::read(&with(good, 4, 1e-8)).unwrap();
        ProjectionMatrix::read(&with(good, 12, -1e-8)).unwrap();
    }
}
