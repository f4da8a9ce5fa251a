//! The screen-space ambient occlusion of 2008.

pub mod context;
mod error;
pub mod image;
pub use error::Error;
