//! Cameras as other programs describe them, by matrices and by focal lengths in pixels, show what `--eye`, `--target`,
//! `--up` and `--fov-y` show.

use crate::rig::command::{cached, notices, texts};
use hbao::image::{Image, exr, png};
use std::fs;
use std::path::Path;

/// A camera that looks at the Cornell box askew.
const LOOKED: &str = "--eye 120,400,-700 --target 300,200,280 --up 0.2,1,0.1 --fov-y 48 --near 100 --far 3000";
/// The same camera's tangent of half the field of view.
const HALF: f64 = 0.445_228_685_308_536_2;
const SIZE: (u32, u32) = (96, 64);

fn render(folder: &Path, output: &str, arguments: &str) -> String {
    let (width, height) = SIZE;
    let output = cached(folder, &format!("render -o {output} --size {width}x{height} --show normals {arguments}"));
    let [_, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    notices(&stderr).join("\n")
}

fn refused(folder: &Path, arguments: &str) -> String {
    let output = cached(folder, &format!("render -o refused.png --size 8x8 {arguments}"));
    let [_, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
    stderr
}

/// Multiplies, adds and normalises as the textbook's `lookAt` does, independently of the program.
fn view_matrix() -> [[f64; 4]; 4] {
    look_at([120.0, 400.0, -700.0], [300.0, 200.0, 280.0], [0.2, 1.0, 0.1])
}

fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> [[f64; 4]; 4] {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |a: [f64; 3]| a.map(|x| x / dot(a, a).sqrt());
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let forward = unit([target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]]);
    let right = unit(cross(forward, up));
    let up = cross(right, forward);
    let row = |a: [f64; 3]| [a[0], a[1], a[2], -dot(a, eye)];
    [row(right), row(up), row(forward.map(|x| -x)), [0.0, 0.0, 0.0, 1.0]]
}

/// Writes a matrix row by row. A number is written so that it is read back as the same.
fn text(matrix: [[f64; 4]; 4]) -> String {
    matrix.as_flattened().iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(",")
}

fn projection_matrix() -> [[f64; 4]; 4] {
    let (near, far) = (100.0, 3000.0);
    let aspect = f64::from(SIZE.0) / f64::from(SIZE.1);
    let depth = [-(far + near) / (far - near), -2.0 * far * near / (far - near)];
    [
        [1.0 / (HALF * aspect), 0.0, 0.0, 0.0],
        [0.0, 1.0 / HALF, 0.0, 0.0],
        [0.0, 0.0, depth[0], depth[1]],
        [0.0, 0.0, -1.0, 0.0],
    ]
}

/// Asserts that two images of normals show the same but for rounding at borders between surfaces.
fn hold_same(folder: &Path, a: &str, b: &str) {
    let [a, b]: [Image<[f32; 3]>; 2] = [a, b].map(|name| exr::read(&folder.join(name)).unwrap());
    let apart = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|i| (a[i] - b[i]).abs() > 0.02);
    let off = a.texels.iter().zip(&b.texels).filter(|&pair| apart(pair)).count();
    assert!(off <= 3, "{off} of {} pixels differ", a.texels.len());
    assert!(a.texels.iter().any(|&n| n != a.texels[0]), "the image shows several surfaces");
}

#[test]
fn matrices_show_what_eye_target_up_and_field_of_view_show() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    render(folder, "looked.exr", LOOKED);
    let [x, y, z, last] = view_matrix();
    fs::write(folder.join("projection.txt"), format!("{:?}", projection_matrix())).unwrap();
    let negative = |row: [f64; 4]| row.map(|x| -x);
    for (name, matrices) in [
        ("gl", format!("--view-matrix {} --projection projection.txt", text([x, y, z, last]))),
        (
            "cv",
            format!(
                "--view-matrix {} --view-axes cv --projection {}",
                text([x, negative(y), negative(z), last]),
                text(projection_matrix())
            ),
        ),
    ] {
        let told = render(folder, &format!("{name}.exr"), &matrices);
        assert_eq!(told, "", "{name}");
        hold_same(folder, "looked.exr", &format!("{name}.exr"));
    }
}

