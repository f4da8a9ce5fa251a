//! Compares the depth and normals of a G-buffer with those of rays, wherever a ray is sure of what it sees.

use super::Image;
use glam::{DVec3, Vec3};
use hbao::reference::gbuffer::gbuffer;
use hbao::scene::{Camera, Mesh, Projection};
use hbao::settings::Normals;

/// The rays around a sample are moved by this share of a pixel, because the rasteriser rounds vertices to 1/256 of a
/// pixel.
const SURE: f64 = 0.01;

/// The tolerance of an interpolated position, as a share of the distance of the farthest vertex. In a million pixels,
/// most of them on triangles that are clipped at a plane near the eye, llvmpipe's positions were within half of it.
const INTERPOLATED: f64 = 1e-5;

/// What is compared.
pub struct Surfaces<'a> {
    pub depth: &'a Image<f32>,
    pub normals: &'a Image<[f32; 3]>,
    /// The angle in degrees by which the format of the normals may turn them.
    pub rounded: f64,
    pub mesh: &'a Mesh,
    pub camera: &'a Camera,
    pub by: Normals,
    /// The position of each pixel's sample, relative to the pixel's centre.
    pub sample: [f64; 2],
}

impl Surfaces<'_> {
    /// Compares the pixels at which the rays to all points within a hundredth of a pixel of the sample meet the same
    /// triangle, or all meet none. Returns how many of these pixels show a surface, or else a description of what
    /// differs.
    pub fn compare(&self) -> Result<usize, String> {
        let size = (self.depth.width, self.depth.height);
        let [x, y] = self.sample;
        let around = [[0.0, 0.0], [-SURE, -SURE], [SURE, -SURE], [-SURE, SURE], [SURE, SURE]];
        let rays = |by, [dx, dy]: [f64; 2]| gbuffer(self.mesh, self.camera, size, by, [x + dx, y + dy]);
        let planes = around.map(|moved| rays(Normals::Derivative, moved));
        let smooth = (self.by == Normals::Vertex).then(|| rays(Normals::Vertex, around[0]));
        let reach = self.mesh.positions.iter().map(|p| p.distance(self.camera.eye)).fold(0.0, f64::max);
        let mut compared = 0;
        for (i, expected) in planes[0].texels.iter().enumerate() {
            let at = (i % size.0, i / size.0);
            if planes.iter().any(|plane| plane.texels[i] != *expected) {
                continue;
            }
            let (z, n) = (f64::from(self.depth.texels[i]), Vec3::from(self.normals.texels[i]).as_dvec3());
            let (start, r) = self.ray(at, [0.0; 2]);
            // float32 knows the distance of the triangle's plane from the eye only to a share of the distance of the
            // farthest vertex.
            let relative_allowed = match expected.depth.is_finite() {
                true => 1e-6 + INTERPOLATED * reach / (expected.depth * expected.normal.dot(r).abs()),
                false => 1e-6 + INTERPOLATED * reach / z,
            };
            // If so large an error is allowed, the rasteriser may not even draw the pixel.
            if relative_allowed > 0.01 {
                continue;
            }
            if z.is_finite() != expected.depth.is_finite() {
                if self.edge_on(at) {
                    continue;
                }
                return Err(format!("depth is {z} at {at:?}, where rays meet {}", expected.depth));
            }
            if z.is_infinite() {
                continue;
            }
            compared += 1;
            let position = start + expected.depth * r;
            let relative = (z / expected.depth - 1.0).abs();
            let normal = smooth.as_ref().map_or(expected.normal, |smooth| smooth.texels[i].normal);
            let degrees = n.cross(normal).length().atan2(n.dot(normal)).to_degrees();
            // A normal from derivatives is computed from two positions that are a pixel apart, each rounded to 2^-24.
            let [x, y] = self.footprint(size, expected.depth);
            let degrees_allowed = self.rounded + (10.0 * 6e-8 * position.length() / x.min(y)).to_degrees();
            if (relative > relative_allowed || degrees > degrees_allowed)
                && !self.meets_another(at, z, relative_allowed, (position, expected.normal))
                && !self.edge_on(at)
            {
                return Err(format!(
                    "depth {z} at {at:?} is off {} by {relative:e}, of {relative_allowed:e} allowed, and the normal {n} off \
                     {normal} by {degrees} degrees, of {degrees_allowed}",
                    expected.depth
                ));
            }
        }
        Ok(compared)
    }

    /// Whether a triangle at this pixel is seen so nearly edge-on that its depth changes by more than 30 % within a
    /// hundredth of a pixel of the sample. Such a triangle may be drawn or not, because it may fall between two slices
    /// of depth or beside its own outline.
    fn edge_on(&self, at: (usize, usize)) -> bool {
        let size = [self.depth.width as f64, self.depth.height as f64];
        let sample = [at.0 as f64 + 0.5 + self.sample[0], at.1 as f64 + 0.5 + self.sample[1]];
        self.mesh.triangles.iter().any(|triangle| {
            let [a, b, c] = triangle.map(|i| self.camera.to_eye(self.mesh.positions[i as usize]));
            // A triangle that reaches in front of the near plane may be anywhere in the picture.
            let here = [a, b, c].iter().any(|corner| corner.z <= self.camera.near) || {
                let window = [a, b, c].map(|corner| self.camera.project(corner));
                (0..2).all(|axis| {
                    let along = window.map(|uv| uv[axis] * size[axis]);
                    let (low, high) = along.iter().fold((f64::MAX, f64::MIN), |(l, h), &p| (l.min(p), h.max(p)));
                    (low - SURE..=high + SURE).contains(&sample[axis])
                })
            };
            let (low, high) = self.about(at, a, (b - a).cross(c - a));
            here && (low.signum() != high.signum() || high > 1.3 * low)
        })
    }

    /// Whether z is the depth of another triangle's plane which, within a hundredth of a pixel of the sample, is as
    /// near as the surface that is seen. This happens where two triangles cross and one of them is seen nearly edge-on.
    fn meets_another(&self, at: (usize, usize), z: f64, allowed: f64, (position, normal): (DVec3, DVec3)) -> bool {
        let seen = self.about(at, position, normal);
        self.mesh.triangles.iter().any(|triangle| {
            let [a, b, c] = triangle.map(|i| self.camera.to_eye(self.mesh.positions[i as usize]));
            let normal = (b - a).cross(c - a);
            let (start, r) = self.ray(at, [0.0; 2]);
            let (low, high) = self.about(at, a, normal);
            ((a - start).dot(normal) / r.dot(normal) / z - 1.0).abs() <= allowed && low <= seen.1 && high >= seen.0
        })
    }

    fn ray(&self, at: (usize, usize), [dx, dy]: [f64; 2]) -> (DVec3, DVec3) {
        let (width, height) = (self.depth.width as f64, self.depth.height as f64);
        self.camera.ray((at.0 as f64 + 0.5 + dx) / width, (at.1 as f64 + 0.5 + dy) / height)
    }

    /// Returns the least and the greatest depth of a plane within a hundredth of a pixel of the sample.
    fn about(&self, at: (usize, usize), point: DVec3, normal: DVec3) -> (f64, f64) {
        let [x, y] = self.sample;
        let depths = [[-SURE, -SURE], [SURE, -SURE], [-SURE, SURE], [SURE, SURE]].map(|[dx, dy]| {
            let (start, r) = self.ray(at, [x + dx, y + dy]);
            (point - start).dot(normal) / r.dot(normal)
        });
        depths.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)))
    }

    /// Returns the width and height that a pixel has at depth z.
    fn footprint(&self, size: (usize, usize), z: f64) -> [f64; 2] {
        let half = self.camera.projection.half_extents_at(z);
        [2.0 * half[0] / size.0 as f64, 2.0 * half[1] / size.1 as f64]
    }
}
