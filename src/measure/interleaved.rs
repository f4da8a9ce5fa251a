//! Times ambient occlusion in interleaved rounds. If something slows the machine down for a while, all contenders are
//! slowed down alike.

use super::times::{is_ao, is_blur, sum};
use crate::{AmbientOcclusion, Error, Inputs, Timers};

/// Times all `passes` in turn, in `runs` rounds. A first round, which compiles the shaders, is not counted. Returns,
/// for each of `passes`, the milliseconds of every run. `progress` is called after each rendering.
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