#[test]
fn the_planes_of_a_projection_matrix_clip_and_flags_override_them() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let stored = |file: &str| {
        let text =
            exr::read_text(&folder.join(file)).unwrap().into_iter().find(|(keyword, _)| keyword == "hbao").unwrap().1;
        let table: toml::Table = text.parse().unwrap();
        ["near", "far"].map(|key| table["render"][key].as_float().unwrap())
    };
    let matrix = text(projection_matrix());
    render(folder, "own.exr", &format!("--projection {matrix}"));
    // A matrix has the precision of float32.
    let [near, far] = stored("own.exr");
    assert!((near - 100.0).abs() < 1e-3 && (far - 3000.0).abs() < 1.0, "{near} {far}");
    render(folder, "given.exr", &format!("--projection {matrix} --near 300 --far 4000"));
    assert_eq!(stored("given.exr"), [300.0, 4000.0]);
    // The far plane of this matrix is infinitely far, and so follows from the scene.
    let infinite = "1,0,0,0, 0,1.5,0,0, 0,0,-1,-200, 0,0,-1,0".replace(' ', "");
    render(folder, "infinite.exr", &format!("--projection {infinite}"));
    let [near, far] = stored("infinite.exr");
    assert!((near - 100.0).abs() < 1e-3 && far > 1000.0 && far < 10_000.0, "{near} {far}");
}

#[test]
fn intrinsics_show_the_extents_that_they_stand_for() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Powers of two, so that no number is rounded: the left edge is -32/128, the right (96 - 32)/128.
    let place = "--eye 278,273,-800 --target 278,273,280";
    render(folder, "extents.png", &format!("{place} --frustum=-0.25,0.5,-0.75,0.25"));
    render(folder, "intrinsics.png", &format!("{place} --intrinsics 128,64,32,16"));
    let [a, b]: [Image<[u8; 3]>; 2] =
        ["extents.png", "intrinsics.png"].map(|name| png::read(&folder.join(name)).unwrap());
    assert_eq!(a.texels, b.texels);
    let [a, b] = ["extents.png", "intrinsics.png"].map(|name| fs::read(folder.join(name)).unwrap());
    assert_eq!(a, b, "the metadata are the same too");
}

#[test]
fn what_a_matrix_cannot_mean_is_refused_and_what_it_hardly_means_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let [x, y, z, last] = view_matrix();
    let matrix = [x, y, z, last];
    let transposed: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| matrix[j][i]));
    let sheared = [[x[0], x[1] + 0.5, x[2], x[3]], y, z, last];
    let scaled = [x, y, z].map(|row| row.map(|x| 3.0 * x));
    for (given, said) in [
        (text(transposed), "it looks transposed: give it row by row"),
        (text([x, y, z.map(|x| -x), last]), "it mirrors"),
        (text(sheared), "it is not a rotation and a translation"),
        (text([scaled[0], scaled[1], scaled[2], last]), "it scales by 3"),
        (text([x, y, z, [0.0, 0.0, 0.0, 2.0]]), "its last four numbers must be 0,0,0,1"),
        ("1,0,0,0".into(), "4 numbers are given, and a matrix has 16"),
        ("nothing.txt".into(), "neither 16 numbers separated by commas nor a file of them"),
        (format!("{} --eye 1,2,3", text(matrix)), "cannot be used with '--eye"),
    ] {
        let stderr = refused(folder, &format!("--view-matrix {given}"));
        assert!(stderr.contains(said), "{given}: {stderr}");
    }
    for (given, said) in [
        ("--view-axes cv", "--view-axes says which axes --view-matrix leads to"),
        ("--intrinsics 0,1,1,1", "the focal lengths must be above 0"),
        ("--intrinsics 1e-9,1,1,1", "--intrinsics: "),
        ("--intrinsics 8,8,4,4 --fov-y 40", "cannot be used with"),
        ("--projection 1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1", "both must be above 0"),
        ("--projection 1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1", "--projection: "),
    ] {
        let stderr = refused(folder, given);
        assert!(stderr.contains(said), "{given}: {stderr}");
    }
    let told = render(folder, "wide.png", &format!("--projection {} --size 96x48", text(projection_matrix())));
    assert!(told.contains("its pixels are not square; --size 72x48 has square ones"), "{told}");
    let told = render(folder, "aside.png", "--intrinsics 100,100,-3,20");
    assert!(told.contains("the principal point -3,20 lies outside the 96x64 pixels"), "{told}");
}

/// A floor and a triangle, in the bounds -3..3, 0..4, -3..3.
const FLOOR: &str = "v -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nf 1 2 3 4\nv 0 0 0\nv 0 4 0\nv 1 4 1\nf 5 6 7\n";

/// Renders a turn in four frames, as normals.
fn turn(folder: &Path, arguments: &str) {
    let (width, height) = SIZE;
    let given = format!("sequence {arguments} --turntable 4 -o t#.exr --size {width}x{height} --show normals");
    let output = cached(folder, &given);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", texts(&output)[1]);
}

