//! The papers' tables measured again, and the trade of error against time.

use super::drawing::{self, Axes};
use super::lab::{Lab, Subject};
use super::page::{Drawing, Figure, Table};
use crate::cli::bench::{self, exponents, mode_in_words, number, samples_of, size_of, with_spread};
use crate::cli::{plot, trade as trade_verb};
use hbao::image::Image;
use hbao::measure::bench::{Case, Row, crysis, figure1, measure, scaling, table};
use hbao::measure::decomposition::{Decomposition, Part, decompose_all, subset};
use hbao::measure::published::{COLUMNS, CRYSIS_MS, CRYSIS_SIZE, TABLE_6_2_1, TABLE_SIZE, figure_1};
use hbao::measure::ratios::{Ratio, ratios};
use hbao::measure::{median, trade};
use hbao::reference::truth::Truth;
use hbao::settings::Method;
use hbao::{Error, Settings, size_limit};
use serde_json::{Value, json};

/// A sweep over one scene.
pub(super) struct Trade {
    pub(super) scene: String,
    pub(super) size: (u32, u32),
    pub(super) noise: f64,
    key: &'static str,
    rays: u32,
    runs: usize,
    /// The fastest first.
    pub(super) rows: Vec<trade::Row>,
    /// The chapter's own rows taken apart.
    parts: Vec<(Settings, Decomposition)>,
    arguments: String,
}

/// What was timed and swept.
pub(super) struct Tables {
    /// The scene of [`Tables::rows`].
    scene: String,
    arguments: String,
    size: (u32, u32),
    runs: usize,
    pub(super) rows: Vec<Row>,
    pub(super) ratios: Vec<Ratio>,
    pub(super) trades: Vec<Trade>,
}

/// What is measured, in turns by part.
fn parts(lab: &Lab, subject: &Subject) -> [Vec<Case>; 4] {
    let base = subject.settings(Method::Hbao);
    let largest = size_limit(lab.gl);
    let mut parts = [
        table(&base, lab.size),
        figure1(&base, lab.size),
        crysis(&base),
        scaling(&base, lab.size, subject.mesh.triangles.len()),
    ];
    for cases in &mut parts {
        cases.retain(|case| case.size.0.max(case.size.1) <= largest);
    }
    parts
}

impl Tables {
    /// How many frames [`Tables::measure`] will render.
    pub(super) fn frames(lab: &Lab, runs: usize) -> usize {
        let cases: usize = parts(lab, lab.church()).iter().map(Vec::len).sum();
        let sweep = trade::sweep(&Settings::default()).len();
        (cases + lab.data_sets().len() * sweep) * (runs + 1)
    }

    /// Measures all: the papers' tables on their church, the trade on every data set.
    pub(super) fn measure(lab: &Lab, runs: usize, progress: impl Fn()) -> Result<Tables, Error> {
        let church = lab.church();
        let mut rows = Vec::new();
        for cases in parts(lab, church) {
            rows.extend(measure(lab.gl, (&church.mesh, &church.view), &cases, runs, &progress)?);
        }
        let trades = lab.data_sets().into_iter().map(|subject| Trade::measure(lab, subject, runs, &progress));
        Ok(Tables {
            scene: church.name.clone(),
            arguments: church.arguments.clone().unwrap_or_default(),
            size: lab.size,
            runs,
            ratios: ratios(&rows),
            trades: trades.collect::<Result<_, _>>()?,
            rows,
        })
    }

    /// The scene that was timed.
    pub(super) fn scene(&self) -> &str {
        &self.scene
    }

