//! The float64 twin of `glsl/blur.frag`: the cross-bilateral blur, ShaderX7 6.2, separated and in full.

use crate::Error;
use crate::image::Image;
use crate::settings::{BlurKernel, DepthSigma, Settings};
use rayon::prelude::*;

/// Blurs `ao` as the settings say, with the weights of `depth` (linear, infinite on background). Background is 1.
///
/// # Errors
/// A depth sigma that follows from a radius in percent.
pub fn blur(ao: &Image<f64>, depth: &Image<f32>, settings: &Settings) -> Result<Image<f64>, Error> {
    let sigma = settings.depth_sigma()?;
    let radius = i64::from(settings.blur / 2);
    Ok(match (settings.blur, settings.blur_kernel) {
        (0, _) => ao.clone(),
        (_, BlurKernel::Separable) => {
            let x = pass(ao, depth, sigma, radius, [radius, 0]);
            pass(&x, depth, sigma, radius, [0, radius])
        }
        (_, BlurKernel::Full) => pass(ao, depth, sigma, radius, [radius, radius]),
    })
}

/// One pass over the taps within `reach` of each pixel in x and y.
fn pass(ao: &Image<f64>, depth: &Image<f32>, sigma: DepthSigma, radius: i64, reach: [i64; 2]) -> Image<f64> {
    let (width, height) = (ao.width as i64, ao.height as i64);
    // s = (radius + 1) / 2 texels.
    let s = (radius + 1) as f64 / 2.0;
    let blurred = |x: i64, y: i64| {
        let z = f64::from(depth.at(x as usize, y as usize));
        if z.is_infinite() {
            return 1.0;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for ky in -reach[1]..=reach[1] {
            for kx in -reach[0]..=reach[0] {
                let (tap_x, tap_y) = (x + kx, y + ky);
                // Taps outside the image and on background weigh nothing.
                if !(0..width).contains(&tap_x) || !(0..height).contains(&tap_y) {
                    continue;
                }
                let tap_z = f64::from(depth.at(tap_x as usize, tap_y as usize));
                if tap_z.is_infinite() {
                    continue;
                }
                let weight = (-(kx * kx + ky * ky) as f64 / (2.0 * s * s)).exp()
                    * (-((tap_z - z) / sigma.at(z)).powi(2) / 2.0).exp();
                sum += weight * ao.at(tap_x as usize, tap_y as usize);
                weights += weight;
            }
        }
        sum / weights
    };
    let texels = (0..width * height).into_par_iter().map(|i| blurred(i % width, i / width)).collect();
    Image { width: ao.width, height: ao.height, texels }
}
