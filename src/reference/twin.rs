//! What the float64 twin of a method is made of. Each method's own file holds its twin.

use super::sampling::{Pixel, Scene, Shift};
use crate::settings::Settings;

/// The occlusion of a pixel in direction k, or by sample k.
pub(super) type Occlusion = fn(&Scene, &Pixel, u32, Shift) -> f64;

/// A method: A = 1 - scale times the sum of its occlusion over all directions, or over all samples.
pub(super) struct Twin {
    pub(super) occlusion: Occlusion,
    /// The number of directions, or of samples.
    pub(super) count: fn(&Settings) -> u32,
    /// The factor on the sum.
    pub(super) scale: fn(&Settings) -> f64,
    /// Whether the method ends with A^2 + A (6.1).
    pub(super) curve: fn(&Settings) -> bool,
    /// What the method converges to; `None` where that is not defined.
    pub(super) converged: Option<Converged>,
}

/// A method's converged form.
pub(super) struct Converged {
    /// The occlusion in direction k, where there is a sample at every texel.
    pub(super) occlusion: Occlusion,
    /// Whether a sample that repeats the one before it changes nothing. Samples beyond the image's border repeat each
    /// other, and then need not be taken.
    pub(super) ignores_repeats: bool,
}

/// The number of directions, for methods that add up directions.
pub(super) fn directions(settings: &Settings) -> u32 {
    settings.directions
}

/// strength / N_d, for methods that average over directions.
pub(super) fn strength_by_direction(settings: &Settings) -> f64 {
    settings.strength / f64::from(settings.directions)
}

/// For methods that end with A itself.
pub(super) fn no_curve(_: &Settings) -> bool {
    false
}
