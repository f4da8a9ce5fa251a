//! Ambient occlusion of depth and normals that an application owns: the part of the library that applications embed.

mod check;
mod diagnose;
mod evidence;
mod input_textures;
mod inputs;
mod plan;
mod programs;
mod targets;

pub use diagnose::Finding;
pub use input_textures::InputTextures;
pub use inputs::{Inputs, Viewport};
pub(crate) use programs::Purpose;

use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, Format, Renderbuffer, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::linear_depth::LinearDepth;
use crate::pass::method::{MethodView, NormalsInput};
use crate::pass::{FullScreen, Grid, TextureRef};
use crate::projection::Projection;
use crate::settings::{AoFormat, DepthSigma, MethodBlur, Settings};
use glow::HasContext;
use plan::Plan;
use programs::{InputKind, Programs};
use std::sync::Arc;
use targets::{AoTarget, COVERED, EDGE, mark, only_where, read};

/// The name of the place that is given in OpenGL errors that were recorded before a call. Without it, an error of the
/// application would seem to come from this library.
const PENDING: &str = "an error left by the application before ambient occlusion";

/// The results that a run keeps besides ambient occlusion itself.
#[derive(Clone, Copy, Default)]
pub(crate) struct Extras {
    /// Keep ambient occlusion as it was before the blur.
    pub(crate) raw: bool,
    /// Keep which pixels are edges.
    pub(crate) edges: bool,
}

/// The results that an [`Extras`] asked for.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) raw: Option<Image<f32>>,
    pub(crate) edges: Option<Image<bool>>,
}

/// Computes ambient occlusion in an OpenGL context that the caller owns. The context must be current at every call, and
/// when this value is dropped.
///
/// All OpenGL state that a call changes is restored, after an error too: the enabled capabilities; the masks, blending,
/// stencil and polygon mode; the viewport; the bound program, vertex array, framebuffers and renderbuffer; texture
/// units 0 to 3 with their samplers; and the parameters of pixel unpacking. OpenGL 3.3 core is enough, and no extension
/// is needed. State that exists only in later versions is neither saved nor changed.
///
/// An application may have activated the following features, which OpenGL 3.3 can neither pause nor detect:
///
/// - If transform feedback is active, a call fails. End it first.
/// - Conditional rendering would discard passes. End it first.
/// - Active queries of samples, primitives or elapsed time also count the passes.
/// - A program that was deleted while it was in use ceases to exist during the call, as after any change of the program
///   in use.
pub struct AmbientOcclusion {
    gl: Arc<glow::Context>,
    settings: Settings,
    radius: f64,
    depth_sigma: DepthSigma,
    size: (u32, u32),
    purpose: Purpose,
    full_screen: FullScreen,
    /// The images that the passes draw into. Each has a stencil with the bit [`COVERED`] at pixels that hold a surface,
    /// and the bit [`EDGE`] at edge pixels. Targets of the same size share one stencil.
    targets: Vec<AoTarget>,
    /// The index of the target that holds the result.
    last: usize,
    programs: Vec<Programs>,
    /// The index of the programs of the last run.
    current: usize,
}

