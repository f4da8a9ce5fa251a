//! A sweep of combinations of settings over one scene: the time and the error of each, and the error decomposed by its
//! causes.

use super::fields::{object, trade_fields};
use super::figure::{Drawing, Figure};
use super::json;
use super::lab::{Lab, Noise};
use super::plot;
use super::subject::Subject;
use super::tables::trade::{Decomposed, decomposed_pixels, parts, sweep};
use hbao::Error;
use hbao::Settings;
use hbao::measure::decomposition::{TruthAt, decompose_all, subset};
use hbao::measure::table::Table;
use hbao::measure::trade::{self, TradeRow};
use hbao::measure::{Shot, TruthImage};
use hbao::reference::truth::Truth;
use hbao::settings::Method;
use serde_json::{Value, json};

/// The largest number of covered pixels on which the error is decomposed.
pub(crate) const DECOMPOSED_PIXELS: usize = 50_000;

/// A sweep over one scene, with its measurements.
pub(super) struct Sweep {
    pub(super) scene: String,
    size: (u32, u32),
    /// The noise of the truth, as a root mean square.
    noise: f64,
    pub(super) key: &'static str,
    rays: u32,
    runs: usize,
    /// The rows, with the fastest first.
    pub(super) rows: Vec<TradeRow>,
    /// The combinations of the chapter's own rows, each with its decomposed error.
    pub(super) parts: Vec<Decomposed>,
    arguments: String,
}

impl Sweep {
    /// Traces the truth, and measures all combinations of the sweep.
    pub(super) fn measure(lab: &Lab, subject: &Subject, runs: usize, progress: impl Fn()) -> Result<Sweep, Error> {
        // The sweep has a quarter of the report's pixels, because all of them are traced.
        let size = lab.small();
        let (width, height) = (size.0 as usize, size.1 as usize);
        let base = subject.settings(Method::Hbao);
        let camera = subject.camera(size)?;
        let pixels: Vec<usize> = (0..width * height).collect();
        let traced = Truth::new(&subject.mesh, &camera, (width, height), &base, lab.rays)?.trace(&pixels, |_| ());
        let truth = TruthImage::new(&traced, size);
        let shot = Shot { mesh: &subject.mesh, camera: &camera, size };
        let mut rows = trade::measure(lab.gl, shot, &truth, &trade::sweep(&base), runs, progress)?;
        rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
        let chapter = trade::chapter(&base);
        let pixels = subset(&truth.covered, DECOMPOSED_PIXELS);
        let visibility: Vec<f64> = pixels.iter().map(|&i| traced.visibility[i]).collect();
        let truth = TruthAt { pixels: &pixels, visibility: &visibility };
        let parts = decompose_all(lab.gl, shot, &chapter, truth, || ())?;
        Ok(Sweep {
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

    /// Returns the settings of the chapter's own rows.
    pub(super) fn chapter(&self) -> impl Iterator<Item = &Settings> {
        self.parts.iter().map(|(settings, _)| settings)
    }

    /// Returns each error that was measured, together with the noise of the truth.
    pub(super) fn noises(&self) -> impl Iterator<Item = Noise> {
        self.rows.iter().map(|row| Noise { noise: self.noise, error: row.errors.rmse })
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "scene": self.scene,
            "size": [self.size.0, self.size.1],
            "noise_rmse": self.noise,
            "rows": self.rows.iter().map(|row| object(trade_fields(row))).collect::<Vec<_>>(),
            "decomposition": self.parts.iter().map(|(s, parts)| json::decomposition(s, parts)).collect::<Vec<_>>(),
        })
    }

    /// Makes the part of the page that shows the sweep.
    pub(super) fn figure(&self) -> Result<Figure, Error> {
        let (width, height) = self.size;
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
            tables: vec![self.errors_table(), self.parts_table()],
            ..Figure::default()
        })
    }

    fn errors_table(&self) -> Table {
        let (width, height) = self.size;
        let mut table = sweep(&self.rows, 3).renamed("MAE", "mean abs.");
        // On the page the star stands in the column of the method's name.
        for row in &mut table.rows {
            row[1] = row[0].clone() + &row[1];
        }
        table
            .without("")
            .captioned(format!("{}, {width}x{height}", self.scene))
            .noted(["Edge RMSE is over the pixels that hold several surfaces.".into()])
    }

    fn parts_table(&self) -> Table {
        let mut table = parts(&self.parts).without("method").renamed("samples", "");
        // All rows have the same method and blur, so the numbers of directions and steps are enough to name them.
        for (row, s) in table.rows.iter_mut().zip(self.chapter()) {
            row[0] = format!("{}/{}{}", s.directions, s.steps, if s.half_res { ", half" } else { "" });
        }
        table.captioned(format!("{}: error taken apart, RMSE and bias", self.scene)).noted([format!(
            "Over {} covered pixels, blur 9x9. Model: the converged method against the truth; sampling: so many directions \
             and steps against it; filtering: after the blur against before; quantisation: 8-bit targets against float. \
             The biases of the parts add up to the whole bias. Their squares, together with the cross term, add up to the \
             square of the whole RMSE.",
            decomposed_pixels(&self.parts)
        )])
    }
}
