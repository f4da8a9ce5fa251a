//! A camera, and the ray through each point of its picture (SPEC section 1).

use crate::projection::Projection;
use glam::{DVec2, DVec3};

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
    pub fn to_eye(&self, world: DVec3) -> DVec3 {
        self.direction_to_eye(world - self.eye)
    }

    /// A direction of world space in eye space; its length stays.
    pub fn direction_to_eye(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(world), self.up.dot(world), self.forward.dot(world))
    }

    /// A direction of eye space in world space, and so also a point of eye space relative to the eye; lengths stay.
    pub fn direction_to_world(&self, eye_space: DVec3) -> DVec3 {
        eye_space.x * self.right + eye_space.y * self.up + eye_space.z * self.forward
    }

    /// The ray through the picture at (u, v), both 0 to 1 from the lower left corner: its origin and r, in eye space.
    /// The point at depth z is origin + z r; r has z = 1 and is not a unit vector in perspective.
    pub fn ray(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let [half_x, half_y] = self.projection.half_extents();
        let across = DVec2::new(x * half_x, y * half_y);
        if self.projection.is_perspective() {
            (DVec3::ZERO, across.extend(1.0))
        } else {
            (across.extend(0.0), DVec3::Z)
        }
    }

    /// Where a point of eye space with z > 0 appears in the picture: (u, v) as in [`Camera::ray`], past [0, 1] outside.
    pub fn project(&self, eye_space: DVec3) -> DVec2 {
        let half = DVec2::from(self.projection.half_extents_at(eye_space.z));
        (eye_space.truncate() / half + 1.0) / 2.0
    }
}