#[test]
fn a_turntable_of_a_matrix_turns_about_the_point_of_its_axis_nearest_to_the_centre() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("a.obj"), FLOOR).unwrap();
    let (eye, up) = ([1.0, 5.0, 9.0], [0.2, 1.0, 0.1]);
    let matrix = look_at(eye, [0.4, 1.0, -1.0], up);
    let list = |v: [f64; 3]| v.map(|x| format!("{x:?}")).join(",");
    turn(folder, &format!("a.obj --view-matrix {}", text(matrix)));
    render(folder, "given.exr", &format!("a.obj --view-matrix {}", text(matrix)));
    hold_same(folder, "given.exr", "t0.exr");
    // Eye space is right-handed, so that the third row points backward. The centre of the bounds is 0, 2, 0.
    let forward = [0, 1, 2].map(|i| -matrix[2][i]);
    let distance: f64 = [0, 1, 2].map(|i| ([0.0, 2.0, 0.0][i] - eye[i]) * forward[i]).iter().sum();
    let pivot = [0, 1, 2].map(|i| eye[i] + distance * forward[i]);
    // Half a turn about the axis y through it.
    let half = |v: [f64; 3], [x, z]: [f64; 2]| [2.0 * x - v[0], v[1], 2.0 * z - v[2]];
    let (eye, up) = (half(eye, [pivot[0], pivot[2]]), half(up, [0.0; 2]));
    let camera = format!("--eye {} --target {} --up {}", list(eye), list(pivot), list(up));
    render(folder, "half.exr", &format!("a.obj {camera}"));
    hold_same(folder, "half.exr", "t2.exr");
    // Half a turn about another axis: z stays, and x and y change their signs.
    turn(folder, &format!("a.obj --view-matrix {} --up 0,0,1", text(look_at([1.0, 5.0, 9.0], [0.4, 1.0, -1.0], up))));
    let matrix = look_at([1.0, 5.0, 9.0], [0.4, 1.0, -1.0], up);
    let over = |v: [f64; 3], [x, y]: [f64; 2]| [2.0 * x - v[0], 2.0 * y - v[1], v[2]];
    let (eye, up) = (over([1.0, 5.0, 9.0], [pivot[0], pivot[1]]), over(matrix_up(matrix), [0.0; 2]));
    let camera = format!("--eye {} --target {} --up {}", list(eye), list(pivot), list(up));
    render(folder, "over.exr", &format!("a.obj {camera}"));
    hold_same(folder, "over.exr", "t2.exr");
    // The centre lies behind this camera.
    let away = text(look_at([0.0, 2.0, 9.0], [0.0, 2.0, 20.0], [0.0, 1.0, 0.0]));
    let output = cached(folder, &format!("sequence a.obj --view-matrix {away} --turntable 4 -o b#.png --size 8x8"));
    assert_eq!(output.status.code(), Some(2));
    assert!(texts(&output)[1].contains("does not lie before the camera"), "{}", texts(&output)[1]);
    let stderr = refused(folder, &format!("a.obj --view-matrix {away} --up 0,1,0"));
    assert!(stderr.contains("--up cannot be used with --view-matrix"), "{stderr}");
}

fn matrix_up([_, up, ..]: [[f64; 4]; 4]) -> [f64; 3] {
    [up[0], up[1], up[2]]
}

#[test]
fn a_turntable_of_a_gltf_camera_turns_about_the_point_of_its_axis_nearest_to_the_centre() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // One triangle in the bounds -3..3, 0..4, -1..5, and a camera at 1, 2, 10 that looks along -z.
    let file = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}], "scene": 0,
        "nodes": [{"mesh": 0}, {"camera": 0, "translation": [1, 2, 10]}],
        "cameras": [{"name": "c", "type": "perspective", "perspective": {"yfov": 1.0471975511965976, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [-3, 0, -1], "max": [3, 4, 5]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AABAwAAAAAAAAIC/AABAQAAAgEAAAIC/AABAQAAAAAAAAKBA"}]}"#;
    fs::write(folder.join("a.gltf"), file).unwrap();
    turn(folder, "a.gltf --camera c");
    for (frame, eye) in [(0, "1,2,10"), (1, "9,2,2"), (2, "1,2,-6"), (3, "-7,2,2")] {
        render(folder, "looked.exr", &format!("a.gltf --eye {eye} --target 1,2,2 --fov-y 60"));
        hold_same(folder, "looked.exr", &format!("t{frame}.exr"));
    }
}
