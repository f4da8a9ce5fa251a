//! The float64 twin of `glsl/ssao.frag`: screen-space ambient occlusion as Crysis has it, ShaderX7 6.1: the share of
//! points around P that lie in free space, in front of the surface that is seen at their texels.

use super::observer::{Compared, Observer};
use super::sampling::{MethodScene, Pixel, Shift};
use super::twin::Twin;
use crate::settings::{SsaoDepth, SsaoRotation, Toggle};
use glam::{DMat3, DVec3};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: |settings| settings.ssao_samples,
    scale: |settings| 1.0 / f64::from(settings.ssao_samples),
    curve: |settings| settings.curve() == Toggle::On,
    // It has no converged form, because its offsets are a fixed set.
    converged: None,
};

/// Returns 1 minus what sample i = `index` + 1 adds to the accessibility.
#[allow(non_snake_case)]
fn occlusion(scene: &MethodScene, pixel: &Pixel, index: u32, shift: Shift, observer: &mut dyn Observer) -> f64 {
    let settings = scene.settings;
    let (l, mut offset) = kernel(scene, pixel, index);

    // An offset's x and y are texture coordinates, and its z is in units of 2 P.z.
    let texels = |offset: DVec3| offset.truncate() * scene.extent;
    let point = |offset: DVec3| scene.position(pixel.p + texels(offset), pixel.P.z + 2.0 * pixel.P.z * offset.z);
    if settings.ssao_normals == Toggle::On {
        // 6.1, Future improvements: no sample lies behind the surface. D leads from P to the point at the sample's
        // depth on the ray through the sample's position. If n.D is negative, the offset is reversed.
        let D = point(offset) - pixel.P;
        if pixel.n.dot(D) < shift.comparison * pixel.n.length() * D.length() {
            offset = -offset;
        }
    }

    // The sample reads the nearest texel in the image.
    let q = scene.clamped(pixel.p + shift.round(texels(offset)));
    let (x, y, scale) = (q.x as usize, q.y as usize, settings.ao_scale() as usize);
    let z = match settings.ssao_depth {
        SsaoDepth::Full => scene.depth_of_pixel(scale * x, scale * y),
        SsaoDepth::Half => scene.depth_of_pixel(scale * x / 2 * 2, scale * y / 2 * 2),
    };
    let mut tell = |open: bool, range: f64, accessibility: f64| {
        observer.point(&Compared { point: point(offset), surface: z, open, range, accessibility });
    };
    if z.is_infinite() {
        tell(true, 0.0, 1.0);
        return 0.0;
    }
    // The point lies in free space if S.z > P.z + 2 P.z offset.z. Both sides are taken relative to P.z and divided by
    // the reach of the offset, 2 P.z l, which is 2 % to 20 % of P.z. So the shift is relative to the reach. A shift
    // relative to the depth would be 5 to 45 times as large, far more than float32 can be off by.
    let reach = 2.0 * pixel.P.z * l;
    let is_open = (z - pixel.P.z) / reach > offset.z / l + shift.comparison;
    let open = if is_open { 1.0 } else { 0.0 };
    // 6.1, depth range check: the sample counts 0.5 if the surface is too far in front of P.
    let range = if scene.range_check { ((pixel.P.z - z) / z).clamp(0.0, 1.0) } else { 0.0 };
    let accessibility = open * (1.0 - range) + 0.5 * range;
    tell(is_open, range, accessibility);
    1.0 - accessibility
}

/// Returns the length l_i and the rotated offset of sample i = `index` + 1.
fn kernel(scene: &MethodScene, pixel: &Pixel, index: u32) -> (f64, DVec3) {
    let n = f64::from(scene.settings.ssao_samples);
    // 6.1, SSAO pixel shader: the offsets point to the corners of a cube and have the lengths l_i, which are 0.01 (1 +
    // 2.4/n)^i. Sample i uses the corner `index` modulo 8; x changes its sign most slowly, z fastest.
    let side = |corner: u32| if corner.is_multiple_of(2) { -1.0 } else { 1.0 };
    let corner = DVec3::new(side(index / 4), side(index / 2), side(index));
    let l = 0.01 * (1.0 + 2.4 / n).powi(index as i32 + 1);
    (l, turned(scene.settings.ssao_rotation, pixel.jitter.into(), l * corner / 3f64.sqrt()))
}

/// Turns an offset by v, a unit vector from the tile (6.1, Randomly rotated kernel).
fn turned(rotation: SsaoRotation, v: DVec3, offset: DVec3) -> DVec3 {
    match rotation {
        // 6.1, Future improvements: the offset o is reflected in the plane with the normal v, o - 2 (o.v) v.
        SsaoRotation::Mirror => offset - 2.0 * offset.dot(v) * v,
        // The rotation that carries (0, 0, 1) to v. The tile has v.z >= 0 only, so the division is never by 0.
        SsaoRotation::Matrix => {
            let h = 1.0 / (1.0 + v.z);
            let x = DVec3::new(h * v.y * v.y + v.z, -h * v.x * v.y, -v.x);
            let y = DVec3::new(-h * v.x * v.y, h * v.x * v.x + v.z, -v.y);
            DMat3::from_cols(x, y, v) * offset
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation_tile;
    use crate::settings::{Method, Settings};

    #[test]
    fn turned_offsets_keep_their_lengths_and_the_matrix_carries_z_to_the_tiles_vector() {
        // These include vectors on the horizon and at the zenith, which the tile need not hold.
        for v in vectors().chain([DVec3::X, DVec3::NEG_Y, DVec3::Z]) {
            assert!(turned(SsaoRotation::Matrix, v, DVec3::Z).distance(v) < 1e-7);
            assert!(turned(SsaoRotation::Mirror, v, v).distance(-v) < 1e-6);
            for rotation in [SsaoRotation::Matrix, SsaoRotation::Mirror] {
                let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turned(rotation, v, axis));
                let handed = if rotation == SsaoRotation::Matrix { 1.0 } else { -1.0 };
                assert!((axes[0].cross(axes[1]).dot(axes[2]) - handed).abs() < 1e-6, "{rotation:?} {v}");
                for corner in 0..8 {
                    let side = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                    let offset = DVec3::new(side(2), side(1), side(0)) / 3f64.sqrt();
                    let length = turned(rotation, v, offset).length();
                    assert!((length - 1.0).abs() < 1e-6, "{rotation:?} {v} {offset}: {length}");
                }
            }
        }
    }

    fn vectors() -> impl Iterator<Item = DVec3> {
        let tile = rotation_tile(&Settings::for_method(Method::Ssao));
        tile.texels.into_iter().map(|v| DVec3::from(v.map(f64::from)))
    }
}
