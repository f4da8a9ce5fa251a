//! Images of the caller that ambient occlusion is written to.

use super::check::{Found, usage};
use super::inputs::{Inputs, Viewport};
use crate::Error;
use crate::gl::state::Multiplying;
use crate::gl::{ProgramCache, Texture, check, incompleteness, not_made};
use crate::pass::apply::{ApplyPass, Share};
use crate::pass::{FullScreen, TextureRef, TextureTarget};
use glow::HasContext;
use std::sync::Arc;

/// Where [`AmbientOcclusion::render_into`](super::AmbientOcclusion::render_into) writes, and what.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// The image that is written to.
    pub to: Destination,
    /// The lower left pixel of the view in that image.
    pub corner: (u32, u32),
    /// What is written.
    pub write: Write,
}

impl Output {
    /// Multiplies the colours of a framebuffer by visibility, from its lower left corner on; `None` is the window.
    #[must_use]
    pub fn multiplied(framebuffer: Option<glow::Framebuffer>) -> Output {
        Output { to: Destination::Framebuffer(framebuffer), corner: (0, 0), write: Write::Multiplied(1.0) }
    }
}

/// An image of the caller.
#[derive(Clone, Copy, Debug)]
pub enum Destination {
    /// Level 0 of a texture whose format can be drawn to.
    Texture(TextureRef),
    /// What a framebuffer object draws into, or the default framebuffer for `None`, which in most applications is the
    /// window. It must have exactly one draw buffer.
    Framebuffer(Option<glow::Framebuffer>),
    /// What the framebuffer draws into that is bound as `GL_DRAW_FRAMEBUFFER`: for applications whose toolkit hides its
    /// framebuffers.
    Bound,
}

/// What is written to an image.
#[derive(Clone, Copy, Debug)]
pub enum Write {
    /// Visibility A, in red, green and blue; alpha becomes 1.
    Visibility,
    /// The colour that is there, times 1 - s (1 - A). The share s of ambient light in the colour is from 0 to 1; with 1
    /// the whole colour is multiplied by A. Alpha is kept. If the application has enabled `GL_FRAMEBUFFER_SRGB`, colours
    /// in sRGB formats are multiplied as linear light.
    Multiplied(f32),
    /// The same, with a share s for each pixel, in the alpha channel of a texture. It has the size of the view, or, with
    /// [`Inputs::viewport`], holds the view in the same part as the inputs. It must not be the image that is written to.
    MultipliedByShare(TextureRef),
}

/// The state of an application that decides what is written.
#[derive(Clone, Copy)]
pub(super) struct Bound {
    /// What is bound as `GL_DRAW_FRAMEBUFFER`.
    framebuffer: Option<glow::Framebuffer>,
    /// Whether `GL_FRAMEBUFFER_SRGB` is enabled.
    srgb: bool,
}

impl Bound {
    pub(super) fn of(gl: &glow::Context) -> Bound {
        // SAFETY: the context is current, and these are core parameters.
        unsafe {
            Bound {
                framebuffer: gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING),
                srgb: gl.is_enabled(glow::FRAMEBUFFER_SRGB),
            }
        }
    }
}

/// Writes to images of the caller.
pub(super) struct Writer {
    gl: Arc<glow::Context>,
    /// The framebuffer that the caller's textures are attached to.
    framebuffer: glow::Framebuffer,
}

impl Writer {
    pub(super) fn new(gl: &Arc<glow::Context>) -> Result<Writer, Error> {
        // SAFETY: the context is current.
        let framebuffer = unsafe { gl.create_framebuffer() }.map_err(|_| not_made(gl, "apply: framebuffer"))?;
        Ok(Writer { gl: gl.clone(), framebuffer })
    }

    /// Writes visibility, which belongs to a view of this size, or is half as large. `bound` is the state of the
    /// application.
    pub(super) fn write(
        &self,
        programs: &mut ProgramCache,
        full_screen: &FullScreen,
        (visibility, size): (&Texture, (u32, u32)),
        inputs: &Inputs,
        output: &Output,
        bound: Bound,
    ) -> Result<(), Error> {
        let gl = &self.gl;
        let (x, y) = output.corner;
        let place = Viewport { x, y, width: size.0, height: size.1 };
        let share = self.share(size, inputs, output)?;
        match output.to {
            Destination::Texture(image) => {
                Found::of(gl, "output", image.texture, image.target)?.part("output", Some(place), size)?;
                self.attach(Some(image));
            }
            Destination::Framebuffer(framebuffer) => self.bind(framebuffer),
            Destination::Bound => self.bind(bound.framebuffer),
        }
        let drawn = self.draw(programs, full_screen, (visibility, size), share, output, bound);
        if matches!(output.to, Destination::Texture(_)) {
            // The caller may delete the texture.
            self.attach(None);
        }
        drawn
    }

