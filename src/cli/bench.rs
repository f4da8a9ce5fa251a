//! `hbao bench`: Table 6.2.1, Figure 1 of the talk and the cost of Crysis on this machine, and how costs scale.

use super::flags::{self, Flags, Opened};
use super::{bar, print, say};
use clap::{ArgMatches, Command};
use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::Outputs;
use hbao::measure::bench::{Case, FIXED, Row, crysis, exponent, figure1, measure, scaling, table};
use hbao::measure::median;
use hbao::measure::published::{
    COLUMNS, CRYSIS_MS, EIGHT, FIGURE_1, TABLE_6_2_1, TABLE_SIZE, ULTRA, figure_1, table_mpixels_per_s,
};
use hbao::measure::ratios::{Ratio, ratios};
use hbao::scene::{CORNELL_BOX, NAVE};
use hbao::{Error, size_limit};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;

const EXPLANATION: &str = "\
The parts of --only:
  table    Table 6.2.1: whole frames at half resolution, 1x and 4x, with a blur of 9 and more and more samples
  figure1  Figure 1 of the talk: each method's pass alone, against the least that its fetches take
  crysis   16 samples and their blur at 1280x720, with depth at full size and at half (with what makes it), by mirror
           in place of a matrix
  scaling  hbao by pixels, samples and triangles, with the power fitted to each; every triangle is cut in 4, repeatedly

Times are medians over interleaved runs, by the driver's timer query where it has one, after a first run that compiles
the shaders; in percent, how far from it the farthest run was. The floor is the AO shader with every fetch of depth, in
which the arithmetic after each is replaced by a sum. Beside them stand the papers' figures of 2008. Methods, samples
and blurs are the papers' own: settings that would change them are said to have no effect. --size is that of table and
figure1; scaling goes from a quarter of its width to twice. The machine should have nothing else to do; LP_NUM_THREADS=1
keeps llvmpipe to one thread, and MESA_SHADER_CACHE_DISABLE=true has it compile every time.

Examples:
  hbao bench
  hbao bench --only figure1 --size 800x600 --runs 11
  hbao bench sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --json bench.json";

/// A part of the measurement: its name, and its cases in turns.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Table,
    Figure1,
    Crysis,
    Scaling,
}

const PARTS: [(&str, Part); 4] =
    [("table", Part::Table), ("figure1", Part::Figure1), ("crysis", Part::Crysis), ("scaling", Part::Scaling)];

/// The verb's flags.
pub(crate) fn command() -> Command {
    let parts = PARTS.map(|(name, _)| name).join(",");
    let own = [
        flags::path("json", "FILE.json", "Write the figures"),
        flags::valued("only", "PARTS", format!("What to measure, some of {parts} [default: all]")),
        flags::valued("runs", "N", "Counted runs [1 to 1000; default: 5]"),
    ];
    let scene = format!("An OBJ file, or a built-in scene, {CORNELL_BOX} or {NAVE} [default: {NAVE}]");
    Command::new("bench")
        .about("Measure what the papers of 2008 measured, and how costs scale")
        .args(own)
        .args(flags::arguments())
        .mut_arg("scene", |arg| arg.help(scene))
        .after_help(EXPLANATION)
}

