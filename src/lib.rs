//! The screen-space ambient occlusion of 2008, as it ran on the GeForce 8: the horizon-based ambient occlusion of
//! Bavoil and Sainz (*ShaderX7* 6.2) on OpenGL 3.3 core, with a float64 twin of every pass that computes something.
//!
//! - To embed it in an application that owns a context and a G-buffer, use [`AmbientOcclusion`]; the example is below.
//! - To compute it from images in memory, such as another renderer wrote, use [`InputTextures`] and [`image::Layers`].
//! - To render a model without a display, use [`context::Context`], [`scene::Scene`] and [`Pipeline`].
//! - To compare its results with the equations, use [`mod@reference`].
//! - To read the results of the measurements, see [`measure`].
//!
//! The crate is not an interactive renderer, and it does not implement the ambient occlusion of today. It reproduces
//! what the papers describe, and [`mod@reference`] lists the places where it departs from them.
//!
//! # Features
//!
//! Without any feature the crate is [`AmbientOcclusion`] and its settings alone. `render` adds contexts, scenes, image
//! files, the pipeline, the twins and the measurements. `cli` adds the command. `flip` adds the error measure FLIP,
//! which needs a C++ compiler. `cli` and `flip` are on by default. `view` adds the window of `hbao view`.
//!
//! # Conventions
//!
//! Eye space is left-handed: x right, y up, z forward, so that a visible point has z > 0. Images in memory and textures
//! have their bottom row first, and files have their top row first. Ambient occlusion is stored as visibility, which
//! the papers and the comments call A: 1 means that nothing occludes, and 0 that everything does. Angles are radians
//! here, and degrees on the command line and in files.
#![cfg_attr(feature = "render", doc = include_str!("embedding.md"))]
#![doc = include_str!("passes.md")]
// Without `render`, a few functions that only the pipeline calls are unused, and the documentation's links to what
// `render` adds lead nowhere.
#![cfg_attr(not(feature = "render"), allow(dead_code, rustdoc::broken_intra_doc_links))]

mod ambient_occlusion;
#[cfg(feature = "render")]
pub mod context;
mod encoding;
mod error;
mod gl;
pub mod image;
#[cfg(feature = "render")]
pub mod measure;
mod pass;
#[cfg(feature = "render")]
mod pipeline;
mod projection;
#[cfg(feature = "render")]
pub mod reference;
#[cfg(feature = "render")]
pub mod scene;
pub mod settings;
#[cfg(feature = "render")]
mod threads;
mod tile;

pub use ambient_occlusion::{AmbientOcclusion, Destination, Finding, InputTextures, Inputs, Output, Viewport, Write};
pub use encoding::{ClipRange, DepthEncoding, NormalEncoding, NormalSpace};
pub use error::Error;
pub use gl::{Format, PassTime, Timers, check_size, size_limit};
#[cfg(feature = "render")]
pub use pass::composite::Apply;
#[cfg(feature = "render")]
pub use pass::probe::format_renders;
pub use pass::{BACKGROUND_R16F, BACKGROUND_R32F, DepthSamples, TextureRef, TextureTarget};
#[cfg(feature = "render")]
pub use pipeline::{Pipeline, Request};
pub use projection::{Extents, Hand, Projection, ProjectionMatrix};
pub use settings::Settings;
pub use tile::rotation_tile;

// These crates are re-exported because their types appear in the interface of this one. The versions match.
#[cfg(feature = "render")]
pub use glam;
pub use glow;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
