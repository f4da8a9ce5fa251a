//! The search for the settings that a view needs: the cheapest within an error, or the most accurate within a time.
//!
//! What a view does not ask for is known before anything is rendered ([`Requirements`]). Of the rest each is rendered
//! once, the least work first, since its error does not depend on time; those that can still win are timed roughly, and
//! those near the goal are varied knob by knob. At last the contenders are timed in interleaved rounds, and the
//! finalists of those for longer. It is no proof: settings far from all that is near the goal are not looked at.
#![doc = include_str!("tuned.md")]

pub mod choice;
mod space;

use super::errors::{Comparison, Errors};
use super::median;
use super::trade::{GBuffers, interleaved, timed};
use crate::image::Image;
use crate::pipeline::check_depth_range;
use crate::scene::{Camera, Mesh};
use crate::settings::{KNOBS, Method, Settings};
use crate::{AmbientOcclusion, Error, Pipeline, Request, Timers};
use choice::{Goal, Measured, choose};
use space::{Space, exits_early, key, no_more_work, work};
use std::collections::HashSet;
use std::sync::Arc;

/// Rounds about the leaders, at most: the last ones find little.
const ROUNDS: usize = 4;
/// Leaders of each kind in a round.
const LEADERS: usize = 4;
/// What misses the limit by no more than this factor may meet it with a knob turned.
const NEAR: f64 = 1.25;
/// How many are timed in interleaved rounds at once, so that a handful of images is held.
const CONTENDERS: usize = 12;
const FINALISTS: usize = 4;
/// How many times as often the finalists are timed.
const FINALIST_RUNS: usize = 3;
/// Rough times may be off by as much: what takes this many times the limit is too slow for certain.
const NOISE: f64 = 2.0;
/// The step in texels below which a pixel is surely left out: 1, less what rounding to 16-bit depth may add.
const SURELY_BELOW: f64 = 0.999;

/// What a view asks of settings, known before the search.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// The pixels that hold a surface: where errors count.
    pub covered: Image<bool>,
    /// Depth samples a pixel, as many as the driver gave.
    pub samples: u32,
    /// How many pixels the blur takes for edges, with the method's depth sigma and with that of `ssao`.
    pub edge_pixels: [usize; 2],
    /// R in texels at the farthest covered pixel and at the nearest.
    pub radius_px: (f64, f64),
}

/// Why settings lost, or that they won.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// None yet: the search is under way.
    Open,
    /// The answer.
    Best,
    /// Not rendered: every step is below a texel, where A = 1 as without a method.
    StepsBelowTexel,
    /// Not rendered: a 16-bit depth does not hold both the near and the far plane.
    DepthFormat,
    /// Not rendered: more work than settings that reach the error, or that take far longer than the time.
    MoreWork,
    /// The driver refuses them.
    Refused,
    /// The error is above the limit.
    TooInaccurate,
    /// Others are as accurate with less work, and differ in counts alone.
    NoGain,
    /// The error is reached without wider formats.
    WiderThanNeeded,
    /// The time is above the limit.
    TooSlow,
    /// As good, and slower.
    Slower,
    /// Not as accurate, and no faster beyond noise.
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
    /// What was considered.
    pub settings: Settings,
    /// The lesser of two runs in a row, in milliseconds; none where they could not win.
    pub rough_ms: Option<f64>,
    /// Interleaved runs, in milliseconds; none where they were no contender.
    pub times: Vec<f64>,
    /// Against the truth, with FLIP for contenders alone; none where they were not rendered.
    pub errors: Option<Errors>,
    /// What became of them.
    pub verdict: Verdict,
}

impl Tried {
    /// Milliseconds: the median of the interleaved runs, else the rough time.
    pub fn ms(&self) -> Option<f64> {
        if self.times.is_empty() { self.rough_ms } else { Some(median(&self.times)) }
    }

    /// The RMSE.
    pub fn rmse(&self) -> Option<f64> {
        self.errors.map(|errors| errors.rmse)
    }

    fn measured(&self) -> Option<Measured> {
        let mut sorted = self.times.clone();
        sorted.sort_by(f64::total_cmp);
        let upper_ms = *sorted.get((3 * sorted.len()).div_ceil(4).checked_sub(1)?)?;
        Some(Measured { rmse: self.rmse()?, ms: median(&self.times), upper_ms })
    }
}

