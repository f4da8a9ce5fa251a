//! The float64 twin of `glsl/hbao.frag`: horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9.

use super::horizons::{grounded, horizons};
use super::observer::{HorizonSample, Observer};
use super::sampling::{MethodScene, Pixel, Sample, Shift};
use super::twin::{Converged, Twin, directions, no_curve, strength_by_direction};
use crate::settings::Grounding;

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: strength_by_direction,
    curve: no_curve,
    converged: Some(Converged { occlusion: converged, ignores_repeats: true }),
};

/// Returns the sum of Eq. 6.2.9 in direction k.
fn occlusion(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, observer: &mut dyn Observer) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    // The horizon starts at the direction's tangent, t(theta).
    let start = scene.sine_of_tangent(pixel, direction.stride);
    observer.starts(start);
    // Eq. 6.2.9 uses the tangent towards each sample. Eq. 6.2.8 uses one tangent for the whole direction.
    let ground = |sample: &Sample| match scene.settings.grounding {
        Grounding::Sample => scene.sine_of_tangent(pixel, sample.taken),
        Grounding::Direction => start,
    };
    let mut horizon = start;
    let mut previous = 0.0;
    let mut occlusion = 0.0;
    for i in 1..=pixel.steps {
        let Some(sample) = scene.sample(pixel, &direction, i, shift) else { continue };
        // Eq. 6.2.6 is the elevation's tangent. This is the elevation's sine, which orders the samples in the same way.
        let sine = -sample.D.z / sample.D.length();
        let within = scene.within(pixel, &sample, shift);
        let raises = within && sine > horizon + shift.comparison;
        let seen = HorizonSample { sample: &sample, sine, horizon, ground: &|| ground(&sample), within, raises };
        observer.sample(i, &seen);
        if !raises {
            continue;
        }
        let rise = sine - ground(&sample);
        let added = scene.attenuation(pixel, sample.D.length()) * (rise - previous);
        observer.adds(i, added);
        occlusion += added;
        previous = rise;
        horizon = sine;
    }
    occlusion
}

/// Returns the sum of Eq. 6.2.9 in direction k with a sample at every texel.
fn converged(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, _: &mut dyn Observer) -> f64 {
    let rise = |sample: &Sample, r: f64| grounded(scene, pixel, sample, r);
    let mut previous = 0.0;
    let increments = horizons(scene, pixel, k, shift, rise).map(|(rise, r)| {
        let increment = scene.attenuation(pixel, r) * (rise - previous);
        previous = rise;
        increment
    });
    increments.sum()
}
