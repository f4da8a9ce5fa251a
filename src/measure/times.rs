//! Computes sums and medians of measured times.

use crate::PassTime;
use std::ops::Add as _;

/// Adds up the milliseconds of the passes whose name is `wanted`. The times are those of the driver's timer, or of the
/// system's clock if the driver has none.
pub(super) fn sum(times: &[PassTime], wanted: impl Fn(&str) -> bool) -> f64 {
    // The fold starts from 0, because `sum()` of an empty list is -0.
    times.iter().filter(|time| wanted(time.name)).map(|time| time.gpu_ms.unwrap_or(time.wall_ms)).fold(0.0, f64::add)
}

/// Returns whether the pass of this name computes ambient occlusion, or makes the half-size depth that it reads.
pub(super) fn is_ao(pass: &str) -> bool {
    matches!(pass, "half_depth" | "ao")
}

/// Returns whether the pass of this name belongs to the blur.
pub(super) fn is_blur(pass: &str) -> bool {
    pass.starts_with("blur")
}

/// Returns the milliseconds of the blur's passes together.
#[must_use]
pub fn blur_ms(times: &[PassTime]) -> f64 {
    sum(times, is_blur)
}

/// Returns the median: the middle value, or the mean of the two middle values. The median of no values is NaN.
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
