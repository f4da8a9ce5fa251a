//! The horizons of the converged methods, which take a sample at every texel.

use super::sampling::{MethodScene, Pixel, Shift};

/// Returns the samples within R in direction k that rise higher than all samples before them. Each is given by its
/// rise, which is the sine of its elevation minus that of the tangent towards it, and by its distance from P.
pub(super) fn horizons(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift) -> impl Iterator<Item = (f64, f64)> {
    let direction = scene.direction(pixel, k, shift);
    let mut highest = 0.0;
    (1..=pixel.steps).filter_map(move |i| {
        let sample = scene.sample(pixel, &direction, i, shift).filter(|sample| scene.within(sample, shift))?;
        let r = sample.D.length();
        let rise = -sample.D.z / r - scene.sine_of_tangent(pixel, sample.taken);
        let rises = rise > highest;
        highest = rise.max(highest);
        rises.then_some((rise, r))
    })
}
