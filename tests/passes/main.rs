//! Tests that each pass does what the papers and the specification say. Each module tests one promise. All are compiled
//! into one program, so that shared code is compiled once and the tests keep every core busy.

#[path = "../rig/mod.rs"]
mod rig;

mod analytic;
mod bytes;
mod changes;
mod claims;
mod comparator;
mod context;
mod converged;
mod debug_output;
mod decomposition;
mod depth_slices;
mod edges;
mod exit;
mod extremes;
mod formats;
mod golden;
mod half_resolution;
mod inputs;
mod invariance;
mod materials;
mod off_centre;
mod output;
mod precision;
mod radius;
mod request;
mod shaders;
mod ssao;
mod state;
mod truth;
mod twins;
mod versions;
mod view;
