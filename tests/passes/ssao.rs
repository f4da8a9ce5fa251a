//! What ShaderX7 6.1 says about its method, and what 6.2 says against it, on surfaces for which the answer can be
//! derived by hand. The shader and its twin are both tested.

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, orthographic, perspective, read_red, rubble, slope};
use crate::rig::{SIZE, everywhere, hold, twin};
use glam::{DQuat, DVec2, DVec3};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference::anatomy::Anatomy;
use hbao::reference::visibility;
use hbao::scene::{Extents, Projection};
use hbao::settings::{Jitter, Method, Radius, SsaoDepth, SsaoRotation, Toggle};
use hbao::{AmbientOcclusion, Inputs, NormalEncoding, Settings, TextureTarget, rotation_tile};

/// The error that single precision leaves in a share of samples.
const FLOAT: f64 = 1e-6;

const ROTATIONS: [SsaoRotation; 2] = [SsaoRotation::Matrix, SsaoRotation::Mirror];

/// The accessibility itself, without the curve and the blur, in float.
fn plain() -> Settings {
    Settings { method: Method::Ssao, ssao_curve: Some(Toggle::Off), msaa: 1, blur: 0, ..rig::float_settings(1.0) }
}

/// A surface with normals that face the eye; a caller may replace them.
fn heights(projection: Projection, (width, height): (u32, u32), depth: impl FnMut(usize, usize) -> f64) -> ByHand {
    let mut depth = depth;
    let depth = Image::from_fn(width as usize, height as usize, |x, y| depth(x, y) as f32);
    ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection }
}

/// Checks that all covered pixels of a view have this value, for the shader and for the twin.
#[track_caller]
fn holds_everywhere(view: &ByHand, settings: &Settings, expected: f64) {
    let context = Context::open(Backend::Egl).unwrap();
    for (who, got) in view.by_both(context.gl(), settings) {
        let text = format!("{:?}\n{}", view.projection, settings.to_toml());
        hold(who, &got, &got.map(|_| expected), &view.covered(), everywhere(FLOAT), &text);
    }
}

/// Every variant of the method.
fn variants() -> Vec<Settings> {
    let mut all = Vec::new();
    for ssao_samples in [8, 16, 24] {
        for ssao_rotation in ROTATIONS {
            for ssao_depth in [SsaoDepth::Full, SsaoDepth::Half] {
                for ssao_normals in [Toggle::Off, Toggle::On] {
                    all.push(Settings { ssao_samples, ssao_rotation, ssao_depth, ssao_normals, ..plain() });
                }
            }
        }
    }
    all
}

/// The result is exact: opposite corners of a cube lie on opposite sides of the wall, whatever rotates them, so four of
/// eight are in front of it and four behind it. Texels beyond the border are those at the border.
#[test]
fn half_the_samples_about_a_flat_wall_are_open_and_three_quarters_after_the_curve() {
    for projection in [perspective(60.0, SIZE), perspective(120.0, SIZE), orthographic(0.1, SIZE)] {
        let wall = heights(projection, SIZE, |_, _| 7.3);
        for settings in variants().into_iter().filter(|s| s.ssao_normals == Toggle::Off) {
            holds_everywhere(&wall, &settings, 0.5);
            let curve = Settings { ssao_curve: Some(Toggle::On), ..settings };
            holds_everywhere(&wall, &curve, 0.75);
        }
    }
}

#[test]
fn with_normals_a_wall_that_faces_the_camera_is_open() {
    for projection in [perspective(60.0, SIZE), orthographic(0.1, SIZE)] {
        let wall = heights(projection, SIZE, |_, _| 7.3);
        for settings in variants().into_iter().filter(|s| s.ssao_normals == Toggle::On) {
            holds_everywhere(&wall, &settings, 1.0);
        }
    }
}

/// A^2 + A is 1 from A = 0.618 on, so that with it surfaces that are little occluded would all be white.
#[test]
fn with_normals_the_curve_is_off_unless_it_is_given() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble(SIZE, perspective(60.0, SIZE), 12, 4.0..8.0);
    let with = |ssao_curve| Settings { ssao_normals: Toggle::On, ssao_curve, ..plain() };
    let [by_default, off, on] =
        [None, Some(Toggle::Off), Some(Toggle::On)].map(|curve| view.by_both(context.gl(), &with(curve)));
    for (((who, got), (_, off)), (_, on)) in by_default.iter().zip(&off).zip(&on) {
        assert!(got == off && got != on, "{who}");
    }
}

