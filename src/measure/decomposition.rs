//! Decomposes the error of ambient occlusion by its causes: the method itself, too few samples, the blur, and 8-bit
//! formats.
//!
//! Five images form a chain: the ray-traced truth; the converged method ([`reference::converged`]) on a float G-buffer;
//! the method with its own number of samples, before the blur, in float; the same after the blur, in float; and the
//! shown image, with the formats of the settings. Each part of the error is the difference between two neighbours in
//! this chain. At each pixel the parts therefore add up to the whole error, and the biases of the parts add up to the
//! total bias. The squares of the RMSEs do not add up to the square of the total RMSE: [`Decomposition::cross`] is the
//! remainder.

use super::Shot;
use super::gbuffers::GBuffers;
use crate::ambient_occlusion::Extras;
use crate::image::Image;
use crate::settings::{AoFormat, DepthFormat, NormalFormat, Settings};
use crate::{AmbientOcclusion, Error, Inputs, Timers, reference, rotation_tile};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;
use std::sync::Arc;

/// The seed of the random choice of pixels. It is fixed, so that every run chooses the same pixels.
const SEED: u128 = 0x6465_636f_6d70_2008;

/// One part of the error, or the whole error, in units of visibility.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorPart {
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The mean difference. It is above 0 if this part makes the image lighter.
    pub bias: f64,
    /// The largest absolute difference.
    pub max: f64,
}

impl ErrorPart {
    fn of(differences: &[f64]) -> ErrorPart {
        let mean = |f: &dyn Fn(f64) -> f64| differences.iter().map(|&d| f(d)).sum::<f64>() / differences.len() as f64;
        ErrorPart {
            rmse: mean(&|d| d * d).sqrt(),
            bias: mean(&|d| d),
            max: differences.iter().fold(0.0, |max, d| max.max(d.abs())),
        }
    }
}

/// The error of one combination of settings, and its parts. The biases of the parts add up to the total bias. The
/// squares of their RMSEs and `cross` add up to the square of the total RMSE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decomposition {
    /// The difference between the converged method and the truth. It includes the noise of the truth.
    pub model: ErrorPart,
    /// The difference between the method as the settings sample it and the converged method. It is caused by the
    /// numbers of directions and steps, the jitter, the early exit and half resolution, and it includes the rounding of
    /// the passes to single precision.
    pub sampling: ErrorPart,
    /// The difference between the images after and before the blur. At half resolution the image before the blur has
    /// half the size, and its texel (x/2, y/2) is compared with the pixel (x, y).
    pub filtering: ErrorPart,
    /// The difference between the image with the formats of the settings and the image with RGBA16F normals, R32F depth
    /// and R32F ambient occlusion.
    pub quantisation: ErrorPart,
    /// The difference between the shown image and the truth.
    pub total: ErrorPart,
    /// Twice the sum, over all pairs of parts, of the mean of their product. It is below 0 if parts cancel each other.
    pub cross: f64,
    /// How many pixels were compared.
    pub pixels: usize,
}

