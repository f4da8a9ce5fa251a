//! The screen-space ambient occlusion of 2008.

mod ambient_occlusion;
pub mod context;
mod error;
mod gl;
pub mod image;
pub mod measure;
mod pass;
mod pipeline;
pub mod reference;
pub mod scene;
pub mod settings;
mod tile;

pub use ambient_occlusion::{AmbientOcclusion, Inputs};
pub use error::Error;
pub use gl::{Format, PassTime, Timers, size_limit};
pub use pass::composite::Apply;
pub use pass::hbao::NormalEncoding;
pub use pass::{BACKGROUND_R16F, BACKGROUND_R32F, TextureRef, TextureTarget};
pub use pipeline::{Pipeline, Request};
pub use settings::Settings;
pub use tile::rotation_tile;
