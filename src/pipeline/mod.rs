//! Renders a scene to images: G-buffer, resolve, ambient occlusion, composite (ShaderX7 6.2). [`AmbientOcclusion`]
//! knows the order of the passes between the resolve and the composite.

mod targets;

use crate::Error;
use crate::ambient_occlusion::{AmbientOcclusion, Extras, Inputs, Kept, Purpose};
use crate::encoding::{DepthEncoding, NormalEncoding, NormalSpace};
use crate::gl::{self, Format, PassTime, Target, Texture, Timers};
use crate::image::Image;
use crate::pass::composite::{Apply, Composite};
use crate::pass::gbuffer::{GBuffer, GBufferVariant};
use crate::pass::skin::{Needs, Textures};
use crate::pass::{BACKGROUND_R16F, BACKGROUND_R32F, FullScreen};
use crate::projection::{Hand, Projection};
use crate::scene::{Camera, Mesh};
use crate::settings::{DepthFormat, Settings};
use glow::HasContext;
use std::sync::{Arc, Mutex, PoisonError};
use targets::Targets;

/// The images that a pipeline makes and keeps besides ambient occlusion itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Request {
    /// Make depth and normals only, and skip ambient occlusion and everything that needs it. Edges are still
    /// found if `edges` asks for them.
    pub gbuffer_only: bool,
    /// Keep the shaded colour without ambient occlusion. It is also made and kept if the final image needs it.
    pub colour: bool,
    /// Make the final image, with ambient occlusion applied in this way.
    pub composite: Option<Apply>,
    /// Keep ambient occlusion as it was before the blur.
    pub raw: bool,
    /// Keep which pixels are edges, that is, hold more than one surface.
    pub edges: bool,
    /// Skip the method's own pass. The blur then runs on visibility 1 everywhere, as in the 'No AO' rows of Table
    /// 6.2.1.
    pub without_ao: bool,
    /// Measure the time of each pass.
    pub timings: bool,
}

impl Request {
    /// Returns whether the G-buffer must hold colours.
    fn needs_colour(&self) -> bool {
        self.colour || (self.composite.is_some() && !self.gbuffer_only)
    }
}

/// Renders scenes with ambient occlusion. The OpenGL context must be current at every call, and when this value is
/// dropped.
///
/// The pipeline must have the context to itself, as [`crate::context::Context`] gives one: it expects OpenGL's initial
/// state, and does not restore its own bindings. In an application's context, use [`AmbientOcclusion`].
pub struct Pipeline {
    gl: Arc<glow::Context>,
    settings: Settings,
    request: Request,
    size: (u32, u32),
    targets: Arc<Targets>,
    /// The G-buffer pass, compiled for the kind of camera that was rendered last.
    gbuffer: Option<GBuffer>,
    /// The textures of the mesh that was rendered last. Pipelines beside this one share them, as they share the
    /// targets.
    textures: Arc<Mutex<Textures>>,
    ao: Option<AmbientOcclusion>,
    composite: Option<FinalImage>,
    full_screen: FullScreen,
    kept: Kept,
    /// The part of the picture in which ambient occlusion is computed, if that is not all of it.
    within: Option<[u32; 4]>,
    /// The projection of the camera that was rendered last.
    projection: Option<Projection>,
    timers: Timers,
    notices: Vec<String>,
    triangle_bytes: u64,
}

/// The final image, and the pass that makes it.
struct FinalImage {
    pass: Composite,
    image: Texture,
    target: Target,
}

impl Pipeline {
    /// Allocates the textures and framebuffers for images of `size` (width, height) pixels. The radius must be in scene
    /// units.
    ///
    /// # Errors
    /// [`Error::Usage`] for a setting out of range, a radius in percent, or a size that the driver cannot render.
    /// [`Error::Gl`] if the driver refuses an allocation or a shader, or if an OpenGL error is pending.
    pub fn new(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        request: Request,
    ) -> Result<Pipeline, Error> {
        settings.validate()?;
        gl::check(gl, "an error left by earlier calls, before the pipeline")?;
        gl::check_size(gl, size.0, size.1)?;
        let mut notices = Vec::new();
        let targets = Targets::new(gl, size, settings, request.needs_colour(), &mut notices)?;
        let textures = Arc::new(Mutex::new(Textures::new(gl)));
        Pipeline::with(gl, size, settings, request, (Arc::new(targets), textures), notices)
    }

