//! The screen-space ambient occlusion of 2008, as it ran on the GeForce 8: the horizon-based ambient occlusion of
//! Bavoil and Sainz (*ShaderX7* 6.2) on OpenGL 3.3 core, with a float64 twin of every pass.
//!
//! - To embed it in an application that owns a context and a G-buffer: [`AmbientOcclusion`].
//! - To render a model with it, headless: [`context::Context`], [`scene::Scene`], [`Pipeline`].
//! - To compare it with its equations: [`mod@reference`].
//!
//! It is not an interactive renderer, and not an ambient occlusion of today's kind: it reproduces what the papers
//! describe, and says where it departs from them (README, 'Where we depart from 2008').
//!
//! # Conventions
//!
//! Eye space is left-handed: x right, y up, z forward, so a visible point has z > 0. Images in memory and textures
//! have their bottom row first, files their top row. Ambient occlusion is visibility: 1 is open, 0 is closed. Angles
//! are radians here, degrees on the command line and in files.
//!
//! The README's example, which is run as a test, shows how to embed it.

// Without `render` the rooms that the pipeline shares with the AO pass hold a few functions that only the pipeline calls.
#![cfg_attr(not(feature = "render"), allow(dead_code))]

mod ambient_occlusion;
#[cfg(feature = "render")]
pub mod context;
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
mod tile;

pub use ambient_occlusion::{AmbientOcclusion, Inputs};
pub use error::Error;
pub use gl::{Format, PassTime, Timers, check_size, size_limit};
#[cfg(feature = "render")]
pub use pass::composite::Apply;
pub use pass::method::NormalEncoding;
#[cfg(feature = "render")]
pub use pass::probe::format_renders;
pub use pass::{BACKGROUND_R16F, BACKGROUND_R32F, DepthSamples, TextureRef, TextureTarget};
#[cfg(feature = "render")]
pub use pipeline::{Pipeline, Request};
pub use projection::Projection;
pub use settings::Settings;
pub use tile::rotation_tile;

// The crates whose types stand in this one's interface, in the versions that fit.
#[cfg(feature = "render")]
pub use glam;
pub use glow;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
