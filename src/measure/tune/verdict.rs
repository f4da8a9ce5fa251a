//! The combinations of settings that a search considered, and why each of them won or lost.

use super::choice::{Goal, Measured};
use crate::measure::errors::Errors;
use crate::measure::median;
use crate::settings::Settings;

/// Why a combination lost, or that it won.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// There is no verdict yet.
    Open,
    /// It is the answer.
    Best,
    /// It was not rendered, because at more than half of the texels R covers too few texels, so that the method exits
    /// early ([`MOST_EXITS`](crate::measure::MOST_EXITS)).
    StepsBelowTexel,
    /// It was not rendered, because a 16-bit depth cannot hold both the near and the far plane.
    DepthFormat,
    /// It was not rendered, because it takes no less work than a combination that reaches the error or, if the time is
    /// limited, than one whose rough time is over twice the limit.
    MoreWork,
    /// The driver refuses it.
    Refused,
    /// Its error is above the limit.
    TooInaccurate,
    /// Another combination, which differs only in numbers of samples, in the strength and in the blur, is at least as
    /// accurate with no more work.
    NoGain,
    /// It has a wider format than usual, and others reach the error without one.
    WiderThanNeeded,
    /// Its time is above the limit.
    TooSlow,
    /// It is slower than the answer, or as accurate as the answer and not faster.
    Slower,
    /// It is less accurate than the answer, and not faster than noise explains.
    LessAccurate,
}

impl Verdict {
    /// Returns the name of the verdict in files.
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

/// A combination that was considered.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The settings.
    pub settings: Settings,
    /// The shorter of two runs in a row, in milliseconds; `None` if the combination could not win.
    pub rough_ms: Option<f64>,
    /// The interleaved runs, in milliseconds; empty if the combination was no contender.
    pub times: Vec<f64>,
    /// The errors relative to the truth; `None` if the combination was not rendered. Only contenders have FLIP.
    pub errors: Option<Errors>,
    /// Why the combination lost or won.
    pub verdict: Verdict,
}

impl Tried {
    /// Makes a record of a combination that has been neither rendered nor timed.
    pub(super) fn new(settings: Settings, verdict: Verdict) -> Tried {
        Tried { settings, rough_ms: None, times: Vec::new(), errors: None, verdict }
    }

    /// Returns the median of the interleaved runs in milliseconds, or the rough time if there are none.
    pub fn ms(&self) -> Option<f64> {
        if self.times.is_empty() { self.rough_ms } else { Some(median(&self.times)) }
    }

    /// Returns the RMSE, if the combination was rendered.
    pub fn rmse(&self) -> Option<f64> {
        self.errors.map(|errors| errors.rmse)
    }

    /// Returns the measurements from which the final choice is made; `None` if there are no interleaved runs.
    pub(super) fn measured(&self) -> Option<Measured> {
        let mut sorted = self.times.clone();
        sorted.sort_by(f64::total_cmp);
        let upper_ms = *sorted.get((3 * sorted.len()).div_ceil(4).checked_sub(1)?)?;
        Some(Measured { rmse: self.rmse()?, ms: median(&self.times), upper_ms })
    }

    /// Returns the limited quantity divided by its limit; `None` for a combination that cannot win.
    pub(super) fn share(&self, goal: Goal) -> Option<f64> {
        let ms = if matches!(goal, Goal::MaxError(_)) { 0.0 } else { self.ms()? };
        Some(goal.share(ms, self.rmse()?)).filter(|_| self.verdict == Verdict::Open)
    }
}

/// The result of a search.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// All combinations that were considered, in the order in which they were tried.
    pub tried: Vec<Tried>,
    /// The index of the answer, if there is one.
    pub best: Option<usize>,
}

impl Tuned {
    /// Returns the indices of the answer and of the timed combinations that came nearest to it, `count` in all. The
    /// nearest are those that would have won if the limited quantity and the minimised quantity had been smaller by the
    /// smallest factors.
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

/// Gives every combination that was rendered its final verdict.
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
