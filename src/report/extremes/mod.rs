//! 'Numbers at their extremes': measures what float32 and the narrower formats do to images, where each breaks down,
//! and what is done about it.

mod axes;
mod cases;
mod measured;
mod page;

pub(super) use measured::{Extremes, measure};
