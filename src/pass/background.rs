//! The stencil: 1 where a pixel holds a surface, so that the passes after it skip background.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, TextureTarget, depth_defines};
use crate::Error;
use crate::gl::{Program, source};
use std::sync::Arc;

/// The pass.
pub(crate) struct Background {
    program: Program,
}

impl Background {
    /// A texel of the target stands for `scale` pixels.
    pub(crate) fn new(gl: &Arc<glow::Context>, depth: TextureTarget, scale: [u32; 2]) -> Result<Background, Error> {
        let defines = depth_defines(depth, scale);
        let program = Program::new(gl, &defines, FULLSCREEN, &[FETCH, source!("background.frag")])?;
        Ok(Background { program })
    }

    /// Draws every pixel of the bound target that holds a surface.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &DepthInput) {
        depth.bind(full_screen, self.program.bind(), 0);
        full_screen.draw();
    }
}
