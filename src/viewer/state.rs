//! What the window shows, and what its panel and keys can do with it.

use super::Hearing;
use super::costs::Costs;
use super::eye::Eye;
use super::log::{self, Log};
use super::request::{self, Rendered};
use super::section::Inspection;
use super::sweep::Sweep;
use super::tracing::{Look, Truth};
use super::watch::Watch;
use super::worker::{Answer, Drawn, Job, Order, Worker, title};
use crate::picture::{self, ImageKind};
use eframe::egui::{self, Rect, TextureHandle, pos2};
use hbao::Error;
use hbao::context::Backend;
use hbao::image::{Image, Outputs};
use hbao::scene::{Scene, View};
use hbao::settings::{Radius, Settings};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Instant, SystemTime};

/// The longest time in seconds that an image may take while something moves. If the full image takes longer, a smaller
/// one is shown meanwhile.
const LONGEST: f64 = 0.2;
/// The largest divisor of the width and height of that smaller image.
const LARGEST_DIVISOR: u32 = 4;
/// How long after the last movement the full image is rendered, in seconds.
const STILL: f64 = 0.15;

/// Which of the two sides are shown.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Compare {
    /// The side whose settings are in the panel.
    One,
    /// A to the left of the divider, B to its right.
    Split,
    /// The difference of A and B, amplified.
    Difference,
}

