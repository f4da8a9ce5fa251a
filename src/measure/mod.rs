//! Measures what ambient occlusion costs and how accurate it is. This module works on images and numbers and renders
//! through the pipeline; it never deals with a shader.
#![doc = include_str!("claims.md")]
#![doc = include_str!("drivers.md")]

pub mod bench;
mod counts;
pub mod decomposition;
pub mod difference;
pub mod errors;
mod gbuffers;
mod interleaved;
pub mod precision;
pub mod published;
pub mod ratios;
mod reach;
mod shot;
mod strength;
pub mod table;
mod times;
pub mod trade;
mod truth_image;
pub mod tune;

pub use counts::{blur_width, directions_rays_steps};
pub use reach::{MOST_EXITS, Reach};
pub use shot::Shot;
pub use strength::BestStrength;
pub use times::{blur_ms, median};
pub use truth_image::TruthImage;
