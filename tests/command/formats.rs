//! Checks that the command renders PLY, STL and glTF files, and through the cameras of a glTF file.

use crate::rig::command::{cached, texts};
use crate::rig::formats::{self, Order};
use glam::dvec3;
use hbao::scene::Mesh;
use serde_json::{Value, json};
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

/// The wall with a camera that moves from 0.5,0.5,3 to 1,0.5,3 in the first second, and one that stands still.
fn with_a_moving_camera() -> Vec<u8> {
    let nodes = r#"{"mesh":0},{"name":"moving","camera":0,"translation":[0.5,0.5,3]},
        {"name":"still","camera":0,"translation":[0.5,0.5,9]}"#;
    let more = r#","cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.5,"zfar":20}}]"#;
    let (json, mut binary) = formats::gltf(&wall(), nodes, more, None);
    let mut root: Value = serde_json::from_str(&json).unwrap();
    let start = binary.len();
    for number in [0.0, 1.0, 0.5, 0.5, 3.0, 1.0, 0.5, 3.0_f32] {
        binary.extend(number.to_le_bytes());
    }
    root["buffers"][0]["byteLength"] = json!(binary.len());
    root["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 0, "byteOffset": start, "byteLength": 32}));
    let accessors = root["accessors"].as_array_mut().unwrap();
    let first = accessors.len();
    accessors.push(json!({"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR"}));
    accessors.push(json!({"bufferView": 2, "byteOffset": 8, "componentType": 5126, "count": 2, "type": "VEC3"}));
    root["animations"] = json!([{
        "samplers": [{"input": first, "output": first + 1}],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
    }]);
    formats::glb(&root.to_string(), &binary)
}

#[test]
fn a_sequence_follows_a_camera_that_its_file_moves() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("m.glb"), with_a_moving_camera()).unwrap();
    let run = |arguments: &str| {
        let output = cached(folder.path(), arguments);
        let [_, stderr] = texts(&output);
        (output.status.code(), stderr)
    };
    let common = "m.glb --size 40x30 --radius 0.5 --show depth --no-metadata";
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let (code, stderr) = run(&format!("sequence {common} --camera moving --fps 2 -o #.png"));
    assert!(code == Some(0) && stderr.contains("frames 0 to 2: 3 rendered"), "{stderr}");
    for (frame, x) in [(0, 0.5), (1, 0.75), (2, 1.0)] {
        let fov_y = 0.5_f64.to_degrees();
        let place = format!("--eye {x},0.5,3 --target {x},0.5,0 --fov-y {fov_y} --near 0.5 --far 20");
        assert_eq!(run(&format!("render {common} -o one.png {place}")).0, Some(0));
        assert!(read("one.png") == read(&format!("{frame}.png")), "frame {frame}");
    }
    // A flag gives another lens, and a turntable another motion.
    let before = read("0.png");
    assert_eq!(run(&format!("sequence {common} --camera moving --fps 1 --ortho 2 -o #.png")).0, Some(0));
    assert!(before != read("0.png"));
    assert_eq!(run(&format!("sequence {common} --camera moving --turntable 2 -o #.png")).0, Some(0));
    assert!(before == read("0.png"), "a turn begins at the camera");
    for (arguments, said) in [
        ("--camera still", "--camera 'still' is not moved by an animation of the scene: give --path or --turntable"),
        ("--camera other", "--camera 'other' is no camera of the scene: there are 'moving', 'still'"),
        ("--camera moving --fps 0", "--fps 0: the number of frames per second must be above 0"),
        ("--camera moving --fps 1e9", "--fps 1000000000: no frame, or one after frame 10000000, lies in the animation"),
        ("--camera moving --eye 1,2,3", "--eye cannot be used with the animation of --camera"),
        ("--camera moving --frames 0-99", "has frames that there are not: they are 0 to 24"),
    ] {
        let (code, stderr) = run(&format!("sequence {common} -o x#.png {arguments}"));
        assert!(code == Some(2) && stderr.contains(said) && stderr.lines().count() == 1, "{arguments}: {stderr}");
    }
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
