//! Writes the stencil: it is 1 at pixels that hold a surface. The later passes test the stencil and so skip the
//! background.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, ImageVariant, depth_defines};
use crate::Error;
use crate::gl::{Program, ProgramCache, source};
use std::sync::Arc;

pub(crate) struct Background {
    program: Arc<Program>,
}

impl Background {
    /// Compiles the pass for a depth texture of this kind, and for a target each of whose texels stands for `scale`
    /// pixels in x and y.
    pub(crate) fn new(programs: &mut ProgramCache, depth: ImageVariant, scale: [u32; 2]) -> Result<Background, Error> {
        let defines = depth_defines(depth, scale);
        let program = programs.get(&defines, FULLSCREEN, &[FETCH, source!("background.frag")])?;
        Ok(Background { program })
    }

    /// Draws at every texel of the bound target that holds a surface. The caller sets what drawing does to the stencil.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &DepthInput) {
        depth.bind(full_screen, self.program.bind(), 0);
        full_screen.draw();
    }
}
