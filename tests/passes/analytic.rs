//! Tests against closed forms, which were derived by hand from the chapter's equations. They share no code with the
//! shader or its twin, and both must meet them.

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, columns, orthographic, perspective, plane, read_red};
use crate::rig::{SIZE, everywhere, hold, scenes};
use glam::DVec3;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::{Mesh, View};
use hbao::settings::{Attenuation, BlurKernel, Clamp, Grounding, Jitter, NormalFormat, Radius, Snap};
use hbao::{AmbientOcclusion, Inputs, NormalEncoding, Settings, TextureTarget};

/// The error that single precision leaves in a closed form.
pub(crate) const FLOAT: f64 = 2e-5;

/// Unit normals of planes that face the eye on the picture's axis, and of some that only the picture's border sees. For
/// these, tilted by more than 90 degrees, n.z is positive, as on walls beside the camera.
pub(crate) fn tilts() -> impl Iterator<Item = DVec3> {
    [0.0, 20.0, 45.0, 70.0, 80.0, 95.0, 110.0f64].into_iter().flat_map(|tilt| {
        [0.0, 37.0, 90.0, 211.0, 300.0f64].into_iter().take(if tilt == 0.0 { 1 } else { 5 }).map(move |turn| {
            let (sin, cos) = tilt.to_radians().sin_cos();
            let (s, c) = turn.to_radians().sin_cos();
            DVec3::new(sin * c, sin * s, -cos)
        })
    })
}

#[test]
fn every_plane_is_open() {
    const SIZE: (u32, u32) = (33, 25);
    let context = Context::open(Backend::Egl).unwrap();
    let mut views = Vec::new();
    for n in tilts() {
        for fov in [20.0, 45.0, 90.0, 120.0] {
            views.push(plane(perspective(fov, SIZE), SIZE, n, -3.0 * n.z.abs()));
        }
        if n.z < 0.0 {
            views.push(plane(orthographic(0.1, SIZE), SIZE, n, 5.0 * n.z));
        }
    }
    // Some planes are not visible in a narrow view. Enough are visible that have n.z > 0.
    views.retain(|view| view.covered().texels.contains(&true));
    assert!(views.iter().filter(|view| view.normals.at(0, 0)[2] > 0.0).count() >= 10);
    for snap in [Snap::Step, Snap::Sample] {
        let settings = Settings { snap, blur: 0, ..rig::float_settings(2.0) };
        let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
        for view in &views {
            let text = format!("{snap:?} {:?} n = {:?}", view.projection, view.normals.at(0, 0));
            let textures = Textures::new(context.gl(), view, TextureTarget::Rectangle, NormalEncoding::Signed);
            let by_shader = textures.visibility(&mut ao, view).map(f64::from);
            for (who, got) in [("shader", by_shader), ("twin", view.by_twin(&settings))] {
                hold(who, &got, &got.map(|_| 1.0), &view.covered(), everywhere(1e-3), &text);
            }
        }
    }
}

#[test]
fn a_plane_is_not_open_when_grounded_by_direction_and_snapped_by_sample() {
    let context = Context::open(Backend::Egl).unwrap();
    let n = DVec3::new(0.6, 0.3, -0.5).normalize();
    let view = plane(perspective(60.0, SIZE), SIZE, n, 3.0 * n.z);
    let grounded = Settings { snap: Snap::Sample, blur: 0, ..rig::float_settings(1.0) };
    let by_direction = Settings { grounding: Grounding::Direction, ..grounded.clone() };
    for ((who, open), (_, closed)) in
        view.by_both(context.gl(), &grounded).into_iter().zip(view.by_both(context.gl(), &by_direction))
    {
        let least = |image: &Image<f64>| image.texels.iter().copied().fold(1.0, f64::min);
        assert!(least(&open) > 1.0 - 1e-3, "{who}: {}", least(&open));
        assert!(least(&closed) < 0.98, "{who}: {}", least(&closed));
    }
}

/// With R = 8 and 3 steps, samples are at 2, 4 and 6 texels. The 4 directions are right, up, left and down.
fn right_angles() -> Settings {
    Settings { directions: 4, steps: 3, jitter: Jitter::None, blur: 0, ..rig::float_settings(8.0) }
}

