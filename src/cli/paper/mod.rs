//! `hbao paper`: every picture, table and claim of the papers, regenerated into one page.

mod claims;
mod drawing;
mod figures;
mod lab;
mod page;
mod scenes;
mod tables;

use super::flags;
use super::folder::MadeFolder;
use super::{bar, say};
use clap::{Arg, ArgMatches, Command, value_parser};
use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::Outputs;
use hbao::{Error, check_size};
use lab::Lab;
use page::Report;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use tables::Tables;

const PAGE: &str = "index.html";
const FIGURES: &str = "report.json";

/// Below this there is nothing to see.
const SMALLEST: &str = "64x48";

/// What is no rendering.
const DIAGRAMS: &str = "The papers' diagrams that show nothing rendered: 6.1.2, 6.1.3, 6.2.2, 6.2.5 to 6.2.9, 6.2.11, 6.2.12 and \
                        the talk's Figure 2";

const EXPLANATION: &str = "\
DIR/index.html needs nothing but itself; its pictures and drawings also lie beside it, and report.json has the figures. The
models are those of the papers: sibenik.obj and dragon.obj, and sponza.obj for the pictures of 6.1. What is not there is
left out, which the page says; the built-in nave stands in for Sibenik. The machine should have nothing else to do.

Examples:
  hbao paper -o report --size 320x240
  hbao paper -o report --models models";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("DIR").required(true);
    let own = [
        output.value_parser(value_parser!(PathBuf)).help("The folder to write into; made if it is missing"),
        flags::path("models", "DIR", "Where the papers' models lie"),
        flags::valued(
            "size",
            "WxH",
            format!("Width and height of the pictures [at least {SMALLEST}; default: 1600x1200]"),
        ),
        flags::truth_rays(),
        flags::valued("runs", "N", "Counted runs of what is timed [1 to 1000; default: 3]"),
        flags::backend_argument(),
    ];
    Command::new("paper").about("Regenerate the papers' pictures, tables and claims").args(own).after_help(EXPLANATION)
}

/// Measures and renders everything, and writes the page.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let models = matches.get_one::<PathBuf>("models").cloned();
    let size = flags::read_size(matches)?;
    if size.0 < 64 || size.1 < 48 {
        return Err(Error::Usage(format!("--size {}x{}: the report needs at least {SMALLEST}", size.0, size.1)));
    }
    let rays = flags::read_truth_rays(matches)?;
    let runs = flags::read_runs(matches, 3)?;
    let backend = flags::read_backend(matches)?;
    if let Some(models) = models.as_ref().filter(|models| !models.is_dir()) {
        return Err(Error::Usage(format!("--models {}: no such folder", models.display())));
    }
    {
        // Gone again at once, so that an interrupt in the minutes to come leaves no empty folder.
        let _rehearsal = MadeFolder::ensure(&output)?;
        Outputs::check([output.join(PAGE), output.join(FIGURES)])?;
    }

    let start = Instant::now();
    let context = Context::open(backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    check_size(gl, size.0, size.1)?;
    let lab = Lab::open(gl, size, rays, models.as_deref())?;
    lab.missing.iter().for_each(|line| say(line));

    let progress = bar(Tables::frames(&lab, runs) as u64, "frames timed");
    let tables = Tables::measure(&lab, runs, || progress.inc(1))?;
    progress.finish_and_clear();
    let tests: Vec<claims::Test> = claims::all().collect();
    let progress = bar((figures::ALL.len() + tests.len()) as u64, "figures and claims");
    let mut report = Report {
        about: Vec::new(),
        missing: lab.missing.iter().cloned().chain([DIAGRAMS.into()]).collect(),
        claims: Vec::new(),
        measures: tables.figures()?,
        figures: Vec::new(),
    };
    for test in tests {
        report.claims.push(test(&lab, &tables)?);
        progress.inc(1);
    }
    for make in figures::ALL {
        report.figures.push(make(&lab)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    if let Some(line) = lab.noise_is_much(&tables) {
        say(&line);
        report.missing.push(line);
    }
    if size.0 * size.1 < 1_000_000 {
        report.missing.push(format!(
            "What {}x{} pixels are too few for: where a step falls below a texel the chapter exits early, and far surfaces are \
             open. 1600x1200 is the papers' size",
            size.0, size.1
        ));
    }
    // SAFETY: the context is current on this thread, and these are core parameters.
    let (renderer, version) =
        unsafe { (gl.get_parameter_string(glow::RENDERER), gl.get_parameter_string(glow::VERSION)) };
    report.about = vec![
        ("program", format!("hbao {}", env!("CARGO_PKG_VERSION"))),
        ("renderer", renderer.clone()),
        ("OpenGL", version),
        ("size", format!("{}x{}", size.0, size.1)),
        ("rays a pixel of the truth", rays.to_string()),
        ("noise of the claims' truths", format!("at most {:.4} RMS", lab.noise())),
        ("took", format!("{:.0} s", start.elapsed().as_secs_f64())),
    ];

    let made = MadeFolder::ensure(&output)?;
    let mut outputs = Outputs::new();
    for figure in report.measures.iter().chain(&report.figures) {
        figure.pictures.iter().try_for_each(|picture| outputs.stage(output.join(&picture.file), &picture.png))?;
        figure
            .drawings
            .iter()
            .try_for_each(|drawing| outputs.stage(output.join(&drawing.file), drawing.svg.as_bytes()))?;
    }
    outputs.stage(output.join(FIGURES), format!("{:#}\n", figures_of(&report, &tables, &renderer, size)).as_bytes())?;
    outputs.stage(output.join(PAGE), page::html(&report).as_bytes())?;
    outputs.commit()?;
    made.keep();
    say(&format!("{}: {} claims, {} figures", output.join(PAGE).display(), report.claims.len(), report.figures.len()));
    Ok(())
}

/// What the page says in numbers.
fn figures_of(report: &Report, tables: &Tables, renderer: &str, size: (u32, u32)) -> serde_json::Value {
    let claims = report.claims.iter().map(|claim| {
        let found = claim.found.iter().map(|found| {
            json!({
                "scene": found.scene,
                "value": found.value,
                "text": found.text,
                "verdict": found.verdict.name(),
            })
        });
        json!({
            "id": claim.id,
            "says": claim.says,
            "source": claim.source,
            "rule": claim.rule,
            "note": claim.note,
            "unmeasured": claim.unmeasured.as_ref().filter(|_| claim.found.is_empty()),
            "verdict": claim.verdict().name(),
            "found": found.collect::<Vec<_>>(),
        })
    });
    json!({
        "renderer": renderer,
        "size": [size.0, size.1],
        "missing": report.missing,
        "about": report.about.iter().map(|(name, value)| json!({ "name": name, "value": value })).collect::<Vec<_>>(),
        "claims": claims.collect::<Vec<_>>(),
        "tables": tables.json(),
    })
}
