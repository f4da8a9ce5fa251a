//! Makes a caller's depth linear, if it is hardware depth or has several samples per pixel.

use super::{
    DepthInput, DepthSamples, FETCH, FULLSCREEN, FullScreen, ImageVariant, TextureRef, bind_viewport, depth_defines,
};
use crate::Error;
use crate::encoding::Curve;
use crate::gl::{Canvas, Defines, Format, Program, ProgramCache, Source, source};
use std::sync::Arc;

const HARDWARE: Source = source!("shared/hardware.glsl");
/// The pieces of a shader that reads the depth samples of a pixel, besides [`FETCH`].
pub(super) const SAMPLES: [Source; 2] = [HARDWARE, source!("shared/samples.glsl")];

/// What shaders that read encoded depth are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct CurveVariant {
    name: Option<&'static str>,
    reversed: bool,
}

impl From<Curve> for CurveVariant {
    fn from(curve: Curve) -> CurveVariant {
        let (name, reversed) = match curve {
            Curve::Linear => (None, false),
            Curve::Perspective { reversed, .. } => (Some("PERSPECTIVE"), reversed),
            Curve::Orthographic { reversed, .. } => (Some("ORTHOGRAPHIC"), reversed),
            Curve::Logarithmic { .. } => (Some("LOGARITHMIC"), false),
        };
        CurveVariant { name, reversed }
    }
}

impl CurveVariant {
    /// Adds the defines of `glsl/shared/hardware.glsl`.
    fn define(self, defines: Defines) -> Defines {
        let defines = self.name.into_iter().fold(defines, |defines, name| defines.word("CURVE", name));
        defines.flag("CURVE_REVERSED", self.reversed)
    }
}

/// Sets the uniforms of `glsl/shared/hardware.glsl` in the program in use.
fn bind_curve(program: &Program, curve: Curve) {
    program.vec2(
        "curve",
        match curve {
            Curve::Linear => [0.0; 2],
            Curve::Perspective { at_far, rise, .. } => [at_far, rise],
            Curve::Orthographic { near, range, .. } => [near, range],
            Curve::Logarithmic { logarithm, c } => [logarithm, 1.0 / c],
        },
    );
}

/// The variant of the shaders that read the depth samples of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SamplesVariant {
    /// The number of samples per pixel.
    pub(crate) count: u32,
    pub(crate) curve: CurveVariant,
    /// Whether the view is a part of the texture.
    pub(crate) viewport: bool,
}

impl SamplesVariant {
    /// Adds the defines of `glsl/shared/samples.glsl`.
    pub(super) fn define(self, defines: Defines) -> Defines {
        let defines = self.curve.define(defines).value("SAMPLES", self.count);
        defines.flag("SAMPLES_VIEWPORT", self.viewport)
    }
}

/// The depth samples of pixels, as passes read them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplesInput {
    pub(crate) image: DepthSamples,
    pub(crate) curve: Curve,
    /// The lower left texel of the view, and the view's size; `None` if the view is the whole texture.
    pub(crate) viewport: Option<[(u32, u32); 2]>,
}

impl SamplesInput {
    /// Binds the texture to `unit`, and sets the uniforms of `glsl/shared/samples.glsl` in the program in use.
    pub(super) fn bind(&self, full_screen: &FullScreen, program: &Program, unit: u32) {
        full_screen.bind_samples(unit, self.image.texture);
        program.unit("depth_samples", unit);
        bind_curve(program, self.curve);
        if let Some([corner, size]) = self.viewport {
            bind_viewport(program, corner, size);
        }
    }
}

pub(crate) struct LinearDepth {
    program: Arc<Program>,
}

impl LinearDepth {
    /// Compiles the pass for a depth texture of this kind and encoding.
    pub(crate) fn new(
        programs: &mut ProgramCache,
        depth: ImageVariant,
        curve: CurveVariant,
    ) -> Result<LinearDepth, Error> {
        let defines = curve.define(depth_defines(depth, [1, 1]));
        let pieces = [FETCH, HARDWARE, source!("linear_depth.frag")];
        Ok(LinearDepth { program: programs.get(&defines, FULLSCREEN, &pieces)? })
    }

    /// Makes the pass's image, for a view of this size.
    pub(crate) fn canvas(gl: &Arc<glow::Context>, size: (u32, u32)) -> Result<Canvas, Error> {
        Canvas::new(gl, "linear_depth", Format::R32f, size, None)
    }

    /// Draws into the pass's image, and leaves it bound. Background becomes `depth.background`. Returns the image, as
    /// later passes read it.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        canvas: &Canvas,
        depth: &DepthInput,
        curve: Curve,
    ) -> DepthInput {
        canvas.framebuffer.bind();
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        bind_curve(program, curve);
        full_screen.draw();
        DepthInput { image: TextureRef::from(&canvas.texture), part: None, ..*depth }
    }
}