/// What a search found.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// All that was considered, in the order in which it was.
    pub tried: Vec<Tried>,
    /// The answer's index, if there is one.
    pub best: Option<usize>,
}

impl Tuned {
    /// The answer, and then those of the timed that came nearest to it: that would have won with the least change of
    /// what is limited and of what is sought, both as factors.
    pub fn nearest(&self, goal: Goal, count: usize) -> Vec<usize> {
        let of = |i: usize| Some(goal.of(self.tried[i].ms()?, self.tried[i].rmse()?));
        let Some((best, (_, sought))) = self.best.and_then(|i| Some((i, of(i)?))) else { return Vec::new() };
        let excess = |(share, value): (f64, f64)| share.max(1.0) * (value / sought.max(1e-9)).max(1.0);
        let others = (0..self.tried.len()).filter(|&i| i != best);
        let mut others: Vec<(usize, f64)> = others.filter_map(|i| Some((i, excess(of(i)?)))).collect();
        others.sort_by(|a, b| a.1.total_cmp(&b.1));
        [best].into_iter().chain(others.into_iter().map(|(i, _)| i)).take(count).collect()
    }
}

/// A search on one view.
pub struct Tuner<'a> {
    gl: Arc<glow::Context>,
    camera: &'a Camera,
    size: (u32, u32),
    gbuffers: GBuffers<'a>,
    timers: Timers,
    space: Space,
    requirements: Requirements,
    tried: Vec<Tried>,
    /// The first refusal of the driver.
    refusal: Option<Error>,
}

