//! The float64 twin of `glsl/blur.frag`: two blurs of ambient occlusion that respect depth. One is the cross-bilateral
//! blur of ShaderX7 6.2, in X and Y or over the whole square, whose weights are Gaussian in the image and in depth. The
//! other is the 4x4 blur of 6.1, whose taps all have the same weight. Both can upsample from half resolution, and both
//! can supersample on edge pixels.
#![allow(non_snake_case)]

use super::edges;
use super::sampling::{EXACT, Shift};
use crate::Error;
use crate::image::Image;
use crate::projection::Projection;
use crate::settings::{BlurKernel, Edges, Length, MethodBlur, Settings};
use crate::threads::on_all_cores;
use rayon::prelude::*;

/// Blurs `ao` as the settings say, with weights from `depth`, and upsamples it to the size of `depth`. Depth is linear,
/// and +infinity on background, where the result is 1. `samples` holds one image for each depth sample of the pixels.
/// If it is empty, no pixel is an edge. If the settings ask for no blur, `ao` is returned unchanged.
///
/// # Errors
/// [`Error::Usage`] if the depth sigma follows from a radius in percent.
pub fn blur(
    ao: &Image<f64>,
    depth: &Image<impl Copy + Into<f64>>,
    samples: &[Image<f32>],
    projection: Projection,
    settings: &Settings,
) -> Result<Image<f64>, Error> {
    shifted(ao, &depth.map(Into::into), samples, projection, settings, EXACT)
}

/// Finds the pixels at which the blur can move by more than 1e-3 when its comparisons are shifted by 1e-5 relative. At
/// such a pixel two taps are equally near in depth as far as float32 can tell, or the sum of weights is about 1e-6, or
/// a difference in depth is about sigma.
///
/// # Errors
/// The same as for [`blur`].
pub fn ambiguous(
    ao: &Image<f64>,
    depth: &Image<impl Copy + Into<f64>>,
    samples: &[Image<f32>],
    projection: Projection,
    settings: &Settings,
) -> Result<Image<bool>, Error> {
    let depth = &depth.map(Into::into);
    let of = |comparison| shifted(ao, depth, samples, projection, settings, Shift { rounding: 0.0, comparison });
    let [exact, low, high] = [of(0.0)?, of(-1e-5)?, of(1e-5)?];
    let moves = |x: usize, y: usize| {
        let exact = exact.at(x, y);
        [low.at(x, y), high.at(x, y)].iter().any(|moved| (moved - exact).abs() > 1e-3)
    };
    Ok(Image::from_fn(exact.width, exact.height, moves))
}

/// Computes [`blur`] with shifted comparisons.
fn shifted(
    ao: &Image<f64>,
    depth: &Image<f64>,
    samples: &[Image<f32>],
    projection: Projection,
    settings: &Settings,
    shift: Shift,
) -> Result<Image<f64>, Error> {
    let sigma = settings.depth_sigma(projection)?;
    let radius = i64::from(settings.blur / 2);
    let scale = i64::from(settings.ao_scale());
    let own = settings.method.facts().blur;
    if settings.blur == 0 || own == MethodBlur::None {
        return Ok(ao.clone());
    }
    let square =
        if own == MethodBlur::Crysis { Taps::Crysis } else { Taps::Gaussian { radius, reach: [radius, radius] } };
    let (half, full) = ([scale; 2], [1; 2]);
    let mut blurred = match (own, settings.blur_kernel) {
        (MethodBlur::Crysis, _) | (_, BlurKernel::Full) => {
            Pass { ao, depth, sigma, shift, taps: square, from: half, to: full }.everywhere()
        }
        (_, BlurKernel::Separable) => {
            let x = Taps::Gaussian { radius, reach: [radius, 0] };
            let y = Taps::Gaussian { radius, reach: [0, radius] };
            // From half resolution, the pass in X fills in columns, and the pass in Y fills in rows.
            let rows = Pass { ao, depth, sigma, shift, taps: x, from: half, to: [1, scale] }.everywhere();
            Pass { ao: &rows, depth, sigma, shift, taps: y, from: [1, scale], to: full }.everywhere()
        }
    };
    if !samples.is_empty() && settings.edges == Edges::Supersample {
        let edges = edges::shifted(samples, projection, settings, shift)?;
        let whole = Pass { ao, depth, sigma, shift, taps: square, from: half, to: full };
        for (i, blurred) in blurred.texels.iter_mut().enumerate().filter(|&(i, _)| edges.texels[i]) {
            let (x, y) = ((i % depth.width) as i64, (i / depth.width) as i64);
            let around = samples.iter().map(|image| whole.around(x, y, f64::from(image.texels[i])));
            *blurred = around.sum::<f64>() / samples.len() as f64;
        }
    }
    Ok(blurred)
}

