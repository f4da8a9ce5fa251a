//! Some changes must not change the image: the scale and place of the world, its mirror image, the frame of the picture
//! and, where samples can be made to lie on the same rays, the size of the picture.

use crate::rig;
use crate::rig::{Frame, Limits, SIZE, Shot, hold, scenes};
use glam::{DVec3, dvec3};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::Lens;
use hbao::settings::{Jitter, Method, Radius, Snap, TileKind};

/// Rounds a shot to coordinates that float32 and float64 hold with bits to spare, so that a translation rounds nothing.
fn coarse(shot: &Shot) -> Shot {
    let round = |p: DVec3| (p * 1024.0).round() / 1024.0;
    let mut shot = shot.clone();
    shot.mesh.positions.iter_mut().for_each(|p| *p = round(*p));
    shot.view.eye = shot.view.eye.map(round);
    shot.view.target = shot.view.target.map(round);
    shot
}

fn hold_identical(got: &Frame, expected: &Frame, what: &str) {
    let bits = |image: &Image<f32>| image.map(f32::to_bits);
    assert_eq!(got.normals.map(|n| n.map(f32::to_bits)), expected.normals.map(|n| n.map(f32::to_bits)), "{what}");
    assert_eq!(bits(&got.raw), bits(&expected.raw), "{what}");
    assert_eq!(bits(&got.ao), bits(&expected.ao), "{what}");
    assert_eq!(got.edges, expected.edges, "{what}");
    assert!(expected.raw.texels.iter().any(|&a| a < 0.95), "{what}");
}

/// Runs `body` for every method, with one shot in perspective and one that is orthographic.
fn each_method(mut body: impl FnMut(&Context, &Shot, &Settings, &str)) {
    let context = Context::open(Backend::Osmesa).unwrap();
    for method in rig::methods() {
        for shot in [scenes::box_on_a_floor(), scenes::floor_and_wall().orthographic()] {
            let settings = Settings { blur: Settings::default().blur, ..rig::raw(method, shot.radius) };
            let what = format!("{} of {}", method.name(), shot.name);
            body(&context, &shot, &settings, &what);
        }
    }
}

#[test]
fn a_world_scaled_by_a_power_of_two_looks_the_same_to_the_bit() {
    each_method(|context, shot, settings, what| {
        let frame = rig::render(context.gl(), shot, SIZE, settings);
        for factor in [-40, -20, 20, 40].map(|n| 2f64.powi(n)) {
            let scaled = shot.scaled(factor);
            let settings = rig::scaled(settings, factor);
            let other = rig::render(context.gl(), &scaled, SIZE, &settings);
            hold_identical(&other, &frame, &format!("{what} by {factor:e}"));
        }
    });
}

/// Factors that are not powers of two change how float32 rounds. Pixels where the twin says that float32 may decide
/// otherwise are left out.
#[test]
fn a_world_far_smaller_or_larger_looks_the_same() {
    let context = Context::open(Backend::Osmesa).unwrap();
    for shot in [scenes::box_on_a_floor(), scenes::ball().orthographic()] {
        let settings = |radius: f64| Settings { blur: 9, ..rig::float_settings(radius) };
        let frame = rig::render(context.gl(), &shot, SIZE, &settings(shot.radius));
        let ambiguous = reference::ambiguous(&frame.inputs(), &settings(shot.radius)).unwrap();
        for factor in [1e-10, 1e-3, 1e3, 1e10] {
            let shot = shot.scaled(factor);
            let other = rig::render(context.gl(), &shot, SIZE, &settings(shot.radius));
            let mask = Image::from_fn(ambiguous.width, ambiguous.height, |x, y| {
                frame.depth.at(x, y).is_finite() && other.depth.at(x, y).is_finite() && !ambiguous.at(x, y)
            });
            let text = format!("{} by {factor}", shot.name);
            // At an edge, a pixel may see another triangle.
            let limits = Limits { tolerance: 1e-3, share: 0.001 };
            hold("raw", &other.raw, &frame.raw, &mask, limits, &text);
            hold("blurred", &other.ao, &frame.ao, &mask, Limits { share: 0.01, ..limits }, &text);
        }
    }
}

