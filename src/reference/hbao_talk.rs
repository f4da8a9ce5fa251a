//! The float64 twin of `glsl/hbao_talk.frag`: horizon-based ambient occlusion as the SIGGRAPH 2008 talk has it, Eq. 3.
//! Each direction has one horizon and one attenuation, which is that of the sample at the horizon.

use super::horizons::{grounded, horizons};
use super::observer::{HorizonSample, Observer};
use super::sampling::{MethodScene, Pixel, Sample, Shift};
use super::twin::{Converged, Twin, directions, no_curve, strength_by_direction};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: strength_by_direction,
    curve: no_curve,
    converged: Some(Converged { occlusion: converged, ignores_repeats: true }),
};

/// Returns (sin h - sin t(theta)) W of Eq. 3 in direction k.
fn occlusion(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, observer: &mut dyn Observer) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    let tangent = scene.sine_of_tangent(pixel, direction.stride);
    observer.starts(tangent);
    // The horizon h(theta) is the highest of the tangent and the samples within R. r is the distance of the sample that
    // determines the horizon, or 0 as long as the tangent determines it.
    let (mut horizon, mut r, mut highest) = (tangent, 0.0, None);
    for i in 1..=pixel.steps {
        let Some(sample) = scene.sample(pixel, &direction, i, shift) else { continue };
        let sine = -sample.D.z / sample.D.length();
        let within = scene.within(pixel, &sample, shift);
        let raises = within && sine > horizon + shift.comparison;
        let seen = HorizonSample { sample: &sample, sine, horizon, ground: &|| tangent, within, raises };
        observer.sample(i, &seen);
        if raises {
            (horizon, r, highest) = (sine, sample.D.length(), Some(i));
        }
    }
    let occlusion = (horizon - tangent) * scene.attenuation(pixel, r);
    // Without such a sample the horizon is the tangent, and the occlusion is 0.
    if let Some(i) = highest {
        observer.adds(i, occlusion);
    }
    occlusion
}

/// Returns the same in direction k with a sample at every texel. The whole rise has the attenuation of the sample at
/// the horizon.
fn converged(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, _: &mut dyn Observer) -> f64 {
    let rise = |sample: &Sample, r: f64| grounded(scene, pixel, sample, r);
    horizons(scene, pixel, k, shift, rise).last().map_or(0.0, |(rise, r)| rise * scene.attenuation(pixel, r))
}
