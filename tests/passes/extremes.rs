//! Views in which an equation degenerates: walls along the view axis, samples straight in front, steps that collapse,
//! normals of no length or beyond the silhouette, radii far beyond the picture, pictures of one texel, and triangles at
//! the eye. Shader and twin must agree there, and both must match the closed form where there is one.

use crate::rig;
use crate::rig::by_hand::{self, ByHand, Textures, orthographic, perspective};
use crate::rig::{FOUR_SAMPLES, Shot, everywhere, hold, raw};
use glam::{DVec3, dvec3};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::{Extents, Lens, Mesh, Projection, View};
use hbao::settings::{Clamp, Jitter, Method, Normals, Snap, SsaoDepth, Toggle};
use hbao::{AmbientOcclusion, NormalEncoding, Settings, TextureTarget, rotation_tile};

/// Compares the shader with the twin over views of one size, at the pixels that are not ambiguous. Most pixels may be
/// ambiguous here: if samples are equally high by construction, rounding decides which of them gives the talk's W.
fn hold_views(context: &Context, views: &[ByHand], settings: &Settings, what: &str) {
    let mut ao = AmbientOcclusion::new(context.gl().clone(), views[0].size(), settings).unwrap();
    for (i, view) in views.iter().enumerate() {
        let textures = Textures::new(context.gl(), view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let got = textures.visibility(&mut ao, view);
        let tile = rotation_tile(settings);
        let inputs = view.twin_inputs(&tile);
        let expected = reference::visibility(&inputs, settings).unwrap();
        let ambiguous = reference::ambiguous(&inputs, settings).unwrap();
        let (width, height) = (got.width, got.height);
        let clear = Image::from_fn(width, height, |x, y| view.covered().at(x, y) && !ambiguous.at(x, y));
        let text =
            format!("{} of view {i} {what}\n{:?}\n{}", settings.method.name(), view.projection, settings.to_toml());
        let count = |mask: &Image<bool>| mask.texels.iter().filter(|&&m| m).count();
        assert!(20 * count(&clear) > count(&view.covered()), "too few pixels are unambiguous: {text}");
        hold("raw", &got, &expected, &clear, everywhere(1e-3), &text);
        assert!(got.texels.iter().all(|a| (0.0..=1.0).contains(a)), "{text}");
    }
}

/// Checks shader and twin over views of planes of one size. By the closed form, planes are open.
fn hold_open(context: &Context, views: &[ByHand], settings: &Settings, what: &str) {
    let mut ao = AmbientOcclusion::new(context.gl().clone(), views[0].size(), settings).unwrap();
    for view in views {
        let textures = Textures::new(context.gl(), view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let shader = textures.visibility(&mut ao, view).map(f64::from);
        for (who, got) in [("shader", shader), ("twin", view.by_twin(settings))] {
            let text = format!("{what} {:?} n = {:?}", view.projection, view.normals.at(0, 0));
            hold(who, &got, &got.map(|_| 1.0), &view.covered(), everywhere(1e-3), &text);
        }
    }
}

/// In perspective, a wall beside the eye is visible even if n.z = 0 or n.z > 0, where the view axis lies in the wall's
/// plane or above it.
#[test]
fn walls_along_the_view_axis_match_their_twins_and_are_open() {
    const SIZE: (u32, u32) = (33, 25);
    let context = Context::open(Backend::Egl).unwrap();
    let mut views = Vec::new();
    for fov in [1.0f64, 60.0, 150.0, 175.0] {
        let projection = perspective(fov, SIZE);
        for turn in [0.0f64, 37.0, 90.0, 211.0] {
            let (sin, cos) = turn.to_radians().sin_cos();
            for z in [0.0, 1e-8, -1e-8, 1e-3, 0.3 * (fov / 2.0).to_radians().tan()] {
                let n = dvec3(cos, sin, z).normalize();
                // At a depth of 1, the wall begins halfway between the middle of the picture and its border.
                views.push(by_hand::plane(projection, SIZE, n, -0.5 * (fov / 2.0).to_radians().tan()));
            }
        }
    }
    views.retain(|view| view.covered().texels.iter().filter(|&&c| c).count() > 50);
    assert!(views.iter().filter(|view| view.normals.at(0, 0)[2] == 0.0).count() >= 10);
    let narrow = |view: &ByHand| view.projection.is_perspective() && view.projection.half_extents()[1] < 0.1;
    let wide: Vec<ByHand> = views.iter().filter(|view| !narrow(view)).cloned().collect();
    for method in rig::methods() {
        // Beyond 64 texels, float32 is too imprecise for the sum of micro-spheres: see `amplifies` in
        // tests/stability.rs.
        let wide = if method == Method::Microsphere { wide.as_slice() } else { &views };
        hold_views(&context, wide, &raw(method, 2.0), "beside the eye");
    }
    for snap in [Snap::Step, Snap::Sample] {
        let settings = Settings { snap, ..raw(Method::Hbao, 2.0) };
        hold_open(&context, &views, &settings, &format!("{snap:?}"));
    }
}

/// The case D.xy = 0: if z x' is the same for P and the sample, the sample is in front of P on a line along the view
/// axis. Its elevation is 90 degrees, and the tangent would be infinite.
#[test]
fn a_sample_straight_in_front_closes_its_direction_by_its_weight() {
    // With this projection, x' is 4/41 at column 22 and 8/41 at column 24.
    let projection = Projection::Perspective(Extents::centred(1.0, 3.0 / 41.0));
    let context = Context::open(Backend::Egl).unwrap();
    for z in [1e-6, 1.0, 1e6, 1e12] {
        let depth = Image::from_fn(41, 3, |x, y| match (x, y) {
            (22, 1) => z as f32,
            (24, 1) => (z as f32) / 2.0,
            _ => f32::INFINITY,
        });
        let view = ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection };
        // The radius is ten steps of two texels.
        let radius = 20.0 * z * 2.0 / 41.0;
        let r = 0.5 * z / radius;
        for (method, snap) in [Snap::Step, Snap::Sample, Snap::None]
            .map(|snap| (Method::Hbao, snap))
            .into_iter()
            .chain([(Method::HbaoTalk, Snap::Step), (Method::HbaoTalk, Snap::Sample)])
        {
            for bias in [0.0f64, 0.5, 89f64.to_radians()] {
                let settings =
                    Settings { snap, bias, jitter: Jitter::None, directions: 1, steps: 9, ..raw(method, radius) };
                let weight = if method == Method::Hbao { 1.0 - r * r } else { 1.0 - r };
                let expected = 1.0 - weight * (1.0 - bias.sin());
                for (who, got) in view.by_both(context.gl(), &settings) {
                    let a = got.at(22, 1);
                    assert!(
                        (a - expected).abs() < 1e-5,
                        "{who}: {a} is not {expected}, {method:?} {snap:?} {bias} {z:e}"
                    );
                }
            }
        }
        for method in rig::methods() {
            let settings = Settings { directions: 4, jitter: Jitter::None, ..raw(method, radius) };
            hold_views(&context, std::slice::from_ref(&view), &settings, "straight in front");
        }
    }
}

/// If steps are just above one texel, offsets round to the nearest texels and never to P's own. If they are shorter,
/// horizon methods return early, and marched rays end in P's own texel and meet nothing. In a small picture, Crysis'
/// offsets end there too.
#[test]
fn steps_that_collapse_towards_the_centre_match_their_twins() {
    const SIZE: (u32, u32) = (31, 23);
    let context = Context::open(Backend::Osmesa).unwrap();
    for projection in [orthographic(0.25, SIZE), perspective(60.0, SIZE)] {
        let view = [by_hand::rubble(SIZE, projection, 11, 8.0..9.0)];
        let texel = match projection {
            Projection::Orthographic { .. } => 0.25,
            Projection::Perspective(extents) => 8.0 * 2.0 * extents.half()[1] / f64::from(SIZE.1),
        };
        for method in rig::methods() {
            for texels in [0.1, 0.999, 1.001, 1.3] {
                for (snap, jitter) in [(Snap::Step, Jitter::Tile), (Snap::None, Jitter::None)] {
                    let settings =
                        Settings { snap, jitter, directions: 5, steps: 3, ..raw(method, 4.0 * texels * texel) };
                    let settings = rig::evenly_if_stepping(settings);
                    hold_views(&context, &view, &settings, &format!("at steps of {texels} texels"));
                }
            }
        }
        let marched = raw(Method::RayMarch, 1e-6 * texel);
        for (who, got) in view[0].by_both(context.gl(), &marched) {
            assert!(got.texels.iter().all(|&a| a == 1.0), "{who}");
        }
    }
}

/// All samples beyond the border read the border, whichever side they leave by. In the corners, three quarters of the
/// directions are clamped in both coordinates.
#[test]
fn planes_are_open_to_the_corners_at_every_radius_and_field_of_view() {
    const SIZE: (u32, u32) = (21, 15);
    let context = Context::open(Backend::Egl).unwrap();
    let views: Vec<ByHand> = [1.0, 20.0, 120.0, 175.0]
        .into_iter()
        .flat_map(|fov| {
            let n = |x: f64, y: f64| dvec3(x, y, -1.0 / (fov / 2.0f64).to_radians().tan()).normalize();
            [n(0.0, 0.0), n(0.3, 0.2), n(-0.5, 0.1)].map(|n| by_hand::plane(perspective(fov, SIZE), SIZE, n, 3.0 * n.z))
        })
        .chain([dvec3(0.4, -0.3, -0.8)].map(|n| by_hand::plane(orthographic(0.1, SIZE), SIZE, n, 5.0 * n.z)))
        .collect();
    for radius in [0.01, 10.0, 1e4, 1e15, 1e30] {
        let settings = Settings { directions: 16, steps: 5, ..raw(Method::Hbao, radius) };
        hold_open(&context, &views, &settings, &format!("R = {radius:e}"));
    }
}

#[test]
fn a_radius_across_the_whole_picture_and_far_beyond_matches_the_twin() {
    const SIZE: (u32, u32) = (21, 15);
    let context = Context::open(Backend::Osmesa).unwrap();
    let views: Vec<ByHand> =
        [(3, perspective(60.0, SIZE)), (4, perspective(175.0, SIZE)), (5, orthographic(0.5, SIZE))]
            .map(|(seed, projection)| by_hand::rubble(SIZE, projection, seed, 8.0..12.0))
            .into();
    for method in rig::methods() {
        // Beyond 64 texels, float32 is too imprecise for the sum of micro-spheres: see `amplifies` in
        // tests/stability.rs.
        let radii: &[f64] = if method == Method::Microsphere { &[10.0] } else { &[10.0, 1e3, 1e9, 1e16] };
        for &radius in radii {
            for clamp in [Clamp::Position, Clamp::Depth] {
                hold_views(&context, &views, &Settings { clamp, ..raw(method, radius) }, &format!("at R = {radius:e}"));
            }
        }
    }
}

/// At these sizes, half of an odd size is rounded up, and the last texel of half resolution lies at the border.
#[test]
fn pictures_of_few_texels_match_their_twins_at_half_resolution_with_the_blur() {
    let context = Context::open(Backend::Egl).unwrap();
    for size in [(1, 1), (2, 1), (1, 7), (13, 7)] {
        let view = by_hand::rubble(size, perspective(60.0, size), 21, 8.0..9.0);
        for method in rig::methods() {
            for (half_res, ssao_depth) in [(true, SsaoDepth::Full), (false, SsaoDepth::Half)] {
                let settings = Settings { half_res, ssao_depth, blur: 9, ..raw(method, 6.0) };
                let unblurred = Settings { blur: 0, ..settings.clone() };
                let text = format!("{} at {size:?}, half {half_res}, {ssao_depth:?}", method.name());
                let mut ao = AmbientOcclusion::new(context.gl().clone(), size, &settings).unwrap();
                let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
                let got = textures.visibility(&mut ao, &view);
                let tile = rotation_tile(&settings);
                let inputs = view.twin_inputs(&tile);
                let raw = reference::visibility(&inputs, &unblurred).unwrap();
                let ambiguous = reference::ambiguous(&inputs, &unblurred).unwrap();
                let expected = reference::blur::blur(&raw, &view.depth, &[], view.projection, &settings).unwrap();
                let unsure = reference::blur::ambiguous(&raw, &view.depth, &[], view.projection, &settings).unwrap();
                // In so small a picture, the blur spreads one ambiguous texel over all pixels.
                let clear = ambiguous.texels.iter().all(|&a| !a);
                assert!(clear, "{text}: choose another seed");
                hold("blurred", &got, &expected, &unsure.map(|a| !a), everywhere(1e-3), &text);
            }
        }
    }
}

/// The scene has triangles with corners at the eye, behind it and in its plane, triangles that are seen edge-on or have
/// no area, and one triangle twice.
#[test]
fn triangles_at_the_eye_and_of_no_area_leave_a_gbuffer_like_the_rays() {
    let context = Context::open(Backend::Egl).unwrap();
    let eye = dvec3(0.25, 0.5, 1.0);
    let wall = [dvec3(-2.0, -2.0, -1.0), dvec3(3.0, -2.0, -1.5), dvec3(0.0, 3.0, -1.2)];
    let at_the_eye = [eye, dvec3(1.0, 0.0, -0.5), dvec3(1.2, 1.0, -0.5)];
    let behind = [eye + dvec3(-0.3, -0.4, 1.0), dvec3(-1.0, -0.5, -0.7), dvec3(0.0, -0.6, -0.6)];
    let in_its_plane = [eye + dvec3(-0.5, 0.1, 0.0), eye + dvec3(-0.4, 0.4, 0.0), dvec3(-0.8, 1.2, -0.8)];
    let edge_on = [eye + dvec3(0.1, 0.0, -0.2), eye + dvec3(0.2, 0.1, -0.4), eye + dvec3(0.2, 0.0, -0.4)];
    let line = [dvec3(-1.0, 0.0, 0.0), dvec3(0.0, 0.1, 0.0), dvec3(1.0, 0.2, 0.0)];
    let point = [dvec3(0.1, 0.4, 0.0); 3];
    let triangles = [wall, wall, at_the_eye, behind, in_its_plane, edge_on, line, point];
    let positions: Vec<DVec3> = triangles.into_iter().flatten().collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new(positions, indices).unwrap();
    for lens in [Lens::FovY(f64::to_radians(60.0)), Lens::FovY(f64::to_radians(170.0)), Lens::Height(3.0)] {
        for (normals, msaa) in [(Normals::Derivative, 1), (Normals::Derivative, 4), (Normals::Vertex, 1)] {
            let view = View { eye: Some(eye), target: Some(eye - DVec3::Z), lens: Some(lens), ..View::default() };
            let shot = Shot::new("at the eye", mesh.clone(), view, 1.0);
            let size = (63, 47);
            let settings = Settings { normals, msaa, ..rig::float_settings(1.0) };
            let frame = rig::render(context.gl(), &shot, size, &settings);
            let text = format!("{lens:?} {normals:?} {msaa}");
            rig::twin::hold_raw(&frame, &settings, &text);
            let surfaces = rig::surfaces::Surfaces {
                depth: &frame.depth,
                normals: &frame.normals,
                rounded: 0.05,
                mesh: &mesh,
                camera: &shot.camera(size),
                by: normals,
                sample: if frame.samples.is_empty() { [0.0; 2] } else { FOUR_SAMPLES[0] },
            };
            let compared = surfaces.compare().unwrap_or_else(|why| panic!("{why}\n{text}"));
            assert!(compared > 300, "{compared}");
        }
    }
}

/// The rounding errors of float32 are multiplied by the strength. Planes stay open except for 3e-6 times the strength.
#[test]
fn a_great_strength_multiplies_what_is_rounded_off_and_no_more() {
    const SIZE: (u32, u32) = (33, 25);
    let context = Context::open(Backend::Egl).unwrap();
    let n = dvec3(0.5, 0.3, -0.8).normalize();
    let view = by_hand::plane(perspective(60.0, SIZE), SIZE, n, 3.0 * n.z);
    for strength in [1.0, 1e2, 1e4, 1e6, 1e300] {
        let settings = Settings { strength, ..raw(Method::Hbao, 1.0) };
        let got = view.by_shader(context.gl(), &settings);
        let least = 1.0 - 3e-6 * strength;
        assert!(got.texels.iter().all(|&a| (0.0..=1.0).contains(&a) && f64::from(a) >= least), "at {strength:e}");
    }
}

/// A texel at the bottom of a shaft that is s pixels wide. All samples are at the distance sqrt(2) s and at height s,
/// so m Omega n.D/|D| adds up to pi/(4 sqrt 2) of pi, whatever s is. A random test had found that 1 - sqrt(1 - x)
/// rounded all of it away.
#[test]
fn micro_spheres_far_away_keep_their_solid_angle() {
    let context = Context::open(Backend::Egl).unwrap();
    for s in [1e3, 1e6, 1e9, 1e12] {
        let size = (5, 5);
        let depth = Image::from_fn(5, 5, |x, y| if (x, y) == (2, 2) { 3.0 * s } else { 2.0 * s } as f32);
        let view = ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection: orthographic(1.0, size) };
        let settings = Settings {
            method: Method::Microsphere,
            steps: 1,
            // There is one direction along each axis.
            directions: 4,
            jitter: Jitter::None,
            clamp: Clamp::Depth,
            blur: 0,
            ..rig::float_settings(2.0 * s)
        };
        let expected = 1.0 - std::f64::consts::PI / (4.0 * 2f64.sqrt());
        for (who, got) in view.by_both(context.gl(), &settings) {
            assert!((got.at(2, 2) - expected).abs() < 1e-4, "{who} at {s:e}: {} is not {expected}", got.at(2, 2));
        }
    }
}

