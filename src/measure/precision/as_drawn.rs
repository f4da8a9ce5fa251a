//! Finds the surface that the rasteriser drew at a pixel, if rays around the pixel's centre meet several.

use crate::image::Image;
use crate::reference::{self, gbuffer::Surface};
use crate::scene::{Camera, Mesh};
use crate::settings::Normals;
use glam::{DVec3, Vec3};

/// The distance in pixels by which the rasteriser may move a triangle's edge. The rasteriser rounds the position of a
/// vertex to 1/256 pixel; twice that leaves room for the errors of clipping and interpolation.
const SNAPPED: f64 = 2.0 / 256.0;

/// An angle in radians. If the drawn normal differs by more than this from the normals of all surfaces that rays meet
/// around the pixel, it is taken for the normal of a side that faces away, which no ray meets. No format rounds a
/// normal by as much.
const SLIVER: f64 = 0.03;

/// Returns, for each pixel, the surface that the rasteriser may have drawn. Rays are cast through the pixel's centre
/// and through four points around it, [`SNAPPED`] pixels away in x and y. Of the surfaces that they meet, the result
/// holds the one that is nearest to the drawn depth and normal. If the rays meet several surfaces and the drawn one is
/// none of them, the result holds the drawn depth and normal.
///
/// The second value is the number of pixels whose surface is not the one that the ray through the centre meets.
pub(super) fn as_drawn(
    mesh: &Mesh,
    camera: &Camera,
    source: Normals,
    depth: &Image<f32>,
    normals: &Image<[f32; 3]>,
) -> (Image<Surface>, usize) {
    let size = (depth.width, depth.height);
    let at = |x: f64, y: f64| reference::gbuffer::gbuffer(mesh, camera, size, source, [x * SNAPPED, y * SNAPPED]);
    let mut seen = at(0.0, 0.0);
    // The distance counts depths and normals: two surfaces that meet differ only in their normals, and two parallel
    // surfaces only in their depths.
    let off = |a: &Surface, z: f64, n: DVec3| match (a.depth.is_finite(), z.is_finite()) {
        (true, true) => 1e3 * (z / a.depth - 1.0).abs() + (a.normal - n).length(),
        (false, false) => 0.0,
        _ => f64::INFINITY,
    };
    let same = |a: &Surface, b: &Surface| off(a, b.depth, b.normal) < 1e-9;
    let (mut beside, mut several) = (vec![false; seen.texels.len()], vec![false; seen.texels.len()]);
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
        for (i, other) in at(x, y).texels.into_iter().enumerate() {
            let (z, n) = (f64::from(depth.texels[i]), Vec3::from(normals.texels[i]).as_dvec3());
            let known = &mut seen.texels[i];
            let another = !same(&other, known);
            several[i] |= another;
            // Surfaces in one plane count as the same, because they differ by rounding only.
            if another && off(&other, z, n) < off(known, z, n) {
                beside[i] = true;
                *known = other;
            }
        }
    }
    for (i, known) in seen.texels.iter_mut().enumerate().filter(|&(i, _)| several[i]) {
        let (z, n) = (depth.texels[i], Vec3::from(normals.texels[i]).as_dvec3());
        if z.is_finite() && known.depth.is_finite() && (known.normal - n).length() > SLIVER {
            beside[i] = true;
            *known = Surface { depth: z.into(), normal: n, ..*known };
        }
    }
    (seen, beside.into_iter().filter(|&b| b).count())
}
