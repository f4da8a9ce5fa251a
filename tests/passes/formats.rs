//! A mesh is drawn alike whatever the format of its file is: the G-buffers are the same to the bit, and agree with
//! rays.

use crate::rig::formats::{self, Order};
use crate::rig::{self, Frame, Shot, assert_identical, twin};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::scene::{Group, Mesh, Scene};
use std::fs;
use tempfile::TempDir;

/// The ball's scene with positions that float32 knows, so that every format can hold them.
fn rounded() -> Shot {
    let shot = rig::scenes::ball();
    let positions = shot.mesh.positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
    let mesh = Mesh::new(positions, shot.mesh.triangles.clone()).unwrap();
    Shot { mesh: mesh.with_groups(shot.mesh.groups.clone()).unwrap(), ..shot }
}

/// Draws the scene of a file as `shot` is drawn.
fn drawn(files: &[(&str, Vec<u8>)], shot: &Shot, settings: &Settings) -> (Frame, Shot) {
    let folder = TempDir::new().unwrap();
    files.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    let scene = Scene::open(folder.path().join(files[0].0)).unwrap();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let shot = Shot { mesh: scene.mesh, ..shot.clone() };
    let context = Context::open(Backend::Egl).unwrap();
    (rig::render(context.gl(), &shot, rig::SIZE, settings), shot)
}

#[test]
fn the_colours_of_vertices_are_those_of_obj() {
    let colours = [[255, 0, 0], [0, 255, 51], [0, 102, 255], [204, 204, 0]];
    let points = ["-1 0 -1", "1 0 -1", "1 0 1", "-1 1 1"];
    let (mut obj, mut ply) = (String::new(), "ply\nformat ascii 1.0\nelement vertex 4\n".to_string());
    ["x", "y", "z"].iter().for_each(|name| ply += &format!("property float {name}\n"));
    ["red", "green", "blue", "alpha"].iter().for_each(|name| ply += &format!("property uchar {name}\n"));
    ply += "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let mut glb = Vec::new();
    for (point, [r, g, b]) in points.iter().zip(colours) {
        obj += &format!("v {point} {} {} {}\n", f64::from(r) / 255.0, f64::from(g) / 255.0, f64::from(b) / 255.0);
        ply += &format!("{point} {r} {g} {b} 255\n");
        glb.extend(point.split(' ').flat_map(|x| x.parse::<f32>().unwrap().to_le_bytes()));
    }
    obj += "f 1 2 3\nf 1 3 4\n";
    ply += "3 0 1 2\n3 0 2 3\n";
    // glTF keeps linear colours; 0 and 1 are the same in both.
    glb.extend(colours.iter().flat_map(|&[r, g, b]| [r, g, b, 255].map(|x| if x > 0 { 255 } else { 0 })));
    glb.extend([0, 1, 2, 0, 2, 3]);
    let json = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"buffers":[{"byteLength":70}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1},"indices":2}]}],
        "bufferViews":[{"buffer":0,"byteLength":70}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
        {"bufferView":0,"byteOffset":48,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"},
        {"bufferView":0,"byteOffset":64,"componentType":5121,"count":6,"type":"SCALAR"}]}"#;
    let shot = rounded();
    let settings = Settings { msaa: 1, ..rig::float_settings(shot.radius) };
    let draw = |file: Vec<u8>| drawn(&[("scene", file)], &shot, &settings).0;
    let expected = draw(obj.clone().into_bytes());
    assert_identical(&draw(ply.into_bytes()), &expected, "PLY");
    let bright = obj.lines().map(|line| match line.strip_prefix("v ") {
        Some(numbers) => {
            let numbers: Vec<f64> = numbers.split(' ').map(|x| x.parse().unwrap()).collect();
            let bright = |x: f64| if x > 0.0 { 1.0 } else { 0.0 };
            let [r, g, b] = [3, 4, 5].map(|i| bright(numbers[i]));
            format!("v {} {} {} {r} {g} {b}\n", numbers[0], numbers[1], numbers[2])
        }
        None => format!("{line}\n"),
    });
    let bright: String = bright.collect();
    assert_ne!(bright, obj);
    assert_identical(&draw(formats::glb(json, &glb)), &draw(bright.into_bytes()), "GLB");
}

#[test]
fn every_format_of_a_mesh_gives_the_same_picture_and_agrees_with_rays() {
    let shot = rounded();
    let settings = Settings { msaa: 1, ..rig::float_settings(shot.radius) };
    let one_colour = vec![Group { colour: [1.0; 3], triangles: 0..shot.mesh.triangles.len() }];
    let white = shot.mesh.clone().with_groups(one_colour).unwrap();
    let obj = |mesh: &Mesh| {
        let [obj, mtl] = formats::obj(mesh);
        [("scene.obj", obj.into_bytes()), ("scene.mtl", mtl.into_bytes())]
    };
    let glb = |mesh: &Mesh| {
        let (json, binary) = formats::gltf(mesh, r#"{"mesh":0}"#, "", None);
        formats::glb(&json, &binary)
    };
    for (mesh, others) in [
        (&shot.mesh, vec![("GLB with colours", glb(&shot.mesh))]),
        (
            &white,
            vec![
                ("PLY", formats::ply(&white, Order::Text)),
                ("PLY, little", formats::ply(&white, Order::Little)),
                ("PLY, big", formats::ply(&white, Order::Big)),
                ("STL", formats::stl(&white)),
                ("STL, text", formats::text_stl(&white).into_bytes()),
                ("GLB", glb(&white)),
            ],
        ),
    ] {
        let (expected, _) = drawn(&obj(mesh), &shot, &settings);
        assert!(expected.covered().texels.iter().filter(|&&covered| covered).count() > 1000);
        for (name, file) in others {
            let (frame, read) = drawn(&[("scene", file)], &shot, &settings);
            assert_identical(&frame, &expected, name);
            twin::hold_gbuffer(&frame, &read, rig::SIZE, &settings, name);
        }
    }
}