/// Between two texels of half resolution whose depths are equally near, either may be taken as the nearest.
#[test]
fn a_tie_between_the_nearest_taps_is_ambiguous() {
    let depth = Image::from_fn(5, 1, |x, _| [0.1f32, 0.2, 0.3, 0.4, 0.5][x]);
    let ao = Image { width: 3, height: 1, texels: vec![0.0, 0.5, 1.0] };
    let settings = Settings { half_res: true, blur: 3, blur_depth_sigma: Some(1e-3), ..rig::float_settings(1.0) };
    let ambiguous = reference::blur::ambiguous(&ao, &depth, &[], Projection::perspective(1.0, 5.0), &settings).unwrap();
    assert_eq!(ambiguous.texels, [false, true, false, true, false]);
}

/// Hills and holes, with every kind of normal that the passes must accept: of no length, of any length, edge-on except
/// for rounding, and beyond the silhouette.
#[test]
fn normals_of_any_length_edge_on_and_facing_away_match_the_twin() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (33, 21);
    for projection in [perspective(90.0, size), orthographic(0.1, size)] {
        // Sines with irrational factors are used instead of a random sequence.
        let wave = |x: usize, y: usize, k: f64| (x as f64 * 12.9898 * k + y as f64 * 78.233 + k).sin();
        let depth = Image::from_fn(33, 21, |x, y| {
            if wave(x, y, 5.0) > 0.95 { f32::INFINITY } else { (8.0 + 2.0 * wave(x, y, 1.0)) as f32 }
        });
        for length in [1e-30f64, 1e-20, 1e-3, 1.0, 1e10, 1e18, 1e30] {
            let normals = Image::from_fn(33, 21, |x, y| {
                let [sx, sy] = by_hand::slope(projection, size, x, y);
                let r = match projection {
                    Projection::Perspective { .. } => dvec3(sx, sy, 1.0),
                    Projection::Orthographic { .. } => DVec3::Z,
                };
                let n = dvec3(wave(x, y, 2.0), wave(x, y, 3.0), wave(x, y, 4.0));
                let n = match (x + y) % 4 {
                    0 => DVec3::ZERO,
                    1 => n - n.dot(r) / r.dot(r) * r,
                    _ => n,
                };
                (length * n).as_vec3().to_array()
            });
            let view = ByHand { depth: depth.clone(), normals, projection };
            for method in rig::methods() {
                let settings = Settings { bias: 0.2, ..raw(method, 2.0) };
                let settings = Settings { ssao_normals: Toggle::On, directions: 5, steps: 4, ..settings };
                hold_views(&context, std::slice::from_ref(&view), &settings, &format!("at length {length:e}"));
            }
        }
    }
}
