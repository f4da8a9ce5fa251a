//! Views whose axis does not go through the middle of the picture: tiles, jitter, a headset's eyes, shifted lenses.
//! Every pass matches its twin in them as it does in centred views.

use crate::rig;
use crate::rig::by_hand::{self, ByHand, rubble};
use crate::rig::{SIZE, Shot, everywhere, hold, scenes, twin};
use glam::DVec3;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference::gbuffer::gbuffer;
use hbao::reference::truth::Truth;
use hbao::reference::{self};
use hbao::scene::{Camera, Extents, Lens, Projection};
use hbao::settings::{Method, Normals, Radius, Snap, SsaoDepth, Toggle};
use hbao::{Error, NormalEncoding, Settings, TextureTarget, rotation_tile};

/// Extents of which the first hold the axis, off the middle, and the second do not. Pixels are not square.
const EXTENTS: [[f64; 4]; 2] = [[-0.2, 0.9, -0.6, 0.15], [0.3, 1.3, -1.0, -0.35]];

fn projections() -> Vec<Projection> {
    let extents = EXTENTS.map(|[left, right, bottom, top]| Extents::new(left, right, bottom, top));
    let wide = Extents::new(-2.0, 6.0, 2.0, 7.0);
    [extents.map(Projection::Perspective).as_slice(), &[Projection::Orthographic(wide)]].concat()
}

/// Returns a scene that an off-centre camera frames, so that it is seen whatever the extents are.
fn framed(shot: &Shot, lens: Lens) -> Shot {
    let mut shot = shot.clone();
    (shot.view.eye, shot.view.target, shot.view.lens) = (None, None, Some(lens));
    shot
}

fn framed_shots() -> Vec<Shot> {
    let orthographic = Lens::OrthoFrustum([7.0, 12.0, -9.0, -5.5]);
    let lenses = [Lens::Frustum(EXTENTS[0]), Lens::Frustum(EXTENTS[1]), orthographic];
    let shots = [scenes::box_on_a_floor(), scenes::floor_and_wall(), scenes::ball()];
    shots.iter().zip(lenses).map(|(shot, lens)| framed(shot, lens).rolled()).collect()
}

#[test]
fn rendered_views_match_the_ray_cast_and_every_twin() {
    let context = Context::open(Backend::Egl).unwrap();
    for shot in framed_shots() {
        for msaa in [1, 4] {
            let settings = Settings { msaa, ..rig::float_settings(shot.radius) };
            let frame = rig::render(context.gl(), &shot, SIZE, &settings);
            let text = format!("{:?}\n{}", shot.camera(SIZE), settings.to_toml());
            let covered = frame.covered().texels.iter().filter(|&&covered| covered).count();
            assert!(covered > 1000, "{covered}\n{text}");
            twin::hold_gbuffer(&frame, &shot, SIZE, &settings, &text);
            twin::hold_edges(&frame, &settings, &text);
            twin::hold_raw(&frame, &settings, &text);
            twin::hold_blur(&frame, &settings, &text);
        }
    }
}

#[test]
fn every_method_matches_its_twin_at_full_and_at_half_resolution() {
    let context = Context::open(Backend::Egl).unwrap();
    for (seed, projection) in (1..).zip(projections()) {
        let view = rubble(SIZE, projection, seed, 8.0..10.0);
        for method in rig::methods() {
            for half_res in [false, true] {
                let settings = Settings { half_res, ..rig::raw(method, 2.0) };
                let tile = rotation_tile(&settings);
                let inputs = view.twin_inputs(&tile);
                let got = raw(&context, &view, &settings);
                let text = format!("{projection:?}\n{}", settings.to_toml());
                let covered: Vec<f32> = got.texels.iter().copied().filter(|a| *a < 1.0).collect();
                assert!(covered.len() > 100, "{text}");
                twin::hold_visibility(&got, &inputs, &settings, &text);
            }
        }
        let flipped = Settings { ssao_normals: Toggle::On, ssao_depth: SsaoDepth::Half, ..rig::raw(Method::Ssao, 2.0) };
        let got = raw(&context, &view, &flipped);
        twin::hold_visibility(&got, &view.twin_inputs(&rotation_tile(&flipped)), &flipped, "ssao");
    }
}