/// A tilted wall is not quite open. Where it comes nearer to the eye, the range check moves open samples towards 0.5.
/// And a sample whose offset runs along the wall may lie behind the texel that it is rounded to.
#[test]
fn with_normals_a_tilted_wall_is_nearly_open() {
    let context = Context::open(Backend::Egl).unwrap();
    let settings = Settings { ssao_normals: Toggle::On, ..plain() };
    for tilt in [20.0, 45.0, 60.0f64] {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let n = DVec3::new(0.8 * sin, 0.6 * sin, -cos);
        for projection in [perspective(30.0, SIZE), orthographic(0.05, SIZE)] {
            let mut wall = heights(projection, SIZE, |x, y| {
                let [sx, sy] = slope(projection, SIZE, x, y);
                if projection.is_perspective() {
                    -7.3 * cos / n.dot(DVec3::new(sx, sy, 1.0))
                } else {
                    7.3 + (n.x * sx + n.y * sy) / cos
                }
            });
            wall.normals = wall.depth.map(|_| n.as_vec3().to_array());
            for (who, got) in wall.by_both(context.gl(), &settings) {
                // Beyond the border the wall is unknown, so pixels are left out whose samples, up to 0.0936 of the
                // picture away, may reach there.
                let inner = |i: &usize| {
                    let (x, y) = (i % got.width, i / got.width);
                    (10..got.width - 10).contains(&x) && (6..got.height - 6).contains(&y)
                };
                let open: Vec<f64> = (0..got.texels.len()).filter(inner).map(|i| got.texels[i]).collect();
                let mean = open.iter().sum::<f64>() / open.len() as f64;
                let least = open.iter().copied().fold(1.0, f64::min);
                assert!(mean > 0.97 && least > 0.7, "tilt {tilt} {projection:?} {who}: mean {mean}, least {least}");
            }
        }
    }
}

/// A wedge of 90 degrees in eye space whose edge runs across the picture, seen along its bisector. It is concave, or
/// convex if `sign` is 1. The picture is 2 P.z wide, so that the sphere of samples is a sphere in eye space too.
struct Wedge {
    sign: f64,
    perspective: bool,
    /// Whether the edge runs from left to right.
    level: bool,
    edge: usize,
}

impl Wedge {
    /// The number of texels across the edge, which is so large that half a texel is little.
    const ACROSS: u32 = 1203;
    /// The depth of the edge.
    const Z: f64 = 5.0;

    fn size(&self) -> (u32, u32) {
        if self.level { (4, Wedge::ACROSS) } else { (Wedge::ACROSS, 4) }
    }

    fn projection(&self) -> Projection {
        if self.perspective {
            Projection::Perspective(Extents::centred(1.0, 1.0))
        } else {
            Projection::Orthographic(Extents::centred(Wedge::Z, Wedge::Z))
        }
    }

    /// Returns depth divided by the edge's depth, at `t` texels from the edge: z = Z + sign |X - X_edge| on the ray
    /// there.
    fn depth(&self, t: f64) -> f64 {
        let texel = 2.0 / f64::from(Wedge::ACROSS);
        let a = (self.edge as f64 + 0.5) * texel - 1.0;
        let side = self.sign * t.signum();
        if self.perspective { (1.0 - side * a) / (1.0 - side * (a + t * texel)) } else { 1.0 + side * t * texel }
    }

    fn view(&self) -> ByHand {
        let edge = self.edge as f64;
        heights(self.projection(), self.size(), |x, y| {
            Wedge::Z * self.depth(if self.level { y } else { x } as f64 - edge)
        })
    }

