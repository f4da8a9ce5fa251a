//! The window of `hbao view`: an image that `hbao render` would write, beside a panel with every setting.
//!
//! A thread renders ([`worker`]), in a context of its own, by the library's own interface; the window shows the images
//! that it reads back. So the window waits for no image, what it shows is what `hbao render` writes, and the state of
//! OpenGL that the interface of the window changes is no matter. The window is drawn again only if there is a reason.

mod anatomy;
mod complaints;
mod costs;
#[cfg(test)]
mod dropped;
mod eye;
mod graph;
mod keys;
mod knobs;
mod label;
mod log;
mod panel;
mod plot;
mod request;
mod scatter;
mod section;
mod stage;
mod state;
mod sweep;
mod tracing;
mod truth;
mod watch;
mod worker;

pub(crate) use worker::{OpenContext, Render};

use complaints::{Complaints, Heard, REMEDY, too_old};
use eframe::egui::{self, ViewportCommand};
use eframe::egui_glow::CallbackFn;
use hbao::Error;
use hbao::context::Backend;
use hbao::glow::{self, HasContext as _};
use hbao::scene::{Scene, View};
use hbao::settings::Settings;
use log::{Log, milliseconds};
use serde_json::json;
use state::{Start, Viewer};
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use worker::{Worker, title};

/// The size of the window, in points.
const WINDOW: [f32; 2] = [1280.0, 800.0];
/// The smallest size of the window, in points.
const SMALLEST: [f32; 2] = [640.0, 420.0];

/// What the window is opened with.
pub(crate) struct Opening {
    /// The scene's name or path.
    pub(crate) name: OsString,
    pub(crate) scene: Scene,
    /// The camera: what the flags give, completed by the scene.
    pub(crate) view: View,
    pub(crate) settings: Settings,
    /// The size of the image at the start, if a flag gives it.
    pub(crate) size: Option<(u32, u32)>,
    pub(crate) backend: Backend,
    /// Where a line is written for each frame.
    pub(crate) log: Option<PathBuf>,
    pub(crate) context: OpenContext,
    pub(crate) render: Render,
}

/// Shows the window until it is closed.
pub(crate) fn run(opening: Opening) -> Result<(), Error> {
    let start = Instant::now();
    let log = opening.log.map(|path| Log::create(&path, start)).transpose()?;
    // Drivers are heard for the log only, because some are slower then.
    let complaints = log.is_some().then(Complaints::default);
    let worker = Worker::start(opening.context, opening.render, complaints.clone())?;
    let viewer = Viewer::new(Start {
        worker,
        name: opening.name,
        scene: opening.scene,
        view: opening.view,
        settings: opening.settings,
        backend: opening.backend,
        size: opening.size.unwrap_or((WINDOW[0] as u32, WINDOW[1] as u32)),
        wanted: opening.size,
        log,
        start,
    })?;
    let window = egui::ViewportBuilder::default().with_inner_size(WINDOW).with_min_inner_size(SMALLEST);
    let window = window.with_title(format!("{} - hbao", title(&viewer.name))).with_app_id("hbao");
    let options = eframe::NativeOptions { viewport: window, ..eframe::NativeOptions::default() };
    let made: eframe::AppCreator<'_> = Box::new(move |created| {
        let mut viewer = viewer;
        viewer.heard = heard_window(created, complaints)?;
        created.egui_ctx.set_theme(egui::Theme::Dark);
        // The usual grey of labels is hard to read.
        created
            .egui_ctx
            .all_styles_mut(|style| style.visuals.override_text_color = Some(egui::Color32::from_gray(220)));
        viewer.worker.wakes(&created.egui_ctx);
        viewer.watch.wakes(&created.egui_ctx);
        viewer.name_window(&created.egui_ctx);
        Ok(Box::new(viewer))
    });
    eframe::run_native("hbao", options, made).map_err(|error| {
        let what = error.to_string().replace('\n', " ");
        match error {
            eframe::Error::AppCreation(error) => Error::Context(format!("no window can be opened: {error}")),
            eframe::Error::Glutin(_) | eframe::Error::NoGlutinConfigs(..) | eframe::Error::OpenGL(_) => Error::Context(
                format!("no window can be opened: the display's driver gives it no OpenGL 3.3: {REMEDY} ({what})"),
            ),
            _ => Error::Context(format!("no window can be opened: {what}: it needs an X11 or Wayland display")),
        }
    })
}

/// Checks the window's context, for which eframe asks for OpenGL 3.3 core first, and takes less if it must. Listens to
/// it if there is a log.
fn heard_window(
    created: &eframe::CreationContext<'_>,
    complaints: Option<Complaints>,
) -> Result<Option<Hearing>, Box<dyn std::error::Error + Send + Sync>> {
    let Some(gl) = &created.gl else { return Err("it has no OpenGL context".into()) };
    // SAFETY: eframe calls this with the window's context current, and this is a core parameter.
    let renderer = unsafe { gl.get_parameter_string(glow::RENDERER) };
    if let Some(refusal) = too_old(gl.version(), &renderer) {
        return Err(refusal.into());
    }
    let (Some(complaints), Some(load)) = (complaints, &created.get_proc_address) else { return Ok(None) };
    // SAFETY: the context is current, and the addresses are its own.
    let window = unsafe { Heard::new(gl, |name| load(name), "window", &complaints) };
    Ok(Some(Hearing { window: Arc::new(Mutex::new(window)), complaints }))
}

