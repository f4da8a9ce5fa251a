//! Each pass does what the papers and the specification say: one module for each promise, all in one program, so that
//! what they share is compiled once and their tests fill every core.

#[path = "../rig/mod.rs"]
mod rig;

mod analytic;
mod claims;
mod comparator;
mod context;
mod converged;
mod debug_output;
mod decomposition;
mod depth_slices;
mod edges;
mod extremes;
mod golden;
mod half_resolution;
mod invariance;
mod precision;
mod shaders;
mod ssao;
mod state;
mod truth;
mod twins;
