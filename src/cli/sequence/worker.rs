//! Renders frames, in a context and a thread of its own.

use super::frames::Names;
use super::nothing;
use crate::cli::flags::Flags;
use crate::cli::session::samples_given;
use crate::cli::{render, unmeant};
use crate::picture::{FileFormat, ImageKind};
use crate::terminal::say;
use hbao::context::Context;
use hbao::image::{Image, Outputs, exr, metadata, png};
use hbao::measure::errors::Errors;
use hbao::measure::{Reach, TruthImage};
use hbao::reference::trace::Tracer;
use hbao::reference::truth::Truth;
use hbao::scene::{Camera, Scene, View};
use hbao::settings::Settings;
use hbao::{Apply, Error, Pipeline, Request};
use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// What all workers share.
pub(super) struct Work<'a, V> {
    pub(super) flags: &'a Flags,
    pub(super) scene: &'a Scene,
    /// The settings as they were given, which are stored in files.
    pub(super) settings: &'a Settings,
    /// The settings to render with.
    pub(super) resolved: Settings,
    pub(super) show: &'static ImageKind,
    pub(super) apply: Apply,
    pub(super) request: Request,
    pub(super) format: FileFormat,
    pub(super) names: &'a Names,
    /// The rays per pixel of the truth that each frame is compared with.
    pub(super) rays: Option<u32>,
    /// The scene prepared for tracing, by the first frame that is traced, for all.
    pub(super) tracer: OnceLock<Arc<Tracer<'a>>>,
    /// What the log has traced already: see [`Done::traced`].
    pub(super) traced: HashSet<String>,
    /// The hash of what the scene holds, which is stored in files; `None` for files without metadata.
    pub(super) contents: Option<String>,
    /// The view of each frame.
    pub(super) view: &'a V,
    pub(super) frames: &'a [u32],
    /// The index of the next frame that nobody has begun.
    pub(super) next: AtomicUsize,
}

/// What became of a frame.
pub(super) struct Done {
    pub(super) frame: u32,
    pub(super) path: PathBuf,
    /// False if the frame was there already.
    pub(super) rendered: bool,
    pub(super) seconds: f64,
    /// The share of the surface at which the method exits early.
    pub(super) exits: Option<f64>,
    /// The RMSE of ambient occlusion against the truth, and the truth's noise.
    pub(super) error: Option<(f64, f64)>,
    /// What was traced, as a hash of the frame's metadata and of the number of rays; `None` without a truth.
    pub(super) traced: Option<String>,
    pub(super) notices: Vec<String>,
}