impl Decomposition {
    /// Decomposes the error along a chain of images, given at the same pixels.
    fn of([truth, converged, sampled, blurred, shown]: [&[f64]; 5]) -> Decomposition {
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let parts = [less(converged, truth), less(sampled, converged), less(blurred, sampled), less(shown, blurred)];
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / truth.len() as f64;
        let pairs = (0..parts.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let [model, sampling, filtering, quantisation] = [0, 1, 2, 3].map(|i| ErrorPart::of(&parts[i]));
        Decomposition {
            model,
            sampling,
            filtering,
            quantisation,
            total: ErrorPart::of(&less(shown, truth)),
            cross: pairs.map(|(i, j)| 2.0 * product(&parts[i], &parts[j])).sum(),
            pixels: truth.len(),
        }
    }
}

/// Chooses the pixels at which a view's error is decomposed: `count` random ones of the covered pixels, the same in
/// every run. If there are no more than `count` covered pixels, it chooses them all. The result is in the order of the
/// image.
///
/// The whole image would take minutes, because the converged method takes 64 R samples per pixel, with R in texels.
pub fn subset(covered: &Image<bool>, count: usize) -> Vec<usize> {
    let all: Vec<usize> = (0..covered.texels.len()).filter(|&i| covered.texels[i]).collect();
    let mut random = Pcg64Mcg::new(SEED);
    let (mut left, mut wanted) = (all.len(), count.min(all.len()));
    let chosen = |_: &usize| {
        // Each of the remaining pixels is equally likely to be chosen.
        let uniform = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let take = uniform * (left as f64) < wanted as f64;
        left -= 1;
        wanted -= usize::from(take);
        take
    };
    all.into_iter().filter(chosen).collect()
}

/// Some pixels of a view, such as those of [`subset`], and their ray-traced visibility
/// ([`reference::truth::Truth::trace`]).
#[derive(Clone, Copy, Debug)]
pub struct TruthAt<'a> {
    /// The pixels, as indices into the image.
    pub pixels: &'a [usize],
    /// The ray-traced visibility of each of these pixels.
    pub visibility: &'a [f64],
}

/// Decomposes the error of `settings` on a view, at the pixels whose truth is given.
///
/// # Errors
/// [`Error::Usage`] for a method without a converged form, for no pixels or pixels outside the image, or for a radius
/// in percent. [`Error::Gl`] if the driver refuses a shader, an allocation or a call.
pub fn decompose(
    gl: &Arc<glow::Context>,
    shot: Shot,
    settings: &Settings,
    truth: TruthAt,
) -> Result<Decomposition, Error> {
    let mut all = decompose_all(gl, shot, std::slice::from_ref(settings), truth, || {})?;
    Ok(all.remove(0))
}

/// Calls [`decompose`] for each combination in `settings`. Combinations with the same converged method share its image.
/// `progress` is called after each combination.
///
/// # Errors
/// The same as for [`decompose`].
pub fn decompose_all(
    gl: &Arc<glow::Context>,
    shot: Shot,
    settings: &[Settings],
    truth: TruthAt,
    progress: impl Fn(),
) -> Result<Vec<Decomposition>, Error> {
    let Shot { camera, size, .. } = shot;
    let TruthAt { pixels, visibility: truth } = truth;
    let (width, height) = (size.0 as usize, size.1 as usize);
    if pixels.is_empty() || pixels.len() != truth.len() || pixels.iter().any(|&i| i >= width * height) {
        return Err(Error::Usage(format!(
            "error is decomposed at pixels of the image, with one truth for each: {} pixels of {width}x{height} and {} truths",
            pixels.len(),
            truth.len()
        )));
    }
    // Returns the visibility at each of `pixels`. The image has the full size, or half of it at half resolution before
    // the blur.
    let pick = |image: &Image<f32>| -> Vec<f64> {
        let scale = if (image.width, image.height) == (width, height) { 1 } else { 2 };
        pixels.iter().map(|i| f64::from(image.at(i % width / scale, i / width / scale))).collect()
    };
    let mut gbuffers = GBuffers::new(gl);
    let mut converged: Vec<(Settings, Vec<f64>)> = Vec::new();
    let mut all = Vec::new();
    for each in settings {
        let float = Settings {
            normal_format: NormalFormat::Rgba16f,
            depth_format: DepthFormat::R32f,
            ao_format: AoFormat::R32f,
            ..each.clone()
        };
        let gbuffer = gbuffers.of(shot, &float)?;
        let limit = limit(each);
        let known = match converged.iter().position(|(known, _)| *known == limit) {
            Some(known) => known,
            None => {
                let (depth, normals, tile) = (gbuffer.depth()?, gbuffer.normals()?, rotation_tile(each));
                let (projection, near) = (camera.projection, camera.near);
                let inputs = reference::TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
                converged.push((limit, reference::converged(&inputs, each, pixels)?));
                converged.len() - 1
            }
        };
        let (sampled, blurred) = occlusion(gl, size, &float, &gbuffer.inputs(camera))?;
        let (sampled, blurred) = (pick(&sampled), pick(&blurred));
        let shown = if *each == float {
            blurred.clone()
        } else {
            pick(&occlusion(gl, size, each, &gbuffers.inputs(shot, each)?)?.1)
        };
        all.push(Decomposition::of([truth, &converged[known].1, &sampled, &blurred, &shown]));
        progress();
    }
    Ok(all)
}

