//! The promises that hold for any content of a file. The tests check them on the corpus and its mutations, and so does
//! the fuzzer.

use hbao::Error;
use hbao::image::{Layers, exr, png, read_channels};
use hbao::scene::{Mesh, Scene};
use hbao::settings::{KNOBS, Settings};
use std::io::BufReader;
use std::path::Path;

/// Reads a model, with `mtl` as the content of every `mtllib` that the model names. The result must be a consistent
/// mesh, with one line for each kind of thing that was left out, or a one-line error about the model. Returns these
/// lines if there is a mesh.
pub(crate) fn model(obj: &[u8], mtl: &[u8]) -> Option<Vec<String>> {
    let path = Path::new("model.obj");
    let result = Mesh::read_obj(obj, path, |_| Ok(mtl));
    // This reads the same bytes in small pieces, as from a slow pipe.
    let in_pieces = Mesh::read_obj(BufReader::with_capacity(7, obj), path, |_| Ok(BufReader::with_capacity(3, mtl)));
    let lines = obj.iter().chain(mtl).filter(|&&byte| matches!(byte, b'\n' | b'\r')).count() + 2;
    let line_of = |message: &str| {
        let line = message.split_once(": line ").map(|(_, rest)| rest.split(':').next().unwrap().parse().unwrap());
        line.inspect(|line: &usize| assert!((1..=lines).contains(line), "no valid line: {message}"))
    };
    match (result, in_pieces) {
        (Ok((mesh, notices)), Ok(same)) => {
            assert_eq!((&mesh, &notices), (&same.0, &same.1), "reading in pieces gives another mesh");
            holds_together(&mesh);
            assert!(notices.len() <= 9, "{notices:?}");
            for notice in &notices {
                one_line(notice);
                assert!(line_of(notice).is_some() || notice.contains(": this is "), "no valid line: {notice}");
            }
            Some(notices)
        }
        (Err(error), Err(same)) => {
            let message = error.to_string();
            assert_eq!(message, same.to_string());
            assert!(!error.is_usage(), "{message}");
            one_line(&message);
            let whole = ["holds no faces", "is empty", "this is "].map(|what| format!("model.obj: {what}"));
            let whole = whole.iter().any(|what| message.starts_with(what));
            assert!(message.starts_with("model.obj: "), "the model is refused because of its materials: {message}");
            assert!(whole || line_of(&message).is_some(), "no valid line: {message}");
            None
        }
        (result, in_pieces) => panic!("{result:?}, but read in pieces {in_pieces:?}"),
    }
}

/// Reads a model of any format, whole and in small pieces. The result must be a consistent mesh with notices of one
/// line, or an error of one line. Returns whether there is a mesh.
pub(crate) fn any_model(bytes: &[u8]) -> bool {
    // No file of this folder is read, because there is none.
    let path = Path::new("no such folder/model");
    match (Scene::read(bytes, path), Scene::read(BufReader::with_capacity(7, bytes), path)) {
        (Ok(scene), Ok(same)) => {
            assert_eq!((&scene.mesh, &scene.notices, &scene.cameras), (&same.mesh, &same.notices, &same.cameras));
            holds_together(&scene.mesh);
            scene.notices.iter().for_each(|notice| one_line(notice));
            assert!(scene.cameras.iter().all(|(_, view)| view.check().is_ok()));
            true
        }
        (Err(error), Err(same)) => {
            assert!(!error.is_usage() && error.to_string() == same.to_string(), "{error} {same}");
            one_line(&error.to_string());
            false
        }
        (scene, same) => panic!("{:?}, but read in pieces {:?}", scene.map(|s| s.notices), same.map(|s| s.notices)),
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

/// Reads the text of a settings file. The result must be settings that are in range and survive a settings file to the
/// bit, or a one-line error that leaves the settings unchanged. Returns true if it is settings.
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
            assert!(named || placed, "the message names neither a line nor a setting: {message}");
            assert_eq!(read, Settings::default(), "the settings changed in spite of the error: {message}");
            false
        }
    }
}

/// Checks that a message is short and contains no control characters.
pub(crate) fn one_line(message: &str) {
    assert!(!message.is_empty() && !message.chars().any(char::is_control), "{message:?}");
    assert!(message.len() < 1000, "{} bytes: {message}", message.len());
}

/// Reads a file that may be a PNG, an EXR or neither. Its text and its pixels must each be read, or be refused with a
/// one-line error. Returns true if there is text.
pub(crate) fn picture(path: &Path) -> bool {
    let texts = [png::read_text(path), exr::read_text(path)];
    let read = texts.iter().flatten().any(|text| !text.is_empty());
    let pixels = [
        png::read::<u8>(path).err(),
        png::read::<[u8; 3]>(path).err(),
        exr::read::<f32>(path).err(),
        exr::read::<[f32; 3]>(path).err(),
        read_channels(path).err(),
        Layers::open(path).and_then(read_layers).err(),
    ];
    for error in texts.into_iter().map(Result::err).chain(pixels).flatten() {
        assert!(!error.is_usage());
        one_line(&error.to_string());
    }
    read
}

/// Reads three channels of a picture, as the command does. They are then as large as the picture.
fn read_layers(picture: Layers) -> Result<(), Error> {
    let (first, size): (Vec<usize>, _) = ((0..picture.names().count().min(3)).collect(), picture.size());
    let images = picture.read(&first, 0.0)?;
    assert!(images.iter().all(|image| (image.width, image.height) == size && image.texels.len() == size.0 * size.1));
    Ok(())
}