    /// The row of a mode and column.
    pub(super) fn row(&self, mode: &str, column: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.case.mode == mode && row.case.column == column)
    }

    /// Everything in numbers.
    pub(super) fn json(&self) -> Value {
        let trades = self.trades.iter().map(|swept| {
            json!({
                "scene": swept.scene,
                "size": [swept.size.0, swept.size.1],
                "noise_rmse": swept.noise,
                "rows": swept.rows.iter().map(trade_verb::as_json).collect::<Vec<_>>(),
                "decomposition": swept.parts.iter().map(|(s, parts)| trade_verb::parts_as_json(s, parts)).collect::<Vec<_>>(),
            })
        });
        json!({
            "scene": self.scene,
            "runs": self.runs,
            "rows": self.rows.iter().map(bench::as_json).collect::<Vec<_>>(),
            "ratios": self.ratios.iter().map(bench::ratio_as_json).collect::<Vec<_>>(),
            "trades": trades.collect::<Vec<_>>(),
        })
    }

    /// As parts of the page.
    pub(super) fn figures(&self) -> Result<Vec<Figure>, Error> {
        let mut figures = vec![self.frames_table(), self.methods_table(), self.crysis_table(), self.ratio_table()];
        figures.push(self.scaling_figure()?);
        for swept in &self.trades {
            figures.push(swept.figure()?);
        }
        Ok(figures)
    }

    fn command(&self, part: &str) -> String {
        let (width, height) = self.size;
        format!("hbao bench {} --size {width}x{height} --only {part} --runs {}", self.arguments, self.runs)
    }

    fn of_mode(&self, mode: &str) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(move |row| row.case.mode == mode)
    }

    fn frames_table(&self) -> Figure {
        let head: Vec<String> = [""].into_iter().chain(COLUMNS).map(String::from).collect();
        let (mut here, mut parts) = (Vec::new(), Vec::new());
        for mode in ["half", "msaa1", "msaa4"] {
            let name = mode_in_words(mode);
            let row = |what: &str, cell: &dyn Fn(&Row) -> String| {
                let cells = COLUMNS.iter().map(|column| self.row(mode, column).map_or("-".into(), cell));
                [format!("{name}{what}")].into_iter().chain(cells).collect::<Vec<_>>()
            };
            here.push(row("", &|row| number(row.fps(), 2)));
            parts.push(row(", frame", &|row| with_spread(&row.frame_ms)));
            parts.push(row(", AO", &|row| with_spread(&row.ao_ms)));
            parts.push(row(", its fetch floor", &|row| with_spread(&row.floor_ms)));
            parts.push(row(", blur", &|row| with_spread(&row.blur_ms)));
            parts.push(row(", compiling", &|row| number(row.compile_ms, 0)));
        }
        let then = TABLE_6_2_1.iter().map(|row| {
            let name = format!("{}, {}", mode_in_words(row.mode), row.card);
            [name].into_iter().chain(row.fps.iter().map(f64::to_string)).collect::<Vec<_>>()
        });
        let (width, height) = self.size;
        let mut notes = vec![self.command("table")];
        notes.extend(self.rows.iter().filter(|row| row.samples != row.case.settings.msaa).take(1).map(|row| {
            format!("Of {} depth samples a pixel the driver gave {}.", row.case.settings.msaa, row.samples)
        }));
        Figure {
            id: "table-6.2.1".into(),
            title: "Table 6.2.1: frames per second".into(),
            text: "Whole frames with a blur of 9x9: without ambient occlusion and blur, with the blur over A = 1, and with so \
                   many directions of so many steps."
                .into(),
            tables: vec![
                Table {
                    caption: format!("Here: {}, {width}x{height}, frames per second", self.scene),
                    head: head.clone(),
                    rows: here,
                    notes,
                },
                Table {
                    caption: format!("2008: Sibenik, {}x{}, frames per second", TABLE_SIZE.0, TABLE_SIZE.1),
                    head: head.clone(),
                    rows: then.collect(),
                    notes: Vec::new(),
                },
                Table {
                    caption: format!("Here: milliseconds, the median of {} runs and the farthest from it", self.runs),
                    head,
                    rows: parts,
                    notes: Vec::new(),
                },
            ],
            ..Figure::default()
        }
    }

    fn methods_table(&self) -> Figure {
        let rows = self.of_mode("figure1").map(|row| {
            let method = row.case.method();
            vec![
                method.name().into(),
                samples_of(&row.case),
                number(row.mpixels_per_s(), 2),
                figure_1(method).map_or(String::new(), |then| number(then, 0)),
                with_spread(&row.ao_ms),
                with_spread(&row.floor_ms),
                number(row.ao_to_floor(), 2),
                number(row.compile_ms, 0),
            ]
        });
        let heads = ["method", "samples", "MPixels/s", "2008", "AO, ms", "floor, ms", "AO / floor", "compiling, ms"];
        Figure {
            id: "speeds".into(),
            title: "Each method's pass, and Figure 1 of the talk".into(),
            text: "The ambient occlusion pass alone, one sample a pixel. Its floor is the same shader with every fetch of depth, \
                   in which the arithmetic after each is replaced by a sum."
                .into(),
            tables: vec![Table {
                caption: format!("{}, {}x{}", self.scene, self.size.0, self.size.1),
                head: heads.map(String::from).into(),
                rows: rows.collect(),
                notes: vec![bench::disagreement(), self.command("figure1")],
            }],
            ..Figure::default()
        }
    }

    fn crysis_table(&self) -> Figure {
        let mut rows: Vec<Vec<String>> = self
            .of_mode("crysis")
            .map(|row| {
                let both = median(&row.ao_ms) + median(&row.blur_ms);
                let [ao, blur] = [&row.ao_ms, &row.blur_ms].map(|times| with_spread(times));
                vec![row.case.column.into(), ao, blur, number(both, 2)]
            })
            .collect();
        rows.push(vec!["2008, GeForce 8800 GTX".into(), String::new(), String::new(), number(CRYSIS_MS, 0)]);
        Figure {
            id: "crysis".into(),
            title: "Crysis at 1280x720".into(),
            text: "16 samples and their 4x4 blur, as in the paper; with depth at half size, and with mirrored offsets."
                .into(),
            tables: vec![Table {
                caption: format!("{}, {}x{}, milliseconds", self.scene, CRYSIS_SIZE.0, CRYSIS_SIZE.1),
                head: ["", "AO", "blur", "both"].map(String::from).into(),
                rows,
                notes: vec![self.command("crysis")],
            }],
            ..Figure::default()
        }
    }

    fn ratio_table(&self) -> Figure {
        let rows = self.ratios.iter().map(|ratio| {
            let papers: Vec<String> = ratio.papers.iter().map(|(card, x)| format!("{card} {x:.2}")).collect();
            vec![ratio.what.into(), number(ratio.ours, 2), papers.join(", ")]
        });
        Figure {
            id: "ratios".into(),
            title: "Ratios of times, here and in 2008".into(),
            text: "What one thing costs relative to another. In the papers AO is a frame less that without it.".into(),
            tables: vec![Table {
                caption: self.scene.clone(),
                head: ["ratio", "here", "2008"].map(String::from).into(),
                rows: rows.collect(),
                notes: Vec::new(),
            }],
            ..Figure::default()
        }
    }

    fn scaling_figure(&self) -> Result<Figure, Error> {
        let (mut drawings, mut tables) = (Vec::new(), Vec::new());
        let exponents = exponents(&self.rows);
        for (series, x) in [
            ("pixels", "pixels of the image"),
            ("samples", "samples a pixel"),
            ("triangles", "triangles of the surface"),
        ] {
            let rows: Vec<&Row> = self.of_mode("scaling").filter(|row| row.case.column == series).collect();
            let line = |name: &str, times: fn(&Row) -> &Vec<f64>| {
                let points: Vec<_> = rows.iter().map(|row| (row.along(), median(times(row)))).collect();
                let drawn = !points.is_empty() && points.iter().all(|point| point.1 > 0.0);
                drawn.then(|| (name.to_string(), points))
            };
            let lines = [
                line("AO", |row| &row.ao_ms),
                line("its fetch floor", |row| &row.floor_ms),
                line("blur", |row| &row.blur_ms),
                line("G-buffer", |row| &row.gbuffer_ms),
            ];
            let powers = exponents.iter().filter(|(known, ..)| *known == series);
            let powers =
                powers.filter_map(|(_, of, power)| Some(format!("{of}: {:.2}", (*power)?))).collect::<Vec<_>>();
            let lines: Vec<_> = lines.into_iter().flatten().collect();
            if !lines.is_empty() {
                let axes = Axes { x, y: "milliseconds", logarithmic: true };
                drawings.push(Drawing {
                    file: format!("scaling-{series}.svg"),
                    caption: format!("Powers of {x} fitted: {}", powers.join(", ")),
                    svg: drawing::lines(&lines, &axes)?,
                });
            }
            tables.push(Table {
                caption: x.into(),
                head: ["", "size", "AO, ms", "ns a sample", "G-buffer, ms", "frame, ms"].map(String::from).into(),
                rows: rows
                    .iter()
                    .map(|row| {
                        vec![
                            number(row.along(), 0),
                            size_of(&row.case),
                            with_spread(&row.ao_ms),
                            number(row.ns_per_sample(&row.ao_ms), 3),
                            with_spread(&row.gbuffer_ms),
                            with_spread(&row.frame_ms),
                        ]
                    })
                    .collect(),
                notes: Vec::new(),
            });
        }
        Ok(Figure {
            id: "scaling".into(),
            title: "How costs grow".into(),
            text: format!(
                "{}, hbao with a blur of 9x9. Triangles are the same surface, every triangle cut in four, repeatedly. {}",
                self.scene,
                self.command("scaling")
            ),
            drawings,
            tables,
            ..Figure::default()
        })
    }
}

