//! A camera, and the ray through each point of its picture (SPEC section 1).

use glam::{DVec2, DVec3};

/// How eye space becomes the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Rays from the eye: at z = 1 the picture reaches from -tan to +tan of half its field of view.
    Perspective {
        /// tan(fov_x/2), above 0.
        tan_half_fov_x: f64,
        /// tan(fov_y/2), above 0.
        tan_half_fov_y: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the picture's width in scene units, above 0.
        half_width: f64,
        /// Half the picture's height in scene units, above 0.
        half_height: f64,
    },
}

/// Where the eye stands, how it is turned, and what it sees. `right`, `up` and `forward` are orthogonal unit vectors
/// of world space; lengths are scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The eye, world space.
    pub eye: DVec3,
    /// The picture's x axis: forward x up, so that a right-handed world is not mirrored.
    pub right: DVec3,
    /// The picture's y axis.
    pub up: DVec3,
    /// The direction of view.
    pub forward: DVec3,
    /// How eye space becomes the picture.
    pub projection: Projection,
    /// The smallest visible z, above 0.
    pub near: f64,
    /// The largest visible z, above `near`, at most 1e15.
    pub far: f64,
}

impl Camera {
    /// A point of world space in left-handed eye space: x right, y up, z forward.
    #[must_use]
    pub fn to_eye(&self, world: DVec3) -> DVec3 {
        self.direction_to_eye(world - self.eye)
    }

    /// A direction of world space in eye space; its length stays.
    #[must_use]
    pub fn direction_to_eye(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(world), self.up.dot(world), self.forward.dot(world))
    }

    /// The ray through the picture at (u, v), both 0 to 1 from the lower left corner: its origin and r, in eye space.
    /// The point at depth z is origin + z r; r has z = 1 and is not a unit vector in perspective.
    #[must_use]
    pub fn ray(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        match self.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => {
                (DVec3::ZERO, DVec3::new(x * tan_half_fov_x, y * tan_half_fov_y, 1.0))
            }
            Projection::Orthographic { half_width, half_height } => {
                (DVec3::new(x * half_width, y * half_height, 0.0), DVec3::Z)
            }
        }
    }

    /// Where a point of eye space with z > 0 appears in the picture: (u, v) as in [`Camera::ray`], past [0, 1] outside.
    #[must_use]
    pub fn project(&self, eye_space: DVec3) -> DVec2 {
        let half = match self.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => {
                DVec2::new(tan_half_fov_x, tan_half_fov_y) * eye_space.z
            }
            Projection::Orthographic { half_width, half_height } => DVec2::new(half_width, half_height),
        };
        (eye_space.truncate() / half + 1.0) / 2.0
    }
}
