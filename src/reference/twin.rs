//! What the float64 twin of a method consists of. The twin of each method is in a file of its own.

use super::sampling::{MethodScene, Pixel, Shift};
use crate::settings::Settings;

/// Computes the occlusion of a pixel in direction k, or by sample k.
pub(super) type Occlusion = fn(&MethodScene, &Pixel, u32, Shift) -> f64;

/// A method, as A = 1 - scale times the sum of its occlusion over all directions, or over all samples.
pub(super) struct Twin {
    pub(super) occlusion: Occlusion,
    /// The number of directions, or of samples.
    pub(super) count: fn(&Settings) -> u32,
    /// The factor by which the sum is multiplied.
    pub(super) scale: fn(&Settings) -> f64,
    /// Whether the method ends with A^2 + A (6.1).
    pub(super) curve: fn(&Settings) -> bool,
    /// What the method converges to; `None` if that is not defined.
    pub(super) converged: Option<Converged>,
}

/// The converged form of a method; see [`super::converged()`].
pub(super) struct Converged {
    /// The occlusion in direction k, with a sample at every texel.
    pub(super) occlusion: Occlusion,
    /// Whether a sample that equals the one before it changes nothing. Samples beyond the image's border equal each
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

/// For methods that return A itself.
pub(super) fn no_curve(_: &Settings) -> bool {
    false
}
