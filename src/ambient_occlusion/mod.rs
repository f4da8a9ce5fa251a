//! Ambient occlusion of depth and normals that an application owns: the part of the library that applications embed.

mod check;
mod diagnose;
mod evidence;
mod frame;
mod input_textures;
mod inputs;
mod output;
mod plan;
mod programs;
mod targets;

pub use diagnose::Finding;
pub(crate) use frame::{Extras, Kept};
pub use input_textures::InputTextures;
pub use inputs::{Inputs, Viewport};
pub use output::{Destination, Output, Write};
pub(crate) use programs::Purpose;

use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, DebugGroups, ProgramCache, Texture, Timers};
use crate::image::Image;
use crate::pass::method::MethodPass;
use crate::pass::{FullScreen, TextureRef};
use crate::projection::Projection;
use crate::settings::{MethodBlur, Settings};
use glow::HasContext;
use output::{Bound, Writer};
use programs::Programs;
use std::ffi::{CStr, c_void};
use std::sync::Arc;
use targets::{AoTarget, Images, read, same_images};

/// The name of the place that is given in OpenGL errors that were recorded before a call. Without it, an error of the
/// application would seem to come from this library.
const PENDING: &str = "an error left by the application before ambient occlusion";

/// Computes ambient occlusion in an OpenGL context that the caller owns. The context must be current at every call, and
/// when this value is dropped.
///
/// All OpenGL state that a call changes is restored, after an error too: the enabled capabilities; the masks, blending,
/// stencil and polygon mode; the viewport; the bound program, vertex array, framebuffers and renderbuffer; texture
/// units 0 to 3 with their samplers; and the parameters of pixel unpacking. OpenGL 3.3 core is enough, and no extension
/// is needed. Of later versions, [`AmbientOcclusion::render_into`] also restores the blend functions that OpenGL 4.0
/// keeps for each draw buffer; no other state that exists only in later versions is changed.
///
/// An application may have activated the following features, which OpenGL 3.3 can neither pause nor detect:
///
/// - If transform feedback is active, a call fails. End it first.
/// - Conditional rendering would discard passes. End it first.
/// - Active queries of samples, primitives or elapsed time also count the passes.
/// - A program that was deleted while it was in use ceases to exist during the call, as after any change of the program
///   in use.
///
/// Once two frames of a kind have been rendered, further ones allocate no memory in this library.
pub struct AmbientOcclusion {
    gl: Arc<glow::Context>,
    settings: Settings,
    size: (u32, u32),
    purpose: Purpose,
    full_screen: FullScreen,
    images: Images,
    cache: ProgramCache,
    /// The programs of the present settings, for each kind of inputs so far.
    programs: Vec<Programs>,
    /// The index of the programs of the last run.
    current: usize,
    /// The index of the image that holds the result of the last run; `None` if there is no result.
    result: Option<usize>,
    /// What [`AmbientOcclusion::render_into`] writes with; made at its first call.
    writer: Option<Writer>,
    groups: Option<DebugGroups>,
}

