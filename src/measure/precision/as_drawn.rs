//! Which surface the rasteriser drew at a pixel, where rays meet several around the pixel's centre.

use crate::image::Image;
use crate::reference::{self, gbuffer::Surface};
use crate::scene::{Camera, Mesh};
use crate::settings::Normals;
use glam::{DVec3, Vec3};

/// By how much, in pixels, the rasteriser may move a triangle's edge. It keeps 8 bits of a vertex's place in its pixel;
/// twice that step leaves room for the errors of clipping and interpolation.
const SNAPPED: f64 = 2.0 / 256.0;

/// By how much, in radians, the normal drawn must differ from the normals of all surfaces that rays meet around a pixel
/// before it is taken for that of a side turned away. No format rounds by as much.
const SLIVER: f64 = 0.03;

/// The surface at each pixel as the rasteriser may have taken it. Of the surfaces that rays meet within the
/// rasteriser's grid around the pixel's centre, it is the one nearest to the depth and the normal drawn. Where there
/// are several and the drawn one is none of them, it is what was drawn.
///
/// The second value is the number of pixels where it is another surface than the one at the centre.
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
    // Two surfaces that meet differ in their normals alone, and two parallel ones in their depths.
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
            // Surfaces of one plane differ by rounding only.
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
