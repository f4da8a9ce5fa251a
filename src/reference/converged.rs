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

use super::sampling::{EXACT, Pixel, Scene, Shift};
use super::{Inputs, Occlusion, Terms};
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
    let wanted = |&i: &usize| scene.pixel(i % width, i / width).map_or(0, |pixel| at_every_texel(&scene, pixel).steps);
    if pixels.iter().map(wanted).max() > Some(MOST_STEPS) {
        return Err(Error::Usage(format!("R covers more than {MOST_STEPS} texels: too many to take a sample at each")));
    }
    let occlusion: Occlusion = match settings.method {
        Method::Hbao => hbao,
        Method::HbaoTalk => hbao_talk,
        Method::Microsphere | Method::Crease => method.occlusion,
        Method::RayMarch | Method::Ssao | Method::None => {
            return Err(Error::Usage(format!(
                "{} has no converged form: hbao, hbao-talk, microsphere, crease and none have one",
                settings.method.name()
            )));
        }
    };
    let visibility = |&i: &usize| {
        let Some(pixel) = scene.pixel(i % width, i / width) else { return 1.0 };
        let pixel = at_every_texel(&scene, pixel);
        method.visibility((0..method.count).map(|k| occlusion(&scene, &pixel, k, EXACT)).sum())
    };
    Ok(pixels.par_iter().map(visibility).collect())
}

/// The pixel with a step of one texel and as many of them as R has, unjittered.
fn at_every_texel(scene: &Scene, pixel: Pixel) -> Pixel {
    let radius = scene.radius_in_texels(pixel.P.z);
    let texels = radius.max_element();
    let step_px = radius / texels;
    let horizon = matches!(scene.settings.method, Method::Hbao | Method::HbaoTalk);
    // Beyond the border a clamped sample slides along it to a corner, at the latest after the image's side over the
    // least slope of a direction; then it is the same for ever, and no horizon rises. R may be far longer than that.
    let (width, height) = scene.size();
    let slope = (TAU / f64::from(DIRECTIONS)).sin() * step_px.min_element();
    let corner = width.max(height) as f64 / slope + 1.0;
    let last = if horizon && scene.settings.clamp == Clamp::Position { texels.min(corner) } else { texels };
    Pixel { steps: last as u32, step_px, jitter: [1.0, 0.0, 0.0], ..pixel }
}

/// Eq. 6.2.9 in direction k.
fn hbao(scene: &Scene, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
    let mut previous = 0.0;
    let increments = horizons(scene, pixel, k, shift).map(|(rise, r)| {
        let increment = scene.attenuation(r) * (rise - previous);
        previous = rise;
        increment
    });
    increments.sum()
}

/// Eq. 3 of the talk in direction k: all of the rise by the weight of the highest.
fn hbao_talk(scene: &Scene, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
    horizons(scene, pixel, k, shift).last().map_or(0.0, |(rise, r)| rise * scene.attenuation(r))
}

/// The samples within R of direction k that rise above all before them: by how much over the tangent, and how far away.
fn horizons(scene: &Scene, pixel: &Pixel, k: u32, shift: Shift) -> impl Iterator<Item = (f64, f64)> {
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
