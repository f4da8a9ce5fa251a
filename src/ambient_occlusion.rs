//! The library's face: ambient occlusion of depth and normals that somebody else owns.

mod plan;

use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, Format, Renderbuffer, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::background::Background;
use crate::pass::blur::{self, Blur};
use crate::pass::edges::Edges;
use crate::pass::half_depth::HalfDepth;
use crate::pass::method::{self, MethodPass, NormalEncoding};
use crate::pass::{BACKGROUND_R32F, DepthInput, DepthSamples, FullScreen, Grid, TextureRef, TextureTarget};
use crate::scene::Projection;
use crate::settings::{AoFormat, DepthSigma, Method, Settings, SsaoDepth};
use glow::HasContext;
use plan::{Plan, Step};
use std::sync::Arc;

/// What ambient occlusion is computed from: a view's depth and normals, of the size that [`AmbientOcclusion`] was made
/// for, the bottom row first.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Linear eye-space z in scene units, above 0 and growing away from the eye; one float channel.
    pub depth: TextureRef,
    /// Depths from here on are background, whose ambient occlusion is 1. Finite: [`BACKGROUND_R32F`], or
    /// [`crate::BACKGROUND_R16F`] in a 16-bit image.
    pub background: f32,
    /// Normals in left-handed eye space (x right, y up, z forward) that face the eye, of any length.
    pub normals: TextureRef,
    /// How the normals are stored.
    pub normal_encoding: NormalEncoding,
    /// With multisample antialiasing, the linear depth of every sample; `depth` and `normals` are then those of one
    /// sample of each pixel. The blur at pixels that hold several surfaces reads it, where the settings' `edges` say
    /// so. [`Inputs::new`] has none.
    pub samples: Option<DepthSamples>,
    /// The view's projection, centred.
    pub projection: Projection,
    /// The near plane's z, above 0, at which the rays of `ray-march` end. No other method reads it, and
    /// [`Inputs::new`] leaves it 0.
    pub near: f64,
}

impl Inputs {
    /// Linear depth in R32F and signed normals, both of one kind of texture.
    pub fn new(depth: glow::Texture, normals: glow::Texture, target: TextureTarget, projection: Projection) -> Inputs {
        Inputs {
            depth: TextureRef { texture: depth, target },
            background: BACKGROUND_R32F,
            normals: TextureRef { texture: normals, target },
            normal_encoding: NormalEncoding::Signed,
            samples: None,
            projection,
            near: 0.0,
        }
    }

    /// Refuses what would be computed with and mean nothing.
    fn check(&self, gl: &glow::Context, size: (u32, u32)) -> Result<(), Error> {
        let (x, y) = match self.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => (tan_half_fov_x, tan_half_fov_y),
            Projection::Orthographic { half_width, half_height } => (half_width, half_height),
        };
        if !(x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0) {
            return Err(Error::Usage(format!("{:?}: both extents must be finite and above 0", self.projection)));
        }
        let multisample = glow::TEXTURE_2D_MULTISAMPLE;
        let samples = self.samples.map(|samples| ("samples", samples.texture, multisample, samples.samples));
        let plain = [("depth", self.depth), ("normals", self.normals)];
        let plain = plain.map(|(name, image)| (name, image.texture, image.target.gl(), 0));
        for (name, texture, kind, samples) in plain.into_iter().chain(samples) {
            // SAFETY: the context is current; a texture of another kind is a GL error, and nothing more.
            let found = unsafe {
                gl.bind_texture(kind, Some(texture));
                gl::check(gl, &format!("the {name} texture is not of the kind said"))?;
                let parameter = |parameter| gl.get_tex_level_parameter_i32(kind, 0, parameter);
                let size = [glow::TEXTURE_WIDTH, glow::TEXTURE_HEIGHT].map(parameter);
                // What is compiled in must be what there is.
                let samples = if kind == multisample { parameter(glow::TEXTURE_SAMPLES) } else { 0 };
                (size.map(i64::from), i64::from(samples))
            };
            gl::check(gl, &format!("the {name} texture's size"))?;
            if found.0 != [i64::from(size.0), i64::from(size.1)] {
                let ([width, height], (w, h)) = (found.0, size);
                return Err(Error::Usage(format!(
                    "the {name} texture has {width}x{height} texels, and ambient occlusion is set up for {w}x{h}"
                )));
            }
            if found.1 != i64::from(samples) {
                return Err(Error::Usage(format!(
                    "the {name} texture has {} samples a pixel, not the {samples} said",
                    found.1
                )));
            }
        }
        Ok(())
    }

    fn variant(&self, purpose: Purpose, edges: bool) -> Variant {
        Variant {
            method: method::Variant {
                orthographic: matches!(self.projection, Projection::Orthographic { .. }),
                depth: self.depth.target,
                normals: self.normals.target,
                encoding: self.normal_encoding,
                floor: purpose == Purpose::Floor,
            },
            samples: self.samples.map(|samples| samples.samples).filter(|_| edges),
        }
    }
}

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

