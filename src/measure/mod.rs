//! What ambient occlusion costs, measured.

use crate::{AmbientOcclusion, Error, Inputs, Settings, Timers};
use std::sync::Arc;

/// The AO pass timed against its fetch floor, in interleaved pairs. Milliseconds; by the driver's timer where it has
/// one, else on the wall.
#[derive(Clone, Debug, PartialEq)]
pub struct AgainstFloor {
    /// The pass, run by run.
    pub ao_ms: Vec<f64>,
    /// The same shader with a sum in place of the arithmetic after each fetch ([`AmbientOcclusion::fetch_floor`]).
    pub floor_ms: Vec<f64>,
    /// The blur's passes together, run by run; 0 without a blur.
    pub blur_ms: Vec<f64>,
}

impl AgainstFloor {
    /// Runs `pairs` of the two on the same inputs, after one of each that compiles and is not counted.
    ///
    /// # Errors
    /// What the driver refuses.
    pub fn measure(
        gl: &Arc<glow::Context>,
        inputs: &Inputs,
        size: (u32, u32),
        settings: &Settings,
        pairs: usize,
    ) -> Result<AgainstFloor, Error> {
        let mut ao = AmbientOcclusion::new(gl.clone(), size, settings)?;
        let mut floor = AmbientOcclusion::fetch_floor(gl.clone(), size, settings)?;
        let mut timers = Timers::new(gl, true)?;
        ao.render(inputs)?;
        floor.render(inputs)?;
        let mut result = AgainstFloor { ao_ms: Vec::new(), floor_ms: Vec::new(), blur_ms: Vec::new() };
        for _ in 0..pairs {
            floor.render_timed(inputs, &mut timers)?;
            result.floor_ms.push(sum(&mut timers, |name| name == "ao"));
            ao.render_timed(inputs, &mut timers)?;
            let times = timers.take();
            let of = |wanted: &dyn Fn(&str) -> bool| -> f64 {
                times.iter().filter(|t| wanted(t.name)).map(|t| t.gpu_ms.unwrap_or(t.wall_ms)).sum()
            };
            result.ao_ms.push(of(&|name| name == "ao"));
            result.blur_ms.push(of(&|name| name.starts_with("blur")));
        }
        Ok(result)
    }

    /// The median over the pairs of AO's time divided by its floor's.
    pub fn ratio(&self) -> f64 {
        median(&self.ao_ms.iter().zip(&self.floor_ms).map(|(ao, floor)| ao / floor).collect::<Vec<_>>())
    }
}

fn sum(timers: &mut Timers, wanted: impl Fn(&str) -> bool) -> f64 {
    timers.take().iter().filter(|t| wanted(t.name)).map(|t| t.gpu_ms.unwrap_or(t.wall_ms)).sum()
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
