//! What ambient occlusion costs, measured. It sees a way to render and times, never a shader.
#![doc = include_str!("claims.md")]
#![doc = include_str!("drivers.md")]

pub mod bench;
pub mod decomposition;
pub mod errors;
pub mod precision;
pub mod published;
pub mod ratios;
pub mod trade;
pub mod tune;

use crate::PassTime;
use std::ops::Add as _;

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
}
