//! Traces the view on the screen on threads of its own, in passes that make it more and more exact.

use crate::picture::ImageKind;
use eframe::egui::{self, TextureHandle};
use hbao::Error;
use hbao::image::Image;
use hbao::measure::errors::Errors;
use hbao::reference::trace::Tracer;
use hbao::reference::truth as rays;
use hbao::scene::{Scene, View};
use hbao::settings::Settings;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The rays of each pixel in one pass.
pub(super) const RAYS_OF_PASS: u32 = 16;
/// The first pass traces the middles of blocks of this size first, then those of smaller blocks, then all pixels.
const BLOCKS: [usize; 4] = [16, 8, 4, 1];
/// How many pixels a thread traces before it looks whether the picture is still wanted.
const AT_ONCE: usize = 256;
/// The time between two looks of the window at the progress.
const SEEN: Duration = Duration::from_millis(200);

/// How the truth is looked at.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Look {
    /// It is not traced.
    #[default]
    Off,
    /// The image stays what it is, and the errors are shown in numbers.
    Numbers,
    /// The side in the panel to the left of the divider, and the truth to its right.
    Beside,
    /// The truth alone.
    Alone,
    /// Where each side differs from the truth.
    Error,
}

/// What the window knows of the truth.
pub(super) struct Truth {
    pub(super) look: Look,
    /// The image before the truth was looked at, if it was another than ambient occlusion.
    pub(super) before: Option<(&'static str, &'static ImageKind)>,
    pub(super) rays: u32,
    /// The threads, once something was traced.
    pub(super) tracing: Option<Tracing>,
    /// What is traced, or was traced to its end.
    pub(super) wanted: Option<Wanted>,
    pub(super) refined: Option<Arc<Refined>>,
    /// The errors of each side against the truth, or why there are none.
    pub(super) errors: Vec<Result<Errors, String>>,
    /// The truth, and the errors of each side as heat maps.
    pub(super) texture: Option<TextureHandle>,
    pub(super) heats: Vec<TextureHandle>,
    /// Whether the image or the truth has changed since the errors were measured.
    pub(super) stale: bool,
}

impl Truth {
    pub(super) fn new() -> Truth {
        Truth {
            look: Look::Off,
            before: None,
            rays: 256,
            tracing: None,
            wanted: None,
            refined: None,
            errors: Vec::new(),
            texture: None,
            heats: Vec::new(),
            stale: false,
        }
    }
}

/// What is traced.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) scene: Arc<Scene>,
    pub(super) view: View,
    pub(super) size: (u32, u32),
    /// Settings of which only the radius and the attenuation are read. The others are the defaults.
    pub(super) settings: Settings,
    /// The number of rays of each pixel after which nothing more is traced.
    pub(super) rays: u32,
}

impl Wanted {
    /// Whether the same is traced.
    pub(super) fn same(&self, other: &Wanted) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene)
            && (&self.view, self.size, self.rays) == (&other.view, other.size, other.rays)
            && self.settings == other.settings
    }
}

/// What is known so far.
pub(super) struct Refined {
    /// Visibility; 1 on background. Before all pixels were traced, that of a block's middle stands for the block.
    pub(super) visibility: Image<f32>,
    /// The pixels that show a surface.
    pub(super) covered: Image<bool>,
    /// How many rays each pixel has; 0 before all pixels were traced.
    pub(super) rays: u32,
    /// The square root of the mean variance over the covered pixels.
    pub(super) noise: f64,
    /// How long it took so far, in seconds.
    pub(super) seconds: f64,
}

/// What is known so far, or what went wrong.
pub(super) type Known = Result<Arc<Refined>, Error>;

/// The order that counts, and what was traced for it.
struct Shared {
    /// The number of the order. An earlier one is given up.
    order: AtomicU64,
    /// How many pixels were traced for it, each pass counted.
    done: AtomicU64,
    /// The result for the order of that number.
    result: Mutex<Option<(u64, Known)>>,
}

