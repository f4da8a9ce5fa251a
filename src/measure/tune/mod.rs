//! Searches for the settings that suit a view: the cheapest within an error, or the most accurate within a time.
//!
//! The G-buffer of a view alone already rules out some combinations of settings ([`Requirements`]). Each remaining
//! combination is rendered once for its error, those with the least work first; once is enough, because the error is
//! the same in every run. Combinations that can still win are timed roughly, and those near the goal are varied in one
//! setting at a time. At last the contenders, which may win, are timed in interleaved rounds, and the best of them, the
//! finalists, are timed for longer. The search does not prove that its answer is the best: it never tries combinations
//! that are far from all those near the goal.
#![doc = include_str!("../tuned.md")]

pub mod choice;
mod contest;
mod requirements;
mod search;
mod space;
mod stage;
mod verdict;

pub use requirements::Requirements;
pub use search::Tuner;
pub use verdict::{Tried, Tuned, Verdict};
