//! The end of a search: the combinations of settings that may win are timed in interleaved rounds, and the answer is
//! chosen.

use super::choice::{Goal, Measured, choose};
use super::space::Space;
use super::stage::Stage;
use super::verdict::{Tried, Verdict};
use crate::Error;
use crate::image::Image;
use crate::measure::errors::Errors;
use crate::measure::median;
use std::cell::Cell;

/// A combination that misses the limit by no more than this factor may meet it with another value of one setting, or in
/// other runs.
pub(super) const NEAR: f64 = 1.25;
/// Rough times may be wrong by this factor. A combination whose rough time is over this many times the limit is
/// certainly too slow.
pub(super) const NOISE: f64 = 2.0;
/// The largest number of combinations that are timed in the same interleaved rounds. The number is small because each
/// holds images in memory.
const CONTENDERS: usize = 12;
/// The number of contenders that are timed for longer, called finalists.
const FINALISTS: usize = 4;
/// Finalists get this many times as many additional runs as a contender has.
const FINALIST_RUNS: usize = 3;

/// A contest between combinations that may win: its goal, and the truth that images are compared with.
pub(super) struct Contest<'c> {
    pub(super) goal: Goal,
    pub(super) truth: &'c Image<f32>,
    /// The pixels that are compared.
    pub(super) covered: &'c Image<bool>,
    /// The number of timed runs of a contender.
    pub(super) runs: usize,
}

impl Contest<'_> {
    /// Times the combinations that may win, and returns the index of the answer. `progress` is called with the number
    /// of renderings that are done and the number of all renderings.
    pub(super) fn hold(
        &self,
        stage: &mut Stage,
        space: &Space,
        all: &mut [Tried],
        progress: impl Fn(usize, usize),
    ) -> Result<Option<usize>, Error> {
        let hopeful = self.hopeful(space, all);
        let mut best: Option<usize> = None;
        loop {
            // The machine may have been faster when the remaining combinations were timed roughly. Those whose rough
            // time is below the best median so far are therefore timed too.
            let beats = |i: usize| match (self.goal, best.and_then(|best| all[best].ms())) {
                (_, None) => true,
                (Goal::MaxError(_), Some(ms)) => all[i].rough_ms.is_some_and(|rough| rough < ms),
                (Goal::MaxMs(_), Some(_)) => false,
            };
            let untimed = hopeful.iter().copied().filter(|&i| all[i].times.is_empty() && beats(i));
            let new: Vec<usize> = untimed.take(CONTENDERS).collect();
            if new.is_empty() {
                return Ok(best);
            }
            let contenders: Vec<usize> = best.into_iter().chain(new).collect();
            let finalists = self.time(stage, all, &contenders, &progress)?;
            best = self.choose(all, &finalists).or_else(|| self.choose(all, &contenders)).or(best);
        }
    }

    /// Returns the combinations that may win, the most promising first. If some reach the error without wider formats,
    /// those with wider formats are rejected here.
    fn hopeful(&self, space: &Space, all: &mut [Tried]) -> Vec<usize> {
        let goal = self.goal;
        let margin = if matches!(goal, Goal::MaxError(_)) { 1.0 } else { NEAR };
        let shares = (0..all.len()).filter_map(|i| Some((i, all[i].share(goal)?)));
        let mut hopeful: Vec<usize> = shares.filter(|(_, share)| *share <= margin).map(|(i, _)| i).collect();
        if matches!(goal, Goal::MaxError(_)) {
            let (wide, narrow): (Vec<usize>, Vec<usize>) =
                hopeful.iter().partition(|&&i| space.is_wide(&all[i].settings));
            if !narrow.is_empty() {
                hopeful = narrow;
                wide.into_iter().for_each(|i| all[i].verdict = Verdict::WiderThanNeeded);
            }
        }
        let ms = |i: usize| all[i].rough_ms.unwrap_or(f64::INFINITY);
        let rmse = |i: usize| all[i].rmse().unwrap_or(f64::INFINITY);
        let sought = |i: usize| goal.sought(ms(i), rmse(i));
        let first = |a: &usize, b: &usize| sought(*a).total_cmp(&sought(*b));
        hopeful.sort_by(first);
        if let (Goal::MaxError(_), Some(&fastest)) = (goal, hopeful.first()) {
            let most = NOISE * ms(fastest);
            hopeful.retain(|&i| ms(i) <= most);
        }
        hopeful
    }

    fn choose(&self, all: &[Tried], among: &[usize]) -> Option<usize> {
        let measured: Vec<_> = among.iter().filter_map(|&i| Some((i, all[i].measured()?))).collect();
        let points: Vec<Measured> = measured.iter().map(|&(_, measured)| measured).collect();
        choose(self.goal, &points).map(|best| measured[best].0)
    }

    /// Times the contenders, then times the finalists among them for longer. Returns the finalists.
    fn time(
        &self,
        stage: &mut Stage,
        all: &mut [Tried],
        contenders: &[usize],
        progress: &impl Fn(usize, usize),
    ) -> Result<Vec<usize>, Error> {
        let most =
            contenders.len() * (self.runs + 1) + FINALISTS.min(contenders.len()) * (FINALIST_RUNS * self.runs + 1);
        let done = Cell::new(0);
        let tick = || {
            done.set(done.get() + 1);
            progress(done.get(), most);
        };
        let mut passes = Vec::new();
        for &i in contenders {
            passes.push(stage.ready(&all[i].settings)?);
        }
        let times = stage.interleaved(&mut passes, self.runs, tick)?;
        for ((&i, (ao, _)), times) in contenders.iter().zip(&passes).zip(times) {
            all[i].errors = Some(Errors::of(&ao.image()?, self.truth, self.covered)?);
            all[i].times = times;
        }
        let mut finalists: Vec<(usize, _)> = contenders.iter().copied().zip(passes).collect();
        let ms = |i: usize| median(&all[i].times);
        match self.goal {
            Goal::MaxError(_) => finalists.sort_by(|a, b| ms(a.0).total_cmp(&ms(b.0))),
            // The contenders are already in the order of their errors.
            Goal::MaxMs(limit) => finalists.retain(|(i, _)| ms(*i) <= NEAR * limit),
        }
        finalists.truncate(FINALISTS);
        let (which, mut passes): (Vec<usize>, Vec<_>) = finalists.into_iter().unzip();
        let times = stage.interleaved(&mut passes, FINALIST_RUNS * self.runs, tick)?;
        which.iter().zip(times).for_each(|(&i, times)| all[i].times.extend(times));
        Ok(which)
    }
}
