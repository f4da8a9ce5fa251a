//! `hbao trade`: error against time over a sweep of settings.

use super::flags::{self, Flags, Opened};
use super::truth::trace;
use super::{bar, plot, print, say};
use clap::{ArgMatches, Command};
use glow::HasContext as _;
use hbao::Error;
use hbao::context::Context;
use hbao::image::{Image, Outputs};
use hbao::measure::trade::{Row, measure, sweep};
use hbao::settings::{Method, Settings};
use serde_json::json;
use std::fmt::Write as _;

const EXPLANATION: &str = "\
Each of some 50 settings is timed (ambient occlusion and its blur, the median of interleaved runs) and compared, over the
pixels that hold a surface, with ray-traced ambient occlusion of the same radius and attenuation. A star marks what
nothing else beats in both time and RMSE. Of the settings only --radius, --attenuation and --strength matter: the sweep
goes through the others. LP_NUM_THREADS=1 keeps llvmpipe to one thread; the machine should have nothing else to do.

Examples:
  hbao trade nave --size 400x300
  hbao trade sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --size 800x600 --json trade.json --plot trade.svg";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let own = [
        flags::path("json", "FILE.json", "Write the rows"),
        flags::path("csv", "FILE.csv", "Write the rows as a table"),
        flags::path("plot", "FILE.svg", "Draw RMSE against time"),
        flags::valued("runs", "N", "Counted runs [1 to 1000; default: 5]"),
        flags::truth_rays(),
    ];
    Command::new("trade")
        .about("Measure what accuracy costs: error against time over a sweep of settings")
        .args(own)
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

/// Traces the truth, measures the sweep, prints a table, and writes what is wanted.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let (rays, runs) = (flags::read_truth_rays(matches)?, flags::read_runs(matches, 5)?);
    let json = flags::path_of(matches, "json", "json")?;
    let csv = flags::path_of(matches, "csv", "csv")?;
    let plotted = flags::path_of(matches, "plot", "svg")?;
    Outputs::check(json.iter().chain(&csv).chain(&plotted).cloned())?;
    let Opened { scene, settings, camera, notices } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| !matches!(*knob, "radius" | "attenuation" | "strength"));
    idle.map(|knob| format!("--{knob} has no effect on the sweep")).chain(notices).for_each(|notice| say(&notice));
    let base = settings.resolved(scene.mesh.diagonal());

    let context = Context::open(flags.backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    let traced = trace(&scene.mesh, &camera, flags.size, &base, rays)?;
    let (width, height) = (flags.size.0 as usize, flags.size.1 as usize);
    let truth = Image { width, height, texels: traced.visibility.iter().map(|&a| a as f32).collect() };
    let covered = Image { width, height, texels: traced.covered.clone() };
    let all = sweep(&base);
    let progress = bar((all.len() * (runs + 1)) as u64, "renderings");
    let view = (&scene.mesh, &camera);
    let mut rows = measure(gl, view, (&truth, &covered), &all, runs, || progress.inc(1))?;
    progress.finish_and_clear();
    rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let least = rows.iter().map(|row| row.errors.rmse).fold(f64::INFINITY, f64::min);
    if traced.noise_rmse > least / 5.0 {
        say(&format!(
            "the truth's noise of {:.5} is more than a fifth of the least error, {least:.5}: give more --truth-rays",
            traced.noise_rmse
        ));
    }

    print(&table(&rows))?;
    // SAFETY: the context is current on this thread, and this is a core parameter.
    let renderer = unsafe { gl.get_parameter_string(glow::RENDERER) };
    let mut outputs = Outputs::new();
    if let Some(path) = json {
        let report = json!({
            "renderer": renderer,
            "scene": scene.name,
            "size": [flags.size.0, flags.size.1],
            "truth": { "rays": rays, "noise_rmse": traced.noise_rmse },
            "rows": rows.iter().map(as_json).collect::<Vec<_>>(),
        });
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
    }
    if let Some(path) = csv {
        outputs.stage(path, as_csv(&rows).as_bytes())?;
    }
    if let Some(path) = plotted {
        let title = format!("{}, {}x{}, {renderer}", scene.name, flags.size.0, flags.size.1);
        outputs.stage(path, plot::trade(&rows, &title)?.as_bytes())?;
    }
    outputs.commit()
}

