//! What the papers claim and what can be measured of it: each claim has what was found and the rule that decides.

mod crysis;
mod geometry;
mod jitter_noise;
mod sampling;
mod speed;
mod targets;
mod test;

use test::Test;

/// Every test, those of the papers' first pages first.
pub(super) fn all() -> impl Iterator<Item = Test> {
    let chapters = [crysis::ALL, geometry::ALL, sampling::ALL, targets::ALL, speed::ALL];
    chapters.into_iter().flatten().copied()
}
