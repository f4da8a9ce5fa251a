//! Tests of cameras, up to extreme ones: the conventions of eye space, framing, and the near and far planes.

use glam::{DVec2, DVec3, dvec3};
use hbao::Error;
use hbao::scene::{Camera, Lens, Mesh, Scene, View};

/// A tetrahedron whose bounding box has these corners.
fn spanning(low: DVec3, high: DVec3) -> Mesh {
    let points = vec![low, dvec3(high.x, high.y, low.z), dvec3(high.x, low.y, high.z), dvec3(low.x, high.y, high.z)];
    Mesh::new(points, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 2, 3]]).unwrap()
}

fn room() -> Mesh {
    spanning(dvec3(-3.0, 0.0, -8.0), dvec3(5.0, 2.0, 4.0))
}

fn box_corners(mesh: &Mesh) -> impl Iterator<Item = DVec3> {
    let (low, high) = mesh.bounds();
    (0..8).map(move |i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        dvec3(pick(0), pick(1), pick(2))
    })
}

/// Returns the camera. It must be valid, and its notices must contain exactly these words, one of them each.
fn camera_with(view: &View, mesh: &Mesh, size: (u32, u32), words: &[&str]) -> Camera {
    let (camera, notices) = view.camera(mesh, size.0, size.1).unwrap();
    assert_eq!(notices.len(), words.len(), "{notices:?}");
    for (notice, word) in notices.iter().zip(words) {
        assert!(notice.contains(word) && notice.lines().count() == 1, "{notice}");
    }
    let Camera { right, up, forward, near, far, eye, .. } = camera;
    assert!(eye.is_finite(), "{camera:?}");
    for axis in [right, up, forward] {
        assert!((axis.length() - 1.0).abs() < 1e-12, "{camera:?}");
    }
    assert!(right.dot(up).abs().max(up.dot(forward).abs()).max(forward.dot(right).abs()) < 1e-12, "{camera:?}");
    assert!(right.distance(forward.cross(up)) < 1e-12, "{camera:?}");
    assert!(0.0 < near && near < far && far <= 1e15, "{camera:?}");
    camera
}

fn camera(view: &View, mesh: &Mesh) -> Camera {
    camera_with(view, mesh, (640, 480), &[])
}

fn looking(eye: DVec3, target: DVec3) -> View {
    View { eye: Some(eye), target: Some(target), ..View::default() }
}

/// Asserts that a view is refused with a usage error of one line that contains each of `words`.
fn refused(view: View, words: &[&str]) {
    let error: Error = view.camera(&room(), 640, 480).unwrap_err();
    let message = error.to_string();
    assert!(error.is_usage() && message.lines().count() == 1, "{message}");
    for word in words {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
}

#[test]
fn eye_space_is_left_handed_and_not_mirrored() {
    // The camera looks from +z towards the origin, as at a page: world x is to the right, y is up, and the page is
    // ahead.
    let camera = camera(&looking(dvec3(0.0, 0.0, 10.0), DVec3::ZERO), &room());
    assert_eq!(camera.forward, DVec3::NEG_Z);
    assert_eq!(camera.to_eye(dvec3(1.0, 2.0, 3.0)), dvec3(1.0, 2.0, 7.0));
    assert_eq!(camera.direction_to_eye(dvec3(1.0, 2.0, 3.0)), dvec3(1.0, 2.0, -3.0));
    // The transformation has determinant -1, because the world is right-handed and eye space is left-handed.
    let images = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| camera.direction_to_eye(axis));
    assert_eq!(images[0].cross(images[1]).dot(images[2]), -1.0);
}

