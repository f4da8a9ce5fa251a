//! The parts of a method's float64 twin. The twin of each method is in a file of its own.

use super::observer::Observer;
use super::sampling::{MethodScene, Pixel, Shift};
use crate::settings::Settings;

/// Computes the occlusion of a pixel in direction k, or by sample k, and tells the observer how. The converged forms
/// tell nothing.
pub(super) type Occlusion = fn(&MethodScene, &Pixel, u32, Shift, &mut dyn Observer) -> f64;

/// A method in the form A = 1 - scale * (sum of its occlusion over all directions, or over all samples).
pub(super) struct Twin {
    pub(super) occlusion: Occlusion,
    /// The number of directions, or of samples.
    pub(super) count: fn(&Settings) -> u32,
    /// The factor by which the sum is multiplied.
    pub(super) scale: fn(&Settings) -> f64,
    /// Whether the method ends with A^2 + A (6.1).
    pub(super) curve: fn(&Settings) -> bool,
    /// The converged form of the method; `None` if the method has none.
    pub(super) converged: Option<Converged>,
}

/// The converged form of a method; see [`super::converged()`].
pub(super) struct Converged {
    /// The occlusion in direction k, with a sample at every texel.
    pub(super) occlusion: Occlusion,
    /// True if a sample that is equal to the previous sample has no effect on the result. If so, samples that lie
    /// beyond the image's border and equal each other need not be taken.
    pub(super) ignores_repeats: bool,
}

/// Returns the number of directions, for methods that add up directions.
pub(super) fn directions(settings: &Settings) -> u32 {
    settings.directions
}

/// Returns strength / N_d, for methods that average over directions.
pub(super) fn strength_by_direction(settings: &Settings) -> f64 {
    settings.strength / f64::from(settings.directions)
}

/// Returns false, for methods that return A itself.
pub(super) fn no_curve(_: &Settings) -> bool {
    false
}