/// The threads. They give up what they trace when this is dropped.
pub(super) struct Tracing {
    orders: Sender<(u64, Wanted)>,
    shared: Arc<Shared>,
}

impl Tracing {
    /// Starts the threads: one fewer than there are cores, so that one stays for the window.
    pub(super) fn start(window: &egui::Context) -> Result<Tracing, Error> {
        let refused = |error: &dyn std::fmt::Display| {
            Error::Usage(format!("no thread can be started that traces: {error}; close other programs"))
        };
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let pool = ThreadPoolBuilder::new().num_threads((cores - 1).max(1)).start_handler(|_| yield_to_others());
        let pool = pool.thread_name(|at| format!("trace {at}")).build().map_err(|error| refused(&error))?;
        let (orders, ordered) = channel();
        let shared = Arc::new(Shared { order: 0.into(), done: 0.into(), result: Mutex::new(None) });
        let (window, known) = (window.clone(), shared.clone());
        let run = move || serve(&pool, &ordered, &known, &window);
        thread::Builder::new().name("truth".into()).spawn(run).map_err(|error| refused(&error))?;
        Ok(Tracing { orders, shared })
    }

    /// Traces something else from now on.
    pub(super) fn order(&self, wanted: Wanted) {
        self.cancel();
        let _ = self.orders.send((self.shared.order.load(Ordering::Relaxed), wanted));
    }

    /// Gives up what is being traced.
    pub(super) fn cancel(&self) {
        self.shared.order.fetch_add(1, Ordering::Relaxed);
        self.shared.done.store(0, Ordering::Relaxed);
    }

    /// Takes the newest result of the last order.
    pub(super) fn result(&self) -> Option<Known> {
        let (order, result) = self.shared.result.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        (order == self.shared.order.load(Ordering::Relaxed)).then_some(result)
    }

    /// How many pixels were traced for the last order, each pass counted.
    pub(super) fn done(&self) -> u64 {
        self.shared.done.load(Ordering::Relaxed)
    }
}

impl Drop for Tracing {
    fn drop(&mut self) {
        self.cancel();
    }
}

/// Lets the threads of the window and of the driver run first.
fn yield_to_others() {
    #[cfg(target_os = "linux")]
    // SAFETY: the call reads no memory. On Linux it concerns this thread alone.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 15);
    }
}

/// Traces what was ordered last, until nobody can order.
fn serve(pool: &ThreadPool, ordered: &Receiver<(u64, Wanted)>, shared: &Shared, window: &egui::Context) {
    let mut next = ordered.recv().ok();
    while let Some((_, Wanted { scene, .. })) = next.clone() {
        let tracer = Arc::new(pool.install(|| Tracer::new(&scene.mesh)));
        // The tracer serves as long as the scene stays.
        while let Some((number, wanted)) = next.take_if(|(_, wanted)| Arc::ptr_eq(&wanted.scene, &scene)) {
            let run = Run { pool, shared, window, number };
            if let Err(error) = run.trace(&tracer, &wanted) {
                run.tell(Err(error));
            }
            next = match ordered.recv() {
                Ok(first) => ordered.try_iter().last().or(Some(first)),
                Err(_) => return,
            };
        }
    }
}

/// The work for one order.
struct Run<'a> {
    pool: &'a ThreadPool,
    shared: &'a Shared,
    window: &'a egui::Context,
    number: u64,
}