/// Compares the shader and the twin with a visibility that depends only on a texel's column.
#[track_caller]
fn hold_columns(view: &ByHand, settings: &Settings, skip: &[usize], expected: impl Fn(usize) -> f64) {
    let context = Context::open(Backend::Egl).unwrap();
    let expected = Image::from_fn(view.depth.width, view.depth.height, |x, _| expected(x));
    let mask = Image::from_fn(view.depth.width, view.depth.height, |x, _| !skip.contains(&x));
    for (who, got) in view.by_both(context.gl(), settings) {
        hold(who, &got, &expected, &mask, everywhere(FLOAT), &settings.to_toml().to_string());
    }
}

/// On a floor that faces the eye, t = 0, so a column of height h at m texels occludes by sin phi times W, with sin phi
/// = h / sqrt(m^2 + h^2) (Eq. 6.2.6) and W = 1 - (m^2 + h^2) / R^2. It is met in one of four directions.
#[test]
fn a_wall_on_a_floor_occludes_by_its_sine_times_its_weight() {
    const H: f64 = 3.0;
    hold_columns(&columns(0.0, &[(20, H)]), &right_angles(), &[], |x| match x.abs_diff(20) {
        m @ (2 | 4 | 6) => {
            let squared = (m * m) as f64 + H * H;
            1.0 - (1.0 - squared / 64.0) * H / squared.sqrt() / 4.0
        }
        _ => 1.0,
    });
}

#[test]
fn linear_attenuation_is_one_less_the_distance_and_none_is_one() {
    const H: f64 = 3.0;
    for attenuation in [Attenuation::Linear, Attenuation::None] {
        let settings = Settings { attenuation, ..right_angles() };
        hold_columns(&columns(0.0, &[(20, H)]), &settings, &[], |x| match x.abs_diff(20) {
            m @ (2 | 4 | 6) => {
                let distance = ((m * m) as f64 + H * H).sqrt();
                let weight = if attenuation == Attenuation::Linear { 1.0 - distance / 8.0 } else { 1.0 };
                1.0 - weight * H / distance / 4.0
            }
            _ => 1.0,
        });
    }
}

/// A wall of height 6 is sqrt(72) > 8 away at 6 texels, and sqrt(52) at 4 texels.
#[test]
fn a_sample_beyond_the_radius_is_ignored() {
    let settings = Settings { attenuation: Attenuation::None, ..right_angles() };
    hold_columns(&columns(0.0, &[(20, 6.0)]), &settings, &[], |x| match x.abs_diff(20) {
        m @ (2 | 4) => 1.0 - 6.0 / ((m * m) as f64 + 36.0).sqrt() / 4.0,
        _ => 1.0,
    });
}

/// Eq. 6.2.9 with two occluders: W_1 (s_1 - t) + W_2 [(s_2 - t) - (s_1 - t)]. The floor falls away to the right by 1/2
/// per texel, so t = -1/2 / sqrt(5/4) to the right.
#[test]
fn a_second_occluder_adds_what_it_rises_above_the_first() {
    const RISE: f64 = 0.5;
    let (low, high) = (1.5, 6.0);
    // With R = 16 and 3 steps, samples are at 4, 8 and 12 texels.
    let view = columns(RISE, &[(20, low), (24, high)]);
    let settings = Settings { radius: Radius::Units(16.0), ..right_angles() };
    let t = -RISE / (1.0 + RISE * RISE).sqrt();
    // Returns (sine, W) of a column m texels to the right.
    let met = |m: f64, h: f64| {
        let (away, squared) = (RISE * m - h, m * m + (RISE * m - h).powi(2));
        (-away / squared.sqrt(), 1.0 - squared / 256.0)
    };
    let expected = |x: usize| {
        let occlusion = match x {
            16 => {
                let ((s1, w1), (s2, w2)) = (met(4.0, low), met(8.0, high));
                assert!(s1 > t && s2 > s1);
                w1 * (s1 - t) + w2 * ((s2 - t) - (s1 - t))
            }
            // Both columns are met, at 8 and 12 texels.
            12 => {
                let ((s1, w1), (s2, w2)) = (met(8.0, low), met(12.0, high));
                assert!(s2 > s1);
                w1 * (s1 - t) + w2 * ((s2 - t) - (s1 - t))
            }
            8 => {
                let (s, w) = met(12.0, low);
                w * (s - t)
            }
            _ => 0.0,
        };
        1.0 - occlusion / 4.0
    };
    // To the right of the columns and on them, other samples would have to be derived, so these are left out.
    let skip: Vec<usize> = (17..41).collect();
    hold_columns(&view, &settings, &skip, expected);
}

