//! The float64 twin of `glsl/edges.frag`: edge detection, ShaderX7 6.2 (Multisample antialiasing).

use super::sampling::{EXACT, Shift};
use crate::Error;
use crate::image::Image;
use crate::projection::Projection;
use crate::settings::Settings;

/// Finds the edge pixels: a pixel is an edge if its depth samples span more than the blur's depth sigma, or if some of
/// them lie on a surface and some on background. `samples` holds one image for each sample, of linear depth, +infinity
/// on background. The images have the same size, which is that of the result. Without images the result is empty.
///
/// # Errors
/// [`Error::Usage`] if the depth sigma follows from a radius in percent.
pub fn edges(samples: &[Image<f32>], projection: Projection, settings: &Settings) -> Result<Image<bool>, Error> {
    shifted(samples, projection, settings, EXACT)
}

/// Finds the edges as [`edges`] does, with a depth sigma that is larger by the factor 1 + `shift.comparison`.
pub(super) fn shifted(
    samples: &[Image<f32>],
    projection: Projection,
    settings: &Settings,
    shift: Shift,
) -> Result<Image<bool>, Error> {
    let sigma = settings.depth_sigma(projection)?;
    let is_edge = |x: usize, y: usize| {
        let depths = || samples.iter().map(|image| f64::from(image.at(x, y)));
        let (nearest, farthest) = (depths().fold(f64::INFINITY, f64::min), depths().fold(0.0, f64::max));
        // If some samples lie on background, the difference is infinite. If all do, it is NaN, and the comparison is
        // false.
        farthest - nearest > sigma.at(nearest) * (1.0 + shift.comparison)
    };
    let (width, height) = samples.first().map_or((0, 0), |image| (image.width, image.height));
    Ok(Image::from_fn(width, height, is_edge))
}
