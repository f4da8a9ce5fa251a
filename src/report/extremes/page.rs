//! Makes the part of the page on numbers at their extremes, and its JSON.

use super::axes::{AXES, Axis};
use super::cases::{EYE, FOV_Y, RADIUS, SIZE, SMALL, TARGET};
use super::measured::{Extreme, Extremes, Floor, Gaps, LOUDER};
use crate::report::drawing::{self, Axes, Series};
use crate::report::figure::{Drawing, Figure};
use hbao::Error;
use hbao::measure::precision::{Precision, Spread};
use hbao::measure::table::Table;
use serde_json::{Value, json};

/// Formats a number that may be very small, in scientific notation.
fn tiny(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
}

/// The headings of the tables of cases.
const HEADINGS: [&str; 12] = [
    "",
    "pixels",
    "depth, 99.9 %",
    "normals, degrees, 99.9 %",
    "AO arithmetic, max",
    "ambiguous",
    "AO end to end, RMSE",
    "99.9 %",
    "max",
    "ambiguous",
    "shown, RMSE",
    "max",
];

fn cells(extreme: &Extreme) -> Vec<String> {
    let mut cells = vec![extreme.name.clone()];
    match &extreme.found {
        Err(why) => cells.push(format!("refused: {why}")),
        Ok(p) => cells.extend([
            p.covered.to_string(),
            tiny(p.depth.most),
            tiny(p.normals.most),
            tiny(p.arithmetic.max),
            p.ambiguous.to_string(),
            tiny(p.whole.rmse),
            tiny(p.whole.most),
            tiny(p.whole.max),
            p.whole_ambiguous.to_string(),
            tiny(p.shown.rmse),
            tiny(p.shown.max),
        ]),
    }
    cells
}

fn case_json(extreme: &Extreme) -> Value {
    let spread = |s: &Spread| json!({ "rmse": s.rmse, "most": s.most, "max": s.max, "pixels": s.pixels });
    match &extreme.found {
        Err(why) => json!({ "axis": extreme.axis, "case": extreme.name, "refused": why }),
        Ok(p) => json!({
            "axis": extreme.axis,
            "case": extreme.name,
            "along": extreme.along,
            "covered": p.covered,
            "beside": p.beside,
            "depth": spread(&p.depth),
            "normals": spread(&p.normals),
            "arithmetic": spread(&p.arithmetic),
            "ambiguous": p.ambiguous,
            "whole": spread(&p.whole),
            "whole_ambiguous": p.whole_ambiguous,
            "shown": spread(&p.shown),
        }),
    }
}

impl Extremes {
    pub(in crate::report) fn json(&self) -> Value {
        let gaps = self.gaps.iter().map(|Gaps { orthographic, near_far, at: [near, middle, far] }| {
            json!({ "orthographic": orthographic, "near_far": near_far, "near": near, "middle": middle, "far": far })
        });
        let floors = self.floors.iter().map(
            |Floor { formats, bias, mean, max }| json!({ "formats": formats, "bias": bias, "mean": mean, "max": max }),
        );
        json!({
            "size": [SIZE.0, SIZE.1],
            "view": { "eye": EYE.to_array(), "target": TARGET.to_array(), "fov_y": FOV_Y, "radius": RADIUS },
            "rows": self.cases.iter().map(case_json).collect::<Vec<_>>(),
            "told_apart": gaps.collect::<Vec<_>>(),
            "floor": floors.collect::<Vec<_>>(),
        })
    }

