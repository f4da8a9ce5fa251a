//! At half resolution a quarter of the pixels is computed, and the same picture appears in the same place.

use crate::rig;
use crate::rig::by_hand::{ByHand, orthographic, perspective, slope};
use crate::rig::{Limits, SIZE, everywhere, hold, scenes};
use glam::DVec3;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::Projection;
use hbao::settings::{AoFormat, BlurKernel, Jitter};
use hbao::{NormalEncoding, Settings, TextureTarget};

/// Every pairing of odd and even, and the smallest sizes.
const SIZES: [(u32, u32); 8] = [(1, 1), (2, 1), (1, 3), (5, 2), (8, 8), (9, 8), (8, 9), (31, 17)];

const KERNELS: [BlurKernel; 2] = [BlurKernel::Separable, BlurKernel::Full];

/// Makes a view in which the plane n.P = -distance fills the image.
fn plane(projection: Projection, size: (u32, u32), n: DVec3, distance: f64) -> ByHand {
    let depth = Image::from_fn(size.0 as usize, size.1 as usize, |x, y| {
        let [u, v] = slope(projection, size, x, y);
        let z = if projection.is_perspective() {
            -distance / n.dot(DVec3::new(u, v, 1.0))
        } else {
            (-distance - n.x * u - n.y * v) / n.z
        };
        z as f32
    });
    let normals = depth.map(|_| n.as_vec3().to_array());
    ByHand { depth, normals, projection }
}

#[test]
fn planes_are_open_at_every_size_odd_and_even() {
    let context = Context::open(Backend::Egl).unwrap();
    for size in SIZES {
        for kernel in KERNELS {
            for projection in [perspective(60.0, size), orthographic(0.2, size)] {
                let view = plane(projection, size, DVec3::new(0.2, -0.3, -1.0).normalize(), 5.0);
                // At these sizes the radius is some 16 texels, so that no pixel returns early.
                let settings = Settings { half_res: true, steps: 2, blur_kernel: kernel, ..rig::float_settings(40.0) };
                for (who, got) in view.by_both(context.gl(), &settings) {
                    let ones = view.depth.map(|_| 1.0);
                    hold(
                        "plane",
                        &got,
                        &ones,
                        &view.covered(),
                        everywhere(1e-4),
                        &format!("{who} {size:?} {kernel:?}"),
                    );
                }
            }
        }
    }
}

/// At an odd size the first texel is the mirror image of the last one, and so on for all between. A picture that is
/// shifted by less than a texel would not match its mirror image.
#[test]
fn a_mirrored_world_gives_the_mirrored_image_at_an_odd_size() {
    let context = Context::open(Backend::Osmesa).unwrap();
    for shot in [scenes::box_on_a_floor(), scenes::floor_and_wall().orthographic()] {
        let base = Settings { jitter: Jitter::None, half_res: true, ..rig::float_settings(2.0 * shot.radius) };
        for kernel in KERNELS {
            let settings = Settings { blur_kernel: kernel, ..base.clone() };
            let frame = rig::render(context.gl(), &shot, SIZE, &settings);
            let mirrored = rig::render(context.gl(), &shot.mirrored(), SIZE, &settings);
            let turned =
                |image: &Image<f32>| Image::from_fn(image.width, image.height, |x, y| image.at(image.width - 1 - x, y));
            let (depth, ao) = (turned(&mirrored.depth), turned(&mirrored.ao));
            let mask = Image::from_fn(ao.width, ao.height, |x, y| {
                frame.depth.at(x, y).is_finite() && depth.at(x, y).is_finite()
            });
            // A pixel centre on an edge, or a sample on a texel's border, may fall to either side, and the blur spreads
            // the difference.
            let limits = Limits { tolerance: 5e-3, share: 0.03 };
            hold("mirrored", &ao, &frame.ao, &mask, limits, shot.name);
            let shifted = Image::from_fn(ao.width, ao.height, |x, y| ao.at((x + 1).min(ao.width - 1), y));
            let moved = rig::compare(&shifted, &frame.ao, &mask, limits);
            assert!(moved.is_err(), "a shift by one pixel is not noticed");
        }
    }
}

