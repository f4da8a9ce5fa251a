//! The search itself: combinations of settings are rendered for their error, and those near the goal are varied in one
//! setting at a time.

use super::choice::Goal;
use super::contest::{Contest, NEAR, NOISE};
use super::requirements::Requirements;
use super::space::{Space, key, no_more_work, work};
use super::stage::Stage;
use super::verdict::{Tried, Tuned, Verdict, decide};
use crate::Error;
use crate::image::Image;
use crate::measure::gbuffers::GBuffers;
use crate::measure::{MOST_EXITS, Shot};
use crate::pipeline::check_depth_range;
use crate::scene::Camera;
use crate::settings::{Exit, KNOBS, Settings};
use std::collections::HashSet;
use std::sync::Arc;

/// The largest number of rounds of variations. Later rounds would find little.
const ROUNDS: usize = 4;
/// The largest number of combinations that are varied in a round, both of those that meet the goal and of those that
/// nearly meet it.
const LEADERS: usize = 4;

/// A search on one view.
pub struct Tuner<'a> {
    camera: &'a Camera,
    stage: Stage<'a>,
    space: Space,
    requirements: Requirements,
    tried: Vec<Tried>,
    /// The first error with which the driver refused a combination.
    refusal: Option<Error>,
}

impl<'a> Tuner<'a> {
    /// Prepares a search on a view. The search keeps the radius, attenuation, bias and number of depth samples of
    /// `base`, and every setting that `pinned` names. The radius must be in scene units.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver refuses a shader, an allocation or a call. [`Error::Usage`] if `half-res` and a
    /// `blur` of 0 are both pinned, because no image would then have full size.
    pub fn new(gl: &Arc<glow::Context>, shot: Shot<'a>, base: &Settings, pinned: &[&str]) -> Result<Tuner<'a>, Error> {
        if base.ao_scale() > 1 && base.blur == 0 && pinned.contains(&"half-res") && pinned.contains(&"blur") {
            return Err(Error::Usage(
                "half-res with blur 0 leaves ambient occlusion at half size, where it cannot be compared: let one of \
                 them be searched"
                    .into(),
            ));
        }
        let mut gbuffers = GBuffers::new(gl);
        let requirements = Requirements::of(gl, &mut gbuffers, shot, base)?;
        let pinned = KNOBS.iter().filter(|knob| pinned.contains(&knob.name)).collect();
        let edges = requirements.edge_pixels.map(|pixels| pixels > 0);
        Ok(Tuner {
            camera: shot.camera,
            stage: Stage::new(gl, shot, gbuffers)?,
            space: Space { base: base.clone(), pinned, edges },
            requirements,
            tried: Vec::new(),
            refusal: None,
        })
    }

    /// Returns the requirements that were found on the view.
    pub fn requirements(&self) -> &Requirements {
        &self.requirements
    }

    /// Searches. The contenders are timed in `runs` interleaved rounds, and the finalists in `3 * runs` further ones.
    /// `progress` is called with the number of steps that are done and the number of steps that are known so far.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no pixel to compare, or if the view and the truth have different sizes.
    /// [`Error::Gl`] if the driver refused all combinations.
    pub fn run(
        mut self,
        truth: &Image<f32>,
        goal: Goal,
        runs: usize,
        progress: impl Fn(usize, usize),
    ) -> Result<Tuned, Error> {
        let mut next = self.space.sweep();
        let mut known = HashSet::new();
        for round in 0..=ROUNDS {
            let admitted = next.iter().filter_map(|settings| self.space.admit(settings));
            let mut new: Vec<Settings> = admitted.flat_map(|settings| self.with_exits(settings)).collect();
            new.retain(|settings| known.insert(key(settings)));
            new.sort_by(|a, b| work(a).total_cmp(&work(b)));
            let all = self.tried.len() + new.len();
            for settings in new {
                let tried = self.try_once(settings, truth, goal)?;
                self.tried.push(tried);
                progress(self.tried.len(), all);
            }
            if round == ROUNDS {
                break;
            }
            // Wider formats cost memory and gain little. They are tried only if nothing else reaches the error.
            let reached = self.tried.iter().any(|tried| tried.share(goal).is_some_and(|share| share <= 1.0));
            let wide = round > 0 && !reached && matches!(goal, Goal::MaxError(_));
            let leaders = self.leaders(goal, round, wide);
            next = leaders.iter().flat_map(|&i| self.space.around(&self.tried[i].settings, wide)).collect();
            for i in leaders {
                next.extend(self.fitted(i, truth)?);
            }
        }
        if let (Some(refusal), true) = (self.refusal.take(), self.tried.iter().all(|tried| tried.rmse().is_none())) {
            return Err(refusal);
        }
        let contest = Contest { goal, truth, covered: &self.requirements.covered, runs };
        let best = contest.hold(&mut self.stage, &self.space, &mut self.tried, progress)?;
        decide(&mut self.tried, goal, best);
        Ok(Tuned { tried: self.tried, best })
    }

    /// Returns a combination that was tried with the strength that fits it best, to 2 decimal places; `None` if the
    /// strength has no effect on it, or if the user pinned it.
    fn fitted(&mut self, i: usize, truth: &Image<f32>) -> Result<Option<Settings>, Error> {
        let settings = self.tried[i].settings.clone();
        if self.space.pins("strength") || settings.idle("strength").is_some() {
            return Ok(None);
        }
        let best = self.stage.best_strength(&settings, truth, &self.requirements.covered)?;
        Ok(Some(Settings { strength: (best * 100.0).round().max(1.0) / 100.0, ..settings }))
    }

    /// Returns the combination with each exit that makes a difference: if its steps are shorter than a texel at no
    /// pixel, only with the chapter's. An exit that the user pinned is kept.
    fn with_exits(&self, settings: Settings) -> Vec<Settings> {
        if self.space.pins("exit") {
            return vec![settings];
        }
        let paper = Settings { exit: Exit::Paper, ..settings.clone() };
        let exits = self.requirements.steps_may_exit(&paper);
        let shorten = exits.then_some(Settings { exit: Exit::Shorten, ..settings });
        [paper].into_iter().chain(shorten).collect()
    }

    /// Rejects a combination without rendering it, or renders it for its error and times it roughly if it may win.
    fn try_once(&mut self, settings: Settings, truth: &Image<f32>, goal: Goal) -> Result<Tried, Error> {
        let verdict = self.unrendered(&settings, goal).unwrap_or(Verdict::Open);
        let mut tried = Tried::new(settings, verdict);
        if verdict == Verdict::Open {
            match self.render_once(&mut tried, truth, goal) {
                Err(refusal @ Error::Gl { .. }) => {
                    tried.verdict = Verdict::Refused;
                    self.refusal.get_or_insert(refusal);
                }
                other => other?,
            }
        }
        Ok(tried)
    }

    fn render_once(&mut self, tried: &mut Tried, truth: &Image<f32>, goal: Goal) -> Result<(), Error> {
        let mut ready = self.stage.ready(&tried.settings)?;
        let errors = self.stage.errors(&mut ready, truth, &self.requirements.covered)?;
        tried.errors = Some(errors);
        let exits = self.requirements.steps_may_exit(&tried.settings);
        let as_good = |other: &Tried| {
            other.rmse().is_some_and(|rmse| rmse <= errors.rmse)
                && no_more_work(&other.settings, &tried.settings, exits)
        };
        if self.tried.iter().any(as_good) {
            tried.verdict = Verdict::NoGain;
        } else if matches!(goal, Goal::MaxMs(_)) || goal.share(0.0, errors.rmse) <= NEAR {
            tried.rough_ms = Some(self.stage.rough_ms(&mut ready)?);
        }
        Ok(())
    }

    /// Returns why a combination need not be rendered, or `None` if it must be.
    fn unrendered(&self, settings: &Settings, goal: Goal) -> Option<Verdict> {
        if check_depth_range(settings, self.camera).is_err() {
            return Some(Verdict::DepthFormat);
        }
        if self.requirements.reach(settings).is_ok_and(|reach| reach.exits > MOST_EXITS) {
            return Some(Verdict::StepsBelowTexel);
        }
        let exits = self.requirements.steps_may_exit(settings);
        let enough = |other: &Tried| match goal {
            Goal::MaxError(limit) => other.rmse().is_some_and(|rmse| rmse <= limit),
            Goal::MaxMs(limit) => other.rough_ms.is_some_and(|ms| ms > NOISE * limit),
        };
        let more = |other: &Tried| enough(other) && no_more_work(&other.settings, settings, exits);
        self.tried.iter().any(more).then_some(Verdict::MoreWork)
    }

    /// Returns the combinations that are worth varying: the best of those that meet the goal, and those that nearly
    /// meet it and would be better. If there are none, it returns those that are nearest to the goal.
    fn leaders(&self, goal: Goal, round: usize, wide: bool) -> Vec<usize> {
        let usual = |&i: &usize| wide || !self.space.is_wide(&self.tried[i].settings);
        let all = (0..self.tried.len()).filter(usual);
        let mut open: Vec<(usize, f64)> = all.filter_map(|i| Some((i, self.tried[i].share(goal)?))).collect();
        let sought = |i: usize| {
            let tried = &self.tried[i];
            tried.ms().zip(tried.rmse()).map_or(f64::INFINITY, |(ms, rmse)| goal.sought(ms, rmse))
        };
        open.sort_by(|a, b| sought(a.0).total_cmp(&sought(b.0)));
        let mut meeting: Vec<usize> = open.iter().filter(|(_, share)| *share <= 1.0).map(|(i, _)| *i).collect();
        // The first round also varies the best combination of every method. A method that is far behind in the sweep
        // may be ahead with other numbers of samples.
        let mut methods = HashSet::new();
        let mut place = 0;
        meeting.retain(|&i| {
            place += 1;
            let first = methods.insert(self.tried[i].settings.method.name());
            place <= LEADERS || round == 0 && first
        });
        let best = meeting.first().map_or(f64::INFINITY, |&i| sought(i));
        open.retain(|&(i, share)| share > 1.0 && (meeting.is_empty() || sought(i) < best));
        open.sort_by(|a, b| a.1.total_cmp(&b.1));
        if open.iter().any(|(_, share)| *share <= NEAR) {
            open.retain(|(_, share)| *share <= NEAR);
        } else if !meeting.is_empty() {
            open.clear();
        }
        meeting.into_iter().chain(open.into_iter().map(|(i, _)| i).take(LEADERS)).collect()
    }
}
