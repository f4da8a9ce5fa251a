//! Models with textures that cut surfaces away, and the comparison of what is seen through them.

use super::{Frame, Shot};
use hbao::Settings;
use hbao::reference::gbuffer::gbuffer;
use hbao::reference::truth::Truth;
use hbao::scene::{Mesh, Scene};
use std::fs;
use std::path::Path;

/// Texture coordinates this near to the border of a texel are ambiguous.
pub const NEAR: f64 = 1e-5;

/// Opens the model `scene.obj` of a folder, whose material file is written from `mtl`. In it `PLACED` stands for the
/// options of each texture. The meshes after the first one have their textures moved by [`NEAR`] in each direction.
pub fn open(folder: &Path, mtl: &str) -> [Mesh; 5] {
    [[0.0, 0.0], [NEAR, NEAR], [-NEAR, NEAR], [NEAR, -NEAR], [-NEAR, -NEAR]].map(|[u, v]| {
        fs::write(folder.join("scene.mtl"), mtl.replace("PLACED", &format!("-o {u} {v}"))).unwrap();
        Scene::open(folder.join("scene.obj")).unwrap().mesh
    })
}

/// Compares which surface each pixel shows with rays, wherever these are sure of it: all rays to points within a
/// hundredth of a pixel of the sample see it, and so do rays past each of the moved textures. Returns how many pixels
/// were compared, and describes those that differ.
pub fn differences(frame: &Frame, meshes: &[Mesh; 5], shot: &Shot, settings: &Settings) -> (usize, Vec<String>) {
    let size = (frame.depth.width, frame.depth.height);
    let camera = shot.camera((size.0 as u32, size.1 as u32));
    let [x, y] = frame.sample_positions()[0];
    let around = [[0.0, 0.0], [-0.01, -0.01], [0.01, -0.01], [-0.01, 0.01], [0.01, 0.01]];
    let mut seen: Vec<_> =
        around.map(|[dx, dy]| gbuffer(&meshes[0], &camera, size, settings.normals, [x + dx, y + dy])).into();
    seen.extend(meshes[1..].iter().map(|mesh| gbuffer(mesh, &camera, size, settings.normals, [x, y])));
    let (mut compared, mut different) = (0, Vec::new());
    for (i, &depth) in frame.depth.texels.iter().enumerate() {
        let expected = seen[0].texels[i].depth;
        if seen.iter().any(|seen| seen.texels[i].depth != expected) {
            continue;
        }
        compared += 1;
        let same = (f64::from(depth) / expected - 1.0).abs() < 1e-3 || (depth.is_infinite() && expected.is_infinite());
        if !same {
            different.push(format!("depth {depth} at {:?}, where rays meet {expected}", (i % size.0, i / size.0)));
        }
    }
    (compared, different)
}

/// Returns how far ambient occlusion is from the truth of a mesh, as the root of the mean square over the pixels that
/// show a surface.
pub fn error(frame: &Frame, mesh: &Mesh, shot: &Shot, settings: &Settings, rays: u32) -> f64 {
    let size = (frame.ao.width, frame.ao.height);
    let camera = shot.camera((size.0 as u32, size.1 as u32));
    let pixels: Vec<usize> = (0..size.0 * size.1).filter(|&i| frame.depth.texels[i].is_finite()).collect();
    let traced = Truth::new(mesh, &camera, size, settings, rays).unwrap().trace(&pixels, |_| {});
    let squares = pixels.iter().zip(&traced.visibility).map(|(&i, a)| (f64::from(frame.ao.texels[i]) - a).powi(2));
    (squares.sum::<f64>() / pixels.len() as f64).sqrt()
}
