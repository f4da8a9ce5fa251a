//! Tests on real models from the folder `../shared/models` beside the package. If the folder is not there, the tests
//! report that and pass. `HBAO_MODELS_SIZE=1600x1200` sets the size of the images.

mod rig;

use glam::{DMat4, DVec3, dvec3};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::scene::{Lens, Scene, View};
use hbao::settings::Radius;
use rig::{Shot, assert_identical, formats, twin};
use std::io::Write as _;
use std::path::Path;

fn size() -> (u32, u32) {
    let text = std::env::var("HBAO_MODELS_SIZE").unwrap_or("400x300".into());
    let numbers = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    numbers.unwrap_or_else(|| panic!("HBAO_MODELS_SIZE={text}: give it as 1600x1200"))
}

/// Opens a model of that folder, with a radius of 5 % of its size. Returns `None` if the file is not there.
fn open(name: &'static str, eye: DVec3, target: DVec3, fov_y: f64) -> Option<Shot> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models").join(name);
    if !path.exists() {
        // The harness would capture what `eprintln!` writes, and nobody would see it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} is not there", path.display());
        return None;
    }
    let scene = Scene::open(path.to_str().unwrap()).unwrap();
    let radius = 0.05 * scene.mesh.diagonal();
    let lens = Some(Lens::FovY(fov_y.to_radians()));
    let view = View { eye: Some(eye), target: Some(target), lens, ..View::default() };
    Some(Shot::new(name, scene.mesh, view, radius))
}

/// Compares the G-buffer with ray casting, edges and ambient occlusion with the twins, and EGL with OSMesa.
fn hold_model(name: &'static str, eye: DVec3, target: DVec3, fov_y: f64) {
    let Some(shot) = open(name, eye, target, fov_y) else { return };
    let radius = shot.radius;
    let settings = Settings { radius: Radius::Units(radius), ..rig::float_settings(radius) };
    // The format of the normals and the number of samples are the defaults.
    let Settings { normal_format, msaa, .. } = Settings::default();
    let settings = Settings { normal_format, msaa, ..settings };
    let text = format!("{name} at {:?}\n{}", size(), settings.to_toml());
    let frame = rig::render(Context::open(Backend::Egl).unwrap().gl(), &shot, size(), &settings);
    let other = rig::render(Context::open(Backend::Osmesa).unwrap().gl(), &shot, size(), &settings);
    assert_identical(&frame, &other, &format!("egl and osmesa, {text}"));
    twin::hold_gbuffer(&frame, &shot, size(), &settings, &text);
    let ambiguous = twin::hold_raw(&frame, &settings, &text);
    twin::hold_edges(&frame, &settings, &text);
    twin::hold_blur(&frame, &settings, &text);
    let covered = frame.covered().texels.iter().filter(|&&c| c).count();
    eprintln!("{name}: {ambiguous} of {covered} covered pixels are ambiguous");
    assert!(covered > frame.depth.texels.len() / 10);
}

/// Compares every method and switch with the twins, and EGL with OSMesa.
fn hold_every_switch(name: &'static str, eye: DVec3, target: DVec3, fov_y: f64) {
    let Some(shot) = open(name, eye, target, fov_y) else { return };
    let [egl, osmesa] = rig::BOTH;
    // The radii of the switches were chosen for the Cornell box, so they are scaled to this model.
    let scale = shot.radius / rig::scenes::cornell_box().radius;
    for settings in rig::every_switch() {
        let settings = rig::scaled(&settings, scale);
        let text = format!("{name}\n{}", settings.to_toml());
        let [frame, other] = [egl, osmesa].map(|backend| {
            let context = Context::open(backend).unwrap();
            rig::render(context.gl(), &shot, (140, 105), &settings)
        });
        assert_identical(&frame, &other, &text);
        twin::hold_edges(&frame, &settings, &text);
        twin::hold_raw(&frame, &settings, &text);
        twin::hold_blur(&frame, &settings, &text);
    }
}

#[test]
fn every_method_and_switch_on_sibenik() {
    hold_every_switch("sibenik.obj", dvec3(-15.5, -10.5, 0.0), dvec3(10.0, -9.0, 0.0), 60.0);
}

#[test]
fn every_method_and_switch_on_the_dragon() {
    hold_every_switch("dragon.obj", dvec3(-5.0, 8.0, 14.5), dvec3(0.0, 4.5, 0.0), 45.0);
}

#[test]
fn sibenik_down_the_nave() {
    hold_model("sibenik.obj", dvec3(-15.5, -10.5, 0.0), dvec3(10.0, -9.0, 0.0), 60.0);
}

#[test]
fn sibenik_behind_a_column() {
    hold_model("sibenik.obj", dvec3(-16.0, -12.0, -3.0), dvec3(8.0, -8.0, 2.0), 60.0);
}

#[test]
fn sibenik_from_the_choir() {
    hold_model("sibenik.obj", dvec3(14.0, -12.5, 0.0), dvec3(-10.0, -8.0, 0.0), 60.0);
}