/// A texture and the framebuffer that draws into it.
struct Surface {
    grid: Grid,
    texture: Texture,
    target: Target,
    stencil: Arc<Renderbuffer>,
}

/// What an [`AmbientOcclusion`] is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Ambient occlusion.
    Visibility,
    /// The fetch floor of the method's pass, without a blur.
    Floor,
    /// Which pixels are edges, and nothing else: A = 1.
    Edges,
    /// The blur, over A = 1 in place of what the method would draw.
    Blur,
}

/// Bits of the stencil.
const COVERED: u32 = 1;
const EDGE: u32 = 2;

/// What the programs are compiled for, beside the settings.
#[derive(Clone, Copy, PartialEq)]
struct Variant {
    method: method::Variant,
    /// The depth samples of a pixel, where edges are looked for.
    samples: Option<u32>,
}

/// The programs that one kind of inputs needs.
struct Programs {
    variant: Variant,
    plan: Plan,
    /// The surface that a stencil is first used with, and the pass that fills it. None where nothing is masked.
    stencils: Vec<(usize, Background)>,
    /// None where A = 1 everywhere.
    ao: Option<MethodPass>,
    /// What the method's samples read, where that is not the depth image itself.
    half_depth: Option<HalfDepth>,
    edges: Option<Edges>,
    blurs: Vec<(Step, Blur)>,
    blur_edges: Option<(Step, Blur)>,
}

