//! The projection of a view from eye space to the picture.

/// How eye space is projected to the picture. The view's axis goes through the middle of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective: all rays start at the eye. At z = 1 the picture reaches from -tan(fov/2) to tan(fov/2) in x and y.
    Perspective {
        /// tan(fov_x/2), above 0; fov_x is the horizontal field of view.
        tan_half_fov_x: f64,
        /// tan(fov_y/2), above 0; fov_y is the vertical field of view.
        tan_half_fov_y: f64,
    },
    /// Orthographic: all rays are parallel.
    Orthographic {
        /// Half the picture's width in scene units, above 0.
        half_width: f64,
        /// Half the picture's height in scene units, above 0.
        half_height: f64,
    },
}

impl Projection {
    /// Returns half the picture's width and height. In perspective they are measured at z = 1; in an orthographic view
    /// they are the same at every depth, in scene units.
    #[must_use]
    pub fn half_extents(&self) -> [f64; 2] {
        match *self {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => [tan_half_fov_x, tan_half_fov_y],
            Projection::Orthographic { half_width, half_height } => [half_width, half_height],
        }
    }

    /// Returns half the picture's width and height at depth z, in scene units.
    #[must_use]
    pub fn half_extents_at(&self, z: f64) -> [f64; 2] {
        let scale = if self.is_perspective() { z } else { 1.0 };
        self.half_extents().map(|half| half * scale)
    }

    /// Returns whether the projection is perspective, so that rays start at the eye and do not run in parallel.
    #[must_use]
    pub fn is_perspective(&self) -> bool {
        matches!(self, Projection::Perspective { .. })
    }
}
