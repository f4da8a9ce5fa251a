//! The images that inputs are judged by, read back.

use crate::encoding::{NormalEncoding, NormalSpace};
use std::cmp::Ordering;

/// The depth and normals of a view, as the passes read them. All images have a texel for each pixel.
#[derive(Clone)]
pub(super) struct Evidence {
    /// Linear depth.
    pub(super) depth: Vec<f64>,
    /// This depth and all greater ones are background.
    pub(super) background: f64,
    /// Normals rebuilt from depth, in left-handed eye space, turned towards the eye.
    pub(super) rebuilt: Vec<[f64; 3]>,
    /// The caller's normals as they are stored.
    pub(super) stored: Vec<[f64; 3]>,
    pub(super) encoding: NormalEncoding,
    pub(super) space: NormalSpace,
    /// Whether depth is stored finely enough for normals to be rebuilt from it.
    pub(super) fine: Vec<bool>,
}

impl Evidence {
    /// Returns the pixels that hold a surface.
    pub(super) fn covered(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.depth.len()).filter(|&i| self.depth[i] > 0.0 && self.depth[i] < self.background)
    }

    /// Returns the median depth of the surfaces; NaN if there are none.
    pub(super) fn median(&self) -> f64 {
        let mut depths: Vec<f64> = self.covered().map(|i| self.depth[i]).collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Returns a stored normal in the space that it was stored in.
    pub(super) fn decoded(&self, stored: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = if self.encoding.is_biased() { stored.map(|c| 2.0 * c - 1.0) } else { stored };
        if !self.encoding.is_octahedral() {
            return [x, y, z];
        }
        let z = 1.0 - x.abs() - y.abs();
        let folded = |along: f64, across: f64| if z < 0.0 { (1.0 - across.abs()).copysign(along) } else { along };
        [folded(x, y), folded(y, x), z]
    }

    /// Returns the caller's normals in left-handed eye space.
    pub(super) fn normals(&self) -> Vec<[f64; 3]> {
        // The space has been checked.
        let matrix = self.space.to_eye().ok().flatten().map(|matrix| matrix.map(f64::from));
        let turned = |n: [f64; 3]| match matrix {
            None => n,
            Some(m) => std::array::from_fn(|row| m[row] * n[0] + m[row + 3] * n[1] + m[row + 6] * n[2]),
        };
        self.stored.iter().map(|&stored| turned(self.decoded(stored))).collect()
    }

    /// Returns the same images with normals that are read as biased, if they are not, or the other way round.
    pub(super) fn otherwise_encoded(&self) -> Evidence {
        let encoding = match self.encoding {
            NormalEncoding::Signed => NormalEncoding::Biased,
            NormalEncoding::Biased => NormalEncoding::Signed,
            NormalEncoding::Octahedral => NormalEncoding::OctahedralBiased,
            NormalEncoding::OctahedralBiased => NormalEncoding::Octahedral,
        };
        Evidence { encoding, ..self.clone() }
    }

    /// Returns the same images with the transposed view matrix, if there is one.
    pub(super) fn transposed(&self) -> Option<Evidence> {
        let NormalSpace::World { view, eye } = self.space else { return None };
        let view = std::array::from_fn(|i| view[3 * (i % 3) + i / 3]);
        Some(Evidence { space: NormalSpace::World { view, eye }, ..self.clone() })
    }
}

/// The least number of pixels from which anything is concluded about normals.
const FEW: usize = 32;

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the pairs of one of these normals and the one rebuilt from depth, with unit length, where both exist.
fn pairs<'a>(seen: &'a Evidence, normals: &'a [[f64; 3]]) -> impl Iterator<Item = [[f64; 3]; 2]> + 'a {
    let unit = |n: [f64; 3]| n.map(|c| c / dot(n, n).sqrt());
    let both = seen.covered().filter(|&i| seen.fine[i]).map(move |i| [unit(normals[i]), unit(seen.rebuilt[i])]);
    both.filter(|pair| pair.iter().flatten().all(|c| c.is_finite()))
}

