//! Random choices that are the same in every run and on every machine.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;

/// A sequence of choices that is determined by its seed alone.
pub struct Draw(Pcg64Mcg);

impl Draw {
    pub fn new(seed: u128) -> Draw {
        Draw(Pcg64Mcg::new(seed))
    }

    /// Returns a number from 0 up to but not including 1.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number from -1 up to but not including 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Returns a whole number below `end`, or 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.0.next_u64() >> 33) as usize % end.max(1)
    }

    /// Returns one of the choices.
    pub fn one<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }
}
