//! A claim of the papers, the rule that decides whether it holds, and its verdict.

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Holds,
    InPart,
    DoesNotHold,
    /// No scene was suitable for measuring it.
    NotMeasured,
}

impl Verdict {
    pub(super) fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::InPart => "holds in part",
            Verdict::DoesNotHold => "does not hold",
            Verdict::NotMeasured => "not measured",
        }
    }

    /// Returns the name of the verdict's class in the page's style sheet.
    pub(super) fn class(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::InPart => "in-part",
            Verdict::DoesNotHold => "does-not-hold",
            Verdict::NotMeasured => "not-measured",
        }
    }
}

/// What was measured for a claim in one scene.
pub(super) struct Found {
    pub(super) scene: String,
    pub(super) text: String,
    /// The number that the rule compares with its bounds.
    pub(super) value: f64,
    pub(super) verdict: Verdict,
}

/// A claim of the papers in our words, and what was measured for it.
#[derive(Default)]
pub(super) struct Claim {
    pub(super) id: &'static str,
    pub(super) says: &'static str,
    pub(super) source: &'static str,
    pub(super) found: Vec<Found>,
    pub(super) rule: String,
    pub(super) note: String,
    /// Why nothing was measured, for a claim without measurements.
    pub(super) unmeasured: Option<String>,
}

impl Claim {
    /// Returns the verdict on the claim. It holds if it holds in every scene, does not hold if it holds in no scene
    /// even in part, and holds in part otherwise.
    pub(super) fn verdict(&self) -> Verdict {
        let all = |verdict| self.found.iter().all(|found| found.verdict == verdict);
        match () {
            () if self.found.is_empty() => Verdict::NotMeasured,
            () if all(Verdict::Holds) => Verdict::Holds,
            () if all(Verdict::DoesNotHold) => Verdict::DoesNotHold,
            () => Verdict::InPart,
        }
    }
}

/// The two bounds that a number is compared with.
#[derive(Clone, Copy)]
pub(super) struct Bound {
    /// The bound within which the claim holds.
    pub(super) holds: f64,
    /// The bound within which the claim holds in part.
    part: f64,
    /// True if the bounds are upper bounds, false if they are lower bounds.
    at_most: bool,
}

/// Makes upper bounds.
pub(super) fn at_most(holds: f64, part: f64) -> Bound {
    Bound { holds, part, at_most: true }
}

/// Makes lower bounds.
pub(super) fn at_least(holds: f64, part: f64) -> Bound {
    Bound { holds, part, at_most: false }
}

impl Bound {
    /// Returns the verdict on a value.
    pub(super) fn verdict(self, value: f64) -> Verdict {
        let within = |bound: f64| if self.at_most { value <= bound } else { value >= bound };
        match () {
            () if within(self.holds) => Verdict::Holds,
            () if within(self.part) => Verdict::InPart,
            // NaN is within no bound.
            () => Verdict::DoesNotHold,
        }
    }

    /// Returns the rule in words, with numbers as `show` formats them.
    pub(super) fn rule(self, what: &str, show: impl Fn(f64) -> String) -> String {
        let word = if self.at_most { "at most" } else { "at least" };
        let holds = format!("holds where {what} is {word} {}", show(self.holds));
        if self.part == self.holds { holds } else { format!("{holds}, in part {word} {}", show(self.part)) }
    }

    /// Records what was measured in a scene, with the verdict on its value.
    pub(super) fn found(self, scene: impl Into<String>, value: f64, text: String) -> Found {
        Found { scene: scene.into(), text, value, verdict: self.verdict(value) }
    }
}

/// Formats a visibility in steps of an 8-bit target.
pub(super) fn steps(visibility: f64) -> String {
    format!("{:.2}/255", visibility * 255.0)
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.0} %", share * 100.0)
}

pub(super) fn decimal(value: f64) -> String {
    format!("{value:.3}")
}

pub(super) fn times(factor: f64) -> String {
    format!("{factor:.2}x")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_as_good_as_its_scenes_together() {
        let bound = at_most(1.0, 2.0);
        let claim = |values: &[f64]| {
            let found = values.iter().map(|&value| bound.found("scene", value, String::new())).collect();
            Claim { found, ..Claim::default() }.verdict()
        };
        assert_eq!(claim(&[1.0, 0.0]), Verdict::Holds);
        assert_eq!(claim(&[1.0, 3.0]), Verdict::InPart);
        assert_eq!(claim(&[1.5, 1.5]), Verdict::InPart);
        assert_eq!(claim(&[3.0, f64::NAN]), Verdict::DoesNotHold);
        assert_eq!(claim(&[]), Verdict::NotMeasured);
        assert_eq!(at_least(2.0, 1.0).verdict(1.5), Verdict::InPart);
    }

    #[test]
    fn a_rule_says_the_bounds_that_decide() {
        assert_eq!(at_most(0.5, 0.75).rule("it", percent), "holds where it is at most 50 %, in part at most 75 %");
        assert_eq!(at_least(1.0, 1.0).rule("it", decimal), "holds where it is at least 1.000");
    }
}
