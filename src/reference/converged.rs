//! Computes the result to which a method converges on a depth image, when more samples would change nothing. It
//! separates the error of too few samples from the error of the method itself.
//!
//! The converged method takes 64 directions and, in each, a sample at every texel from the first to R. It has no jitter
//! and no early exit, and runs at full resolution.
//!
//! Each sample is rounded to a texel centre by itself. If the step of one texel were rounded once, the samples would
//! lie in 8 directions only, however many directions there are. But a sample near P that is rounded by itself may lie
//! up to 22 degrees beside its direction, and the tangent in that direction is another. With infinitely small texels
//! the sample would lie in its direction. Therefore each sample is measured from the tangent towards itself, also in
//! those places where the passes compare it with the direction's tangent. Otherwise the texels of a tilted plane would
//! raise the horizon and hide what is low and near, however fine the image is: in a valley of 90 degrees A would be too
//! large by 0.013.
//!
//! For the same reason each sample of `hbao-view` is measured in the slice of its own azimuth. In the limit its spacing
//! and its quadrature make no difference.
//!
//! In this limit Eq. 6.2.8 and 6.2.9 (`grounding`) are the same, and nothing occludes a plane in the talk's method,
//! too.

use super::inputs::TwinInputs;
use super::sampling::{EXACT, MethodScene, Pixel};
use super::terms::Terms;
use super::twin::Converged;
use crate::Error;
use crate::settings::{Clamp, Method, Settings, Snap};
use crate::threads::on_all_cores;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// N_d of the converged method: the most directions that the settings allow.
const DIRECTIONS: u32 = 64;

/// The largest number of steps. With more steps, one pixel would take seconds and an image would take days.
const MOST_STEPS: u32 = 1 << 20;

/// Computes converged visibility A, by the method of the settings, at the pixels of these indices (y * width + x, y
/// up). Background is 1. Of the settings it reads the method, R, attenuation, strength, bias, clamp and zenith.
///
/// `microsphere` converges to the integral, over the disc of radius R, of the occlusion that a texel's sphere adds,
/// because a sample stands for i step_px^2 2 pi / N_d texels. `crease` converges to the mean of its samples along R,
/// because each has the weight 1 / (N_d N_s). `none` is 1.
///
/// # Errors
/// [`Error::Usage`] in these cases:
///
/// - The method has no converged form. For `ray-march` the number of rays would have to grow together with the
///   directions and steps, and `ssao` has a fixed set of offsets.
/// - A pixel needs more than 2^20 steps to reach R.
/// - A pixel lies outside the image.
/// - The radius is in percent, or the images have different sizes.
pub fn converged(inputs: &TwinInputs, settings: &Settings, pixels: &[usize]) -> Result<Vec<f64>, Error> {
    let settings =
        Settings { directions: DIRECTIONS, snap: Snap::Sample, spacing: 1.0, half_res: false, ..settings.clone() };
    let scene = MethodScene::new(inputs, &settings)?;
    let (width, height) = scene.size();
    if let Some(outside) = pixels.iter().find(|&&i| i >= width * height) {
        return Err(Error::Usage(format!("pixel {outside} lies outside the image of {width}x{height}")));
    }
    let Some(method) = Terms::of(&settings) else { return Ok(vec![1.0; pixels.len()]) };
    let Some(Converged { occlusion, ignores_repeats }) = method.converged else {
        let having: Vec<_> = Method::ALL.iter().filter(|&&method| converges(method)).map(|m| m.name()).collect();
        return Err(Error::Usage(format!(
            "{} has no converged form; the methods that have one are {}",
            settings.method.name(),
            having.join(", ")
        )));
    };
    let refined = |&i: &usize| Some(at_every_texel(&scene, scene.pixel(i % width, i / width)?, ignores_repeats));
    let wanted = |i: &usize| refined(i).map_or(0, |pixel| pixel.steps);
    if pixels.iter().map(wanted).max() > Some(MOST_STEPS) {
        return Err(Error::Usage(format!("R covers more than {MOST_STEPS} texels: use a smaller radius or image")));
    }
    let visibility = |i: &usize| {
        let Some(pixel) = refined(i) else { return 1.0 };
        method.visibility((0..method.count).map(|k| occlusion(&scene, &pixel, k, EXACT, &mut ())).sum())
    };
    Ok(on_all_cores(|| pixels.par_iter().map(visibility).collect()))
}

/// Returns whether [`converged`] can compute the method.
#[must_use]
pub fn converges(method: Method) -> bool {
    Terms::of(&Settings { method, ..Settings::default() }).is_none_or(|terms| terms.converged.is_some())
}

/// Returns the pixel without jitter, with a step of one texel and as many steps as R has texels.
fn at_every_texel(scene: &MethodScene, pixel: Pixel, ignores_repeats: bool) -> Pixel {
    let radius = scene.radius_in_texels(pixel.P.z);
    let texels = radius.max_element();
    let step_px = radius / texels;
    // Beyond the border a clamped sample slides along the border to a corner. It gets there, at the latest, after as
    // many steps as the image's longer side divided by the least slope of a direction. From there on all samples are
    // the same, and no horizon rises any more. R may be far longer than that.
    let (width, height) = scene.size();
    let slope = (TAU / f64::from(DIRECTIONS)).sin() * step_px.min_element();
    let corner = width.max(height) as f64 / slope + 1.0;
    let last = if ignores_repeats && scene.settings.clamp == Clamp::Position { texels.min(corner) } else { texels };
    Pixel { steps: last as u32, step_px, jitter: [1.0, 0.0, 0.0], ..pixel }
}