    /// Makes the part of the page on extremes.
    pub(in crate::report) fn figures(&self) -> Result<Vec<Figure>, Error> {
        let mut tables = Vec::new();
        for Axis { name, title, note } in AXES {
            let rows = self.cases.iter().filter(|case| case.axis == name).map(cells);
            tables.push(Table::headed(HEADINGS).captioned(title).filled(rows).noted([note.into()]));
        }
        tables.insert(1, self.gap_table());
        tables.push(self.floor_table());
        let line = |of: fn(&Precision) -> f64, wanted: &dyn Fn(&Extreme) -> bool| {
            let points = self.cases.iter().filter(|case| case.axis == "distance" && wanted(case));
            points
                .filter_map(|case| case.found.as_ref().ok().map(|p| (case.along, of(p))))
                .filter(|point| point.1 > 0.0)
                .collect::<Vec<_>>()
        };
        let parallel = |case: &Extreme| case.name.ends_with("orthographic");
        let series: Vec<Series> = vec![
            ("AO end to end, orthographic".into(), line(|p| p.whole.most, &parallel)),
            ("AO end to end, perspective".into(), line(|p| p.whole.most, &|case| !parallel(case))),
            ("AO arithmetic alone, orthographic".into(), line(|p| p.arithmetic.most, &parallel)),
        ];
        let axes = Axes { x: "distance from the eye, in R", y: "what 99.9 % of the pixels keep", logarithmic: true };
        Ok(vec![Figure {
            id: "extremes".into(),
            title: "Numbers at their extremes".into(),
            text: format!(
                "Each pass against the same equations in float64, over covered pixels of {}x{} ({}x{} for the counts of samples): depth \
                 relative to that of a ray, normals in degrees, ambient occlusion on the GPU's own depth and normals (its \
                 arithmetic alone), on what rays meet in float64 (end to end), and after the blur (shown). Pixels where a shift of \
                 1e-5 decides otherwise are counted apart, and are in what is shown. The Cornell box from {EYE} to {TARGET}, \
                 {FOV_Y} degrees, R = {RADIUS}, unless said.",
                SIZE.0, SIZE.1, SMALL.0, SMALL.1
            ),
            tables,
            drawings: vec![Drawing {
                file: "extremes-distance.svg".into(),
                caption: "Ambient occlusion against distance".into(),
                svg: drawing::lines(&series, &axes)?,
            }],
            pictures: self.pictures.clone(),
        }])
    }

    fn gap_table(&self) -> Table {
        let rows = self.gaps.iter().map(|Gaps { orthographic, near_far, at }| {
            let kind = if *orthographic { "orthographic" } else { "perspective" };
            [format!("{near_far:e}, {kind}")].into_iter().chain(at.map(tiny)).collect()
        });
        Table::headed(["near / far", "at 1.3 near", "at sqrt(near far)", "at 0.7 far"])
            .captioned(
                "Surfaces one behind the other: the largest gap, relative to their depth, that is not told apart",
            )
            .filled(rows)
            .noted([
                "The view is drawn in slices of depth, each with a far end at most 100 times as far as its near one, \
                     orthographic views too."
                    .into(),
            ])
    }

    fn floor_table(&self) -> Table {
        let mut biases: Vec<f64> = self.floors.iter().map(|floor| floor.bias).collect();
        biases.dedup();
        let formats = self.floors.iter().take_while(|floor| floor.bias == 0.0).map(|floor| floor.formats);
        let cell = |formats: &str, bias: f64| {
            let found = self.floors.iter().find(|floor| floor.formats == formats && floor.bias == bias);
            found.map_or(String::new(), |floor| format!("{}, {}", tiny(floor.mean), tiny(floor.max)))
        };
        let rows = formats.map(|formats| {
            [formats.to_string()].into_iter().chain(biases.iter().map(|&bias| cell(formats, bias))).collect()
        });
        let headings = ["depth, normals".into()].into_iter().chain(biases.iter().map(|b| format!("{b} degrees")));
        Table::headed(headings)
            .captioned("False occlusion of a floor, which is open: mean and largest 1 - A, by angle bias")
            .filled(rows)
            .noted([format!(
                "R is 1, the eye 10 away. Biased RGBA8 is what a driver gets that renders neither signed format: computed by the \
                 twin. In the pictures what is missing to 1 is {LOUDER} times as dark."
            )])
    }
}
