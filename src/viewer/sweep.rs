//! Measures in the background what `hbao trade` measures, at a reduced size: the time and the error of many
//! combinations of settings, and of those of both sides.

use super::eye::Eye;
use super::request;
use eframe::egui;
use hbao::context::{Backend, Context};
use hbao::measure::trade::{TradeRow, measure, pareto, sweep};
use hbao::measure::{MOST_EXITS, Shot, TruthImage};
use hbao::reference::truth::{Traced, Truth};
use hbao::scene::{Scene, View};
use hbao::settings::{Knob, Settings};
use hbao::{Error, check_size};
use std::ffi::OsString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// The longest side of the images that are measured, in pixels.
const LONGEST: u32 = 240;
/// The rays of each pixel of the truth.
pub(super) const RAYS: u32 = 64;
/// The timed runs of each combination.
pub(super) const RUNS: usize = 3;
/// The number of combinations that are measured at a time. In between, the measurement can be cancelled.
const BATCH: usize = 4;
/// The number of pixels that are traced at a time.
const CHUNK: usize = 2048;
/// The least time between two frames of the window that show progress.
const PAUSE: Duration = Duration::from_millis(100);

/// What is measured.
pub(super) struct Asked {
    pub(super) name: OsString,
    pub(super) scene: Arc<Scene>,
    pub(super) eye: Eye,
    pub(super) view: View,
    /// Width and height of the image in the window.
    pub(super) size: (u32, u32),
    pub(super) backend: Backend,
    /// The settings of A and B, and the side whose radius, attenuation and strength the sweep has.
    pub(super) sides: [Settings; 2],
    pub(super) tab: usize,
}

/// How far a measurement is.
#[derive(Default)]
pub(super) struct State {
    /// What is being done, and how much of it.
    pub(super) step: &'static str,
    pub(super) done: usize,
    pub(super) total: usize,
    pub(super) rows: Vec<TradeRow>,
    /// The noise of the truth, which is in every error.
    pub(super) noise: f64,
    /// Whether it has ended, and what went wrong.
    pub(super) ended: bool,
    pub(super) error: Option<String>,
}

/// A measurement. It ends early when this is dropped.
pub(super) struct Sweep {
    pub(super) asked: Arc<Asked>,
    state: Arc<Mutex<State>>,
    cancelled: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Asked {
    /// The size of the images that are measured.
    pub(super) fn reduced(&self) -> (u32, u32) {
        let (width, height) = self.size;
        let divisor = width.max(height).div_ceil(LONGEST).max(1);
        (width.div_ceil(divisor), height.div_ceil(divisor))
    }

    /// The settings of a side as the sweep measures them: with one depth sample per pixel, because the truth is traced
    /// from the centres of the pixels.
    pub(super) fn measured(&self, settings: &Settings) -> Settings {
        Settings { msaa: 1, ..settings.resolved(self.scene.mesh.diagonal()) }
    }

    /// The combinations: those of both sides, if the same truth judges them, and those of `hbao trade`.
    fn combinations(&self) -> Vec<Settings> {
        let base = self.measured(&self.sides[self.tab]);
        let judged = |side: &Settings| side.radius == base.radius && side.attenuation == base.attenuation;
        let sides = self.sides.iter().map(|side| self.measured(side)).filter(judged);
        let mut all: Vec<Settings> = Vec::new();
        for settings in sides.chain(sweep(&base)) {
            if !all.contains(&settings) {
                all.push(settings);
            }
        }
        all
    }

    /// The command that measures the same, alone on the machine and with its own two tables.
    pub(super) fn command(&self) -> String {
        let (width, height) = self.reduced();
        let side = &self.sides[self.tab];
        let mut words: Vec<OsString> = vec!["trade".into(), "--size".into(), format!("{width}x{height}").into()];
        let mut flag = |name: &str, value: &str| words.extend([name.into(), value.into()]);
        self.eye.flags().iter().for_each(|(name, value)| flag(name, value));
        if self.backend != Backend::Auto {
            flag("--backend", self.backend.name());
        }
        let usual = Settings::for_scene(side.method);
        for name in ["method", "radius", "attenuation", "strength", "exit"] {
            let Some(knob) = Knob::named(name) else { continue };
            // The method matters only for whether the exit is its default.
            let is_usual = knob.text(side) == knob.text(&usual);
            let written = match name {
                "method" => side.exit != usual.exit,
                "exit" => !is_usual,
                _ => true,
            };
            if written {
                flag(&format!("--{name}"), &knob.text(side));
            }
        }
        flag("--truth-rays", &RAYS.to_string());
        flag("--runs", &RUNS.to_string());
        flag("--plot", "trade.svg");
        if self.name.to_string_lossy().starts_with('-') {
            words.push("--".into());
        }
        words.push(self.name.clone());
        request::line(&words)
    }
}

impl Sweep {
    /// Starts a measurement, which wakes the window.
    pub(super) fn start(asked: Asked, window: &egui::Context) -> Result<Sweep, Error> {
        let (asked, state) = (Arc::new(asked), Arc::new(Mutex::new(State::default())));
        let cancelled = Arc::new(AtomicBool::new(false));
        let (ask, shared, cancel, window) = (asked.clone(), state.clone(), cancelled.clone(), window.clone());
        let run = move || {
            let wake = || window.request_repaint_after(PAUSE);
            let outcome = run(&ask, &shared, &cancel, &wake);
            let mut state = lock(&shared);
            state.ended = true;
            state.error = outcome.err().map(|error| error.to_string());
            window.request_repaint();
        };
        let thread = std::thread::Builder::new().name("sweep".into()).spawn(run);
        let thread = thread.map_err(|error| Error::Context(format!("a thread cannot be started: {error}")))?;
        Ok(Sweep { asked, state, cancelled, thread: Some(thread) })
    }

