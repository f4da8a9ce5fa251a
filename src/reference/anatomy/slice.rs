//! One direction of a horizon method: its samples, and what each adds.

use super::super::observer::{HorizonSample, Observer};
use glam::{DVec2, DVec3};

/// One direction around a pixel, as a horizon method (`hbao`, `hbao-talk`, `hbao-view`) walks along it. Angles are
/// given by their sines, as the methods compute them.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The direction in the image, turned by the tile's angle: a unit vector, with y up.
    pub direction: DVec2,
    /// The way from one sample to the next in texels. With `snap = step` it is rounded to whole texels.
    pub stride: DVec2,
    /// The sine of t(theta), the elevation of the tangent from which the horizon starts, with the angle bias added.
    pub sin_t: f64,
    /// The samples i = 1..N_s in their order, including those that the method ignores.
    pub samples: Vec<SampleAnatomy>,
    /// What the direction adds to the occlusion. It is the sum of the contributions of the samples, to the bit.
    pub occlusion: f64,
}

impl Slice {
    /// Returns the sine of the horizon h(theta): of the highest of the tangent and the samples within R.
    #[must_use]
    pub fn sin_h(&self) -> f64 {
        self.horizon_sample().and_then(|sample| sample.found.as_ref()).map_or(self.sin_t, |found| found.sin_phi)
    }

    /// Returns the sample at the horizon; `None` if no sample is higher than the tangent.
    #[must_use]
    pub fn horizon_sample(&self) -> Option<&SampleAnatomy> {
        self.samples.iter().rev().find(|sample| sample.fate == Fate::Raises)
    }
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It reads P's own texel, and is ignored.
    OwnTexel,
    /// It reads background, and is ignored.
    Background,
    /// It lies further than R from P, and is ignored.
    BeyondRadius,
    /// It is not higher than the horizon so far, or with `hbao-view` it was snapped behind P or lies nearly at a
    /// right angle to its slice. It is ignored.
    BelowHorizon,
    /// It raises the horizon.
    Raises,
}

/// A sample of a direction.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleAnatomy {
    /// i = 1..N_s.
    pub index: u32,
    /// The offset (b + i) step_px of Eq. 6.2.10, or with `hbao-view` the offset that its spacing gives, in texels from
    /// P's own texel, before it is rounded.
    pub meant: DVec2,
    /// The texel that is read, in texels from P's own: rounded as `snap` says, and clamped to the image.
    pub taken: DVec2,
    /// What becomes of the sample.
    pub fate: Fate,
    /// The surface at the texel; `None` for background and P's own texel.
    pub found: Option<Found>,
    /// What the sample adds to the occlusion; 0 if it is ignored. With `hbao` it is W [(sin phi - sin t) - previous] of
    /// Eq. 6.2.9, and may be negative. With `hbao-talk` the last sample that raises the horizon has all, (sin h - sin
    /// t(theta)) W, and the others have 0. With `hbao-view` it is the term of its sum.
    pub contribution: f64,
}

/// The surface that a sample finds.
#[allow(non_snake_case)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// S - P in eye space, in scene units.
    pub D: DVec3,
    /// The sine of the elevation phi of the sample: -D.z / |D|, or with `hbao-view` that over the plane perpendicular
    /// to the view ray.
    pub sin_phi: f64,
    /// The sine of the tangent that the sample is measured from: t_i towards the sample in `hbao` with `grounding =
    /// sample` and in `hbao-view` with `zenith = axis`, and t(theta) otherwise.
    pub sin_t: f64,
    /// The sine of the horizon before the sample: the running maximum.
    pub sin_before: f64,
    /// The attenuation W(|D|). Beyond R it has no meaning. `hbao-view` takes the distance in the slice, and its
    /// quadrature changes the weight.
    pub weight: f64,
}

/// Collects a slice from what a twin tells.
pub(super) struct Collector<'a> {
    pub(super) samples: Vec<SampleAnatomy>,
    /// The sine of t(theta), if the twin told it.
    pub(super) sin_t: Option<f64>,
    /// W(r).
    pub(super) attenuation: &'a dyn Fn(f64) -> f64,
}

impl Observer for Collector<'_> {
    fn starts(&mut self, sin_t: f64) {
        self.sin_t = Some(sin_t);
    }

    fn sample(&mut self, i: u32, seen: &HorizonSample) {
        let sample = &mut self.samples[i as usize - 1];
        sample.fate = match (seen.within, seen.raises) {
            (_, true) => Fate::Raises,
            (true, false) => Fate::BelowHorizon,
            (false, false) => Fate::BeyondRadius,
        };
        sample.found = Some(Found {
            D: seen.sample.D,
            sin_phi: seen.sine,
            sin_t: (seen.ground)(),
            sin_before: seen.horizon,
            weight: (self.attenuation)(seen.sample.D.length()),
        });
    }

    fn adds(&mut self, i: u32, occlusion: f64) {
        // Methods without a horizon number what they tell otherwise. What they tell is no slice.
        if let Some(sample) = (i as usize).checked_sub(1).and_then(|at| self.samples.get_mut(at)) {
            sample.contribution = occlusion;
        }
    }
}
