//! What ambient occlusion costs, measured. It sees a way to render and times, never a shader.

pub mod errors;
pub mod trade;
pub mod tune;

use crate::scene::{Camera, Mesh};
use crate::{AmbientOcclusion, Error, PassTime, Pipeline, Settings, Timers};
use std::ops::Add as _;
use std::sync::Arc;

/// A scene's passes timed, the AO pass against its fetch floor in interleaved pairs. Milliseconds, run by run; by the
/// driver's timer where it has one, else on the wall from a finished queue to a finished queue.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bench {
    /// Every pass of a frame.
    pub frame_ms: Vec<f64>,
    /// The AO pass.
    pub ao_ms: Vec<f64>,
    /// The AO pass with a sum in place of the arithmetic after each fetch ([`AmbientOcclusion::fetch_floor`]).
    pub floor_ms: Vec<f64>,
    /// The blur's passes together; 0 without a blur.
    pub blur_ms: Vec<f64>,
}

impl Bench {
    /// Times `runs` pairs of a frame and the floor on the same G-buffer, after one of each that compiles the shaders
    /// and is not counted. `pipeline` must have been made with timings, for `size` and `settings`.
    ///
    /// # Errors
    /// What the driver refuses.
    pub fn run(
        gl: &Arc<glow::Context>,
        pipeline: &mut Pipeline,
        (mesh, camera): (&Mesh, &Camera),
        size: (u32, u32),
        settings: &Settings,
        runs: usize,
    ) -> Result<Bench, Error> {
        let mut floor = AmbientOcclusion::fetch_floor(gl.clone(), size, settings)?;
        let mut timers = Timers::new(gl, true)?;
        let mut bench = Bench::default();
        for run in 0..=runs {
            let frame = pipeline.render(mesh, camera)?;
            floor.render_timed(&pipeline.inputs(camera), &mut timers)?;
            let floor = timers.take();
            if run > 0 {
                bench.frame_ms.push(sum(&frame, |_| true));
                bench.ao_ms.push(sum(&frame, |name| name == "ao"));
                bench.floor_ms.push(sum(&floor, |name| name == "ao"));
                bench.blur_ms.push(sum(&frame, |name| name.starts_with("blur")));
            }
        }
        Ok(bench)
    }

    /// AO's time over its floor's: the median over the pairs.
    pub fn ratio(&self) -> f64 {
        median(&self.ao_ms.iter().zip(&self.floor_ms).map(|(ao, floor)| ao / floor).collect::<Vec<_>>())
    }
}

fn sum(times: &[PassTime], wanted: impl Fn(&str) -> bool) -> f64 {
    // From 0, since an empty sum is -0.
    times.iter().filter(|time| wanted(time.name)).map(|time| time.gpu_ms.unwrap_or(time.wall_ms)).fold(0.0, f64::add)
}

/// The middle of the values, or the mean of the two in the middle; NaN of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => sorted[middle - 1].midpoint(sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_whatever_the_order() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), 2.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn the_ratio_is_taken_pair_by_pair() {
        let bench = Bench { ao_ms: vec![2.0, 30.0, 8.0], floor_ms: vec![1.0, 10.0, 2.0], ..Bench::default() };
        assert_eq!(bench.ratio(), 3.0);
    }
}
