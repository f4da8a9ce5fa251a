//! The view that a measurement renders.

use crate::scene::{Camera, Mesh};

/// A scene's triangles, the camera that sees them, and the size of the image.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// The triangles.
    pub mesh: &'a Mesh,
    /// The camera that sees the triangles.
    pub camera: &'a Camera,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
}