#[test]
fn dragon() {
    hold_model("dragon.obj", dvec3(-5.0, 8.0, 14.5), dvec3(0.0, 4.5, 0.0), 45.0);
}

#[test]
fn sponza_in_the_courtyard() {
    hold_model("sponza.obj", dvec3(7.2, 1.6, -0.35), dvec3(-10.0, 3.2, -0.35), 60.0);
}

#[test]
fn sponza_from_the_gallery() {
    hold_model("sponza.obj", dvec3(-9.8, 5.6, 2.8), dvec3(8.0, 2.5, -2.0), 60.0);
}

#[test]
fn bunny() {
    hold_model("bunny.obj", dvec3(-0.017, 0.16, 0.25), dvec3(-0.017, 0.108, 0.0), 45.0);
}

/// Checks that the supersampling blur leaves at most `share` of the mean error that the plain blur has on edge pixels.
fn hold_edges_to(share: f64, name: &'static str, eye: DVec3, target: DVec3, fov_y: f64) {
    let Some(shot) = open(name, eye, target, fov_y) else { return };
    let [plain, supersampled] = rig::errors_on_edges(&shot, size());
    eprintln!("{name}: plain {plain:.4}, supersampled {supersampled:.4}, ratio {:.3}", supersampled / plain);
    assert!(supersampled <= share * plain, "{supersampled} of {plain}");
}

#[test]
fn supersampling_halves_the_dragons_error_on_edges() {
    hold_edges_to(0.5, "dragon.obj", dvec3(-5.0, 8.0, 14.5), dvec3(0.0, 4.5, 0.0), 45.0);
}

#[test]
fn supersampling_lowers_sibeniks_error_on_edges() {
    hold_edges_to(0.85, "sibenik.obj", dvec3(-15.5, -10.5, 0.0), dvec3(10.0, -9.0, 0.0), 60.0);
    hold_edges_to(0.85, "sibenik.obj", dvec3(-16.0, -12.0, -3.0), dvec3(8.0, -8.0, 2.0), 60.0);
    hold_edges_to(0.85, "sibenik.obj", dvec3(14.0, -12.5, 0.0), dvec3(-10.0, -8.0, 0.0), 60.0);
}

/// Writes Sponza with texture coordinates, by the dominant axis of each face and one repeat a metre. Returns its
/// material file, in which three materials have holes.
fn write_textured_sponza(folder: &Path, path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut obj, mut mtl) = (String::from("mtllib scene.mtl\n"), String::new());
    let mut positions: Vec<DVec3> = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", x, y, z] => positions.push(dvec3(x.parse().unwrap(), y.parse().unwrap(), z.parse().unwrap())),
            ["usemtl", name] => {
                let picture = mtl.len() % 3;
                mtl += &format!("newmtl {name}\nKd 0.9 0.9 0.8\nmap_Kd PLACED {picture}.png\n");
                if name.ends_with("_mask") {
                    mtl += "map_d PLACED holes.png\n";
                }
            }
            ["f", ..] => {
                let corners: Vec<usize> = words[1..].iter().map(|word| word.parse().unwrap()).collect();
                let at: Vec<DVec3> = corners.iter().map(|&i| positions[i - 1]).collect();
                let axis = (at[1] - at[0]).cross(at[2] - at[0]).abs().max_position();
                at.iter().for_each(|p| obj += &format!("vt {} {}\n", p[(axis + 1) % 3], p[(axis + 2) % 3]));
                obj += "f";
                let count = corners.len();
                corners.iter().enumerate().for_each(|(i, v)| obj += &format!(" {v}/-{}", count - i));
                obj += "\n";
                continue;
            }
            _ => {}
        }
        obj += line;
        obj += "\n";
    }
    std::fs::write(folder.join("scene.obj"), obj).unwrap();
    for picture in 0..3u32 {
        let texel = |x: u32, y: u32| image::Rgb([(40 * picture + 12 * x) as u8, (11 * y) as u8 + 60, 150]);
        image::RgbImage::from_fn(16, 16, texel).save(folder.join(format!("{picture}.png"))).unwrap();
    }
    let holes = |x: u32, y: u32| image::Luma([if (x / 3 + y / 5).is_multiple_of(2) { 255u8 } else { 0 }]);
    image::GrayImage::from_fn(24, 20, holes).save(folder.join("holes.png")).unwrap();
    mtl
}

