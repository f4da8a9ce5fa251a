//! Measures what float32 and narrower formats do to an image, by comparing each pass with the same equations in
//! float64.
//!
//! A pass is compared with its twin twice. In the first comparison the twin reads the images that the GPU made, and the
//! difference is the error of the pass's own arithmetic. In the second the twin reads the surfaces that rays meet in
//! float64, unrounded, and the difference is the error of all passes up to this one.
#![doc = include_str!("../extremes.md")]

mod as_drawn;
mod comparison;
mod depth_gaps;
mod spread;

pub use comparison::{Comparer, Images, Precision, biased};
pub use depth_gaps::{DepthPlanes, unresolved_gap};
pub use spread::Spread;