#[test]
fn the_blur_brings_a_ramp_to_full_size_without_moving_it() {
    for (width, height) in [(48, 32), (49, 33)] {
        let depth = Image::filled(width, height, 5.0f32);
        let view = Projection::perspective(1.0, 1.5);
        let ramp = |x: usize, y: usize| 0.3 + 0.005 * x as f64 + 0.004 * y as f64;
        // Texel (i, j) was computed at pixel (2i, 2j).
        let half = Image::from_fn(width.div_ceil(2), height.div_ceil(2), |i, j| ramp(2 * i, 2 * j));
        for kernel in KERNELS {
            for blur in [3, 9, 21] {
                let settings = Settings { half_res: true, blur, blur_kernel: kernel, ..rig::float_settings(1.0) };
                let got = reference::blur::blur(&half, &depth, &[], view, &settings).unwrap();
                // Nearer to the border, taps are missing on one side.
                let inside = |side: usize, at: usize| (11..side - 12).contains(&at);
                let mask = Image::from_fn(width, height, |x, y| inside(width, x) && inside(height, y));
                let expected = Image::from_fn(width, height, ramp);
                hold("ramp", &got, &expected, &mask, everywhere(1e-12), &format!("{kernel:?} {blur}"));
            }
        }
    }
}

/// One pixel lies behind hills, in an odd row and column, for which no texel of ambient occlusion was computed.
#[test]
fn a_pixel_between_the_texels_takes_the_visibility_nearest_in_depth() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (32, 32);
    // The heights of the taps all differ, so exactly one tap is nearest in depth.
    let hills = |x: usize, y: usize| 6.0 + ((x * 37 + y * 101) % 1024) as f32 / 256.0;
    let depth = Image::from_fn(32, 32, |x, y| if (x, y) == (15, 15) { 12.0 } else { hills(x, y) });
    let view = ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection: orthographic(0.5, size) };
    let base = Settings { half_res: true, steps: 4, blur_depth_sigma: Some(0.01), ..rig::float_settings(8.0) };
    let settings = Settings { blur_kernel: BlurKernel::Full, ..base };
    let raw = view.by_twin(&Settings { blur: 0, ..settings.clone() });
    // These are the 9x9 taps around (15, 15) that have a texel: those with even coordinates from 12 to 18.
    let taps: Vec<(usize, usize)> = (6..10).flat_map(|j| (6..10).map(move |i| (i, j))).collect();
    let nearest = *taps.iter().max_by(|a, b| hills(2 * a.0, 2 * a.1).total_cmp(&hills(2 * b.0, 2 * b.1))).unwrap();
    let expected = raw.at(nearest.0, nearest.1);
    for &(i, j) in taps.iter().filter(|&&tap| tap != nearest) {
        assert!((raw.at(i, j) - expected).abs() > 1e-3, "the tap {i}, {j} has the same visibility, {expected}");
    }
    for (who, got) in view.by_both(context.gl(), &settings) {
        assert!((got.at(15, 15) - expected).abs() < 1e-4, "{who}: {} not {expected}", got.at(15, 15));
    }
}

#[test]
fn two_dimensional_and_biased_textures_are_read_at_the_same_texels() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (31, 18);
    // A step in depth makes sure that reading one texel to the side would give another picture.
    let depth = Image::from_fn(31, 18, |x, y| if x > 14 && y > 6 { 4.0 } else { 5.0f32 });
    let view = ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection: perspective(60.0, size) };
    let settings = Settings { half_res: true, steps: 3, ..rig::float_settings(3.0) };
    let expected = view.by_shader(context.gl(), &settings);
    assert!(expected.texels.iter().any(|&a| a < 0.9));
    let got = view.by_shader_from(context.gl(), &settings, TextureTarget::Texture2d, NormalEncoding::Biased);
    assert_eq!(got, expected);
}

#[test]
fn half_resolution_looks_like_full_resolution() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::cornell_box();
    let full = Settings { ao_format: AoFormat::R32f, msaa: 1, ..rig::float_settings(150.0) };
    let half = Settings { half_res: true, ..full.clone() };
    let [full, half] = [full, half].map(|settings| rig::render(context.gl(), &shot, (160, 120), &settings).ao);
    let squares = full.texels.iter().zip(&half.texels).map(|(a, b)| f64::from(a - b).powi(2));
    let rmse = (squares.sum::<f64>() / full.texels.len() as f64).sqrt();
    // The measured value is 0.017. At half the size the samples are half as finely placed. For comparison, A itself
    // varies by 0.2 over the picture.
    assert!(rmse < 0.02, "{rmse}");
}
