//! 'Numbers at their extremes': what float32 and the narrower formats do, where each breaks, and what is done about it.

mod axes;
mod cases;
mod measured;
mod page;

pub(super) use measured::{Extremes, measure};
