//! Embeds the library in an application of eframe. The scene stands beside a panel, whose sliders change the settings
//! of ambient occlusion.

use application::{Frames, GBuffer, Model, SIZE};
use eframe::egui;
use eframe::egui_glow::CallbackFn;
use hbao::settings::{Method, Radius, Settings};
use hbao::{AmbientOcclusion, Inputs, Output, TextureTarget, glow};
use std::error::Error;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

type Failure = Box<dyn Error>;

/// The width of the panel, in points.
const PANEL: f32 = 260.0;

// Ambient occlusion begins.
/// Multiplies the colour of the G-buffer by visibility, in each frame. Only a setting that shaders hold as a constant
/// makes `set` compile: a slider of the radius or the strength moves without a wait.
fn darken(ao: &mut AmbientOcclusion, gbuffer: &GBuffer, settings: &Settings) -> Result<(), Failure> {
    ao.resize(gbuffer.size)?;
    ao.set(settings)?;
    let matrix = gbuffer.projection.to_cols_array();
    let inputs = Inputs::from_matrix(gbuffer.depth, gbuffer.normals, TextureTarget::Texture2d, &matrix)?;
    Ok(ao.render_into(&inputs, &Output::multiplied(Some(gbuffer.picture)))?)
}
// Ambient occlusion ends.

/// What the callback draws. egui runs it after the panels are laid out, when the size of the scene is known, and with
/// the context current.
struct Scene {
    model: Model,
    frames: Frames,
    /// Made in the first frame.
    occlusion: Option<AmbientOcclusion>,
    /// The G-buffer has the size of the scene. It is made in the first frame, and again after the size has changed.
    gbuffer: Option<GBuffer>,
    /// What went wrong. `main` reports it.
    failure: Option<String>,
}

impl Scene {
    /// Draws the scene into this part of the window, (x, y, width, height) from its lower left corner. Returns true
    /// after the last frame.
    fn draw(&mut self, gl: &Arc<glow::Context>, part: [i32; 4], settings: &Settings) -> Result<bool, Failure> {
        let [x, y, width, height] = part;
        let (Ok(width), Ok(height)) = (u32::try_from(width), u32::try_from(height)) else { return Ok(false) };
        if width == 0 || height == 0 {
            return Ok(false); // The panel fills the window.
        }
        let size = (width, height);
        if self.gbuffer.as_ref().is_none_or(|gbuffer| gbuffer.size != size) {
            self.gbuffer = Some(GBuffer::new(gl, size, &self.model)?);
        }
        if self.occlusion.is_none() {
            self.occlusion = Some(AmbientOcclusion::new(gl.clone(), size, settings)?);
        }
        let (Some(gbuffer), Some(occlusion)) = (&self.gbuffer, &mut self.occlusion) else { return Ok(false) };
        gbuffer.draw();
        darken(occlusion, gbuffer, settings)?;
        gbuffer.show((x, y));
        Ok(self.frames.drawn(gl, part)?)
    }
}

/// The window: the settings that the panel changes, and the scene, which the callback shares.
struct Application {
    settings: Settings,
    /// The least and the greatest radius of the slider, in units of the scene.
    radii: [f64; 2],
    scene: Arc<Mutex<Scene>>,
}

impl Application {
    /// Lets the user choose the method, and change the radius and the strength if the method reads them.
    fn panel(&mut self, ui: &mut egui::Ui) {
        egui::ComboBox::from_label("method").selected_text(self.settings.method.name()).show_ui(ui, |ui| {
            for &method in Method::ALL {
                if ui.selectable_label(self.settings.method == method, method.name()).clicked() {
                    let Settings { radius, strength, .. } = self.settings;
                    self.settings = Settings { radius, strength, ..Settings::for_method(method) };
                }
            }
        });
        let reads = |name| self.settings.method.reads(name);
        let [radius_read, strength_read] = ["radius", "strength"].map(reads);
        if let (true, Radius::Units(radius)) = (radius_read, &mut self.settings.radius) {
            ui.add(egui::Slider::new(radius, self.radii[0]..=self.radii[1]).text("radius"));
        }
        if strength_read {
            ui.add(egui::Slider::new(&mut self.settings.strength, 0.1..=4.0).text("strength"));
        }
    }
}

impl eframe::App for Application {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        egui::Panel::right("settings").exact_size(PANEL).resizable(false).show(ui, |ui| self.panel(ui));
        let (rect, context) = (ui.available_rect_before_wrap(), ui.ctx().clone());
        let (scene, settings) = (self.scene.clone(), self.settings.clone());
        let callback = CallbackFn::new(move |info, painter| {
            let part = info.viewport_in_pixels();
            let part = [part.left_px, part.from_bottom_px, part.width_px, part.height_px];
            let mut scene = lock(&scene);
            let outcome = scene.draw(painter.gl(), part, &settings);
            if !matches!(outcome, Ok(false)) {
                scene.failure = outcome.err().map(|failure| failure.to_string());
                context.send_viewport_cmd(egui::ViewportCommand::Close);
            }
        });
        ui.painter().add(egui::PaintCallback { rect, callback: Arc::new(callback) });
        if lock(&self.scene).frames.counted() {
            ui.ctx().request_repaint();
        }
    }

    /// The context is current here for the last time, so that what it made is dropped here.
    fn on_exit(&mut self, _: Option<&glow::Context>) {
        let mut scene = lock(&self.scene);
        (scene.occlusion, scene.gbuffer) = (None, None);
    }
}

/// Locks what the callback shares with the application. egui demands that callbacks can go to other threads, but runs
/// them on that of the window.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn main() -> Result<(), Failure> {
    let (model, frames) = (Model::load()?, Frames::from_arguments()?);
    let settings = Settings { radius: Radius::Units(model.radius), ..Settings::default() };
    let radii = [model.radius / 10.0, model.radius * 4.0];
    let scene = Arc::new(Mutex::new(Scene { model, frames, occlusion: None, gbuffer: None, failure: None }));
    let application = Application { settings, radii, scene: scene.clone() };
    let viewport = egui::ViewportBuilder::default().with_inner_size([SIZE.0 as f32 + PANEL, SIZE.1 as f32]);
    let options = eframe::NativeOptions { viewport, ..eframe::NativeOptions::default() };
    eframe::run_native("hbao in egui", options, Box::new(|_| Ok(Box::new(application))))?;
    let failure = lock(&scene).failure.take();
    failure.map_or(Ok(()), |failure| Err(failure.into()))
}
