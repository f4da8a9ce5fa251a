//! The float64 twin of `glsl/rebuilt_normals.frag`: normals from depth alone.

use crate::image::Image;
use crate::projection::Projection;
use glam::{DVec2, DVec3, dvec2};

/// Rebuilds unit normals in left-handed eye space, turned towards the eye, from linear depth, +infinity on background,
/// where the result is zero. The normal is perpendicular to the ways from the surface point of the pixel to that of a
/// neighbour in x and to that of one in y. Of the two neighbours along each axis, the one is taken whose depth differs
/// less; of two equal ones, the one to the right or above. With no surface on either side, depth is assumed not to
/// change along that axis.
#[must_use]
pub fn rebuilt_normals(depth: &Image<f32>, projection: Projection) -> Image<[f64; 3]> {
    let size = dvec2(depth.width as f64, depth.height as f64);
    let half = DVec2::from(projection.half_extents());
    let middle = DVec2::from(projection.extents().middle());
    // The surface point at depth z on the ray through the window position p.
    let position = |p: DVec2, z: f64| {
        let slope = middle + (2.0 * p / size - 1.0) * half;
        if projection.is_perspective() { z * slope.extend(1.0) } else { slope.extend(z) }
    };
    Image::from_fn(depth.width, depth.height, |x, y| {
        let z = f64::from(depth.at(x, y));
        if z.is_infinite() {
            return [0.0; 3];
        }
        let p = dvec2(x as f64 + 0.5, y as f64 + 0.5);
        let here = position(p, z);
        let along = |axis: DVec2| {
            let neighbour = |q: DVec2| {
                let inside = q.cmpge(DVec2::ZERO).all() && q.cmplt(size).all();
                if inside { f64::from(depth.at(q.x as usize, q.y as usize)) } else { f64::INFINITY }
            };
            let (after, before) = (neighbour(p + axis), neighbour(p - axis));
            let side = if (after - z).abs() <= (before - z).abs() { 1.0 } else { -1.0 };
            let q_z = if side > 0.0 { after } else { before };
            let q_z = if q_z.is_infinite() { z } else { q_z };
            side * (position(p + side * axis, q_z) - here)
        };
        let n = along(DVec2::X).normalize().cross(along(DVec2::Y).normalize()).normalize_or_zero();
        let r = if projection.is_perspective() { here } else { DVec3::Z };
        if n.dot(r) > 0.0 { -n } else { n }.to_array()
    })
}