/// Measures part by part, prints each, and writes the figures where they are wanted.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let mut flags = Flags::read(matches)?;
    if flags::text(matches, "scene").is_none() {
        flags.scene = NAVE.into();
    }
    let runs = flags::read_runs(matches, 5)?;
    let parts = read_parts(flags::text(matches, "only"))?;
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(&json)?;
    let Opened { scene, settings, notices, .. } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| FIXED.contains(knob));
    idle.map(|knob| format!("--{knob} has no effect on the cases")).chain(notices).for_each(|notice| say(&notice));
    let base = settings.resolved(scene.mesh.diagonal());

    let context = Context::open(flags.backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    let limit = size_limit(gl);
    let mut cases: Vec<(Part, Vec<Case>)> = Vec::new();
    for part in parts {
        let mut all = match part {
            Part::Table => table(&base, flags.size),
            Part::Figure1 => figure1(&base, flags.size),
            Part::Crysis => crysis(&base),
            Part::Scaling => scaling(&base, flags.size, scene.mesh.triangles.len()),
        };
        // The series goes on to larger images than were asked for; of those that were, the driver may say what it will.
        let largest = limit.max(flags.size.0).max(flags.size.1);
        let (count, fits) = (all.len(), |case: &Case| case.size.0.max(case.size.1) <= largest);
        all.retain(fits);
        if all.len() < count {
            say(&format!("scaling: {} sizes past the driver's limit of {limit} are left out", count - all.len()));
        }
        cases.push((part, all));
    }
    let view = flags.view.or(&scene.view);
    let frames: usize = cases.iter().map(|(_, cases)| cases.len() * (runs + 1)).sum();
    let progress = bar(frames as u64, "frames");
    let (mut rows, mut said) = (Vec::new(), Vec::new());
    for (part, cases) in cases {
        let measured = measure(gl, (&scene.mesh, &view), &cases, runs, || progress.inc(1))?;
        for notice in measured.iter().flat_map(notices_of) {
            if !said.contains(&notice) {
                progress.suspend(|| say(&notice));
                said.push(notice);
            }
        }
        let (title, text) = match part {
            Part::Table => ("Table 6.2.1, whole frames with a blur of 9", frames_table(&measured)),
            Part::Figure1 => {
                ("Figure 1 of the talk and the other methods, the AO pass alone", methods_table(&measured))
            }
            Part::Crysis => ("Crysis, 16 samples and their blur", crysis_table(&measured)),
            Part::Scaling => ("Scaling of hbao with a blur of 9", series_tables(&measured)),
        };
        let sizes: BTreeSet<_> = measured.iter().map(|row| size_of(&row.case)).collect();
        let size = sizes.first().filter(|_| sizes.len() == 1).map(|size| format!(", {size}")).unwrap_or_default();
        let heading = format!("{title}: {}{size}, the median of {runs} and the farthest from it\n", scene.name);
        let text = heading + &text + &in_words(&ratios(&measured));
        progress.suspend(|| print(&text))?;
        rows.extend(measured);
    }
    progress.finish_and_clear();

    if let Some(path) = json {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        let renderer = unsafe { gl.get_parameter_string(glow::RENDERER) };
        let report = json!({
            "renderer": renderer,
            "scene": scene.name,
            "runs": runs,
            "rows": rows.iter().map(as_json).collect::<Vec<_>>(),
            "ratios": ratios(&rows).iter().map(ratio_as_json).collect::<Vec<_>>(),
            "exponents": exponents(&rows).into_iter().map(|(series, of, power)| {
                json!({ "series": series, "of": of, "exponent": power })
            }).collect::<Vec<_>>(),
        });
        let mut outputs = Outputs::new();
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
        outputs.commit()?;
    }
    Ok(())
}

/// What `--only` says, in the order of [`PARTS`].
fn read_parts(only: Option<&str>) -> Result<Vec<Part>, Error> {
    let wanted = match only {
        None => PARTS.map(|(_, part)| part).into(),
        Some(text) => {
            text.split(',').map(|name| flags::word("only", name.trim(), &PARTS)).collect::<Result<Vec<_>, Error>>()?
        }
    };
    Ok(PARTS.into_iter().map(|(_, part)| part).filter(|part| wanted.contains(part)).collect())
}

/// What the driver did otherwise than asked.
fn notices_of(row: &Row) -> Vec<String> {
    let mut notices = row.notices.clone();
    if row.samples != row.case.settings.msaa {
        notices.push(format!("msaa: asked for {}, given {}", row.case.settings.msaa, row.samples));
    }
    notices
}

/// A number in so many places, or a dash where there is none.
pub(crate) fn number(x: f64, places: usize) -> String {
    if x.is_finite() { format!("{x:.places$}") } else { "-".into() }
}

fn spread(times: &[f64]) -> (f64, f64) {
    times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &t| (low.min(t), high.max(t)))
}

/// The median in milliseconds, and how far from it the farthest run was; a dash where no pass was to be timed.
pub(crate) fn with_spread(times: &[f64]) -> String {
    let ((low, high), middle) = (spread(times), median(times));
    let farthest = (high - middle).max(middle - low) / middle * 100.0;
    match times.len() {
        // Of none, the greatest is less than all.
        _ if high <= 0.0 => "-".into(),
        1 => format!("{middle:.2}"),
        _ => format!("{middle:.2} ±{farthest:.0}%"),
    }
}

pub(crate) fn size_of(case: &Case) -> String {
    format!("{}x{}", case.size.0, case.size.1)
}

pub(crate) fn samples_of(case: &Case) -> String {
    match case.samples() {
        [1, 1, samples] => samples.to_string(),
        [directions, 1, steps] => format!("{directions} x {steps}"),
        [directions, rays, steps] => format!("{directions} x {rays} x {steps}"),
    }
}

