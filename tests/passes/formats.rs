//! A mesh is drawn alike whatever the format of its file is: the G-buffers are the same to the bit, and agree with rays.

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
