//! Times ambient occlusion in interleaved rounds. If something slows the machine down for a while, all contenders are
//! slowed down alike.

use super::times::{is_ao, is_blur, sum};
use crate::{AmbientOcclusion, Error, Inputs, Timers};

/// The time of one rendering, in milliseconds.
#[derive(Clone, Copy)]
pub(super) struct Timed {
    /// The time of ambient occlusion and its blur together.
    pub(super) ms: f64,
    /// The time of ambient occlusion alone.
    pub(super) ao_ms: f64,
}

/// Times all `passes` in turn, in `runs` rounds. A first round, which compiles the shaders, is not counted. Returns,
/// for each of `passes`, the time of every run. `progress` is called after each rendering.
pub(super) fn interleaved(
    passes: &mut [(AmbientOcclusion, Inputs)],
    timers: &mut Timers,
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Vec<Timed>>, Error> {
    let mut times = vec![Vec::new(); passes.len()];
    for run in 0..=runs {
        for ((ao, inputs), times) in passes.iter_mut().zip(&mut times) {
            let timed = timed(ao, inputs, timers)?;
            if run > 0 {
                times.push(timed);
            }
            progress();
        }
    }
    Ok(times)
}

/// Renders once, and returns how long it took.
pub(super) fn timed(ao: &mut AmbientOcclusion, inputs: &Inputs, timers: &mut Timers) -> Result<Timed, Error> {
    ao.render_timed(inputs, timers)?;
    let times = timers.take();
    Ok(Timed { ms: sum(&times, |pass| is_ao(pass) || is_blur(pass)), ao_ms: sum(&times, is_ao) })
}