/// The window's context that is heard, and what was heard of either context.
#[derive(Clone)]
struct Hearing {
    window: Arc<Mutex<Heard>>,
    complaints: Complaints,
}

impl Viewer {
    fn name_window(&self, context: &egui::Context) {
        context.send_viewport_cmd(ViewportCommand::Title(format!("{} - hbao", title(&self.name))));
    }

    /// Gives the window the size in which the image has the size that a flag asked for, once the panels have theirs.
    fn resize_once(&mut self, context: &egui::Context) {
        // In the first frame, the layout is not settled.
        if self.frames < 1 {
            return;
        }
        let Some((width, height)) = self.wanted.take() else { return };
        let scale = context.pixels_per_point();
        let [more_width, more_height] =
            [(width, self.size.0), (height, self.size.1)].map(|(wanted, has)| (wanted as f32 - has as f32) / scale);
        let size = context.content_rect().size() + egui::vec2(more_width, more_height);
        context.send_viewport_cmd(ViewportCommand::InnerSize(size));
    }

    /// Writes the line of this frame to the log, once everything else in it is drawn.
    fn write_log(&mut self, context: &egui::Context) {
        let Some(log) = self.log.clone() else { return };
        let image = self.drawn.as_ref().map(|drawn| {
            json!({
                "input_ms": drawn.input,
                "size": [drawn.job.size.0, drawn.job.size.1],
                "divisor": drawn.job.divisor,
                "render_ms": 1e3 * drawn.seconds,
                "hash": self.hash,
                "sides": drawn.sides.len(),
                "current": self.is_current(),
                "exits": drawn.sides.iter().map(|side| side.exits.clone()).collect::<Vec<_>>(),
                "texture_bytes": drawn.sides.iter().map(|side| side.texture_bytes).collect::<Vec<_>>(),
                "triangle_bytes": drawn.sides.iter().map(|side| side.triangle_bytes).collect::<Vec<_>>(),
            })
        });
        let toml = |settings: &Settings| settings.to_toml();
        let line = json!({
            "frame": self.frames,
            "input_ms": self.input,
            "scene": self.name.to_string_lossy(),
            "show": self.show.0,
            "settings": self.sides.each_ref().map(toml),
            "tab": self.tab,
            "timed_frames": self.costs.count(),
            "sweep": self.sweep.as_ref().map(scatter::in_json),
            "command": self.command(),
            "image": image,
            "message": self.message,
            "truth": truth::log(self),
            "anatomy": anatomy::log(self),
            "said": self.said,
            "fields": [self.model_text, self.image_text, self.settings_text],
            "widgets": log::rectangles(&self.widgets, context.pixels_per_point()),
        });
        let hearing = self.heard.clone();
        let write = move |_: egui::PaintCallbackInfo, painter: &eframe::egui_glow::Painter| {
            // SAFETY: egui calls this with its context current.
            unsafe { painter.gl().finish() };
            let mut line = line.clone();
            if let Some(Hearing { window, complaints }) = &hearing {
                window.lock().unwrap_or_else(PoisonError::into_inner).ask();
                line["gl"] = json!(complaints.take());
            }
            log.lock().unwrap_or_else(PoisonError::into_inner).write(line);
        };
        let callback = Arc::new(CallbackFn::new(write));
        let top = context.layer_painter(egui::LayerId::new(egui::Order::Debug, egui::Id::unique("log")));
        top.add(egui::PaintCallback { rect: context.content_rect(), callback });
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        self.input = milliseconds(self.start);
        self.widgets.clear();
        let scene = self.name.clone();
        self.take_answers(&context);
        if self.name != scene {
            self.name_window(&context);
        }
        self.take_dropped(&context);
        if self.watch.has_changed() {
            self.open_again();
        }
        let flies = keys::act(self, &context);
        egui::Panel::bottom("status").resizable(false).show(ui, |ui| panel::status(self, ui));
        egui::Panel::right("panel").exact_size(panel::WIDTH).resizable(false).show(ui, |ui| panel::show(self, ui));
        let dragged = stage::show(self, ui);
        graph::show(self, &context);
        scatter::show(self, &context);
        panel::message(self, &context);
        keys::list(self, &context);
        let moving = flies || dragged || context.egui_is_using_pointer();
        self.resize_once(&context);
        self.order_image(moving, &context);
        truth::follow(self, moving, &context);
        anatomy::window(self, &context);
        self.write_log(&context);
        self.frames += 1;
    }
}
