//! The settings that a search considered, and why each of them lost or won.

use super::choice::{Goal, Measured};
use crate::measure::errors::Errors;
use crate::measure::median;
use crate::settings::Settings;

/// Why settings lost, or that they won.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// There is no verdict yet: the search is under way.
    Open,
    /// They are the answer.
    Best,
    /// They were not rendered: every step is below a texel, where A = 1 as without a method.
    StepsBelowTexel,
    /// They were not rendered: a 16-bit depth does not hold both the near and the far plane.
    DepthFormat,
    /// They were not rendered: they take more work than settings that reach the error, or that take far longer than the
    /// time.
    MoreWork,
    /// The driver refuses them.
    Refused,
    /// Their error is above the limit.
    TooInaccurate,
    /// Others are as accurate with less work, and differ in counts alone.
    NoGain,
    /// The error is reached without wider formats.
    WiderThanNeeded,
    /// Their time is above the limit.
    TooSlow,
    /// They are as good as the answer, and slower.
    Slower,
    /// They are less accurate than the answer, and no faster beyond noise.
    LessAccurate,
}

impl Verdict {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Open => "open",
            Verdict::Best => "best",
            Verdict::StepsBelowTexel => "steps-below-texel",
            Verdict::DepthFormat => "depth-format",
            Verdict::MoreWork => "more-work",
            Verdict::Refused => "refused",
            Verdict::TooInaccurate => "too-inaccurate",
            Verdict::NoGain => "no-gain",
            Verdict::WiderThanNeeded => "wider-than-needed",
            Verdict::TooSlow => "too-slow",
            Verdict::Slower => "slower",
            Verdict::LessAccurate => "less-accurate",
        }
    }
}

/// Settings that were considered.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The settings.
    pub settings: Settings,
    /// The shorter of two runs in a row, in milliseconds; none where they could not win.
    pub rough_ms: Option<f64>,
    /// Interleaved runs, in milliseconds; empty where they were no contender.
    pub times: Vec<f64>,
    /// The errors against the truth; none where they were not rendered. Contenders alone have FLIP.
    pub errors: Option<Errors>,
    /// Why they lost or won.
    pub verdict: Verdict,
}

impl Tried {
    /// Settings that were neither rendered nor timed so far.
    pub(super) fn new(settings: Settings, verdict: Verdict) -> Tried {
        Tried { settings, rough_ms: None, times: Vec::new(), errors: None, verdict }
    }

    /// Milliseconds: the median of the interleaved runs, else the rough time.
    pub fn ms(&self) -> Option<f64> {
        if self.times.is_empty() { self.rough_ms } else { Some(median(&self.times)) }
    }

    /// The RMSE.
    pub fn rmse(&self) -> Option<f64> {
        self.errors.map(|errors| errors.rmse)
    }

    /// What the final choice is made by; none where there are no interleaved runs.
    pub(super) fn measured(&self) -> Option<Measured> {
        let mut sorted = self.times.clone();
        sorted.sort_by(f64::total_cmp);
        let upper_ms = *sorted.get((3 * sorted.len()).div_ceil(4).checked_sub(1)?)?;
        Some(Measured { rmse: self.rmse()?, ms: median(&self.times), upper_ms })
    }

    /// The limited quantity as a share of its limit; none for settings that cannot win.
    pub(super) fn share(&self, goal: Goal) -> Option<f64> {
        let ms = if matches!(goal, Goal::MaxError(_)) { 0.0 } else { self.ms()? };
        Some(goal.share(ms, self.rmse()?)).filter(|_| self.verdict == Verdict::Open)
    }
}

/// What a search found.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// All settings that were considered, in their order.
    pub tried: Vec<Tried>,
    /// The answer's index, if there is an answer.
    pub best: Option<usize>,
}

impl Tuned {
    /// The answer, and then those of the timed settings that came nearest to it: those that would have won with the
    /// least change of the limited quantity and of the one to be minimised, both as factors.
    pub fn nearest(&self, goal: Goal, count: usize) -> Vec<usize> {
        let measured = |i: usize| Some((self.tried[i].ms()?, self.tried[i].rmse()?));
        let Some((best, (ms, rmse))) = self.best.and_then(|i| Some((i, measured(i)?))) else { return Vec::new() };
        let least = goal.sought(ms, rmse).max(1e-9);
        let excess = |(ms, rmse)| goal.share(ms, rmse).max(1.0) * (goal.sought(ms, rmse) / least).max(1.0);
        let others = (0..self.tried.len()).filter(|&i| i != best);
        let mut others: Vec<(usize, f64)> = others.filter_map(|i| Some((i, excess(measured(i)?)))).collect();
        others.sort_by(|a, b| a.1.total_cmp(&b.1));
        [best].into_iter().chain(others.into_iter().map(|(i, _)| i)).take(count).collect()
    }
}

/// Gives all settings that were rendered their final verdict.
pub(super) fn decide(all: &mut [Tried], goal: Goal, best: Option<usize>) {
    let open = all.iter().filter(|tried| tried.verdict == Verdict::Open);
    let meeting = open.filter_map(Tried::measured).filter(|one| goal.share(one.ms, one.rmse) <= 1.0);
    let fastest = meeting.min_by(|a, b| a.ms.total_cmp(&b.ms)).map_or(0.0, |one| one.upper_ms);
    let least = best.and_then(|i| all[i].rmse()).unwrap_or(0.0);
    for (i, tried) in all.iter_mut().enumerate() {
        let (Some(rmse), Verdict::Open | Verdict::NoGain) = (tried.rmse(), tried.verdict) else { continue };
        let ms = tried.ms();
        tried.verdict = match goal {
            _ if best == Some(i) => Verdict::Best,
            Goal::MaxError(limit) if rmse > limit => Verdict::TooInaccurate,
            _ if tried.verdict == Verdict::NoGain => Verdict::NoGain,
            Goal::MaxError(_) if !tried.times.is_empty() && ms.is_some_and(|ms| ms <= fastest) => {
                if rmse > least {
                    Verdict::LessAccurate
                } else {
                    Verdict::Slower
                }
            }
            Goal::MaxError(_) => Verdict::Slower,
            Goal::MaxMs(limit) if ms.is_some_and(|ms| ms > limit) => Verdict::TooSlow,
            Goal::MaxMs(_) if rmse > least => Verdict::LessAccurate,
            Goal::MaxMs(_) => Verdict::Slower,
        };
    }
}
