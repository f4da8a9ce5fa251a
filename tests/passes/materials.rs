//! Surfaces that textures cut away are cut alike in the G-buffer, in its twin and in the truth.

use crate::rig::{self, Shot, cuts, formats, twin};
use glam::dvec3;
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::reference::truth::Truth;
use hbao::scene::{Lens, Mesh, Scene, View};
use hbao::settings::{Normals, Radius};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A floor, a wall with holes, a leaf whose colours have alpha, and a pane that is left out.
const MTL: &str = "newmtl floor\nKd 0.9 0.8 0.7\nmap_Kd PLACED tiles.bmp\n\
    newmtl wall\nKd 0.5 0.6 0.9\nmap_Kd PLACED -s 2 2 tiles.bmp\nmap_d PLACED holes.png\n\
    newmtl leaf\nKd 1 1 1\nmap_Kd PLACED -clamp on leaf.tga\nnewmtl pane\nKd 1 0 0\nd 0.25\n";

fn write_model(folder: &Path) {
    let mut obj = String::from("mtllib scene.mtl\n");
    let mut quad = |material: &str, corners: [[f64; 3]; 4], repeats: f64, colour: &str| {
        let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for ([x, y, z], [u, v]) in corners.into_iter().zip(uv) {
            let _ = writeln!(obj, "v {x} {y} {z} {colour}\nvt {} {}", u * repeats - 0.3, v * repeats + 0.1);
        }
        let _ = writeln!(obj, "usemtl {material}\nf -4/-4 -3/-3 -2/-2 -1/-1");
    };
    quad("floor", [[-3., 0., -3.], [-3., 0., 3.], [3., 0., 3.], [3., 0., -3.]], 3.0, "1 0.5 0.25");
    quad("wall", [[-2., 0., -0.6], [2., 0., -0.9], [2., 2., -0.7], [-2., 2., -0.8]], 2.5, "");
    quad("leaf", [[-1., 0.1, 0.4], [0.4, 0.1, 0.7], [0.3, 1.2, 0.2], [-0.9, 1.3, 0.4]], 1.0, "");
    quad("pane", [[-3., 0., 1.5], [3., 0., 1.5], [3., 3., 1.5], [-3., 3., 1.5]], 1.0, "");
    fs::write(folder.join("scene.obj"), obj).unwrap();
    let tiles = image::RgbImage::from_fn(8, 4, |x, y| image::Rgb([30 * x as u8 + 40, 200, 60 * y as u8 + 20]));
    tiles.save(folder.join("tiles.bmp")).unwrap();
    let holes = image::GrayImage::from_fn(13, 7, |x, y| image::Luma([if (x * 5 + y * 3) % 7 < 3 { 127 } else { 128 }]));
    holes.save(folder.join("holes.png")).unwrap();
    let leaf = image::RgbaImage::from_fn(16, 16, |x, y| {
        let (dx, dy) = (x as f64 - 7.5, y as f64 - 6.5);
        image::Rgba([20, 160 + 5 * y as u8, 30, if dx * dx + dy * dy < 40.0 { 255 } else { 0 }])
    });
    leaf.save(folder.join("leaf.tga")).unwrap();
}

fn shot(mesh: Mesh) -> Shot {
    let view = View {
        eye: Some(dvec3(0.6, 1.7, 4.0)),
        target: Some(dvec3(0.0, 0.6, 0.0)),
        lens: Some(Lens::FovY(45f64.to_radians())),
        ..View::default()
    };
    Shot::new("cut-outs", mesh, view, 0.6)
}

