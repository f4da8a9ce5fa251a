//! A scene to images: G-buffer, ambient occlusion, composite (ShaderX7 6.2). The order of the passes between the
//! G-buffer and the composite is [`AmbientOcclusion`]'s.

mod targets;

use crate::Error;
use crate::ambient_occlusion::{AmbientOcclusion, Extras, Inputs, Kept, Purpose};
use crate::gl::{self, Format, PassTime, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::composite::{Apply, Composite};
use crate::pass::gbuffer::{GBuffer, GBufferVariant};
use crate::pass::method::NormalEncoding;
use crate::pass::{BACKGROUND_R16F, BACKGROUND_R32F, FullScreen};
use crate::scene::{Camera, Mesh};
use crate::settings::{DepthFormat, Settings};
use glow::HasContext;
use std::sync::Arc;
use targets::Targets;

/// What a pipeline is to do beside ambient occlusion itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Request {
    /// Stop at depth, normals and colour: no ambient occlusion, and nothing that needs it.
    pub gbuffer_only: bool,
    /// Make the final image, with ambient occlusion applied so.
    pub composite: Option<Apply>,
    /// Keep ambient occlusion as it was before the blur.
    pub raw: bool,
    /// Keep which pixels are edges: those of several surfaces.
    pub edges: bool,
    /// Leave the method's own pass out: the blur goes over A = 1, as in 'No AO' of Table 6.2.1.
    pub without_ao: bool,
    /// Time the passes.
    pub timings: bool,
}

/// Renders scenes with ambient occlusion, in a context that is current at every call, the drop included.
///
/// The context is taken to be its own, as [`crate::context::Context`] gives one: it expects OpenGL's initial state and
/// leaves its own bindings behind. In an application's context, use [`AmbientOcclusion`].
pub struct Pipeline {
    gl: Arc<glow::Context>,
    settings: Settings,
    request: Request,
    size: (u32, u32),
    targets: Arc<Targets>,
    /// Of the last kind of camera.
    gbuffer: Option<GBuffer>,
    ao: Option<AmbientOcclusion>,
    composite: Option<(Composite, Texture, Target)>,
    full_screen: FullScreen,
    kept: Kept,
    timers: Timers,
    notices: Vec<String>,
}

impl Pipeline {
    /// Allocates what images of `size` (width, height) need. The radius must be in scene units.
    ///
    /// # Errors
    /// A setting out of range, a size that the driver cannot render, or what the driver refused.
    pub fn new(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        request: Request,
    ) -> Result<Pipeline, Error> {
        settings.validate()?;
        gl::check(gl, "an error left from before the pipeline")?;
        gl::check_size(gl, size.0, size.1)?;
        let mut notices = Vec::new();
        let targets = Targets::new(gl, size, settings, &mut notices)?;
        Pipeline::with((gl, size), settings, request, (Arc::new(targets), notices))
    }

    /// One more pipeline that draws into this one's G-buffer, which settings that differ in its formats or samples must
    /// not ask for: many of them, measured in turns, would not fit into memory with a G-buffer each.
    pub(crate) fn beside(&self, settings: &Settings, request: Request) -> Result<Pipeline, Error> {
        settings.validate()?;
        Pipeline::with((&self.gl, self.size), settings, request, (self.targets.clone(), self.notices.clone()))
    }

    fn with(
        (gl, size): (&Arc<glow::Context>, (u32, u32)),
        settings: &Settings,
        request: Request,
        (targets, notices): (Arc<Targets>, Vec<String>),
    ) -> Result<Pipeline, Error> {
        let purpose = match request {
            Request { gbuffer_only: true, edges: false, .. } => None,
            Request { gbuffer_only: true, .. } => Some(Purpose::Edges),
            Request { without_ao: true, .. } => Some(Purpose::Blur),
            _ => Some(Purpose::Visibility),
        };
        let ao = purpose.map(|purpose| AmbientOcclusion::build(gl.clone(), size, settings, purpose)).transpose()?;
        let composite = match request.composite {
            Some(apply) if !request.gbuffer_only => {
                let image = Texture::new(gl, "composite: image", Format::Rgba8, size.0, size.1)?;
                let target = Target::new(gl, "composite: framebuffer", &[&image], None, size)?;
                Some((Composite::new(gl, apply)?, image, target))
            }
            _ => None,
        };
        Ok(Pipeline {
            gl: gl.clone(),
            settings: settings.clone(),
            request,
            size,
            targets,
            gbuffer: None,
            ao,
            composite,
            full_screen: FullScreen::new(gl)?,
            kept: Kept::default(),
            timers: Timers::new(gl, request.timings)?,
            notices,
        })
    }

