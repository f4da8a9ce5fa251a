//! Measures how long passes take, by OpenGL's timer queries and by the system's clock.

use super::{DebugGroups, check, not_made};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;
use std::time::Instant;

/// How long one pass took.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PassTime {
    /// The name of the pass, such as `ao` or `blur_x`.
    pub name: &'static str,
    /// Milliseconds by the driver's timer query; `None` if the driver has no working timer.
    pub gpu_ms: Option<f64>,
    /// Milliseconds by the system's clock, from one `glFinish` before the pass to another after it.
    pub wall_ms: f64,
}

/// Runs passes, and times them if it was created to do so.
pub struct Timers {
    gl: Arc<glow::Context>,
    on: bool,
    query: Option<glow::Query>,
    times: Vec<PassTime>,
    /// Names the passes for debuggers, where that is possible.
    pub(crate) groups: Option<DebugGroups>,
}

impl Timers {
    /// Timers that measure if `on` is true, and that otherwise only run the passes. The context must be current.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver makes no query object.
    pub fn new(gl: &Arc<glow::Context>, on: bool) -> Result<Timers, Error> {
        let mut query = None;
        if on {
            // SAFETY: the context is current.
            query = Some(unsafe { gl.create_query() }.map_err(|_| not_made(gl, "timer"))?);
        }
        Ok(Timers { gl: gl.clone(), on, query, times: Vec::new(), groups: None })
    }

    /// Returns true if the driver's timer query works: some drivers accept the query and always answer 0. The context
    /// must be current, and no `GL_TIME_ELAPSED` query may be active.
    ///
    /// # Errors
    /// [`Error::Gl`] if the driver makes no query object, or if OpenGL refuses the query.
    pub fn driver_has_one(gl: &Arc<glow::Context>) -> Result<bool, Error> {
        let mut timers = Timers::new(gl, true)?;
        timers.pass("nothing", || Ok(()))?;
        Ok(timers.take().iter().all(|time| time.gpu_ms.is_some()))
    }

    /// Returns the times of the passes that ran since the previous call, in the order in which they ran. Empty if the
    /// timers do not measure.
    #[must_use]
    pub fn take(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// Runs a pass. An OpenGL error during the pass is returned as an error at the place `name`.
    pub(crate) fn pass(&mut self, name: &'static str, run: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
        let groups = self.groups;
        if let Some(groups) = groups {
            groups.push(name);
        }
        let result = self.measured(name, run);
        if let Some(groups) = groups {
            groups.pop();
        }
        result
    }

    fn measured(&mut self, name: &'static str, run: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
        if !self.on {
            run()?;
            return check(&self.gl, name);
        }
        let gl = &self.gl;
        // SAFETY: the context is current, and no other TIME_ELAPSED query is active, since passes do not nest.
        unsafe {
            gl.finish();
            let start = Instant::now();
            if let Some(query) = self.query {
                gl.begin_query(glow::TIME_ELAPSED, query);
                // llvmpipe bins the begin mark together with the draws before it. Without the flush, a pass on a
                // framebuffer that was already bound would seem to take almost no time.
                gl.flush();
            }
            check(gl, "timer")?;
            let result = run().and_then(|()| check(gl, name));
            if self.query.is_some() {
                gl.end_query(glow::TIME_ELAPSED);
            }
            gl.finish();
            let wall_ms = start.elapsed().as_secs_f64() * 1e3;
            result?;
            let mut nanoseconds = 0u64;
            if let Some(query) = self.query {
                // glow 0.17's get_query_parameter_u64 calls an extension's function wherever a function of OpenGL 4.5
                // is missing. The function below calls OpenGL 3.3's glGetQueryObjectui64v, which takes the offset as an
                // address in memory when no query buffer is bound.
                let address = (&raw mut nanoseconds).expose_provenance();
                gl.get_query_parameter_u64_with_offset(query, glow::QUERY_RESULT, address);
            }
            check(gl, "timer")?;
            // A driver whose timer has 0 bits always answers 0.
            let gpu_ms = (nanoseconds > 0).then_some(nanoseconds as f64 / 1e6);
            self.times.push(PassTime { name, gpu_ms, wall_ms });
        }
        Ok(())
    }
}

impl Drop for Timers {
    fn drop(&mut self) {
        if let Some(query) = self.query {
            // SAFETY: the query is ours, and the context current by the contract of `gl`.
            unsafe { self.gl.delete_query(query) };
        }
    }
}
