//! Renders on a thread of its own, so that the window never waits for an image. The thread has an OpenGL context of its
//! own too, the one that `hbao render` would have.

use super::complaints::{Complaints, Heard};
use crate::picture::{self, ImageKind, NEVER_EXITS, Pixels};
use crate::report::tables::cells::percent;
use eframe::egui;
use hbao::context::Context;
use hbao::image::Image;
use hbao::scene::{Camera, Scene, View};
use hbao::settings::{DepthFormat, NormalFormat, Settings};
use hbao::{Apply, Error, PassTime, Pipeline, Request};
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Instant;

/// Opens the context in which images are rendered.
pub(crate) type OpenContext = Box<dyn FnOnce() -> Result<Context, Error> + Send>;

/// Renders and writes an image as the arguments of `hbao render` say.
pub(crate) type Render = fn(&Context, &[OsString]) -> Result<(), Error>;

/// The number of pipelines that are kept, so that going back to another image compiles nothing.
const KEPT: usize = 4;

/// What an image depends on.
#[derive(Clone)]
pub(super) struct Job {
    pub(super) scene: Arc<Scene>,
    /// The settings of each side.
    pub(super) sides: Vec<Settings>,
    pub(super) show: &'static ImageKind,
    pub(super) view: View,
    /// Width and height of the full image.
    pub(super) size: (u32, u32),
    /// By how much the width and the height are divided.
    pub(super) divisor: u32,
    pub(super) timed: bool,
    /// Whether ambient occlusion is compared with the truth, so that it is read back whatever the image shows.
    pub(super) measured: bool,
    /// Whether a pixel is taken apart, for which everything that ambient occlusion is computed from is read back.
    pub(super) inspected: bool,
}

impl Job {
    /// Whether another job gives the same image.
    pub(super) fn same(&self, other: &Job) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene)
            && std::ptr::eq(self.show, other.show)
            && (&self.sides, &self.view, self.size) == (&other.sides, &other.view, other.size)
            && (self.divisor, self.timed, self.measured) == (other.divisor, other.timed, other.measured)
            && self.inspected == other.inspected
    }
}

/// What the window asks for.
pub(super) enum Order {
    /// Render this. The number is the time of the input that led to it.
    Draw(Job, f64),
    /// Open a model by its name or path.
    Open(OsString),
    /// Open the present model again, because its files have changed.
    OpenAgain(OsString),
    /// Run `hbao render` with these arguments, which write this file.
    Save(Vec<OsString>, PathBuf),
}

/// An image of one side.
pub(super) struct Side {
    pub(super) pixels: Pixels,
    pub(super) shown: Image<[u8; 3]>,
    /// What share of the surface exits early, if the image shows that.
    pub(super) exits: Option<String>,
    /// Ambient occlusion after the blur, if it is compared with the truth.
    pub(super) ao: Option<Image<f32>>,
    /// What ambient occlusion was computed from, if a pixel is taken apart.
    pub(super) inspected: Option<Inspected>,
    pub(super) times: Vec<PassTime>,
    /// Depth samples per pixel, as the driver gives them.
    pub(super) samples: u32,
    /// What the pipeline holds on the GPU, and what the triangles of a frame take there.
    pub(super) texture_bytes: u64,
    pub(super) triangle_bytes: u64,
}

/// What ambient occlusion was computed from.
pub(super) struct Inspected {
    pub(super) depth: Image<f32>,
    pub(super) normals: Image<[f32; 3]>,
    /// Ambient occlusion before the blur.
    pub(super) raw: Option<Image<f32>>,
    pub(super) camera: Camera,
    /// The settings, with the radius in scene units.
    pub(super) settings: Settings,
}

/// What a [`Job`] led to.
pub(super) struct Drawn {
    pub(super) job: Job,
    pub(super) input: f64,
    pub(super) sides: Vec<Side>,
    /// How long the rendering took, reading it back included.
    pub(super) seconds: f64,
    /// Whether shaders were compiled, so that the time is no usual one.
    pub(super) compiled: bool,
    pub(super) notices: Vec<String>,
}

