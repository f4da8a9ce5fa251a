//! The screen-space ambient occlusion of 2008.

mod error;
pub mod image;
pub mod scene;
pub use error::Error;
