//! `hbao bench`: measures Table 6.2.1, Figure 1 of the talk and the cost of Crysis on this machine, and how costs grow.

use super::flags::{self, Flags, Opened};
use super::session::{open_context, samples_given};
use super::unmeant;
use crate::report::json;
use crate::report::tables::bench::{self, SERIES, growths};
use crate::report::tables::cells::{number, optional, size_of};
use crate::terminal::{bar, print, say};
use clap::{ArgMatches, Command};
use hbao::image::Outputs;
use hbao::measure::bench::{
    Case, FIXED, Measurement, SMALL, changes, crysis, figure1, input_costs, measure, scaling, table,
};
use hbao::measure::published::{CRYSIS_MS, TABLE_SIZE};
use hbao::measure::ratios::ratios;
use hbao::scene::{CORNELL_BOX, NAVE};
use hbao::{Error, size_limit};
use serde_json::json;
use std::collections::BTreeSet;

const EXPLANATION: &str = "\
The parts of --only:
  table    Table 6.2.1: whole frames at half resolution, and at full resolution with 1 and with 4 depth samples per
           pixel, each with a 9x9 blur and an increasing number of samples
  figure1  Figure 1 of the talk: the pass of each method alone, beside its floor (see below)
  crysis   ssao with 16 samples and its blur at 1280x720: with depth at full size; with depth at half size, including
           the time of making it; and with --ssao-rotation mirror
  embedding  what an application pays: for changing a setting from one frame of 16x16 pixels to the next, and for depth
           and normals in other forms than the passes read
  scaling  hbao with increasing numbers of pixels, samples and triangles, and the power of each number with which the
           time grows; to get more triangles, every triangle is cut into 4, repeatedly

Each time is the median over interleaved runs. The driver's timer query measures it, or the clock if the driver has no
such query. A first run, which compiles the shaders, is not counted. The percentage after a time says how far the
farthest run was from the median. The floor of a method is the time of its shader with all its fetches of depth and
without its arithmetic, which is replaced by a sum. The papers' figures of 2008 are printed beside the measured ones.
The papers determine the methods, the numbers of samples and the blurs, and a notice names the flags that have no effect
for this reason. --size applies to table and figure1; scaling goes from a quarter to twice its width and height. Nothing
else should run on the machine. With LP_NUM_THREADS=1 in the environment, llvmpipe uses one thread; with
MESA_SHADER_CACHE_DISABLE=true, it compiles the shaders every time.

Examples:
  hbao bench
  hbao bench --only figure1 --size 800x600 --runs 11
  hbao bench sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --json bench.json";

/// A group of cases that are measured in interleaved rounds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Group {
    Table,
    Figure1,
    Crysis,
    Scaling,
}

/// What is measured together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Cases(Group),
    Embedding,
}

/// The parts, with their names for `--only`.
const PARTS: [(&str, Part); 5] = [
    ("table", Part::Cases(Group::Table)),
    ("figure1", Part::Cases(Group::Figure1)),
    ("crysis", Part::Cases(Group::Crysis)),
    ("scaling", Part::Cases(Group::Scaling)),
    ("embedding", Part::Embedding),
];

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let parts = PARTS.map(|(name, _)| name).join(",");
    let own = [
        flags::path("json", "FILE.json", "Write the measured figures"),
        flags::valued("only", "PARTS", format!("The parts to measure, separated by commas [{parts}; default: all]")),
        flags::valued("runs", "N", "Number of timed runs of each case [1 to 1000; default: 5]"),
    ];
    let scene =
        format!("A model (OBJ, PLY, STL, glTF, GLB), or a built-in scene, {CORNELL_BOX} or {NAVE} [default: {NAVE}]");
    Command::new("bench")
        .about("Measure again what the papers of 2008 measured, and how costs grow with pixels, samples and triangles")
        .args(own)
        .args(flags::arguments())
        .mut_arg("scene", |arg| arg.help(scene))
        .after_help(EXPLANATION)
}

