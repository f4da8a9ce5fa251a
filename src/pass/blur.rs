//! The cross-bilateral blur (ShaderX7 6.2): separated in X and Y or in full, upsampling from half resolution,
//! supersampling on edge pixels; and the blur of equal weights of 6.1.

use super::{
    DepthInput, DepthSamples, FETCH, FULLSCREEN, FullScreen, TextureTarget, depth_defines, depth_sigma, pixels,
};
use crate::Error;
use crate::gl::{Program, Texture, source};
use crate::settings::DepthSigma;
use std::f64::consts::SQRT_2;
use std::sync::Arc;

/// Which taps a pass takes, and their weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kernel {
    /// A row of the Gaussian of this width in pixels, odd.
    X(u32),
    /// A column.
    Y(u32),
    /// The square.
    Full(u32),
    /// Crysis' 4x4 texels, from two before the pixel's own to the one after it, of equal weights: every residue of the
    /// tile once.
    Crysis,
}

/// What a pass is compiled for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlurVariant {
    pub(crate) kernel: Kernel,
    pub(crate) depth: TextureTarget,
    /// How many pixels a texel of what is blurred stands for in x and y.
    pub(crate) from: [u32; 2],
    /// The same of the target.
    pub(crate) to: [u32; 2],
    /// The depth samples around each of which it is blurred; none: around the resolved depth.
    pub(crate) samples: Option<u32>,
}

/// The pass.
pub(crate) struct Blur {
    program: Program,
    gaussian: bool,
}

impl Blur {
    pub(crate) fn new(gl: &Arc<glow::Context>, variant: BlurVariant) -> Result<Blur, Error> {
        let mut defines = depth_defines(variant.depth, variant.to).value("FROM", pixels(variant.from));
        if variant.from != [1, 1] {
            defines = defines.value("UPSAMPLES", 1);
        }
        if let Some(samples) = variant.samples {
            defines = defines.value("SAMPLES", samples);
        }
        let (width, along_x, along_y) = match variant.kernel {
            Kernel::X(width) => (Some(width), true, false),
            Kernel::Y(width) => (Some(width), false, true),
            Kernel::Full(width) => (Some(width), true, true),
            Kernel::Crysis => (None, true, true),
        };
        for (axis, along, from) in [("X", along_x, variant.from[0]), ("Y", along_y, variant.from[1])] {
            let (first, last) = match width {
                _ if !along => (0, 0),
                // At half resolution the pixel's own texel may be to its left: taps reach one pixel further right.
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
            // The outermost taps of half resolution lie up to two pixels beyond the kernel, and weigh nothing.
            let weights: Vec<String> = (0..=radius + 2).map(|k| format!("{:?}", weight(k) as f32)).collect();
            defines = defines.value("GAUSSIAN", weights.len()).value("SPATIAL", weights.join(", "));
        }
        let program = Program::new(gl, &defines, FULLSCREEN, &[FETCH, source!("blur.frag")])?;
        Ok(Blur { program, gaussian: width.is_some() })
    }

    /// Blurs `ao` into the bound target. `samples` are the depth samples that it is compiled for.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        ao: &Texture,
        depth: &DepthInput,
        samples: Option<DepthSamples>,
        sigma: DepthSigma,
    ) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        full_screen.bind_texture(1, ao.into());
        if let Some(samples) = samples {
            full_screen.bind_samples(2, samples.texture);
            program.unit("depth_samples", 2);
        }
        program.unit("ao_image", 1).vec2("extent", [f64::from(depth.size.0), f64::from(depth.size.1)]);
        if self.gaussian {
            // Of a Gaussian, s_z is in scene units: only 6.1's blur goes by the depth.
            program.float("inverse_sigma", 1.0 / (SQRT_2 * sigma.at(0.0)));
        } else {
            depth_sigma(program, sigma);
        }
        full_screen.draw();
    }
}
