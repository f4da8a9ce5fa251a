//! Framebuffers, and the depth-stencil buffers attached to them.

use super::texture::DefaultPacking;
use super::{Format, MultisampleTexture, Texture, check, not_made};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;

/// A renderbuffer.
pub(crate) struct Renderbuffer {
    gl: Arc<glow::Context>,
    id: glow::Renderbuffer,
    /// The bytes of one sample of every pixel. All formats of depth and stencil that are used have 4 bytes.
    pub(crate) bytes_per_sample: u64,
}

impl Renderbuffer {
    /// Allocates a renderbuffer of the internal format `format`. With 0 `samples` it is not multisample. `place` names
    /// it in errors. Leaves it bound.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: u32,
        (width, height): (u32, u32),
        samples: u32,
    ) -> Result<Renderbuffer, Error> {
        // SAFETY: the context is current.
        unsafe {
            let id = gl.create_renderbuffer().map_err(|_| not_made(gl, place))?;
            let bytes_per_sample = 4 * u64::from(width) * u64::from(height);
            let buffer = Renderbuffer { gl: gl.clone(), id, bytes_per_sample };
            gl.bind_renderbuffer(glow::RENDERBUFFER, Some(id));
            let (width, height) = (width as i32, height as i32);
            gl.renderbuffer_storage_multisample(glow::RENDERBUFFER, samples as i32, format, width, height);
            check(gl, place)?;
            Ok(buffer)
        }
    }
}

impl Drop for Renderbuffer {
    fn drop(&mut self) {
        // SAFETY: the renderbuffer is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_renderbuffer(self.id) };
    }
}

/// A texture that a framebuffer can draw colours into.
pub(crate) trait Attachment {
    /// Returns the texture target, such as `GL_TEXTURE_RECTANGLE`, and the texture.
    fn texture(&self) -> (u32, glow::Texture);
}

impl Attachment for Texture {
    fn texture(&self) -> (u32, glow::Texture) {
        (glow::TEXTURE_RECTANGLE, self.id)
    }
}

impl Attachment for MultisampleTexture {
    fn texture(&self) -> (u32, glow::Texture) {
        (glow::TEXTURE_2D_MULTISAMPLE, self.id)
    }
}

/// A complete framebuffer. The textures and renderbuffers attached to it must live for as long as it is used.
pub(crate) struct Target {
    gl: Arc<glow::Context>,
    id: glow::Framebuffer,
    width: u32,
    height: u32,
}

impl Target {
    /// Makes a framebuffer of `width` by `height` texels. `colours` are attached in order, from `GL_COLOR_ATTACHMENT0`
    /// on. `depth` is an attachment point (depth, stencil, or both) and what is attached there. `place` names the
    /// framebuffer in errors. Leaves it bound.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        colours: &[&dyn Attachment],
        depth: Option<(u32, &Renderbuffer)>,
        (width, height): (u32, u32),
    ) -> Result<Target, Error> {
        // SAFETY: the context is current, and the attachments are allocated objects.
        unsafe {
            let id = gl.create_framebuffer().map_err(|_| not_made(gl, place))?;
            let target = Target { gl: gl.clone(), id, width, height };
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(id));
            let attachments: Vec<u32> = (0..colours.len() as u32).map(|i| glow::COLOR_ATTACHMENT0 + i).collect();
            for (&attachment, texture) in attachments.iter().zip(colours) {
                let (kind, id) = texture.texture();
                gl.framebuffer_texture_2d(glow::FRAMEBUFFER, attachment, kind, Some(id), 0);
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
                status => {
                    // If OpenGL recorded an error, it explains the failure better than the status, which may be 0.
                    check(gl, place)?;
                    return Err(Error::gl(place, format!("incomplete: {}", incompleteness(status))));
                }
            }
            check(gl, place)?;
            Ok(target)
        }
    }

    /// Reads back the stencil value of each pixel, the bottom row first. `place` names the image in errors.
    pub(crate) fn read_stencil(&self, place: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = vec![0; self.width as usize * self.height as usize];
        // SAFETY: the context is current and the framebuffer is ours. `DefaultPacking::around` reads only if the
        // framebuffer could be bound and the packing could be set. `bytes` then holds exactly the bytes that are
        // written: with an alignment of 1, rows have no padding.
        let bind = || unsafe { self.gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.id)) };
        let (width, height) = (self.width as i32, self.height as i32);
        // SAFETY: as above.
        let read = || unsafe {
            let into = glow::PixelPackData::Slice(Some(&mut bytes));
            self.gl.read_pixels(0, 0, width, height, glow::STENCIL_INDEX, glow::UNSIGNED_BYTE, into);
        };
        DefaultPacking::around(&self.gl, place, 1, bind, read)?;
        Ok(bytes)
    }

    /// Binds the framebuffer and sets the viewport to all of it.
    pub(crate) fn bind(&self) {
        // SAFETY: the context is current and the framebuffer ours.
        unsafe {
            self.gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.id));
            self.gl.viewport(0, 0, self.width as i32, self.height as i32);
        }
    }
}

/// A texture, and the framebuffer through which a pass draws into it.
pub(crate) struct Canvas {
    pub(crate) texture: Texture,
    pub(crate) framebuffer: Target,
}

impl Canvas {
    /// Makes an image of the pass of this name. With a stencil of the same size, the caller sets where passes draw.
    /// Leaves the new framebuffer bound, and the new image on the active texture unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        pass: &str,
        format: Format,
        size: (u32, u32),
        stencil: Option<&Renderbuffer>,
    ) -> Result<Canvas, Error> {
        let texture = Texture::new(gl, &format!("{pass}: image"), format, size.0, size.1)?;
        let stencil = stencil.map(|stencil| (glow::DEPTH_STENCIL_ATTACHMENT, stencil));
        let framebuffer = Target::new(gl, &format!("{pass}: framebuffer"), &[&texture], stencil, size)?;
        Ok(Canvas { texture, framebuffer })
    }
}

/// Describes a status of `glCheckFramebufferStatus` in words, for messages.
pub(crate) fn incompleteness(status: u32) -> String {
    match status {
        glow::FRAMEBUFFER_UNDEFINED => "there is no window to draw to".into(),
        glow::FRAMEBUFFER_INCOMPLETE_ATTACHMENT => "an attachment cannot be drawn to".into(),
        glow::FRAMEBUFFER_INCOMPLETE_MISSING_ATTACHMENT => "it has no attachment".into(),
        glow::FRAMEBUFFER_INCOMPLETE_DRAW_BUFFER => "an attachment that is drawn to is missing".into(),
        glow::FRAMEBUFFER_INCOMPLETE_READ_BUFFER => "the attachment that is read is missing".into(),
        glow::FRAMEBUFFER_INCOMPLETE_MULTISAMPLE => "its attachments differ in samples".into(),
        glow::FRAMEBUFFER_UNSUPPORTED => "this driver does not draw to these formats together".into(),
        other => format!("status 0x{other:04x}"),
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        // SAFETY: the framebuffer is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_framebuffer(self.id) };
    }
}