    /// Returns the least and the greatest accessibility of a texel on the edge. Rounding may move each of its 16
    /// samples, rotated by the tile's vector, by up to half a texel.
    fn bounds(&self, rotation: SsaoRotation, v: DVec3) -> DVec2 {
        let mut bounds = DVec2::ZERO;
        let corners = (0..8).map(|k| DVec3::new(f64::from(k / 4), f64::from(k / 2 % 2), f64::from(k % 2)) * 2.0 - 1.0);
        for (i, corner) in corners.cycle().take(16).enumerate() {
            let offset = corner.normalize() * 0.01 * 1.15f64.powi(i as i32 + 1);
            let offset = match rotation {
                SsaoRotation::Matrix => DQuat::from_rotation_arc(DVec3::Z, v.normalize()) * offset,
                _ => offset.reflect(v.normalize()),
            };
            let t = if self.level { offset.y } else { offset.x } * f64::from(Wedge::ACROSS);
            let shares = [t - 0.5, t - 1e-9, t + 0.5].map(|t| {
                let z = self.depth(t);
                let range = ((1.0 - z) / z).clamp(0.0, 1.0);
                let open = f64::from(u8::from(z > 1.0 + 2.0 * offset.z));
                open * (1.0 - range) + 0.5 * range
            });
            bounds += DVec2::new(shares.into_iter().fold(1.0, f64::min), shares.into_iter().fold(0.0, f64::max));
        }
        bounds / 16.0
    }
}

/// Figure 6.1.4: the solid share is 0.75 around a corner and 0.25 around an edge. Each of the tile's 16 texels is
/// compared with its own 16 samples, which are computed here. This is exact except for samples within half a texel of
/// the surface. The paper's numbers are about their mean, which is only near them for two reasons. The tile's 16
/// vectors leave an edge up to 0.02 off (over all vectors, the matrix gives 0.235 and 0.765 in an orthographic view,
/// and the mirror 0.25 and 0.75). And in a corner the walls on both sides are nearer than P, so that the range check
/// moves each share by up to 0.19 towards 0.5.
#[test]
fn a_corner_is_a_quarter_open_and_an_edge_three_quarters() {
    let context = Context::open(Backend::Egl).unwrap();
    for (sign, paper) in [(-1.0, 0.25), (1.0, 0.75)] {
        for (perspective, level) in [(false, false), (false, true), (true, false), (true, true)] {
            let mut by_rotation = Vec::new();
            for rotation in ROTATIONS {
                let settings = Settings { ssao_rotation: rotation, ..plain() };
                let tile = rotation_tile(&settings);
                let (mut means, mut gap) = ([0.0; 2], 0.0);
                for edge in 600..604 {
                    let wedge = Wedge { sign, perspective, level, edge };
                    let got = wedge.view().by_both(context.gl(), &settings);
                    for along in 0..4 {
                        let (x, y) = if level { (along, edge) } else { (edge, along) };
                        let v = DVec3::from(tile.at(x % 4, y % 4).map(f64::from));
                        let bounds = wedge.bounds(rotation, v);
                        gap += (bounds.y - bounds.x) / 16.0;
                        for ((who, image), mean) in got.iter().zip(&mut means) {
                            let a = image.at(x, y);
                            let inside = a > bounds.x - 1e-5 && a < bounds.y + 1e-5;
                            assert!(inside, "{who} {rotation:?} {sign} {perspective} {level}: {a} {bounds}");
                            *mean += a / 16.0;
                        }
                    }
                }
                // Rounding to texels has little influence.
                assert!(gap < 0.035, "{gap}");
                for mean in means {
                    let more = mean - paper;
                    let near = if sign < 0.0 { (0.0..0.04).contains(&more) } else { more.abs() < 0.02 };
                    assert!(near, "{rotation:?} {sign} {perspective} {level}: {means:?}");
                }
                by_rotation.push(means[0]);
            }
            // The two rotations sample the same share in different ways.
            let apart = (by_rotation[0] - by_rotation[1]).abs();
            assert!(apart > 0.0 && apart < 0.03, "{by_rotation:?}");
        }
    }
}

#[test]
fn mirrored_offsets_are_others_than_turned_ones() {
    let context = Context::open(Backend::Egl).unwrap();
    let wedge = Wedge { sign: -1.0, perspective: true, level: false, edge: 600 }.view();
    let [turned, mirrored] =
        ROTATIONS.map(|rotation| wedge.by_shader(context.gl(), &Settings { ssao_rotation: rotation, ..plain() }));
    let differ = turned.texels.iter().zip(&mirrored.texels).filter(|(a, b)| (*a - *b).abs() > 0.03).count();
    let mean = |image: &Image<f32>| image.texels.iter().sum::<f32>() / image.texels.len() as f32;
    assert!(differ * 100 > turned.texels.len(), "{differ} texels differ");
    assert!((mean(&turned) - mean(&mirrored)).abs() < 0.01);
}

