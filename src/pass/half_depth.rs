//! Reduces depth to half the width and height, for the samples of `ssao` (ShaderX7 6.1, Future improvements).

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, ImageVariant, depth_defines};
use crate::Error;
use crate::gl::{Canvas, Format, Program, ProgramCache, source};
use std::sync::Arc;

/// The texture unit to which the image stays bound, for the pass that samples it.
pub(super) const UNIT: u32 = 3;

pub(crate) struct HalfDepth {
    program: Arc<Program>,
}

impl HalfDepth {
    /// Compiles the pass for a depth texture of this kind.
    pub(crate) fn new(programs: &mut ProgramCache, depth: ImageVariant) -> Result<HalfDepth, Error> {
        let pieces = [FETCH, source!("half_depth.frag")];
        Ok(HalfDepth { program: programs.get(&depth_defines(depth, [2, 2]), FULLSCREEN, &pieces)? })
    }

    /// Makes the pass's image, for a view of this size.
    pub(crate) fn canvas(gl: &Arc<glow::Context>, (width, height): (u32, u32)) -> Result<Canvas, Error> {
        Canvas::new(gl, "half_depth", Format::R32f, (width.div_ceil(2), height.div_ceil(2)), None)
    }

    /// Draws into the pass's image. Leaves it bound, and its texture on unit 3.
    pub(crate) fn draw(&self, full_screen: &FullScreen, canvas: &Canvas, depth: &DepthInput) {
        canvas.framebuffer.bind();
        depth.bind(full_screen, self.program.bind(), 0);
        full_screen.draw();
        full_screen.bind_texture(UNIT, (&canvas.texture).into());
    }
}
