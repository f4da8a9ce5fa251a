//! The library's face: ambient occlusion of depth and normals that somebody else owns.

mod inputs;
mod plan;
mod programs;
mod targets;

pub use inputs::Inputs;
pub(crate) use programs::Purpose;

use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, Format, Renderbuffer, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::{DepthInput, FullScreen, Grid, TextureRef};
use crate::settings::{AoFormat, DepthSigma, MethodBlur, Settings};
use glow::HasContext;
use plan::Plan;
use programs::{InputKind, Programs};
use std::sync::Arc;
use targets::{AoTarget, COVERED, EDGE, mark, only_where, read};

/// Where errors come from that the application made and did not ask for: they would read as ours.
const PENDING: &str = "an error left by the application before ambient occlusion";

/// What is asked of a run beside ambient occlusion itself.
#[derive(Clone, Copy, Default)]
pub(crate) struct Extras {
    /// Ambient occlusion as it was before the blur.
    pub(crate) raw: bool,
    /// Which pixels are edges.
    pub(crate) edges: bool,
}

/// What an [`Extras`] asked for.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) raw: Option<Image<f32>>,
    pub(crate) edges: Option<Image<bool>>,
}

/// Computes ambient occlusion in a context that the caller owns and has current at every call, the drop included.
///
/// All OpenGL state that it touches is put back, after an error too: what is tested, masked and blended, the stencil,
/// the viewport, the program, vertex array, framebuffers and renderbuffer bound, texture units 0 to 3, and how pixels
/// are unpacked. It needs OpenGL 3.3 core and no extension; state that later versions add is not looked at.
///
/// Some of what may be under way OpenGL 3.3 can neither pause nor report. Transform feedback is refused. Conditional
/// rendering would discard passes: end it first. Queries of samples, primitives and time count the passes too. And a
/// program that was deleted while in use is gone, as with any change of program.
pub struct AmbientOcclusion {
    gl: Arc<glow::Context>,
    settings: Settings,
    radius: f64,
    depth_sigma: DepthSigma,
    size: (u32, u32),
    purpose: Purpose,
    full_screen: FullScreen,
    /// Each with its stencil, which those of one size share: [`COVERED`] where there is a surface, [`EDGE`] on edges.
    targets: Vec<AoTarget>,
    /// Which target holds the result.
    last: usize,
    programs: Vec<Programs>,
}

