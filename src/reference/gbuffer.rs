//! The float64 twin of `glsl/gbuffer.frag`, by ray casting: depth, normal and material colour of the surface on the ray
//! through each pixel's centre. Unlike the shader it does not shade the colour.

use super::trace::{Hit, Tracer};
use crate::image::Image;
use crate::scene::{Camera, Mesh};
use crate::settings::Normals;
use crate::threads::on_all_cores;
use glam::DVec3;
use rayon::prelude::*;

/// The surface that one pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Linear eye-space z in scene units; +infinity on background.
    pub depth: f64,
    /// Unit normal in eye space, turned towards the eye; zero on background.
    pub normal: DVec3,
    /// The material's colour with its texture and the colours of the vertices; white on background.
    pub diffuse: [f32; 3],
}

/// Casts one ray per pixel, and returns the surface that each pixel shows. Images have the size (width, height).
///
/// `sample` is the position of a depth sample relative to the pixel's centre, in pixels. The ray through the sample
/// decides which triangle is seen. Depth, normal and colour are those of the triangle's plane on the ray through the
/// pixel's centre. There it is also decided whether a texture cuts the triangle away, so for all samples of the pixel.
#[must_use]
pub fn gbuffer(
    mesh: &Mesh,
    camera: &Camera,
    (width, height): (usize, usize),
    normals: Normals,
    sample: [f64; 2],
) -> Image<Surface> {
    // Vertex normals are computed before the corners are moved, because moving may merge two corners.
    let vertex_normals = (normals == Normals::Vertex).then(|| mesh.vertex_normals());
    // Positions are made relative to the eye. In a small scene far from the origin, float64 itself leaves few digits,
    // and none may be lost to rounding again.
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|p| *p -= camera.eye);
    let tracer = Tracer::new(&mesh);
    let cuts = mesh.skins().iter().any(|skin| skin.cut.is_some());
    let texel = |x: usize, y: usize| {
        let ray = |[dx, dy]: [f64; 2]| {
            let (u, v) = ((x as f64 + 0.5 + dx) / width as f64, (y as f64 + 0.5 + dy) / height as f64);
            let (start, r) = camera.ray(u, v);
            (camera.direction_to_world(start), camera.direction_to_world(r), r)
        };
        let (at_centre, to_centre, r) = ray([0.0; 2]);
        let (origin, direction, _) = ray(sample);
        let is_cut = |hit: &Hit| {
            let centre = tracer.meet_plane(at_centre, to_centre, hit.triangle).unwrap_or(*hit);
            mesh.is_cut(hit.triangle, centre.barycentric)
        };
        // r.z is 1, so t is the depth.
        let range = camera.near..=camera.far;
        let Some(seen) = tracer.nearest_where(origin, direction, range, |hit| !cuts || !is_cut(hit)) else {
            return Surface { depth: f64::INFINITY, normal: DVec3::ZERO, diffuse: [1.0; 3] };
        };
        let hit = tracer.meet_plane(at_centre, to_centre, seen.triangle).unwrap_or(seen);
        let corners = mesh.triangles[hit.triangle].map(|i| i as usize);
        let [a, b, c] = corners.map(|i| mesh.positions[i]);
        let plane = camera.direction_to_eye((b - a).cross(c - a)).normalize();
        let plane = if plane.dot(r) > 0.0 { -plane } else { plane };
        let normal = match &vertex_normals {
            None => plane,
            Some(normals) => {
                let [a, b, c] = corners.map(|i| normals[i]);
                let weights = hit.barycentric;
                let smooth = camera.direction_to_eye(weights.x * a + weights.y * b + weights.z * c).normalize_or(plane);
                // The normal is turned to the side of the triangle that is seen.
                if smooth.dot(plane) < 0.0 { -smooth } else { smooth }
            }
        };
        Surface {
            depth: hit.t.clamp(camera.near, camera.far),
            normal,
            diffuse: mesh.diffuse(hit.triangle, hit.barycentric),
        }
    };
    let texels = on_all_cores(|| (0..width * height).into_par_iter().map(|i| texel(i % width, i / width)).collect());
    Image { width, height, texels }
}
