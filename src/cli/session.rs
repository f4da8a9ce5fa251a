//! The steps that several verbs share: opening a context, tracing the truth, and reporting times.

use crate::terminal::{bar, say};
use hbao::context::{Backend, Context, fewer_threads};
use hbao::measure::Shot;
use hbao::reference::truth::{Traced, Truth, Weight};
use hbao::settings::Settings;
use hbao::{Error, PassTime};
use serde_json::json;
use std::time::Instant;

/// The largest number of pixels that are traced, which is that of 8192x8192 pixels. Tracing takes some 60 bytes per
/// pixel.
const MOST_PIXELS: u64 = 1 << 26;

/// Gives llvmpipe fewer threads if it cannot have all that it wants, because it would wait for them for ever. Returns
/// their number in this case. This must be called before the first context is opened.
pub(crate) fn limit_threads() -> Option<usize> {
    let fewer = fewer_threads()?;
    // SAFETY: no driver has been loaded, so that all threads of this process run Rust code only. It reads the
    // environment under the lock that this function takes.
    unsafe { std::env::set_var("LP_NUM_THREADS", fewer.to_string()) };
    Some(fewer)
}

/// Opens the command's only context, and reports which backend gave it.
pub(crate) fn open_context(backend: Backend) -> Result<Context, Error> {
    let fewer = limit_threads();
    let context = Context::open(backend)?;
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    if let Some(fewer) = fewer.filter(|_| context.renderer().contains("llvmpipe")) {
        say(&format!(
            "llvmpipe cannot start all of its threads (ulimit -u, or pids.max of the control group): \
             LP_NUM_THREADS={fewer} is used"
        ));
    }
    Ok(context)
}

/// Traces every pixel with a progress bar, and reports the speed and the noise of the result.
pub(crate) fn trace(shot: Shot, settings: &Settings, rays: u32, weight: Weight) -> Result<Traced, Error> {
    let Shot { mesh, camera, size: (width, height) } = shot;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(Error::Usage(format!("--size {width}x{height}: at most {MOST_PIXELS} pixels can be traced")));
    }
    let truth = Truth::new(mesh, camera, (width as usize, height as usize), settings, rays)?.weighted(weight);
    let pixels: Vec<usize> = (0..width as usize * height as usize).collect();
    let start = Instant::now();
    let progress = bar(pixels.len() as u64, "pixels traced");
    let traced = truth.trace(&pixels, |done| progress.inc(done as u64));
    progress.finish_and_clear();
    let covered = traced.covered.iter().filter(|&&covered| covered).count();
    say(&format!(
        "truth: {covered} covered pixels, {rays} rays each, {:.2} million rays per second, noise {:.5} RMS",
        covered as f64 * f64::from(rays) / start.elapsed().as_secs_f64() / 1e6,
        traced.noise_rmse
    ));
    Ok(traced)
}

/// Returns the notice that the driver gives another number of samples per pixel than `--msaa` or its default asks for.
/// `None` if it gives as many.
pub(crate) fn samples_given(asked: u32, given: u32) -> Option<String> {
    let samples = if given == 1 { "sample" } else { "samples" };
    (given != asked).then(|| format!("the driver gives {given} {samples} per pixel, not the {asked} of --msaa"))
}

/// Returns the notice that a setting has no effect on `on`, the name of a thing that depends only on the radius and the
/// attenuation. The notice for `--method` names the attenuation if it is the default of that method, because the method
/// then has this effect.
pub(crate) fn without_effect(knob: &str, settings: &Settings, on: &str) -> String {
    let attenuation = settings.attenuation.name();
    if knob == "method" && settings.attenuation == Settings::for_method(settings.method).attenuation {
        return format!("--method has no effect on {on} but for its attenuation, {attenuation}");
    }
    format!("--{knob} has no effect on {on}")
}

/// Returns the text of the file that `--timings` writes.
pub(crate) fn timings(context: &Context, size: (u32, u32), (asked, given): (u32, u32), times: &[PassTime]) -> String {
    let pass = |time: &PassTime| json!({ "name": time.name, "gpu_ms": time.gpu_ms, "wall_ms": time.wall_ms });
    let report = json!({
        "backend": context.backend().name(),
        "renderer": context.renderer(),
        "size": [size.0, size.1],
        "msaa": { "asked": asked, "given": given },
        "passes": times.iter().map(pass).collect::<Vec<_>>(),
        "total_ms": times.iter().map(|time| time.wall_ms).sum::<f64>(),
    });
    format!("{report:#}\n")
}