#[test]
fn sponza_with_textures_and_cut_outs() {
    let (eye, target) = (dvec3(7.2, 1.6, -0.35), dvec3(-10.0, 3.2, -0.35));
    let Some(plain) = open("sponza.obj", eye, target, 60.0) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models/sponza.obj");
    let mtl = write_textured_sponza(folder.path(), &path);
    let meshes = rig::cuts::open(folder.path(), &mtl);
    let shot = Shot { mesh: meshes[0].clone(), ..plain.clone() };
    let settings = rig::float_settings(shot.radius);
    let context = Context::open(Backend::Egl).unwrap();
    let [frame, of_plain] = [&shot, &plain].map(|shot| rig::render(context.gl(), shot, size(), &settings));
    let cut = frame.depth.texels.iter().zip(&of_plain.depth.texels).filter(|(a, b)| *a > *b).count();
    twin::hold_gbuffer(&frame, &shot, size(), &settings, "sponza with cut-outs");
    let (compared, different) = rig::cuts::differences(&frame, &meshes, &shot, &settings);
    let [with, without] = [(&frame, &shot), (&of_plain, &plain)]
        .map(|(frame, shot)| rig::cuts::error(frame, &shot.mesh, shot, &settings, 64));
    eprintln!(
        "{cut} pixels see through; {} of {compared} differ {:?}; error {with:.4}, and {without:.4} without cut-outs",
        different.len(),
        different.first()
    );
    assert!(cut > 100, "only {cut} pixels see through a cut-out");
    assert!(different.len() * 10_000 <= compared, "{} of {compared} differ: {}", different.len(), different[0]);
    assert!(compared * 10 > 9 * frame.depth.texels.len(), "only {compared} compared");
    assert!(with < 1.1 * without, "{with}, and {without} without cut-outs");
}

/// Writes a model in another format, reads it again, and checks it as [`hold_model`] checks an OBJ file: its G-buffer
/// agrees with rays, and the error of ambient occlusion against the truth is that of the OBJ file. The views are those
/// of the file's cameras `0`, `1`, ..., or that of `shot` if it has none.
fn hold_format(shot: &Shot, file: &[u8], context: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model"), file).unwrap();
    let scene = Scene::open(folder.path().join("model")).unwrap();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let views = scene.cameras.iter().map(|(_, view)| view.clone());
    let views = if scene.cameras.is_empty() { vec![shot.view.clone()] } else { views.collect() };
    let settings = rig::float_settings(shot.radius);
    let gl = Context::open(Backend::Egl).unwrap();
    for (i, view) in views.into_iter().enumerate() {
        let text = format!("{context}, view {i}");
        let obj = Shot { view, ..shot.clone() };
        let read = Shot { mesh: scene.mesh.clone(), ..obj.clone() };
        let frame = rig::render(gl.gl(), &read, size(), &settings);
        twin::hold_gbuffer(&frame, &read, size(), &settings, &text);
        let of_obj = rig::render(gl.gl(), &obj, size(), &settings);
        let [error, expected] = [(&frame, &read), (&of_obj, &obj)]
            .map(|(frame, shot)| rig::cuts::error(frame, &shot.mesh, shot, &settings, 64));
        let covered = frame.covered().texels.iter().filter(|&&covered| covered).count();
        eprintln!("{text}: {covered} pixels covered, error {error:.5}, and {expected:.5} as OBJ");
        assert!(covered > frame.depth.texels.len() / 10, "{text}: {covered}");
        // The files hold float32, in which the rasteriser meets other surfaces at a few silhouettes.
        assert!((error - expected).abs() < 0.01 * expected, "{text}: {error}, and {expected} as OBJ");
    }
}

#[test]
fn a_scan_in_ply_has_the_errors_that_it_has_in_obj() {
    let Some(bunny) = open("bunny.obj", dvec3(-0.017, 0.16, 0.25), dvec3(-0.017, 0.108, 0.0), 45.0) else { return };
    for order in [formats::Order::Text, formats::Order::Little, formats::Order::Big] {
        hold_format(&bunny, &formats::ply(&bunny.mesh, order), "the bunny in PLY");
    }
}

#[test]
fn a_part_in_stl_has_the_errors_that_it_has_in_obj() {
    let Some(dragon) = open("dragon.obj", dvec3(-5.0, 8.0, 14.5), dvec3(0.0, 4.5, 0.0), 45.0) else { return };
    hold_format(&dragon, &formats::stl(&dragon.mesh), "the dragon in STL");
    hold_format(&dragon, formats::text_stl(&dragon.mesh).as_bytes(), "the dragon in STL of text");
}

#[test]
fn a_church_in_glb_has_the_errors_that_it_has_in_obj_from_both_cameras() {
    let (nave, target) = (dvec3(-15.5, -10.5, 0.0), dvec3(10.0, -9.0, 0.0));
    let Some(sibenik) = open("sibenik.obj", nave, target, 60.0) else { return };
    let camera = |(eye, target): (DVec3, DVec3)| {
        let back = (eye - target).normalize();
        let right = DVec3::Y.cross(back).normalize();
        let axes = [right, back.cross(right), back].map(|axis| axis.extend(0.0));
        let to_world = DMat4::from_cols(axes[0], axes[1], axes[2], eye.extend(1.0)).to_cols_array();
        format!(r#"{{"camera":0,"matrix":{to_world:?}}}"#)
    };
    let [first, second] = [(nave, target), (dvec3(14.0, -12.5, 0.0), dvec3(-10.0, -8.0, 0.0))].map(camera);
    let cameras = r#","cameras":[{"type":"perspective","perspective":{"yfov":1.0471975511965976,"znear":0.05}}]"#;
    let (json, binary) = formats::gltf(&sibenik.mesh, &format!(r#"{{"mesh":0}},{first},{second}"#), cameras, None);
    hold_format(&sibenik, &formats::glb(&json, &binary), "Sibenik in GLB");
}
