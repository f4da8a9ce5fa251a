//! `hbao tune`: finds the combination of settings that suits a view best.

mod listing;
mod words;

use super::flags::{self, Flags, Opened};
use super::session::{open_context, trace};
use super::unmeant;
use crate::terminal::{bar, print, say};
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::Error;
use hbao::image::Outputs;
use hbao::measure::errors::too_noisy;
use hbao::measure::tune::Tuner;
use hbao::measure::tune::choice::Goal;
use hbao::measure::{Shot, TruthImage};
use hbao::reference::truth::Weight;
use serde_json::json;
use std::path::PathBuf;

const EXPLANATION: &str = "\
The command tries many combinations of settings. The RMSE that it reports compares two images: the file ao.exr that
'hbao render --dump' writes for this scene, size and camera with --settings F.toml, and the image of 'hbao truth' with
the same --truth-rays. The RMSE covers the pixels whose depth in depth.exr is finite. The milliseconds are the time of
ambient occlusion and its blur, as in 'hbao trade'.

The search varies method, directions, steps, rays, half-res, blur, blur-kernel, edges, jitter and the formats, and for
ssao also its samples, depth, normals and curve. The strength of a combination near the goal becomes the one that fits
its image best. If a flag or a line of --settings sets one of them, the search does not vary it. The radius,
attenuation, bias and msaa are never varied, and all other settings keep each method's default unless they are set. An
RMSE over all pixels hardly reflects the pattern of 4x4 pixels that the jitter leaves, or banding. It hardly reflects
jagged edges either, because few pixels are edges. Give --jitter tile --blur 9 --edges supersample to keep the settings
that prevent these artefacts.

The combinations are rendered once for their error, those with the least work first. For --max-error, a combination is
not rendered if it certainly needs no less work than an earlier one that meets the goal. For --max-ms, it is not
rendered if it certainly needs no less work than an earlier one whose rough time is over twice T. The combinations that
are nearest to the goal are varied in one setting at a time. Those that may win are then timed in interleaved rounds,
and the best 4 of them in three times as many more.

For --max-error, all combinations that reach the error and whose median time is at most the upper quartile of the
fastest one's times count as equally fast, and the most accurate of these is chosen. For --max-ms, the most accurate
combination whose median time is at most T is chosen. RMSEs that are equal when rounded to 4 decimal places count as
equally accurate; the fastest of these is chosen. With LP_NUM_THREADS=1 in the environment, llvmpipe uses one thread.
Nothing else should run on the machine.

Examples:
  hbao tune nave --size 400x300 --max-error 0.15 -o fast.toml
  hbao tune sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --size 800x600 --max-ms 20 --method hbao -o t.toml
  hbao render nave --size 400x300 --settings fast.toml -o nave.png";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("F.toml").required(true);
    let own = [
        flags::valued(
            "max-error",
            "E",
            "Find the cheapest settings whose RMSE from the ray-traced image is at most E [above 0]",
        ),
        flags::valued("max-ms", "T", "Find the most accurate settings that take at most T milliseconds [above 0]"),
        output.value_parser(value_parser!(PathBuf)).help("The settings file to write, F.toml"),
        flags::path("json", "FILE.json", "Write every combination considered, and its verdict"),
        flags::valued("runs", "N", "Number of timed runs of each combination that may win [1 to 1000; default: 5]"),
        flags::truth_rays(),
    ];
    Command::new("tune")
        .about("Find the cheapest settings within an error, or the most accurate within a time, for one view")
        .args(own)
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

fn read_goal(matches: &ArgMatches) -> Result<Goal, Error> {
    let limit = |name: &str| {
        let Some(text) = flags::text(matches, name) else { return Ok(None) };
        let limit = text.trim().parse().ok().filter(|limit: &f64| limit.is_finite() && *limit > 0.0);
        limit.map(Some).ok_or_else(|| Error::Usage(format!("--{name}: '{text}' is not a finite number above 0")))
    };
    match (limit("max-error")?, limit("max-ms")?) {
        (Some(error), None) => Ok(Goal::MaxError(error)),
        (None, Some(ms)) => Ok(Goal::MaxMs(ms)),
        (None, None) => Err(Error::Usage("tune needs a goal: give --max-error E or --max-ms T".into())),
        (Some(_), Some(_)) => {
            let what = "--max-error E finds the fastest settings within E, and --max-ms T the most accurate within T: \
                        give only one of them";
            Err(Error::Usage(what.into()))
        }
    }
}

