//! The view on which a search renders combinations of settings.

use crate::image::Image;
use crate::measure::errors::{Comparison, Errors};
use crate::measure::gbuffers::GBuffers;
use crate::measure::interleaved::{interleaved, timed};
use crate::measure::{BestStrength, Shot};
use crate::settings::Settings;
use crate::{AmbientOcclusion, Error, Inputs, Timers};
use std::sync::Arc;

/// Ambient occlusion that is ready to be rendered, and its inputs.
pub(super) type Ready = (AmbientOcclusion, Inputs);

/// A view with its G-buffers and timers, on which combinations are rendered and timed.
pub(super) struct Stage<'a> {
    gl: Arc<glow::Context>,
    shot: Shot<'a>,
    gbuffers: GBuffers<'a>,
    timers: Timers,
}

impl<'a> Stage<'a> {
    pub(super) fn new(gl: &Arc<glow::Context>, shot: Shot<'a>, gbuffers: GBuffers<'a>) -> Result<Stage<'a>, Error> {
        Ok(Stage { gl: gl.clone(), shot, gbuffers, timers: Timers::new(gl, true)? })
    }

    /// Prepares to render this combination: allocates its images, and renders its G-buffer if there is none yet.
    pub(super) fn ready(&mut self, settings: &Settings) -> Result<Ready, Error> {
        let inputs = self.gbuffers.inputs(self.shot, settings)?;
        Ok((AmbientOcclusion::new(self.gl.clone(), self.shot.size, settings)?, inputs))
    }

    /// Renders once, and compares the image with the truth at the pixels where `covered` is true.
    pub(super) fn errors(
        &self,
        (ao, inputs): &mut Ready,
        truth: &Image<f32>,
        covered: &Image<bool>,
    ) -> Result<Errors, Error> {
        ao.render(inputs)?;
        // FLIP takes longer than rendering a fast method. It is computed only for contenders.
        let errors = Comparison::without_flip(&ao.image()?, truth)?.over(covered)?;
        errors.ok_or_else(Errors::of_nothing)
    }

    /// Renders this combination once, and returns the strength with which it would be nearest to the truth at the
    /// pixels where `covered` is true.
    pub(super) fn best_strength(
        &mut self,
        settings: &Settings,
        truth: &Image<f32>,
        covered: &Image<bool>,
    ) -> Result<f64, Error> {
        let (mut ao, inputs) = self.ready(settings)?;
        ao.render(&inputs)?;
        Ok(BestStrength::of(&ao.image()?, truth, covered, settings.strength)?.strength)
    }

    /// Renders twice in a row, and returns the shorter time in milliseconds.
    pub(super) fn rough_ms(&mut self, (ao, inputs): &mut Ready) -> Result<f64, Error> {
        let first = timed(ao, inputs, &mut self.timers)?;
        Ok(first.ms.min(timed(ao, inputs, &mut self.timers)?.ms))
    }

    /// Times `passes` in interleaved runs, and returns the milliseconds of each run for each of them. `progress` is
    /// called after each rendering.
    pub(super) fn interleaved(
        &mut self,
        passes: &mut [Ready],
        runs: usize,
        progress: impl Fn(),
    ) -> Result<Vec<Vec<f64>>, Error> {
        let times = interleaved(passes, &mut self.timers, runs, progress)?;
        Ok(times.into_iter().map(|runs| runs.into_iter().map(|timed| timed.ms).collect()).collect())
    }
}