impl Trade {
    /// The settings of the chapter's own rows.
    pub(super) fn chapter(&self) -> impl Iterator<Item = &Settings> {
        self.parts.iter().map(|(settings, _)| settings)
    }
    fn measure(lab: &Lab, subject: &Subject, runs: usize, progress: impl Fn()) -> Result<Trade, Error> {
        // A quarter of the pixels: all of them are traced.
        let size = lab.small();
        let (width, height) = (size.0 as usize, size.1 as usize);
        let base = subject.settings(Method::Hbao);
        let camera = subject.camera(size)?;
        let pixels: Vec<usize> = (0..width * height).collect();
        let traced = Truth::new(&subject.mesh, &camera, (width, height), &base, lab.rays)?.trace(&pixels, |_| ());
        let truth = Image { width, height, texels: traced.visibility.iter().map(|&a| a as f32).collect() };
        let covered = Image { width, height, texels: traced.covered.clone() };
        let all = trade::sweep(&base);
        let view = (&*subject.mesh, &camera);
        let mut rows = trade::measure(lab.gl, view, (&truth, &covered), &all, runs, progress)?;
        rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
        let chapter = trade::chapter(&base);
        let pixels = subset(&covered, trade_verb::PIXELS);
        let visibility: Vec<f64> = pixels.iter().map(|&i| traced.visibility[i]).collect();
        let parts = decompose_all(lab.gl, view, size, &chapter, (&pixels, &visibility), || ())?;
        Ok(Trade {
            parts: chapter.into_iter().zip(parts).collect(),
            scene: subject.name.clone(),
            key: subject.key,
            rays: lab.rays,
            runs,
            size,
            noise: traced.noise_rmse,
            rows,
            arguments: subject.arguments.clone().unwrap_or_default(),
        })
    }