/// A floor that faces the eye, seen straight on, with columns of texels of these heights on it.
fn floor(height_at: impl Fn(usize) -> f64) -> ByHand {
    const SIZE: (u32, u32) = (401, 5);
    // A texel is 1 unit wide and the picture is 2 P.z wide, so that the samples fill a sphere.
    heights(orthographic(1.0, SIZE), SIZE, |x, _| 200.5 - height_at(x))
}

/// Figure 6.2.4: S is above the height field, but a ridge hides it from P, and no sample falls on the ridge. `ssao`
/// counts S as open. HBAO finds the ridge on its way.
#[test]
fn a_sample_hidden_from_p_by_a_ridge_counts_as_open_where_hbao_is_occluded() {
    const P: usize = 150;
    let ridge = |x: usize| if (P + 3..P + 8).contains(&x) { 12.0 } else { 0.0 };
    let (flat, ridged) = (floor(|_| 0.0), floor(ridge));
    // Without jitter, the offsets of the 8 samples are l_i / sqrt 3 along each axis. Samples 5 and 7 are to the right
    // and above the floor.
    let settings = Settings { ssao_samples: 8, jitter: Jitter::None, ssao_rotation: SsaoRotation::Matrix, ..plain() };
    for i in [5, 7] {
        let offset = 0.01 * 1.3f64.powi(i) / 3f64.sqrt() * 401.0;
        let at = P + (offset + 0.5).floor() as usize;
        // The sample is above the height field of the depth image, but below the ridge's top on the way there at 45
        // degrees.
        assert!(ridge(at) < offset && (P + 1..at).any(|x| ridge(x) > (x - P) as f64), "sample {i} at {at}");
    }
    let context = Context::open(Backend::Egl).unwrap();
    let hbao =
        Settings { method: Method::Hbao, directions: 4, steps: 12, radius: Radius::Units(26.0), ..settings.clone() };
    let at_p = |view: &ByHand, settings: &Settings| view.by_both(context.gl(), settings).map(|(_, a)| a.at(P, 2));
    assert_eq!(at_p(&flat, &settings), [0.5; 2]);
    assert_eq!(at_p(&ridged, &settings), [0.5; 2]);
    // One direction of four meets the ridge, first at 4 texels: sin phi = 12 / sqrt(4^2 + 12^2), W = 1 - 160 / 26^2.
    let occlusion = 12.0 / 160f64.sqrt() * (1.0 - 160.0 / 676.0) / 4.0;
    for a in at_p(&ridged, &hbao) {
        assert!((a - (1.0 - occlusion)).abs() < 1e-4, "{a} is not {}", 1.0 - occlusion);
    }
    assert!(at_p(&flat, &hbao).iter().all(|a| (a - 1.0).abs() < 1e-5));
}

/// The section on the depth range check. A texel at depth 100 is the bottom of a pit that is one texel wide, so
/// everything around it is solid. If the surroundings are at half of P's depth or nearer, nothing is known about the
/// space behind them, and half of it is taken to be open.
#[test]
fn what_is_far_nearer_than_p_leaves_it_half_open() {
    let context = Context::open(Backend::Egl).unwrap();
    let settings = Settings { jitter: Jitter::None, ..plain() };
    for (around, expected) in [(1.0, 0.5), (50.0, 0.5), (80.0, 0.125), (85.0, 0.5 * 15.0 / 85.0), (200.0, 1.0)] {
        let view = heights(orthographic(1.0, (401, 5)), (401, 5), |x, _| if x == 200 { 100.0 } else { around });
        for (who, got) in view.by_both(context.gl(), &settings) {
            let a = got.at(200, 2);
            assert!((a - expected).abs() < 1e-5, "{who}, {around} around: {a} is not {expected}");
        }
    }
}

/// The report shows what the range check is for by the twin without it.
#[test]
fn without_the_range_check_what_is_far_nearer_than_p_closes_it() {
    let settings = Settings { jitter: Jitter::None, ..plain() };
    let tile = rotation_tile(&settings);
    for (around, expected) in [(1.0, 0.0), (50.0, 0.0), (200.0, 1.0)] {
        let view = heights(orthographic(1.0, (401, 5)), (401, 5), |x, _| if x == 200 { 100.0 } else { around });
        let inputs = view.twin_inputs(&tile);
        let twin = Anatomy::new(&inputs, &settings).unwrap().without_range_check();
        assert_eq!(twin.visibilities(&[(200, 2)]), [Some(expected)], "{around} around");
    }
}

