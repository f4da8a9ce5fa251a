//! The G-buffer is drawn in slices of depth. These tests check that nothing is visible where two slices meet.

use crate::rig::random::Draw;
use glam::{DVec3, dvec3};
use glow::HasContext;
use hbao::context::{Backend, Context};
use hbao::scene::{Camera, Lens, Mesh, View};
use hbao::settings::Radius;
use hbao::{Pipeline, Request, Settings};

fn quad(corner: DVec3, a: DVec3, b: DVec3) -> Mesh {
    Mesh::new(vec![corner, corner + a, corner + a + b, corner + b], vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// Renders the depth of the visible surfaces, without ambient occlusion. It is infinite where nothing is visible.
fn depth(context: &Context, mesh: &Mesh, camera: &Camera, size: (u32, u32), msaa: u32) -> Vec<f32> {
    let settings = Settings { radius: Radius::Units(1.0), msaa, ..Settings::default() };
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(context.gl(), size, &settings, request).unwrap();
    pipeline.render(mesh, camera).unwrap();
    pipeline.depth_samples().unwrap().into_iter().flat_map(|image| image.texels).collect()
}

#[test]
fn a_floor_has_no_hole_where_slices_meet() {
    const SIZE: (u32, u32) = (400, 300);
    let floor = quad(dvec3(-200.0, 0.0, -200.0), dvec3(400.0, 0.0, 0.0), dvec3(0.0, 0.0, 400.0));
    let context = Context::open(Backend::Egl).unwrap();
    let mut draw = Draw::new(5);
    for (near, far) in [(0.1, 1000.0), (0.05, 40.0), (0.5, 60.0), (1e-3, 1e3)] {
        for _ in 0..6 {
            let view = View {
                eye: Some(dvec3(0.0, 0.7 + 2.0 * draw.unit(), 0.0)),
                target: Some(dvec3(draw.unit() - 0.5, -1.0 - draw.unit(), 2.0)),
                up: Some(dvec3(draw.unit() - 0.5, 1.0, 0.0)),
                lens: Some(Lens::FovY(1.0)),
                near: Some(near),
                far: Some(far),
                ..View::default()
            };
            let camera = view.camera(&floor, SIZE.0, SIZE.1).unwrap().0;
            for msaa in [1, 4] {
                let seen = depth(&context, &floor, &camera, SIZE, msaa);
                let mut inside = 0;
                for (i, &z) in seen.iter().enumerate() {
                    let (x, y) = (i % 400, i / 400 % 300);
                    let (_, r) = camera.ray((x as f64 + 0.5) / 400.0, (y as f64 + 0.5) / 300.0);
                    let down = r.x * camera.right.y + r.y * camera.up.y + camera.forward.y;
                    let expected = -camera.eye.y / down;
                    // Pixels are left out if they reach beyond the near plane, the far plane or the end of the floor.
                    if (1.2 * near..(0.5 * far).min(100.0)).contains(&expected) {
                        inside += 1;
                        // The depth of a hole is infinite, so a hole fails this test.
                        assert!(
                            (f64::from(z) / expected - 1.0).abs() < 1e-4,
                            "{z} for {expected} at {x}, {y}\n{camera:?}"
                        );
                    }
                }
                assert!(inside > 10_000, "{inside}");
            }
        }
    }
}

#[test]
fn a_wall_on_the_border_of_two_slices_is_whole() {
    const SIZE: (u32, u32) = (16, 12);
    let context = Context::open(Backend::Osmesa).unwrap();
    for (near, far) in [(4.503_685_637_737_6, 3_422_397.990_088_233), (1e-3, 1e3), (0.02, 7.0f64)] {
        let slices = f64::ceil((far / near).log(100.0));
        for border in 1..slices as i32 {
            let border = near * (far / near).powf(f64::from(border) / slices);
            for ppm in [-300.0, -10.0, -3.0, -2.0, -1.5, -1.25, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0, 10.0, 300.0] {
                let z = border * (1.0 + 1e-6 * ppm);
                let wall = quad(dvec3(-9.0 * z, -9.0 * z, -z), dvec3(18.0 * z, 0.0, 0.0), dvec3(0.0, 18.0 * z, 0.0));
                let view = View {
                    eye: Some(DVec3::ZERO),
                    target: Some(-DVec3::Z),
                    lens: Some(Lens::FovY(1.0)),
                    near: Some(near),
                    far: Some(far),
                    ..View::default()
                };
                let camera = view.camera(&wall, SIZE.0, SIZE.1).unwrap().0;
                for seen in depth(&context, &wall, &camera, SIZE, 1) {
                    assert!((f64::from(seen) / z - 1.0).abs() < 1e-5, "{seen} for {z}, {ppm} ppm off {border}");
                }
            }
        }
    }
}

/// Returns the number of triangles that are drawn to render the depth of this mesh.
fn triangles_drawn(context: &Context, mesh: &Mesh, camera: &Camera) -> u32 {
    let (gl, settings) = (context.gl(), Settings { radius: Radius::Units(1.0), msaa: 1, ..Settings::default() });
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, (16, 12), &settings, request).unwrap();
    // SAFETY: the context is current, and no other query is active.
    unsafe {
        let query = gl.create_query().unwrap();
        gl.begin_query(glow::PRIMITIVES_GENERATED, query);
        pipeline.render(mesh, camera).unwrap();
        gl.end_query(glow::PRIMITIVES_GENERATED);
        let count = gl.get_query_parameter_u32(query, glow::QUERY_RESULT);
        gl.delete_query(query);
        count
    }
}

#[test]
fn a_slice_draws_only_the_triangles_that_reach_into_it() {
    let context = Context::open(Backend::Egl).unwrap();
    for lens in [Lens::FovY(1.0), Lens::Height(30.0)] {
        // The two slices are 0.1 to 15 and 10 to 1000.
        let view = View {
            eye: Some(DVec3::ZERO),
            target: Some(DVec3::Z),
            lens: Some(lens),
            near: Some(0.1),
            far: Some(1000.0),
            ..View::default()
        };
        let drawn = |[z, end]: [f64; 2]| {
            let mesh = quad(dvec3(-2.0, -1.0, z), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 1.0, end - z));
            triangles_drawn(&context, &mesh, &view.camera(&mesh, 16, 12).unwrap().0)
        };
        for (ends, times) in [
            ([1.0, 2.0], 1),
            ([11.0, 12.0], 2),
            ([100.0, 200.0], 1),
            ([1.0, 500.0], 2),
            ([-500.0, 2000.0], 2),
            ([-2.0, -1.0], 0),
            ([2000.0, 3000.0], 0),
        ] {
            assert_eq!(drawn(ends), 2 * times, "{ends:?}, {lens:?}");
        }
    }
}
