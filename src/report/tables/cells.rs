//! How numbers, times, sizes and counts are formatted in a cell.

use hbao::measure::bench::Case;
use hbao::measure::median;

/// A number with this many decimal places, or a dash for one that is not finite.
pub(crate) fn number(x: f64, places: usize) -> String {
    if x.is_finite() { format!("{x:.places$}") } else { "-".into() }
}

/// The same for a number that may be missing.
pub(crate) fn optional(x: Option<f64>, places: usize) -> String {
    number(x.unwrap_or(f64::NAN), places)
}

/// The shortest and the longest of these times.
pub(crate) fn spread(times: &[f64]) -> (f64, f64) {
    times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &t| (low.min(t), high.max(t)))
}

/// The median in milliseconds, and by how many percent the farthest run differs from it; a dash where no pass was
/// timed.
pub(crate) fn with_spread(times: &[f64]) -> String {
    let ((low, high), middle) = (spread(times), median(times));
    let farthest = (high - middle).max(middle - low) / middle * 100.0;
    match times.len() {
        // With no times, the maximum is the identity: less than any value.
        _ if high <= 0.0 => "-".into(),
        1 => format!("{middle:.2}"),
        _ => format!("{middle:.2} ±{farthest:.0}%"),
    }
}

/// A case's width and height.
pub(crate) fn size_of(case: &Case) -> String {
    format!("{}x{}", case.size.0, case.size.1)
}

/// A case's directions, rays and steps, without the factors that are 1.
pub(crate) fn samples_of(case: &Case) -> String {
    match case.samples() {
        [1, 1, samples] => samples.to_string(),
        [directions, 1, steps] => format!("{directions} x {steps}"),
        [directions, rays, steps] => format!("{directions} x {rays} x {steps}"),
    }
}
