//! What the twins read.

use crate::image::Image;
use crate::projection::Projection;

/// The images that ambient occlusion is computed from, all of one size. In float32 they are what a G-buffer holds; in
/// float64 nothing has been rounded yet.
#[derive(Clone, Copy)]
pub struct Inputs<'a, F = f32> {
    /// Linear eye-space z; infinite on background.
    pub depth: &'a Image<F>,
    /// Eye-space normals, of any length.
    pub normals: &'a Image<[F; 3]>,
    /// The 4x4 rotation tile, of the settings' method ([`crate::rotation_tile`]).
    pub tile: &'a Image<[f32; 3]>,
    /// The view's projection.
    pub projection: Projection,
    /// The near plane's z, for `ray-march`.
    pub near: f64,
}