#[test]
fn rays_are_those_of_the_specification_and_projection_undoes_them() {
    let lenses = [
        Lens::FovY(90_f64.to_radians()),
        Lens::FovY(1_f64.to_radians()),
        Lens::FovY(175_f64.to_radians()),
        Lens::Height(6.0),
    ];
    for lens in lenses {
        let camera = camera(&View { lens: Some(lens), ..looking(DVec3::splat(20.0), DVec3::ZERO) }, &room());
        for (u, v) in [(0.5, 0.5), (0.0, 0.0), (1.0, 0.25)] {
            let (origin, r) = camera.ray(u, v);
            assert_eq!(r.z, 1.0);
            let back = camera.project(origin + 7.0 * r);
            assert!(back.distance(DVec2::new(u, v)) < 1e-12, "{back}");
        }
    }
    let mut view = View { lens: Some(Lens::FovY(90_f64.to_radians())), ..looking(DVec3::splat(20.0), DVec3::ZERO) };
    let (origin, r) = camera(&view, &room()).ray(1.0, 0.0);
    assert!(origin == DVec3::ZERO && r.distance(dvec3(4.0 / 3.0, -1.0, 1.0)) < 1e-12);
    view.lens = Some(Lens::Height(6.0));
    let (origin, r) = camera(&view, &room()).ray(1.0, 0.0);
    assert!(r == DVec3::Z && origin.distance(dvec3(4.0, -3.0, 0.0)) < 1e-12);
}

#[test]
fn the_target_is_in_the_middle_of_the_picture() {
    for target in [dvec3(1.0, 2.0, 3.0), dvec3(-40.0, 0.5, 0.0)] {
        for eye in [Some(dvec3(9.0, -7.0, 5.0)), None] {
            let camera = camera(&View { eye, target: Some(target), ..View::default() }, &room());
            let seen = camera.to_eye(target);
            assert!(seen.z > 0.0 && camera.project(seen).distance(DVec2::splat(0.5)) < 1e-12, "{seen}");
        }
    }
}

#[test]
fn an_eye_without_a_target_looks_at_the_boxs_centre() {
    let camera = camera(&View { eye: Some(dvec3(30.0, 5.0, 1.0)), ..View::default() }, &room());
    assert!(camera.project(camera.to_eye(dvec3(1.0, 1.0, -2.0))).distance(DVec2::splat(0.5)) < 1e-12);
    refused(View { eye: Some(dvec3(1.0, 1.0, -2.0)), ..View::default() }, &["--eye is the scene's centre"]);
}

#[test]
fn framing_has_the_whole_box_in_the_picture_and_fills_it() {
    let (one, far_off) = (DVec3::ONE, DVec3::splat(1e6));
    let scenes = [
        room(),
        spanning(far_off - one, far_off + one),
        spanning(-one * 1e-6, one * 1e-6),
        spanning(-one * 1e6, one * 1e6),
        spanning(dvec3(-1.0, -1.0, 0.0), dvec3(1.0, 1.0, 0.0)),
        spanning(dvec3(-1.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0)),
    ];
    for mesh in &scenes {
        for fov in [1.0, 45.0, 120.0, 175.0_f64] {
            for size in [(640, 480), (480, 640), (1, 1), (1, 997), (16384, 1)] {
                for target in [None, Some(mesh.bounds().1)] {
                    let view = View { target, lens: Some(Lens::FovY(fov.to_radians())), ..View::default() };
                    let camera = camera_with(&view, mesh, size, &[]);
                    let mut reach = 0.0_f64;
                    for corner in box_corners(mesh) {
                        let eye_space = camera.to_eye(corner);
                        assert!(eye_space.z > 0.0);
                        reach = reach.max((2.0 * camera.project(eye_space) - 1.0).abs().max_element());
                    }
                    assert!(reach < 0.96, "{reach} at {fov} degrees, {size:?}");
                    if fov <= 45.0 && size.0 < 1000 {
                        assert!(reach > 0.94, "{reach} at {fov} degrees, {size:?}");
                    }
                }
            }
        }
        // An orthographic view has a given height. If it is the length of the diagonal, the view shows everything.
        let view = View { lens: Some(Lens::Height(mesh.diagonal() * 1.01)), ..View::default() };
        let camera = camera(&view, mesh);
        for corner in box_corners(mesh) {
            let eye_space = camera.to_eye(corner);
            assert!(eye_space.z > 0.0);
            assert!((2.0 * camera.project(eye_space) - 1.0).abs().max_element() < 1.0);
        }
    }
}

#[test]
fn framing_looks_from_the_front_the_right_and_above() {
    // The tuples are up and front: for y up, for z up (whose front is -y) and for z down.
    for (up, front) in [(DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::NEG_Y), (DVec3::NEG_Z, DVec3::Y)] {
        let camera = camera(&View { up: Some(up * 7.0), ..View::default() }, &room());
        let back = -camera.forward;
        assert!(back.dot(front) > back.dot(up.cross(front)), "{back}");
        assert!(back.dot(up.cross(front)) > 0.0 && back.dot(up) > 0.0 && camera.up.dot(up) > 0.0, "{back}");
    }
}