    /// Makes another pipeline that draws into the G-buffer of this one. Its settings must have the same formats of
    /// depth and normals, and the same number of samples, and its request must need colour only if this pipeline's
    /// does. Measurements run many pipelines in turns, and memory could not hold a G-buffer for each of them.
    pub(crate) fn beside(&self, settings: &Settings, request: Request) -> Result<Pipeline, Error> {
        settings.validate()?;
        let shared = (self.targets.clone(), self.textures.clone());
        Pipeline::with(&self.gl, self.size, settings, request, shared, self.notices.clone())
    }

    fn with(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        request: Request,
        (targets, textures): (Arc<Targets>, Arc<Mutex<Textures>>),
        notices: Vec<String>,
    ) -> Result<Pipeline, Error> {
        let purpose = match request {
            Request { gbuffer_only: true, edges: false, .. } => None,
            Request { gbuffer_only: true, .. } => Some(Purpose::Edges),
            Request { without_ao: true, .. } => Some(Purpose::Blur),
            _ => Some(Purpose::Visibility),
        };
        let ao = purpose.map(|purpose| AmbientOcclusion::build(gl.clone(), size, settings, purpose)).transpose()?;
        if request.needs_colour() && targets.colour.is_none() {
            return Err(Error::Usage("the pipeline that this one draws beside keeps no colour".into()));
        }
        let composite = match request.composite {
            Some(apply) if !request.gbuffer_only => {
                let (image, target) = final_image(gl, size)?;
                Some(FinalImage { pass: Composite::new(gl, apply)?, image, target })
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
            textures,
            ao,
            composite,
            full_screen: FullScreen::new(gl)?,
            kept: Kept::default(),
            within: None,
            projection: None,
            timers: Timers::new(gl, request.timings)?,
            notices,
            triangle_bytes: 0,
        })
    }

    /// Changes the settings. Returns whether shaders were compiled, or must be for the next frame. If the number of
    /// samples per pixel and the formats of depth and normals stay the same, the G-buffer is kept, and the settings are
    /// changed as [`AmbientOcclusion::set`] changes them.
    ///
    /// # Errors
    /// The same as for [`Pipeline::new`]. The settings are then the earlier ones.
    pub fn set(&mut self, settings: &Settings) -> Result<bool, Error> {
        let of_targets = |settings: &Settings| (settings.msaa, settings.depth_format, settings.normal_format);
        if of_targets(settings) != of_targets(&self.settings) {
            *self = Pipeline::new(&self.gl.clone(), self.size, settings, self.request)?;
            return Ok(true);
        }
        settings.validate()?;
        let mut compiled = settings.normals != self.settings.normals;
        if let Some(ao) = &mut self.ao {
            compiled |= ao.set(settings)?;
        }
        (self.settings, self.kept) = (settings.clone(), Kept::default());
        Ok(compiled)
    }

    /// Changes the size (width, height) in pixels of the images. The shaders of ambient occlusion stay compiled.
    ///
    /// # Errors
    /// The same as for [`Pipeline::new`]. The size is then the earlier one.
    pub fn resize(&mut self, size: (u32, u32)) -> Result<(), Error> {
        if size == self.size {
            return Ok(());
        }
        let gl = self.gl.clone();
        gl::check(&gl, "an error left by earlier calls, before the pipeline")?;
        gl::check_size(&gl, size.0, size.1)?;
        let mut notices = Vec::new();
        let targets = Targets::new(&gl, size, &self.settings, self.request.needs_colour(), &mut notices)?;
        let composite = self.composite.is_some().then(|| final_image(&gl, size)).transpose()?;
        if let Some(ao) = &mut self.ao {
            ao.resize(size)?;
        }
        if let (Some(earlier), Some((image, target))) = (&mut self.composite, composite) {
            (earlier.image, earlier.target) = (image, target);
        }
        (self.size, self.targets, self.notices, self.kept) = (size, Arc::new(targets), notices, Kept::default());
        Ok(())
    }

