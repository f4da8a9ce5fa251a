//! `hbao trade`: measures the time and the error of many combinations of settings.

use super::flags::{self, Flags, Opened};
use super::session::{open_context, trace, without_effect};
use super::unmeant;
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
use hbao::reference::truth::Weight;
use hbao::{Error, check_size};
use serde_json::json;

const EXPLANATION: &str = "\
Some 60 combinations of settings are timed and compared with ray-traced ambient occlusion of the same radius and
attenuation. The time is that of ambient occlusion and its blur, the median over interleaved runs. The comparison covers
the pixels that hold a surface. A star marks each combination that no other beats in both time and RMSE. The column
'exits' has the share of the surface at which a method exits early, with visibility 1, because R covers too few
texels there; combinations above 50 % get no star. An edge pixel is one whose 4 depth samples show more than one surface.
'AO ms' is the time without the blur. 'best S' is the --strength with which the RMSE would be the least, found on the
same image, and 'its RMSE' is what is left with it.
Of the flags for settings, only --radius, --attenuation, --strength and --exit have an effect, because the sweep sets
all other settings itself. With LP_NUM_THREADS=1 in the environment, llvmpipe uses one thread. Nothing else should run
on the machine.

The second table splits the error of 'hbao' into parts, for 4x4, 8x8 and 16x16 samples at full and at half resolution,
on 50,000 random pixels that are the same in every run. Each part is the difference between two images:
  model         the converged method (64 directions, a sample at every texel, in float64) minus the ray-traced image
  sampling      the method with its own number of samples minus the converged method
  filtering     the image after the blur minus the image before it
  quantisation  the image with 8-bit formats minus the image with float formats
At each pixel the parts add up to the total error, and so the biases of the parts add up to the total bias. The squares
of the RMSEs add up to the square of the total RMSE only together with the cross term: twice the sum, over all pairs of
parts, of the mean of their product.

Examples:
  hbao trade nave --size 400x300
  hbao trade sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --size 800x600 --json trade.json --plot trade.svg";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let own = [
        flags::path("json", "FILE.json", "Write the rows of both tables"),
        flags::path("csv", "FILE.csv", "Write the rows of the first table"),
        flags::path("plot", "FILE.svg", "Write a plot with time on one axis and RMSE on the other"),
        flags::valued("runs", "N", "Number of timed runs of each combination [1 to 1000; default: 5]"),
        flags::truth_rays(),
    ];
    Command::new("trade")
        .about("Measure what accuracy costs: the time and the error of many combinations of settings")
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
    let Opened { scene, settings, camera, notices, .. } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| !matches!(*knob, "radius" | "attenuation" | "strength" | "exit"));
    idle.map(|knob| without_effect(knob, &settings, "the sweep")).chain(notices).for_each(|notice| say(&notice));
    let base = settings.resolved(scene.mesh.diagonal());

    let context = open_context(flags.backend)?;
    let gl = context.gl();
    check_size(gl, flags.size.0, flags.size.1)?;
    let shot = Shot { mesh: &scene.mesh, camera: &camera, size: flags.size };
    let traced = trace(shot, &base, rays, Weight::Uniform)?;
    if !traced.covered.contains(&true) {
        let what = unmeant::empty(&flags, &scene.mesh, &camera);
        return Err(Error::Input { path: flags.scene.clone().into(), what });
    }
    let truth = TruthImage::new(&traced, shot.size);
    let all = sweep(&base);
    let progress = bar((all.len() * (runs + 1)) as u64, "renderings");
    let mut rows = measure(gl, shot, &truth, &all, runs, || progress.inc(1))?;
    progress.finish_and_clear();
    rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    unmeant::radius_of_many(rows.iter().map(|row| (&row.settings, row.reach))).iter().for_each(|notice| say(notice));
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
