//! Reduces depth to half the width and height, for the samples of `ssao` (ShaderX7 6.1, Future improvements).

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, ImageVariant, depth_defines};
use crate::Error;
use crate::gl::{Format, Program, Target, Texture, source};
use std::sync::Arc;

/// The texture unit to which the image stays bound, for the pass that samples it.
pub(super) const UNIT: u32 = 3;

/// The pass and the image that it draws.
pub(crate) struct HalfDepth {
    program: Program,
    texture: Texture,
    target: Target,
}

impl HalfDepth {
    /// Compiles the pass for a depth texture of this kind, and makes its image for a depth texture of this size. Leaves
    /// the new framebuffer bound, and the new image on the active texture unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        depth: ImageVariant,
        (width, height): (u32, u32),
    ) -> Result<HalfDepth, Error> {
        let size = (width.div_ceil(2), height.div_ceil(2));
        let texture = Texture::new(gl, "half_depth: image", Format::R32f, size.0, size.1)?;
        Ok(HalfDepth {
            program: Program::new(gl, &depth_defines(depth, [2, 2]), FULLSCREEN, &[FETCH, source!("half_depth.frag")])?,
            target: Target::new(gl, "half_depth: framebuffer", &[&texture], None, size)?,
            texture,
        })
    }

    /// Draws into the pass's own target, which has no stencil. Leaves the target bound, and the image on unit 3.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &DepthInput) {
        self.target.bind();
        depth.bind(full_screen, self.program.bind(), 0);
        full_screen.draw();
        full_screen.bind_texture(UNIT, (&self.texture).into());
    }
}
