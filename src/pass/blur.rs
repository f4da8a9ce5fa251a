//! The blurs of ambient occlusion. One is the cross-bilateral blur of ShaderX7 6.2, either as two passes along X and Y
//! or as one pass over the whole kernel. It can upsample from half resolution, and on edge pixels it can supersample.
//! The other is the blur of 6.1, whose taps all have the same weight.

use super::linear_depth::{self, SamplesInput, SamplesVariant};
use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, ImageVariant, depth_defines, depth_sigma, pixels};
use crate::Error;
use crate::gl::{Program, ProgramCache, Texture, source};
use crate::settings::Length;
use std::f64::consts::SQRT_2;
use std::sync::Arc;

/// The taps that a pass takes, and their weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kernel {
    /// A row of the Gaussian kernel. The width is in pixels, and odd.
    X(u32),
    /// A column of the Gaussian kernel, of this width.
    Y(u32),
    /// The whole square Gaussian kernel, of this width.
    Full(u32),
    /// The 4x4 texels of Crysis, all with the same weight. They reach from two texels before the pixel's own to one
    /// texel after it, so that each texel of the rotation tile contributes once.
    Crysis,
}

/// The variant of the pass that is compiled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlurVariant {
    pub(crate) kernel: Kernel,
    pub(crate) depth: ImageVariant,
    /// How many pixels in x and y one texel of the blurred image stands for.
    pub(crate) from: [u32; 2],
    /// How many pixels in x and y one texel of the target stands for.
    pub(crate) to: [u32; 2],
    /// Whether the depth sigma of a Gaussian is in proportion to depth.
    pub(crate) sigma_of_depth: bool,
    /// For the supersampling blur, the depth samples of the pixels. `None` for the blur around the resolved depth.
    pub(crate) samples: Option<SamplesVariant>,
}

pub(crate) struct Blur {
    program: Arc<Program>,
    gaussian: bool,
}

impl Blur {
    pub(crate) fn new(programs: &mut ProgramCache, variant: BlurVariant) -> Result<Blur, Error> {
        let mut defines = depth_defines(variant.depth, variant.to).value("FROM", pixels(variant.from));
        if variant.from != [1, 1] {
            defines = defines.value("UPSAMPLES", 1);
        }
        let mut pieces = vec![FETCH];
        if let Some(samples) = variant.samples {
            defines = samples.define(defines);
            pieces.extend(linear_depth::SAMPLES);
        }
        pieces.push(source!("blur.frag"));
        let (width, along_x, along_y) = match variant.kernel {
            Kernel::X(width) => (Some(width), true, false),
            Kernel::Y(width) => (Some(width), false, true),
            Kernel::Full(width) => (Some(width), true, true),
            Kernel::Crysis => (None, true, true),
        };
        for (axis, along, from) in [("X", along_x, variant.from[0]), ("Y", along_y, variant.from[1])] {
            let (first, last) = match width {
                _ if !along => (0, 0),
                // At half resolution the pixel can be the one to the right of its texel's own. Rounding the number of
                // taps up lets them reach the end of the kernel on that side, too.
                Some(width) => (-i64::from((width / 2).div_ceil(from)), i64::from((width / 2).div_ceil(from))),
                None => (-2, 1),
            };
            defines = defines.value(&format!("FIRST_{axis}"), first).value(&format!("LAST_{axis}"), last);
        }
        if let Some(width) = width {
            let radius = width / 2;
            // s = (radius + 1) / 2 pixels.
            let sigma = f64::from(radius + 1) / 2.0;
            let weight = |k: u32| if k > radius { 0.0 } else { (-f64::from(k * k) / (2.0 * sigma * sigma)).exp() };
            // At half resolution the outermost taps lie up to two pixels beyond the kernel, where the weight is 0.
            let weights: Vec<String> = (0..=radius + 2).map(|k| format!("{:?}", weight(k) as f32)).collect();
            defines = defines
                .value("GAUSSIAN", weights.len())
                .value("SPATIAL", weights.join(", "))
                .flag("SIGMA_OF_DEPTH", variant.sigma_of_depth);
        }
        let program = programs.get(&defines, FULLSCREEN, &pieces)?;
        Ok(Blur { program, gaussian: width.is_some() })
    }

    /// Blurs `ao` into the bound target. `samples` must be given if the pass is compiled for the supersampling blur,
    /// and must be of the variant that it is compiled for, as must `sigma`.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        ao: &Texture,
        depth: &DepthInput,
        samples: Option<&SamplesInput>,
        sigma: Length,
    ) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        full_screen.bind_texture(1, ao.into());
        if let Some(samples) = samples {
            samples.bind(full_screen, program, 2);
        }
        program.unit("ao_image", 1).vec2("extent", [f64::from(depth.size.0), f64::from(depth.size.1)]);
        if self.gaussian {
            program.float("inverse_sigma", 1.0 / (SQRT_2 * sigma.at(1.0)));
        } else {
            depth_sigma(program, sigma);
        }
        full_screen.draw();
    }
}
