//! Measures everything that the report times: the papers' tables on their church, and a sweep of settings on every data
//! set.

use super::json;
use super::lab::{Lab, Noise};
use super::subject::Subject;
use super::sweep::Sweep;
use hbao::measure::bench::{Case, Measurement, crysis, figure1, measure, scaling, table};
use hbao::measure::ratios::{Ratio, ratios};
use hbao::measure::trade;
use hbao::settings::Method;
use hbao::{Error, Settings, size_limit};
use serde_json::{Value, json};

/// The results of the timing and of the sweeps.
pub(super) struct Measures {
    /// The scene that was timed.
    pub(super) scene: String,
    /// The scene and its camera as arguments of the command line.
    pub(super) arguments: String,
    pub(super) size: (u32, u32),
    pub(super) runs: usize,
    pub(super) cases: Vec<Measurement>,
    pub(super) ratios: Vec<Ratio>,
    pub(super) sweeps: Vec<Sweep>,
}

/// Returns the cases, in groups. The cases of a group are measured in interleaved rounds.
fn groups(lab: &Lab, subject: &Subject) -> [Vec<Case>; 4] {
    let base = subject.settings(Method::Hbao);
    let largest = size_limit(lab.gl);
    let mut groups = [
        table(&base, lab.size),
        figure1(&base, lab.size),
        crysis(&base),
        scaling(&base, lab.size, subject.mesh.triangles.len()),
    ];
    for cases in &mut groups {
        cases.retain(|case| case.size.0.max(case.size.1) <= largest);
    }
    groups
}

impl Measures {
    /// Returns how many frames [`Measures::measure`] will render.
    pub(super) fn frames(lab: &Lab, runs: usize) -> usize {
        let cases: usize = groups(lab, lab.church()).iter().map(Vec::len).sum();
        let sweep = trade::sweep(&Settings::default()).len();
        (cases + lab.data_sets().len() * sweep) * (runs + 1)
    }

    /// Measures everything. `progress` is called after each frame.
    pub(super) fn measure(lab: &Lab, runs: usize, progress: impl Fn()) -> Result<Measures, Error> {
        let church = lab.church();
        let mut cases = Vec::new();
        for group in groups(lab, church) {
            cases.extend(measure(lab.gl, &church.mesh, &church.view, &group, runs, &progress)?);
        }
        let sweeps = lab.data_sets().into_iter().map(|subject| Sweep::measure(lab, subject, runs, &progress));
        Ok(Measures {
            scene: church.name.clone(),
            arguments: church.arguments.clone().unwrap_or_default(),
            size: lab.size,
            runs,
            ratios: ratios(&cases),
            sweeps: sweeps.collect::<Result<_, _>>()?,
            cases,
        })
    }

    /// Returns the measurement of the case with this mode and column.
    pub(super) fn of_case(&self, mode: &str, column: &str) -> Option<&Measurement> {
        self.cases.iter().find(|one| one.case.mode == mode && one.case.column == column)
    }

    /// Returns each error that a sweep measured, together with the noise of the truth.
    pub(super) fn noises(&self) -> impl Iterator<Item = Noise> {
        self.sweeps.iter().flat_map(Sweep::noises)
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "scene": self.scene,
            "runs": self.runs,
            "rows": self.cases.iter().map(json::measurement).collect::<Vec<_>>(),
            "ratios": self.ratios.iter().map(json::ratio).collect::<Vec<_>>(),
            "trades": self.sweeps.iter().map(Sweep::json).collect::<Vec<_>>(),
        })
    }
}
