//! What a method comes to on a depth image when more samples would change nothing: the yardstick that tells the error
//! of too few samples from the error of the method itself.
//!
//! 64 directions, in each a sample every texel from the first to R, no jitter and no early exit, at full resolution.
//! Each sample is snapped by itself: a step of one texel that is rounded once points in 8 directions only, whatever
//! their number. Snapped so, the nearest samples lie up to 22 degrees beside their direction, where the surface has
//! another tangent. With infinitely small texels they would lie in it; so a sample's height is that over its own
//! tangent throughout, where the passes compare it with the direction's. Otherwise a tilted plane's own texels would
//! raise the horizon, and hide what is low and near, however fine the image: in a valley of 90 degrees A is too open by
//! 0.013 so. Eq. 6.2.8 and 6.2.9 (`grounding`) are one in this limit, and a plane is open in the talk's method too.

use super::inputs::Inputs;
use super::sampling::{EXACT, Pixel, Scene};
use super::terms::Terms;
use super::twin::Converged;
use crate::Error;
use crate::settings::{Clamp, Method, Settings, Snap};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// N_d of the converged method: the most that the method itself takes.
const DIRECTIONS: u32 = 64;

/// A pixel of more would take seconds, and an image days.
const MOST_STEPS: u32 = 1 << 20;

/// Visibility A by the settings' method, converged, of the pixels of these indices (y * width + x, y up); 1 on
/// background. Of the settings it reads the method, R, attenuation, strength, bias and clamp.
///
/// `microsphere` converges too, to the integral over the disc of radius R of what a texel's sphere adds, since a sample
/// stands for i step_px^2 2 pi / N_d texels; and `crease` to the mean of its samples along R, since each weighs
/// 1 / (N_d N_s). `none` is 1.
///
/// # Errors
/// A method without a converged form: `ray-march`, whose rays would have to grow in number beside directions and steps,
/// and `ssao`, whose offsets are those that there are. A pixel outside the image; and as [`super::visibility`].
pub fn converged(inputs: &Inputs, settings: &Settings, pixels: &[usize]) -> Result<Vec<f64>, Error> {
    let settings = Settings { directions: DIRECTIONS, snap: Snap::Sample, half_res: false, ..settings.clone() };
    let scene = Scene::new(inputs, &settings)?;
    let (width, height) = scene.size();
    if let Some(outside) = pixels.iter().find(|&&i| i >= width * height) {
        return Err(Error::Usage(format!("pixel {outside} lies outside the image of {width}x{height}")));
    }
    let Some(method) = Terms::of(&settings) else { return Ok(vec![1.0; pixels.len()]) };
    let Some(Converged { occlusion, ignores_repeats }) = method.converged else {
        let having: Vec<_> = Method::ALL.iter().filter(|&&method| converges(method)).map(|m| m.name()).collect();
        return Err(Error::Usage(format!(
            "{} has no converged form: these methods have one: {}",
            settings.method.name(),
            having.join(", ")
        )));
    };
    let refined = |&i: &usize| Some(at_every_texel(&scene, scene.pixel(i % width, i / width)?, ignores_repeats));
    let wanted = |i: &usize| refined(i).map_or(0, |pixel| pixel.steps);
    if pixels.iter().map(wanted).max() > Some(MOST_STEPS) {
        return Err(Error::Usage(format!("R covers more than {MOST_STEPS} texels: too many to take a sample at each")));
    }
    let visibility = |i: &usize| {
        let Some(pixel) = refined(i) else { return 1.0 };
        method.visibility((0..method.count).map(|k| occlusion(&scene, &pixel, k, EXACT)).sum())
    };
    Ok(pixels.par_iter().map(visibility).collect())
}

/// Whether a method has a converged form, as [`converged`] computes it.
#[must_use]
pub fn converges(method: Method) -> bool {
    Terms::of(&Settings { method, ..Settings::default() }).is_none_or(|terms| terms.converged.is_some())
}

/// The pixel with a step of one texel and as many of them as R has, unjittered.
fn at_every_texel(scene: &Scene, pixel: Pixel, ignores_repeats: bool) -> Pixel {
    let radius = scene.radius_in_texels(pixel.P.z);
    let texels = radius.max_element();
    let step_px = radius / texels;
    // Beyond the border a clamped sample slides along it to a corner, at the latest after the image's side over the
    // least slope of a direction; then it is the same for ever, and no horizon rises. R may be far longer than that.
    let (width, height) = scene.size();
    let slope = (TAU / f64::from(DIRECTIONS)).sin() * step_px.min_element();
    let corner = width.max(height) as f64 / slope + 1.0;
    let last = if ignores_repeats && scene.settings.clamp == Clamp::Position { texels.min(corner) } else { texels };
    Pixel { steps: last as u32, step_px, jitter: [1.0, 0.0, 0.0], ..pixel }
}