/// A mode of the table in words.
pub(crate) fn mode_in_words(mode: &str) -> &'static str {
    match mode {
        "half" => "half resolution",
        "msaa1" => "1x MSAA",
        _ => "4x MSAA",
    }
}

fn frames_table(rows: &[Row]) -> String {
    let mut text = String::new();
    let line = |text: &mut String, name: &str, cells: &mut dyn Iterator<Item = String>| {
        let _ = write!(text, "{name:<28}");
        cells.for_each(|cell| _ = write!(text, "{cell:>16}"));
        text.push('\n');
    };
    line(&mut text, "", &mut COLUMNS.iter().map(|column| (*column).into()));
    for row in rows.chunks(COLUMNS.len()) {
        let mode = row.first().map_or("", |first| mode_in_words(first.case.mode));
        line(&mut text, &format!("{mode}, frames/s"), &mut row.iter().map(|row| number(row.fps(), 2)));
        for (name, times) in [
            ("  frame, ms", (|row| &row.frame_ms) as fn(&Row) -> &Vec<f64>),
            ("  AO, ms", |row| &row.ao_ms),
            ("  its fetch floor, ms", |row| &row.floor_ms),
            ("  blur, ms", |row| &row.blur_ms),
        ] {
            line(&mut text, name, &mut row.iter().map(|row| with_spread(times(row))));
        }
        line(&mut text, "  compiling, ms", &mut row.iter().map(|row| number(row.compile_ms, 0)));
    }
    let _ = writeln!(text, "\n2008: Sibenik, {}x{}, frames/s", TABLE_SIZE.0, TABLE_SIZE.1);
    for row in TABLE_6_2_1 {
        let name = format!("{}, {}", mode_in_words(row.mode), row.card);
        line(&mut text, &name, &mut row.fps.iter().map(f64::to_string));
    }
    text
}

fn methods_table(rows: &[Row]) -> String {
    let mut text = String::new();
    let heads = ["MPixels/s", "2008", "AO, ms", "floor, ms", "AO/floor", "ns/fetch", "compiling, ms"];
    let [mpixels, then, ao, floor, to_floor, fetch, compiling] = heads;
    let _ = writeln!(
        text,
        "{:<14}{:<12}{mpixels:>10}{then:>6}{ao:>14}{floor:>14}{to_floor:>10}{fetch:>10}{compiling:>15}",
        "method", "samples"
    );
    for row in rows {
        let method = row.case.method();
        let _ = writeln!(
            text,
            "{:<14}{:<12}{:>10}{:>6}{:>14}{:>14}{:>10}{:>10}{:>15}",
            method.name(),
            samples_of(&row.case),
            number(row.mpixels_per_s(), 2),
            figure_1(method).map_or(String::new(), |then| number(then, 0)),
            with_spread(&row.ao_ms),
            with_spread(&row.floor_ms),
            number(row.ao_to_floor(), 2),
            number(row.ns_per_sample(&row.floor_ms), 2),
            number(row.compile_ms, 0),
        );
    }
    let _ = writeln!(text, "\n{}", disagreement());
    text
}

/// What the papers say of one card.
pub(crate) fn disagreement() -> String {
    format!(
        "The two papers disagree: the talk has {} MPixels/s with 8 directions of 8 steps on an {ULTRA}, and Table 6.2.1, by its \
         frames with {} less those with {} at 1x, {:.1} on the same card.",
        FIGURE_1[0].1,
        COLUMNS[EIGHT],
        COLUMNS[1],
        table_mpixels_per_s()
    )
}

fn crysis_table(rows: &[Row]) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{:<18}{:>14}{:>14}{:>12}", "", "AO, ms", "blur, ms", "both, ms");
    for row in rows {
        let (ao, blur) = (with_spread(&row.ao_ms), with_spread(&row.blur_ms));
        let both = median(&row.ao_ms) + median(&row.blur_ms);
        let _ = writeln!(text, "{:<18}{ao:>14}{blur:>14}{both:>12.2}", row.case.column);
    }
    let _ = writeln!(text, "{:<18}{:>40}", "2008, 8800 GTX", number(CRYSIS_MS, 2));
    text
}

/// Some of a row's times.
type Times = fn(&Row) -> &Vec<f64>;

/// Each series of the scaling, and of what a power is fitted to it.
const SERIES: [(&str, [(&str, Times); 2]); 3] = [
    ("pixels", [("ao", |row| &row.ao_ms), ("frame", |row| &row.frame_ms)]),
    ("samples", [("ao", |row| &row.ao_ms), ("floor", |row| &row.floor_ms)]),
    ("triangles", [("ao", |row| &row.ao_ms), ("gbuffer", |row| &row.gbuffer_ms)]),
];