    /// One line for each setting that the driver cannot fulfil. It says what is used instead.
    #[must_use]
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Renders the triangles as the camera sees them. The images can then be read. Returns the times of the passes if
    /// [`Request::timings`] asks for them, and an empty list otherwise.
    ///
    /// # Errors
    /// [`Error::Usage`] if the depth format cannot hold the camera's range of depths. [`Error::Gl`] if the driver
    /// refuses a shader, an allocation or a call.
    pub fn render(&mut self, mesh: &Mesh, camera: &Camera) -> Result<Vec<PassTime>, Error> {
        check_depth_range(&self.settings, camera)?;
        self.projection = Some(camera.projection);
        let (gl, size, background) = (&self.gl, self.size, self.background());
        let targets = &*self.targets;
        let variant = GBufferVariant {
            normals: self.settings.normals,
            orthographic: !camera.projection.is_perspective(),
            biased: targets.encoding == NormalEncoding::Biased,
            colour: targets.colour.is_some(),
            needs: Needs::of(mesh, targets.colour.is_some()),
        };
        let pass = match self.gbuffer.take() {
            Some(pass) if pass.variant == variant => pass,
            _ => GBuffer::new(&self.gl, variant)?,
        };
        let pass = self.gbuffer.insert(pass);
        let triangles = pass.upload(mesh, camera, &mut self.textures.lock().unwrap_or_else(PoisonError::into_inner))?;
        self.triangle_bytes = triangles.bytes;
        self.timers.pass("gbuffer", || {
            targets.drawn().bind();
            // SAFETY: the context is current, and the target bound.
            unsafe {
                gl.clear_buffer_f32_slice(glow::COLOR, 0, &[background; 4]);
                gl.clear_buffer_f32_slice(glow::COLOR, 1, &[0.0; 4]);
                if variant.colour {
                    gl.clear_buffer_f32_slice(glow::COLOR, 2, &[1.0; 4]);
                }
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
            let extras = Extras { raw: self.request.raw, edges: self.request.edges, within: self.within };
            self.kept = ao.run(&inputs, &mut self.timers, extras)?;
            if let (Some(FinalImage { pass, target, .. }), Some(colour)) = (&self.composite, &targets.colour) {
                self.timers.pass("composite", || {
                    target.bind();
                    pass.draw(&self.full_screen, colour, ao.texture()?);
                    Ok(())
                })?;
            }
        }
        Ok(self.timers.take())
    }

    /// Computes ambient occlusion only in a part of the picture from now on, or, with `None`, in all of it. The part is
    /// given by its lower left pixel, its width and its height. It is widened by [`Settings::blur_reach`], so that the
    /// blur within it is the same. Elsewhere ambient occlusion is 1. The G-buffer is still the whole picture's.
    ///
    /// A part of a large picture, which needs the depth and the normals of a guard band around it, costs no more than
    /// its own pixels in this way.
    pub fn restrict(&mut self, part: Option<[u32; 4]>) {
        let reach = self.settings.blur_reach();
        let along = |first: u32, count: u32, side: u32| {
            let start = first.saturating_sub(reach).min(side);
            [start, first.saturating_add(count).saturating_add(reach).min(side) - start]
        };
        self.within = part.map(|[left, bottom, width, height]| {
            let [x, y] = [along(left, width, self.size.0), along(bottom, height, self.size.1)];
            [x[0], y[0], x[1], y[1]]
        });
    }

    /// Returns the inputs from which ambient occlusion is computed, for this camera. The textures are those of the
    /// G-buffer, and belong to the pipeline.
    #[must_use]
    pub fn inputs(&self, camera: &Camera) -> Inputs {
        Inputs {
            depth: (&self.targets.depth).into(),
            depth_encoding: DepthEncoding::Linear,
            background: self.background(),
            normals: Some((&self.targets.normals).into()),
            normal_encoding: self.targets.encoding,
            normal_space: NormalSpace::Eye(Hand::Left),
            samples: self.targets.depth_samples(),
            viewport: None,
            projection: camera.projection,
            near: camera.near,
        }
    }

    /// Returns the bytes of all textures and renderbuffers that the pipeline holds, as their formats and sizes say. A
    /// driver may take more. Some are made at the first [`Pipeline::render`], as are the textures of the mesh, which
    /// later frames of it use again.
    #[must_use]
    pub fn texture_bytes(&self) -> u64 {
        let image = self.composite.as_ref().map_or(0, |composite| composite.image.bytes());
        let textures = self.textures.lock().unwrap_or_else(PoisonError::into_inner).bytes();
        self.targets.bytes() + self.ao.as_ref().map_or(0, AmbientOcclusion::texture_bytes) + image + textures
    }

    /// Returns the bytes of the triangles that the last [`Pipeline::render`] uploaded: positions, indices, and those of
    /// the vertices' normals, colours and texture coordinates that the image needs. They are deleted again after the
    /// frame.
    #[must_use]
    pub fn triangle_bytes(&self) -> u64 {
        self.triangle_bytes
    }

    /// Returns the number of depth samples per pixel that the driver gave for [`Settings::msaa`].
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.targets.samples()
    }

    /// Reads back the linear depth of every sample, one image for each. Background is +infinity. The first image is
    /// that of [`Pipeline::depth`].
    ///
    /// # Errors
    /// The same as for [`Pipeline::depth`].
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

    /// Reads back linear depth, of sample 0 if pixels have several. Background is +infinity.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver refuses to read the image back.
    pub fn depth(&self) -> Result<Image<f32>, Error> {
        let background = self.background();
        let texels = self.targets.depth.read()?;
        Ok(self.image(texels.into_iter().map(|z| if z >= background { f32::INFINITY } else { z }).collect()))
    }

    /// Reads back the eye-space normals as unit vectors. Background is (0, 0, 0).
    ///
    /// # Errors
    /// The same as for [`Pipeline::depth`].
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

    /// Reads back the shaded colour without ambient occlusion.
    ///
    /// # Errors
    /// [`Error::Usage`] if neither [`Request::colour`] nor the final image asked for it. Otherwise the same as for
    /// [`Pipeline::depth`].
    pub fn colour(&self) -> Result<Image<[u8; 3]>, Error> {
        match &self.targets.colour {
            Some(colour) => Ok(self.image(rgb8(&colour.read()?))),
            None => Err(Error::Usage("this pipeline keeps no colour: set colour to true in its Request".into())),
        }
    }

    /// Returns whether the pipeline makes ambient occlusion: [`Request::gbuffer_only`] is not set.
    #[must_use]
    pub fn makes_ao(&self) -> bool {
        !self.request.gbuffer_only
    }

    /// Reads back ambient occlusion after the blur.
    ///
    /// # Errors
    /// [`Error::Usage`] if [`Request::gbuffer_only`] is set, so that there is none. Otherwise the same as for
    /// [`Pipeline::depth`].
    pub fn ao(&self) -> Result<Image<f32>, Error> {
        match &self.ao {
            Some(ao) if self.makes_ao() => ao.image(),
            _ => Err(Error::Usage(
                "this pipeline makes no ambient occlusion: set gbuffer_only to false in its Request".into(),
            )),
        }
    }

    /// Returns ambient occlusion before the blur, if [`Request::raw`] asked for it.
    #[must_use]
    pub fn ao_raw(&self) -> Option<&Image<f32>> {
        self.kept.raw.as_ref()
    }

    /// Returns which pixels hold more than one surface, if [`Request::edges`] asked for it. Without multisample
    /// antialiasing no pixel does.
    #[must_use]
    pub fn edges(&self) -> Option<&Image<bool>> {
        self.kept.edges.as_ref()
    }

    /// Reads back the final image, if [`Request::composite`] asked for it.
    ///
    /// # Errors
    /// The same as for [`Pipeline::depth`].
    pub fn composite(&self) -> Result<Option<Image<[u8; 3]>>, Error> {
        let Some(FinalImage { image, .. }) = &self.composite else { return Ok(None) };
        Ok(Some(self.image(rgb8(&image.read()?))))
    }

    /// Returns the projection of the camera that was rendered last; `None` before the first rendering.
    #[must_use]
    pub fn projection(&self) -> Option<Projection> {
        self.projection
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

/// Allocates the final image.
fn final_image(gl: &Arc<glow::Context>, size: (u32, u32)) -> Result<(Texture, Target), Error> {
    let image = Texture::new(gl, "composite: image", Format::Rgba8, size.0, size.1)?;
    let target = Target::new(gl, "composite: framebuffer", &[&image], None, size)?;
    Ok((image, target))
}

/// The smallest half float with full precision, 2^-14. Below it, each halving of a depth costs one bit of precision.
const LEAST_R16F: f64 = 1.0 / 16384.0;

/// Checks that half floats can hold the depths of the view, if the settings store depth in them. The near plane must
/// not be nearer than full precision reaches. Background must lie further than R behind the far plane, or it would
/// occlude.
///
/// # Errors
/// [`Error::Usage`] if the format cannot hold the depths, or if the radius is in percent.
pub(crate) fn check_depth_range(settings: &Settings, camera: &Camera) -> Result<(), Error> {
    if settings.depth_format == DepthFormat::R32f {
        return Ok(());
    }
    let (near, reach) = (camera.near, camera.far + settings.radius_read(camera.projection)?.at(camera.far));
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
