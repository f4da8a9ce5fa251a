//! The 4x4 rotation tile, which is repeated over the screen and makes each pixel sample differently from its
//! neighbours.
//!
//! For all methods but `ssao` it is the tile of ShaderX7 6.2 (Directions and jittering). Each texel is (cos a, sin a,
//! b), where a is a random angle that is less than the angle between two directions, and b is a random fraction of a
//! step. For `hbao-view` the 16 pairs of a and b are not random: they are spread evenly. For `ssao` it is the tile of
//! 6.1 (Randomly rotated kernel). Each texel is a random unit vector, by which the offsets of the samples are turned.

use crate::image::Image;
use crate::settings::{Jitter, Settings, TileKind};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use std::f64::consts::TAU;

/// The seed of the random numbers. It is fixed so that the tile is the same in every run and on every platform.
const SEED: u128 = 0x6862_616f_2008_0602;

/// Makes the rotation tile for these settings, with 4x4 texels. The pixel at the window position (x, y), with y up,
/// uses texel (x mod 4, y mod 4). The tile is the same on every platform.
///
/// Each texel is (cos a, sin a, b), with a uniform in [0, 2 pi / N_d) and b uniform in [0, 1). For `hbao-view` the 16
/// pairs are not random, but spread evenly. Without jitter a = b = 0.
///
/// For `ssao` each texel is a unit vector (x, y, z), uniform over the hemisphere z >= 0, and (0, 0, 1) without jitter.
/// Vectors with z < 0 are left out because they would not vary the offsets any further, and because the rotation that
/// carries (0, 0, 1) to (0, 0, -1) is not defined.
#[must_use]
pub fn rotation_tile(settings: &Settings) -> Image<[f32; 3]> {
    let kind = settings.method.facts().tile;
    let vectors = kind == TileKind::Vectors;
    if settings.jitter == Jitter::None {
        return Image::filled(4, 4, if vectors { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] });
    }
    let mut random = Pcg64Mcg::new(SEED);
    // The numbers have 24 bits, as many as float32 holds, so that b is still below 1 when it is rounded to float32.
    let mut uniform = move || (random.next_u64() >> 40) as f64 / (1u64 << 24) as f64;
    Image::from_fn(4, 4, |x, y| {
        if vectors {
            // z is uniform because slices of a sphere that are equally high have equal areas. The square root is
            // correctly rounded on every platform.
            let (a, z) = (uniform() * TAU, uniform());
            let across = (1.0 - z * z).sqrt();
            return [across * libm::cos(a), across * libm::sin(a), z].map(|c| c as f32);
        }
        let [turn, b] = if kind == TileKind::EvenRotations { even(x, y) } else { [uniform(), uniform()] };
        let a = turn * TAU / f64::from(settings.directions);
        // libm's sine is the same everywhere. The standard library's depends on the platform.
        [libm::cos(a) as f32, libm::sin(a) as f32, b as f32]
    })
}

/// Returns two numbers in (0, 1) for the texel (x, y) of the tile. Over the 16 texels each takes every value (j +
/// 1/2)/16, j = 0..15, once, and together they are spread evenly over the square (a Hammersley set). The first goes
/// through the texels in the order of an ordered dither, so that every block of 2x2 texels, too, has one value in each
/// quarter of the range.
fn even(x: usize, y: usize) -> [f64; 2] {
    let mixed = x ^ y;
    let bits = [mixed & 1, y & 1, mixed >> 1, y >> 1];
    let number = |bits: [usize; 4]| bits.iter().fold(0, |number, bit| 2 * number + bit);
    let [a, b, c, d] = bits;
    [[a, b, c, d], [d, c, b, a]].map(|bits| (number(bits) as f64 + 0.5) / 16.0)
}