/// The report compares a picture with a wider one. Where the wider one repeats the depths at the picture's border, both
/// must be the same, so the offsets must be as long in texels.
#[test]
fn a_wider_picture_with_the_borders_depths_and_the_pictures_offsets_is_the_picture() {
    let (size, margin) = ((40, 24), 4);
    let settings = plain();
    let tile = rotation_tile(&settings);
    let view = rubble(size, orthographic(1.0, size), 5, 30.0..60.0);
    let (width, height) = (size.0 as usize, size.1 as usize);
    let inner = |v: usize, size: usize| v.saturating_sub(margin).min(size - 1);
    let wide = heights(orthographic(1.0, (48, 32)), (48, 32), |x, y| {
        f64::from(view.depth.at(inner(x, width), inner(y, height)))
    });
    let inputs = wide.twin_inputs(&tile);
    let twin = || Anatomy::new(&inputs, &settings).unwrap();
    let pixels: Vec<_> = (0..width * height).map(|i| (margin + i % width, margin + i / width)).collect();
    let expected = visibility(&view.twin_inputs(&tile), &settings).unwrap();
    let of = |twin: Anatomy| twin.visibilities(&pixels).into_iter().map(|a| a.unwrap_or(1.0)).collect::<Vec<f64>>();
    assert_eq!(of(twin().with_offsets_of((width, height))), expected.texels);
    assert_ne!(of(twin()), expected.texels, "the offsets do not follow the size of the picture");
}

#[test]
fn background_is_open_even_where_it_stands_for_a_depth_that_a_sample_exceeds() {
    // This is background as 16-bit depth holds it. Samples around a surface at 59000 reach beyond 60000.
    let view = heights(orthographic(1.0, SIZE), SIZE, |x, y| if (x, y) == (50, 30) { 59_000.0 } else { 60_000.0 });
    let context = Context::open(Backend::Egl).unwrap();
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let mut ao =
        AmbientOcclusion::new(context.gl().clone(), SIZE, &Settings { jitter: Jitter::None, ..plain() }).unwrap();
    let got = ao.render(&Inputs { background: 6e4, ..textures.inputs }).unwrap();
    let got = read_red(context.gl(), got, view.depth.texels.len());
    assert_eq!(got, vec![1.0; view.depth.texels.len()]);
}

/// The section on the edge-preserving blur. Where the surface is the same along a column, every fourth row uses the
/// same vectors, and a mean over 4x4 pixels has each of the sixteen vectors once. A wall that faces the camera has no
/// noise in the first place, but beside a step there is much.
#[test]
fn the_blur_of_4x4_leaves_no_noise_where_the_surface_is_the_same() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (96, 40);
    for projection in [perspective(60.0, size), orthographic(0.1, size)] {
        let step = heights(projection, size, |x, _| if x < 48 { 5.0 } else { 5.6 });
        for settings in variants().into_iter().filter(|s| s.ssao_samples == 16) {
            // The step is first within the blur's reach in depth, and then beyond it.
            for sigma in [None, Some(0.1)] {
                let settings = Settings { blur_depth_sigma: sigma, ..settings.clone() };
                let blurred = Settings { blur: 9, ..settings.clone() };
                let shaken = |(who, image): (&str, Image<f64>)| {
                    // Rows nearer to the border have taps on one side only.
                    let column = |x: usize| (2..38).map(move |y| (x, y));
                    let spread = |x: usize| {
                        let of = |f: fn(f64, f64) -> f64, start| column(x).map(|(x, y)| image.at(x, y)).fold(start, f);
                        of(f64::max, 0.0) - of(f64::min, 1.0)
                    };
                    ((0..96).map(spread).fold(0.0, f64::max), who.to_string())
                };
                for (before, who) in step.by_both(context.gl(), &settings).map(shaken) {
                    assert!(before > 0.05, "{who}: there is no noise, {before}");
                }
                for (after, who) in step.by_both(context.gl(), &blurred).map(shaken) {
                    assert!(after < FLOAT, "{who}: {after} is left\n{}", blurred.to_toml());
                }
            }
        }
    }
}

