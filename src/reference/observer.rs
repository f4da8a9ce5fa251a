//! What the twins tell about their work while they do it. The twins are the only place of the equations, so that
//! whoever shows the intermediate results, like [`super::anatomy`], listens to the twins.

use super::sampling::Sample;
use glam::{DVec2, DVec3};

/// Is told what a twin does at one pixel, in one direction or with one point. The observer `()` ignores everything.
pub(super) trait Observer {
    /// The horizon of a direction starts at the tangent whose elevation has this sine.
    fn starts(&mut self, _sin_t: f64) {}

    /// A horizon method looks at sample i.
    fn sample(&mut self, _i: u32, _sample: &HorizonSample) {}

    /// Ray k starts at P in this direction and ends at E.
    fn ray(&mut self, _k: u32, _direction: DVec3, _end: DVec3) {}

    /// A ray is compared with the depth image at step i.
    fn step(&mut self, _i: u32, _step: &Step) {}

    /// The point of an offset is compared with the depth image.
    fn point(&mut self, _point: &Compared) {}

    /// Sample i, or ray k, adds this much to the occlusion.
    fn adds(&mut self, _index: u32, _occlusion: f64) {}
}

impl Observer for () {}

/// A sample as a horizon method sees it, before the method decides.
pub(super) struct HorizonSample<'a> {
    pub(super) sample: &'a Sample,
    /// The sine of the sample's elevation.
    pub(super) sine: f64,
    /// The sine of the horizon so far: the running maximum.
    pub(super) horizon: f64,
    /// Returns the sine of the tangent that the sample's rise is measured from.
    pub(super) ground: &'a dyn Fn() -> f64,
    /// Whether the sample lies within R.
    pub(super) within: bool,
    /// Whether the sample raises the horizon.
    pub(super) raises: bool,
}

/// A step of a ray.
pub(super) struct Step<'a> {
    /// The place of the step in the image, in texels from P's own, before it is rounded.
    pub(super) at: DVec2,
    /// The way from P's texel to the texel that is read.
    pub(super) taken: DVec2,
    /// The depth of the ray.
    pub(super) ray_z: f64,
    /// The surface at the texel; `None` on background and on P's own texel.
    pub(super) sample: Option<&'a Sample>,
    /// Whether the surface stops the ray.
    pub(super) stops: bool,
}

/// A point of `ssao`, compared with the depth image.
pub(super) struct Compared {
    /// The point, in eye space.
    pub(super) point: DVec3,
    /// The depth of the surface that is seen at its texel, +infinity on background.
    pub(super) surface: f64,
    /// Whether the point lies in free space, in front of that surface.
    pub(super) open: bool,
    /// How far the depth range check replaces the result by 0.5: 0 not at all, 1 wholly.
    pub(super) range: f64,
    /// What the point adds to the accessibility, in [0, 1].
    pub(super) accessibility: f64,
}
