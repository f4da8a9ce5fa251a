//! The search for the settings that a view needs: the cheapest within an error, or the most accurate within a time.
//!
//! Some of what a view needs is known before anything is rendered ([`Requirements`]). Each of the remaining settings is
//! rendered once, in the order of their work, because their error does not depend on time. Those that can still win are
//! timed roughly, and those near the goal are varied knob by knob. At last the contenders are timed in interleaved
//! rounds, and the finalists among them for longer. The search proves nothing: it never looks at settings that are far
//! from all those near the goal.
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
