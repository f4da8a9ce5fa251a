//! Finds the power with which a cost grows.

/// Returns the power p with which y grows as x^p. It is fitted by least squares to the logarithms of the points (x, y).
/// `None` if x does not vary, or if a coordinate is not above 0.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    if points.iter().all(|point| point.0 == points[0].0) {
        return None;
    }
    let logs: Vec<_> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = logs.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let both: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = logs.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum();
    Some(both / square).filter(|slope| slope.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_is_the_slope_in_logarithms() {
        let power = |p: f64| [0.5, 1.0, 7.0, 30.0].map(|x: f64| (x, 3.0 * x.powf(p)));
        for p in [-1.0, 0.0, 0.5, 1.0, 2.0] {
            assert!((exponent(&power(p)).unwrap() - p).abs() < 1e-12);
        }
        // These points lie on two parallel lines of slope 1, and the fit lies between them.
        let scattered = [(1.0, 2.0), (1.0, 0.5), (4.0, 8.0), (4.0, 2.0)];
        assert!((exponent(&scattered).unwrap() - 1.0).abs() < 1e-12);
        for none in
            [&[][..], &[(2.0, 3.0)], &[(0.1, 1.0); 7], &[(1.0, 0.0), (2.0, 1.0)], &[(1.0, f64::NAN), (2.0, 1.0)]]
        {
            assert_eq!(exponent(none), None, "{none:?}");
        }
    }
}
