//! Rebuilds normals from depth, for an application that has none.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, Grid, ImageVariant, RAY, depth_defines};
use crate::Error;
use crate::gl::{Format, Program, Renderbuffer, Target, Texture, source};
use crate::projection::Projection;
use std::sync::Arc;

/// The pass and the image that it draws.
pub(crate) struct RebuiltNormals {
    program: Program,
    pub(crate) texture: Texture,
    target: Target,
    grid: Grid,
}

impl RebuiltNormals {
    /// Compiles the pass for a depth texture of this kind, and makes its image, with a texel for each texel of `grid`.
    /// With a stencil of the same size, the caller sets where the pass draws. Leaves the new framebuffer bound, and the
    /// new image on the active texture unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        depth: ImageVariant,
        orthographic: bool,
        grid: Grid,
        stencil: Option<&Renderbuffer>,
    ) -> Result<RebuiltNormals, Error> {
        let size = grid.size();
        let texture = Texture::new(gl, "rebuilt_normals: image", Format::Rgba16f, size.0, size.1)?;
        let defines = depth_defines(depth, grid.scale).flag("ORTHOGRAPHIC", orthographic);
        let stencil = stencil.map(|stencil| (glow::DEPTH_STENCIL_ATTACHMENT, stencil));
        Ok(RebuiltNormals {
            program: Program::new(gl, &defines, FULLSCREEN, &[FETCH, RAY, source!("rebuilt_normals.frag")])?,
            target: Target::new(gl, "rebuilt_normals: framebuffer", &[&texture], stencil, size)?,
            texture,
            grid,
        })
    }

    /// Draws into the pass's own target, and leaves it bound.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &DepthInput, projection: Projection) {
        self.target.bind();
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        self.grid.bind(program, projection);
        full_screen.draw();
    }
}