#[test]
fn a_world_a_million_away_looks_the_same_to_the_bit() {
    each_method(|context, shot, settings, what| {
        let shot = coarse(shot);
        let frame = rig::render(context.gl(), &shot, SIZE, settings);
        for offset in [dvec3(1e6, 0.0, 0.0), dvec3(-1e6, 1e6, 1e6), dvec3(3.0, 1e9, -1e7)] {
            let mut moved = shot.clone();
            moved.mesh.positions.iter_mut().for_each(|p| *p += offset);
            moved.view.eye = moved.view.eye.map(|p| p + offset);
            moved.view.target = moved.view.target.map(|p| p + offset);
            let other = rig::render(context.gl(), &moved, SIZE, settings);
            hold_identical(&other, &frame, &format!("{what} at {offset}"));
        }
    });
}

#[test]
fn a_mirrored_world_gives_the_mirrored_image_by_every_method() {
    each_method(|context, shot, settings, what| {
        if settings.method.facts().tile == TileKind::Vectors {
            // The offsets of this method are points in space, at the corners of a cube with a series of lengths.
            // Together they are not their own mirror image.
            return;
        }
        let settings = Settings { jitter: Jitter::None, ..settings.clone() };
        let frame = rig::render(context.gl(), shot, SIZE, &settings);
        let mirrored = rig::render(context.gl(), &shot.mirrored(), SIZE, &settings);
        let turned =
            |image: &Image<f32>| Image::from_fn(image.width, image.height, |x, y| image.at(image.width - 1 - x, y));
        let ambiguous = reference::ambiguous(&frame.inputs(), &settings).unwrap();
        let (depth, raw) = (turned(&mirrored.depth), turned(&mirrored.raw));
        let mask = Image::from_fn(raw.width, raw.height, |x, y| {
            frame.depth.at(x, y).is_finite() && depth.at(x, y).is_finite() && !ambiguous.at(x, y)
        });
        // A pixel centre that lies on an edge belongs to the triangle on one side, which is another triangle in the
        // mirror.
        hold("mirrored", &raw, &frame.raw, &mask, Limits { tolerance: 1e-3, share: 0.005 }, what);
    });
}

/// The pixels of the small image have the same rays as pixels of the large one, and the offset is a whole number of
/// tile periods. Farther than R from the border they must have the same values.
#[test]
fn a_smaller_field_of_view_crops_the_image() {
    const FULL: (u32, u32) = (120, 88);
    const PART: (u32, u32) = (72, 56);
    let (left, low) = (((FULL.0 - PART.0) / 2) as usize, ((FULL.1 - PART.1) / 2) as usize);
    each_method(|context, shot, settings, what| {
        if !settings.method.reads("radius") {
            // The offsets of this method are shares of the image, and this image shows less.
            return;
        }
        let mut full = shot.clone();
        let mut part = shot.clone();
        let share = f64::from(PART.1) / f64::from(FULL.1);
        part.view.lens = match full.view.lens {
            Some(Lens::FovY(fov)) => Some(Lens::FovY(2.0 * ((fov / 2.0).tan() * share).atan())),
            Some(Lens::Height(height)) => Some(Lens::Height(height * share)),
            Some(lens) => panic!("this test does not know how to scale {lens:?}"),
            None => None,
        };
        full.view.near = Some(1.0);
        full.view.far = Some(20.0);
        (part.view.near, part.view.far) = (full.view.near, full.view.far);
        // The radius is at most about 8 pixels.
        let settings = Settings { radius: Radius::Units(shot.radius * 0.2), steps: 3, blur: 3, ..settings.clone() };
        let frame = rig::render(context.gl(), &full, FULL, &settings);
        let cropped = rig::render(context.gl(), &part, PART, &settings);
        let ambiguous = reference::ambiguous(&cropped.inputs(), &settings).unwrap();
        let part = |image: &Image<f32>| Image::from_fn(72, 56, |x, y| image.at(x + left, y + low));
        let (of_full, blurred) = (part(&frame.raw), part(&frame.ao));
        let margin = 16;
        let mask = Image::from_fn(of_full.width, of_full.height, |x, y| {
            let inside =
                (margin..of_full.width - margin).contains(&x) && (margin..of_full.height - margin).contains(&y);
            inside && cropped.depth.at(x, y).is_finite() && !ambiguous.at(x, y)
        });
        let limits = Limits { tolerance: 1e-3, share: 0.005 };
        hold("cropped", &cropped.raw, &of_full, &mask, limits, what);
        // The blur spreads the few pixels that differ, so their neighbours are left out too.
        let same = |x: usize, y: usize| (cropped.raw.at(x, y) - of_full.at(x, y)).abs() <= 1e-3;
        let all_same = Image::from_fn(mask.width, mask.height, |x, y| {
            mask.at(x, y) && (0..9).all(|i| same(x + i % 3 - 1, y + i / 3 - 1))
        });
        hold("cropped and blurred", &cropped.ao, &blurred, &all_same, limits, what);
        let occluded = (0..mask.texels.len()).any(|i| mask.texels[i] && of_full.texels[i] < 0.95);
        assert!(occluded, "{what}");
    });
}

