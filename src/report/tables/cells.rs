//! Formats numbers, times, sizes and counts for cells of tables.

use hbao::measure::bench::Case;
use hbao::measure::median;

/// Formats a number with this many decimal places, or as a dash if it is not finite.
pub(crate) fn number(x: f64, places: usize) -> String {
    if x.is_finite() { format!("{x:.places$}") } else { "-".into() }
}

/// Does the same for a number that may be missing; the result is then a dash.
pub(crate) fn optional(x: Option<f64>, places: usize) -> String {
    number(x.unwrap_or(f64::NAN), places)
}

/// Formats a share in percent, or as a dash if it is 0. The result is `100%` only if the share is 1.
pub(crate) fn percent(share: f64) -> String {
    match share {
        0.0 => "-".into(),
        1.0 => "100%".into(),
        _ => format!("{:.0}%", (100.0 * share).clamp(1.0, 99.0)),
    }
}

/// Returns the shortest and the longest of these times.
pub(crate) fn spread(times: &[f64]) -> (f64, f64) {
    times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &t| (low.min(t), high.max(t)))
}

/// Formats the median in milliseconds, followed by the difference of the farthest run from it in percent; a dash if no
/// pass was timed.
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

/// Formats the width and height of a case.
pub(crate) fn size_of(case: &Case) -> String {
    format!("{}x{}", case.size.0, case.size.1)
}

/// Formats the numbers of directions, rays and steps of a case, without those that are 1.
pub(crate) fn samples_of(case: &Case) -> String {
    match case.samples() {
        [1, 1, samples] => samples.to_string(),
        [directions, 1, steps] => format!("{directions} x {steps}"),
        [directions, rays, steps] => format!("{directions} x {rays} x {steps}"),
    }
}
