//! `hbao trade`: error against time over a sweep of settings.

use super::flags::{self, Flags, Opened};
use super::truth::{trace, without_effect};
use super::{bar, plot, print, say};
use clap::{ArgMatches, Command};
use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::{Image, Outputs};
use hbao::measure::decomposition::{Decomposition, Part, decompose_all, subset};
use hbao::measure::trade::{Row, chapter, measure, sweep};
use hbao::settings::{Method, Settings};
use hbao::{Error, check_size};
use serde_json::json;
use std::fmt::Write as _;

const EXPLANATION: &str = "\
Each of some 50 settings is timed (ambient occlusion and its blur, the median of interleaved runs) and compared, over
the pixels that hold a surface, with ray-traced ambient occlusion of the same radius and attenuation. A star marks what
nothing else beats in both time and RMSE. Edge pixels hold more than one surface, by the depths of 4 samples a pixel.
Of the settings only --radius, --attenuation and --strength matter: the sweep goes through the others. LP_NUM_THREADS=1
keeps llvmpipe to one thread; the machine should have nothing else to do.

The second table takes the error of the chapter's settings apart, on 50,000 random pixels, the same in every run. Model:
64 directions with a sample every texel, in float64, against the rays. Sampling: the settings' samples against those.
Filtering: after the blur against before. Quantisation: 8 bits against float. A pixel's parts add up to its total error,
and so do the biases. The squares of the RMSEs do so only with the cross term, twice the mean of the parts' products.

Examples:
  hbao trade nave --size 400x300
  hbao trade sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --size 800x600 --json trade.json --plot trade.svg";

/// How many covered pixels the error is taken apart on, where there are as many.
pub(crate) const PIXELS: usize = 50_000;

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
    idle.map(|knob| without_effect(knob, &settings, "the sweep")).chain(notices).for_each(|notice| say(&notice));
    let base = settings.resolved(scene.mesh.diagonal());

    let context = Context::open(flags.backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    check_size(gl, flags.size.0, flags.size.1)?;
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
    let chapter = chapter(&base);
    let pixels = subset(&covered, PIXELS);
    let visibility: Vec<f64> = pixels.iter().map(|&i| traced.visibility[i]).collect();
    let progress = bar(chapter.len() as u64, "errors taken apart");
    let parts = decompose_all(gl, view, flags.size, &chapter, (&pixels, &visibility), || progress.inc(1))?;
    progress.finish_and_clear();
    let parts: Vec<_> = chapter.iter().zip(parts).collect();
    let errors = rows.iter().map(|row| row.errors.rmse).chain(parts.iter().map(|(_, parts)| parts.model.rmse));
    let least = errors.fold(f64::INFINITY, f64::min);
    if traced.noise_rmse > least / 5.0 {
        say(&format!(
            "the truth's noise of {:.5} is more than a fifth of the least error, {least:.5}: give more --truth-rays",
            traced.noise_rmse
        ));
    }

    print(&format!("{}\n{}", table(&rows), table_of_parts(&parts)))?;
    // SAFETY: the context is current on this thread, and this is a core parameter.
    let renderer = unsafe { gl.get_parameter_string(glow::RENDERER) };
    let mut outputs = Outputs::new();
    if let Some(path) = json {
        let report = json!({
            "renderer": renderer,
            "scene": scene.name,
            "size": [flags.size.0, flags.size.1],
            "truth": { "rays": rays, "noise_rmse": traced.noise_rmse },
            "edges": { "pixels": rows.first().and_then(|row| row.edge_errors).map_or(0, |e| e.pixels) },
            "rows": rows.iter().map(as_json).collect::<Vec<_>>(),
            "decomposition": parts.iter().map(|(settings, parts)| parts_as_json(settings, parts)).collect::<Vec<_>>(),
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
    let (e, edge) = (&row.errors, &row.edge_errors);
    let mut all = settings_fields(&row.settings);
    all.extend([
        ("ms", row.ms.into()),
        ("rmse", e.rmse.into()),
        ("mae", e.mae.into()),
        ("bias", e.bias.into()),
        ("max", e.max.into()),
        ("flip", e.flip.into()),
        ("edge_rmse", edge.map(|e| e.rmse).into()),
        ("edge_mae", edge.map(|e| e.mae).into()),
        ("edge_bias", edge.map(|e| e.bias).into()),
        ("edge_max", edge.map(|e| e.max).into()),
        ("edge_flip", edge.and_then(|e| e.flip).into()),
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

pub(crate) fn as_json(row: &Row) -> serde_json::Value {
    serde_json::Value::Object(fields(row).into_iter().map(|(name, value)| (name.to_string(), value)).collect())
}

pub(crate) fn parts_as_json(s: &Settings, parts: &Decomposition) -> serde_json::Value {
    let of = |part: &Part| json!({ "rmse": part.rmse, "bias": part.bias, "max": part.max });
    json!({
        "method": s.method.name(),
        "directions": s.directions,
        "steps": s.steps,
        "half_res": s.half_res,
        "blur": s.blur,
        "model": of(&parts.model),
        "sampling": of(&parts.sampling),
        "filtering": of(&parts.filtering),
        "quantisation": of(&parts.quantisation),
        "total": of(&parts.total),
        "cross": parts.cross,
        "pixels": parts.pixels,
    })
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
        "  {:<12}{:<32}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}{:>11}\n",
        "method", "samples", "ms", "RMSE", "MAE", "bias", "max", "FLIP", "edge RMSE"
    );
    for row in rows {
        let e = &row.errors;
        let [flip, edge] = [e.flip, row.edge_errors.map(|edge| edge.rmse)]
            .map(|value| value.map_or("-".into(), |value| format!("{value:.4}")));
        let _ = writeln!(
            text,
            "{} {:<12}{:<32}{:>9.2}{:>9.4}{:>9.4}{:>+9.4}{:>8.3}{:>8}{:>11}",
            if row.pareto { '*' } else { ' ' },
            row.settings.method.name(),
            words(&row.settings),
            row.ms,
            e.rmse,
            e.mae,
            e.bias,
            e.max,
            flip,
            edge
        );
    }
    text
}

fn table_of_parts(all: &[(&Settings, Decomposition)]) -> String {
    let pixels = all.first().map_or(0, |(_, parts)| parts.pixels);
    let mut text =
        format!("  RMSE and bias of each part of the error, on {pixels} pixels\n  {:<12}{:<20}", "method", "samples");
    for name in ["model", "sampling", "filtering", "quantisation", "total"] {
        let _ = write!(text, "{name:>18}");
    }
    let _ = writeln!(text, "{:>11}", "cross");
    for (settings, parts) in all {
        let _ = write!(text, "  {:<12}{:<20}", settings.method.name(), words(settings));
        for part in [parts.model, parts.sampling, parts.filtering, parts.quantisation, parts.total] {
            let _ = write!(text, "{:>10.4} {:>+7.4}", part.rmse, part.bias);
        }
        let _ = writeln!(text, "{:>+11.5}", parts.cross);
    }
    text
}
