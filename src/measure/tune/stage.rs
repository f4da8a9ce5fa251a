//! The view that a search renders its settings on.

use crate::image::Image;
use crate::measure::Shot;
use crate::measure::errors::{Comparison, Errors};
use crate::measure::gbuffers::GBuffers;
use crate::measure::interleaved::{interleaved, timed};
use crate::settings::Settings;
use crate::{AmbientOcclusion, Error, Inputs, Timers};
use std::sync::Arc;

/// Ambient occlusion that is ready to be rendered, and what it is computed from.
pub(super) type Ready = (AmbientOcclusion, Inputs);

/// A view, its G-buffers, and the means to render and time settings on it.
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

    /// Compiles and allocates what these settings need.
    pub(super) fn ready(&mut self, settings: &Settings) -> Result<Ready, Error> {
        let inputs = self.gbuffers.inputs(self.shot, settings)?;
        Ok((AmbientOcclusion::new(self.gl.clone(), self.shot.size, settings)?, inputs))
    }

    /// Renders once, and compares the image with the truth where `covered` is true.
    pub(super) fn errors(
        &self,
        (ao, inputs): &mut Ready,
        truth: &Image<f32>,
        covered: &Image<bool>,
    ) -> Result<Errors, Error> {
        ao.render(inputs)?;
        // FLIP takes longer than the rendering of a fast method: contenders alone have it.
        let errors = Comparison::without_flip(&ao.image()?, truth)?.over(covered)?;
        errors.ok_or_else(Errors::of_nothing)
    }

    /// The shorter of two runs in a row, in milliseconds.
    pub(super) fn rough_ms(&mut self, (ao, inputs): &mut Ready) -> Result<f64, Error> {
        let first = timed(ao, inputs, &mut self.timers)?;
        Ok(first.min(timed(ao, inputs, &mut self.timers)?))
    }

    /// Interleaved runs in milliseconds, for each of `passes`. `progress` is called after each rendering.
    pub(super) fn interleaved(
        &mut self,
        passes: &mut [Ready],
        runs: usize,
        progress: impl Fn(),
    ) -> Result<Vec<Vec<f64>>, Error> {
        interleaved(passes, &mut self.timers, runs, progress)
    }
}
