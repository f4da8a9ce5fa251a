//! The times that were measured for a case, and the figures that follow from them.

use super::cases::Case;
use crate::measure::{Reach, median};

/// The times of one case in milliseconds, one for each run. They are measured by the driver's timer. If the driver has
/// none, the system's clock measures from one `glFinish` before the pass to another after it. A part of the frame that
/// has no pass takes 0.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The case that was measured.
    pub case: Case,
    /// The number of depth samples per pixel that the driver gave.
    pub samples: u32,
    /// The number of triangles of the mesh.
    pub triangles: usize,
    /// How R fits the steps and the picture.
    pub reach: Reach,
    /// The time of all passes of a frame together.
    pub frame_ms: Vec<f64>,
    /// The time of the G-buffer and its resolve.
    pub gbuffer_ms: Vec<f64>,
    /// The time of the AO pass. If it reads depth at half size, the time includes the pass that makes that depth.
    pub ao_ms: Vec<f64>,
    /// The floor of the AO pass, measured right after the pass itself: the time of the method's shader with all its
    /// fetches and with a sum in place of its arithmetic ([`crate::AmbientOcclusion::fetch_floor`]). Empty without an
    /// AO pass.
    pub floor_ms: Vec<f64>,
    /// The time of all passes of the blur together.
    pub blur_ms: Vec<f64>,
    /// The time by which the first frame took longer than the others by the system's clock. It is spent on compiling
    /// shaders and on allocating memory.
    pub compile_ms: f64,
    /// One line for each thing that the driver could not do as asked. It says what was done instead.
    pub notices: Vec<String>,
}

impl Measurement {
    /// Makes a measurement without any runs.
    pub(super) fn begin(case: Case, samples: u32, triangles: usize, reach: Reach, notices: Vec<String>) -> Measurement {
        Measurement {
            case,
            samples,
            triangles,
            reach,
            frame_ms: Vec::new(),
            gbuffer_ms: Vec::new(),
            ao_ms: Vec::new(),
            floor_ms: Vec::new(),
            blur_ms: Vec::new(),
            compile_ms: 0.0,
            notices,
        }
    }

    /// Returns the frames per second, from the median time of a frame.
    pub fn fps(&self) -> f64 {
        1e3 / median(&self.frame_ms)
    }

    /// Returns the megapixels of the image per second of the AO pass; NaN without an AO pass.
    pub fn mpixels_per_s(&self) -> f64 {
        if self.case.fetches() == 0 { f64::NAN } else { self.case.pixels() / median(&self.ao_ms) / 1e3 }
    }

    /// Returns the time of the AO pass divided by that of its floor. The ratio is taken run by run, and the result is
    /// the median. NaN without an AO pass.
    pub fn ao_to_floor(&self) -> f64 {
        median(&self.ao_ms.iter().zip(&self.floor_ms).map(|(ao, floor)| ao / floor).collect::<Vec<_>>())
    }

    /// Returns the median of these times in nanoseconds per sample, as if the method took all its samples at every
    /// texel. If the radius is small on the screen, a step is shorter than a texel at many texels, and the method exits
    /// there without a fetch. NaN without samples.
    pub fn ns_per_sample(&self, times: &[f64]) -> f64 {
        match self.case.fetches() {
            0 => f64::NAN,
            fetches => median(times) * 1e6 / (self.case.texels() * f64::from(fetches)),
        }
    }

    /// Returns the quantity that a series of [`super::scaling`] varies: the number of pixels, of samples per pixel, or
    /// of triangles.
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
        let measured = Measurement { ao_ms, floor_ms, ..Measurement::begin(case, 1, 1, Reach::default(), Vec::new()) };
        assert_eq!(measured.ao_to_floor(), 3.0);
        assert_eq!(measured.mpixels_per_s(), 1.92 / 8.0 * 1e3);
        assert_eq!(measured.ns_per_sample(&measured.floor_ms), 2e6 / (1.92e6 * 64.0));
    }
}
