//! Tests of the papers' claims. Each test measures a claim, and returns the measurements and the rule that decides
//! whether the claim holds.

mod crysis;
mod geometry;
mod jitter_noise;
mod parts;
mod sampling;
mod speed;
mod targets;
mod test;

use test::Test;

/// Returns every test, in the order of the papers' pages.
pub(super) fn all() -> impl Iterator<Item = Test> {
    let chapters = [crysis::ALL, geometry::ALL, sampling::ALL, parts::ALL, targets::ALL, speed::ALL];
    chapters.into_iter().flatten().copied()
}