impl Compare {
    pub(super) const ALL: [(Compare, &'static str); 3] =
        [(Compare::One, "one side"), (Compare::Split, "A beside B"), (Compare::Difference, "difference")];
}

/// The window.
pub(super) struct Viewer {
    pub(super) worker: Worker,
    /// The scene's name or path, as the command line has it.
    pub(super) name: OsString,
    pub(super) scene: Arc<Scene>,
    pub(super) backend: Backend,
    /// The camera at the start.
    pub(super) first: Eye,
    pub(super) eye: Eye,
    /// The settings of A and of B. A radius in percent is one of the scene's size.
    pub(super) sides: [Settings; 2],
    /// The side whose settings are in the panel.
    pub(super) tab: usize,
    pub(super) compare: Compare,
    /// Where the divider is: a share of the image's width.
    pub(super) divider: f32,
    /// Whether the divider is dragged by a pointer that left it at once.
    pub(super) divider_left: bool,
    /// By what the difference is multiplied.
    pub(super) gain: f32,
    /// The name of the image, and the image.
    pub(super) show: (&'static str, &'static ImageKind),
    pub(super) timed: bool,
    pub(super) truth: Truth,
    pub(super) inspection: Inspection,
    pub(super) costs: Costs,
    /// Whether error against time is shown, and the measurement of it.
    pub(super) sweep_shown: bool,
    pub(super) sweep: Option<Sweep>,
    /// The files of the scene, which may change.
    pub(super) watch: Watch,
    /// When the scene was asked for that is shown or will be next.
    asked: SystemTime,
    pub(super) magnified: bool,
    pub(super) keys_shown: bool,
    /// What went wrong last.
    pub(super) message: Option<String>,
    /// What was done last.
    pub(super) said: String,
    /// The texts of the fields of the panel: a model, an image and a settings file.
    pub(super) model_text: String,
    pub(super) image_text: String,
    pub(super) settings_text: String,
    /// The image on the screen.
    pub(super) drawn: Option<Box<Drawn>>,
    /// The textures of A and B or, with one side, of that side; and of the difference.
    pub(super) textures: Vec<TextureHandle>,
    pub(super) difference: Option<(f32, TextureHandle)>,
    /// The hash of the image, for the log.
    pub(super) hash: String,
    /// The last job that was ordered.
    ordered: Option<Job>,
    /// How long the last full image took that needed no compiling, in seconds.
    full_seconds: f64,
    /// Width and height of the image in the window, in pixels.
    pub(super) size: (u32, u32),
    /// The size that the image shall have at the start.
    pub(super) wanted: Option<(u32, u32)>,
    /// When something moved last, in seconds of the window's clock.
    moved: f64,
    pub(super) start: Instant,
    /// When the input of this frame arrived, in milliseconds since the start.
    pub(super) input: f64,
    pub(super) log: Option<Arc<Mutex<Log>>>,
    /// The drivers that are heard, if there is a log.
    pub(super) heard: Option<Hearing>,
    /// The widgets of this frame, for the log.
    pub(super) widgets: Vec<(String, Rect)>,
    pub(super) frames: u64,
}

/// What the window is opened with.
pub(super) struct Start {
    pub(super) worker: Worker,
    pub(super) name: OsString,
    pub(super) scene: Scene,
    pub(super) view: View,
    pub(super) settings: Settings,
    pub(super) backend: Backend,
    pub(super) size: (u32, u32),
    pub(super) wanted: Option<(u32, u32)>,
    pub(super) log: Option<Log>,
    pub(super) start: Instant,
}

impl Viewer {
    pub(super) fn new(start: Start) -> Result<Viewer, Error> {
        let Start { worker, name, scene, view, settings, backend, size, wanted, log, start } = start;
        let eye = Eye::new(&view, &scene.mesh, size)?;
        let (scene, asked) = (Arc::new(scene), SystemTime::now());
        let show = picture::names().next().ok_or_else(|| Error::Usage("there is no image".into()))?;
        Ok(Viewer {
            worker,
            model_text: name.to_string_lossy().into_owned(),
            scene: scene.clone(),
            backend,
            first: eye.clone(),
            eye,
            sides: [settings.clone(), settings],
            tab: 0,
            compare: Compare::One,
            divider: 0.5,
            divider_left: false,
            gain: 8.0,
            show,
            timed: false,
            truth: Truth::new(),
            inspection: Inspection::default(),
            costs: Costs::default(),
            sweep_shown: false,
            sweep: None,
            watch: Watch::start(&scene.files, asked),
            asked,
            magnified: false,
            keys_shown: false,
            message: None,
            said: String::new(),
            image_text: "view.png".into(),
            settings_text: "view.toml".into(),
            drawn: None,
            textures: Vec::new(),
            difference: None,
            hash: String::new(),
            ordered: None,
            full_seconds: 0.0,
            size,
            wanted,
            moved: f64::NEG_INFINITY,
            start,
            input: 0.0,
            log: log.map(|log| Arc::new(Mutex::new(log))),
            heard: None,
            widgets: Vec::new(),
            frames: 0,
            name,
        })
    }

    /// The settings in the panel.
    pub(super) fn settings(&self) -> &Settings {
        &self.sides[self.tab]
    }

    /// The names of the sides on the screen.
    pub(super) fn side_names(&self) -> [&'static str; 2] {
        match self.drawn.as_ref().map_or(1, |drawn| drawn.sides.len()) {
            1 if self.tab == 1 => ["B", "A"],
            _ => ["A", "B"],
        }
    }

    /// Notes where a widget is, for the log.
    pub(super) fn note(&mut self, name: impl Into<String>, rect: Rect) {
        if self.log.is_some() {
            self.widgets.push((name.into(), rect));
        }
    }

    pub(super) fn reset(&mut self) {
        self.eye = self.first.clone();
    }

    pub(super) fn frame_all(&mut self) {
        let framed = self.eye.frame(&self.scene.mesh, self.size);
        self.report(framed);
    }

    /// Chooses the image with this number, in the order of `--show`.
    pub(super) fn choose_image(&mut self, number: usize) {
        self.show = picture::names().nth(number).unwrap_or(self.show);
    }

    /// Shows what went wrong, if something did.
    pub(super) fn report(&mut self, outcome: Result<(), Error>) {
        if let Err(error) = outcome {
            self.message = Some(error.to_string());
        }
    }

    /// The arguments of `hbao` that render the image of the side in the panel.
    fn arguments(&self, output: &OsStr) -> Vec<OsString> {
        Rendered {
            name: &self.name,
            scene: &self.scene,
            eye: &self.eye,
            settings: self.settings(),
            show: self.show.0,
            size: self.size,
            backend: self.backend,
        }
        .arguments(output)
    }

    /// The command that renders the image of the side in the panel.
    pub(super) fn command(&self) -> String {
        request::line(&self.arguments(OsStr::new(&self.image_text)))
    }

    /// Lets the command be run, so that the file is the command's to the bit.
    pub(super) fn save_image(&mut self) {
        let path = PathBuf::from(self.image_text.trim());
        if Outputs::is_stream(&path) {
            self.message = Some(format!("cannot write {}: give the name of a file", path.display()));
            return;
        }
        self.said = format!("Saving {} ...", path.display());
        self.order(Order::Save(self.arguments(path.as_os_str()), path));
    }

    /// Writes the settings in the panel to a file that `--settings` reads.
    pub(super) fn save_settings(&mut self) {
        let path = PathBuf::from(self.settings_text.trim());
        let text = self.settings().to_toml();
        let written = (|| {
            let ends_well = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
            if !ends_well {
                let what = "its name must end in .toml".into();
                return Err(Error::Output { path: path.clone(), what });
            }
            let mut outputs = Outputs::new();
            outputs.stage(&path, text.as_bytes())?;
            outputs.commit()
        })();
        if written.is_ok() {
            self.said = format!("The settings were saved as {}.", path.display());
        }
        self.report(written);
    }

    /// Opens another model. The scene on the screen stays until it is read.
    pub(super) fn open(&mut self, name: &Path) {
        self.said = format!("Opening {} ...", name.display());
        self.asked = SystemTime::now();
        self.order(Order::Open(name.into()));
    }

    /// Opens the first of the files that were dropped on the window.
    pub(super) fn take_dropped(&mut self, context: &egui::Context) {
        let dropped = context.input(|input| input.raw.dropped_files.clone());
        if let Some(file) = dropped.first() {
            self.open(file.path());
        }
    }

    /// Reads the files of the scene again, which have changed. The scene on the screen stays until they are read.
    pub(super) fn open_again(&mut self) {
        self.asked = SystemTime::now();
        self.order(Order::OpenAgain(self.name.clone()));
    }

    fn order(&mut self, order: Order) {
        if !self.worker.order(order) {
            self.message = Some("the thread that renders has ended: close the window, and start again".into());
        }
    }

    /// Takes what the thread that renders has answered.
    pub(super) fn take_answers(&mut self, context: &egui::Context) {
        for answer in self.worker.answers() {
            match answer {
                Answer::Drawn(Ok(drawn)) => self.take_image(drawn, context),
                Answer::Drawn(Err(error)) => self.message = Some(error.to_string()),
                Answer::Opened(name, Ok(scene)) => {
                    let opened = self.take_scene(name, *scene);
                    self.report(opened);
                }
                Answer::Opened(_, Err(error)) => {
                    self.said.clear();
                    self.message = Some(error.to_string());
                }
                Answer::OpenedAgain(name, scene) => {
                    let opened = scene.and_then(|scene| self.take_scene_again(name, *scene));
                    self.report(opened);
                }
                Answer::Saved(path, Ok(())) => self.said = format!("The image was saved as {}.", path.display()),
                Answer::Saved(_, Err(error)) => {
                    self.said.clear();
                    self.message = Some(error.to_string());
                }
            }
        }
    }

    /// Takes a scene whose files have changed. Camera and settings stay.
    fn take_scene_again(&mut self, name: OsString, scene: Scene) -> Result<(), Error> {
        // Another one may have been opened meanwhile.
        if name != self.name {
            return Ok(());
        }
        check_extent(&name, &scene)?;
        self.said = match scene.notices.first() {
            Some(notice) => notice.clone(),
            None => format!("{} has changed, and was read again.", title(&name)),
        };
        self.watch.of(&scene.files, self.asked);
        (self.scene, self.message) = (Arc::new(scene), None);
        Ok(())
    }

    fn take_scene(&mut self, name: OsString, scene: Scene) -> Result<(), Error> {
        check_extent(&name, &scene)?;
        let eye = Eye::new(&scene.view, &scene.mesh, self.size)?;
        let mut changed = None;
        for settings in &mut self.sides {
            // A length in units of the earlier scene means nothing here.
            if let Radius::Units(_) = settings.radius {
                settings.radius = request::defaults(settings, &scene).radius;
                changed = Some(settings.radius);
            }
            settings.blur_depth_sigma = None;
        }
        self.said = match scene.notices.first() {
            Some(notice) => notice.clone(),
            None => {
                let radius = match changed {
                    Some(Radius::Units(radius)) => format!(" The radius is the scene's own now, {radius}."),
                    Some(Radius::Percent(share)) => format!(" The radius is {share} % of the scene now."),
                    _ => String::new(),
                };
                format!("{} has {} triangles.{radius}", title(&name), scene.mesh.triangles.len())
            }
        };
        self.costs.frames.clear();
        (self.first, self.eye) = (eye.clone(), eye);
        (self.name, self.scene, self.message) = (name, Arc::new(scene), None);
        self.model_text = self.name.to_string_lossy().into_owned();
        self.watch.of(&self.scene.files, self.asked);
        Ok(())
    }

    fn take_image(&mut self, drawn: Box<Drawn>, context: &egui::Context) {
        // A time that holds that of compiling is better than none.
        if drawn.job.divisor == 1 && (!drawn.compiled || self.full_seconds == 0.0) {
            self.full_seconds = drawn.seconds;
        }
        self.costs.note(&drawn, self.tab);
        // Texels are seen as they are where one is a pixel.
        let options = match drawn.job.divisor {
            1 => egui::TextureOptions::NEAREST,
            _ => egui::TextureOptions::LINEAR,
        };
        self.textures.truncate(drawn.sides.len());
        for (at, side) in drawn.sides.iter().enumerate() {
            let image = color_image(&side.shown);
            match self.textures.get_mut(at) {
                Some(texture) => texture.set(image, options),
                None => self.textures.push(context.load_texture(format!("side {at}"), image, options)),
            }
        }
        if self.log.is_some() {
            self.hash = drawn.sides.first().map_or_else(String::new, |side| log::hash(&side.shown));
        }
        (self.drawn, self.difference) = (Some(drawn), None);
        (self.truth.stale, self.inspection.stale) = (true, true);
    }

    /// Whether the image on the screen is the one that was ordered last.
    pub(super) fn is_current(&self) -> bool {
        matches!((&self.drawn, &self.ordered), (Some(drawn), Some(ordered)) if drawn.job.same(ordered))
    }

    /// Orders the image that the window should show, unless it was ordered already. `moving` says that the camera or a
    /// setting is changing.
    pub(super) fn order_image(&mut self, moving: bool, context: &egui::Context) {
        let now = context.input(|input| input.time);
        let both = self.compare != Compare::One;
        let mut job = Job {
            scene: self.scene.clone(),
            sides: if both { self.sides.to_vec() } else { vec![self.settings().clone()] },
            show: self.show.1,
            view: self.eye.view(),
            size: self.size,
            divisor: 1,
            timed: self.timed,
            measured: self.truth.look != Look::Off,
            inspected: self.inspection.is_on,
        };
        let divisor = (self.full_seconds / LONGEST).sqrt().ceil().clamp(1.0, f64::from(LARGEST_DIVISOR)) as u32;
        let changed = self.ordered.as_ref().is_none_or(|ordered| !job.same(&Job { divisor: 1, ..ordered.clone() }));
        if changed && moving {
            self.moved = now;
        }
        // The full image follows when nothing has changed for a while, even if a button is still held.
        let rest = STILL - (now - self.moved);
        if divisor > 1 && rest > 0.0 {
            job.divisor = divisor;
            context.request_repaint_after_secs(rest as f32);
        }
        if self.ordered.as_ref().is_some_and(|ordered| job.same(ordered)) {
            return;
        }
        self.ordered = Some(job.clone());
        self.order(Order::Draw(job, self.input));
    }
}

/// The part of a texture that is shown, upside down, because images have their bottom row first.
pub(super) const UPRIGHT: Rect = Rect { min: pos2(0.0, 1.0), max: pos2(1.0, 0.0) };
/// Refuses a scene without an extent.
fn check_extent(name: &OsStr, scene: &Scene) -> Result<(), Error> {
    if scene.mesh.diagonal() > 0.0 {
        return Ok(());
    }
    let what = "all its points coincide, so there is nothing to see".into();
    Err(Error::Input { path: name.into(), what })
}

/// An image for egui, with the same order of rows: the bottom row first.
pub(super) fn color_image(image: &Image<[u8; 3]>) -> egui::ColorImage {
    egui::ColorImage::from_rgb([image.width, image.height], image.texels.as_flattened())
}
