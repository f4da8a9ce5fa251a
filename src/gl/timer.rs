//! How long passes take: OpenGL timer queries, and the clock on the wall around finished work.

use super::{check, not_made};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;
use std::time::Instant;

/// One pass's time.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PassTime {
    /// The pass.
    pub name: &'static str,
    /// Milliseconds by the driver's timer query; none where it has no timer.
    pub gpu_ms: Option<f64>,
    /// Milliseconds from a finished queue to a finished queue.
    pub wall_ms: f64,
}

/// Times passes, when it is asked to; without, passes are only run.
pub struct Timers {
    gl: Arc<glow::Context>,
    on: bool,
    query: Option<glow::Query>,
    times: Vec<PassTime>,
}

impl Timers {
    /// Timers that time (`on`), or that only run what they are given.
    ///
    /// # Errors
    /// Where the driver makes no query object.
    pub fn new(gl: &Arc<glow::Context>, on: bool) -> Result<Timers, Error> {
        let mut query = None;
        if on {
            // SAFETY: the context is current.
            query = Some(unsafe { gl.create_query() }.map_err(|_| not_made(gl, "timer"))?);
        }
        Ok(Timers { gl: gl.clone(), on, query, times: Vec::new() })
    }

    /// True where the driver's timer sees time pass. The context must be current, and no query of elapsed time under
    /// way.
    ///
    /// # Errors
    /// As [`Timers::new`].
    pub fn driver_has_one(gl: &Arc<glow::Context>) -> Result<bool, Error> {
        let mut timers = Timers::new(gl, true)?;
        timers.pass("nothing", || Ok(()))?;
        Ok(timers.take().iter().all(|time| time.gpu_ms.is_some()))
    }

    /// The times of the passes run since it was last asked, in their order.
    #[must_use]
    pub fn take(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// Runs a pass. What OpenGL has against it is an error in the pass's name.
    pub(crate) fn pass(&mut self, name: &'static str, run: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
        if !self.on {
            run()?;
            return check(&self.gl, name);
        }
        let gl = &self.gl;
        // SAFETY: the context is current, and no other TIME_ELAPSED query is under way: passes do not nest.
        unsafe {
            gl.finish();
            let start = Instant::now();
            if let Some(query) = self.query {
                gl.begin_query(glow::TIME_ELAPSED, query);
                // llvmpipe bins the begin mark into the scene under way: without the flush, a pass on the framebuffer
                // that is already bound would read as next to nothing.
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
                // glow 0.17's get_query_parameter_u64 calls an extension's function wherever one of OpenGL 4.5 is
                // missing. This one calls OpenGL 3.3's, to which the offset is the address when no buffer is bound.
                let address = (&raw mut nanoseconds).expose_provenance();
                gl.get_query_parameter_u64_with_offset(query, glow::QUERY_RESULT, address);
            }
            check(gl, "timer")?;
            // A driver whose timer has no bits answers 0.
            let gpu_ms = (nanoseconds > 0).then_some(nanoseconds as f64 / 1e6);
            self.times.push(PassTime { name, gpu_ms, wall_ms });
        }
        Ok(())
    }
}

impl Drop for Timers {
    fn drop(&mut self) {
        if let Some(query) = self.query {
            // SAFETY: the query is ours, and the context current by the room's contract.
            unsafe { self.gl.delete_query(query) };
        }
    }
}