    /// What the driver could not do as asked, and what is done in its place: one line each.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Renders the triangles as the camera sees them. The images are then there to be read. The times of the passes
    /// are returned where they were asked for.
    ///
    /// # Errors
    /// A depth that the format cannot hold, or what the driver refused.
    pub fn render(&mut self, mesh: &Mesh, camera: &Camera) -> Result<Vec<PassTime>, Error> {
        check_depth_range(&self.settings, camera)?;
        let (gl, size, background) = (&self.gl, self.size, self.background());
        let targets = &*self.targets;
        let variant = GBufferVariant {
            normals: self.settings.normals,
            orthographic: !camera.projection.is_perspective(),
            biased: targets.encoding == NormalEncoding::Biased,
        };
        let pass = match self.gbuffer.take() {
            Some(pass) if pass.variant == variant => pass,
            _ => GBuffer::new(&self.gl, variant)?,
        };
        let pass = self.gbuffer.insert(pass);
        let triangles = pass.upload(mesh, camera)?;
        self.timers.pass("gbuffer", || {
            targets.drawn().bind();
            // SAFETY: the context is current, and the target bound.
            unsafe {
                gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]);
                gl.clear_buffer_f32_slice(glow::COLOR, 1, &[background; 4]);
                gl.clear_buffer_f32_slice(glow::COLOR, 2, &[0.0; 4]);
            }
            pass.draw(&triangles, size);
            Ok(())
        })?;
        if targets.samples() > 1 {
            self.timers.pass("resolve", || {
                targets.resolve(&self.full_screen, 0);
                Ok(())
            })?;
        }

        let inputs = self.inputs(camera);
        if let Some(ao) = &mut self.ao {
            let extras = Extras { raw: self.request.raw, edges: self.request.edges };
            self.kept = ao.run(&inputs, &mut self.timers, extras)?;
            if let Some((composite, _, target)) = &self.composite {
                self.timers.pass("composite", || {
                    target.bind();
                    composite.draw(&self.full_screen, &self.targets.colour, ao.texture());
                    Ok(())
                })?;
            }
        }
        Ok(self.timers.take())
    }

    /// What ambient occlusion was computed from: the G-buffer's textures, which stay the pipeline's.
    pub fn inputs(&self, camera: &Camera) -> Inputs {
        Inputs {
            depth: (&self.targets.depth).into(),
            background: self.background(),
            normals: (&self.targets.normals).into(),
            normal_encoding: self.targets.encoding,
            samples: self.targets.depth_samples(),
            projection: camera.projection,
            near: camera.near,
        }
    }

    /// How many samples a pixel has: what the driver gave for [`Settings::msaa`].
    pub fn samples(&self) -> u32 {
        self.targets.samples()
    }

    /// Linear depth of every sample of the pixels, read back: an image for each sample; +infinity on background. The
    /// first is what [`Pipeline::depth`] reads.
    ///
    /// # Errors
    /// As [`Pipeline::depth`].
    pub fn depth_samples(&self) -> Result<Vec<Image<f32>>, Error> {
        let mut images = vec![self.depth()?];
        for which in 1..self.samples() {
            self.targets.resolve(&self.full_screen, which);
            gl::check(&self.gl, "resolve")?;
            images.push(self.depth()?);
        }
        if self.samples() > 1 {
            self.targets.resolve(&self.full_screen, 0);
            gl::check(&self.gl, "resolve")?;
        }
        Ok(images)
    }

    /// Linear depth, read back: of sample 0 where a pixel has several; +infinity on background.
    ///
    /// # Errors
    /// What the driver refused, here and in all that read images back.
    pub fn depth(&self) -> Result<Image<f32>, Error> {
        let background = self.background();
        let texels = self.targets.depth.read()?;
        Ok(self.image(texels.into_iter().map(|z| if z >= background { f32::INFINITY } else { z }).collect()))
    }

    /// Eye-space normals, read back and made unit; (0, 0, 0) on background.
    ///
    /// # Errors
    /// As [`Pipeline::depth`].
    pub fn normals(&self) -> Result<Image<[f32; 3]>, Error> {
        let (depth, background) = (self.targets.depth.read()?, self.background());
        let stored = self.targets.normals.read()?;
        let unit = |(texel, z): (&[f32], f32)| {
            let mut n = glam::Vec3::from_slice(texel);
            if self.targets.encoding == NormalEncoding::Biased {
                n = 2.0 * n - 1.0;
            }
            if z >= background { [0.0; 3] } else { n.normalize_or_zero().to_array() }
        };
        Ok(self.image(stored.chunks_exact(4).zip(depth).map(unit).collect()))
    }

    /// The shaded colour without ambient occlusion, read back.
    ///
    /// # Errors
    /// As [`Pipeline::depth`].
    pub fn colour(&self) -> Result<Image<[u8; 3]>, Error> {
        Ok(self.image(rgb8(&self.targets.colour.read()?)))
    }

    /// Ambient occlusion after the blur, read back.
    ///
    /// # Errors
    /// As [`Pipeline::depth`]; or there is none, because the G-buffer alone was asked for.
    pub fn ao(&self) -> Result<Image<f32>, Error> {
        match &self.ao {
            Some(ao) if !self.request.gbuffer_only => ao.image(),
            _ => Err(Error::Usage("only the G-buffer was asked for: there is no ambient occlusion".into())),
        }
    }

    /// Ambient occlusion before the blur, where it was asked for.
    pub fn ao_raw(&self) -> Option<&Image<f32>> {
        self.kept.raw.as_ref()
    }

    /// Which pixels hold more than one surface, where it was asked for; none does without multisample antialiasing.
    pub fn edges(&self) -> Option<&Image<bool>> {
        self.kept.edges.as_ref()
    }

    /// The final image, where it was asked for, read back.
    ///
    /// # Errors
    /// As [`Pipeline::depth`].
    pub fn composite(&self) -> Result<Option<Image<[u8; 3]>>, Error> {
        let Some((_, image, _)) = &self.composite else { return Ok(None) };
        Ok(Some(self.image(rgb8(&image.read()?))))
    }

    fn image<T: Copy>(&self, texels: Vec<T>) -> Image<T> {
        Image { width: self.size.0 as usize, height: self.size.1 as usize, texels }
    }

    fn background(&self) -> f32 {
        match self.settings.depth_format {
            DepthFormat::R32f => BACKGROUND_R32F,
            DepthFormat::R16f => BACKGROUND_R16F,
        }
    }
}