impl<'a> Tuner<'a> {
    /// Looks at a view. The search keeps of `base`, whose radius must be in scene units, the radius, attenuation,
    /// strength, bias and depth samples, and the knobs named by `pinned`.
    ///
    /// # Errors
    /// What the driver refuses, or a `half-res` and a `blur` of 0 both pinned: no image of full size comes of them.
    pub fn new(
        gl: &Arc<glow::Context>,
        (mesh, camera): (&'a Mesh, &'a Camera),
        size: (u32, u32),
        base: &Settings,
        pinned: &[&str],
    ) -> Result<Tuner<'a>, Error> {
        if base.ao_scale() > 1 && base.blur == 0 && pinned.contains(&"half-res") && pinned.contains(&"blur") {
            return Err(Error::Usage(
                "half-res with blur 0 leaves ambient occlusion at half size, where it cannot be compared: let one of \
                 them be searched"
                    .into(),
            ));
        }
        let mut gbuffers = GBuffers::new(gl, (mesh, camera), size);
        let pipeline = gbuffers.of(base)?;
        let depth = pipeline.depth()?;
        let covered = depth.map(|z| z.is_finite());
        let depths = depth.texels.iter().filter(|z| z.is_finite());
        let (nearest, farthest) = depths.fold((f32::INFINITY, 0.0f32), |(a, b), &z| (a.min(z), b.max(z)));
        let in_texels = |z: f32| {
            let [_, half_height] = camera.projection.half_extents_at(f64::from(z));
            base.radius_units().map(|radius| radius * f64::from(size.1) / (2.0 * half_height))
        };
        let radius_px = (in_texels(farthest)?, in_texels(nearest)?);
        let samples = pipeline.samples();
        let mut edge_pixels = [0; 2];
        if samples > 1 {
            let method = if base.method == Method::Ssao { Method::Hbao } else { base.method };
            // Of all sample counts of `ssao`, 8 has the least depth sigma, and the most edges.
            for (pixels, method) in edge_pixels.iter_mut().zip([method, Method::Ssao]) {
                let settings = Settings { method, ssao_samples: 8, ..base.clone() };
                let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
                let mut pipeline = Pipeline::new(gl, size, &settings, request)?;
                pipeline.render(mesh, camera)?;
                *pixels = pipeline.edges().map_or(0, |edges| edges.texels.iter().filter(|&&edge| edge).count());
            }
        }
        let pinned = KNOBS.iter().filter(|knob| pinned.contains(&knob.name)).collect();
        Ok(Tuner {
            gl: gl.clone(),
            camera,
            size,
            gbuffers,
            timers: Timers::new(gl, true)?,
            space: Space { base: base.clone(), pinned, edges: edge_pixels.map(|pixels| pixels > 0) },
            requirements: Requirements { covered, samples, edge_pixels, radius_px },
            tried: Vec::new(),
            refusal: None,
        })
    }

    /// What the view asks of settings.
    pub fn requirements(&self) -> &Requirements {
        &self.requirements
    }

    /// Searches. The contenders are timed in `runs` interleaved rounds, the finalists in as many again and three times
    /// as many. `progress` is called with what is done and what there is to do, as far as that is known.
    ///
    /// # Errors
    /// A view or a truth without a pixel to compare, or what the driver refused where it refused all.
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
            let mut new: Vec<Settings> = next.iter().filter_map(|settings| self.space.admit(settings)).collect();
            new.retain(|settings| known.insert(key(settings)));
            new.sort_by(|a, b| work(a).total_cmp(&work(b)));
            let all = self.tried.len() + new.len();
            for settings in new {
                let tried = self.try_once(settings, truth, goal)?;
                self.tried.push(tried);
                progress(self.tried.len(), all);
            }
            // Wider formats cost memory and gain little: they are varied where nothing else reaches an error.
            let reached = (0..self.tried.len()).any(|i| self.share(i, goal).is_some_and(|share| share <= 1.0));
            let wide = round > 0 && !reached && matches!(goal, Goal::MaxError(_));
            let leaders = self.leaders(goal, round, wide);
            next = leaders.iter().flat_map(|&i| self.space.around(&self.tried[i].settings, wide)).collect();
        }
        if let (Some(refusal), true) = (self.refusal.take(), self.tried.iter().all(|tried| tried.rmse().is_none())) {
            return Err(refusal);
        }
        let best = self.contest(truth, goal, runs, progress)?;
        self.decide(goal, best);
        Ok(Tuned { tried: self.tried, best })
    }

    /// Settings rejected unrendered, or rendered for their error, and timed roughly where they can win.
    fn try_once(&mut self, settings: Settings, truth: &Image<f32>, goal: Goal) -> Result<Tried, Error> {
        let verdict = self.unrendered(&settings, goal);
        let verdict = verdict.unwrap_or(Verdict::Open);
        let mut tried = Tried { settings, rough_ms: None, times: Vec::new(), errors: None, verdict };
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
        let inputs = self.gbuffers.inputs(&tried.settings)?;
        let mut ao = AmbientOcclusion::new(self.gl.clone(), self.size, &tried.settings)?;
        ao.render(&inputs)?;
        // FLIP takes longer than a fast method's rendering: contenders alone have it.
        let errors = Comparison::without_flip(&ao.image()?, truth)?.over(&self.requirements.covered)?;
        let errors = errors.ok_or_else(Errors::of_nothing)?;
        let error = errors.rmse;
        tried.errors = Some(errors);
        let exits = self.exits(&tried.settings);
        let as_good = |other: &Tried| {
            other.rmse().is_some_and(|rmse| rmse <= error) && no_more_work(&other.settings, &tried.settings, exits)
        };
        if self.tried.iter().any(as_good) {
            tried.verdict = Verdict::NoGain;
        } else if matches!(goal, Goal::MaxMs(_)) || goal.of(0.0, error).0 <= NEAR {
            let first = timed(&mut ao, &inputs, &mut self.timers)?;
            tried.rough_ms = Some(first.min(timed(&mut ao, &inputs, &mut self.timers)?));
        }
        Ok(())
    }

    /// Why settings need not be rendered, if so.
    fn unrendered(&self, settings: &Settings, goal: Goal) -> Option<Verdict> {
        if check_depth_range(settings, self.camera).is_err() {
            return Some(Verdict::DepthFormat);
        }
        if exits_early(settings.method) && step(self.requirements.radius_px.1, settings) < SURELY_BELOW {
            return Some(Verdict::StepsBelowTexel);
        }
        let exits = self.exits(settings);
        let enough = |other: &Tried| match goal {
            Goal::MaxError(limit) => other.rmse().is_some_and(|rmse| rmse <= limit),
            Goal::MaxMs(limit) => other.rough_ms.is_some_and(|ms| ms > NOISE * limit),
        };
        let more = |other: &Tried| enough(other) && no_more_work(&other.settings, settings, exits);
        self.tried.iter().any(more).then_some(Verdict::MoreWork)
    }

    /// Whether some pixel may be left out because its step is below a texel.
    fn exits(&self, settings: &Settings) -> bool {
        exits_early(settings.method) && step(self.requirements.radius_px.0, settings) < 1.0 / SURELY_BELOW
    }

    /// What is limited, as a share of the limit, of settings that can win.
    fn share(&self, i: usize, goal: Goal) -> Option<f64> {
        let tried = &self.tried[i];
        let ms = if matches!(goal, Goal::MaxError(_)) { 0.0 } else { tried.ms()? };
        Some(goal.of(ms, tried.rmse()?).0).filter(|_| tried.verdict == Verdict::Open)
    }

    /// What is worth varying: the best of those that meet the goal, and those that nearly do and would be better. Where
    /// there are none, those nearest to it.
    fn leaders(&self, goal: Goal, round: usize, wide: bool) -> Vec<usize> {
        let usual = |&i: &usize| wide || !self.space.is_wide(&self.tried[i].settings);
        let all = (0..self.tried.len()).filter(usual);
        let mut open: Vec<(usize, f64)> = all.filter_map(|i| Some((i, self.share(i, goal)?))).collect();
        let sought = |i: usize| {
            let tried = &self.tried[i];
            tried.ms().zip(tried.rmse()).map_or(f64::INFINITY, |(ms, rmse)| goal.of(ms, rmse).1)
        };
        open.sort_by(|a, b| sought(a.0).total_cmp(&sought(b.0)));
        let mut meeting: Vec<usize> = open.iter().filter(|(_, share)| *share <= 1.0).map(|(i, _)| *i).collect();
        // At first one of every method too: what is far behind in the sweep may be ahead with other counts.
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

    /// Times those that may win, in interleaved rounds, and chooses.
    fn contest(
        &mut self,
        truth: &Image<f32>,
        goal: Goal,
        runs: usize,
        progress: impl Fn(usize, usize),
    ) -> Result<Option<usize>, Error> {
        let margin = if matches!(goal, Goal::MaxError(_)) { 1.0 } else { NEAR };
        let shares = (0..self.tried.len()).filter_map(|i| Some((i, self.share(i, goal)?)));
        let mut hopeful: Vec<usize> = shares.filter(|(_, share)| *share <= margin).map(|(i, _)| i).collect();
        if matches!(goal, Goal::MaxError(_)) {
            let (wide, narrow): (Vec<usize>, Vec<usize>) =
                hopeful.iter().partition(|&&i| self.space.is_wide(&self.tried[i].settings));
            if !narrow.is_empty() {
                hopeful = narrow;
                wide.into_iter().for_each(|i| self.tried[i].verdict = Verdict::WiderThanNeeded);
            }
        }
        let ms = |i: usize| self.tried[i].rough_ms.unwrap_or(f64::INFINITY);
        let rmse = |i: usize| self.tried[i].rmse().unwrap_or(f64::INFINITY);
        let first = |a: &usize, b: &usize| goal.of(ms(*a), rmse(*a)).1.total_cmp(&goal.of(ms(*b), rmse(*b)).1);
        hopeful.sort_by(first);
        if let (Goal::MaxError(_), Some(&fastest)) = (goal, hopeful.first()) {
            let most = NOISE * ms(fastest);
            hopeful.retain(|&i| ms(i) <= most);
        }
        let mut best: Option<usize> = None;
        loop {
            // The machine may have been faster when the others were timed roughly: then they meet the best so far.
            let beats = |i: usize| match (goal, best.and_then(|best| self.tried[best].ms())) {
                (_, None) => true,
                (Goal::MaxError(_), Some(ms)) => self.tried[i].rough_ms.is_some_and(|rough| rough < ms),
                (Goal::MaxMs(_), Some(_)) => false,
            };
            let untimed = hopeful.iter().copied().filter(|&i| self.tried[i].times.is_empty() && beats(i));
            let new: Vec<usize> = untimed.take(CONTENDERS).collect();
            if new.is_empty() {
                return Ok(best);
            }
            let contenders: Vec<usize> = best.into_iter().chain(new).collect();
            let finalists = self.time(&contenders, truth, goal, runs, &progress)?;
            best = self.choose(goal, &finalists).or_else(|| self.choose(goal, &contenders)).or(best);
        }
    }

    fn choose(&self, goal: Goal, among: &[usize]) -> Option<usize> {
        let measured: Vec<_> = among.iter().filter_map(|&i| Some((i, self.tried[i].measured()?))).collect();
        let points: Vec<Measured> = measured.iter().map(|&(_, measured)| measured).collect();
        choose(goal, &points).map(|best| measured[best].0)
    }

    /// Times contenders, and for longer the finalists, which are returned.
    fn time(
        &mut self,
        contenders: &[usize],
        truth: &Image<f32>,
        goal: Goal,
        runs: usize,
        progress: &impl Fn(usize, usize),
    ) -> Result<Vec<usize>, Error> {
        let most = contenders.len() * (runs + 1) + FINALISTS.min(contenders.len()) * (FINALIST_RUNS * runs + 1);
        let done = std::cell::Cell::new(0);
        let tick = || {
            done.set(done.get() + 1);
            progress(done.get(), most);
        };
        let mut passes = Vec::new();
        for &i in contenders {
            let settings = &self.tried[i].settings;
            let inputs = self.gbuffers.inputs(settings)?;
            passes.push((AmbientOcclusion::new(self.gl.clone(), self.size, settings)?, inputs));
        }
        let times = interleaved(&mut passes, &mut self.timers, runs, tick)?;
        for ((&i, (ao, _)), times) in contenders.iter().zip(&passes).zip(times) {
            self.tried[i].errors = Some(Errors::of(&ao.image()?, truth, &self.requirements.covered)?);
            self.tried[i].times = times;
        }
        let mut finalists: Vec<(usize, _)> = contenders.iter().copied().zip(passes).collect();
        let ms = |i: usize| median(&self.tried[i].times);
        match goal {
            Goal::MaxError(_) => finalists.sort_by(|a, b| ms(a.0).total_cmp(&ms(b.0))),
            // These are in the order of their errors.
            Goal::MaxMs(limit) => finalists.retain(|(i, _)| ms(*i) <= NEAR * limit),
        }
        finalists.truncate(FINALISTS);
        let (which, mut passes): (Vec<usize>, Vec<_>) = finalists.into_iter().unzip();
        let times = interleaved(&mut passes, &mut self.timers, FINALIST_RUNS * runs, tick)?;
        which.iter().zip(times).for_each(|(&i, times)| self.tried[i].times.extend(times));
        Ok(which)
    }

    /// Says of all that was rendered why it lost.
    fn decide(&mut self, goal: Goal, best: Option<usize>) {
        let fastest = self.tried.iter().filter(|tried| tried.verdict == Verdict::Open);
        let fastest = fastest.filter_map(Tried::measured).filter(|one| goal.of(one.ms, one.rmse).0 <= 1.0);
        let fastest = fastest.min_by(|a, b| a.ms.total_cmp(&b.ms)).map_or(0.0, |one| one.upper_ms);
        let least = best.and_then(|i| self.tried[i].rmse()).unwrap_or(0.0);
        for (i, tried) in self.tried.iter_mut().enumerate() {
            let (Some(rmse), Verdict::Open | Verdict::NoGain) = (tried.rmse(), tried.verdict) else { continue };
            let ms = tried.ms();
            tried.verdict =
                match goal {
                    _ if best == Some(i) => Verdict::Best,
                    Goal::MaxError(limit) if rmse > limit => Verdict::TooInaccurate,
                    _ if tried.verdict == Verdict::NoGain => Verdict::NoGain,
                    Goal::MaxError(_) if !tried.times.is_empty() && ms.is_some_and(|ms| ms <= fastest) => {
                        if rmse > least { Verdict::LessAccurate } else { Verdict::Slower }
                    }
                    Goal::MaxError(_) => Verdict::Slower,
                    Goal::MaxMs(limit) if ms.is_some_and(|ms| ms > limit) => Verdict::TooSlow,
                    Goal::MaxMs(_) if rmse > least => Verdict::LessAccurate,
                    Goal::MaxMs(_) => Verdict::Slower,
                };
        }
    }
}

/// The length of a step in texels of ambient occlusion, where R is as many texels of the image.
fn step(radius_px: f64, settings: &Settings) -> f64 {
    radius_px / f64::from(settings.steps + 1) / f64::from(settings.ao_scale())
}