    /// Returns how far it is.
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    /// Ends the measurement after what is being measured now. What was measured stays.
    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Returns whether it was cancelled.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

impl Drop for Sweep {
    fn drop(&mut self) {
        self.cancel();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Traces the truth, and measures one batch after the other.
fn run(asked: &Asked, state: &Mutex<State>, cancelled: &AtomicBool, wake: &dyn Fn()) -> Result<(), Error> {
    let size = asked.reduced();
    let mesh = &asked.scene.mesh;
    let (camera, _) = asked.view.camera(mesh, size.0, size.1)?;
    let shot = Shot { mesh, camera: &camera, size };
    let base = asked.measured(&asked.sides[asked.tab]);
    let Some(traced) = trace(shot, &base, state, cancelled, wake)? else { return Ok(()) };
    if !traced.covered.contains(&true) {
        return Err(Error::Usage("there is no surface in this view, so nothing can be measured".into()));
    }
    let truth = TruthImage::new(&traced, size);
    let context = Context::open(asked.backend)?;
    let gl = context.gl();
    check_size(gl, size.0, size.1)?;
    let all = asked.combinations();
    begin(state, "renderings", all.len() * (RUNS + 1));
    lock(state).noise = traced.noise_rmse;
    for batch in all.chunks(BATCH) {
        if cancelled.load(Ordering::Relaxed) {
            break;
        }
        let progress = || {
            lock(state).done += 1;
            wake();
        };
        let rows = measure(gl, shot, &truth, batch, RUNS, progress)?;
        let mut state = lock(state);
        state.rows.extend(rows);
        mark_front(&mut state.rows);
    }
    Ok(())
}

fn begin(state: &Mutex<State>, step: &'static str, total: usize) {
    let mut state = lock(state);
    (state.step, state.done, state.total) = (step, 0, total);
}

/// Traces every pixel; `None` if that was cancelled.
fn trace(
    shot: Shot,
    base: &Settings,
    state: &Mutex<State>,
    cancelled: &AtomicBool,
    wake: &dyn Fn(),
) -> Result<Option<Traced>, Error> {
    let (width, height) = (shot.size.0 as usize, shot.size.1 as usize);
    let truth = Truth::new(shot.mesh, shot.camera, (width, height), base, RAYS)?;
    let pixels: Vec<usize> = (0..width * height).collect();
    begin(state, "pixels traced", pixels.len());
    let mut all = Traced { visibility: Vec::new(), covered: Vec::new(), noise_rmse: 0.0 };
    let (mut squares, mut surfaces) = (0.0, 0);
    for chunk in pixels.chunks(CHUNK) {
        if cancelled.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let traced = truth.trace(chunk, |_| {});
        let covered = traced.covered.iter().filter(|&&covered| covered).count();
        squares += traced.noise_rmse.powi(2) * covered as f64;
        surfaces += covered;
        all.visibility.extend(traced.visibility);
        all.covered.extend(traced.covered);
        lock(state).done += chunk.len();
        wake();
    }
    all.noise_rmse = (squares / surfaces.max(1) as f64).sqrt();
    Ok(Some(all))
}

/// Marks the rows that no other beats in both time and error, as `hbao trade` marks them.
fn mark_front(rows: &mut [TradeRow]) {
    rows.iter_mut().for_each(|row| row.pareto = false);
    let mut judged: Vec<_> = rows.iter_mut().filter(|row| row.reach.exits <= MOST_EXITS).collect();
    let points: Vec<_> = judged.iter().map(|row| (row.ms, row.errors.rmse)).collect();
    judged.iter_mut().zip(pareto(&points)).for_each(|(row, pareto)| row.pareto = pareto);
}

#[cfg(test)]
mod tests {
    use super::*;
    use hbao::scene::CORNELL_BOX;
    use hbao::settings::Method;

    fn asked() -> Asked {
        let scene = Scene::open(CORNELL_BOX).unwrap();
        let eye = Eye::new(&scene.view, &scene.mesh, (900, 600)).unwrap();
        let a = Settings { directions: 5, ..Settings::for_scene(Method::Hbao) };
        let b = Settings { directions: 7, ..Settings::for_scene(Method::HbaoTalk) };
        Asked {
            name: CORNELL_BOX.into(),
            view: eye.view(),
            eye,
            scene: Arc::new(scene),
            size: (900, 600),
            backend: Backend::Auto,
            sides: [a, b],
            tab: 0,
        }
    }

    #[test]
    fn the_sides_are_measured_where_the_same_truth_judges_them() {
        let mut asked = asked();
        assert_eq!(asked.reduced(), (225, 150));
        let count = sweep(&asked.measured(&asked.sides[0])).len();
        // The talk's method has another attenuation.
        assert_eq!(asked.combinations().len(), count + 1);
        assert_eq!(asked.combinations()[0], asked.measured(&asked.sides[0]));
        asked.sides[1].attenuation = asked.sides[0].attenuation;
        assert_eq!(asked.combinations().len(), count + 2);
        let command = asked.command();
        assert!(command.starts_with("hbao trade --size 225x150 --eye 278,273,-800 "), "{command}");
        let end =
            "--radius 5% --attenuation quadratic --strength 1.0 --truth-rays 64 --runs 3 --plot trade.svg cornell-box";
        assert!(command.ends_with(end), "{command}");
    }

    #[test]
    fn the_truth_in_parts_is_the_truth() {
        let asked = asked();
        let base = asked.measured(&asked.sides[0]);
        let size = (90, 60);
        let (camera, _) = asked.view.camera(&asked.scene.mesh, size.0, size.1).unwrap();
        let shot = Shot { mesh: &asked.scene.mesh, camera: &camera, size };
        let (state, cancelled) = (Mutex::new(State::default()), AtomicBool::new(false));
        let parts = trace(shot, &base, &state, &cancelled, &|| {}).unwrap().unwrap();
        let pixels: Vec<usize> = (0..90 * 60).collect();
        let whole = Truth::new(shot.mesh, shot.camera, (90, 60), &base, RAYS).unwrap().trace(&pixels, |_| {});
        assert_eq!((&parts.visibility, &parts.covered), (&whole.visibility, &whole.covered));
        assert!((parts.noise_rmse - whole.noise_rmse).abs() < 1e-12 && parts.noise_rmse > 0.0);
        cancelled.store(true, Ordering::Relaxed);
        assert!(trace(shot, &base, &state, &cancelled, &|| {}).unwrap().is_none());
    }
}