/// The smallest half float of full precision: below, each halving of a depth costs it a bit.
const LEAST_R16F: f64 = 1.0 / 16384.0;

/// What half floats hold: nothing nearer than their precision reaches, and background further than R beyond all else,
/// or it would occlude.
pub(crate) fn check_depth_range(settings: &Settings, camera: &Camera) -> Result<(), Error> {
    if settings.depth_format == DepthFormat::R32f {
        return Ok(());
    }
    let (near, reach) = (camera.near, camera.far + settings.radius_read()?);
    let refuse =
        |what: String, how: &str| Err(Error::Usage(format!("depth-format r16f holds depths {what}: use r32f, {how}")));
    if reach > f64::from(BACKGROUND_R16F) {
        let what = format!("to {BACKGROUND_R16F}, and the far plane plus the radius is {reach:.0}");
        return refuse(what, "or scale the scene down");
    }
    if near < LEAST_R16F {
        let what = format!("from 6.1e-5, and the near plane is {near:.1e}");
        return refuse(what, "a larger --near, or scale the scene up");
    }
    Ok(())
}

fn rgb8(texels: &[f32]) -> Vec<[u8; 3]> {
    texels.chunks_exact(4).map(|c| [c[0], c[1], c[2]].map(|x| (x * 255.0).round() as u8)).collect()
}
