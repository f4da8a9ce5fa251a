//! What was measured of a case, and the figures that follow from it.

use super::cases::Case;
use crate::measure::median;

/// The times of one case: milliseconds, run by run, by the driver's timer where it has one, else on the wall from a
/// finished queue to a finished queue. A part of the frame that has no pass takes 0.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The case that was measured.
    pub case: Case,
    /// Depth samples a pixel, as the driver gave them.
    pub samples: u32,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Every pass of a frame together.
    pub frame_ms: Vec<f64>,
    /// The G-buffer and its resolve.
    pub gbuffer_ms: Vec<f64>,
    /// The AO pass. Where it reads depth at half size, the pass that makes that depth is included.
    pub ao_ms: Vec<f64>,
    /// The AO pass with a sum in place of the arithmetic after each fetch ([`crate::AmbientOcclusion::fetch_floor`]),
    /// measured right after the pass itself. Empty without an AO pass.
    pub floor_ms: Vec<f64>,
    /// The blur's passes together.
    pub blur_ms: Vec<f64>,
    /// By how much the first frame took longer on the wall than the others: the time for compiling its shaders, and for
    /// allocating.
    pub compile_ms: f64,
    /// What the driver could not do as asked, and what was done in its place: one line each.
    pub notices: Vec<String>,
}

impl Measurement {
    /// A measurement without any runs yet.
    pub(super) fn begin(case: Case, samples: u32, triangles: usize, notices: Vec<String>) -> Measurement {
        Measurement {
            case,
            samples,
            triangles,
            frame_ms: Vec::new(),
            gbuffer_ms: Vec::new(),
            ao_ms: Vec::new(),
            floor_ms: Vec::new(),
            blur_ms: Vec::new(),
            compile_ms: 0.0,
            notices,
        }
    }

    /// Frames per second, by the median frame.
    pub fn fps(&self) -> f64 {
        1e3 / median(&self.frame_ms)
    }

    /// The image's megapixels over the AO pass's time; NaN without an AO pass.
    pub fn mpixels_per_s(&self) -> f64 {
        if self.case.fetches() == 0 { f64::NAN } else { self.case.pixels() / median(&self.ao_ms) / 1e3 }
    }

    /// AO's time over its floor's: the median over the pairs. NaN without an AO pass.
    pub fn ao_to_floor(&self) -> f64 {
        median(&self.ao_ms.iter().zip(&self.floor_ms).map(|(ao, floor)| ao / floor).collect::<Vec<_>>())
    }

    /// The median of these times, in nanoseconds for each sample, as if no texel left early. Where the radius is small
    /// on the screen, many texels do leave early and fetch nothing. NaN without samples.
    pub fn ns_per_sample(&self, times: &[f64]) -> f64 {
        match self.case.fetches() {
            0 => f64::NAN,
            fetches => median(times) * 1e6 / (self.case.texels() * f64::from(fetches)),
        }
    }

    /// Where on its series a case of [`super::scaling`] stands: its pixels, its samples a pixel, or its triangles.
    pub fn along(&self) -> f64 {
        match self.case.column {
            "samples" => f64::from(self.case.fetches()),
            "triangles" => self.triangles as f64,
            _ => self.case.pixels(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Settings;
    use crate::measure::bench::figure1;

    #[test]
    fn the_ratio_to_the_floor_is_taken_pair_by_pair() {
        let case = figure1(&Settings::default(), (1600, 1200)).remove(0);
        let (ao_ms, floor_ms) = (vec![2.0, 30.0, 8.0], vec![1.0, 10.0, 2.0]);
        let measured = Measurement { ao_ms, floor_ms, ..Measurement::begin(case, 1, 1, Vec::new()) };
        assert_eq!(measured.ao_to_floor(), 3.0);
        assert_eq!(measured.mpixels_per_s(), 1.92 / 8.0 * 1e3);
        assert_eq!(measured.ns_per_sample(&measured.floor_ms), 2e6 / (1.92e6 * 64.0));
    }
}
