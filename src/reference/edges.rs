//! The float64 twin of `glsl/edges.frag`: the pixels that hold more than one surface.

use super::sampling::{EXACT, Shift};
use crate::Error;
use crate::image::Image;
use crate::settings::Settings;

/// True where a pixel's depth samples (an image for each, linear, infinite on background) span more than the blur's
/// depth sigma, or mix surface and background.
///
/// # Errors
/// A depth sigma that follows from a radius in percent.
pub fn edges(samples: &[Image<f32>], settings: &Settings) -> Result<Image<bool>, Error> {
    shifted(samples, settings, EXACT)
}

/// The same, the span compared with a sigma that is larger by the shift's share.
pub(super) fn shifted(samples: &[Image<f32>], settings: &Settings, shift: Shift) -> Result<Image<bool>, Error> {
    let sigma = settings.depth_sigma()?;
    let is_edge = |x: usize, y: usize| {
        let depths = || samples.iter().map(|image| f64::from(image.at(x, y)));
        let (nearest, farthest) = (depths().fold(f64::INFINITY, f64::min), depths().fold(0.0, f64::max));
        // Infinity where surface and background mix; where all is background, no number.
        farthest - nearest > sigma.at(nearest) * (1.0 + shift.comparison)
    };
    let (width, height) = samples.first().map_or((0, 0), |image| (image.width, image.height));
    Ok(Image::from_fn(width, height, is_edge))
}
