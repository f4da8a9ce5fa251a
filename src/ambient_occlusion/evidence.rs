//! The images that inputs are judged by, read back.

use crate::encoding::{NormalEncoding, NormalSpace};

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

/// Returns the mean cosine of the angle between these normals and those rebuilt from depth; `None` if too few pixels
/// have both.
pub(super) fn score(seen: &Evidence, normals: &[[f64; 3]]) -> Option<f64> {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cosine = |i: usize| {
        let (a, b) = (normals[i], seen.rebuilt[i]);
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    let (mut sum, mut count) = (0.0, 0);
    for cosine in seen.covered().filter(|&i| seen.fine[i]).map(cosine).filter(|c| c.is_finite()) {
        sum += cosine;
        count += 1;
    }
    (count >= FEW).then(|| sum / count as f64)
}