impl AmbientOcclusion {
    /// Allocates the textures and framebuffers for images of `size` (width, height) pixels. Shaders are compiled later,
    /// at the first [`AmbientOcclusion::render`] of each kind of inputs.
    ///
    /// # Errors
    /// [`Error::Usage`] for a setting out of range, a radius in percent, or a size that the driver cannot render.
    /// [`Error::Gl`] if the driver refuses an allocation, if transform feedback is active, or if an OpenGL error is
    /// pending.
    pub fn new(gl: Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<AmbientOcclusion, Error> {
        AmbientOcclusion::build(gl, size, settings, Purpose::Visibility)
    }

    /// Makes the fetch floor of the method, for measurements: the method's shader with all its fetches of depth, in
    /// which a sum replaces the arithmetic after each fetch. The time of the floor is the least that this sampling can
    /// cost. The floor has no blur, and the values that it renders are meaningless.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::new`].
    pub fn fetch_floor(
        gl: Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
    ) -> Result<AmbientOcclusion, Error> {
        AmbientOcclusion::build(gl, size, settings, Purpose::Floor)
    }

    /// Does the same as [`AmbientOcclusion::new`], for any purpose.
    pub(crate) fn build(
        gl: Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        purpose: Purpose,
    ) -> Result<AmbientOcclusion, Error> {
        settings.validate()?;
        gl::check(&gl, PENDING)?;
        gl::check_size(&gl, size.0, size.1)?;
        let mut settings = settings.clone();
        if matches!(purpose, Purpose::Floor | Purpose::Edges) {
            settings.blur = 0;
        }
        let state = SavedState::save(&gl, None)?;
        state.put_back_after(&gl.clone(), || {
            let mut ao = AmbientOcclusion {
                radius: settings.radius_read()?,
                // A method without a blur, whose A is 1 everywhere, needs no depth sigma. Therefore it needs no radius
                // either, from which the sigma would follow.
                depth_sigma: match (settings.method.facts().blur, purpose) {
                    (MethodBlur::None, Purpose::Visibility) => settings.depth_sigma().unwrap_or(DepthSigma::Units(0.0)),
                    _ => settings.depth_sigma()?,
                },
                settings,
                size,
                purpose,
                full_screen: FullScreen::new(&gl)?,
                targets: Vec::new(),
                last: 0,
                programs: Vec::new(),
                current: 0,
                gl,
            };
            ao.allocate(&Plan::new(&ao.settings, false))?;
            Ok(ao)
        })
    }

    /// Makes those targets of the plan that do not exist yet. All plans for the same settings begin with the same
    /// targets.
    fn allocate(&mut self, plan: &Plan) -> Result<(), Error> {
        let format = match self.settings.ao_format {
            AoFormat::R8 => Format::R8,
            AoFormat::R16f => Format::R16f,
            AoFormat::R32f => Format::R32f,
        };
        for (i, &scale) in plan.scales.iter().enumerate().skip(self.targets.len()) {
            let grid = Grid { full: self.size, scale };
            let (gl, size) = (&self.gl, grid.size());
            let place = |object| format!("{}: {object}", ["ao", "blur", "blurred"][i]);
            let stencil = match self.targets.iter().find(|target| target.grid == grid) {
                Some(target) => target.stencil.clone(),
                None => Arc::new(Renderbuffer::new(gl, &place("stencil"), glow::DEPTH24_STENCIL8, size, 0)?),
            };
            let texture = Texture::new(gl, &place("image"), format, size.0, size.1)?;
            let attachment = Some((glow::DEPTH_STENCIL_ATTACHMENT, &*stencil));
            let framebuffer = Target::new(gl, &place("framebuffer"), &[&texture], attachment, size)?;
            self.targets.push(AoTarget { grid, texture, framebuffer, stencil });
        }
        Ok(())
    }

    /// Returns the depth beyond which the method exits early, so that visibility is 1 at all farther surfaces, for
    /// inputs with this projection. It is infinite if the method exits nowhere. See [`Settings::exit_depth`].
    #[must_use]
    pub fn exit_depth(&self, projection: Projection) -> f64 {
        // The radius was in scene units when this object was made, so there is no error.
        self.settings.exit_depth(projection, self.size).unwrap_or(f64::INFINITY)
    }

    /// Computes the ambient occlusion of the inputs: visibility in [0, 1], where 1 means that nothing occludes.
    /// Background is 1. The result is in the red channel of the returned rectangle texture, to be read through a
    /// `sampler2DRect` at `gl_FragCoord.xy`.
    ///
    /// The texture has the size that this object was made for. At half resolution without a blur, which would bring it
    /// to full size, it has half the width and height, rounded up. The texture belongs to this object, and its contents
    /// are valid until the next call.
    ///
    /// # Errors
    /// [`Error::Usage`] for inputs that cannot be right: a texture of another size or number of samples than declared,
    /// a layer that does not exist, or a format that cannot hold what its encoding says; a viewport of another size, or
    /// one that reaches past a texture; near and far planes in the wrong order, a matrix that is no projection, or a
    /// view matrix that is no rotation; what [`Projection::check`] refuses; or a near plane that `ray-march` cannot
    /// use. What is plausible and still wrong, [`AmbientOcclusion::diagnose`] finds. [`Error::Gl`] for a texture of
    /// another kind than declared, if transform feedback is active, if an OpenGL error is pending, or if the driver
    /// refuses a shader, an allocation or a call.
    pub fn render(&mut self, inputs: &Inputs) -> Result<TextureRef, Error> {
        let mut timers = Timers::new(&self.gl, false)?;
        self.render_timed(inputs, &mut timers)
    }

    /// Does the same as [`AmbientOcclusion::render`], with each pass run by `timers`. If they measure, no query of
    /// elapsed time may be active.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::render`].
    pub fn render_timed(&mut self, inputs: &Inputs, timers: &mut Timers) -> Result<TextureRef, Error> {
        self.run(inputs, timers, Extras::default())?;
        Ok(self.texture().into())
    }

    /// Returns the linear depth that the last call of [`AmbientOcclusion::render`] made from encoded or multisample
    /// depth: a rectangle texture in R32F, [`BACKGROUND_R32F`](crate::BACKGROUND_R32F) on background. `None` if the
    /// caller's depth was linear already. Like the result, it is valid until the next call.
    #[must_use]
    pub fn linear_depth(&self) -> Option<TextureRef> {
        self.programs.get(self.current)?.linear_depth.as_ref().map(|pass| (&pass.texture).into())
    }

    /// Returns the normals that the last call of [`AmbientOcclusion::render`] rebuilt from depth: a rectangle texture
    /// in RGBA16F, of left-handed eye space and of any length, undefined on background. At half resolution it has half
    /// the width and height, rounded up. `None` if the caller has normals, or if the method reads none. Like the
    /// result, it is valid until the next call.
    #[must_use]
    pub fn rebuilt_normals(&self) -> Option<TextureRef> {
        self.programs.get(self.current)?.rebuilt_normals.as_ref().map(|pass| (&pass.texture).into())
    }

    /// Runs the passes, and reads back what `extras` asks for.
    pub(crate) fn run(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        gl::check(&gl, PENDING)?;
        let state = SavedState::save(&gl, self.targets.first().map(|target| &target.framebuffer))?;
        state.put_back_after(&gl, || self.passes(inputs, timers, extras))
    }

    fn passes(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        let checked = inputs.check(&gl, self.size, self.settings.method)?;
        // Edges are detected if the blur treats them separately, or if the caller asks for them.
        let edges = plan::supersamples(&self.settings) || extras.edges;
        self.current = self.programs_for(checked.kind(inputs, self.purpose, edges))?;
        let (programs, full_screen, targets) = (&self.programs[self.current], &self.full_screen, &self.targets);
        self.last = programs.plan.last();
        let last = &targets[self.last];
        let mut kept = Kept::default();

        let mut depth = checked.depth;
        if let Some(linear_depth) = &programs.linear_depth {
            timers.pass("linear_depth", || {
                // This target has no stencil: background is not known before this pass.
                depth = linear_depth.draw(full_screen, &checked.depth, checked.curve);
                Ok(())
            })?;
        }
        timers.pass("background", || {
            // Every target is cleared to 1, the value of background. The stencil keeps every pass away from background.
            for target in &targets[..programs.plan.scales.len()] {
                target.framebuffer.bind();
                // SAFETY: the context is current.
                unsafe { gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]) };
            }
            for (target, background) in &programs.stencils {
                targets[*target].framebuffer.bind();
                // SAFETY: the context is current.
                unsafe {
                    gl.stencil_mask(0xff);
                    gl.clear_buffer_i32_slice(glow::STENCIL, 0, &[0]);
                }
                mark(&gl, COVERED, || background.draw(full_screen, &depth));
            }
            Ok(())
        })?;
        if let Some(half_depth) = &programs.half_depth {
            timers.pass("half_depth", || {
                // This target has no stencil, so background is drawn too.
                half_depth.draw(full_screen, &depth);
                Ok(())
            })?;
        }
        let mut normals = checked.normals;
        if let Some(rebuilt) = &programs.rebuilt_normals {
            timers.pass("rebuilt_normals", || {
                only_where(&gl, COVERED, COVERED);
                rebuilt.draw(full_screen, &depth, inputs.projection);
                normals = Some(NormalsInput { image: (&rebuilt.texture).into(), part: None, to_eye: None });
                Ok(())
            })?;
        }
        if let Some(ao) = &programs.ao {
            timers.pass("ao", || {
                targets[0].framebuffer.bind();
                only_where(&gl, COVERED, COVERED);
                let view =
                    MethodView { grid: targets[0].grid, projection: inputs.projection, near: inputs.near_plane() };
                ao.draw(full_screen, &depth, normals.as_ref(), view, self.radius, &self.settings);
                Ok(())
            })?;
        }
        if extras.raw {
            kept.raw = Some(read(&targets[0])?);
        }
        if let (Some(edges), Some(samples), Some(full)) = (&programs.edges, &checked.samples, programs.plan.full()) {
            timers.pass("edges", || {
                targets[full].framebuffer.bind();
                mark(&gl, EDGE, || edges.draw(full_screen, samples, depth.background, self.depth_sigma));
                Ok(())
            })?;
        }
        for (step, blur) in &programs.blurs {
            let (from, to) = (&targets[step.from], &targets[step.to]);
            timers.pass(step.name, || {
                to.framebuffer.bind();
                // The last pass leaves edge pixels out if a pass of their own draws them afterwards.
                let left_out = if programs.blur_edges.is_some() && step.to == self.last { EDGE } else { 0 };
                only_where(&gl, COVERED, COVERED | left_out);
                blur.draw(full_screen, &from.texture, &depth, None, self.depth_sigma);
                Ok(())
            })?;
        }
        if let Some((step, blur)) = &programs.blur_edges {
            timers.pass(step.name, || {
                last.framebuffer.bind();
                only_where(&gl, EDGE, EDGE);
                blur.draw(full_screen, &targets[step.from].texture, &depth, checked.samples.as_ref(), self.depth_sigma);
                Ok(())
            })?;
        }
        if extras.edges {
            let (width, height) = (self.size.0 as usize, self.size.1 as usize);
            let texels = match (&programs.edges, programs.plan.full()) {
                (Some(_), Some(full)) => targets[full]
                    .framebuffer
                    .read_stencil("edges: reading them back")?
                    .iter()
                    .map(|bits| u32::from(*bits) & EDGE != 0)
                    .collect(),
                _ => vec![false; width * height],
            };
            kept.edges = Some(Image { width, height, texels });
        }
        Ok(kept)
    }

    /// Reads back the linear depth that the last call of [`AmbientOcclusion::render`] made, as
    /// [`AmbientOcclusion::linear_depth`] lends it. `None` if the caller's depth was linear already.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver refuses to read the image back.
    pub fn linear_depth_image(&self) -> Result<Option<Image<f32>>, Error> {
        let pass = self.programs.get(self.current).and_then(|programs| programs.linear_depth.as_ref());
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let read = |pass: &LinearDepth| self.read_back(|| pass.texture.read());
        pass.map(|pass| Ok(Image { width, height, texels: read(pass)? })).transpose()
    }

    /// Reads back the result of the last call of [`AmbientOcclusion::render`].
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver refuses to read the image back.
    pub fn image(&self) -> Result<Image<f32>, Error> {
        self.read_back(|| read(&self.targets[self.last]))
    }

    /// Runs `read`, which reads an image back, and restores the state that it changes.
    fn read_back<T>(&self, read: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        gl::check(&self.gl, PENDING)?;
        let state = SavedState::save(&self.gl, self.targets.first().map(|target| &target.framebuffer))?;
        state.put_back_after(&self.gl, read)
    }

    /// Returns the texture that [`AmbientOcclusion::image`] reads.
    pub(crate) fn texture(&self) -> &Texture {
        &self.targets[self.last].texture
    }

    /// Returns the index of the programs for a kind of inputs. The programs are compiled if they do not exist yet.
    fn programs_for(&mut self, kind: InputKind) -> Result<usize, Error> {
        if let Some(found) = self.programs.iter().position(|programs| programs.kind == kind) {
            return Ok(found);
        }
        let mut programs = Programs::new(&self.gl, &self.settings, self.purpose, self.size, kind)?;
        self.allocate(&programs.plan)?;
        let drawn = &self.targets[0];
        programs.add_rebuilt_normals(&self.gl, &self.settings, drawn.grid, &drawn.stencil)?;
        self.programs.push(programs);
        Ok(self.programs.len() - 1)
    }
}
