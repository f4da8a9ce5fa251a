//! The float64 twin of `glsl/edges.frag`: edge detection, ShaderX7 6.2 (Multisample antialiasing).

use super::sampling::{EXACT, Shift};
use crate::Error;
use crate::image::Image;
use crate::settings::Settings;

/// Finds the edge pixels: those whose depth samples span more than the blur's depth sigma, or where some lie on a
/// surface and some on background. `samples` holds one image for each sample, of linear depth, +infinity on background.
/// The images have the same size, which is that of the result. Without images the result is empty.
///
/// # Errors
/// [`Error::Usage`] if the depth sigma follows from a radius in percent.
pub fn edges(samples: &[Image<f32>], settings: &Settings) -> Result<Image<bool>, Error> {
    shifted(samples, settings, EXACT)
}

/// [`edges`] with a depth sigma that is larger by the share `shift.comparison`.
pub(super) fn shifted(samples: &[Image<f32>], settings: &Settings, shift: Shift) -> Result<Image<bool>, Error> {
    let sigma = settings.depth_sigma()?;
    let is_edge = |x: usize, y: usize| {
        let depths = || samples.iter().map(|image| f64::from(image.at(x, y)));
        let (nearest, farthest) = (depths().fold(f64::INFINITY, f64::min), depths().fold(0.0, f64::max));
        // The difference is infinite where some samples lie on background. It is NaN where all do, and the comparison
        // is then false.
        farthest - nearest > sigma.at(nearest) * (1.0 + shift.comparison)
    };
    let (width, height) = samples.first().map_or((0, 0), |image| (image.width, image.height));
    Ok(Image::from_fn(width, height, is_edge))
}