    /// Returns the share of ambient light.
    fn share(&self, size: (u32, u32), inputs: &Inputs, output: &Output) -> Result<Share, Error> {
        match output.write {
            Write::Visibility => Ok(Share::Constant(1.0)),
            Write::Multiplied(share) if (0.0..=1.0).contains(&share) => Ok(Share::Constant(share)),
            Write::Multiplied(share) => usage(format!("the share of ambient light must be from 0 to 1, not {share}")),
            Write::MultipliedByShare(image) => {
                if matches!(output.to, Destination::Texture(to) if to.texture == image.texture) {
                    return usage("the texture of shares is the one that is written to: use another one".into());
                }
                let found = Found::of(&self.gl, "shares", image.texture, image.target)?;
                let part = found.part("shares", inputs.viewport, size)?;
                Ok(Share::Image(image, part.map_or((0, 0), |part| part.corner)))
            }
        }
    }

    fn bind(&self, framebuffer: Option<glow::Framebuffer>) {
        // SAFETY: the context is current, and the caller promises that the framebuffer exists; otherwise the call is a
        // GL error.
        unsafe { self.gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, framebuffer) };
    }

    /// Binds the framebuffer for textures, and attaches this one in place of an earlier one.
    fn attach(&self, image: Option<TextureRef>) {
        let (gl, point) = (&self.gl, glow::COLOR_ATTACHMENT0);
        // SAFETY: the context is current, and the framebuffer is ours.
        unsafe {
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(self.framebuffer));
            match image {
                None => gl.framebuffer_texture(glow::DRAW_FRAMEBUFFER, point, None, 0),
                Some(TextureRef { texture, target: TextureTarget::Layer(layer) }) => {
                    gl.framebuffer_texture_layer(glow::DRAW_FRAMEBUFFER, point, Some(texture), 0, layer as i32);
                }
                Some(TextureRef { texture, target }) => {
                    gl.framebuffer_texture_2d(glow::DRAW_FRAMEBUFFER, point, target.gl(), Some(texture), 0);
                }
            }
        }
    }

    /// Draws into the bound framebuffer.
    fn draw(
        &self,
        programs: &mut ProgramCache,
        full_screen: &FullScreen,
        (visibility, size): (&Texture, (u32, u32)),
        share: Share,
        output: &Output,
        bound: Bound,
    ) -> Result<(), Error> {
        let gl = &self.gl;
        self.check_framebuffer()?;
        let pass = ApplyPass::new(programs, share)?;
        let (x, y) = output.corner;
        let halved = (visibility.width, visibility.height) != size;
        let multiplies = !matches!(output.write, Write::Visibility);
        let blending = multiplies.then(|| Multiplying::begin(gl));
        // SAFETY: the context is current.
        unsafe {
            gl.viewport(x as i32, y as i32, size.0 as i32, size.1 as i32);
            gl.disable(glow::STENCIL_TEST);
            if bound.srgb && multiplies {
                gl.enable(glow::FRAMEBUFFER_SRGB);
            }
        }
        pass.draw(full_screen, visibility, halved, output.corner);
        drop(blending);
        Ok(())
    }

    /// Refuses a framebuffer that nothing can be drawn to, and one with several draw buffers: the others would be
    /// overwritten with undefined values.
    fn check_framebuffer(&self) -> Result<(), Error> {
        let gl = &self.gl;
        check(gl, "output")?;
        // SAFETY: the context is current, and these are core parameters.
        unsafe {
            let status = gl.check_framebuffer_status(glow::DRAW_FRAMEBUFFER);
            if status != glow::FRAMEBUFFER_COMPLETE {
                check(gl, "output")?;
                return Err(Error::gl("output", format!("incomplete: {}", incompleteness(status))));
            }
            let buffers = gl.get_parameter_i32(glow::MAX_DRAW_BUFFERS).max(1) as u32;
            let draws = |buffer: &u32| gl.get_parameter_i32(glow::DRAW_BUFFER0 + buffer) as u32 != glow::NONE;
            if !draws(&0) || (1..buffers).any(|buffer| draws(&buffer)) {
                let count = (0..buffers).filter(draws).count();
                return usage(format!(
                    "output: the framebuffer must draw into its first draw buffer alone, and it draws into {count}: call \
                     glDrawBuffers with one attachment, or use a framebuffer of the colour alone"
                ));
            }
        }
        Ok(())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // SAFETY: the framebuffer is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_framebuffer(self.framebuffer) };
    }
}
