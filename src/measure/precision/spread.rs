//! Summarises how large differences are over many pixels.

/// How large the differences at some pixels are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The difference that 99.9 % of the pixels do not exceed.
    pub most: f64,
    /// The largest difference.
    pub max: f64,
    /// How many pixels were compared.
    pub pixels: usize,
}

impl Spread {
    /// Computes the spread of differences of either sign. Without differences every field is 0. NaN counts as infinite.
    pub fn of(differences: impl IntoIterator<Item = f64>) -> Spread {
        let sizes = differences.into_iter().map(|d| if d.is_nan() { f64::INFINITY } else { d.abs() });
        let mut sizes: Vec<f64> = sizes.collect();
        sizes.sort_by(f64::total_cmp);
        let Some(&max) = sizes.last() else { return Spread::default() };
        let count = sizes.len();
        Spread {
            rmse: (sizes.iter().map(|d| d * d).sum::<f64>() / count as f64).sqrt(),
            most: sizes[(count * 999).div_ceil(1000) - 1],
            max,
            pixels: count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_of_the_sizes_and_its_most_leaves_a_thousandth_out() {
        let mut all = vec![-1.0; 998];
        all.extend([2.0, -7.0]);
        let spread = Spread::of(all);
        assert_eq!((spread.most, spread.max, spread.pixels), (2.0, 7.0, 1000));
        assert!((spread.rmse - ((998.0 + 4.0 + 49.0) / 1000.0f64).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of([]), Spread::default());
        assert_eq!(Spread::of([0.0, f64::NAN]).max, f64::INFINITY);
    }
}
