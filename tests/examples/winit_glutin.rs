//! Embeds the library in an application that opens its window with winit, makes its context with glutin and draws with
//! glow.

use application::{Frames, GBuffer, Model, SIZE};
use glutin::config::ConfigTemplateBuilder;
use glutin::context::{ContextApi, ContextAttributesBuilder, GlProfile, PossiblyCurrentContext, Version};
use glutin::display::GetGlDisplay;
use glutin::prelude::*;
use glutin::surface::{Surface, WindowSurface};
use glutin_winit::{DisplayBuilder, GlWindow};
use hbao::settings::{Radius, Settings};
use hbao::{AmbientOcclusion, Inputs, Output, TextureTarget, glow};
use std::error::Error;
use std::num::NonZeroU32;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::raw_window_handle::HasWindowHandle;
use winit::window::{Window, WindowId};

type Failure = Box<dyn Error>;

// Ambient occlusion begins.
/// Prepares ambient occlusion, once.
fn occlusion(gl: &Arc<glow::Context>, size: (u32, u32), radius: f64) -> Result<AmbientOcclusion, Failure> {
    let settings = Settings { radius: Radius::Units(radius), ..Settings::default() };
    Ok(AmbientOcclusion::new(gl.clone(), size, &settings)?)
}

/// Multiplies the colour of the G-buffer by visibility, in each frame.
fn darken(ao: &mut AmbientOcclusion, gbuffer: &GBuffer) -> Result<(), Failure> {
    let matrix = gbuffer.projection.to_cols_array();
    let inputs = Inputs::from_matrix(gbuffer.depth, gbuffer.normals, TextureTarget::Texture2d, &matrix)?;
    Ok(ao.render_into(&inputs, &Output::multiplied(Some(gbuffer.picture)))?)
}
// Ambient occlusion ends.

/// What is drawn into the window. Fields are dropped from first to last: objects of OpenGL before their context, and
/// the context and its surface before the window.
struct Shown {
    occlusion: AmbientOcclusion,
    gbuffer: GBuffer,
    gl: Arc<glow::Context>,
    surface: Surface<WindowSurface>,
    context: PossiblyCurrentContext,
    window: Window,
}

impl Shown {
    /// Opens the window, with a context of OpenGL 3.3 core.
    fn open(events: &ActiveEventLoop, model: &Model) -> Result<Shown, Failure> {
        let attributes = Window::default_attributes()
            .with_title("hbao in winit and glutin")
            .with_inner_size(PhysicalSize::new(SIZE.0, SIZE.1));
        // The picture is drawn into textures, so that the window itself needs no samples.
        let (window, config) = DisplayBuilder::new().with_window_attributes(Some(attributes)).build(
            events,
            ConfigTemplateBuilder::new(),
            |configs| {
                configs.min_by_key(|config| config.num_samples()).expect("glutin asks only if there is a configuration")
            },
        )?;
        let window = window.ok_or("no window was made")?;
        let display = config.display();
        let wanted = ContextAttributesBuilder::new()
            .with_context_api(ContextApi::OpenGl(Some(Version::new(3, 3))))
            .with_profile(GlProfile::Core)
            .build(Some(window.window_handle()?.as_raw()));
        let surface = window.build_surface_attributes(Default::default())?;
        // SAFETY: the window outlives the surface and the context: see the order of the fields.
        let (surface, context) =
            unsafe { (display.create_window_surface(&config, &surface)?, display.create_context(&config, &wanted)?) };
        let context = context.make_current(&surface)?;
        // SAFETY: the context is current, and the display knows its functions.
        let gl = Arc::new(unsafe { glow::Context::from_loader_function_cstr(|name| display.get_proc_address(name)) });

        let size = window.inner_size().into();
        let gbuffer = GBuffer::new(&gl, size, model)?;
        let occlusion = occlusion(&gl, size, model.radius)?;
        Ok(Shown { occlusion, gbuffer, gl, surface, context, window })
    }

    /// Makes everything that has the size of the window again.
    fn resize(&mut self, size: PhysicalSize<u32>, model: &Model) -> Result<(), Failure> {
        let (Some(width), Some(height)) = (NonZeroU32::new(size.width), NonZeroU32::new(size.height)) else {
            return Ok(()); // A minimised window shows nothing.
        };
        self.surface.resize(&self.context, width, height);
        if self.gbuffer.size != size.into() {
            self.gbuffer = GBuffer::new(&self.gl, size.into(), model)?;
            self.occlusion.resize(size.into())?;
        }
        Ok(())
    }

    /// Draws a frame. Returns true if it was the last.
    fn draw(&mut self, frames: &mut Frames) -> Result<bool, Failure> {
        self.gbuffer.draw();
        darken(&mut self.occlusion, &self.gbuffer)?;
        self.gbuffer.show((0, 0));
        let (width, height) = self.gbuffer.size;
        let last = frames.drawn(&self.gl, [0, 0, width as i32, height as i32])?;
        self.surface.swap_buffers(&self.context)?;
        if frames.counted() {
            self.window.request_redraw();
        }
        Ok(last)
    }
}

struct Application {
    model: Model,
    frames: Frames,
    shown: Option<Shown>,
    failure: Option<Failure>,
}

impl Application {
    /// Ends the event loop after the last frame, and after a failure, which `main` reports.
    fn end_after(&mut self, events: &ActiveEventLoop, outcome: Result<bool, Failure>) {
        if !matches!(outcome, Ok(false)) {
            self.failure = outcome.err();
            events.exit();
        }
    }
}

impl ApplicationHandler for Application {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let opened = Shown::open(events, &self.model).map(|shown| self.shown = Some(shown));
        self.end_after(events, opened.map(|()| false));
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        let outcome = match event {
            WindowEvent::CloseRequested => Ok(true),
            WindowEvent::Resized(size) => shown.resize(size, &self.model).map(|()| false),
            WindowEvent::RedrawRequested => shown.draw(&mut self.frames),
            _ => Ok(false),
        };
        self.end_after(events, outcome);
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.shown = None;
    }
}

fn main() -> Result<(), Failure> {
    let mut application =
        Application { model: Model::load()?, frames: Frames::from_arguments()?, shown: None, failure: None };
    EventLoop::new()?.run_app(&mut application)?;
    application.failure.map_or(Ok(()), Err)
}