#[test]
fn cut_outs_textures_and_vertex_colours_are_what_rays_see() {
    let folder = TempDir::new().unwrap();
    write_model(folder.path());
    let meshes = cuts::open(folder.path(), MTL);
    // The pane is left out, and its corners are no part of the scene.
    assert_eq!((meshes[0].triangles.len(), meshes[0].positions.len()), (6, 12));
    let size = (240, 180);
    for orthographic in [false, true] {
        let shot = shot(meshes[0].clone());
        let shot = if orthographic { Shot { height: 3.0, ..shot }.orthographic() } else { shot.rolled() };
        for (msaa, normals) in [(1, Normals::Derivative), (4, Normals::Vertex)] {
            let settings = Settings { msaa, normals, ..rig::float_settings(shot.radius) };
            let context = Context::open(Backend::Egl).unwrap();
            let frame = rig::render(context.gl(), &shot, size, &settings);
            let text = format!("{msaa} samples, orthographic: {orthographic}");
            let (compared, different) = cuts::differences(&frame, &meshes, &shot, &settings);
            assert!(different.is_empty(), "{} of {compared} differ, {text}: {}", different.len(), different[0]);
            assert!(compared > 240 * 180 * 9 / 10, "{compared} compared, {text}");
            twin::hold_gbuffer(&frame, &shot, size, &settings, &text);
        }
    }
}

/// A model as a GLB file, with the holes of a picture that is mirrored along u, and whose border goes on along v. The
/// texture coordinates are x and y of the positions, transformed and then moved by `offset`.
fn masked_glb(mesh: &Mesh, png: &[u8], offset: [f64; 2]) -> Vec<u8> {
    let (json, mut binary) = formats::gltf(mesh, r#"{"mesh":0}"#, "", None);
    let mut root: Value = serde_json::from_str(&json).unwrap();
    let count = mesh.positions.len();
    let accessors = root["accessors"].as_array_mut().unwrap();
    let coordinates = accessors.len();
    accessors.push(json!({"bufferView": 2, "componentType": 5126, "count": count, "type": "VEC2"}));
    let views = root["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteLength": 12 * count, "byteStride": 12}));
    views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": png.len()}));
    binary.extend(png);
    root["buffers"][0]["byteLength"] = json!(binary.len());
    root["images"] = json!([{"bufferView": 3}]);
    root["samplers"] = json!([{"wrapS": 33648, "wrapT": 33071}]);
    root["textures"] = json!([{"source": 0, "sampler": 0}]);
    let [u, v] = offset;
    let transform = json!({"offset": [u, 0.9 + v], "rotation": 0.3, "scale": [1.5, -0.7]});
    for material in root["materials"].as_array_mut().unwrap() {
        material["alphaMode"] = json!("MASK");
        material["alphaCutoff"] = json!(0.6);
        material["pbrMetallicRoughness"]["baseColorTexture"] =
            json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
    }
    for primitive in root["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive["attributes"]["TEXCOORD_0"] = json!(coordinates);
    }
    formats::glb(&root.to_string(), &binary)
}

#[test]
fn a_masked_glb_whose_texture_is_mirrored_is_what_rays_see() {
    let folder = TempDir::new().unwrap();
    let texel =
        |x: u32, y: u32| image::Rgba([20 * x as u8, 30 * y as u8, 90, if (x + 2 * y) % 5 < 2 { 150 } else { 160 }]);
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(11, 7, texel).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let ball = rig::scenes::ball();
    let near = cuts::NEAR;
    let meshes = [[0.0, 0.0], [near, near], [-near, near], [near, -near], [-near, -near]].map(|offset| {
        let path = folder.path().join("ball.glb");
        fs::write(&path, masked_glb(&ball.mesh, png.get_ref(), offset)).unwrap();
        let scene = Scene::open(&path).unwrap();
        assert!(scene.notices.is_empty(), "{:?}", scene.notices);
        scene.mesh
    });
    let shot = Shot { mesh: meshes[0].clone(), ..ball.clone() };
    let (size, settings) = ((240, 180), Settings { msaa: 1, ..rig::float_settings(shot.radius) });
    let context = Context::open(Backend::Egl).unwrap();
    let [frame, whole] = [&shot, &ball].map(|shot| rig::render(context.gl(), shot, size, &settings));
    let (compared, different) = cuts::differences(&frame, &meshes, &shot, &settings);
    assert!(different.is_empty(), "{} of {compared} differ: {}", different.len(), different[0]);
    twin::hold_gbuffer(&frame, &shot, size, &settings, "a masked GLB");
    let through = frame.depth.texels.iter().zip(&whole.depth.texels).filter(|(a, b)| *a > *b).count();
    assert!(through > 1000 && compared > 240 * 180 * 8 / 10, "{through} seen through, {compared} compared");
}

