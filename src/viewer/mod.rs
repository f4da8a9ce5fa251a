//! The window of `hbao view`: an image that `hbao render` would write, beside a panel with every setting.
//!
//! A thread renders ([`worker`]), in a context of its own, by the library's own interface; the window shows the images
//! that it reads back. So the window waits for no image, what it shows is what `hbao render` writes, and the state of
//! OpenGL that the interface of the window changes is no matter. The window is drawn again only if there is a reason.

mod anatomy;
mod eye;
mod keys;
mod knobs;
mod label;
mod log;
mod panel;
mod plot;
mod request;
mod section;
mod stage;
mod state;
mod tracing;
mod truth;
mod worker;

pub(crate) use worker::{OpenContext, Render};

use eframe::egui::{self, ViewportCommand};
use eframe::egui_glow::CallbackFn;
use hbao::Error;
use hbao::context::Backend;
use hbao::glow::HasContext as _;
use hbao::scene::{Scene, View};
use hbao::settings::Settings;
use log::{Log, milliseconds};
use serde_json::json;
use state::{Start, Viewer};
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError};
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
    let worker = Worker::start(opening.context, opening.render)?;
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
        created.egui_ctx.set_theme(egui::Theme::Dark);
        // The usual grey of labels is hard to read.
        created
            .egui_ctx
            .all_styles_mut(|style| style.visuals.override_text_color = Some(egui::Color32::from_gray(220)));
        viewer.worker.wakes(&created.egui_ctx);
        viewer.name_window(&created.egui_ctx);
        Ok(Box::new(viewer))
    });
    eframe::run_native("hbao", options, made).map_err(|error| {
        let what = error.to_string().replace('\n', " ");
        Error::Context(format!("no window can be opened: {what}: it needs an X11 or Wayland display"))
    })
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
            "command": self.command(),
            "image": image,
            "message": self.message,
            "truth": truth::log(self),
            "anatomy": anatomy::log(self),
            "said": self.said,
            "widgets": log::rectangles(&self.widgets, context.pixels_per_point()),
        });
        let write = move |_: egui::PaintCallbackInfo, painter: &eframe::egui_glow::Painter| {
            // SAFETY: egui calls this with its context current.
            unsafe { painter.gl().finish() };
            log.lock().unwrap_or_else(PoisonError::into_inner).write(line.clone());
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
        let dropped = context.input(|input| input.raw.dropped_files.clone());
        if let Some(file) = dropped.first() {
            self.open(file.path());
        }
        let flies = keys::act(self, &context);
        egui::Panel::bottom("status").resizable(false).show(ui, |ui| panel::status(self, ui));
        egui::Panel::right("panel").exact_size(panel::WIDTH).resizable(false).show(ui, |ui| panel::show(self, ui));
        let dragged = stage::show(self, ui);
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