/// Measures group by group, prints the tables of each group, and writes the measured figures if `--json` is given.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let mut flags = Flags::read(matches)?;
    if !matches.contains_id("scene") {
        flags.scene = NAVE.into();
    }
    let runs = flags::read_runs(matches, 5)?;
    let parts = read_parts(flags::text(matches, "only"))?;
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(&json)?;
    let Opened { scene, settings, camera, notices, empty } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| FIXED.contains(knob));
    idle.map(|knob| format!("--{knob} has no effect on the cases")).chain(notices).for_each(|notice| say(&notice));
    let base = settings.resolved(scene.mesh.diagonal());

    let context = open_context(flags.backend)?;
    let gl = context.gl();
    let limit = size_limit(gl);
    let mut cases: Vec<(Group, Vec<Case>)> = Vec::new();
    for part in &parts {
        let Part::Cases(group) = *part else { continue };
        let mut all = match group {
            Group::Table => table(&base, flags.size),
            Group::Figure1 => figure1(&base, flags.size),
            Group::Crysis => crysis(&base),
            Group::Scaling => scaling(&base, flags.size, scene.mesh.triangles.len()),
        };
        // The scaling series contains larger images than the user asked for. Those above the driver's limit are left
        // out. An image of the size that the user asked for is kept; if it is too large, the driver refuses it.
        let largest = limit.max(flags.size.0).max(flags.size.1);
        let (count, fits) = (all.len(), |case: &Case| case.size.0.max(case.size.1) <= largest);
        all.retain(fits);
        if all.len() < count {
            say(&format!("scaling: {} sizes past the driver's limit of {limit} are left out", count - all.len()));
        }
        cases.push((group, all));
    }
    let view = flags.view.or(&scene.view);
    let frames: usize = cases.iter().map(|(_, cases)| cases.len() * (runs + 1)).sum();
    let progress = bar(frames as u64, "frames");
    let (mut rows, mut said) = (Vec::new(), Vec::new());
    for (group, cases) in cases {
        let measured = measure(gl, &scene.mesh, &view, &cases, runs, || progress.inc(1))?;
        let unmeant = if measured.iter().all(|one| one.reach.covered == 0) {
            (!empty).then(|| unmeant::empty(&flags, &scene.mesh, &camera)).into_iter().collect()
        } else {
            let all = measured.iter().map(|one| (&one.case.settings, one.reach));
            let told = unmeant::radius_of_many(all).into_iter();
            told.map(|notice| format!("{}: {notice}", title(group))).collect::<Vec<_>>()
        };
        for notice in measured.iter().flat_map(notices_of).chain(unmeant) {
            if !said.contains(&notice) {
                progress.suspend(|| say(&notice));
                said.push(notice);
            }
        }
        let sizes: BTreeSet<_> = measured.iter().map(|one| size_of(&one.case)).collect();
        let size = sizes.first().filter(|_| sizes.len() == 1).map(|size| format!(", {size}")).unwrap_or_default();
        let (title, text) = (title(group), text(group, &measured));
        let heading = format!("{title}: {}{size}, the median of {runs} and the farthest from it\n", scene.name);
        let text = heading + &text + &ratios_text(&measured);
        progress.suspend(|| print(&text))?;
        rows.extend(measured);
    }
    progress.finish_and_clear();
    let (mut changed, mut costs) = (Vec::new(), Vec::new());
    if parts.contains(&Part::Embedding) {
        let progress = bar((7 * runs) as u64, "rounds");
        changed = changes(gl, &scene.mesh, &view, &base, runs, || progress.inc(1))?;
        costs = input_costs(gl, (&scene.mesh, &view, flags.size), &base, runs, || progress.inc(1))?;
        progress.finish_and_clear();
        let (small, (width, height)) = (format!("{}x{}", SMALL.0, SMALL.1), flags.size);
        print(&format!(
            "What changing a setting adds to a frame of {small}, the median of {runs} and the farthest from it\n{}\n\
             What inputs cost: {}, {width}x{height}, the median of {runs} and the farthest from it\n{}\n",
            bench::changes(&changed).text(),
            scene.name,
            bench::input_costs(&costs).text()
        ))?;
    }

    if let Some(path) = json {
        let report = json!({
            "renderer": context.renderer(),
            "scene": scene.name,
            "runs": runs,
            "rows": rows.iter().map(json::measurement).collect::<Vec<_>>(),
            "ratios": ratios(&rows).iter().map(json::ratio).collect::<Vec<_>>(),
            "changes": changed.iter().map(json::change).collect::<Vec<_>>(),
            "inputs": costs.iter().map(json::input_cost).collect::<Vec<_>>(),
            "exponents": growths(&rows).iter().map(json::growth).collect::<Vec<_>>(),
        });
        let mut outputs = Outputs::new();
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
        outputs.commit()?;
    }
    Ok(())
}

/// Returns the parts that `--only` names, in the order of [`PARTS`].
fn read_parts(only: Option<&str>) -> Result<Vec<Part>, Error> {
    let wanted = match only {
        None => PARTS.map(|(_, part)| part).into(),
        Some(text) => {
            text.split(',').map(|name| flags::word("only", name.trim(), &PARTS)).collect::<Result<Vec<_>, Error>>()?
        }
    };
    Ok(PARTS.into_iter().map(|(_, part)| part).filter(|part| wanted.contains(part)).collect())
}

/// Returns a line for each thing that the driver could not do as asked.
fn notices_of(one: &Measurement) -> Vec<String> {
    let mut notices = one.notices.clone();
    notices.extend(samples_given(one.case.settings.msaa, one.samples));
    notices
}

fn title(group: Group) -> &'static str {
    match group {
        Group::Table => "Table 6.2.1, whole frames with a blur of 9",
        Group::Figure1 => "Figure 1 of the talk and the other methods, the AO pass alone",
        Group::Crysis => "Crysis, 16 samples and their blur",
        Group::Scaling => "Scaling of hbao with a blur of 9",
    }
}

/// Returns the tables of a group as text.
fn text(group: Group, measured: &[Measurement]) -> String {
    match group {
        Group::Table => {
            let (width, height) = TABLE_SIZE;
            let published = bench::published_frames().body();
            format!("{}\n2008: Sibenik, {width}x{height}, frames/s\n{published}", bench::frames(measured).text())
        }
        Group::Figure1 => format!("{}\n{}\n", bench::methods(measured).text(), bench::disagreement()),
        Group::Crysis => {
            let mut table = bench::crysis(measured);
            table.rows.push(vec!["2008, 8800 GTX".into(), String::new(), String::new(), number(CRYSIS_MS, 2)]);
            table.text()
        }
        Group::Scaling => {
            let growths = growths(measured);
            let series = SERIES.map(|(series, _)| {
                let growths = growths.iter().filter(|growth| growth.series == series).map(|growth| {
                    let power = optional(growth.exponent, 2);
                    format!("  {} grows as {series} to the power of {power}\n", growth.of)
                });
                bench::series(measured, series).text() + &growths.collect::<String>()
            });
            series.concat()
        }
    }
}

/// Returns the table of ratios that follow from the measurements, with an empty line before and after it. If there are
/// no ratios, it returns one empty line.
fn ratios_text(measured: &[Measurement]) -> String {
    let ratios = ratios(measured);
    if ratios.is_empty() { "\n".into() } else { format!("\n{}\n", bench::ratios(&ratios).text()) }
}
