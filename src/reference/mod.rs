//! The same equations in float64 on the CPU, without OpenGL: a twin by name of each pass, and ray casting. They are
//! written to be read beside the shaders and to be right, not to be fast.
#![doc = include_str!("departures.md")]

pub mod anatomy;
pub mod blur;
mod converged;
pub mod edges;
pub mod gbuffer;
mod hbao;
mod hbao_talk;
mod microsphere;
mod ray_march;
mod sampling;
pub(crate) mod ssao;
pub mod trace;
pub mod truth;

pub use converged::converged;

use crate::Error;
use crate::image::Image;
use crate::scene::Projection;
use crate::settings::{Method, Settings, Toggle};
use rayon::prelude::*;
use sampling::{EXACT, Pixel, Scene, Shift};
use std::f64::consts::PI;

/// The images that ambient occlusion is computed from, all of one size. In float32 they are what a G-buffer holds; in
/// float64 nothing has been rounded yet.
#[derive(Clone, Copy)]
pub struct Inputs<'a, F = f32> {
    /// Linear eye-space z; infinite on background.
    pub depth: &'a Image<F>,
    /// Eye-space normals, of any length.
    pub normals: &'a Image<[F; 3]>,
    /// The 4x4 rotation tile, of the settings' method ([`crate::rotation_tile`]).
    pub tile: &'a Image<[f32; 3]>,
    /// The view's projection.
    pub projection: Projection,
    /// The near plane's z, for `ray-march`.
    pub near: f64,
}

/// Visibility A in [0, 1] by the settings' method, before any blur; 1 on background. At half resolution the image has
/// half the inputs' width and height, rounded up.
///
/// # Errors
/// A radius in percent, or images of different sizes.
pub fn visibility<F: Copy + Into<f64>>(inputs: &Inputs<F>, settings: &Settings) -> Result<Image<f64>, Error> {
    let scene = Scene::new(inputs, settings)?;
    let Some(method) = Terms::of(settings) else { return Ok(image(&scene, |_, _| 1.0)) };
    Ok(image(&scene, |x, y| {
        let Some(pixel) = scene.pixel(x, y) else { return 1.0 };
        if method.exits_early(&pixel, EXACT) {
            return 1.0;
        }
        let occlusion: f64 = (0..method.count).map(|k| (method.occlusion)(&scene, &pixel, k, EXACT)).sum();
        method.visibility(occlusion)
    }))
}

/// The pixels at which A can move by more than 1e-3 when roundings and comparisons are shifted by 1e-5 relative,
/// either way and in each direction or sample apart: where float32 may decide otherwise than float64.
///
/// # Errors
/// As [`visibility`].
pub fn ambiguous<F: Copy + Into<f64>>(inputs: &Inputs<F>, settings: &Settings) -> Result<Image<bool>, Error> {
    let scene = Scene::new(inputs, settings)?;
    let Some(method) = Terms::of(settings) else { return Ok(image(&scene, |_, _| false)) };
    let shifts = [[1e-5, 1e-5], [1e-5, -1e-5], [-1e-5, 1e-5], [-1e-5, -1e-5]]
        .map(|[rounding, comparison]| Shift { rounding, comparison });
    Ok(image(&scene, |x, y| {
        let Some(pixel) = scene.pixel(x, y) else { return false };
        let exits = shifts.map(|shift| method.exits_early(&pixel, shift));
        if exits.iter().all(|&exits| exits) {
            return false;
        }
        let turned = shifts.map(|shift| scene.pixel_shifted(x, y, shift));
        let moves: f64 = (0..method.count)
            .map(|k| {
                // Where the exit itself is in doubt, the whole occlusion is.
                let exact = if exits.contains(&true) { 0.0 } else { (method.occlusion)(&scene, &pixel, k, EXACT) };
                let shifted = shifts
                    .iter()
                    .zip(&turned)
                    .map(|(&shift, turned)| (method.occlusion)(&scene, turned.as_ref().unwrap_or(&pixel), k, shift));
                shifted.map(|term| (term - exact).abs()).fold(0.0, f64::max)
            })
            .sum();
        method.steepest() * moves > 1e-3
    }))
}

/// The occlusion of a pixel in one direction, or by one sample.
type Occlusion = fn(&Scene, &Pixel, u32, Shift) -> f64;

/// A method: A = 1 - scale times the sum of its occlusion in each direction, or by each sample.
struct Terms {
    occlusion: Occlusion,
    /// The directions or samples.
    count: u32,
    scale: f64,
    /// Whether A = 1 where a step is below a texel (6.2, Variable step size).
    early_exit: bool,
    /// Whether it ends with A^2 + A (6.1).
    curve: bool,
}

impl Terms {
    /// None where A = 1 everywhere.
    fn of(settings: &Settings) -> Option<Terms> {
        let (strength, directions) = (settings.strength, f64::from(settings.directions));
        let (occlusion, scale): (Occlusion, f64) = match settings.method {
            Method::Hbao => (hbao::occlusion, strength / directions),
            Method::HbaoTalk => (hbao_talk::occlusion, strength / directions),
            Method::RayMarch => (ray_march::occlusion, strength / (directions * f64::from(settings.rays))),
            Method::Microsphere | Method::Crease => (microsphere::occlusion, strength / PI),
            Method::Ssao => (ssao::occlusion, 1.0 / f64::from(settings.ssao_samples)),
            Method::None => return None,
        };
        let samples = settings.method == Method::Ssao;
        Some(Terms {
            occlusion,
            count: if samples { settings.ssao_samples } else { settings.directions },
            scale,
            early_exit: !matches!(settings.method, Method::RayMarch | Method::Ssao),
            curve: samples && settings.ssao_curve == Toggle::On,
        })
    }

    fn visibility(&self, occlusion: f64) -> f64 {
        let open = (1.0 - self.scale * occlusion).clamp(0.0, 1.0);
        if self.curve { (open * open + open).min(1.0) } else { open }
    }

    /// By how much A can move for each 1 of occlusion: A^2 + A rises by sqrt(5) where it reaches 1.
    fn steepest(&self) -> f64 {
        if self.curve { 5f64.sqrt() * self.scale } else { self.scale }
    }

    fn exits_early(&self, pixel: &Pixel, shift: Shift) -> bool {
        self.early_exit && pixel.step_px.min_element() < 1.0 + shift.comparison
    }
}

fn image<T: Copy + Send>(scene: &Scene, texel: impl Fn(usize, usize) -> T + Sync) -> Image<T> {
    let (width, height) = scene.size();
    let texels = (0..width * height).into_par_iter().map(|i| texel(i % width, i / width)).collect();
    Image { width, height, texels }
}
