//! Measures how near to each other two surfaces may lie before the depth test confuses them.

use crate::scene::{Camera, Extents, Mesh, Projection};
use crate::settings::{Radius, Settings};
use crate::{Error, Pipeline, Request, reference};
use glam::DVec3;

/// The near and the far plane of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthPlanes {
    /// The smallest visible z, above 0.
    pub near: f64,
    /// The largest visible z, above `near`.
    pub far: f64,
}

/// The largest and the smallest gap that are tested, relative to the depth. There are four gaps for each power of ten.
const GAPS: [f64; 2] = [1e-1, 1e-7];

/// Returns the largest tested gap between two surfaces at the depth z at which the depth test draws the farther surface
/// over the nearer one at some pixel. The gap is relative to z. The result is 0 if this happens at no tested gap.
///
/// The scene is a plate that is tilted both ways, drawn first. In front of it stand strips parallel to it, at gaps that
/// shrink from one strip to the next.
///
/// # Errors
/// The same as for [`Pipeline::render`].
pub fn unresolved_gap(
    gl: &std::sync::Arc<glow::Context>,
    DepthPlanes { near, far }: DepthPlanes,
    z: f64,
    orthographic: bool,
) -> Result<f64, Error> {
    const STRIP: usize = 4;
    let strips = (4.0 * (GAPS[0] / GAPS[1]).log10()).round() as usize + 1;
    let (width, height) = (strips * STRIP, 16);
    let tan = 0.1;
    let half = DVec3::new(width as f64 / height as f64, 1.0, 0.0) * tan;
    let projection = if orthographic {
        Projection::Orthographic(Extents::centred(half.x * z, half.y * z))
    } else {
        Projection::Perspective(Extents::centred(half.x, half.y))
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let camera = Camera { eye: DVec3::ZERO, right: axes[0], up: axes[1], forward: axes[2], projection, near, far };
    let gap = |strip: usize| GAPS[0] * 10f64.powf(-0.25 * strip as f64);
    // Returns the point of the plate z = z0 + 0.1 x + 0.2 y at (x, y), moved towards the eye by the gap. x and y are
    // given as shares of half the picture's size.
    let point = |x: f64, y: f64, gap: f64| {
        let (x, y) = (x * half.x, y * half.y);
        let p = match projection {
            Projection::Perspective { .. } => DVec3::new(x, y, 1.0) * z * (1.0 - gap) / (1.0 - 0.1 * x - 0.2 * y),
            Projection::Orthographic { .. } => z * DVec3::new(x, y, 1.0 - gap + 0.1 * x + 0.2 * y),
        };
        DVec3::new(p.x, p.y, -p.z)
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut plate = |left: f64, right: f64, gap: f64| {
        let start = positions.len() as u32;
        positions.extend([(left, -1.5), (right, -1.5), (right, 1.5), (left, 1.5)].map(|(x, y)| point(x, y, gap)));
        triangles.extend([[start, start + 1, start + 2], [start, start + 2, start + 3]]);
    };
    plate(-1.5, 1.5, 0.0);
    let at = |strip: usize| 2.0 * strip as f64 / strips as f64 - 1.0;
    (0..strips).for_each(|strip| plate(at(strip), at(strip + 1), gap(strip)));
    let mesh = Mesh::new(positions, triangles)?;

    let settings = Settings { msaa: 1, radius: Radius::Units(z), ..Settings::default() };
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, (width as u32, height as u32), &settings, request)?;
    pipeline.render(&mesh, &camera)?;
    let depth = pipeline.depth()?;
    let seen = reference::gbuffer::gbuffer(&mesh, &camera, (width, height), settings.normals, [0.0; 2]);
    let wrong = (0..depth.texels.len()).filter(|&i| {
        let off = f64::from(depth.texels[i]) / seen.texels[i].depth - 1.0;
        off.abs() > 0.5 * gap(i % width / STRIP)
    });
    Ok(wrong.map(|i| gap(i % width / STRIP)).fold(0.0, f64::max))
}