/// The cosine of an angle of 26 degrees. Normals that are as far apart do not belong to the same surface.
const APART: f64 = 0.9;

/// How far normals are from those rebuilt from depth, by (1 - c)/(1 - [`APART`]), but at most 1, where c is the cosine
/// of the angle between the two. So an outlier at a silhouette counts no more than any other normal of another surface.
#[derive(Clone, Copy)]
pub(super) struct Misfit {
    mean: f64,
    median: f64,
    /// The share of the pixels at which they are 26 degrees apart or more.
    pub(super) apart: f64,
}

impl Misfit {
    /// Returns `None` if too few pixels have both.
    pub(super) fn of(seen: &Evidence, normals: &[[f64; 3]]) -> Option<Misfit> {
        let off = |[a, b]: [[f64; 3]; 2]| ((1.0 - dot(a, b)) / (1.0 - APART)).min(1.0);
        let mut all: Vec<f64> = pairs(seen, normals).map(off).collect();
        if all.len() < FEW {
            return None;
        }
        all.sort_by(f64::total_cmp);
        let share = |sum: f64| sum / all.len() as f64;
        let apart = all.iter().filter(|&&off| off == 1.0).count();
        Some(Misfit { mean: share(all.iter().sum()), median: all[all.len() / 2], apart: share(apart as f64) })
    }

    /// Returns whether a change, after which the misfit is `changed`, explains this misfit: normals did not fit, and
    /// now they do. A mistake that moves few normals by far shows in the mean, such as the other hand where most
    /// surfaces are seen edge-on; one that moves all normals by little shows in the median, such as a small turn.
    pub(super) fn is_explained_by(self, changed: Misfit) -> bool {
        let few = changed.mean < self.mean - 0.05 && changed.mean < 0.5 * self.mean;
        let little = self.median > 0.05 && changed.median < 0.25 * self.median;
        few || little
    }

    /// Returns which of two misfits is less.
    pub(super) fn order(&self, other: &Misfit) -> Ordering {
        self.mean.total_cmp(&other.mean)
    }
}

/// Returns the normals turned so that they fit those rebuilt from depth best, and the angle of the turn in radians
/// (Horn: Closed-form solution of absolute orientation using unit quaternions, 1987).
pub(super) fn turned(seen: &Evidence, normals: &[[f64; 3]]) -> (Vec<[f64; 3]>, f64) {
    // S[i][j] is the sum of a_i b_j, and the best turn is the quaternion for which q.N q is greatest.
    let mut s = [[0.0; 3]; 3];
    for [a, b] in pairs(seen, normals) {
        (0..9).for_each(|k| s[k / 3][k % 3] += a[k / 3] * b[k % 3]);
    }
    let n = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    // Power iteration finds the eigenvector of the greatest eigenvalue once all are above 0. Two near eigenvalues, as
    // of a single wall, leave a mixture, which fits as well as either.
    let shift = n.iter().flatten().map(|c: &f64| c.abs()).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut q = [1.0, 0.1, 0.07, 0.03];
    for _ in 0..500 {
        let next: [f64; 4] = std::array::from_fn(|i| (0..4).map(|j| n[i][j] * q[j]).sum::<f64>() + shift * q[i]);
        let length = next.iter().map(|c| c * c).sum::<f64>().sqrt();
        q = next.map(|c| c / length);
    }
    let [w, v @ ..] = q;
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    // a + 2 w (v x a) + 2 v x (v x a)
    let turn = |a: [f64; 3]| {
        let once = cross(v, a);
        let twice = cross(v, once);
        std::array::from_fn(|i| a[i] + 2.0 * (w * once[i] + twice[i]))
    };
    (normals.iter().map(|&normal| turn(normal)).collect(), 2.0 * dot(v, v).sqrt().atan2(w.abs()))
}
