//! The images that the twins read.

use crate::image::Image;
use crate::projection::Projection;

/// The images that ambient occlusion is computed from. Depth and normals have the same size, with the bottom row first.
/// With `F = f32` they hold what a G-buffer holds; with `F = f64` nothing has been rounded yet.
#[derive(Clone, Copy)]
pub struct TwinInputs<'a, F = f32> {
    /// Linear eye-space z in scene units, +infinity on background.
    pub depth: &'a Image<F>,
    /// Eye-space normals of any length.
    pub normals: &'a Image<[F; 3]>,
    /// The 4x4 rotation tile for the method of the settings ([`crate::rotation_tile`]).
    pub tile: &'a Image<[f32; 3]>,
    /// The projection of the view.
    pub projection: Projection,
    /// The near plane's z in scene units, at which the rays of `ray-march` end. No other method reads it.
    pub near: f64,
}