/// Renders the view's G-buffer, traces the truth, searches, prints the result, and writes the settings.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let goal = read_goal(matches)?;
    let (rays, runs) = (flags::read_truth_rays(matches)?, flags::read_runs(matches, 5)?);
    let output = flags::path_of(matches, "output", "toml")?.unwrap_or_default();
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(json.iter().chain([&output]).cloned())?;
    let Opened { scene, settings, camera, notices, .. } = flags.open()?;
    notices.iter().for_each(|notice| say(notice));
    let base = settings.resolved(scene.mesh.diagonal());
    let failed = |what: String| Error::Input { path: flags.scene.clone().into(), what };

    let context = open_context(flags.backend)?;
    let pinned = flags.knobs_pinned();
    let shot = Shot { mesh: &scene.mesh, camera: &camera, size: flags.size };
    let tuner = Tuner::new(context.gl(), shot, &base, &pinned)?;
    let requirements = tuner.requirements().clone();
    if !requirements.covered.texels.contains(&true) {
        return Err(failed(unmeant::empty(&flags, &scene.mesh, &camera)));
    }
    words::requirements(&requirements, &base).iter().for_each(|line| say(line));
    let traced = trace(shot, &base, rays, Weight::Uniform)?;
    let truth = TruthImage::new(&traced, shot.size).visibility;
    let progress = bar(1, "settings and timed runs");
    let tuned = tuner.run(&truth, goal, runs, |done, of| {
        progress.set_length(of as u64);
        progress.set_position(done as u64);
    })?;
    progress.finish_and_clear();
    let Some(best) = tuned.best.map(|i| &tuned.tried[i]) else { return Err(failed(words::nothing(&tuned, goal))) };
    let rmse = best.rmse().unwrap_or(f64::NAN);
    let against = if let Goal::MaxError(limit) = goal { limit } else { rmse };
    if too_noisy(traced.noise_rmse, against) {
        say(&format!(
            "the truth's noise of {:.5} is more than a fifth of an error of {against:.5}: give more --truth-rays",
            traced.noise_rmse
        ));
    }
    let idle = flags.knobs_given().filter(|knob| !best.settings.method.reads(knob));
    let method = best.settings.method.name();
    idle.for_each(|knob| say(&format!("--{knob} has no effect on the settings found, of --method {method}")));

    unmeant::radius(&best.settings, "--radius or --size", |settings| requirements.reach(settings))?
        .iter()
        .for_each(|notice| say(notice));
    let listing = listing::table(&tuned, goal, &requirements).text();
    print(&format!("{}\n{listing}", words::summary(&tuned, goal)))?;
    let mut render = flags.seen(&camera);
    let mut put = |key: &str, value: toml::Value| render.insert(key.into(), value);
    match goal {
        Goal::MaxError(limit) => put("max-error", limit.into()),
        Goal::MaxMs(limit) => put("max-ms", limit.into()),
    };
    put("rmse", rmse.into());
    put("ms", best.ms().unwrap_or(f64::NAN).into());
    put("truth-rays", i64::from(rays).into());
    put("noise_rmse", traced.noise_rmse.into());
    put("samples", i64::from(requirements.samples).into());
    put("renderer", context.renderer().into());
    put("opengl", context.version().into());
    let all = flags::with_origin(&best.settings, render);
    let header = "# Written by hbao tune, for hbao render --settings and Settings::read_toml. [render] tells what for.";
    let mut outputs = Outputs::new();
    outputs.stage(output, format!("{header}\n{all}").as_bytes())?;
    if let Some(path) = json {
        let report = json!({
            "renderer": context.renderer(),
            "scene": scene.name,
            "size": [flags.size.0, flags.size.1],
            "truth": { "rays": rays, "noise_rmse": traced.noise_rmse },
            "max_error": if let Goal::MaxError(limit) = goal { Some(limit) } else { None },
            "max_ms": if let Goal::MaxMs(limit) = goal { Some(limit) } else { None },
            "pinned": pinned,
            "view": {
                "covered": requirements.covered.texels.iter().filter(|&&covered| covered).count(),
                "samples": requirements.samples,
                "edge_pixels": requirements.edges_of(base.method),
                "radius_px": [requirements.radius_px.0, requirements.radius_px.1],
            },
            "rows": tuned.tried.iter().map(|tried| listing::json(tried, &requirements)).collect::<Vec<_>>(),
        });
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
    }
    outputs.commit()
}
