//! The other tests trust the image comparator. These tests check that it catches what it must.

use crate::rig;
use crate::rig::compare::{Limits, Mismatch, compare, everywhere};
use hbao::image::Image;

const WIDTH: usize = 9;
const HEIGHT: usize = 7;

/// An image in which no two texels, rows or columns are equal, and neighbours differ by 0.01 or more.
fn image() -> Image<f32> {
    Image::from_fn(WIDTH, HEIGHT, |x, y| 0.01 * (x + WIDTH * y) as f32)
}

fn all() -> Image<bool> {
    Image::filled(WIDTH, HEIGHT, true)
}

fn with(x: usize, y: usize, texel: f32) -> Image<f32> {
    let mut image = image();
    image.texels[y * WIDTH + x] = texel;
    image
}

fn mismatch(got: &Image<f32>, mask: &Image<bool>, limits: Limits) -> Mismatch {
    compare(got, &image(), mask, limits).unwrap_err()
}

#[test]
fn the_same_image_passes() {
    compare(&image(), &image(), &all(), everywhere(0.0)).unwrap();
}

#[test]
fn one_pixel_is_caught_and_named() {
    let got = with(4, 2, image().at(4, 2) + 0.5);
    let Mismatch::Differs { worst, at, over, compared } = mismatch(&got, &all(), everywhere(1e-3)) else { panic!() };
    assert!((worst - 0.5).abs() < 1e-6);
    assert_eq!((at, over, compared), ((4, 2), 1, WIDTH * HEIGHT));
}

#[test]
fn a_share_of_pixels_passes_only_up_to_that_share() {
    let got = with(4, 2, 9.0);
    let one = 1.0 / (WIDTH * HEIGHT) as f64;
    compare(&got, &image(), &all(), Limits { tolerance: 1e-3, share: 1.01 * one }).unwrap();
    assert!(compare(&got, &image(), &all(), Limits { tolerance: 1e-3, share: 0.99 * one }).is_err());
}

#[test]
fn a_constant_offset_is_caught() {
    let got = image().map(|t| t + 2e-3);
    let caught = mismatch(&got, &all(), Limits { tolerance: 1e-3, share: 0.5 });
    assert!(matches!(caught, Mismatch::Differs { over, .. } if over == WIDTH * HEIGHT));
    compare(&got, &image(), &all(), everywhere(3e-3)).unwrap();
}

#[test]
fn rows_turned_around_are_caught() {
    let got = Image::from_fn(WIDTH, HEIGHT, |x, y| image().at(x, HEIGHT - 1 - y));
    assert!(matches!(mismatch(&got, &all(), Limits { tolerance: 1e-3, share: 0.5 }), Mismatch::Differs { .. }));
}

#[test]
fn a_shift_by_a_texel_is_caught() {
    for (dx, dy) in [(1, 0), (0, 1)] {
        let got = Image::from_fn(WIDTH, HEIGHT, |x, y| image().at((x + dx) % WIDTH, (y + dy) % HEIGHT));
        assert!(matches!(mismatch(&got, &all(), Limits { tolerance: 5e-3, share: 0.5 }), Mismatch::Differs { .. }));
    }
}

#[test]
fn nan_and_infinity_are_caught_whatever_is_allowed() {
    let generous = Limits { tolerance: 1e9, share: 1.0 };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let got = with(3, 5, bad);
        assert_eq!(mismatch(&got, &all(), generous), Mismatch::NotFinite { pixels: 1, at: (3, 5) });
        let expected = compare(&image(), &got, &all(), generous).unwrap_err();
        assert_eq!(expected, Mismatch::NotFinite { pixels: 1, at: (3, 5) });
        // Pixels that are infinite in both images do not match either. The mask must leave such pixels out.
        assert!(compare(&got, &got, &all(), generous).is_err());
    }
}

#[test]
fn different_sizes_are_caught() {
    let turned = Image { width: HEIGHT, height: WIDTH, texels: image().texels };
    assert!(matches!(mismatch(&turned, &all(), everywhere(1e9)), Mismatch::Sizes(_)));
    let mask = Image::filled(WIDTH, HEIGHT - 1, true);
    assert!(matches!(mismatch(&image(), &mask, everywhere(1e9)), Mismatch::Sizes(_)));
}

#[test]
fn an_empty_comparison_fails() {
    assert_eq!(mismatch(&image(), &all().map(|_| false), everywhere(1e9)), Mismatch::Nothing);
    let empty = Image { width: 0, height: 0, texels: Vec::<f32>::new() };
    let mask = Image { width: 0, height: 0, texels: Vec::new() };
    assert_eq!(compare(&empty, &empty, &mask, everywhere(1e9)).unwrap_err(), Mismatch::Nothing);
}

#[test]
fn what_the_mask_leaves_out_does_not_matter() {
    let got = with(4, 2, f32::NAN);
    let mask = Image::from_fn(WIDTH, HEIGHT, |x, y| (x, y) != (4, 2));
    compare(&got, &image(), &mask, everywhere(0.0)).unwrap();
}

#[test]
fn a_failure_leaves_the_images_to_look_at() {
    let got = with(4, 2, 9.0);
    let caught = std::panic::catch_unwind(|| rig::hold("planted", &got, &image(), &all(), everywhere(0.0), "why"));
    let text = *caught.unwrap_err().downcast::<String>().unwrap();
    assert!(text.starts_with("planted: 1 of 63 pixels") && text.ends_with("\nwhy"), "{text}");
    let stem = text.lines().find_map(|line| line.strip_prefix("images: ")).unwrap().trim_end_matches('*');
    let read = hbao::image::exr::read::<f32>(format!("{stem}got.exr").as_ref()).unwrap();
    assert_eq!(read, got);
    for suffix in ["got.exr", "expected.exr", "difference.png"] {
        std::fs::remove_file(format!("{stem}{suffix}")).unwrap();
    }
}
