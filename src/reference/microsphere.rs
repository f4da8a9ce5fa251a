//! The float64 twin of `glsl/microsphere.frag`: micro-spheres (Shanmugam and Arikan 2007) and creases (Fox and Compton
//! 2008) as ShaderX7 6.2 describes them.

use super::sampling::{Pixel, Scene, Shift};
use super::twin::{Converged, Twin, directions, no_curve};
use crate::settings::Method;
use std::f64::consts::{PI, TAU};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: |settings| settings.strength / PI,
    curve: no_curve,
    // Each sample adds what it covers, a repeated one too.
    converged: Some(Converged { occlusion, ignores_repeats: false }),
};

/// The sum of m Omega max(0, n.D/|D|) over the samples of direction k within R.
fn occlusion(scene: &Scene, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    let n = pixel.n.normalize_or_zero();
    let (directions, steps) = (f64::from(scene.settings.directions), f64::from(pixel.steps));
    (1..=pixel.steps)
        .filter_map(|i| Some((i, scene.sample(pixel, &direction, i, shift)?)))
        .filter(|(_, sample)| scene.within(sample, shift))
        .map(|(i, sample)| {
            let distance = sample.D.length();
            let solid_angles = if scene.settings.method == Method::Crease {
                TAU / (directions * steps)
            } else {
                // The sphere that a texel's pixel is wide: its radius rho, its solid angle Omega, and the m texels
                // that the sample stands for.
                let depth = if scene.projection.is_perspective() { sample.z } else { 1.0 };
                let rho = depth * scene.pixel_extent().y / 2.0;
                // 1 - sqrt(1 - x), without its cancellation where x is small: float64 has none of it left below 1e-16.
                let x = (rho / distance).min(1.0).powi(2);
                let omega = TAU * x / (1.0 + (1.0 - x).sqrt());
                let m = TAU * (pixel.jitter[2] + f64::from(i)) * pixel.step_px.x * pixel.step_px.y / directions;
                m * omega
            };
            solid_angles * n.dot(sample.D / distance).max(0.0)
        })
        .sum()
}
