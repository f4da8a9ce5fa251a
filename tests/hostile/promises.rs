//! What must hold of whatever a file holds: by the tests on the corpus and its mutations, and by the fuzzer.

use hbao::image::{exr, png};
use hbao::scene::Mesh;
use hbao::settings::{KNOBS, Settings};
use std::io::BufReader;
use std::path::Path;

/// A model, and what every `mtllib` in it names: a mesh that holds together, or one line. True where it is a mesh.
pub(crate) fn model(obj: &[u8], mtl: &[u8]) -> bool {
    let path = Path::new("model.obj");
    let result = Mesh::read_obj(obj, path, |_| Ok(mtl));
    // As a slow pipe gives it.
    let in_pieces = Mesh::read_obj(BufReader::with_capacity(7, obj), path, |_| Ok(BufReader::with_capacity(3, mtl)));
    match (result, in_pieces) {
        (Ok(mesh), Ok(same)) => {
            assert_eq!(mesh, same, "another mesh where it comes in pieces");
            holds_together(&mesh);
            true
        }
        (Err(error), Err(same)) => {
            let message = error.to_string();
            assert_eq!(message, same.to_string());
            assert!(!error.is_usage(), "{message}");
            one_line(&message);
            let lines = obj.iter().chain(mtl).filter(|&&byte| byte == b'\n').count() + 2;
            let line = message.split_once(": line ").map(|(_, rest)| rest.split(':').next().unwrap().parse().unwrap());
            let whole = message.starts_with("model.obj: holds no faces");
            assert!(whole || line.is_some_and(|line: usize| (1..=lines).contains(&line)), "no line: {message}");
            false
        }
        (result, in_pieces) => panic!("{result:?}, and in pieces {in_pieces:?}"),
    }
}

fn holds_together(mesh: &Mesh) {
    let count = mesh.positions.len();
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.positions.iter().all(|p| p.abs().max_element() <= 1e15), "{:?}", mesh.positions);
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < count), "{:?} of {count}", mesh.triangles);
    let mut end = 0;
    for group in &mesh.groups {
        assert_eq!(group.triangles.start, end);
        assert!(!group.triangles.is_empty() && group.colour.iter().all(|x| (0.0..=1.0).contains(x)), "{group:?}");
        end = group.triangles.end;
    }
    assert_eq!(end, mesh.triangles.len());
    let normals = mesh.vertex_normals();
    assert_eq!(normals.len(), count);
    assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12), "{normals:?}");
}

/// A settings file's text: settings in range that a file keeps to the bit, or one line and nothing changed. True where
/// it is settings.
pub(crate) fn settings(text: &str) -> bool {
    let mut read = Settings::default();
    match read.read_toml(text) {
        Ok(()) => {
            read.validate().unwrap();
            let written = read.to_toml().to_string();
            let mut again = Settings::default();
            again.read_toml(&written).unwrap();
            assert_eq!(again, read, "{written}");
            true
        }
        Err(message) => {
            one_line(&message);
            let named = KNOBS.iter().any(|knob| message.starts_with(&format!("{}: ", knob.name)));
            let placed = message.starts_with("line ") || message.starts_with("unknown setting ");
            assert!(named || placed, "neither line nor setting: {message}");
            assert_eq!(read, Settings::default(), "half read: {message}");
            false
        }
    }
}

/// A message that fits on a terminal and does nothing to it.
pub(crate) fn one_line(message: &str) {
    assert!(!message.is_empty() && !message.chars().any(char::is_control), "{message:?}");
    assert!(message.len() < 1000, "{} bytes: {message}", message.len());
}

/// A PNG or EXR file, or none: its text and its pixels are read or refused in one line. True where there is text.
pub(crate) fn picture(path: &Path) -> bool {
    let texts = [png::read_text(path), exr::read_text(path)];
    let read = texts.iter().flatten().any(|text| !text.is_empty());
    let pixels = [
        png::read::<u8>(path).err(),
        png::read::<[u8; 3]>(path).err(),
        exr::read::<f32>(path).err(),
        exr::read::<[f32; 3]>(path).err(),
    ];
    for error in texts.into_iter().map(Result::err).chain(pixels).flatten() {
        assert!(!error.is_usage());
        one_line(&error.to_string());
    }
    read
}
