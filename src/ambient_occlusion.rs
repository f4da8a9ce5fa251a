//! The library's face: ambient occlusion of depth and normals that somebody else owns.

use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, Format, Renderbuffer, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::background::Background;
use crate::pass::blur::{Blur, Kernel};
use crate::pass::half_depth::HalfDepth;
use crate::pass::method::{MethodPass, NormalEncoding, Variant};
use crate::pass::{BACKGROUND_R32F, DepthInput, FullScreen, TextureRef, TextureTarget};
use crate::scene::Projection;
use crate::settings::{AoFormat, BlurKernel, DepthSigma, Method, Settings, SsaoDepth};
use glow::HasContext;
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
        for (name, image) in [("depth", self.depth), ("normals", self.normals)] {
            let target = image.target.gl();
            // SAFETY: the context is current; a texture of another kind is a GL error, and nothing more.
            let found = unsafe {
                gl.bind_texture(target, Some(image.texture));
                gl::check(gl, &format!("the {name} texture is not of the kind said, {:?}", image.target))?;
                [glow::TEXTURE_WIDTH, glow::TEXTURE_HEIGHT].map(|side| gl.get_tex_level_parameter_i32(target, 0, side))
            };
            if found.map(i64::from) != [i64::from(size.0), i64::from(size.1)] {
                let ([width, height], (w, h)) = (found, size);
                return Err(Error::Usage(format!(
                    "the {name} texture has {width}x{height} texels, and ambient occlusion is set up for {w}x{h}"
                )));
            }
        }
        Ok(())
    }

    fn variant(&self, floor: bool) -> Variant {
        Variant {
            orthographic: matches!(self.projection, Projection::Orthographic { .. }),
            depth: self.depth.target,
            normals: self.normals.target,
            encoding: self.normal_encoding,
            floor,
        }
    }
}

/// Where errors come from that the application made and did not ask for: they would read as ours.
const PENDING: &str = "an error left by the application before ambient occlusion";

/// The blur's passes, by the names that they are timed under.
fn kernels(settings: &Settings) -> &'static [(&'static str, Kernel)] {
    match (settings.blur, settings.blur_kernel) {
        _ if settings.method == Method::None => &[],
        (0, _) => &[],
        (_, BlurKernel::Separable) => &[("blur_x", Kernel::X), ("blur_y", Kernel::Y)],
        (_, BlurKernel::Full) => &[("blur_full", Kernel::Full)],
    }
}

/// A texture and the framebuffer that draws into it.
struct Surface {
    texture: Texture,
    target: Target,
}

/// The programs that one kind of inputs needs.
struct Programs {
    variant: Variant,
    /// The stencil, and the method that it serves; none where A = 1 everywhere.
    ao: Option<(Background, MethodPass)>,
    /// What the method's samples read, where that is not the depth image itself.
    half_depth: Option<HalfDepth>,
    /// X and Y, or the one full pass, or none.
    blurs: Vec<(&'static str, Blur)>,
}

/// Computes ambient occlusion in a context that the caller owns and has current at every call, the drop included.
///
/// All OpenGL state that it touches is put back: what is tested, masked and blended, the stencil, the viewport, the
/// program, vertex array, framebuffers and renderbuffer bound, texture units 0 to 3, and how pixels are unpacked.
/// It needs OpenGL 3.3 core and no extension.
pub struct AmbientOcclusion {
    gl: Arc<glow::Context>,
    settings: Settings,
    radius: f64,
    depth_sigma: DepthSigma,
    size: (u32, u32),
    floor: bool,
    full_screen: FullScreen,
    surfaces: Vec<Surface>,
    /// 1 where there is a surface; attached to every target.
    _stencil: Renderbuffer,
    programs: Vec<Programs>,
}

impl AmbientOcclusion {
    /// Allocates what an image of `size` (width, height) needs. Shaders are compiled for the settings at the first
    /// [`AmbientOcclusion::render`] of each kind of inputs.
    ///
    /// # Errors
    /// A setting out of range or a radius in percent, a size that the driver cannot render, or what the driver refused.
    pub fn new(gl: Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<AmbientOcclusion, Error> {
        AmbientOcclusion::build(gl, size, settings, false)
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
        AmbientOcclusion::build(gl, size, settings, true)
    }

    fn build(
        gl: Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        floor: bool,
    ) -> Result<AmbientOcclusion, Error> {
        settings.validate()?;
        gl::check(&gl, PENDING)?;
        gl::check_size(&gl, size.0, size.1)?;
        let format = match settings.ao_format {
            AoFormat::R8 => Format::R8,
            AoFormat::R16f => Format::R16f,
            AoFormat::R32f => Format::R32f,
        };
        let _state = SavedState::save(&gl);
        let stencil = Renderbuffer::new(&gl, "ao: stencil", glow::DEPTH24_STENCIL8, size.0, size.1)?;
        let surface = |place: &str| -> Result<Surface, Error> {
            let texture = Texture::new(&gl, place, format, size.0, size.1)?;
            let attachment = Some((glow::DEPTH_STENCIL_ATTACHMENT, &stencil));
            let target = Target::new(&gl, place, &[&texture], attachment, size)?;
            Ok(Surface { texture, target })
        };
        let mut surfaces = vec![surface("ao")?];
        if !kernels(settings).is_empty() {
            surfaces.push(surface("blur")?);
        }
        Ok(AmbientOcclusion {
            settings: settings.clone(),
            radius: settings.radius_units()?,
            depth_sigma: settings.depth_sigma()?,
            size,
            floor,
            full_screen: FullScreen::new(&gl)?,
            surfaces,
            _stencil: stencil,
            programs: Vec::new(),
            gl,
        })
    }

    /// Ambient occlusion of the inputs: visibility in [0, 1], 1 is open, in the red channel of a rectangle texture of
    /// the same size (`sampler2DRect`, read at `gl_FragCoord.xy`). It stays this object's, and valid until the next
    /// call.
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
        self.run(inputs, timers, None)?;
        Ok((&self.result().texture).into())
    }