#[test]
fn scenes_without_extent_are_framed_and_said_to_show_nothing() {
    for at in [DVec3::ZERO, DVec3::ONE, dvec3(1e15, -1e15, 1e15), DVec3::splat(1e-20)] {
        for lens in [None, Some(Lens::FovY(175_f64.to_radians())), Some(Lens::Height(1.0))] {
            let mesh = Mesh::new(vec![at; 3], vec![[0, 1, 2]]).unwrap();
            let view = View { lens, ..View::default() };
            let camera = camera_with(&view, &mesh, (640, 480), &["too small to be framed"]);
            let z = camera.to_eye(at).z;
            assert!((camera.near..=camera.far).contains(&z), "{z}: {camera:?}");
        }
    }
}

#[test]
fn near_and_far_clip_nothing_but_what_is_very_near() {
    let mesh = room();
    for eye in [dvec3(20.0, 3.0, 20.0), dvec3(0.0, 1.0, 0.0), dvec3(-3.0, 0.1, -8.0), dvec3(1e6, 1e6, 1e6)] {
        let camera = camera(&looking(eye, dvec3(1.0, 1.0, -2.0)), &mesh);
        let depths: Vec<f64> = mesh.positions.iter().map(|&p| camera.to_eye(p).z).collect();
        let farthest = depths.iter().copied().fold(0.0, f64::max);
        assert!(camera.far > farthest && camera.far < 1.01 * farthest);
        assert!(camera.near >= 0.999e-4 * camera.far);
        for z in depths {
            assert!(z < 1e-4 * farthest || z > camera.near);
        }
    }
    let given = View { near: Some(0.5), far: Some(2e3), ..View::default() };
    let camera = camera(&given, &mesh);
    assert_eq!((camera.near, camera.far), (0.5, 2e3));
}

#[test]
fn a_view_of_nothing_is_valid_and_said() {
    let away = looking(dvec3(0.0, 1.0, 50.0), dvec3(0.0, 1.0, 60.0));
    camera_with(&away, &room(), (64, 48), &["behind the camera"]);
    camera_with(&View { far: Some(1e-3), ..away.clone() }, &room(), (64, 48), &["behind the camera"]);
    let ahead = looking(dvec3(0.0, 1.0, 50.0), DVec3::Y);
    let camera = camera_with(&View { far: Some(10.0), ..ahead.clone() }, &room(), (64, 48), &["beyond --far 10:"]);
    assert_eq!(camera.far, 10.0);
    let camera = camera_with(&View { near: Some(1e3), ..ahead }, &room(), (64, 48), &["--near 1000 lies beyond"]);
    assert_eq!(camera.near, 1e3);
    let huge = spanning(DVec3::splat(-1e15), DVec3::splat(1e15));
    camera_with(&View::default(), &huge, (64, 48), &["beyond 1e15 from the camera"]);
    camera_with(&looking(DVec3::ZERO, DVec3::Z), &spanning(DVec3::ZERO, DVec3::splat(1e15)), (64, 48), &[]);
    camera_with(&looking(DVec3::ZERO, DVec3::NEG_ONE), &huge, (64, 48), &["the part beyond is clipped"]);
}

#[test]
fn an_up_along_the_view_is_replaced_and_said() {
    for up in [None, Some(DVec3::Y), Some(dvec3(0.0, -1e-3, 0.0)), Some(dvec3(1e-9, 1.0, 0.0))] {
        let view = View { up, ..looking(dvec3(1.0, 30.0, 1.0), dvec3(1.0, 0.0, 1.0)) };
        // The view is a plan from above, with x to the right.
        let camera = camera_with(&view, &room(), (64, 48), &["--up is parallel to the direction of view; 0,0,-1"]);
        assert_eq!((camera.right, camera.up), (DVec3::X, DVec3::NEG_Z));
    }
    let view = View { up: Some(DVec3::X), ..looking(dvec3(30.0, 0.0, 0.0), DVec3::ZERO) };
    camera_with(&view, &room(), (64, 48), &["0,0,-1 is up instead"]);
}