impl Programs {
    fn new(
        gl: &Arc<glow::Context>,
        settings: &Settings,
        (purpose, size): (Purpose, (u32, u32)),
        variant: Variant,
    ) -> Result<Programs, Error> {
        let plan = Plan::new(settings, variant.samples.is_some());
        let depth = variant.method.depth;
        let ao = match purpose {
            Purpose::Edges | Purpose::Blur => None,
            Purpose::Visibility | Purpose::Floor => MethodPass::new(gl, settings, variant.method)?,
        };
        let mut stencils = Vec::new();
        for (i, scale) in plan.scales.iter().enumerate() {
            let masked = ao.is_some() || !plan.steps.is_empty() || variant.samples.is_some();
            if masked && !plan.scales[..i].contains(scale) {
                stencils.push((i, Background::new(gl, depth, *scale)?));
            }
        }
        let blur = |step: Step, samples| {
            let (from, to) = (plan.scales[step.from], plan.scales[step.to]);
            Ok((step, Blur::new(gl, blur::Variant { kernel: step.kernel, depth, from, to, samples })?))
        };
        let blurs = plan.steps.iter().map(|&step| blur(step, None)).collect::<Result<_, Error>>()?;
        let blur_edges = plan.edges.map(|step| blur(step, variant.samples)).transpose()?;
        let edges = variant.samples.map(|samples| Edges::new(gl, samples)).transpose()?;
        let half = settings.method == Method::Ssao && settings.ssao_depth == SsaoDepth::Half;
        let half_depth = if half && ao.is_some() { Some(HalfDepth::new(gl, depth, size)?) } else { None };
        Ok(Programs { variant, plan, stencils, ao, half_depth, edges, blurs, blur_edges })
    }
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
    surfaces: Vec<Surface>,
    /// Which surface holds the result.
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
                depth_sigma: match (settings.method, purpose) {
                    (Method::None, Purpose::Visibility) => settings.depth_sigma().unwrap_or(DepthSigma::Units(0.0)),
                    _ => settings.depth_sigma()?,
                },
                settings,
                size,
                purpose,
                full_screen: FullScreen::new(&gl)?,
                surfaces: Vec::new(),
                last: 0,
                programs: Vec::new(),
                gl,
            };
            ao.allocate(&Plan::new(&ao.settings, false))?;
            Ok(ao)
        })
    }

    /// Makes the surfaces of a plan that are not there yet. Plans for the same settings begin alike.
    fn allocate(&mut self, plan: &Plan) -> Result<(), Error> {
        let format = match self.settings.ao_format {
            AoFormat::R8 => Format::R8,
            AoFormat::R16f => Format::R16f,
            AoFormat::R32f => Format::R32f,
        };
        for (i, &scale) in plan.scales.iter().enumerate().skip(self.surfaces.len()) {
            let grid = Grid { full: self.size, scale };
            let (gl, size) = (&self.gl, grid.size());
            let place = |object| format!("{}: {object}", ["ao", "blur", "blurred"][i]);
            let stencil = match self.surfaces.iter().find(|surface| surface.grid == grid) {
                Some(surface) => surface.stencil.clone(),
                None => Arc::new(Renderbuffer::new(gl, &place("stencil"), glow::DEPTH24_STENCIL8, size, 0)?),
            };
            let texture = Texture::new(gl, &place("image"), format, size.0, size.1)?;
            let attachment = Some((glow::DEPTH_STENCIL_ATTACHMENT, &*stencil));
            let target = Target::new(gl, &place("framebuffer"), &[&texture], attachment, size)?;
            self.surfaces.push(Surface { grid, texture, target, stencil });
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
        let state = SavedState::save(&gl, self.surfaces.first().map(|surface| &surface.target))?;
        state.put_back_after(&gl, || self.passes(inputs, timers, extras))
    }

    fn passes(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        inputs.check(&gl, self.size)?;
        if self.settings.method == Method::RayMarch && (inputs.near.is_nan() || inputs.near <= 0.0) {
            return Err(Error::Usage(format!(
                "ray-march ends its rays at the near plane: near must be above 0, not {}",
                inputs.near
            )));
        }
        // Edges are looked for where the blur goes by them, and where somebody wants to know.
        let edges = plan::supersamples(&self.settings) || extras.edges;
        let programs = self.programs_for(inputs.variant(self.purpose, edges))?;
        let (programs, full_screen, surfaces) = (&self.programs[programs], &self.full_screen, &self.surfaces);
        self.last = programs.plan.last();
        let last = &surfaces[self.last];
        let depth = DepthInput { image: inputs.depth, background: inputs.background, size: self.size };
        let mut kept = Kept::default();

        timers.pass("background", || {
            // Background is 1 from the start: the stencil keeps every pass away from it.
            for surface in &surfaces[..programs.plan.scales.len()] {
                surface.target.bind();
                // SAFETY: the context is current.
                unsafe { gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]) };
            }
            for (surface, background) in &programs.stencils {
                surfaces[*surface].target.bind();
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
                surfaces[0].target.bind();
                only_where(&gl, COVERED, COVERED);
                let view = (surfaces[0].grid, inputs.projection, inputs.near);
                ao.draw(full_screen, &depth, inputs.normals, view, (self.radius, &self.settings));
                Ok(())
            })?;
        }
        if extras.raw {
            kept.raw = Some(read(&surfaces[0])?);
        }
        if let (Some(edges), Some(samples), Some(full)) = (&programs.edges, inputs.samples, programs.plan.full()) {
            timers.pass("edges", || {
                surfaces[full].target.bind();
                mark(&gl, EDGE, || edges.draw(full_screen, samples, inputs.background, self.depth_sigma));
                Ok(())
            })?;
        }
        for (step, blur) in &programs.blurs {
            let (from, to) = (&surfaces[step.from], &surfaces[step.to]);
            timers.pass(step.name, || {
                to.target.bind();
                // What the edges' own pass draws, the last one leaves to it.
                let left_out = if programs.blur_edges.is_some() && step.to == self.last { EDGE } else { 0 };
                only_where(&gl, COVERED, COVERED | left_out);
                blur.draw(full_screen, &from.texture, &depth, None, self.depth_sigma);
                Ok(())
            })?;
        }
        if let Some((step, blur)) = &programs.blur_edges {
            timers.pass(step.name, || {
                last.target.bind();
                only_where(&gl, EDGE, EDGE);
                blur.draw(full_screen, &surfaces[step.from].texture, &depth, inputs.samples, self.depth_sigma);
                Ok(())
            })?;
        }
        if extras.edges {
            let (width, height) = (self.size.0 as usize, self.size.1 as usize);
            let texels = match (&programs.edges, programs.plan.full()) {
                (Some(_), Some(full)) => surfaces[full]
                    .target
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
        read(&self.surfaces[self.last])
    }

    /// The texture of [`AmbientOcclusion::image`].
    pub(crate) fn texture(&self) -> &Texture {
        &self.surfaces[self.last].texture
    }

    /// The index of the programs for a kind of inputs, compiled where they are not yet.
    fn programs_for(&mut self, variant: Variant) -> Result<usize, Error> {
        if let Some(found) = self.programs.iter().position(|programs| programs.variant == variant) {
            return Ok(found);
        }
        let programs = Programs::new(&self.gl, &self.settings, (self.purpose, self.size), variant)?;
        self.allocate(&programs.plan)?;
        self.programs.push(programs);
        Ok(self.programs.len() - 1)
    }
}

/// Draws into the stencil alone: sets `bit` at every pixel drawn.
fn mark(gl: &glow::Context, bit: u32, draw: impl FnOnce()) {
    // SAFETY: the context is current, here and below.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_mask(bit);
        gl.stencil_func(glow::ALWAYS, bit as i32, 0xff);
        gl.stencil_op(glow::KEEP, glow::KEEP, glow::REPLACE);
        gl.color_mask_draw_buffer(0, false, false, false, false);
    }
    draw();
    // SAFETY: as above.
    unsafe {
        gl.color_mask_draw_buffer(0, true, true, true, true);
        gl.stencil_mask(0);
    }
}

/// Has passes draw where the stencil's bits of `mask` are `bits`.
fn only_where(gl: &glow::Context, bits: u32, mask: u32) {
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_func(glow::EQUAL, bits as i32, mask);
    }
}

fn read(surface: &Surface) -> Result<Image<f32>, Error> {
    let (width, height) = surface.grid.size();
    Ok(Image { width: width as usize, height: height as usize, texels: surface.texture.read()? })
}
