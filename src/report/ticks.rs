//! Where the axes of plots have their labels, and how these are written. No two labels of an axis touch.

/// The largest number of labels that fit along an axis: each takes a share of 1 / `MOST` of its length.
const MOST: f64 = 9.0;

/// The digits at which the labels of a logarithmic axis may stand, the densest choice first.
const DIGITS: [&[f64]; 5] = [
    &[1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
    &[1.0, 2.0, 5.0],
    &[1.0, 3.0],
    &[1.0],
];

/// Returns the values at which a logarithmic axis from `low` to `high` has labels, in rising order. Both ends must be
/// positive and finite.
pub(crate) fn logarithmic(low: f64, high: f64) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let apart = |ticks: &[f64]| ticks.windows(2).all(|two| (two[1] / two[0]).ln() * MOST >= (high / low).ln());
    let at = |digits: &[f64], every: usize| -> Vec<f64> {
        let decades = decades.clone().step_by(every);
        // Written as text and read again, a label's value is the number that the label shows.
        let values = decades.flat_map(|decade| digits.iter().map(move |digit| format!("{digit}e{decade}")));
        values.filter_map(|text| text.parse().ok()).filter(|value| (low..=high).contains(value)).collect()
    };
    let dense = DIGITS.into_iter().map(|digits| at(digits, 1)).find(|ticks| apart(ticks));
    let sparse = || (2..).map(|every| at(&[1.0], every)).find(|ticks| apart(ticks));
    dense.or_else(sparse).unwrap_or_default()
}

/// Writes the value of a label with three significant digits at most.
pub(crate) fn label(value: f64) -> String {
    if value > 0.0 && value < 1e-3 || value >= 1e5 {
        return format!("{value:.0e}");
    }
    let digits = (2 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 4) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_a_logarithmic_axis_are_few_apart_and_inside_it() {
        for low in [3e-9, 0.004, 0.77, 1.0, 52.0] {
            for factor in [1.7, 2.0, 4.5, 10.0, 43.0, 400.0, 1e5, 1e9, 1e20] {
                let (high, ticks) = (low * factor, logarithmic(low, low * factor));
                assert!((2..=10).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
                assert!(ticks.iter().all(|tick| (low..=high).contains(tick)), "{ticks:?}");
                let least = ticks.windows(2).map(|two| (two[1] / two[0]).ln() / factor.ln()).fold(1.0, f64::min);
                assert!(least >= 1.0 / MOST, "{low} to {high}: {ticks:?}");
            }
        }
        assert_eq!(logarithmic(0.4, 30.0), [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
    }

    #[test]
    fn a_label_shows_its_value() {
        for (value, text) in [(0.0, "0"), (0.5, "0.5"), (20.0, "20"), (1e-4, "1e-4"), (1e5, "1e5"), (0.12, "0.12")] {
            assert_eq!(label(value), text);
        }
    }
}