/// The taps that a pass takes, and their weights in the image.
#[derive(Clone, Copy)]
enum Taps {
    /// A Gaussian kernel of this radius in pixels. The taps lie within `reach` pixels in x and y.
    Gaussian { radius: i64, reach: [i64; 2] },
    /// The 4x4 texels of Crysis, all with the same weight: from two texels before the pixel's own to one after it.
    Crysis,
}

/// One pass. One texel of `ao` stands for `from` pixels in x and y, and one texel of the result for `to` pixels: texel
/// (i, j) stands for the pixel at `from` or `to` times (i, j).
struct Pass<'a> {
    ao: &'a Image<f64>,
    depth: &'a Image<f64>,
    sigma: Length,
    shift: Shift,
    taps: Taps,
    from: [i64; 2],
    to: [i64; 2],
}

impl Pass<'_> {
    /// Blurs the whole image, each pixel around its own depth.
    fn everywhere(&self) -> Image<f64> {
        let width = self.depth.width.div_ceil(self.to[0] as usize);
        let height = self.depth.height.div_ceil(self.to[1] as usize);
        let texel = |i: usize| {
            let (x, y) = ((i % width) as i64 * self.to[0], (i / width) as i64 * self.to[1]);
            self.around(x, y, self.depth.at(x as usize, y as usize))
        };
        let texels = on_all_cores(|| (0..width * height).into_par_iter().map(texel).collect());
        Image { width, height, texels }
    }

    /// Blurs the pixel (x, y) around the depth z.
    fn around(&self, x: i64, y: i64, z: f64) -> f64 {
        if z.is_infinite() {
            return 1.0;
        }
        let shift = self.shift.comparison;
        let (mut sum, mut weights) = (0.0, 0.0);
        let (mut nearest, mut nearest_distance) = (1.0, f64::INFINITY);
        for (i, j, in_image) in self.taps_about(x, y) {
            // The depth of a tap is the depth of the pixel at which its A was computed.
            let (tap_x, tap_y) = (i * self.from[0], j * self.from[1]);
            // Taps on background and outside the image have no weight.
            let inside =
                (0..self.depth.width as i64).contains(&tap_x) && (0..self.depth.height as i64).contains(&tap_y);
            if !inside || self.depth.at(tap_x as usize, tap_y as usize).is_infinite() {
                continue;
            }
            let dz = self.depth.at(tap_x as usize, tap_y as usize) - z;
            let in_depth = match self.taps {
                Taps::Gaussian { .. } => (-(dz / self.sigma.at(z)).powi(2) / 2.0).exp(),
                Taps::Crysis => f64::from(u8::from(dz.abs() <= self.sigma.at(z) * (1.0 + shift))),
            };
            let A = self.ao.at(i as usize, j as usize);
            sum += in_image * in_depth * A;
            weights += in_image * in_depth;
            // If taps are equally near within the shift, one is chosen by the sign of the shift: the tap with the
            // greatest A for a positive shift, with the least A for a negative one.
            let as_near =
                dz.abs() < nearest_distance * (1.0 + shift.abs()) && nearest_distance < dz.abs() * (1.0 + shift.abs());
            let other = if as_near { (A - nearest) * shift > 0.0 } else { dz.abs() < nearest_distance };
            if other {
                (nearest, nearest_distance) = (A, dz.abs());
            }
        }
        if weights < 1e-6 * (1.0 + shift) { nearest } else { sum / weights }
    }

    /// Returns the positions of the taps around a pixel, in texels of `ao` and row by row, and their weights in the
    /// image.
    fn taps_about(&self, x: i64, y: i64) -> Vec<(i64, i64, f64)> {
        let mut taps = Vec::new();
        match self.taps {
            Taps::Gaussian { radius, reach } => {
                // s = (radius + 1) / 2 pixels.
                let s = (radius + 1) as f64 / 2.0;
                let home = [x / self.from[0], y / self.from[1]];
                for j in home[1] - reach[1]..=home[1] + reach[1] {
                    for i in home[0] - reach[0]..=home[0] + reach[0] {
                        let (kx, ky) = (i * self.from[0] - x, j * self.from[1] - y);
                        if kx.abs() <= radius && ky.abs() <= radius {
                            taps.push((i, j, (-(kx * kx + ky * ky) as f64 / (2.0 * s * s)).exp()));
                        }
                    }
                }
            }
            Taps::Crysis => {
                // The 4x4 taps are not symmetric: two lie before `home` and one after it. For a pixel that is the
                // second of the two pixels its texel stands for, the taps are therefore taken around the next texel.
                let home = [(x + self.from[0] - 1) / self.from[0], (y + self.from[1] - 1) / self.from[1]];
                for j in -2..=1 {
                    taps.extend((-2..=1).map(|i| (home[0] + i, home[1] + j, 1.0)));
                }
            }
        }
        taps
    }
}
