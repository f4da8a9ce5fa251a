//! Tests of PLY, STL and glTF files: what is read of them, and that every bad file is refused in one line.

mod gltf;
mod gltf_textures;
mod ply;
mod stl;

use crate::written::{self, Order};
use glam::{DVec3, dvec3};
use hbao::scene::{Mesh, Scene};
use std::fs;
use tempfile::TempDir;

/// What becomes of a file.
enum Verdict {
    /// It has this many triangles, and nothing is left out.
    Triangles(usize),
    /// It has this many triangles, and each of these is in one notice.
    Noticed(usize, &'static [&'static str]),
    /// It is refused, with each of these in the message.
    Refused(&'static [&'static str]),
}
use Verdict::{Noticed, Refused, Triangles};

/// Reads a file of this content beside `others`, both as a file and from a stream of small pieces.
fn open(bytes: &[u8], others: &[(&str, &[u8])]) -> Result<Scene, String> {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in others {
        fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    // The name tells nothing.
    let path = folder.path().join("model.obj");
    fs::write(&path, bytes).unwrap();
    let shorter = |text: String| text.replace(&format!("{}/", folder.path().display()), "");
    let read = |scene: Result<Scene, hbao::Error>| {
        scene.map_err(|e| {
            assert!(!e.is_usage(), "{e}");
            shorter(e.to_string())
        })
    };
    let scene = read(Scene::open(&path));
    let streamed = read(Scene::read(std::io::BufReader::with_capacity(7, bytes), &path));
    match (&scene, &streamed) {
        (Ok(a), Ok(b)) => assert_eq!((&a.mesh, &a.notices, &a.cameras), (&b.mesh, &b.notices, &b.cameras)),
        // The length of a stream is not known, so that its end is found in another place.
        (Err(_), Err(_)) => {}
        (a, b) => panic!("{:?}, but from a stream {:?}", a.as_ref().err(), b.as_ref().err()),
    }
    scene
}

fn one_line(text: &str) {
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.len() < 500 && !text.contains(char::is_control), "{text}");
}

#[track_caller]
fn hold(name: &str, bytes: &[u8], verdict: &Verdict) {
    let scene = open(bytes, &[]);
    if let Ok(Scene { notices, mesh, .. }) = &scene {
        notices.iter().for_each(|notice| one_line(notice));
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()), "{name}");
    }
    match (verdict, scene) {
        (Triangles(count), Ok(scene)) => {
            assert_eq!((scene.mesh.triangles.len(), scene.notices.len()), (*count, 0), "{name}: {:?}", scene.notices);
        }
        (Noticed(count, words), Ok(scene)) => {
            assert_eq!(scene.mesh.triangles.len(), *count, "{name}");
            assert_eq!(scene.notices.len(), words.len(), "{name}: {:?}", scene.notices);
            let found = |word: &&str| scene.notices.iter().any(|notice| notice.contains(word));
            assert!(words.iter().all(found), "{name}: {words:?} of {:?}", scene.notices);
        }
        (Refused(words), Err(message)) => {
            one_line(&message);
            let found = words.iter().all(|word| message.contains(word));
            assert!(message.contains("model.obj: ") && found, "{name}: {words:?} of {message}");
        }
        (_, Ok(scene)) => panic!("{name} is read: {} triangles, {:?}", scene.mesh.triangles.len(), scene.notices),
        (_, Err(message)) => panic!("{name} is refused: {message}"),
    }
}

/// Holds every file to its verdict, and names all that fail.
#[track_caller]
fn hold_all(cases: &[(&str, Vec<u8>, Verdict)]) {
    let fails = |(name, bytes, verdict): &&(&str, Vec<u8>, Verdict)| {
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| hold(name, bytes, verdict))).is_err()
    };
    let failed: Vec<_> = cases.iter().filter(fails).map(|(name, ..)| name).collect();
    assert!(failed.is_empty(), "{failed:?}");
}

/// A tetrahedron and a triangle of another colour, with coordinates that float32 knows.
fn sample() -> Mesh {
    let positions = [(0.0, 0.0, 0.0), (1.5, 0.0, 0.25), (0.0, 2.0, 0.0), (0.0, 0.0, -3.0), (4.0, 1.0, 0.5)];
    let positions = positions.map(|(x, y, z)| dvec3(x, y, z)).to_vec();
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2], [1, 4, 2]];
    Mesh::new(positions, triangles).unwrap()
}

/// The triangles of a mesh by the positions of their corners.
fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])).collect()
}

#[test]
fn the_same_mesh_is_read_from_every_format_by_its_content() {
    let mesh = sample();
    let (json, binary) = written::gltf(&mesh, r#"{"mesh":0}"#, "", None);
    let files = [
        ("OBJ", written::obj(&mesh)[0].replace("mtllib scene.mtl\nusemtl m0\n", "").into_bytes()),
        ("PLY", written::ply(&mesh, Order::Text)),
        ("PLY, little", written::ply(&mesh, Order::Little)),
        ("PLY, big", written::ply(&mesh, Order::Big)),
        ("STL", written::stl(&mesh)),
        ("STL, text", written::text_stl(&mesh).into_bytes()),
        ("GLB", written::glb(&json, &binary)),
    ];
    for (name, file) in files {
        let file = String::from_utf8(file.clone())
            .map_or(file, |text| text.replace("mtllib scene.mtl\n", "").replace("usemtl m0\n", "").into_bytes());
        let scene = open(&file, &[]).unwrap();
        assert_eq!(scene.notices, [""; 0], "{name}");
        assert_eq!(corners(&scene.mesh), corners(&mesh), "{name}");
        assert_eq!(scene.mesh.positions.len(), 5, "{name}: vertices are shared");
    }
}

#[test]
fn progress_is_told_up_to_the_length_of_the_file() {
    let folder = TempDir::new().unwrap();
    let big = (0..40_000).map(|i| format!("v {i} 0 {}\n", i % 7)).collect::<String>() + "f 1 2 3\n";
    let (json, binary) = written::gltf(&sample(), r#"{"mesh":0}"#, "", None);
    for bytes in
        [big.into_bytes(), written::ply(&sample(), Order::Big), written::stl(&sample()), written::glb(&json, &binary)]
    {
        let path = folder.path().join("model");
        fs::write(&path, &bytes).unwrap();
        let told = std::cell::RefCell::new(Vec::new());
        Scene::open_with(&path, &|done, total| told.borrow_mut().push((done, total))).unwrap();
        let (told, length) = (told.into_inner(), bytes.len() as u64);
        assert!(told.iter().all(|&(_, total)| total == length) && told.is_sorted(), "{told:?}");
        assert_eq!(told.last(), Some(&(length, length)));
        assert!(told.len() as u64 > length >> 17, "{told:?}");
    }
}

/// Writes bytes in base64, with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |three: &[u8]| {
        let bits = three.iter().fold(0_u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - three.len()));
        let digit =
            |i: usize| if i > three.len() { '=' } else { char::from(DIGITS[(bits >> (18 - 6 * i)) as usize % 64]) };
        [0, 1, 2, 3].map(digit)
    };
    bytes.chunks(3).flat_map(group).collect()
}
