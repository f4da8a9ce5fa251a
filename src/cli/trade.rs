//! `hbao trade`: error against time over a sweep of settings.

use super::flags::{self, Flags, Opened};
use super::session::{open_context, trace, without_effect};
use crate::report::fields::{object, trade_fields};
use crate::report::tables::trade::{self as tables, Decomposed, decomposed_pixels};
use crate::report::{DECOMPOSED_PIXELS, json, plot};
use crate::terminal::{bar, print, say};
use clap::{ArgMatches, Command};
use hbao::image::Outputs;
use hbao::measure::decomposition::{TruthAt, decompose_all, subset};
use hbao::measure::errors::too_noisy;
use hbao::measure::trade::{chapter, measure, sweep};
use hbao::measure::{Shot, TruthImage};
use hbao::{Error, check_size};
use serde_json::json;

const EXPLANATION: &str = "\
Each of some 50 settings is timed (ambient occlusion and its blur, the median of interleaved runs) and compared, over
the pixels that hold a surface, with ray-traced ambient occlusion of the same radius and attenuation. A star marks the
settings that no others beat in both time and RMSE. Edge pixels are those of which 4 depth samples show more than one
surface. Of the settings only --radius, --attenuation and --strength matter: the sweep goes through the others.
LP_NUM_THREADS=1 keeps llvmpipe to one thread; the machine should have nothing else to do.

The second table takes the error of the chapter's settings apart, on 50,000 random pixels, the same in every run. The model
error is that of 64 directions with a sample every texel, in float64, against the rays. The sampling error is that of the
settings' samples against those. The filtering error is that of the image after the blur against the one before, and the
quantisation error that of 8 bits against float. A pixel's parts add up to its total error, and so do the biases. The
squares of the RMSEs do so only with the cross term, which is twice the mean of the parts' products.

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

/// Traces the truth, measures the sweep, prints the tables, and writes the files that were asked for.
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

    let context = open_context(flags.backend)?;
    let gl = context.gl();
    check_size(gl, flags.size.0, flags.size.1)?;
    let shot = Shot { mesh: &scene.mesh, camera: &camera, size: flags.size };
    let traced = trace(shot, &base, rays)?;
    let truth = TruthImage::new(&traced, shot.size);
    let all = sweep(&base);
    let progress = bar((all.len() * (runs + 1)) as u64, "renderings");
    let mut rows = measure(gl, shot, &truth, &all, runs, || progress.inc(1))?;
    progress.finish_and_clear();
    rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let chapter = chapter(&base);
    let pixels = subset(&truth.covered, DECOMPOSED_PIXELS);
    let visibility: Vec<f64> = pixels.iter().map(|&i| traced.visibility[i]).collect();
    let truth = TruthAt { pixels: &pixels, visibility: &visibility };
    let progress = bar(chapter.len() as u64, "errors taken apart");
    let parts = decompose_all(gl, shot, &chapter, truth, || progress.inc(1))?;
    progress.finish_and_clear();
    let parts: Vec<Decomposed> = chapter.into_iter().zip(parts).collect();
    let errors = rows.iter().map(|row| row.errors.rmse).chain(parts.iter().map(|(_, parts)| parts.model.rmse));
    let least = errors.fold(f64::INFINITY, f64::min);
    if too_noisy(traced.noise_rmse, least) {
        say(&format!(
            "the truth's noise of {:.5} is more than a fifth of the least error, {least:.5}: give more --truth-rays",
            traced.noise_rmse
        ));
    }

    print(&format!(
        "{}\n  RMSE and bias of each part of the error, on {} pixels\n{}",
        tables::sweep(&rows, 4).text(),
        decomposed_pixels(&parts),
        tables::parts(&parts).text()
    ))?;
    let mut outputs = Outputs::new();
    if let Some(path) = json {
        let report = json!({
            "renderer": context.renderer(),
            "scene": scene.name,
            "size": [flags.size.0, flags.size.1],
            "truth": { "rays": rays, "noise_rmse": traced.noise_rmse },
            "edges": { "pixels": rows.first().and_then(|row| row.edge_errors).map_or(0, |e| e.pixels) },
            "rows": rows.iter().map(|row| object(trade_fields(row))).collect::<Vec<_>>(),
            "decomposition": parts.iter().map(|(s, parts)| json::decomposition(s, parts)).collect::<Vec<_>>(),
        });
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
    }
    if let Some(path) = csv {
        outputs.stage(path, tables::all_fields(&rows).csv().as_bytes())?;
    }
    if let Some(path) = plotted {
        let title = format!("{}, {}x{}, {}", scene.name, flags.size.0, flags.size.1, context.renderer());
        outputs.stage(path, plot::trade(&rows, &title)?.as_bytes())?;
    }
    outputs.commit()
}