impl AmbientOcclusion {
    /// Allocates the textures and framebuffers for images of `size` (width, height) pixels. Shaders are compiled later:
    /// by [`AmbientOcclusion::prepare`], or at the first [`AmbientOcclusion::render`] of each kind of inputs.
    ///
    /// # Errors
    /// [`Error::Usage`] for a setting out of range, a radius in percent, or a size that the driver cannot render.
    /// [`Error::Context`] for a context of OpenGL ES, or of a version before 3.3. [`Error::Gl`] if the driver refuses
    /// an allocation, if transform feedback is active, or if an OpenGL error is pending.
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
        let settings = used(settings, purpose)?;
        gl::check_version(&gl)?;
        gl::check(&gl, PENDING)?;
        gl::check_size(&gl, size.0, size.1)?;
        let state = SavedState::save(&gl, None)?;
        state.put_back_after(&gl.clone(), || {
            Ok(AmbientOcclusion {
                full_screen: FullScreen::new(&gl)?,
                images: Images::new(&gl, size, &settings)?,
                cache: ProgramCache::new(&gl),
                settings,
                size,
                purpose,
                programs: Vec::new(),
                current: 0,
                result: None,
                writer: None,
                groups: None,
                gl,
            })
        })
    }

    /// Returns the settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the size (width, height) in pixels of the images that are rendered.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Changes the settings. Returns whether shaders were compiled; they are compiled for inputs like those of the last
    /// call. Many drivers finish a shader when something is first drawn with it, so that the next frame takes some
    /// hundred milliseconds longer: after true, [`AmbientOcclusion::prepare`] takes that time at once.
    ///
    /// The radius, the strength, the bias and the depth sigma of the blur are numbers that the shaders read: to change
    /// them costs microseconds (`hbao bench --only embedding`). Some of their changes compile: the bias becomes 0 or
    /// ceases to be, the radius becomes one of another kind, or the depth sigma is set where none was set, or the other
    /// way round. All other settings are compiled into the shaders. The 32 shaders that were used last stay compiled
    /// when the settings no longer need them, so that going back to earlier settings compiles nothing.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::new`]. The settings are then the earlier ones.
    pub fn set(&mut self, settings: &Settings) -> Result<bool, Error> {
        let settings = used(settings, self.purpose)?;
        if self.settings.same_shaders(&settings) {
            self.settings = settings;
            return Ok(false);
        }
        let compiled = self.cache.compiled();
        // Everything is made before anything is replaced.
        let (programs, images) = self.in_own_state(|ao| {
            let (cache, purpose) = (&mut ao.cache, ao.purpose);
            let programs = ao.programs.iter().map(|earlier| Programs::new(cache, &settings, purpose, earlier.kind));
            let programs = programs.collect::<Result<Vec<_>, Error>>()?;
            let images = match same_images(&ao.settings, &settings) {
                true => None,
                false => Some(Images::new(&ao.gl, ao.size, &settings)?),
            };
            Ok((programs, images))
        })?;
        // The application may have bound an earlier image, which is deleted only here, where its state is restored.
        if let Some(images) = images {
            self.images = images;
        }
        (self.settings, self.programs, self.result) = (settings, programs, None);
        Ok(self.cache.compiled() > compiled)
    }

    /// Changes the size (width, height) in pixels of the images that are rendered. No shader is compiled.
    ///
    /// # Errors
    /// [`Error::Usage`] for a size that the driver cannot render, and [`Error::Gl`] as for [`AmbientOcclusion::new`].
    /// The size is then the earlier one.
    pub fn resize(&mut self, size: (u32, u32)) -> Result<(), Error> {
        if size == self.size {
            return Ok(());
        }
        // As in `set`.
        self.images = self.in_own_state(|ao| {
            gl::check_size(&ao.gl, size.0, size.1)?;
            Images::new(&ao.gl, size, &ao.settings)
        })?;
        (self.size, self.result) = (size, None);
        Ok(())
    }

    /// Compiles the shaders and allocates the images that inputs like these need, so that no later frame waits for
    /// them: for use while an application loads. The textures need no contents yet. It renders a frame and waits for
    /// it, because some drivers compile a shader when something is first drawn with it.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::render`].
    pub fn prepare(&mut self, inputs: &Inputs) -> Result<(), Error> {
        self.render(inputs)?;
        self.in_own_state(|ao| {
            let mut writer = Writer::new(&ao.gl)?;
            writer.prepare(&mut ao.cache)?;
            ao.writer = Some(writer);
            Ok(())
        })?;
        // SAFETY: the context is current.
        unsafe { self.gl.finish() };
        Ok(())
    }

    /// Names the passes for debuggers such as RenderDoc and apitrace: each pass becomes a debug group of its own.
    /// `load` returns the address of an OpenGL function, or null; it is the function that the application's `glow`
    /// context was made with. Returns whether the passes are named: that needs `glPushDebugGroup`, which OpenGL has
    /// since version 4.3 or by `GL_KHR_debug`.
    ///
    /// # Safety
    /// Every address that `load` returns must be that of the function of this name in this context.
    pub unsafe fn name_passes(&mut self, load: impl FnMut(&CStr) -> *const c_void) -> bool {
        // SAFETY: the caller's promise is the same.
        self.groups = unsafe { DebugGroups::load(&self.gl, load) };
        self.groups.is_some()
    }

    /// Returns the depth beyond which the method exits early, so that visibility is 1 at all farther surfaces, for
    /// inputs with this projection. It is infinite if the method exits nowhere. See [`Settings::exit_depth`].
    #[must_use]
    pub fn exit_depth(&self, projection: Projection) -> f64 {
        // The radius needed no scene when these settings were set, so there is no error.
        self.settings.exit_depth(projection, self.size).unwrap_or(f64::INFINITY)
    }

    /// Computes the ambient occlusion of the inputs: visibility in [0, 1], where 1 means that nothing occludes.
    /// Background is 1. The result is in the red channel of the returned rectangle texture, to be read through a
    /// `sampler2DRect` at `gl_FragCoord.xy`.
    ///
    /// The texture has the size that was set. At half resolution without a blur, which would bring it to full size, it
    /// has half the width and height, rounded up. The texture belongs to this object, and its contents are valid until
    /// the next call.
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
        Ok(self.texture()?.into())
    }

    /// Computes the ambient occlusion of the inputs as [`AmbientOcclusion::render`] does, and writes it to an image of
    /// the caller: visibility itself, or what is there multiplied by it.
    ///
    /// # Errors
    /// [`Error::Usage`] for an output that cannot be written: a framebuffer with several draw buffers, which would lose
    /// the contents of the others, a texture that the view does not fit into, a texture that is also read, or a share
    /// outside [0, 1]. [`Error::Gl`] for a framebuffer that is not complete, or a texture that cannot be drawn to.
    /// Otherwise the same as for [`AmbientOcclusion::render`].
    pub fn render_into(&mut self, inputs: &Inputs, output: &Output) -> Result<(), Error> {
        let mut timers = Timers::new(&self.gl, false)?;
        self.render_into_timed(inputs, output, &mut timers)
    }

    /// Does the same as [`AmbientOcclusion::render_into`], with each pass run by `timers`, as
    /// [`AmbientOcclusion::render_timed`] does. The pass that writes is named `apply`.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::render_into`].
    pub fn render_into_timed(&mut self, inputs: &Inputs, output: &Output, timers: &mut Timers) -> Result<(), Error> {
        let bound = Bound::of(&self.gl);
        timers.groups = self.groups;
        self.in_own_state(|ao| {
            ao.passes(inputs, timers, Extras::default())?;
            if ao.writer.is_none() {
                ao.writer = Some(Writer::new(&ao.gl)?);
            }
            let result = ao.result.and_then(|result| ao.images.ao.get(result));
            let (Some(writer), Some(result)) = (&mut ao.writer, result) else { return Err(no_result()) };
            if let Destination::Texture(image) = output.to
                && ao.images.hold(image.texture)
            {
                return Err(Error::Usage("output: the texture is one of this object's own: use another one".into()));
            }
            let visibility = &result.canvas.texture;
            timers.pass("apply", || {
                writer.write(&mut ao.cache, &ao.full_screen, (visibility, ao.size), inputs, output, bound)
            })
        })
    }

    /// Returns the linear depth that the last call of [`AmbientOcclusion::render`] made from encoded or multisample
    /// depth: a rectangle texture in R32F, [`BACKGROUND_R32F`](crate::BACKGROUND_R32F) on background. `None` if the
    /// caller's depth was linear already. Like the result, it is valid until the next call.
    #[must_use]
    pub fn linear_depth(&self) -> Option<TextureRef> {
        self.linear_depth_texture().map(TextureRef::from)
    }

    fn linear_depth_texture(&self) -> Option<&Texture> {
        self.programs.get(self.current)?.linear_depth.as_ref()?;
        self.images.linear_depth.as_ref().map(|image| &image.texture)
    }

    /// Returns the normals that the last call of [`AmbientOcclusion::render`] rebuilt from depth: a rectangle texture
    /// in RGBA16F, of left-handed eye space and of any length, undefined on background. At half resolution it has half
    /// the width and height, rounded up. `None` if the caller has normals, or if the method reads none. Like the
    /// result, it is valid until the next call.
    #[must_use]
    pub fn rebuilt_normals(&self) -> Option<TextureRef> {
        self.programs.get(self.current)?.rebuilt_normals.as_ref()?;
        self.images.rebuilt_normals.as_ref().map(|image| (&image.texture).into())
    }

    /// Runs the passes, and reads back what `extras` asks for.
    pub(crate) fn run(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        timers.groups = self.groups;
        self.in_own_state(|ao| ao.passes(inputs, timers, extras))
    }

    /// Runs `run` in the OpenGL state that passes expect, and restores the application's afterwards.
    fn in_own_state<T>(&mut self, run: impl FnOnce(&mut Self) -> Result<T, Error>) -> Result<T, Error> {
        let gl = self.gl.clone();
        gl::check(&gl, PENDING)?;
        let state = SavedState::save(&gl, self.images.ao.first().map(|target| &target.canvas.framebuffer))?;
        state.put_back_after(&gl, || run(self))
    }

    /// Reads back the linear depth that the last call of [`AmbientOcclusion::render`] made, as
    /// [`AmbientOcclusion::linear_depth`] lends it. `None` if the caller's depth was linear already.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver refuses to read the image back.
    pub fn linear_depth_image(&self) -> Result<Option<Image<f32>>, Error> {
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let Some(texture) = self.linear_depth_texture() else { return Ok(None) };
        Ok(Some(Image { width, height, texels: self.read_back(|| texture.read())? }))
    }

    /// Reads back the result of the last call of [`AmbientOcclusion::render`].
    ///
    /// # Errors
    /// [`Error::Usage`] if there is none: nothing was rendered since this object was made or since the settings or the
    /// size were changed, or the last call failed. [`Error::Gl`] if the driver refuses to read the image back.
    pub fn image(&self) -> Result<Image<f32>, Error> {
        let result = self.result()?;
        self.read_back(|| read(result))
    }

    /// Runs `read`, which reads an image back, and restores the state that it changes.
    fn read_back<T>(&self, read: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        gl::check(&self.gl, PENDING)?;
        let state = SavedState::save(&self.gl, self.images.ao.first().map(|target| &target.canvas.framebuffer))?;
        state.put_back_after(&self.gl, read)
    }

    /// Returns the bytes of all textures and renderbuffers that this object holds, as their formats and sizes say. A
    /// driver may take more. Images that only some kinds of inputs need are made at the first
    /// [`AmbientOcclusion::render`].
    #[must_use]
    pub fn texture_bytes(&self) -> u64 {
        let tiles = self.programs.iter().filter_map(|programs| programs.ao.as_ref());
        self.images.bytes() + tiles.map(MethodPass::tile_bytes).sum::<u64>()
    }

    /// Returns the texture that [`AmbientOcclusion::image`] reads.
    pub(crate) fn texture(&self) -> Result<&Texture, Error> {
        Ok(&self.result()?.canvas.texture)
    }

    /// Returns the image that holds the result of the last run.
    fn result(&self) -> Result<&AoTarget, Error> {
        self.result.and_then(|result| self.images.ao.get(result)).ok_or_else(no_result)
    }
}

fn no_result() -> Error {
    Error::Usage(
        "there is no ambient occlusion yet: call render first, and again after a change of settings or size".into(),
    )
}

/// Checks settings, and returns those that serve the purpose.
///
/// # Errors
/// [`Error::Usage`] for a setting out of range, and for a radius in percent, if something reads it.
fn used(settings: &Settings, purpose: Purpose) -> Result<Settings, Error> {
    settings.validate()?;
    let mut settings = settings.clone();
    if matches!(purpose, Purpose::Floor | Purpose::Edges) {
        settings.blur = 0;
    }
    let sigma_follows = match settings.method.facts().blur {
        MethodBlur::Gaussian => settings.blur_depth_sigma.is_none(),
        MethodBlur::Crysis | MethodBlur::None => false,
    };
    if sigma_follows || settings.method.reads("radius") {
        settings.check_radius()?;
    }
    Ok(settings)
}
