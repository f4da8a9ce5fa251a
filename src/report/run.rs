//! Makes the report: measures and renders everything, and returns the files to be written.

use super::diagrams::{self, Diagrams};
use super::extremes::{self, Extremes};
use super::figures;
use super::findings;
use super::lab::{Lab, Noise};
use super::machine::machine;
use super::measures::Measures;
use super::page::{Report, html};
use super::{claims, speeds};
use crate::terminal::{bar, say};
use hbao::Error;
use hbao::context::Context;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// The name of the page.
pub(crate) const PAGE: &str = "index.html";
/// The name of the file that holds the page's figures as numbers.
pub(crate) const FIGURES: &str = "report.json";

/// The options of a report.
pub(crate) struct Options {
    /// The folder that holds the papers' models.
    pub(crate) models: Option<PathBuf>,
    /// Width and height of the pictures in pixels.
    pub(crate) size: (u32, u32),
    /// The number of rays per pixel of the ray-traced truth.
    pub(crate) rays: u32,
    /// The number of timed runs of each measurement.
    pub(crate) runs: usize,
}

/// A file of the report.
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// A finished report.
pub(crate) struct Made {
    /// All files, in the order in which they are written.
    pub(crate) files: Vec<File>,
    pub(crate) claims: usize,
    pub(crate) figures: usize,
}

/// Measures and renders everything.
pub(crate) fn make(context: &Context, options: &Options) -> Result<Made, Error> {
    let start = Instant::now();
    let (gl, size, runs) = (context.gl(), options.size, options.runs);
    let lab = Lab::open(gl, size, options.rays, options.models.as_deref())?;
    lab.missing.iter().for_each(|line| say(line));

    let progress = bar(Measures::frames(&lab, runs) as u64, "frames timed");
    let measures = Measures::measure(&lab, runs, || progress.inc(1))?;
    progress.finish_and_clear();
    let tests: Vec<_> = claims::all().collect();
    let progress = bar((figures::ALL.len() + tests.len() + 2) as u64, "figures and claims");
    let mut report = Report {
        about: Vec::new(),
        findings: Vec::new(),
        missing: lab.missing.clone(),
        claims: Vec::new(),
        measures: speeds::figures(&measures)?,
        figures: Vec::new(),
        extremes: Vec::new(),
    };
    for sweep in &measures.sweeps {
        report.measures.push(sweep.figure()?);
    }
    for test in tests {
        report.claims.push(test(&lab, &measures)?);
        progress.inc(1);
    }
    let extremes = extremes::measure(gl)?;
    report.extremes = extremes.figures()?;
    progress.inc(1);
    report.findings = findings::all(&lab, &measures, &report.claims)?;
    progress.inc(1);
    for make in figures::ALL {
        report.figures.push(make(&lab)?);
        progress.inc(1);
    }
    let Diagrams { figures: drawn, missing } = diagrams::draw(&lab)?;
    diagrams::insert(&mut report.figures, drawn);
    report.missing.extend(missing);
    progress.inc(1);
    progress.finish_and_clear();
    if let Some(line) = too_noisy(&lab, &measures) {
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
    report.about = vec![
        ("scenes", lab.data_sets().iter().map(|subject| subject.name.as_str()).collect::<Vec<_>>().join(", ")),
        ("program", format!("hbao {}", env!("CARGO_PKG_VERSION"))),
        ("machine", machine()),
        ("renderer", context.renderer()),
        ("OpenGL", context.version()),
        ("size", format!("{}x{}", size.0, size.1)),
        ("rays a pixel of the truth", options.rays.to_string()),
        ("noise of the claims' truths", format!("at most {:.4} RMS", lab.noise())),
        ("took", format!("{:.0} s", start.elapsed().as_secs_f64())),
    ];
    let numbers = format!("{:#}\n", numbers_of(&report, &measures, &extremes, &context.renderer(), size));
    let (claims, figures, page) = (report.claims.len(), report.figures.len(), html(&report));
    let mut files = Vec::new();
    let findings = report.findings.into_iter().map(|finding| finding.figure);
    for figure in findings.chain(report.figures).chain(report.measures).chain(report.extremes) {
        files.extend(figure.pictures.into_iter().map(|picture| File { name: picture.file, bytes: picture.png }));
        files.extend(figure.drawings.into_iter().map(|drawing| File { name: drawing.file, bytes: drawing.svg.into() }));
    }
    files.extend([(FIGURES, numbers), (PAGE, page)].map(|(name, text)| File { name: name.into(), bytes: text.into() }));
    Ok(Made { files, claims, figures })
}

/// Returns a warning if the noise of a truth is more than a fifth of an error that was measured relative to it.
fn too_noisy(lab: &Lab, measures: &Measures) -> Option<String> {
    let all = measures.noises().chain([lab.noisiest()]);
    let share = |one: &Noise| one.noise / one.error;
    let Noise { noise, error } = all.max_by(|a, b| share(a).total_cmp(&share(b)))?;
    hbao::measure::errors::too_noisy(noise, error).then(|| {
        format!(
            "The truth's noise of {noise:.4} is more than a fifth of an error against it, {error:.4}: give more --truth-rays"
        )
    })
}

/// Returns the numbers of the page as JSON.
fn numbers_of(report: &Report, measures: &Measures, extremes: &Extremes, renderer: &str, size: (u32, u32)) -> Value {
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
        "tables": measures.json(),
        "extremes": extremes.json(),
    })
}
