//! The equations of the passes in float64 on the CPU, without OpenGL: a twin of each pass under the name of its shader,
//! and ray casting on the triangles. They are written to be correct and to be read beside the shaders, not to be fast.
#![doc = include_str!("departures.md")]

pub mod anatomy;
mod attenuation;
pub mod blur;
mod converged;
pub mod edges;
pub mod gbuffer;
mod hbao;
mod hbao_talk;
pub mod hbao_view;
mod horizons;
mod inputs;
mod linear_depth;
mod microsphere;
mod observer;
mod ray_march;
mod rebuilt_normals;
mod sampling;
mod ssao;
mod terms;
pub mod trace;
pub mod truth;
mod twin;
mod visibility;

pub use converged::{converged, converges};
pub use inputs::TwinInputs;
pub use linear_depth::linear_depth;
pub use rebuilt_normals::rebuilt_normals;
pub use visibility::{ambiguous, visibility};