    fn figure(&self) -> Result<Figure, Error> {
        let (width, height) = self.size;
        let rows = self.rows.iter().map(|row| {
            let s = &row.settings;
            let flip = row.errors.flip.map_or("-".into(), |flip| format!("{flip:.3}"));
            let star = if row.pareto { "*" } else { "" };
            vec![
                format!("{star}{}", s.method.name()),
                trade_verb::words(s),
                format!("{:.2}", row.ms),
                format!("{:.4}", row.errors.rmse),
                format!("{:.4}", row.errors.mae),
                format!("{:+.4}", row.errors.bias),
                format!("{:.3}", row.errors.max),
                flip,
                row.edge_errors.map_or("-".into(), |edge| format!("{:.4}", edge.rmse)),
            ]
        });
        let heads = ["method", "samples", "ms", "RMSE", "mean abs.", "bias", "max", "FLIP", "edge RMSE"];
        Ok(Figure {
            id: format!("trade-{}", self.key),
            title: format!("Error against time: {}", self.scene),
            text: format!(
                "Ambient occlusion and its blur against ray-traced visibility, whose own noise is {:.4} RMS. A star marks what \
                 nothing else beats in both.",
                self.noise
            ),
            drawings: vec![Drawing {
                file: format!("trade-{}.svg", self.key),
                caption: format!(
                    "hbao trade {} --size {width}x{height} --truth-rays {} --runs {}",
                    self.arguments, self.rays, self.runs
                ),
                svg: plot::trade(&self.rows, &format!("{}, {width}x{height}", self.scene))?,
            }],
            tables: vec![
                Table {
                    caption: format!("{}, {width}x{height}", self.scene),
                    head: heads.map(String::from).into(),
                    rows: rows.collect(),
                    notes: vec!["Edge RMSE is over the pixels that hold several surfaces.".into()],
                },
                self.parts_table(),
            ],
            ..Figure::default()
        })
    }

    fn parts_table(&self) -> Table {
        let rows = self.parts.iter().map(|(s, parts)| {
            let cell = |part: &Part| format!("{:.4} {:+.4}", part.rmse, part.bias);
            vec![
                format!("{}/{}{}", s.directions, s.steps, if s.half_res { ", half" } else { "" }),
                cell(&parts.model),
                cell(&parts.sampling),
                cell(&parts.filtering),
                cell(&parts.quantisation),
                cell(&parts.total),
                format!("{:+.5}", parts.cross),
            ]
        });
        let heads = ["", "model", "sampling", "filtering", "quantisation", "total", "cross"];
        Table {
            caption: format!("{}: error taken apart, RMSE and bias", self.scene),
            head: heads.map(String::from).into(),
            rows: rows.collect(),
            notes: vec![format!(
                "Over {} covered pixels, blur 9x9. Model: the converged method against the truth; sampling: so many directions \
                 and steps against it; filtering: after the blur against before; quantisation: 8-bit targets against float. \
                 Biases add up; squares do with the cross term.",
                self.parts.first().map_or(0, |(_, parts)| parts.pixels)
            )],
        }
    }
}
