//! The float64 twin of `glsl/microsphere.frag`: micro-spheres (Shanmugam and Arikan 2007) and creases (Fox and Compton
//! 2008) as ShaderX7 6.2 describes them. Every sample within R occludes by its solid angle, even where other samples
//! hide it from P.

use super::observer::Observer;
use super::sampling::{MethodScene, Pixel, Shift};
use super::twin::{Converged, Twin, directions, no_curve};
use crate::settings::Method;
use std::f64::consts::{PI, TAU};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: |settings| settings.strength / PI,
    curve: no_curve,
    // Every sample adds its own occlusion, so a repeated sample counts again.
    converged: Some(Converged { occlusion, ignores_repeats: false }),
};

/// Returns the sum of m Omega max(0, n.D/|D|) over the samples within R in direction k.
fn occlusion(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, _: &mut dyn Observer) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    let n = pixel.n.normalize_or_zero();
    let (directions, steps) = (f64::from(scene.settings.directions), f64::from(pixel.steps));
    (1..=pixel.steps)
        .filter_map(|i| Some((i, scene.sample(pixel, &direction, i, shift)?)))
        .filter(|(_, sample)| scene.within(pixel, sample, shift))
        .map(|(i, sample)| {
            let distance = sample.D.length();
            let solid_angles = if scene.settings.method == Method::Crease {
                TAU / (directions * steps)
            } else {
                // The sample stands for m texels. Each holds a sphere of radius rho, as wide as a texel is at the
                // sample's depth, and of the solid angle Omega = 2 pi (1 - sqrt(1 - x)), seen from P. x is the square
                // of the sine of the angle that the radius covers.
                let depth = if scene.projection.is_perspective() { sample.z } else { 1.0 };
                let rho = depth * scene.pixel_extent().y / 2.0;
                // 1 - sqrt(1 - x) = x / (1 + sqrt(1 - x)). The form on the right does not cancel if x is small. The
                // form on the left has no correct digit in float64 if x is below 1e-16.
                let x = (rho / distance).min(1.0).powi(2);
                let omega = TAU * x / (1.0 + (1.0 - x).sqrt());
                let m = TAU * (pixel.jitter[2] + f64::from(i)) * pixel.step_px.x * pixel.step_px.y / directions;
                m * omega
            };
            solid_angles * n.dot(sample.D / distance).max(0.0)
        })
        .sum()
}