/// Returns ambient occlusion before the blur and after it.
fn occlusion(
    gl: &Arc<glow::Context>,
    size: (u32, u32),
    settings: &Settings,
    inputs: &Inputs,
) -> Result<(Image<f32>, Image<f32>), Error> {
    let mut ao = AmbientOcclusion::new(gl.clone(), size, settings)?;
    let kept = ao.run(inputs, &mut Timers::new(gl, false)?, Extras { raw: true, ..Extras::default() })?;
    let after = ao.image()?;
    Ok((kept.raw.unwrap_or_else(|| after.clone()), after))
}

/// Returns the settings that the converged method and its G-buffer read, with all other settings at their defaults.
fn limit(settings: &Settings) -> Settings {
    Settings {
        method: settings.method,
        radius: settings.radius,
        bias: settings.bias,
        strength: settings.strength,
        attenuation: settings.attenuation,
        clamp: settings.clamp,
        normals: settings.normals,
        msaa: settings.msaa,
        ..Settings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_chain_add_up() {
        let chain = [&[0.5, 0.25][..], &[0.75, 0.25], &[0.5, 0.5], &[0.75, 0.5], &[0.75, 1.0]];
        let parts = Decomposition::of(chain);
        assert_eq!(parts.model, ErrorPart { rmse: (0.0625f64 / 2.0).sqrt(), bias: 0.125, max: 0.25 });
        assert_eq!((parts.sampling.bias, parts.filtering.bias, parts.quantisation.bias), (0.0, 0.125, 0.25));
        assert_eq!(parts.total, ErrorPart { rmse: ((0.0625f64 + 0.5625) / 2.0).sqrt(), bias: 0.5, max: 0.75 });
        // The parts are (0.25, -0.25, 0.25, 0) at the first pixel and (0, 0.25, 0, 0.5) at the second. The products of
        // all pairs add up to -0.0625 + 0.0625 - 0.0625 at the first pixel and to 0.125 at the second. Their mean over
        // the two pixels, times 2, is 0.0625.
        assert!((parts.cross - 0.0625).abs() < 1e-15, "{}", parts.cross);
        assert_eq!(parts.pixels, 2);
    }

    #[test]
    fn a_subset_is_of_the_covered_pixels_as_many_as_wanted_and_the_same_every_time() {
        let covered = Image::from_fn(60, 40, |x, y| (x + y) % 3 > 0);
        let all: Vec<usize> = (0..2400).filter(|&i| covered.texels[i]).collect();
        assert_eq!(subset(&covered, 1600), all);
        assert_eq!(subset(&covered, usize::MAX), all);
        let some = subset(&covered, 400);
        assert_eq!(some.len(), 400);
        assert!(some.is_sorted_by(|a, b| a < b) && some.iter().all(|&i| covered.texels[i]));
        assert_eq!(some, subset(&covered, 400));
        // The pixels come from the whole image: half of them lie in its lower half, give or take 3 standard deviations.
        let low = some.iter().filter(|&&i| i < 1200).count();
        assert!(low.abs_diff(200) < 30, "{low}");
        assert!(subset(&covered.map(|_| false), 5).is_empty() && subset(&covered, 0).is_empty());
    }
}
