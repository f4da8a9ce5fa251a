//! Framebuffers, and the depth-stencil buffers attached to them.

use super::{Texture, check};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;

/// A renderbuffer.
pub(crate) struct Renderbuffer {
    gl: Arc<glow::Context>,
    id: glow::Renderbuffer,
}

impl Renderbuffer {
    /// Allocates one of `format`. Changes the renderbuffer binding.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: u32,
        width: u32,
        height: u32,
    ) -> Result<Renderbuffer, Error> {
        // SAFETY: the context is current.
        unsafe {
            let id = gl.create_renderbuffer().map_err(|e| Error::gl(place, e))?;
            let buffer = Renderbuffer { gl: gl.clone(), id };
            gl.bind_renderbuffer(glow::RENDERBUFFER, Some(id));
            gl.renderbuffer_storage(glow::RENDERBUFFER, format, width as i32, height as i32);
            check(gl, place)?;
            Ok(buffer)
        }
    }
}

impl Drop for Renderbuffer {
    fn drop(&mut self) {
        // SAFETY: the renderbuffer is ours, and the context current by the room's contract.
        unsafe { self.gl.delete_renderbuffer(self.id) };
    }
}

/// A complete framebuffer. The textures and buffers attached to it must outlive its use.
pub(crate) struct Target {
    gl: Arc<glow::Context>,
    id: glow::Framebuffer,
    width: u32,
    height: u32,
}

impl Target {
    /// Attaches `colours` in order, and `depth` at `point` (depth, stencil or both). `place` names it in errors.
    /// Leaves it bound.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        colours: &[&Texture],
        depth: Option<(u32, &Renderbuffer)>,
        (width, height): (u32, u32),
    ) -> Result<Target, Error> {
        // SAFETY: the context is current; the attachments are complete objects.
        unsafe {
            let id = gl.create_framebuffer().map_err(|e| Error::gl(place, e))?;
            let target = Target { gl: gl.clone(), id, width, height };
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(id));
            let attachments: Vec<u32> = (0..colours.len() as u32).map(|i| glow::COLOR_ATTACHMENT0 + i).collect();
            for (&attachment, texture) in attachments.iter().zip(colours) {
                gl.framebuffer_texture_2d(glow::FRAMEBUFFER, attachment, glow::TEXTURE_RECTANGLE, Some(texture.id), 0);
            }
            if let Some((point, buffer)) = depth {
                gl.framebuffer_renderbuffer(glow::FRAMEBUFFER, point, glow::RENDERBUFFER, Some(buffer.id));
            }
            if attachments.is_empty() {
                gl.draw_buffer(glow::NONE);
                gl.read_buffer(glow::NONE);
            } else {
                gl.draw_buffers(&attachments);
            }
            match gl.check_framebuffer_status(glow::FRAMEBUFFER) {
                glow::FRAMEBUFFER_COMPLETE => {}
                status => return Err(Error::gl(place, format!("the framebuffer is incomplete (0x{status:04x})"))),
            }
            check(gl, place)?;
            Ok(target)
        }
    }

    /// Makes it what is drawn to, over its whole size.
    pub(crate) fn bind(&self) {
        // SAFETY: the context is current and the framebuffer ours.
        unsafe {
            self.gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.id));
            self.gl.viewport(0, 0, self.width as i32, self.height as i32);
        }
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        // SAFETY: the framebuffer is ours, and the context current by the room's contract.
        unsafe { self.gl.delete_framebuffer(self.id) };
    }
}