/// The fields of a row in files, in their order.
fn fields(row: &Row) -> Vec<(&'static str, serde_json::Value)> {
    let e = &row.errors;
    let mut all = settings_fields(&row.settings);
    all.extend([
        ("ms", row.ms.into()),
        ("rmse", e.rmse.into()),
        ("mae", e.mae.into()),
        ("bias", e.bias.into()),
        ("max", e.max.into()),
        ("flip", e.flip.into()),
        ("pareto", row.pareto.into()),
    ]);
    all
}

/// Those that tell the settings.
pub(super) fn settings_fields(s: &Settings) -> Vec<(&'static str, serde_json::Value)> {
    let blur = match s.method {
        Method::None => 0,
        // Its own.
        Method::Ssao if s.blur > 0 => 4,
        _ => s.blur,
    };
    // How many fetches of depth a pixel takes, in the method's own words.
    let (directions, steps) = match s.method {
        Method::Ssao => (1, s.ssao_samples),
        Method::None => (0, 0),
        _ => (s.directions, s.steps),
    };
    let rays = if s.method == Method::RayMarch { s.rays } else { 1 };
    vec![
        ("method", s.method.name().into()),
        ("directions", directions.into()),
        ("steps", steps.into()),
        ("rays", rays.into()),
        ("half_res", s.half_res.into()),
        ("blur", blur.into()),
        ("blur_kernel", s.blur_kernel.name().into()),
        ("msaa", s.msaa.into()),
        ("ao_format", s.ao_format.name().into()),
        ("normal_format", s.normal_format.name().into()),
        ("depth_format", s.depth_format.name().into()),
    ]
}

fn as_json(row: &Row) -> serde_json::Value {
    serde_json::Value::Object(fields(row).into_iter().map(|(name, value)| (name.to_string(), value)).collect())
}

fn as_csv(rows: &[Row]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let fields = fields(row);
        if i == 0 {
            let names: Vec<_> = fields.iter().map(|(name, _)| *name).collect();
            let _ = writeln!(text, "{}", names.join(","));
        }
        // Words and numbers only: nothing that would have to be quoted.
        let values: Vec<String> = fields.iter().map(|(_, value)| value.to_string().replace('"', "")).collect();
        let _ = writeln!(text, "{}", values.join(","));
    }
    text
}

/// What tells settings from others of their method.
pub(super) fn words(s: &Settings) -> String {
    let samples = match s.method {
        Method::Ssao => format!("{}", s.ssao_samples),
        Method::RayMarch => format!("{}/{}/{}", s.directions, s.rays, s.steps),
        Method::None => String::new(),
        _ => format!("{}/{}", s.directions, s.steps),
    };
    let mut extras = Vec::new();
    if s.half_res {
        extras.push("half".to_string());
    }
    if s.method != Method::Ssao && s.method != Method::None {
        extras.push(format!("blur {}", s.blur));
    }
    let own = Settings::for_method(s.method);
    for (value, usual) in [
        (s.blur_kernel.name(), own.blur_kernel.name()),
        (s.ao_format.name(), own.ao_format.name()),
        (s.normal_format.name(), own.normal_format.name()),
        (s.depth_format.name(), own.depth_format.name()),
    ] {
        if value != usual {
            extras.push(value.into());
        }
    }
    format!("{samples:<9} {}", extras.join(", "))
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "  {:<12}{:<32}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n",
        "method", "samples", "ms", "RMSE", "MAE", "bias", "max", "FLIP"
    );
    for row in rows {
        let e = &row.errors;
        let flip = e.flip.map_or("-".into(), |flip| format!("{flip:.4}"));
        let _ = writeln!(
            text,
            "{} {:<12}{:<32}{:>9.2}{:>9.4}{:>9.4}{:>+9.4}{:>8.3}{:>8}",
            if row.pareto { '*' } else { ' ' },
            row.settings.method.name(),
            words(&row.settings),
            row.ms,
            e.rmse,
            e.mae,
            e.bias,
            e.max,
            flip
        );
    }
    text
}