/// A nearer occluder hides a farther one that does not rise above it.
#[test]
fn an_occluder_below_the_horizon_adds_nothing() {
    let view = columns(0.0, &[(20, 3.0), (22, 3.5)]);
    let occlusion = |m: f64, h: f64| (1.0 - (m * m + h * h) / 64.0) * h / (m * m + h * h).sqrt();
    hold_columns(&view, &right_angles(), &(19..41).collect::<Vec<_>>(), |x| {
        1.0 - match x {
            14 => occlusion(6.0, 3.0),
            16 => occlusion(4.0, 3.0),
            18 => occlusion(2.0, 3.0),
            _ => 0.0,
        } / 4.0
    });
}

/// With t = 0 the horizon starts at the bias, and an occluder counts from there: sin phi - sin bias.
#[test]
fn the_bias_lowers_occlusion_by_its_sine() {
    const H: f64 = 3.0;
    for degrees in [10.0, 45.0, 60.0f64] {
        let settings = Settings { bias: degrees.to_radians(), ..right_angles() };
        hold_columns(&columns(0.0, &[(20, H)]), &settings, &[], |x| match x.abs_diff(20) {
            m @ (2 | 4 | 6) => {
                let squared = (m * m) as f64 + H * H;
                let above = (H / squared.sqrt() - degrees.to_radians().sin()).max(0.0);
                1.0 - (1.0 - squared / 64.0) * above / 4.0
            }
            _ => 1.0,
        });
    }
}

#[test]
fn strength_multiplies_occlusion_until_all_is_closed() {
    const H: f64 = 3.0;
    for strength in [0.5, 2.0, 20.0] {
        let settings = Settings { strength, ..right_angles() };
        hold_columns(&columns(0.0, &[(20, H)]), &settings, &[], |x| match x.abs_diff(20) {
            m @ (2 | 4 | 6) => {
                let squared = (m * m) as f64 + H * H;
                (1.0 - strength * (1.0 - squared / 64.0) * H / squared.sqrt() / 4.0).max(0.0)
            }
            _ => 1.0,
        });
    }
}

/// On a floor that falls away to the right by 1 per texel, an offset (u, v) has T = (u, v, u), so sin t = -u / |T|.
///
/// There are three directions and steps of 3.2 texels. The second direction's samples, at 3.2 (-1/2, 0.866) and twice
/// that, are taken at (-2, 3) and (-3, 6), which are off the direction. The third direction's samples mirror these.
/// Those of the first, which points to the right, are exact.
#[test]
fn grounding_by_sample_takes_the_tangent_of_the_offset_taken() {
    let context = Context::open(Backend::Egl).unwrap();
    let settings = Settings { directions: 3, steps: 2, snap: Snap::Sample, ..right_angles() };
    let settings = Settings { radius: Radius::Units(9.6), attenuation: Attenuation::None, ..settings };
    let tangent = |u: f64, v: f64| -u / DVec3::new(u, v, u).length();
    // One texel rises 4 above the floor. It is seen from the pixel for which it is at (-2, 3), and becomes the horizon
    // there.
    let (x, y) = (20, 8);
    let mut view = columns(1.0, &[]);
    let width = view.depth.width;
    view.depth.texels[y * width + x] -= 4.0;
    let pixel = (x + 2, y - 3);
    let sine = 6.0 / DVec3::new(-2.0, 3.0, -6.0).length();
    // With its own tangent it adds how far it rises above the floor there, and nothing else rises above the floor.
    let by_sample = 1.0 - (sine - tangent(-2.0, 3.0)) / 3.0;
    // With the direction's tangent it starts elsewhere, and the bare floor in the third direction rises above that
    // tangent.
    let theta = tangent(-0.5, 0.75f64.sqrt());
    let floor = tangent(-2.0, -3.0).max(tangent(-3.0, -6.0)) - theta;
    assert!(floor > 0.03);
    let by_direction = 1.0 - (sine - theta + floor) / 3.0;
    for (grounding, expected) in [(Grounding::Sample, by_sample), (Grounding::Direction, by_direction)] {
        let settings = Settings { grounding, ..settings.clone() };
        for (who, got) in view.by_both(context.gl(), &settings) {
            let got = got.at(pixel.0, pixel.1);
            assert!((got - expected).abs() < FLOAT, "{who}, {grounding:?}: {got}, not {expected}");
        }
    }
}

