//! The images that ambient occlusion is drawn into, and the stencil that says which of their pixels are drawn.

use crate::Error;
use crate::gl::{Renderbuffer, Target, Texture};
use crate::image::Image;
use crate::pass::Grid;
use glow::HasContext;
use std::sync::Arc;

/// The stencil bit of pixels that hold a surface.
pub(super) const COVERED: u32 = 1;
/// The stencil bit of pixels that hold several surfaces.
pub(super) const EDGE: u32 = 2;

/// A texture of ambient occlusion, and the framebuffer through which passes draw into it.
pub(super) struct AoTarget {
    pub(super) grid: Grid,
    pub(super) texture: Texture,
    pub(super) framebuffer: Target,
    pub(super) stencil: Arc<Renderbuffer>,
}

/// Runs `draw` so that it writes to the stencil only: it sets `bit` at every pixel drawn.
pub(super) fn mark(gl: &glow::Context, bit: u32, draw: impl FnOnce()) {
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_mask(bit);
        gl.stencil_func(glow::ALWAYS, bit as i32, 0xff);
        gl.stencil_op(glow::KEEP, glow::KEEP, glow::REPLACE);
        gl.color_mask_draw_buffer(0, false, false, false, false);
    }
    draw();
    // SAFETY: the context is current.
    unsafe {
        gl.color_mask_draw_buffer(0, true, true, true, true);
        gl.stencil_mask(0);
    }
}

/// Lets later passes draw only at pixels whose stencil bits under `mask` equal `bits`.
pub(super) fn only_where(gl: &glow::Context, bits: u32, mask: u32) {
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_func(glow::EQUAL, bits as i32, mask);
    }
}

/// Reads the image of a target back.
pub(super) fn read(target: &AoTarget) -> Result<Image<f32>, Error> {
    let (width, height) = target.grid.size();
    Ok(Image { width: width as usize, height: height as usize, texels: target.texture.read()? })
}
