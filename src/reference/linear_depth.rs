//! The float64 twin of `glsl/linear_depth.frag`: linear depth from the values that a depth buffer stores.

use crate::Error;
use crate::encoding::{ClipRange, DepthEncoding};
use crate::image::Image;
use crate::projection::Projection;

/// Computes linear depth from stored values d in [0, 1]. Background, where d is the cleared value of the far end, is
/// +infinity. Each encoding is inverted as its definition stands; the shader's formulas are rearranged for float32.
///
/// # Errors
/// [`Error::Usage`] if no view of this projection has such a depth buffer.
pub fn linear_depth(stored: &Image<f32>, encoding: DepthEncoding, projection: Projection) -> Result<Image<f64>, Error> {
    let perspective = projection.is_perspective();
    // This refuses what the passes refuse.
    encoding.curve(perspective)?;
    Ok(stored.map(|d| {
        let d = f64::from(d);
        let z = match encoding {
            DepthEncoding::Linear => d,
            DepthEncoding::Planes { near, far, reversed } => {
                let d = if reversed { 1.0 - d } else { d };
                match (perspective, far.is_infinite()) {
                    _ if d >= 1.0 => f64::INFINITY,
                    // d = 1 - near/z.
                    (true, true) => near / (1.0 - d),
                    // d = far (z - near) / ((far - near) z).
                    (true, false) => near * far / (far - d * (far - near)),
                    (false, _) => near + d * (far - near),
                }
            }
            DepthEncoding::Matrix { projection, range } => of_matrix(&projection.map(f64::from), range, d),
            DepthEncoding::Logarithmic { .. } if d >= 1.0 => f64::INFINITY,
            // d = ln(C z + 1) / ln(C far + 1).
            DepthEncoding::Logarithmic { c, far } => (d * (c * far).ln_1p()).exp_m1() / c,
        };
        if z >= f64::from(f32::MAX) { f64::INFINITY } else { z }
    }))
}

/// Returns the z that a matrix, given column by column, turns into d: ndc = (m10 z + m14) / (m11 z + m15), solved for
/// z. It is +infinity at the cleared value of the far end, and beyond it.
fn of_matrix(m: &[f64; 16], range: ClipRange, d: f64) -> f64 {
    let z = |d: f64| {
        let ndc = match range {
            ClipRange::MinusOneToOne => 2.0 * d - 1.0,
            ClipRange::ZeroToOne => d,
        };
        (m[14] - ndc * m[15]) / (ndc * m[11] - m[10])
    };
    // Forward is where w is above 0; in an orthographic view both planes lie in front of the eye.
    let forward = if m[11] != 0.0 { m[11].signum() } else { (z(0.0) + z(1.0)).signum() };
    // 1/z, or z in an orthographic view, is linear in d, so that two values tell in which direction z increases.
    let order = |d: f64| if m[11] != 0.0 { -1.0 / (forward * z(d)) } else { forward * z(d) };
    let cleared = if order(0.0) < order(1.0) { 1.0 } else { 0.0 };
    let here = forward * z(d);
    if d == cleared || here.is_nan() || here <= 0.0 { f64::INFINITY } else { here }
}