/// With b = 1/2 and steps of 2, the first offset is round(b 2) = 1, so samples are at 3, 5 and 7 texels. a = 90 degrees
/// turns the one direction from right to up. A pixel uses the tile's row y mod 4 and column x mod 4.
#[test]
fn the_tile_turns_directions_and_offsets_steps_each_pixel_by_its_own_texel() {
    let settings = Settings { directions: 1, ..right_angles() };
    let tile = Image::from_fn(4, 4, |x, y| match (x, y) {
        (1, 2) => [1.0, 0.0, 0.5],
        (3, 0) => [0.0, 1.0, 0.5],
        _ => [1.0, 0.0, 0.0],
    });
    let h = 3.0;
    let occlusion = |m: usize| {
        let squared = (m * m) as f64 + h * h;
        (1.0 - squared / 64.0) * h / squared.sqrt()
    };
    let wall = columns(0.0, &[(20, h)]);
    let got = reference::visibility(&wall.twin_inputs(&tile), &settings).unwrap();
    let expected = Image::from_fn(got.width, got.height, |x, y| {
        let samples: &[usize] = match (x % 4, y % 4) {
            (1, 2) => &[3, 5, 7],
            (3, 0) => &[],
            _ => &[2, 4, 6],
        };
        1.0 - if x < 20 && samples.contains(&(20 - x)) { occlusion(20 - x) } else { 0.0 }
    });
    hold("wall to the right", &got, &expected, &wall.covered(), everywhere(1e-12), "");

    // This wall runs across, in row 11. Only the pixels whose direction is turned by 90 degrees meet it, in rows 8 and
    // 4.
    let width = wall.depth.width;
    let mut wall = columns(0.0, &[]);
    wall.depth.texels[11 * width..12 * width].iter_mut().for_each(|z| *z -= h as f32);
    let got = reference::visibility(&wall.twin_inputs(&tile), &settings).unwrap();
    let expected = Image::from_fn(got.width, got.height, |x, y| {
        1.0 - if x % 4 == 3 && (y == 8 || y == 4) { occlusion(11 - y) } else { 0.0 }
    });
    hold("wall above", &got, &expected, &wall.covered(), everywhere(1e-12), "");
}

/// R is 4 texels. 3 steps are one texel long each. 4 steps are shorter, and then the chapter's method returns early.
#[test]
fn a_step_below_one_texel_leaves_all_open() {
    let wall = columns(0.0, &[(20, 1.0)]);
    let context = Context::open(Backend::Egl).unwrap();
    for (steps, open) in [(3, false), (4, true)] {
        let settings = Settings { steps, radius: Radius::Units(4.0), ..right_angles() };
        for (who, got) in wall.by_both(context.gl(), &settings) {
            assert_eq!(got.texels.iter().all(|&a| a == 1.0), open, "{who}, {steps} steps");
        }
    }
}

#[test]
fn beyond_the_border_position_keeps_a_plane_open_and_depth_does_not() {
    let context = Context::open(Backend::Egl).unwrap();
    let n = DVec3::new(0.5, 0.3, -0.8).normalize();
    let view = plane(perspective(50.0, SIZE), SIZE, n, 3.0 * n.z);
    for (clamp, open) in [(Clamp::Position, true), (Clamp::Depth, false)] {
        let settings = Settings { clamp, blur: 0, ..rig::float_settings(1.0) };
        for (who, got) in view.by_both(context.gl(), &settings) {
            let least = got.texels.iter().copied().fold(1.0, f64::min);
            assert_eq!(least > 1.0 - 1e-3, open, "{who}, {clamp:?}: {least}");
            // In the middle both are open, because no sample from there is clamped.
            assert!(got.at(48, 30) > 1.0 - 1e-3);
        }
    }
}

#[test]
fn background_is_open_and_occludes_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    // One view is a floor with a strip of background, and the other has nothing but background.
    let mut strip = columns(0.0, &[(19, f64::NEG_INFINITY), (20, f64::NEG_INFINITY)]);
    let mut nothing = columns(0.0, &[]);
    nothing.depth = nothing.depth.map(|_| f32::INFINITY);
    for view in [&mut strip, &mut nothing] {
        for blur in [0, 9] {
            let settings = Settings { blur, ..right_angles() };
            for (who, got) in view.by_both(context.gl(), &settings) {
                assert!(got.texels.iter().all(|&a| (a - 1.0).abs() < 1e-6), "{who}");
            }
        }
    }
}