/// The series, what of it, and the power of what it goes along.
pub(crate) fn exponents(rows: &[Row]) -> Vec<(&'static str, &'static str, Option<f64>)> {
    let fitted = |series: &str, times: Times| {
        let of = rows.iter().filter(|row| row.case.mode == "scaling" && row.case.column == series);
        exponent(&of.map(|row| (row.along(), median(times(row)))).collect::<Vec<_>>())
    };
    SERIES.iter().flat_map(|(series, of)| of.map(|(of, times)| (*series, of, fitted(series, times)))).collect()
}

fn series_tables(rows: &[Row]) -> String {
    let mut text = String::new();
    let exponents = exponents(rows);
    for (series, _) in SERIES {
        let _ = writeln!(
            text,
            "{series:<12}{:<12}{:>16}{:>12}{:>16}{:>16}",
            "size", "AO, ms", "ns/sample", "G-buffer, ms", "frame, ms"
        );
        for row in rows.iter().filter(|row| row.case.column == series) {
            let _ = writeln!(
                text,
                "{:<12}{:<12}{:>16}{:>12}{:>16}{:>16}",
                number(row.along(), 0),
                size_of(&row.case),
                with_spread(&row.ao_ms),
                number(row.ns_per_sample(&row.ao_ms), 3),
                with_spread(&row.gbuffer_ms),
                with_spread(&row.frame_ms),
            );
        }
        for (_, of, power) in exponents.iter().filter(|(known, ..)| *known == series) {
            let power = power.map_or("-".into(), |power| format!("{power:.2}"));
            let _ = writeln!(text, "  {of} grows as {series} to the power of {power}");
        }
    }
    text
}

fn in_words(ratios: &[Ratio]) -> String {
    let mut text = String::from("\n");
    if !ratios.is_empty() {
        let _ = writeln!(text, "{:<42}{:>8}   2008", "ratio of times", "here");
    }
    for ratio in ratios {
        let papers: Vec<String> = ratio.papers.iter().map(|(card, x)| format!("{card} {x:.2}")).collect();
        let _ = writeln!(text, "{:<42}{:>8}   {}", ratio.what, number(ratio.ours, 2), papers.join(", "));
    }
    if ratios.is_empty() { text } else { text + "\n" }
}

pub(crate) fn as_json(row: &Row) -> Value {
    let case = &row.case;
    let [directions, rays, steps] = case.samples();
    let mut spreads = serde_json::Map::new();
    let all: [(&str, Times); 5] = [
        ("frame_ms", |row| &row.frame_ms),
        ("gbuffer_ms", |row| &row.gbuffer_ms),
        ("ao_ms", |row| &row.ao_ms),
        ("floor_ms", |row| &row.floor_ms),
        ("blur_ms", |row| &row.blur_ms),
    ];
    for (name, times) in all.iter().filter(|(_, times)| !times(row).is_empty()) {
        let (low, high) = spread(times(row));
        spreads.insert((*name).into(), json!([low, high]));
    }
    // Of what was not measured the median is not a number, which JSON writes as null.
    json!({
        "mode": case.mode,
        "column": case.column,
        "method": case.method().name(),
        "directions": directions,
        "rays": rays,
        "steps": steps,
        "msaa": row.samples,
        "half_res": case.settings.half_res,
        "blur": case.blur(),
        "ssao_depth": case.settings.ssao_depth.name(),
        "ssao_rotation": case.settings.ssao_rotation.name(),
        "size": [case.size.0, case.size.1],
        "triangles": row.triangles,
        "frame_ms": median(&row.frame_ms),
        "gbuffer_ms": median(&row.gbuffer_ms),
        "ao_ms": median(&row.ao_ms),
        "floor_ms": median(&row.floor_ms),
        "ao_to_floor": row.ao_to_floor(),
        "fetches_per_pixel": case.fetches(),
        "ns_per_sample": row.ns_per_sample(&row.ao_ms),
        "floor_ns_per_fetch": row.ns_per_sample(&row.floor_ms),
        "blur_ms": median(&row.blur_ms),
        "fps": row.fps(),
        "mpixels_per_s": row.mpixels_per_s(),
        "spread": spreads,
        "compile_ms": row.compile_ms,
    })
}

pub(crate) fn ratio_as_json(ratio: &Ratio) -> Value {
    let papers: serde_json::Map<_, _> = ratio.papers.iter().map(|&(card, x)| (card.to_string(), json!(x))).collect();
    json!({ "ratio": ratio.what, "here": ratio.ours, "papers": papers })
}
