//! Checks that the command renders PLY, STL and glTF files, and through the cameras of a glTF file.

use crate::rig::command::{cached, texts};
use crate::rig::formats::{self, Order};
use glam::dvec3;
use hbao::scene::Mesh;
use std::fs;
use tempfile::TempDir;

/// A wall of two triangles, a unit square in the plane z = 0.
fn wall() -> Mesh {
    let positions = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| dvec3(x, y, 0.0));
    Mesh::new(positions.into(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// A GLB file of the wall with one camera in front of it and another at its side, one of them orthographic.
fn with_cameras() -> Vec<u8> {
    let nodes = r#"{"mesh":0},{"name":"front","camera":0,"translation":[0.5,0.5,3]},
        {"name":"far off","camera":1,"translation":[0.5,0.5,9]}"#;
    let cameras = r#","cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.5,"zfar":20}},
        {"type":"orthographic","orthographic":{"xmag":2,"ymag":2,"znear":0.5,"zfar":10}}]"#;
    let (json, binary) = formats::gltf(&wall(), nodes, cameras, None);
    formats::glb(&json, &binary)
}

#[test]
fn a_glb_file_is_rendered_through_each_of_its_cameras() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("m.glb"), with_cameras()).unwrap();
    let render = |arguments: &str| {
        let arguments: Vec<_> = arguments.split_whitespace().map(|word| word.replace('_', " ")).collect();
        let mut command = crate::rig::command::of_arguments(folder.path(), &arguments);
        let output = crate::rig::command::with_shader_cache(&mut command).output().unwrap();
        let [_, stderr] = texts(&output);
        (output.status.code(), stderr)
    };
    let image = |arguments: &str| {
        let (code, stderr) = render(&format!(
            "render m.glb --size 40x30 --radius 0.5 -o out.png --show depth --no-metadata {arguments}"
        ));
        assert_eq!(code, Some(0), "{stderr}");
        fs::read(folder.path().join("out.png")).unwrap()
    };
    // The cameras are those that flags describe.
    let fov_y = 0.5_f64.to_degrees();
    let front = image("--camera front");
    let flags = format!("--eye 0.5,0.5,3 --target 0.5,0.5,0 --fov-y {fov_y} --near 0.5 --far 20");
    assert_eq!(front, image(&flags));
    let far_off = image("--camera far_off");
    assert_eq!(far_off, image("--eye 0.5,0.5,9 --target 0.5,0.5,0 --ortho 4 --near 0.5 --far 10"));
    assert_ne!(front, far_off);
    assert_ne!(front, image(""), "without the flag the whole scene is framed");
    // Flags override the camera.
    assert_eq!(far_off, image("--camera front --eye 0.5,0.5,9 --target 0.5,0.5,0 --ortho 4 --near 0.5 --far 10"));

    let (code, stderr) = render("render m.glb -o out.png --camera back");
    assert_eq!(code, Some(2));
    assert_eq!(stderr, "hbao: --camera 'back' is no camera of the scene: there are 'front', 'far off'\n");
    let (code, stderr) = render("render -o out.png --camera front");
    assert_eq!(code, Some(2));
    assert!(stderr.contains("this scene has no cameras"), "{stderr}");
}

#[test]
fn every_format_is_rendered_and_a_bad_file_is_one_line() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let [obj, mtl] = formats::obj(&wall());
    write("a.obj", obj.as_bytes());
    write("scene.mtl", mtl.as_bytes());
    write("a.ply", &formats::ply(&wall(), Order::Big));
    write("a.stl", &formats::stl(&wall()));
    let images = ["a.obj", "a.ply", "a.stl"].map(|name| {
        let output = cached(folder.path(), &format!("render {name} --size 20x15 --no-metadata --radius 1 -o a.png"));
        assert!(output.status.success(), "{:?}", texts(&output));
        fs::read(folder.path().join("a.png")).unwrap()
    });
    assert!(images[0] == images[1] && images[0] == images[2]);
    write("short.stl", &formats::stl(&wall())[..150]);
    let output = cached(folder.path(), "render short.stl -o b.png");
    let [_, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr.starts_with("hbao: short.stl: this STL file claims 2 triangles") && stderr.lines().count() == 1,
        "{stderr}"
    );
    assert!(!folder.path().join("b.png").exists());
}