#[test]
fn settings_outside_their_range_are_refused() {
    let some = |x: f64| Some(dvec3(0.0, x, 1.0));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        refused(View { eye: some(bad), ..View::default() }, &["--eye", "finite"]);
        refused(View { target: some(bad), ..View::default() }, &["--target", "finite"]);
        refused(View { up: some(bad), ..View::default() }, &["--up", "finite"]);
    }
    refused(View { up: Some(DVec3::ZERO), ..View::default() }, &["--up 0,0,0"]);
    refused(looking(DVec3::ONE, DVec3::ONE), &["--eye is the same point as --target"]);
    for degrees in [0.999, 175.001, 0.0, -45.0, f64::NAN, f64::INFINITY] {
        refused(View { lens: Some(Lens::FovY(degrees.to_radians())), ..View::default() }, &["--fov-y", "1 to 175"]);
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300, 1e-300] {
        refused(View { lens: Some(Lens::Height(bad)), ..View::default() }, &["--ortho"]);
        refused(View { near: Some(bad), ..View::default() }, &["--near"]);
        refused(View { far: Some(bad), ..View::default() }, &["--far"]);
    }
    refused(View { near: Some(2.0), far: Some(2.0), ..View::default() }, &["--near 2 must be less than --far 2"]);
    refused(View { near: Some(1e15), ..View::default() }, &["--near", "too close to 1e15"]);
    assert!(View::default().camera(&room(), 0, 5).unwrap_err().is_usage());
}

#[test]
fn tiny_and_huge_but_valid_settings_make_valid_cameras() {
    for scale in [1e-15, 1e15] {
        let view = View { up: Some(DVec3::Y * scale), ..looking(DVec3::X * scale, DVec3::ZERO) };
        let (camera, _) = view.camera(&room(), 64, 48).unwrap();
        assert_eq!((camera.forward, camera.up), (DVec3::NEG_X, DVec3::Y));
        assert!(0.0 < camera.near && camera.near < camera.far && camera.far <= 1e15);
    }
}

#[test]
fn the_cornell_boxs_camera_is_the_published_one() {
    let scene = Scene::open("cornell-box").unwrap();
    let camera = camera_with(&scene.view, &scene.mesh, (512, 512), &[]);
    assert_eq!((camera.eye, camera.forward, camera.up), (dvec3(278.0, 273.0, -800.0), DVec3::Z, DVec3::Y));
    let Some(Lens::FovY(fov)) = scene.view.lens else { panic!() };
    assert!((fov.to_degrees() - 39.3077).abs() < 1e-4);
    let [x, y] = camera.projection.half_extents();
    assert!(camera.projection.is_perspective() && x == y);
    // The red wall, at x = 552.8, is on the left of the picture. The open front just fits into the picture.
    let red = camera.project(camera.to_eye(dvec3(552.8, 273.0, 280.0)));
    assert!(red.x < 0.25, "{red}");
    for corner in [dvec3(0.0, 0.0, 0.0), dvec3(556.0, 548.8, 0.0)] {
        let seen = camera.project(camera.to_eye(corner));
        assert!(seen.min_element() > 0.0 && seen.max_element() < 1.0, "{seen}");
    }
}

#[test]
fn flags_win_over_the_scenes_own_camera_one_by_one() {
    let own = View {
        eye: Some(DVec3::X),
        target: Some(DVec3::Y),
        up: Some(DVec3::Z),
        lens: Some(Lens::Height(2.0)),
        near: Some(1.0),
        far: Some(3.0),
        ..View::default()
    };
    assert_eq!(View::default().or(&own), own);
    assert_eq!(own.or(&View::default()), own);
    let lens = View { lens: Some(Lens::FovY(1.0)), far: Some(9.0), ..View::default() };
    assert_eq!(lens.or(&own), View { lens: Some(Lens::FovY(1.0)), far: Some(9.0), ..own.clone() });
    // A camera that is moved does not take over near and far, which belong to the old position.
    let moved = View { eye: Some(DVec3::ONE), far: Some(9.0), ..View::default() };
    assert_eq!(moved.or(&own), View { eye: Some(DVec3::ONE), near: None, far: Some(9.0), ..own });
}