#[test]
fn ambient_occlusion_is_as_near_to_the_truth_with_cut_outs_as_without() {
    let folder = TempDir::new().unwrap();
    write_model(folder.path());
    let [cut, ..] = cuts::open(folder.path(), MTL);
    let [whole, ..] =
        cuts::open(folder.path(), &MTL.replace("holes.png", "tiles.bmp").replace("leaf.tga", "tiles.bmp"));
    let context = Context::open(Backend::Egl).unwrap();
    let settings = Settings { radius: Radius::Units(0.6), ..rig::float_settings(0.6) };
    let [cut, whole] = [cut, whole].map(shot);
    let [of_cut, of_whole] = [&cut, &whole].map(|shot| rig::render(context.gl(), shot, (160, 120), &settings));
    let own = cuts::error(&of_whole, &whole.mesh, &whole, &settings, 128);
    let through = cuts::error(&of_cut, &cut.mesh, &cut, &settings, 128);
    println!("error of the whole {own}, with cut-outs {through}");
    assert!(through < 1.5 * own, "{through}, and {own} without cut-outs");
}

#[test]
fn the_truth_beside_a_surface_that_is_all_cut_away_is_that_without_it() {
    let folder = TempDir::new().unwrap();
    write_model(folder.path());
    image::GrayImage::from_pixel(2, 2, image::Luma([0])).save(folder.path().join("nothing.png")).unwrap();
    let nothing = MTL.replace("holes.png", "nothing.png").replace("leaf.tga", "leaf.tga\nmap_d nothing.png");
    let [mesh, ..] = cuts::open(folder.path(), &nothing);
    let floor = Mesh::new(mesh.positions.clone(), mesh.triangles[..2].to_vec()).unwrap();
    let settings = rig::float_settings(0.6);
    let context = Context::open(Backend::Egl).unwrap();
    let [with, without] = [mesh, floor].map(|mesh| {
        let shot = shot(mesh);
        let frame = rig::render(context.gl(), &shot, (60, 40), &settings);
        (cuts::error(&frame, &shot.mesh, &shot, &settings, 16), frame.ao)
    });
    assert_eq!(with, without);
}

#[test]
fn the_truth_of_a_wall_that_is_half_cut_away_is_that_of_half_a_wall() {
    let folder = TempDir::new().unwrap();
    let floor = "v -3 0 -3\nv -3 0 3\nv 3 0 3\nv 3 0 -3\nf 1 2 3 4\n";
    let wall = |right: f64| {
        let corners = format!("v -2 0 -0.5\nv {right} 0 -0.5\nv {right} 2 -0.5\nv -2 2 -0.5\n");
        format!("{corners}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wall\nf 5/1 6/2 7/3 8/4\n")
    };
    image::GrayImage::from_fn(2, 1, |x, _| image::Luma([255 - 255 * x as u8]))
        .save(folder.path().join("half.png"))
        .unwrap();
    fs::write(folder.path().join("m.mtl"), "newmtl wall\nmap_d half.png\n").unwrap();
    let settings = rig::float_settings(0.6);
    let [cut, half] = [format!("mtllib m.mtl\n{floor}{}", wall(2.0)), format!("{floor}{}", wall(0.0))].map(|obj| {
        fs::write(folder.path().join("m.obj"), obj).unwrap();
        let shot = shot(Mesh::load_obj(&folder.path().join("m.obj")).unwrap().0);
        let camera = shot.camera((40, 30));
        let pixels: Vec<usize> = (0..40 * 30).collect();
        Truth::new(&shot.mesh, &camera, (40, 30), &settings, 64).unwrap().trace(&pixels, |_| {})
    });
    assert_eq!(cut.covered, half.covered);
    let occluded = half.visibility.iter().filter(|&&a| a < 0.9).count();
    assert!(occluded > 30, "only {occluded} pixels are occluded");
    for (i, (cut, half)) in cut.visibility.iter().zip(&half.visibility).enumerate() {
        assert!((cut - half).abs() < 1e-9, "{cut} at pixel {i}, and {half} of half a wall");
    }
}