/// Computes ambient occlusion without a blur. At half resolution the image has half the width and height.
fn raw(context: &Context, view: &ByHand, settings: &Settings) -> Image<f32> {
    let textures = by_hand::Textures::new(context.gl(), view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let mut ao = hbao::AmbientOcclusion::new(context.gl().clone(), view.size(), settings).unwrap();
    let visibility = ao.render(&textures.inputs).unwrap();
    let scale = if settings.half_res && settings.method.reads("half-res") { 2 } else { 1 };
    let (width, height) = (view.depth.width.div_ceil(scale), view.depth.height.div_ceil(scale));
    Image { width, height, texels: by_hand::read_red(context.gl(), visibility, width * height) }
}

#[test]
fn planes_are_open_in_off_centre_views() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (41, 33);
    for projection in projections() {
        for n in [[0.0, 0.0, -1.0], [0.5, -0.3, -0.8], [-0.7, 0.6, -0.6], [-0.4, 0.8, 0.1]] {
            let n = DVec3::from(n).normalize();
            let [x, y] = projection.middle_at(1.0);
            // The plane lies some 3 units in front of the eye in the picture's middle.
            let middle = if projection.is_perspective() { DVec3::new(x, y, 1.0) * 3.0 } else { DVec3::new(x, y, 30.0) };
            let view = by_hand::plane(projection, size, n, n.dot(middle));
            if n.z > 0.0 && !projection.is_perspective() {
                continue;
            }
            for snap in [Snap::Step, Snap::Sample] {
                for half_res in [false, true] {
                    let settings = Settings { snap, half_res, ..rig::float_settings(2.0) };
                    let text = format!("{projection:?} {n} {snap:?} {half_res}");
                    for (who, got) in view.by_both(context.gl(), &settings) {
                        hold(who, &got, &got.map(|_| 1.0), &view.covered(), everywhere(1e-3), &text);
                    }
                }
            }
        }
    }
}

#[test]
fn centred_extents_render_what_the_field_of_view_or_the_height_renders_to_the_bit() {
    let context = Context::open(Backend::Egl).unwrap();
    for (shot, lens) in [
        (scenes::cornell_box(), Lens::FovY(0.7)),
        (scenes::box_on_a_floor(), Lens::FovY(50f64.to_radians())),
        (scenes::cornell_box(), Lens::Height(620.0)),
    ] {
        let symmetric = Shot { view: hbao::scene::View { lens: Some(lens), ..shot.view.clone() }, ..shot };
        let [x, y] = symmetric.camera(SIZE).projection.half_extents();
        let edges = [-x, x, -y, y];
        let mut extents = symmetric.clone();
        extents.view.lens = Some(match lens {
            Lens::Height(_) => Lens::OrthoFrustum(edges),
            _ => Lens::Frustum(edges),
        });
        assert_eq!(extents.camera(SIZE), symmetric.camera(SIZE));
        for settings in [
            Settings { radius: Radius::Units(symmetric.radius), ..Settings::default() },
            Settings { half_res: true, ..rig::float_settings(2.0 * symmetric.radius) },
            Settings { radius: Radius::Units(symmetric.radius), ..Settings::for_method(Method::Ssao) },
            Settings { radius: Radius::Units(symmetric.radius), ..Settings::for_method(Method::RayMarch) },
        ] {
            let [a, b] = [&symmetric, &extents].map(|shot| rig::render(context.gl(), shot, SIZE, &settings));
            rig::assert_identical(&a, &b, &settings.to_toml());
        }
    }
}

#[test]
fn a_framed_scene_lies_in_the_picture_whatever_the_extents() {
    for shot in framed_shots().iter().filter(|shot| !matches!(shot.view.lens, Some(Lens::OrthoFrustum(_)))) {
        let camera = shot.camera(SIZE);
        let (low, high) = shot.mesh.bounds();
        let mut reaches = 0.0_f64;
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let seen = camera.project(camera.to_eye(DVec3::new(pick(0), pick(1), pick(2))));
            assert!(seen.min_element() > 0.0 && seen.max_element() < 1.0, "{seen}");
            reaches = reaches.max((seen - 0.5).abs().max_element());
        }
        assert!((0.47..0.48).contains(&reaches), "{reaches}");
        let middle = camera.project(camera.to_eye(low.midpoint(high)));
        assert!((middle - 0.5).length() < 1e-9, "{middle}");
    }
}