/// What the thread answers.
pub(super) enum Answer {
    Drawn(Result<Box<Drawn>, Error>),
    Opened(OsString, Result<Box<Scene>, Error>),
    OpenedAgain(OsString, Result<Box<Scene>, Error>),
    Saved(PathBuf, Result<(), Error>),
}

/// The thread that renders. It ends when this is dropped.
pub(super) struct Worker {
    /// `None` once the thread has been told to end.
    orders: Option<Sender<Order>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
    /// The window that is woken by answers, once there is one.
    window: Arc<OnceLock<egui::Context>>,
}

impl Worker {
    /// Starts the thread, and waits until it has its context.
    /// If there are complaints to note, the context is heard.
    pub(super) fn start(open: OpenContext, render: Render, complaints: Option<Complaints>) -> Result<Worker, Error> {
        let (orders, ordered) = channel();
        let (answer, answers) = channel();
        let (ready, opened) = channel();
        let window = Arc::new(OnceLock::<egui::Context>::new());
        let wakes = window.clone();
        let run = move || {
            let context = match open() {
                Ok(context) => context,
                Err(error) => return drop(ready.send(Err(error))),
            };
            let _ = ready.send(Ok(()));
            // SAFETY: the context is current on this thread, and the addresses are its own.
            let listen = |complaints: &Complaints| unsafe {
                Heard::new(context.gl(), |name| context.get_proc_address(name), "render", complaints)
            };
            let mut heard = complaints.as_ref().map(listen);
            serve(&context, render, &ordered, |answered| {
                heard.iter_mut().for_each(Heard::ask);
                let sent = answer.send(answered).is_ok();
                if let Some(window) = wakes.get() {
                    window.request_repaint();
                }
                sent
            });
        };
        let thread = std::thread::Builder::new().name("render".into()).spawn(run);
        let thread = thread.map_err(|error| Error::Context(format!("a thread cannot be started: {error}")))?;
        opened.recv().unwrap_or_else(|_| Err(Error::Context("the thread that renders ended".into())))?;
        Ok(Worker { orders: Some(orders), answers, thread: Some(thread), window })
    }

    /// Lets answers wake this window.
    pub(super) fn wakes(&self, window: &egui::Context) {
        let _ = self.window.set(window.clone());
    }

    /// Sends an order. Returns false if the thread has ended.
    pub(super) fn order(&self, order: Order) -> bool {
        self.orders.as_ref().is_some_and(|orders| orders.send(order).is_ok())
    }