/// The section on the edge-preserving blur: only pixels with a similar depth are blended.
#[test]
fn the_blur_of_4x4_does_not_cross_a_step_deeper_than_sigma() {
    let context = Context::open(Backend::Egl).unwrap();
    let step = |far: f64| heights(orthographic(0.1, SIZE), SIZE, move |x, _| if x < 48 { 5.0 } else { far });
    // Sigma is a quarter of 2 P.z l_n, the depth of the farthest sample.
    let settings = Settings { blur: 9, jitter: Jitter::None, ..plain() };
    let sigma = 5.0 * 2.0 * 0.01 * 1.15f64.powi(16) / 4.0;
    for (who, crossed) in step(5.0 + 0.99 * sigma).by_both(context.gl(), &settings) {
        let raw = step(5.0 + 0.99 * sigma).by_twin(&Settings { blur: 0, ..settings.clone() });
        // Without jitter all pixels of a column are equal, so the mean is that of four columns.
        let mean = (46..50).map(|x| raw.at(x, 30)).sum::<f64>() / 4.0;
        assert!((crossed.at(48, 30) - mean).abs() < FLOAT && raw.at(47, 30) != raw.at(48, 30), "{who}");
    }
    for (who, kept) in step(5.0 + 1.01 * sigma).by_both(context.gl(), &settings) {
        let raw = step(5.0 + 1.01 * sigma).by_twin(&Settings { blur: 0, ..settings.clone() });
        assert!((kept.at(47, 30) - (45..48).map(|x| raw.at(x, 30)).sum::<f64>() / 3.0).abs() < FLOAT, "{who}");
    }
}

#[test]
fn at_half_resolution_the_blur_of_4x4_meets_each_texel_of_the_tile_once() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (97, 41);
    let step = heights(orthographic(0.1, size), size, |x, _| if x < 48 { 5.0 } else { 5.3 });
    let settings = Settings { half_res: true, blur: 9, ..plain() };
    for (who, image) in step.by_both(context.gl(), &settings) {
        assert_eq!((image.width, image.height), (97, 41));
        for x in 0..97 {
            // These rows are at least two texels of half resolution from the border, so all taps are inside.
            for y in 5..35 {
                assert!((image.at(x, y) - image.at(x, 5)).abs() < FLOAT, "{who} {x} {y}");
            }
        }
        assert!((20..70).any(|x| (image.at(x, 20) - 0.5).abs() > 0.05), "{who}: no occlusion is visible");
    }
}

#[test]
fn radius_directions_steps_and_strength_change_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble(SIZE, perspective(60.0, SIZE), 4, 8.0..10.0);
    let other = Settings { radius: Radius::Units(77.0), directions: 3, steps: 5, strength: 4.0, ..plain() };
    assert_eq!(view.by_shader(context.gl(), &plain()), view.by_shader(context.gl(), &other));
    assert_eq!(view.by_twin(&plain()), view.by_twin(&other));
}

#[test]
fn extremes_stay_finite_within_0_and_1_and_match_the_twin() {
    let context = Context::open(Backend::Egl).unwrap();
    let mut variants = variants();
    variants.extend(variants.clone().into_iter().map(|s| Settings { ssao_curve: Some(Toggle::On), ..s }));
    let mut next = variants.iter().cycle();
    for size in [(1, 1), (1, 7), (7, 1), (2, 3), (97, 1), (1, 61), (53, 31)] {
        let projections =
            [perspective(1.0, size), perspective(60.0, size), perspective(175.0, size), orthographic(1e-3, size)];
        for projection in projections {
            for depths in [8.0..10.0, 1e-6..1e-5, 1e-3..1e15, 1e14..1e15] {
                for seed in 0..4 {
                    let settings = next.next().unwrap();
                    let view = rubble(size, projection, seed, depths.clone());
                    let text = format!("{size:?} {projection:?} {depths:?} {seed}\n{}", settings.to_toml());
                    let tile = rotation_tile(settings);
                    // This also checks that values are finite and in [0, 1], and that background is 1.
                    let got = view.by_shader(context.gl(), settings);
                    twin::hold_visibility(&got, &view.twin_inputs(&tile), settings, &text);
                }
            }
        }
    }
}