/// Returns the unit vectors at the angles 2 pi k / `count`, for k = 0, 1, ..., `count` - 1.
pub(crate) fn directions(count: u32) -> Vec<[f64; 2]> {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(count);
    (0..count).map(|k| [libm::cos(angle(k)), libm::sin(angle(k))]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Method;
    use glam::DVec3;

    fn vectors(jitter: Jitter) -> Vec<DVec3> {
        let tile = rotation_tile(&Settings { method: Method::Ssao, jitter, ..Settings::default() });
        tile.texels.iter().map(|v| DVec3::from(v.map(f64::from))).collect()
    }

    #[test]
    fn the_vectors_of_ssao_are_unit_in_the_upper_hemisphere_and_the_same_everywhere() {
        let tile = vectors(Jitter::Tile);
        assert!(tile.iter().all(|v| (v.length() - 1.0).abs() < 1e-7 && v.z >= 0.0), "{tile:?}");
        for (i, v) in tile.iter().enumerate() {
            assert!(tile[..i].iter().all(|other| other.distance(*v) > 0.01), "two texels are alike: {tile:?}");
        }
        // The mean of 16 vectors that are uniform over the hemisphere has z = 1/2 with a standard deviation of
        // 1/sqrt(12 * 16), and x = y = 0 with a standard deviation of 1/sqrt(3 * 16) each.
        let mean = tile.iter().sum::<DVec3>() / 16.0;
        assert!((mean.z - 0.5).abs() < 0.22 && mean.truncate().length() < 0.5, "{mean}");
        assert_eq!(vectors(Jitter::None), [DVec3::Z; 16]);
        let texel = tile[0].as_vec3().to_array();
        assert_eq!(texel.map(f32::to_bits), [3_178_113_546, 3_198_166_795, 1_064_481_443], "{texel:?}");
    }

    #[test]
    fn the_tile_of_hbao_view_is_spread_evenly_over_every_block() {
        let all: Vec<[f64; 2]> = (0..16).map(|i| even(i % 4, i / 4)).collect();
        for k in [0, 1] {
            let mut sorted: Vec<f64> = all.iter().map(|pair| pair[k]).collect();
            sorted.sort_by(f64::total_cmp);
            assert!(sorted.iter().enumerate().all(|(j, &value)| value == (j as f64 + 0.5) / 16.0), "{sorted:?}");
        }
        // One pair in each of the 16 squares of a 4x4 grid.
        let mut cells: Vec<usize> = all.iter().map(|[a, b]| (4.0 * a) as usize * 4 + (4.0 * b) as usize).collect();
        cells.sort_unstable();
        assert!(cells.iter().enumerate().all(|(i, &cell)| i == cell), "{cells:?}");
        // The tile repeats, so a block may start at any texel.
        for (x, y) in (0..16).map(|i| (i % 4, i / 4)) {
            let block = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| even((x + i) % 4, (y + j) % 4)[0]);
            let mut quarters = block.map(|turn| (4.0 * turn) as usize);
            quarters.sort_unstable();
            assert_eq!(quarters, [0, 1, 2, 3], "{block:?} at {x}, {y}");
        }
    }

    #[test]
    fn the_tile_turns_by_less_than_a_direction_and_is_the_same_everywhere() {
        for count in [1, 3, 8, 64] {
            let tile = rotation_tile(&Settings { directions: count, ..Settings::default() });
            for [c, s, b] in tile.texels.iter().copied() {
                let a = f64::from(s).atan2(f64::from(c)).rem_euclid(TAU);
                assert!(a < TAU / f64::from(count) + 1e-6 && (0.0..1.0).contains(&b), "{a} {b}");
                assert!((c.hypot(s) - 1.0).abs() < 1e-6);
            }
            let first = tile.texels[0];
            assert!(tile.texels[1..].iter().all(|&texel| texel != first), "no two texels are alike");
        }
        let texel = rotation_tile(&Settings::default()).texels[0];
        assert_eq!(texel.map(f32::to_bits), [1_062_736_183, 1_057_574_011, 1_064_481_443], "{texel:?}");
    }
}