#[test]
fn the_blur_of_a_constant_is_that_constant() {
    // The heights vary, so the weights differ, but their sum cancels.
    let depth = Image::from_fn(31, 23, |x, y| 5.0 + ((x * 7 + y * 13) % 11) as f32 / 10.0);
    for blur_kernel in [BlurKernel::Separable, BlurKernel::Full] {
        let settings = Settings { blur: 9, blur_kernel, ..rig::float_settings(1.0) };
        let got =
            reference::blur::blur(&depth.map(|_| 0.625), &depth, &[], perspective(1.0, (1, 1)), &settings).unwrap();
        hold("blur", &got, &got.map(|_| 0.625), &got.map(|_| true), everywhere(1e-12), "");
    }
}

#[test]
fn the_blur_does_not_cross_a_step_much_deeper_than_sigma() {
    let depth = Image::from_fn(31, 23, |x, _| if x < 15 { 5.0 } else { 6.0 });
    let ao = Image::from_fn(31, 23, |x, _| if x < 15 { 0.25 } else { 0.75 });
    for blur_kernel in [BlurKernel::Separable, BlurKernel::Full] {
        let settings = Settings { blur: 21, blur_kernel, blur_depth_sigma: Some(0.1), ..rig::float_settings(1.0) };
        let got = reference::blur::blur(&ao, &depth, &[], perspective(1.0, (1, 1)), &settings).unwrap();
        hold("blur", &got, &ao, &got.map(|_| true), everywhere(1e-12), "");
    }
}

/// The default sigma is R/4, so a step of R/4 has the weight exp(-1/2).
#[test]
fn a_depth_difference_of_sigma_weighs_exp_of_minus_one_half() {
    let depth = Image::from_fn(2, 1, |x, _| 5.0 + 0.5 * x as f32);
    let ao = Image::from_fn(2, 1, |x, _| x as f64);
    let settings = Settings { blur: 3, ..rig::float_settings(2.0) };
    let got = reference::blur::blur(&ao, &depth, &[], perspective(1.0, (1, 1)), &settings).unwrap();
    // s = 1, so the neighbour has the weight exp(-1/2) for its place, and the same again for its depth.
    let weight = (-1.0f64).exp();
    assert!((got.at(0, 0) - weight / (1.0 + weight)).abs() < 1e-12);
}

/// On a flat floor a raised texel darkens others around it. Blurred with a sigma beyond all depths, that image must be
/// its own convolution with the Gaussian of s = (radius + 1)/2, cut off at the kernel and at the picture.
#[test]
fn on_a_floor_the_blur_is_the_gaussian_of_half_its_radius_and_one() {
    let context = Context::open(Backend::Egl).unwrap();
    let mut view = columns(0.0, &[]);
    let (width, height) = (view.depth.width, view.depth.height);
    for (x, y) in [(20, 6), (3, 2), (37, 12)] {
        view.depth.texels[y * width + x] -= 3.0;
    }
    for (blur, s) in [(3, 1.0), (9, 2.5), (21, 5.5)] {
        for blur_kernel in [BlurKernel::Separable, BlurKernel::Full] {
            let raw = Settings { blur: 0, ..right_angles() };
            let blurred = Settings { blur, blur_kernel, blur_depth_sigma: Some(1e6), ..right_angles() };
            let raws = view.by_both(context.gl(), &raw);
            for ((who, raw), (_, got)) in raws.into_iter().zip(view.by_both(context.gl(), &blurred)) {
                let radius = (blur / 2) as i64;
                let expected = Image::from_fn(width, height, |x, y| {
                    let (mut sum, mut weights) = (0.0, 0.0);
                    for ty in (y as i64 - radius).max(0)..=(y as i64 + radius).min(height as i64 - 1) {
                        for tx in (x as i64 - radius).max(0)..=(x as i64 + radius).min(width as i64 - 1) {
                            let squared = (tx - x as i64).pow(2) + (ty - y as i64).pow(2);
                            let weight = (-(squared as f64) / (2.0 * s * s)).exp();
                            sum += weight * raw.at(tx as usize, ty as usize);
                            weights += weight;
                        }
                    }
                    sum / weights
                });
                assert!(raw.texels.iter().any(|&a| a < 0.9));
                hold(who, &got, &expected, &got.map(|_| true), everywhere(FLOAT), &format!("{blur} {blur_kernel:?}"));
            }
        }
    }
}

