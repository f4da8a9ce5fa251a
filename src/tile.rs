//! The 4x4 rotation tile of ShaderX7 6.2 (Directions and jittering): (cos a, sin a, b), a random angle below that
//! between two directions and a random fraction of a step, repeated over the screen.

use crate::image::Image;
use crate::settings::{Jitter, Settings};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use std::f64::consts::TAU;

/// Fixed, so that every run and platform jitters alike.
const SEED: u128 = 0x6862_616f_2008_0602;

/// (cos a, sin a, b) with a uniform in [0, 2 pi / N_d) and b in [0, 1); a = b = 0 without jitter. The pixel at window
/// position (x, y), y up, uses texel (x mod 4, y mod 4). The same on every platform.
pub fn rotation_tile(settings: &Settings) -> Image<[f32; 3]> {
    if settings.jitter == Jitter::None {
        return Image::filled(4, 4, [1.0, 0.0, 0.0]);
    }
    let mut random = Pcg64Mcg::new(SEED);
    // As many bits as float32 holds, so that b stays below 1 there.
    let mut uniform = move || (random.next_u64() >> 40) as f64 / (1u64 << 24) as f64;
    Image::from_fn(4, 4, |_, _| {
        let a = uniform() * TAU / f64::from(settings.directions);
        // libm's sine is the same everywhere; the standard library's is the platform's.
        [libm::cos(a) as f32, libm::sin(a) as f32, uniform() as f32]
    })
}

/// The unit vectors at angles 2 pi k / `count`.
pub(crate) fn directions(count: u32) -> Vec<[f64; 2]> {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(count);
    (0..count).map(|k| [libm::cos(angle(k)), libm::sin(angle(k))]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
