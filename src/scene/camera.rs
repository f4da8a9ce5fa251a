//! A camera, and the ray through each point of its picture.

use crate::projection::Projection;
use glam::{DVec2, DVec3};

/// The position and orientation of the eye, and the part of space that it sees. `right`, `up` and `forward` are unit
/// vectors of world space, each perpendicular to the other two. Lengths are in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The eye's position in world space.
    pub eye: DVec3,
    /// The picture's x axis. It is the cross product of `forward` and `up`, so that a right-handed world is not
    /// mirrored.
    pub right: DVec3,
    /// The picture's y axis.
    pub up: DVec3,
    /// The direction of view, eye space's z axis.
    pub forward: DVec3,
    /// How eye space is projected to the picture.
    pub projection: Projection,
    /// The smallest visible z, above 0.
    pub near: f64,
    /// The largest visible z, above `near`, at most 1e15.
    pub far: f64,
}

impl Camera {
    /// Transforms a point from world space to left-handed eye space: x right, y up, z forward.
    #[must_use]
    pub fn to_eye(&self, world: DVec3) -> DVec3 {
        self.direction_to_eye(world - self.eye)
    }

    /// Transforms a direction from world space to eye space. Its length does not change.
    #[must_use]
    pub fn direction_to_eye(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(world), self.up.dot(world), self.forward.dot(world))
    }

    /// Transforms a direction from eye space to world space. Its length does not change. For a point of eye space it
    /// returns the offset from the eye in world space.
    pub fn direction_to_world(&self, eye_space: DVec3) -> DVec3 {
        eye_space.x * self.right + eye_space.y * self.up + eye_space.z * self.forward
    }

    /// Returns the ray through the point (u, v) of the picture, as its origin and its direction r in eye space. (0, 0)
    /// is the lower left corner and (1, 1) the upper right. r.z is 1, so the point at depth z is origin + z r; r is not
    /// a unit vector in perspective.
    #[must_use]
    pub fn ray(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let half = DVec2::from(self.projection.half_extents());
        let across = DVec2::new(x, y) * half + DVec2::from(self.projection.middle_at(1.0));
        if self.projection.is_perspective() {
            (DVec3::ZERO, across.extend(1.0))
        } else {
            (across.extend(0.0), DVec3::Z)
        }
    }

    /// Returns the position at which a point of eye space with z > 0 appears in the picture, as (u, v) of
    /// [`Camera::ray`]. The coordinates of points beside the picture lie outside [0, 1].
    #[must_use]
    pub fn project(&self, eye_space: DVec3) -> DVec2 {
        let half = DVec2::from(self.projection.half_extents_at(eye_space.z));
        let middle = DVec2::from(self.projection.middle_at(eye_space.z));
        ((eye_space.truncate() - middle) / half + 1.0) / 2.0
    }
}