    /// The answers so far.
    pub(super) fn answers(&self) -> Vec<Answer> {
        self.answers.try_iter().collect()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Does what is ordered, until there is nobody to answer. Of several images that were ordered, only the last is
/// rendered.
fn serve(context: &Context, render: Render, ordered: &Receiver<Order>, mut answer: impl FnMut(Answer) -> bool) {
    let mut pipelines = Pipelines(Vec::new());
    while let Ok(first) = ordered.recv() {
        let mut waiting: Vec<Order> = [first].into_iter().chain(ordered.try_iter()).collect();
        let last = waiting.iter().rposition(|order| matches!(order, Order::Draw(..)));
        for (at, order) in waiting.drain(..).enumerate() {
            let answered = match order {
                Order::Draw(..) if Some(at) != last => continue,
                Order::Draw(job, input) => {
                    let drawn = pipelines.draw(context, job, input);
                    if drawn.is_err() {
                        pipelines.0.clear();
                    }
                    Answer::Drawn(drawn.map(Box::new))
                }
                Order::Open(name) => {
                    let scene = Scene::open(&name).map(Box::new);
                    Answer::Opened(name, scene)
                }
                Order::OpenAgain(name) => {
                    let scene = Scene::open(&name).map(Box::new);
                    Answer::OpenedAgain(name, scene)
                }
                Order::Save(arguments, path) => Answer::Saved(path, render(context, &arguments)),
            };
            if !answer(answered) {
                return;
            }
        }
    }
}

/// What a pipeline is made for. A change of the size or of other settings does not need another one.
type Made = (Request, (u32, DepthFormat, NormalFormat));

/// The pipelines that are kept, the one that was used last at the end.
struct Pipelines(Vec<(Made, Pipeline)>);

impl Pipelines {
    fn draw(&mut self, context: &Context, job: Job, input: f64) -> Result<Drawn, Error> {
        let start = Instant::now();
        let (width, height) = job.size;
        let size = (width.div_ceil(job.divisor), height.div_ceil(job.divisor));
        let (camera, mut notices) = job.view.camera(&job.scene.mesh, width, height)?;
        let images = [job.show].into_iter().chain(job.measured.then_some(&picture::AO));
        let images = images.chain(job.inspected.then_some(&picture::AO_RAW));
        let request = Request { timings: job.timed, ..picture::request(images, Apply::All) };
        let (mut sides, mut compiled) = (Vec::new(), false);
        for settings in &job.sides {
            let mut settings = settings.resolved(job.scene.mesh.diagonal());
            if job.show.is_unblurred() && !job.measured {
                settings.blur = 0;
            }
            settings.validate()?;
            let made = (request, (settings.msaa, settings.depth_format, settings.normal_format));
            let (pipeline, compiles) = self.pipeline(context, made, size, &settings)?;
            compiled |= compiles;
            if compiles && job.timed {
                // What compiling takes is no time of a pass.
                pipeline.render(&job.scene.mesh, &camera)?;
            }
            let times = pipeline.render(&job.scene.mesh, &camera)?;
            let pixels = job.show.pixels(pipeline, &settings)?;
            notices.extend(
                pipeline.notices().iter().filter(|notice| !notices.contains(notice)).cloned().collect::<Vec<_>>(),
            );
            let (shown, exits) = (pixels.shown(), exits_in_words(&pixels, &settings));
            let ao = job.measured.then(|| pipeline.ao()).transpose()?;
            let inspected = job.inspected.then(|| {
                let (depth, normals, raw) = (pipeline.depth()?, pipeline.normals()?, pipeline.ao_raw().cloned());
                Ok::<_, Error>(Inspected { depth, normals, raw, camera, settings: settings.clone() })
            });
            let inspected = inspected.transpose()?;
            let (texture_bytes, triangle_bytes) = (pipeline.texture_bytes(), pipeline.triangle_bytes());
            let samples = pipeline.samples();
            sides.push(Side { shown, exits, ao, inspected, pixels, times, samples, texture_bytes, triangle_bytes });
        }
        Ok(Drawn { job, input, sides, seconds: start.elapsed().as_secs_f64(), compiled, notices })
    }

    /// The pipeline for these settings, and whether it has to compile.
    fn pipeline(
        &mut self,
        context: &Context,
        made: Made,
        size: (u32, u32),
        settings: &Settings,
    ) -> Result<(&mut Pipeline, bool), Error> {
        let found = self.0.iter().position(|(kept, _)| *kept == made);
        let (mut entry, is_new) = match found {
            Some(at) => (self.0.remove(at), false),
            None => {
                if self.0.len() >= KEPT {
                    self.0.remove(0);
                }
                ((made, Pipeline::new(context.gl(), size, settings, made.0)?), true)
            }
        };
        entry.1.resize(size)?;
        let compiles = entry.1.set(settings)? || is_new;
        self.0.push(entry);
        let last = self.0.len() - 1;
        Ok((&mut self.0[last].1, compiles))
    }
}

/// Says at what share of the surface the method exits early, if the image shows that.
fn exits_in_words(pixels: &Pixels, settings: &Settings) -> Option<String> {
    let [exits, covered] = pixels.exits()?;
    let name = settings.method.name();
    Some(match exits {
        _ if !settings.method.reads("exit") => format!("{name} {NEVER_EXITS}"),
        0 => format!("{name} exits early nowhere"),
        _ => format!("{name} exits early at {} of the surface", percent(exits as f64 / covered as f64)),
    })
}

/// The name of a scene as a title shows it: a built-in scene's name, or the file's name without its folder.
pub(super) fn title(name: &OsStr) -> String {
    let path = std::path::Path::new(name);
    path.file_name().unwrap_or(name).to_string_lossy().into_owned()
}
