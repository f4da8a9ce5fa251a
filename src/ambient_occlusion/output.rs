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
#[non_exhaustive]
pub struct Output {
    /// The image that is written to.
    pub to: Destination,
    /// The lower left pixel of the view in that image. Of a view that reaches past a framebuffer, the rest is cut off.
    pub corner: (u32, u32),
    /// What is written.
    pub write: Write,
}

impl Output {
    /// Writes to an image, from its lower left corner on.
    #[must_use]
    pub fn new(to: Destination, write: Write) -> Output {
        Output { to, corner: (0, 0), write }
    }

    /// Multiplies the colours of a framebuffer by visibility, from its lower left corner on; `None` is the window.
    #[must_use]
    pub fn multiplied(framebuffer: Option<glow::Framebuffer>) -> Output {
        Output::new(Destination::Framebuffer(framebuffer), Write::Multiplied(1.0))
    }

    /// Writes from this pixel on, the lower left one of the view.
    #[must_use]
    pub fn at(self, corner: (u32, u32)) -> Output {
        Output { corner, ..self }
    }
}

/// An image of the caller.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
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
#[non_exhaustive]
pub enum Write {
    /// Visibility A, in red, green and blue; alpha becomes 1.
    Visibility,
    /// The colour that is there, times 1 - s (1 - A). The share s of ambient light in the colour is from 0 to 1; with 1
    /// the whole colour is multiplied by A. Alpha is kept. If the application has enabled `GL_FRAMEBUFFER_SRGB`,
    /// colours in sRGB formats are multiplied as linear light.
    Multiplied(f32),
    /// The same, with a share s for each pixel, in the alpha channel of a texture: the ambient light's share of the
    /// light that reaches the pixel. An application that has the two apart gets the exact colour if it multiplies the
    /// image of ambient light alone, and adds the rest. The texture has the size of the view, or, with
    /// [`Inputs::viewport`], holds the view in the same part as the inputs; it may be the texture of normals, whose
    /// alpha nothing else reads. It must not be the image that is written to.
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
    /// The pass, compiled for the kinds of shares so far.
    passes: Vec<ApplyPass>,
}

impl Writer {
    pub(super) fn new(gl: &Arc<glow::Context>) -> Result<Writer, Error> {
        // SAFETY: the context is current.
        let framebuffer = unsafe { gl.create_framebuffer() }.map_err(|_| not_made(gl, "apply: framebuffer"))?;
        Ok(Writer { gl: gl.clone(), framebuffer, passes: Vec::new() })
    }

    /// Compiles the pass for one share, which most applications have.
    pub(super) fn prepare(&mut self, programs: &mut ProgramCache) -> Result<(), Error> {
        self.pass(programs, Share::Constant(1.0)).map(drop)
    }

    /// Returns the pass for a share of this kind, and compiles it if it is the first.
    fn pass(&mut self, programs: &mut ProgramCache, share: Share) -> Result<&ApplyPass, Error> {
        let index = match self.passes.iter().position(|pass| pass.takes(share)) {
            Some(found) => found,
            None => {
                self.passes.push(ApplyPass::new(programs, share)?);
                self.passes.len() - 1
            }
        };
        Ok(&self.passes[index])
    }

    /// Writes visibility, which belongs to a view of this size, or is half as large. `bound` is the state of the
    /// application.
    pub(super) fn write(
        &mut self,
        programs: &mut ProgramCache,
        full_screen: &FullScreen,
        (visibility, size): (&Texture, (u32, u32)),
        inputs: &Inputs,
        output: &Output,
        bound: Bound,
    ) -> Result<(), Error> {
        let (x, y) = output.corner;
        if x.max(y) > i32::MAX as u32 / 2 {
            return usage(format!("output: the corner {x},{y} lies past every image"));
        }
        let place = Viewport { x, y, width: size.0, height: size.1 };
        let share = self.share(size, inputs, output)?;
        match output.to {
            Destination::Texture(image) => {
                if inputs.reads(image) {
                    return usage(
                        "output: the texture that is written to is one of the inputs: use another one".into(),
                    );
                }
                let found = Found::of(&self.gl, "output", image.texture, image.target)?;
                found.part("output", Some(place), size)?;
                if !found.holds_fractions() {
                    return usage(
                        "output: the texture has a format that holds no visibility: use R8 or RGBA8, or a float format"
                            .into(),
                    );
                }
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
                    return usage(SHARES_WRITTEN.into());
                }
                let found = Found::of(&self.gl, "shares", image.texture, image.target)?;
                if !found.has_alpha() {
                    return usage("shares: the texture has no alpha channel with numbers from 0 to 1".into());
                }
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
        &mut self,
        programs: &mut ProgramCache,
        full_screen: &FullScreen,
        (visibility, size): (&Texture, (u32, u32)),
        share: Share,
        output: &Output,
        bound: Bound,
    ) -> Result<(), Error> {
        self.check_framebuffer(share)?;
        let gl = self.gl.clone();
        let pass = self.pass(programs, share)?;
        let (x, y) = output.corner;
        let halved = (visibility.width, visibility.height) != size;
        let multiplies = !matches!(output.write, Write::Visibility);
        let blending = multiplies.then(|| Multiplying::begin(&gl)).transpose()?;
        // SAFETY: the context is current.
        unsafe {
            gl.viewport(x as i32, y as i32, size.0 as i32, size.1 as i32);
            gl.disable(glow::STENCIL_TEST);
            if bound.srgb && multiplies {
                gl.enable(glow::FRAMEBUFFER_SRGB);
            }
        }
        pass.draw(full_screen, (visibility, halved), share, output.corner);
        drop(blending);
        Ok(())
    }

    /// Refuses a framebuffer that nothing can be drawn to, and one with several draw buffers: the others would be
    /// overwritten with undefined values. Refuses a share that is read from what is drawn to.
    fn check_framebuffer(&self, share: Share) -> Result<(), Error> {
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
            let several = (1..buffers).any(|buffer| draws(&buffer));
            let none = !draws(&0);
            check(gl, "output")?;
            if none || several {
                let count = (0..buffers).filter(draws).count();
                return usage(format!(
                    "output: the framebuffer must draw into its first draw buffer alone, and it draws into {count}: call \
                     glDrawBuffers with one attachment, or give the colour as Destination::Texture"
                ));
            }
            let attachment = gl.get_parameter_i32(glow::DRAW_BUFFER0) as u32;
            if let Share::Image(TextureRef { texture, target }, _) = share
                && attachment >= glow::COLOR_ATTACHMENT0
                && !matches!(target, TextureTarget::Layer(_))
            {
                let parameter = glow::FRAMEBUFFER_ATTACHMENT_OBJECT_NAME;
                let name = gl.get_framebuffer_attachment_parameter_i32(glow::DRAW_FRAMEBUFFER, attachment, parameter);
                if name as u32 == texture.0.get() {
                    return usage(SHARES_WRITTEN.into());
                }
            }
        }
        Ok(())
    }
}

const SHARES_WRITTEN: &str = "shares: their texture is the one that is written to: use another one";

impl Drop for Writer {
    fn drop(&mut self) {
        // SAFETY: the framebuffer is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_framebuffer(self.framebuffer) };
    }
}
