//! `hbao bench`: what a scene's passes take, and the AO pass against the least that its fetches take.

use super::flags::{self, Flags, Opened};
use super::{print, say};
use clap::{ArgMatches, Command};
use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::Outputs;
use hbao::measure::{Bench, median};
use hbao::settings::Method;
use hbao::{Apply, Error, Pipeline, Request, Settings};
use serde_json::json;
use std::fmt::Write as _;

const EXPLANATION: &str = "\
Times are medians over interleaved runs, by the driver's timer query where it has one, after a first run that compiles
the shaders. The floor is the AO shader with every fetch of depth, in which the arithmetic after each is replaced by
a sum. The machine should have nothing else to do; LP_NUM_THREADS=1 keeps llvmpipe to one thread.

Examples:
  hbao bench
  hbao bench sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --json bench.json";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let own = [
        flags::valued("runs", "N", "Counted runs [1 to 1000; default: 11]"),
        flags::path("json", "FILE.json", "Write the figures"),
    ];
    Command::new("bench")
        .about("Time the passes, and the AO pass against its fetch floor")
        .args(own)
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

/// Measures, prints a table, and writes the figures where they are wanted.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let runs = flags::read_runs(matches, 11)?;
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(&json)?;
    let Opened { scene, settings, camera, notices } = flags.open()?;
    let settings = settings.resolved(scene.mesh.diagonal());
    if settings.method == Method::None {
        return Err(Error::Usage("--method none has no pass to time: choose another".into()));
    }

    let context = Context::open(flags.backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    notices.iter().for_each(|notice| say(notice));
    let request = Request { composite: Some(Apply::All), timings: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, flags.size, &settings, request)?;
    pipeline.notices().iter().for_each(|notice| say(notice));
    let bench = Bench::run(gl, &mut pipeline, (&scene.mesh, &camera), flags.size, &settings, runs)?;

    let (width, height) = flags.size;
    let (sampling, fetches) = samples(&settings);
    let mut table = format!(
        "{}, {width}x{height}, {}, {sampling}, blur {}, {} depth samples{}: milliseconds, {runs} runs\n",
        scene.name,
        settings.method.name(),
        settings.blur,
        pipeline.samples(),
        if settings.half_res { ", half resolution" } else { "" },
    );
    let _ = writeln!(table, "{:<8}{:>9}{:>9}{:>9}", "", "median", "min", "max");
    for (name, times) in
        [("frame", &bench.frame_ms), ("ao", &bench.ao_ms), ("floor", &bench.floor_ms), ("blur", &bench.blur_ms)]
    {
        let (min, max) = times.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), &t| (a.min(t), b.max(t)));
        let _ = writeln!(table, "{name:<8}{:>9.1}{min:>9.1}{max:>9.1}", median(times));
    }
    // As if no pixel left early: where the radius is small on the screen, many do, and fetch nothing.
    let texels = [width, height].map(|side| f64::from(side.div_ceil(settings.ao_scale()))).iter().product::<f64>();
    let floor_ns_per_fetch = median(&bench.floor_ms) * 1e6 / (texels * f64::from(fetches));
    let _ = writeln!(table, "floor: {floor_ns_per_fetch:.2} ns a fetch");
    let _ = writeln!(table, "ao / floor {:.2} (median of {runs} pairs)", bench.ratio());
    print(&table)?;

    let samples = pipeline.samples();
    let mode = if settings.half_res { "half".into() } else { format!("msaa{samples}") };
    if let Some(path) = json {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        let renderer = unsafe { gl.get_parameter_string(glow::RENDERER) };
        let frame_ms = median(&bench.frame_ms);
        let report = json!({ "renderer": renderer, "rows": [{
            "mode": mode,
            "method": settings.method.name(),
            "directions": settings.directions,
            "steps": settings.steps,
            "msaa": samples,
            "half_res": settings.half_res,
            "blur": settings.blur,
            "frame_ms": frame_ms,
            "ao_ms": median(&bench.ao_ms),
            "floor_ms": median(&bench.floor_ms),
            "ao_to_floor": bench.ratio(),
            "fetches_per_pixel": fetches,
            "floor_ns_per_fetch": floor_ns_per_fetch,
            "blur_ms": median(&bench.blur_ms),
            "fps": 1e3 / frame_ms,
            "mpixels_per_s": f64::from(width) * f64::from(height) / median(&bench.ao_ms) / 1e3,
        }]});
        let mut outputs = Outputs::new();
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
        outputs.commit()?;
    }
    Ok(())
}

/// The samples about a pixel in words, and how many fetches of depth they are.
fn samples(settings: &Settings) -> (String, u32) {
    let Settings { directions, steps, rays, ssao_samples, .. } = settings;
    match settings.method {
        Method::Ssao => (format!("{ssao_samples} samples"), *ssao_samples),
        Method::RayMarch => {
            (format!("{directions} directions of {rays} rays of {steps} steps"), directions * rays * steps)
        }
        _ => (format!("{directions} directions of {steps} steps"), directions * steps),
    }
}
