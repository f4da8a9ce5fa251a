//! The float64 twin of `glsl/hbao.frag`: horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9.

use super::horizons::horizons;
use super::sampling::{MethodScene, Pixel, Shift};
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
fn occlusion(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    // The horizon starts at the direction's tangent, t(theta).
    let mut tangent = scene.sine_of_tangent(pixel, direction.stride);
    let mut horizon = tangent;
    let mut previous = 0.0;
    let mut occlusion = 0.0;
    for i in 1..=pixel.steps {
        let Some(sample) = scene.sample(pixel, &direction, i, shift) else { continue };
        // Eq. 6.2.6 is the elevation's tangent. This is the elevation's sine, which orders the samples in the same way.
        let sine = -sample.D.z / sample.D.length();
        if !scene.within(&sample, shift) || sine <= horizon + shift.comparison {
            continue;
        }
        // Eq. 6.2.9 uses the tangent towards each sample. Eq. 6.2.8 uses one tangent for the whole direction.
        if scene.settings.grounding == Grounding::Sample {
            tangent = scene.sine_of_tangent(pixel, sample.taken);
        }
        let rise = sine - tangent;
        occlusion += scene.attenuation(sample.D.length()) * (rise - previous);
        previous = rise;
        horizon = sine;
    }
    occlusion
}

/// Returns the sum of Eq. 6.2.9 in direction k with a sample at every texel.
fn converged(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
    let mut previous = 0.0;
    let increments = horizons(scene, pixel, k, shift).map(|(rise, r)| {
        let increment = scene.attenuation(r) * (rise - previous);
        previous = rise;
        increment
    });
    increments.sum()
}