#[test]
fn no_radius_makes_background_occlude() {
    let context = Context::open(Backend::Egl).unwrap();
    let mut strip = columns(0.0, &[(19, f64::NEG_INFINITY), (20, f64::NEG_INFINITY)]);
    strip.projection = perspective(60.0, strip.size());
    for radius in [1e3, 1e16, 1e18, 1e25, 1e300] {
        let settings = Settings { blur: 0, ..rig::float_settings(radius) };
        for (who, got) in strip.by_both(context.gl(), &settings) {
            assert!(got.texels.iter().all(|&a| (a - 1.0).abs() < 1e-4), "{who} at R = {radius:e}");
        }
    }
    // Here the application's background lies within R of its surfaces.
    let near = ByHand { depth: strip.depth.map(|z| if z.is_finite() { z } else { 150.0 }), ..strip };
    let textures = Textures::new(context.gl(), &near, TextureTarget::Rectangle, NormalEncoding::Signed);
    let inputs = Inputs { background: 150.0, ..textures.inputs };
    for method in rig::methods().filter(|method| method.reads("radius")) {
        let settings = Settings { method, snap: Snap::Step, spacing: 1.0, blur: 0, ..rig::float_settings(200.0) };
        let mut ao = AmbientOcclusion::new(context.gl().clone(), near.size(), &settings).unwrap();
        let visibility = ao.render(&inputs).unwrap();
        let got = read_red(context.gl(), visibility, near.depth.texels.len());
        assert!(got.iter().all(|&a| (a - 1.0).abs() < 1e-4), "{}", method.name());
    }
}

#[test]
fn the_bias_stands_where_the_tangent_has_no_direction() {
    let context = Context::open(Backend::Egl).unwrap();
    let mut wall = columns(0.0, &[(20, 3.0)]);
    wall.normals = wall.normals.map(|_| [0.0; 3]);
    let settings = Settings { bias: 30f64.to_radians(), ..right_angles() };
    let [(_, shader), (_, twin)] = wall.by_both(context.gl(), &settings);
    hold("shader", &shader, &twin, &wall.covered(), everywhere(FLOAT), "normals of no length");
    assert!(twin.texels.iter().any(|&a| a < 0.95));
}

#[test]
fn a_surface_on_the_far_plane_is_seen() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let corners = [(-90., -90.), (90., -90.), (90., 90.), (-90., 90.)].map(|(x, y)| DVec3::new(x, y, -5.0));
    let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let view = View { eye: Some(DVec3::ZERO), target: Some(-DVec3::Z), far: Some(5.0), ..View::default() };
    let shot = rig::Shot::new("wall", mesh, view, 1.0);
    for shot in [shot.clone(), shot.orthographic()] {
        let frame = rig::render(context.gl(), &shot, SIZE, &rig::float_settings(1.0));
        assert!(frame.depth.texels.iter().all(|&z| (z - 5.0).abs() < 1e-5));
    }
}

/// This plane is rendered into the G-buffer, with normals in RGBA16F and depth on the triangle.
#[test]
fn a_rendered_plane_is_open() {
    let context = Context::open(Backend::Osmesa).unwrap();
    for shot in [scenes::tilted_plane(), scenes::tilted_plane().orthographic(), scenes::floor()] {
        let settings = Settings { normal_format: NormalFormat::Rgba16f, blur: 0, ..rig::float_settings(shot.radius) };
        let frame = rig::render(context.gl(), &shot, SIZE, &settings);
        let twin = reference::visibility(&frame.inputs(), &settings).unwrap();
        for (who, got) in [("shader", frame.raw.map(f64::from)), ("twin", twin)] {
            hold(who, &got, &got.map(|_| 1.0), &frame.covered(), everywhere(2e-3), shot.name);
        }
    }
}

#[test]
fn biased_and_two_dimensional_textures_give_what_signed_rectangles_do() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = columns(0.5, &[(20, 3.0)]);
    let settings = right_angles();
    let expected = view.by_shader(context.gl(), &settings);
    for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
        for encoding in [NormalEncoding::Signed, NormalEncoding::Biased] {
            let got = view.by_shader_from(context.gl(), &settings, target, encoding);
            let text = format!("{target:?} {encoding:?}");
            hold("texture", &got, &expected, &view.covered(), everywhere(FLOAT), &text);
        }
    }
}
