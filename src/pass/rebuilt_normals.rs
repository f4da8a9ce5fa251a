//! Rebuilds normals from depth, for an application that has none.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, Grid, ImageVariant, RAY, depth_defines};
use crate::Error;
use crate::gl::{Canvas, Format, Program, ProgramCache, Renderbuffer, source};
use crate::projection::Projection;
use std::sync::Arc;

pub(crate) struct RebuiltNormals {
    program: Arc<Program>,
}

impl RebuiltNormals {
    /// Compiles the pass for a depth texture of this kind, and for an image each of whose texels stands for `scale`
    /// pixels in x and y.
    pub(crate) fn new(
        programs: &mut ProgramCache,
        depth: ImageVariant,
        orthographic: bool,
        scale: [u32; 2],
    ) -> Result<RebuiltNormals, Error> {
        let defines = depth_defines(depth, scale).flag("ORTHOGRAPHIC", orthographic);
        let pieces = [FETCH, RAY, source!("rebuilt_normals.frag")];
        Ok(RebuiltNormals { program: programs.get(&defines, FULLSCREEN, &pieces)? })
    }

    /// Makes the pass's image, with a texel for each texel of `grid`. With a stencil of the same size, the caller sets
    /// where the pass draws.
    pub(crate) fn canvas(gl: &Arc<glow::Context>, grid: Grid, stencil: Option<&Renderbuffer>) -> Result<Canvas, Error> {
        Canvas::new(gl, "rebuilt_normals", Format::Rgba16f, grid.size(), stencil)
    }

    /// Draws into the pass's image, which was made for `grid`, and leaves it bound.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        (canvas, grid): (&Canvas, Grid),
        depth: &DepthInput,
        projection: Projection,
    ) {
        canvas.framebuffer.bind();
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        grid.bind(program, projection);
        full_screen.draw();
    }
}
