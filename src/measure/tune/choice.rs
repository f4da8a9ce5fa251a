//! The goal of a search, and the choice of the answer among the timed combinations of settings.

/// The goal of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Find the combination with the least time whose RMSE is at most this.
    MaxError(f64),
    /// Find the combination with the least RMSE that takes at most this many milliseconds.
    MaxMs(f64),
}

impl Goal {
    /// Returns the limited quantity divided by its limit.
    pub(super) fn share(self, ms: f64, rmse: f64) -> f64 {
        match self {
            Goal::MaxError(limit) => rmse / limit,
            Goal::MaxMs(limit) => ms / limit,
        }
    }

    /// Returns the quantity to be minimised.
    pub(super) fn sought(self, ms: f64, rmse: f64) -> f64 {
        match self {
            Goal::MaxError(_) => ms,
            Goal::MaxMs(_) => rmse,
        }
    }
}

/// The measured RMSE of a combination, and the median and upper quartile of its times. The choice is made from these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The RMSE relative to the truth.
    pub rmse: f64,
    /// The median of the runs, in milliseconds.
    pub ms: f64,
    /// The upper quartile of the runs, in milliseconds. Times up to it are within the noise of the median.
    pub upper_ms: f64,
}

impl Measured {
    /// Returns the RMSE rounded to 4 decimal places, as tables show it, in units of 0.0001.
    fn shown(&self) -> i64 {
        (self.rmse * 1e4).round() as i64
    }

    /// Orders the more accurate before the less accurate, and the faster before the slower if their rounded RMSEs are
    /// equal.
    fn by_error(&self, other: &Measured) -> std::cmp::Ordering {
        self.shown().cmp(&other.shown()).then(self.ms.total_cmp(&other.ms))
    }
}

/// Returns the index of the answer, if there is one.
///
/// If the error is limited, all combinations that reach the error and whose median time is at most the upper quartile
/// of the fastest one's times count as equally fast, because times are noisy and the RMSE is not. The answer is the
/// most accurate of these. If the time is limited, the answer is the most accurate combination whose median time is
/// within the limit. RMSEs that are equal when rounded to 4 decimal places count as equally accurate, and the fastest
/// of these is the answer.
pub fn choose(goal: Goal, measured: &[Measured]) -> Option<usize> {
    let meets = |one: &Measured| goal.share(one.ms, one.rmse) <= 1.0;
    let within = match goal {
        Goal::MaxError(_) => {
            let meeting = measured.iter().filter(|one| meets(one));
            meeting.min_by(|a, b| a.ms.total_cmp(&b.ms))?.upper_ms
        }
        Goal::MaxMs(limit) => limit,
    };
    let answers = (0..measured.len()).filter(|&i| meets(&measured[i]) && measured[i].ms <= within);
    answers.min_by(|&a, &b| measured[a].by_error(&measured[b]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measurements without noise, from pairs of RMSE and median.
    fn exact(points: &[(f64, f64)]) -> Vec<Measured> {
        points.iter().map(|&(rmse, ms)| Measured { rmse, ms, upper_ms: ms }).collect()
    }

    #[test]
    fn the_cheapest_within_an_error_and_the_most_accurate_within_a_time() {
        let rows = exact(&[(0.2, 1.0), (0.1, 5.0), (0.12, 3.0), (0.11, 4.0), (0.05, 20.0)]);
        for (limit, expected) in [(0.3, Some(0)), (0.2, Some(0)), (0.19, Some(2)), (0.1, Some(1)), (0.04, None)] {
            assert_eq!(choose(Goal::MaxError(limit), &rows), expected, "{limit}");
        }
        for (limit, expected) in [(0.5, None), (1.0, Some(0)), (3.9, Some(2)), (5.0, Some(1)), (1e9, Some(4))] {
            assert_eq!(choose(Goal::MaxMs(limit), &rows), expected, "{limit}");
        }
        assert_eq!(choose(Goal::MaxError(1.0), &[]), None);
    }

    #[test]
    fn a_looser_limit_never_costs_more() {
        let rows = exact(&[(0.21, 1.0), (0.1, 5.5), (0.12, 3.0), (0.11, 4.0), (0.05, 20.0), (0.3, 0.0)]);
        let mut last = (f64::INFINITY, f64::INFINITY);
        for step in 1..40 {
            let of = |goal| choose(goal, &rows).map_or((f64::INFINITY, f64::INFINITY), |i| (rows[i].ms, rows[i].rmse));
            let now = (of(Goal::MaxError(0.01 * f64::from(step))).0, of(Goal::MaxMs(0.6 * f64::from(step))).1);
            assert!(now.0 <= last.0 && now.1 <= last.1, "{now:?} after {last:?}");
            last = now;
        }
        assert_eq!(last, (0.0, 0.05));
    }

    #[test]
    fn within_the_noise_of_the_fastest_the_most_accurate_is_taken() {
        let mut rows = exact(&[(0.2, 10.0), (0.1, 10.4), (0.05, 12.0)]);
        assert_eq!(choose(Goal::MaxError(0.3), &rows), Some(0));
        rows[0].upper_ms = 10.5;
        assert_eq!(choose(Goal::MaxError(0.3), &rows), Some(1));
        // Only combinations that reach the error take part in this choice.
        assert_eq!(choose(Goal::MaxError(0.15), &rows), Some(1));
        rows[1].rmse = 0.4;
        assert_eq!(choose(Goal::MaxError(0.3), &rows), Some(0));
    }

    #[test]
    fn errors_that_read_alike_are_alike() {
        let rows = exact(&[(0.100_01, 2.0), (0.100_04, 1.0), (0.1001, 0.5)]);
        assert_eq!(choose(Goal::MaxMs(9.0), &rows), Some(1));
    }
}