#[test]
fn rays_of_a_part_of_a_picture_are_those_of_the_picture() {
    let size = (60, 44);
    for shot in [scenes::box_on_a_floor(), scenes::box_on_a_floor().orthographic(), framed_shots().remove(1)] {
        let whole = shot.camera(size);
        let (corner, part) = ((16, 8), (31, 29));
        let projection = whole.projection.part(size, (corner.0 as i64, corner.1 as i64), part);
        let camera = Camera { projection, ..whole };
        let cast = |camera: &Camera, size: (u32, u32)| {
            gbuffer(&shot.mesh, camera, (size.0 as usize, size.1 as usize), Normals::Derivative, [0.0; 2])
        };
        let (all, some) = (cast(&whole, size), cast(&camera, part));
        for y in 0..some.height {
            for x in 0..some.width {
                let (a, b) = (some.at(x, y), all.at(x + corner.0, y + corner.1));
                assert_eq!(a.depth.is_finite(), b.depth.is_finite());
                assert!(a.depth == b.depth || (a.depth / b.depth - 1.0).abs() < 1e-9, "{x} {y}");
            }
        }
        // The traced truth differs by its noise only.
        let settings = rig::float_settings(shot.radius);
        let traced = |camera: &Camera, size: (usize, usize), pixels: &[usize]| {
            Truth::new(&shot.mesh, camera, size, &settings, 64).unwrap().trace(pixels, |_| {})
        };
        let pixels: Vec<usize> = (0..some.texels.len()).collect();
        let same: Vec<usize> =
            pixels.iter().map(|i| (i / some.width + corner.1) * 60 + i % some.width + corner.0).collect();
        let a = traced(&camera, (some.width, some.height), &pixels);
        let b = traced(&whole, (60, 44), &same);
        assert_eq!(a.covered, b.covered);
        let count = a.covered.iter().filter(|&&covered| covered).count() as f64;
        let squares: f64 = a.visibility.iter().zip(&b.visibility).map(|(a, b)| (a - b).powi(2)).sum();
        assert!((squares / count).sqrt() < 3.0 * a.noise_rmse, "{} {}", (squares / count).sqrt(), a.noise_rmse);
    }
}

/// An application renders a tile of its picture, with the guard band that it asks for.
#[test]
fn ambient_occlusion_of_a_part_with_its_guard_band_is_that_of_the_whole() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (233, 141);
    let extents = Extents::new(-0.7, 0.9, -0.3, 0.7);
    for projection in [Projection::Perspective(extents), Projection::Orthographic(Extents::new(-7.0, 9.0, -3.0, 7.0))] {
        let view = rubble(size, projection, 12, 8.0..10.0);
        for method in rig::methods().filter(|method| !method.facts().reads_near) {
            for half_res in [false, true] {
                let settings = Settings { half_res, ..rig::raw(method, 0.6) };
                let whole = raw(&context, &view, &settings);
                let band = settings.guard_band(projection, size, 8.0).unwrap();
                assert!(band[0] < 60 && band[1] < 50, "{band:?}");
                // The tile is 20x13 pixels from (100, 70) on.
                let start = [(100 - band[0]) / 8 * 8, (70 - band[1]) / 8 * 8];
                let end = [(120 + band[0]).min(size.0), (83 + band[1]).min(size.1)];
                let (width, height) = (end[0] - start[0], end[1] - start[1]);
                let [left, low] = start.map(|start| start as usize);
                let cut = ((left, low), (width as usize, height as usize));
                let part = ByHand {
                    depth: view.depth.part(cut.0, cut.1),
                    normals: view.normals.part(cut.0, cut.1),
                    projection: projection.part(size, (left as i64, low as i64), (width, height)),
                };
                let got = raw(&context, &part, &settings);
                let twin = reference::visibility(&part.twin_inputs(&rotation_tile(&settings)), &settings).unwrap();
                let tile = rotation_tile(&settings);
                let ambiguous = reference::ambiguous(&view.twin_inputs(&tile), &settings).unwrap();
                let scale = whole.width.abs_diff(size.0 as usize).min(1) + 1;
                let mut compared = 0;
                for y in (70usize.div_ceil(scale))..83usize.div_ceil(scale) {
                    for x in (100usize.div_ceil(scale))..120usize.div_ceil(scale) {
                        let at = (x - left / scale, y - low / scale);
                        if !ambiguous.at(x, y) {
                            let (a, b) = (got.at(at.0, at.1), whole.at(x, y));
                            let text = format!("{x} {y} {projection:?}\n{}", settings.to_toml());
                            assert!((a - b).abs() < 1e-3, "{a} {b} {text}");
                            assert!((f64::from(a) - twin.at(at.0, at.1)).abs() < 1e-3, "{text}");
                            compared += 1;
                        }
                    }
                }
                assert!(compared > 50, "{compared}");
            }
        }
    }
}

#[test]
fn a_perspective_whose_axis_is_too_far_aside_is_refused() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble(SIZE, Projection::Perspective(Extents::new(50.0, 50.01, 0.0, 1.0)), 1, 8.0..10.0);
    let textures = by_hand::Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let mut ao = hbao::AmbientOcclusion::new(context.gl().clone(), view.size(), &rig::float_settings(2.0)).unwrap();
    let error: Error = ao.render(&textures.inputs).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("the view's axis"), "{error}");
}
