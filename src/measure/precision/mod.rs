//! What float32 and narrower formats do to an image: each pass is compared with the same equations in float64.
//!
//! A pass is compared with its twin twice. On the images that the GPU itself made, the difference is the pass's own
//! arithmetic. On what rays meet in float64, where nothing was rounded on the way, the difference is the error of all
//! passes up to this one.
#![doc = include_str!("../extremes.md")]

mod as_drawn;
mod comparison;
mod depth_gaps;
mod spread;

pub use comparison::{Comparer, Images, Precision, biased};
pub use depth_gaps::{DepthPlanes, unresolved_gap};
pub use spread::Spread;
