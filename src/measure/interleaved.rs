//! Ambient occlusion timed in interleaved rounds, so that whatever slows the machine down for a while slows every
//! contender down alike.

use super::times::{is_ao, is_blur, sum};
use crate::{AmbientOcclusion, Error, Inputs, Timers};

/// Times passes in `runs` rounds through all of them, after one round that compiles the shaders and is not counted.
/// Returns the milliseconds of each, run by run. `progress` is called after each rendering.
pub(super) fn interleaved(
    passes: &mut [(AmbientOcclusion, Inputs)],
    timers: &mut Timers,
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Vec<f64>>, Error> {
    let mut times = vec![Vec::new(); passes.len()];
    for run in 0..=runs {
        for ((ao, inputs), times) in passes.iter_mut().zip(&mut times) {
            let ms = timed(ao, inputs, timers)?;
            if run > 0 {
                times.push(ms);
            }
            progress();
        }
    }
    Ok(times)
}

/// Renders once, and returns the milliseconds of ambient occlusion and its blur together.
pub(super) fn timed(ao: &mut AmbientOcclusion, inputs: &Inputs, timers: &mut Timers) -> Result<f64, Error> {
    ao.render_timed(inputs, timers)?;
    Ok(sum(&timers.take(), |pass| is_ao(pass) || is_blur(pass)))
}
