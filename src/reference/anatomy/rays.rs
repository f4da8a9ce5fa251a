//! The rays of `ray-march`, and the points of `ssao`.

use super::super::observer::{Compared, Observer, Step};
use super::super::sampling::{MethodScene, Pixel};
use glam::{DVec2, DVec3};

/// A ray of `ray-march`.
#[allow(non_snake_case)]
#[derive(Clone, Debug, PartialEq)]
pub struct Ray {
    /// The direction in eye space, a unit vector on the side of the normal.
    pub direction: DVec3,
    /// E - P in eye space, in scene units. E is where the ray ends: at the distance R, or at the near plane.
    pub E: DVec3,
    /// The steps in their order, up to the one that stops the ray.
    pub steps: Vec<RayStep>,
    /// W(|S - P|) of the surface that stops the ray; `None` if none does.
    pub weight: Option<f64>,
}

/// A step of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayStep {
    /// i = 1..N_s.
    pub index: u32,
    /// The texel that is read, in texels from P's own.
    pub taken: DVec2,
    /// The point on the ray minus P, in eye space.
    pub on_ray: DVec3,
    /// The surface at the texel minus P, in eye space; `None` for background and P's own texel.
    pub surface: Option<DVec3>,
    /// Whether this surface stops the ray: it is in front of the ray, and within R.
    pub stops: bool,
}

/// A point of `ssao`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The point, in eye space.
    pub position: DVec3,
    /// The depth of the surface that is seen at the point's texel, +infinity on background.
    pub surface: f64,
    /// Whether the point lies in free space, in front of that surface.
    pub open: bool,
    /// How far the depth range check replaces the result by 0.5: 0 not at all, 1 wholly.
    pub range: f64,
    /// What the point adds to the accessibility, in [0, 1].
    pub accessibility: f64,
}

/// Collects rays and points from what a twin tells.
pub(super) struct Collector<'a> {
    pub(super) scene: &'a MethodScene<'a>,
    pub(super) pixel: &'a Pixel,
    pub(super) rays: Vec<Ray>,
    pub(super) points: Vec<Point>,
}

impl Observer for Collector<'_> {
    fn ray(&mut self, _: u32, direction: DVec3, end: DVec3) {
        self.rays.push(Ray { direction, E: end - self.pixel.P, steps: Vec::new(), weight: None });
    }

    fn step(&mut self, index: u32, step: &Step) {
        let Some(ray) = self.rays.last_mut() else { return };
        ray.steps.push(RayStep {
            index,
            taken: step.taken,
            on_ray: self.scene.position(self.pixel.p + step.at, step.ray_z) - self.pixel.P,
            surface: step.sample.map(|sample| sample.D),
            stops: step.stops,
        });
    }

    fn point(&mut self, told: &Compared) {
        let &Compared { point: position, surface, open, range, accessibility } = told;
        self.points.push(Point { position, surface, open, range, accessibility });
    }

    fn adds(&mut self, k: u32, occlusion: f64) {
        if let Some(ray) = self.rays.get_mut(k as usize) {
            ray.weight = Some(occlusion);
        }
    }
}