/// In the large picture, 3 by 3 texels cover the area of one texel of the small picture, and the middle one has the
/// same ray. A step along an axis is two texels in the small picture and six in the large one, so the samples lie on
/// the same rays too.
#[test]
fn three_times_the_size_gives_the_same_image_at_the_same_rays() {
    const SMALL: (u32, u32) = (47, 31);
    const LARGE: (u32, u32) = (3 * SMALL.0, 3 * SMALL.1);
    let context = Context::open(Backend::Osmesa).unwrap();
    let shot = scenes::box_on_a_floor().orthographic();
    // This radius gives four steps of two texels, along the axes.
    let radius = 10.0 * shot.height / f64::from(SMALL.1);
    // The micro-sphere method is left out: each of its samples stands for a number of texels, and there are nine times
    // as many texels.
    for method in rig::methods().filter(|&method| method.reads("snap") && method != Method::Microsphere) {
        for snap in [Snap::Step, Snap::Sample, Snap::None] {
            let few = Settings { directions: 4, steps: 4, ..rig::raw(method, radius) };
            let settings = Settings { snap, spacing: 1.0, jitter: Jitter::None, ..few };
            let what = format!("{} {snap:?}", method.name());
            let [small, large] = [SMALL, LARGE].map(|size| rig::render(context.gl(), &shot, size, &settings));
            let middle = |image: &Image<f32>| Image::from_fn(47, 31, |x, y| image.at(3 * x + 1, 3 * y + 1));
            let (depth, raw) = (middle(&large.depth), middle(&large.raw));
            // Samples are clamped to the border texels. In the large picture, the centres of these are a third as far
            // from the border.
            let inside = |x: usize, y: usize| (8..47 - 8).contains(&x) && (8..31 - 8).contains(&y);
            let mask = Image::from_fn(47, 31, |x, y| {
                inside(x, y) && small.depth.at(x, y).is_finite() && depth.at(x, y).is_finite()
            });
            assert!((0..mask.texels.len()).any(|i| mask.texels[i] && raw.texels[i] < 0.9), "{what}");
            let one = small.depth.map(|_| 1.0);
            let relative = Image::from_fn(47, 31, |x, y| depth.at(x, y) / small.depth.at(x, y));
            // The rasteriser rounds vertices to 1/256 of a pixel. In the large picture this is three times as fine, so
            // a few pixels at silhouettes differ.
            let limits = |tolerance| Limits { tolerance, share: 0.005 };
            hold("depth", &relative, &one, &mask, limits(1e-6), &what);
            hold("raw", &raw, &small.raw, &mask, limits(1e-3), &what);
        }
    }
}

/// The creases and the part of the world that R covers do not depend on the size of the picture. But a method that
/// compares a sample with the direction's tangent or with a ray, instead of with the tangent at the sample's own texel,
/// lets a tilted plane occlude itself by up to half a texel. The talk's method and ray-march therefore give a more open
/// image in a finer picture.
#[test]
fn twice_the_size_gives_nearly_the_same_mean() {
    each_method(|context, shot, settings, what| {
        if !settings.method.reads("radius") {
            // The offsets of this method are shares of the picture. In a small picture, a sample that rounds to P's own
            // texel does not occlude P.
            return;
        }
        let radius = Radius::Units(1.5 * shot.radius);
        let settings = Settings { directions: 16, steps: 12, radius, ..settings.clone() };
        let mean = |size: (u32, u32)| {
            let frame = rig::render(context.gl(), shot, size, &settings);
            let covered = frame.covered();
            let of = |i: &usize| covered.texels[*i];
            let all: Vec<f64> = (0..covered.texels.len()).filter(of).map(|i| frame.raw.texels[i].into()).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let (small, large) = (mean((64, 48)), mean((128, 96)));
        let tolerance = if settings.method == Method::Hbao { 0.005 } else { 0.05 };
        assert!(small < 0.99 && (small - large).abs() < tolerance, "{what}: {small} and {large}");
    });
}