impl AmbientOcclusion {
    /// Allocates what an image of `size` (width, height) needs. Shaders are compiled for the settings at the first
    /// [`AmbientOcclusion::render`] of each kind of inputs.
    ///
    /// # Errors
    /// A setting out of range or a radius in percent, a size that the driver cannot render, or what the driver refused.
    pub fn new(gl: Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<AmbientOcclusion, Error> {
        AmbientOcclusion::build(gl, size, settings, Purpose::Visibility)
    }

    /// The least that the same sampling can cost, for measuring: the same shader with every fetch of depth, in which
    /// what is computed after each one is replaced by a sum. What it renders means nothing.
    ///
    /// # Errors
    /// As [`AmbientOcclusion::new`].
    pub fn fetch_floor(
        gl: Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
    ) -> Result<AmbientOcclusion, Error> {
        AmbientOcclusion::build(gl, size, settings, Purpose::Floor)
    }

    /// As [`AmbientOcclusion::new`], for another purpose than its own.
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
                // A = 1 without a blur needs none, nor a radius that it would follow from.
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
                gl,
            };
            ao.allocate(&Plan::new(&ao.settings, false))?;
            Ok(ao)
        })
    }

    /// Makes the targets of a plan that are not there yet. Plans for the same settings begin alike.
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

    /// Ambient occlusion of the inputs: visibility in [0, 1], 1 is open, in the red channel of a rectangle texture of
    /// the same size (`sampler2DRect`, read at `gl_FragCoord.xy`); at half resolution without a blur, which would bring
    /// it to full size, of half the size, rounded up. It stays this object's, and valid until the next call.
    ///
    /// # Errors
    /// A texture of another kind or size than said, a projection without extent, or what the driver refused.
    pub fn render(&mut self, inputs: &Inputs) -> Result<TextureRef, Error> {
        let mut timers = Timers::new(&self.gl, false)?;
        self.render_timed(inputs, &mut timers)
    }

    /// [`AmbientOcclusion::render`], with each pass timed. No query of elapsed time may be under way.
    ///
    /// # Errors
    /// As there.
    pub fn render_timed(&mut self, inputs: &Inputs, timers: &mut Timers) -> Result<TextureRef, Error> {
        self.run(inputs, timers, Extras::default())?;
        Ok(self.texture().into())
    }

    /// Runs the passes, and reads back what else is asked for.
    pub(crate) fn run(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        gl::check(&gl, PENDING)?;
        let state = SavedState::save(&gl, self.targets.first().map(|target| &target.framebuffer))?;
        state.put_back_after(&gl, || self.passes(inputs, timers, extras))
    }

    fn passes(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        inputs.check(&gl, self.size, self.settings.method)?;
        // Edges are looked for where the blur goes by them, and where somebody wants to know.
        let edges = plan::supersamples(&self.settings) || extras.edges;
        let programs = self.programs_for(inputs.kind(self.purpose, edges))?;
        let (programs, full_screen, targets) = (&self.programs[programs], &self.full_screen, &self.targets);
        self.last = programs.plan.last();
        let last = &targets[self.last];
        let depth = DepthInput { image: inputs.depth, background: inputs.background, size: self.size };
        let mut kept = Kept::default();

        timers.pass("background", || {
            // Background is 1 from the start: the stencil keeps every pass away from it.
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
                // Background is drawn too: it has no stencil.
                half_depth.draw(full_screen, &depth);
                Ok(())
            })?;
        }
        if let Some(ao) = &programs.ao {
            timers.pass("ao", || {
                targets[0].framebuffer.bind();
                only_where(&gl, COVERED, COVERED);
                let view = (targets[0].grid, inputs.projection, inputs.near);
                ao.draw(full_screen, &depth, inputs.normals, view, (self.radius, &self.settings));
                Ok(())
            })?;
        }
        if extras.raw {
            kept.raw = Some(read(&targets[0])?);
        }
        if let (Some(edges), Some(samples), Some(full)) = (&programs.edges, inputs.samples, programs.plan.full()) {
            timers.pass("edges", || {
                targets[full].framebuffer.bind();
                mark(&gl, EDGE, || edges.draw(full_screen, samples, inputs.background, self.depth_sigma));
                Ok(())
            })?;
        }
        for (step, blur) in &programs.blurs {
            let (from, to) = (&targets[step.from], &targets[step.to]);
            timers.pass(step.name, || {
                to.framebuffer.bind();
                // What the edges' own pass draws, the last one leaves to it.
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
                blur.draw(full_screen, &targets[step.from].texture, &depth, inputs.samples, self.depth_sigma);
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

    /// What the last run left, read back: after the blur, if there is one.
    pub(crate) fn image(&self) -> Result<Image<f32>, Error> {
        read(&self.targets[self.last])
    }

    /// The texture of [`AmbientOcclusion::image`].
    pub(crate) fn texture(&self) -> &Texture {
        &self.targets[self.last].texture
    }

    /// The index of the programs for a kind of inputs, compiled where they are not yet.
    fn programs_for(&mut self, kind: InputKind) -> Result<usize, Error> {
        if let Some(found) = self.programs.iter().position(|programs| programs.kind == kind) {
            return Ok(found);
        }
        let programs = Programs::new(&self.gl, &self.settings, (self.purpose, self.size), kind)?;
        self.allocate(&programs.plan)?;
        self.programs.push(programs);
        Ok(self.programs.len() - 1)
    }
}
