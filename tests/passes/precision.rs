//! Where float32 and the narrower formats are not precise enough, the library uses a better formulation or refuses. How
//! far each pass is from float64 as the numbers become extreme is a section of the report of `hbao paper`, which
//! tests/command/paper.rs checks.

use crate::rig;
use crate::rig::{float_settings, scenes};
use glam::{DVec3, dvec3};
use hbao::context::{Backend, Context};
use hbao::measure::precision::{Comparer, DepthPlanes, unresolved_gap};
use hbao::reference;
use hbao::scene::{Lens, Mesh, View};
use hbao::settings::{DepthFormat, Radius};
use hbao::{Pipeline, Request, Settings, rotation_tile};

#[test]
fn surfaces_a_hundred_thousandth_apart_are_told_apart_at_any_depth_of_any_view() {
    let context = Context::open(Backend::Auto).unwrap();
    for orthographic in [false, true] {
        for ratio in [0.1, 1e-2, 1e-4, 1e-6, 1e-8f64] {
            for z in [1.3 * ratio, ratio.sqrt(), 0.7] {
                let gap = unresolved_gap(context.gl(), DepthPlanes { near: ratio, far: 1.0 }, z, orthographic).unwrap();
                assert!(gap < 1e-5, "{gap:e} at {z:e} of {ratio:e}, orthographic: {orthographic}");
            }
        }
    }
}

#[test]
fn normals_are_as_true_from_afar_as_from_nearby() {
    let context = Context::open(Backend::Auto).unwrap();
    let shot = scenes::box_on_a_floor();
    let mut comparer = Comparer::new(context.gl(), (64, 48), &float_settings(shot.radius)).unwrap();
    // At a distance of 1e4, float32 has steps of 1e-3 and a texel is 0.06 wide. Normals that are computed from such
    // positions would be off by a degree.
    let narrow = Lens::FovY(1f64.to_radians());
    for (distance, lens) in
        [(5.0, Lens::Height(3.0)), (1e3, Lens::Height(3.0)), (1e4, Lens::Height(3.0)), (170.0, narrow)]
    {
        let eye = distance * dvec3(-0.3, 0.6, 1.0).normalize();
        let view = View { eye: Some(eye), target: Some(DVec3::ZERO), lens: Some(lens), ..View::default() };
        let camera = view.camera(&shot.mesh, 64, 48).unwrap().0;
        let (found, _) = comparer.measure(&shot.mesh, &camera).unwrap();
        assert!(found.covered > 1000, "{found:?}");
        // RGBA16F itself rounds a normal by up to 0.02 degrees.
        assert!(found.normals.max < 0.05, "{distance}: {found:?}");
        assert!(found.depth.max < 3e-6, "{distance}: {found:?}");
    }
}

#[test]
fn half_floats_hold_depth_to_eleven_bits_or_are_refused() {
    let context = Context::open(Backend::Auto).unwrap();
    for (z, held) in
        [(1e-9, false), (1e-6, false), (6.0e-5, false), (6.2e-5, true), (1e-2, true), (8e3, true), (1e4, false)]
    {
        let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
        let corners = corners.map(|(x, y)| dvec3(x * z, y * z, -z * (3.0 + 0.2 * x))).to_vec();
        let mesh = Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let settings =
            Settings { depth_format: DepthFormat::R16f, radius: Radius::Units(z), blur: 0, ..float_settings(z) };
        let view = View {
            eye: Some(DVec3::ZERO),
            target: Some(-z * DVec3::Z),
            near: Some(z),
            far: Some(6.0 * z),
            ..View::default()
        };
        let camera = view.camera(&mesh, 32, 24).unwrap().0;
        let mut pipeline = Pipeline::new(context.gl(), (32, 24), &settings, Request::default()).unwrap();
        match pipeline.render(&mesh, &camera) {
            Err(error) => {
                assert!(!held && error.is_usage() && error.to_string().contains("r16f holds"), "{z:e}: {error}");
            }
            Ok(_) => {
                let seen = reference::gbuffer::gbuffer(&mesh, &camera, (32, 24), settings.normals, [0.0; 2]);
                let depth = pipeline.depth().unwrap();
                let off = |i: usize| (f64::from(depth.texels[i]) / seen.texels[i].depth - 1.0).abs();
                let most = (0..seen.texels.len()).map(off).fold(0.0, f64::max);
                assert!(held && most < 1.1 * 2f64.powi(-10), "{z:e}: {most:e}");
            }
        }
    }
}

#[test]
fn the_twins_compute_the_same_from_float32_and_from_the_same_numbers_in_float64() {
    let context = Context::open(Backend::Auto).unwrap();
    let shot = scenes::box_on_a_floor();
    let settings = float_settings(shot.radius);
    let frame = rig::render(context.gl(), &shot, (40, 30), &settings);
    let (depth, normals) = (frame.depth.map(f64::from), frame.normals.map(|n| n.map(f64::from)));
    let (tile, projection, near) = (rotation_tile(&settings), frame.projection, frame.near);
    let wide = reference::TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
    let of_wide = reference::visibility(&wide, &settings).unwrap();
    assert_eq!(of_wide, reference::visibility(&frame.inputs(), &settings).unwrap());
    let blurred = reference::blur::blur(&of_wide, &frame.depth, &[], projection, &settings).unwrap();
    assert_eq!(reference::blur::blur(&of_wide, &depth, &[], projection, &settings).unwrap(), blurred);
    // The twins do react to differences that float32 cannot represent.
    let moved = depth.map(|z| if z.is_finite() { z * (1.0 + 1e-9 * (9.0 * z).sin()) } else { z });
    let wide = reference::TwinInputs { depth: &moved, ..wide };
    assert_ne!(of_wide, reference::visibility(&wide, &settings).unwrap());
}