impl Run<'_> {
    fn is_wanted(&self) -> bool {
        self.shared.order.load(Ordering::Relaxed) == self.number
    }

    fn tell(&self, result: Known) {
        *self.shared.result.lock().unwrap_or_else(PoisonError::into_inner) = Some((self.number, result));
        self.window.request_repaint();
    }

    /// Traces pass after pass, and tells what is known after each.
    fn trace(&self, tracer: &Arc<Tracer<'_>>, wanted: &Wanted) -> Result<(), Error> {
        let start = Instant::now();
        let mesh = &wanted.scene.mesh;
        let (camera, _) = wanted.view.camera(mesh, wanted.size.0, wanted.size.1)?;
        let settings = wanted.settings.resolved(mesh.diagonal());
        let (width, height) = (wanted.size.0 as usize, wanted.size.1 as usize);
        let truth = rays::Truth::by(tracer, &camera, (width, height), &settings, RAYS_OF_PASS)?;
        let mut sums: Vec<Option<Option<[f64; 2]>>> = vec![None; width * height];
        for (at, block) in BLOCKS.into_iter().enumerate() {
            let corners = |size: usize| (0..size).step_by(block);
            let middle = |corner: usize, size: usize| (corner + block / 2).min(size - 1);
            let blocks = corners(height).flat_map(|y| corners(width).map(move |x| (x, y)));
            let blocks = blocks.map(|(x, y)| middle(y, height) * width + middle(x, width));
            let pixels: Vec<usize> = blocks.filter(|&pixel| sums[pixel].is_none()).collect();
            if !self.pass(&truth, &pixels, 0, |pixel, halves| sums[pixel] = Some(halves)) {
                return Ok(());
            }
            let known = |x: usize, y: usize| {
                let [x, y] = [(x, width), (y, height)].map(|(x, size)| middle(x / block * block, size));
                sums[y * width + x].flatten()
            };
            let rays = if at + 1 == BLOCKS.len() { RAYS_OF_PASS } else { 0 };
            self.tell(Ok(Arc::new(refined((width, height), rays, 1.0, start, known))));
        }
        let pixels: Vec<usize> = (0..width * height).collect();
        for pass in 1..wanted.rays / RAYS_OF_PASS {
            let add = |pixel: usize, halves: Option<[f64; 2]>| {
                if let (Some(Some([a, b])), Some([more_a, more_b])) = (&mut sums[pixel], halves) {
                    (*a, *b) = (*a + more_a, *b + more_b);
                }
            };
            if !self.pass(&truth, &pixels, pass, add) {
                return Ok(());
            }
            let known = |x: usize, y: usize| sums[y * width + x].flatten();
            let passes = pass + 1;
            self.tell(Ok(Arc::new(refined((width, height), passes * RAYS_OF_PASS, passes.into(), start, known))));
        }
        Ok(())
    }

    /// Traces some pixels once. Returns false if the picture is no longer wanted.
    fn pass(
        &self,
        truth: &rays::Truth<'_>,
        pixels: &[usize],
        pass: u32,
        mut take: impl FnMut(usize, Option<[f64; 2]>),
    ) -> bool {
        let mut seen = Instant::now();
        for some in pixels.chunks(AT_ONCE * self.pool.current_num_threads()) {
            if !self.is_wanted() {
                return false;
            }
            let halves = self.pool.install(|| truth.halves(some, pass, |_| ()));
            some.iter().zip(halves).for_each(|(&pixel, halves)| take(pixel, halves));
            if self.is_wanted() {
                self.shared.done.fetch_add(some.len() as u64, Ordering::Relaxed);
            }
            if seen.elapsed() > SEEN {
                seen = Instant::now();
                self.window.request_repaint();
            }
        }
        self.is_wanted()
    }
}

/// Makes the images from the sums of the two halves over some passes.
fn refined(
    (width, height): (usize, usize),
    rays: u32,
    passes: f64,
    start: Instant,
    known: impl Fn(usize, usize) -> Option<[f64; 2]>,
) -> Refined {
    let halves = Image::from_fn(width, height, |x, y| known(x, y).map(|sums| sums.map(|sum| sum / passes)));
    let covered = halves.map(|halves| halves.is_some());
    let variance = halves.texels.iter().flatten().map(|[a, b]| (a - b).powi(2) / 4.0);
    let count = covered.texels.iter().filter(|&&covered| covered).count().max(1) as f64;
    Refined {
        noise: (variance.fold(0.0, |sum, square| sum + square) / count).sqrt(),
        visibility: halves.map(|halves| halves.map_or(1.0, |[a, b]| ((a + b) / 2.0) as f32)),
        covered,
        rays,
        seconds: start.elapsed().as_secs_f64(),
    }
}
