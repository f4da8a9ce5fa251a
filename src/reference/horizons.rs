//! The horizons of the converged methods, which take a sample at every texel.

use super::sampling::{MethodScene, Pixel, Sample, Shift};

/// Returns the samples within R in direction k that rise higher than all samples before them. Each is given by its
/// rise, and by its distance from P. `rise` tells the sine of a sample's elevation minus that of the tangent towards
/// it, from the sample and its distance.
pub(super) fn horizons(
    scene: &MethodScene,
    pixel: &Pixel,
    k: u32,
    shift: Shift,
    rise: impl Fn(&Sample, f64) -> f64,
) -> impl Iterator<Item = (f64, f64)> {
    let direction = scene.direction(pixel, k, shift);
    let mut highest = 0.0;
    (1..=pixel.steps).filter_map(move |i| {
        let sample = scene.sample(pixel, &direction, i, shift).filter(|sample| scene.within(pixel, sample, shift))?;
        let r = sample.D.length();
        let rise = rise(&sample, r);
        let rises = rise > highest;
        highest = rise.max(highest);
        rises.then_some((rise, r))
    })
}

/// Returns the rise of a sample at the distance r with the Z axis as the zenith.
pub(super) fn grounded(scene: &MethodScene, pixel: &Pixel, sample: &Sample, r: f64) -> f64 {
    -sample.D.z / r - scene.sine_of_tangent(pixel, sample.taken)
}
