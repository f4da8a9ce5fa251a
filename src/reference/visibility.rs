//! Computes the ambient occlusion of an image by the twins, and finds the pixels where float32 may differ from them.

use super::inputs::TwinInputs;
use super::sampling::{EXACT, MethodScene, Pixel, Shift};
use super::terms::Terms;
use crate::Error;
use crate::image::Image;
use crate::settings::Settings;
use crate::threads::on_all_cores;
use rayon::prelude::*;

/// Computes visibility A in [0, 1] by the method of the settings, before any blur. Background is 1. At half resolution
/// the image has half the width and height of the inputs, rounded up.
///
/// # Errors
/// [`Error::Usage`] if the radius is in percent, or if the images have different sizes.
pub fn visibility<F: Copy + Into<f64>>(inputs: &TwinInputs<F>, settings: &Settings) -> Result<Image<f64>, Error> {
    let scene = MethodScene::new(inputs, settings)?;
    let Some(method) = Terms::of(settings) else { return Ok(image(&scene, |_, _| 1.0)) };
    Ok(image(&scene, |x, y| {
        let Some(pixel) = scene.pixel(x, y) else { return 1.0 };
        method.at(&scene, &pixel)
    }))
}

/// Finds the ambiguous pixels, at which float32 may round or compare otherwise than float64. A pixel is ambiguous if A
/// can change by more than 1e-3 when all values are shifted by 1e-5 relative before they are rounded or compared. The
/// values are shifted up and down, for each direction or sample separately.
///
/// # Errors
/// The same as for [`visibility`].
pub fn ambiguous<F: Copy + Into<f64>>(inputs: &TwinInputs<F>, settings: &Settings) -> Result<Image<bool>, Error> {
    let scene = MethodScene::new(inputs, settings)?;
    let Some(method) = Terms::of(settings) else { return Ok(image(&scene, |_, _| false)) };
    let shifts = [[1e-5, 1e-5], [1e-5, -1e-5], [-1e-5, 1e-5], [-1e-5, -1e-5]]
        .map(|[rounding, comparison]| Shift { rounding, comparison });
    let occlusion = |pixel: &Pixel, k, shift| (method.occlusion)(&scene, pixel, k, shift, &mut ());
    Ok(image(&scene, |x, y| {
        let Some(pixel) = scene.pixel(x, y) else { return false };
        let exits = shifts.map(|shift| pixel.exits_early(shift));
        if exits.iter().all(|&exits| exits) {
            return false;
        }
        let turned = shifts.map(|shift| scene.pixel_shifted(x, y, shift));
        let moves: f64 = (0..method.count)
            .map(|k| {
                // If the early exit itself is in doubt, A may change by the whole occlusion.
                let exact = if exits.contains(&true) { 0.0 } else { occlusion(&pixel, k, EXACT) };
                let shifted = shifts
                    .iter()
                    .zip(&turned)
                    .map(|(&shift, turned)| occlusion(turned.as_ref().unwrap_or(&pixel), k, shift));
                shifted.map(|term| (term - exact).abs()).fold(0.0, f64::max)
            })
            .sum();
        method.steepest() * moves > 1e-3
    }))
}

fn image<T: Copy + Send>(scene: &MethodScene, texel: impl Fn(usize, usize) -> T + Sync) -> Image<T> {
    let (width, height) = scene.size();
    let texels = on_all_cores(|| (0..width * height).into_par_iter().map(|i| texel(i % width, i / width)).collect());
    Image { width, height, texels }
}
