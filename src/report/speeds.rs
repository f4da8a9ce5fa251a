//! Makes the parts of the page on speed: the papers' tables measured again, ratios of times, and how costs grow.

use super::drawing::{self, Axes};
use super::figure::{Drawing, Figure};
use super::measures::Measures;
use super::tables::bench::{self, Times, growths, of_series};
use super::tables::cells::number;
use hbao::Error;
use hbao::measure::bench::Measurement;
use hbao::measure::median;
use hbao::measure::published::{CRYSIS_MS, CRYSIS_SIZE, TABLE_SIZE};

/// Makes the parts on speed, in the order of the page.
pub(super) fn figures(measures: &Measures) -> Result<Vec<Figure>, Error> {
    let tables = [frames, methods, crysis, ratios].map(|make| make(measures));
    Ok(tables.into_iter().chain([scaling(measures)?]).collect())
}

/// Returns the command line that measures one part of the bench.
fn command(measures: &Measures, part: &str) -> String {
    let Measures { arguments, size: (width, height), runs, .. } = measures;
    format!("hbao bench {arguments} --size {width}x{height} --only {part} --runs {runs}")
}

fn frames(measures: &Measures) -> Figure {
    let Measures { scene, size: (width, height), runs, cases, .. } = measures;
    let fewer = cases.iter().find(|one| one.samples != one.case.settings.msaa);
    let fewer = fewer
        .map(|one| format!("Of {} depth samples a pixel the driver gave {}.", one.case.settings.msaa, one.samples));
    let rates = bench::frame_rates(cases)
        .captioned(format!("Here: {scene}, {width}x{height}, frames per second"))
        .noted([command(measures, "table")].into_iter().chain(fewer));
    let published = bench::published_frames()
        .captioned(format!("2008: Sibenik, {}x{}, frames per second", TABLE_SIZE.0, TABLE_SIZE.1));
    let times = bench::frame_times(cases)
        .captioned(format!("Here: milliseconds, the median of {runs} runs and the farthest from it"));
    Figure {
        id: "table-6.2.1".into(),
        title: "Table 6.2.1: frames per second".into(),
        text: "Whole frames with a blur of 9x9: without ambient occlusion and blur, with the blur over A = 1, and with so \
               many directions of so many steps."
            .into(),
        tables: vec![rates, published, times],
        ..Figure::default()
    }
}

fn methods(measures: &Measures) -> Figure {
    let Measures { scene, size: (width, height), .. } = measures;
    Figure {
        id: "speeds".into(),
        title: "Each method's pass, and Figure 1 of the talk".into(),
        text: "The ambient occlusion pass alone, one sample a pixel. Its floor is the same shader with every fetch of depth, \
               in which the arithmetic after each is replaced by a sum."
            .into(),
        tables: vec![
            bench::methods(&measures.cases)
                .without("ns/fetch")
                .renamed("AO/floor", "AO / floor")
                .captioned(format!("{scene}, {width}x{height}"))
                .noted([bench::disagreement(), command(measures, "figure1")]),
        ],
        ..Figure::default()
    }
}

fn crysis(measures: &Measures) -> Figure {
    let mut table = bench::crysis(&measures.cases)
        .renamed("AO, ms", "AO")
        .renamed("blur, ms", "blur")
        .renamed("both, ms", "both")
        .captioned(format!("{}, {}x{}, milliseconds", measures.scene, CRYSIS_SIZE.0, CRYSIS_SIZE.1))
        .noted([command(measures, "crysis")]);
    table.rows.push(vec!["2008, GeForce 8800 GTX".into(), String::new(), String::new(), number(CRYSIS_MS, 0)]);
    Figure {
        id: "crysis".into(),
        title: "Crysis at 1280x720".into(),
        text: "16 samples and their 4x4 blur, as in the paper; with depth at half size, and with mirrored offsets."
            .into(),
        tables: vec![table],
        ..Figure::default()
    }
}

fn ratios(measures: &Measures) -> Figure {
    Figure {
        id: "ratios".into(),
        title: "Ratios of times, here and in 2008".into(),
        text: "What one thing costs relative to another. In the papers AO is a frame less that without it.".into(),
        tables: vec![
            bench::ratios(&measures.ratios).renamed("ratio of times", "ratio").captioned(measures.scene.clone()),
        ],
        ..Figure::default()
    }
}

/// The name of a line of a drawing, and the times that it shows.
const LINES: [(&str, Times); 4] = [
    ("AO", |one| &one.ao_ms),
    ("its fetch floor", |one| &one.floor_ms),
    ("blur", |one| &one.blur_ms),
    ("G-buffer", |one| &one.gbuffer_ms),
];

fn scaling(measures: &Measures) -> Result<Figure, Error> {
    let (mut drawings, mut tables) = (Vec::new(), Vec::new());
    let growths = growths(&measures.cases);
    for (series, x) in
        [("pixels", "pixels of the image"), ("samples", "samples a pixel"), ("triangles", "triangles of the surface")]
    {
        let cases: Vec<&Measurement> = of_series(&measures.cases, series).collect();
        let line = |(name, times): (&str, Times)| {
            let points: Vec<_> = cases.iter().map(|one| (one.along(), median(times(one)))).collect();
            let drawn = !points.is_empty() && points.iter().all(|point| point.1 > 0.0);
            drawn.then(|| (name.to_string(), points))
        };
        let lines: Vec<_> = LINES.into_iter().filter_map(line).collect();
        if !lines.is_empty() {
            let growths = growths.iter().filter(|growth| growth.series == series);
            let powers = growths.filter_map(|growth| Some(format!("{}: {:.2}", growth.of, growth.exponent?)));
            let axes = Axes { x, y: "milliseconds", logarithmic: true };
            drawings.push(Drawing {
                file: format!("scaling-{series}.svg"),
                caption: format!("Powers of {x} fitted: {}", powers.collect::<Vec<_>>().join(", ")),
                svg: drawing::lines(&lines, &axes)?,
            });
        }
        let table = bench::series(&measures.cases, series).renamed(series, "").renamed("ns/sample", "ns a sample");
        tables.push(table.captioned(x));
    }
    Ok(Figure {
        id: "scaling".into(),
        title: "How costs grow".into(),
        text: format!(
            "{}, hbao with a blur of 9x9. Triangles are the same surface, every triangle cut in four, repeatedly. {}",
            measures.scene,
            command(measures, "scaling")
        ),
        drawings,
        tables,
        ..Figure::default()
    })
}