impl<V: Fn(u32) -> View + Sync> Work<'_, V> {
    /// Renders frames until none is left. The first worker also reports what the driver gives.
    pub(super) fn run(&self, first: bool, done: &Sender<Result<Done, Error>>) {
        if let Err(error) = self.try_run(first, done) {
            // Nobody listens if the main thread has ended.
            let _ = done.send(Err(error));
        }
    }

    /// Lets no worker begin another frame.
    pub(super) fn stop(&self) {
        self.next.store(self.frames.len(), Ordering::Relaxed);
    }

    fn try_run(&self, first: bool, done: &Sender<Result<Done, Error>>) -> Result<(), Error> {
        let context = Context::open(self.flags.backend)?;
        if first {
            context.passed_over().into_iter().for_each(say);
            say(&context.describe());
        }
        let mut pipeline = Pipeline::new(context.gl(), self.flags.size, &self.resolved, self.request)?;
        if first {
            pipeline.notices().iter().for_each(|notice| say(notice));
            samples_given(self.settings.msaa, pipeline.samples()).iter().for_each(|notice| say(notice));
        }
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(&frame) = self.frames.get(index) else { return Ok(()) };
            let path = self.names.of(frame);
            let finished = self.frame(&context, &mut pipeline, frame, &path).map_err(|error| match error {
                // A file is named by its own error.
                Error::Output { .. } | Error::Input { .. } => error,
                Error::Usage(what) => Error::Usage(format!("frame {frame}: {what}")),
                other => other,
            })?;
            if done.send(Ok(finished)).is_err() {
                return Ok(());
            }
        }
    }

    fn frame(&self, context: &Context, pipeline: &mut Pipeline, frame: u32, path: &Path) -> Result<Done, Error> {
        let start = Instant::now();
        let (width, height) = self.flags.size;
        let view = (self.view)(frame);
        let (camera, mut notices) = view.camera(&self.scene.mesh, width, height)?;
        let mut seen = self.flags.seen_through(&camera, view.lens);
        seen.insert("frame".into(), i64::from(frame).into());
        if let Some(contents) = &self.contents {
            seen.insert("contents".into(), contents.clone().into());
        }
        seen.insert("show".into(), self.show.name.unwrap_or_default().into());
        let origin = render::origin(self.settings, seen, self.apply, context, pipeline.samples());
        let mut done = Done {
            frame,
            path: path.into(),
            rendered: false,
            seconds: 0.0,
            exits: None,
            error: None,
            traced: self.rays.map(|rays| identity(&origin, rays)),
            notices: Vec::new(),
        };
        // A frame whose error the log lacks is rendered again, because the error is that of what is rendered.
        let logged = done.traced.as_ref().is_none_or(|traced| self.traced.contains(traced));
        if logged && self.contents.is_some() && is_there(path, self.format, &origin) {
            done.seconds = start.elapsed().as_secs_f64();
            return Ok(done);
        }
        pipeline.render(&self.scene.mesh, &camera)?;
        let text = if self.contents.is_some() { metadata(&origin).to_vec() } else { Vec::new() };
        let bytes = self.show.encode(pipeline, &self.resolved, self.format, &text)?;
        let depth = pipeline.depth()?;
        let nothing = || notices.is_empty().then(nothing);
        let unmeant = unmeant::of(pipeline, &depth, camera.projection, &self.resolved, None, nothing)?;
        notices.extend(unmeant);
        done.notices = notices;
        if pipeline.makes_ao() && self.resolved.method.computes() {
            done.exits = Some(Reach::of(&depth, camera.projection, &self.resolved)?.exits);
        }
        if let Some(rays) = self.rays {
            done.error = self.error(pipeline, &camera, rays)?;
        }
        let mut outputs = Outputs::new();
        outputs.stage(path, &bytes)?;
        outputs.commit()?;
        (done.rendered, done.seconds) = (true, start.elapsed().as_secs_f64());
        Ok(done)
    }

    /// Traces the frame, and returns the RMSE of its ambient occlusion and the noise of the truth. `None` if no pixel
    /// holds a surface.
    fn error(&self, pipeline: &Pipeline, camera: &Camera, rays: u32) -> Result<Option<(f64, f64)>, Error> {
        let (width, height) = self.flags.size;
        let size = (width as usize, height as usize);
        let tracer = self.tracer.get_or_init(|| Arc::new(Tracer::new(&self.scene.mesh)));
        let truth = Truth::by(tracer, camera, size, &self.resolved, rays)?;
        let traced = truth.trace(&(0..size.0 * size.1).collect::<Vec<_>>(), |_| ());
        if !traced.covered.contains(&true) {
            return Ok(None);
        }
        let truth = TruthImage::new(&traced, self.flags.size);
        let errors = Errors::of(&pipeline.ao()?, &truth.visibility, &truth.covered)?;
        Ok(Some((errors.rmse, traced.noise_rmse)))
    }
}

/// Identifies a frame that is traced with this many rays.
fn identity(origin: &str, rays: u32) -> String {
    Sha256::digest(format!("{origin}{rays}")).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns whether a file holds the whole image that this text describes.
fn is_there(path: &Path, format: FileFormat, origin: &str) -> bool {
    let read = match format {
        FileFormat::Png => png::read_text(path),
        FileFormat::Exr => exr::read_text(path),
    };
    let wanted = metadata(origin);
    let same = read.is_ok_and(|found| {
        wanted.iter().all(|&(keyword, text)| found.iter().any(|(k, t)| (k.as_str(), t.as_str()) == (keyword, text)))
    });
    // The text stands before the pixels, so that a file that was cut short may have it too.
    same && match format {
        FileFormat::Png => png::read::<[u8; 3]>(path).is_ok() || png::read::<u8>(path).is_ok(),
        FileFormat::Exr => {
            let one: Result<Image<f32>, _> = exr::read(path);
            one.is_ok() || exr::read::<[f32; 3]>(path).is_ok()
        }
    }
}