    /// Runs the passes; `raw` receives ambient occlusion as it was before the blur.
    pub(crate) fn run(
        &mut self,
        inputs: &Inputs,
        timers: &mut Timers,
        raw: Option<&mut Image<f32>>,
    ) -> Result<(), Error> {
        let gl = self.gl.clone();
        gl::check(&gl, PENDING)?;
        let _state = SavedState::save(&gl);
        inputs.check(&gl, self.size)?;
        if self.settings.method == Method::RayMarch && (inputs.near.is_nan() || inputs.near <= 0.0) {
            return Err(Error::Usage(format!(
                "ray-march ends its rays at the near plane: near must be above 0, not {}",
                inputs.near
            )));
        }
        let programs = self.programs_for(inputs.variant(self.floor))?;
        let (programs, full_screen, surfaces) = (&self.programs[programs], &self.full_screen, &self.surfaces);
        let depth = DepthInput { image: inputs.depth, background: inputs.background, size: self.size };

        // Background is 1 from the start: the stencil keeps every pass away from it.
        let clear = || {
            for surface in surfaces.iter().rev() {
                surface.target.bind();
                // SAFETY: the context is current.
                unsafe { gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]) };
            }
        };
        let Some((background, ao)) = &programs.ao else {
            clear();
            if let Some(raw) = raw {
                *raw = self.read(&surfaces[0])?;
            }
            return gl::check(&gl, "ambient occlusion");
        };
        timers.pass("background", || {
            clear();
            // SAFETY: the context is current.
            unsafe {
                gl.stencil_mask(0xff);
                gl.clear_buffer_i32_slice(glow::STENCIL, 0, &[0]);
                gl.enable(glow::STENCIL_TEST);
                gl.stencil_func(glow::ALWAYS, 1, 0xff);
                gl.stencil_op(glow::KEEP, glow::KEEP, glow::REPLACE);
                gl.color_mask_draw_buffer(0, false, false, false, false);
                background.draw(full_screen, &depth);
                gl.color_mask_draw_buffer(0, true, true, true, true);
                gl.stencil_mask(0);
                gl.stencil_func(glow::EQUAL, 1, 0xff);
            }
            Ok(())
        })?;
        if let Some(half_depth) = &programs.half_depth {
            timers.pass("half_depth", || {
                half_depth.draw(full_screen, &depth);
                surfaces[0].target.bind();
                Ok(())
            })?;
        }
        timers.pass("ao", || {
            ao.draw(
                full_screen,
                &depth,
                inputs.normals,
                (inputs.projection, inputs.near),
                (self.radius, &self.settings),
            );
            Ok(())
        })?;
        if let Some(raw) = raw {
            *raw = self.read(&surfaces[0])?;
        }
        for (i, (name, blur)) in programs.blurs.iter().enumerate() {
            // From one surface to the other, and back.
            let (from, to) = (&surfaces[i % 2], &surfaces[(i + 1) % 2]);
            timers.pass(name, || {
                to.target.bind();
                blur.draw(full_screen, &from.texture, &depth, self.depth_sigma.at(1.0));
                Ok(())
            })?;
        }
        gl::check(&gl, "ambient occlusion")
    }

    /// What the last run left, read back: after the blur, if there is one.
    pub(crate) fn image(&self) -> Result<Image<f32>, Error> {
        self.read(self.result())
    }

    /// The texture of [`AmbientOcclusion::image`].
    pub(crate) fn texture(&self) -> &Texture {
        &self.result().texture
    }

    fn result(&self) -> &Surface {
        // Each blur pass goes from one surface to the other.
        &self.surfaces[kernels(&self.settings).len() % 2]
    }

    fn read(&self, surface: &Surface) -> Result<Image<f32>, Error> {
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        Ok(Image { width, height, texels: surface.texture.read()? })
    }

    /// The index of the programs for a kind of inputs, compiled where they are not yet.
    fn programs_for(&mut self, variant: Variant) -> Result<usize, Error> {
        if let Some(found) = self.programs.iter().position(|programs| programs.variant == variant) {
            return Ok(found);
        }
        let half = self.settings.method == Method::Ssao && self.settings.ssao_depth == SsaoDepth::Half;
        let blur = |&(name, kernel)| Ok((name, Blur::new(&self.gl, kernel, self.settings.blur, variant.depth)?));
        self.programs.push(Programs {
            variant,
            ao: match MethodPass::new(&self.gl, &self.settings, variant)? {
                Some(method) => Some((Background::new(&self.gl, variant.depth)?, method)),
                None => None,
            },
            half_depth: if half { Some(HalfDepth::new(&self.gl, variant.depth, self.size)?) } else { None },
            blurs: kernels(&self.settings).iter().map(blur).collect::<Result<_, Error>>()?,
        });
        Ok(self.programs.len() - 1)
    }
}
