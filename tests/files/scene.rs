//! Tests of models: a file is loaded as it is written, and every bad file is refused with one line.

use glam::DVec3;
use hbao::Error;
use hbao::reference::trace::Tracer;
use hbao::scene::{Camera, Group, Mesh, Scene};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::Command;
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Loads `obj` from a folder of its own that also contains `files`, and returns the mesh and its notices. Of a path in
/// that folder only the name is left in a notice.
fn noticed(obj: impl AsRef<[u8]>, files: &[(&str, &[u8])]) -> Result<(Mesh, Vec<String>), Error> {
    let folder = TempDir::new().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let path = folder.path().join("model.obj");
    fs::write(&path, obj).unwrap();
    let (mesh, notices) = Mesh::load_obj(&path)?;
    let folders = [folder.path().canonicalize().unwrap(), folder.path().to_path_buf()];
    let shorter = |notice: String| folders.iter().fold(notice, |n, f| n.replace(&format!("{}/", f.display()), ""));
    Ok((mesh, notices.into_iter().map(shorter).collect()))
}

/// Loads `obj` beside `files`. There must be no notice.
fn load_beside(obj: impl AsRef<[u8]>, files: &[(&str, &str)]) -> Result<Mesh, Error> {
    let files: Vec<_> = files.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
    let (mesh, notices) = noticed(obj, &files)?;
    assert!(notices.is_empty(), "{notices:?}");
    Ok(mesh)
}

fn load(obj: impl AsRef<[u8]>) -> Mesh {
    load_beside(obj, &[]).unwrap()
}

/// Asserts that loading has failed with one line that contains each of `words`.
fn refused<T>(result: Result<T, Error>, words: &[&str]) {
    let Err(error) = result else { panic!("accepted, but it must be refused for: {words:?}") };
    let message = error.to_string();
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.len() < 400, "{message}");
    for word in words {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
}

fn corners(mesh: &Mesh, triangle: &[u32; 3]) -> [DVec3; 3] {
    triangle.map(|i| mesh.positions[i as usize])
}

/// The sum of the triangles' areas as vectors, which is zero if windings cancel.
fn area_vector(mesh: &Mesh) -> DVec3 {
    mesh.triangles.iter().map(|t| corners(mesh, t)).map(|[a, b, c]| (b - a).cross(c - a) / 2.0).sum()
}

/// The sum of the triangles' areas, whatever their winding.
fn area(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|t| corners(mesh, t)).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

fn colours(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.groups.iter().map(|group| group.colour).collect()
}

#[test]
fn each_bad_number_is_named_with_its_line() {
    for bad in ["nan", "NaN", "inf", "-inf", "infinity", "1e400", "-1e999"] {
        refused(load_beside(format!("{TRIANGLE}v 0 {bad} 0\n"), &[]), &["line 5", bad, "finite"]);
    }
    for bad in ["1,5", "x", "1.0D5", "--1", "0x10"] {
        refused(load_beside(format!("v {bad} 0 0\n{TRIANGLE}"), &[]), &["line 1", bad, "not a number"]);
    }
    for huge in ["1.1e15", "-1e300"] {
        refused(load_beside(format!("v 0 0 {huge}\n{TRIANGLE}"), &[]), &["line 1", huge, "1e15"]);
    }
    refused(load_beside(format!("{TRIANGLE}v 1 2\n"), &[]), &["line 5", "three numbers"]);
}

#[test]
fn each_bad_index_is_named_with_its_line() {
    let extremes = ["4", "-4", "0", "9223372036854775807", "-9223372036854775808"];
    for bad in extremes {
        refused(load_beside(format!("{TRIANGLE}\nf 1 2 {bad}\n"), &[]), &["line 6", bad, "3 v lines"]);
    }
    for bad in ["99999999999999999999", "1.5", "a", "//", "/1/", "1/1/1/1", "1,2"] {
        refused(load_beside(format!("{TRIANGLE}f 1 2 {bad}\n"), &[]), &["line 5", bad]);
    }
    // Forward references are refused too, because only the lines before a face are counted.
    refused(load_beside("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", &[]), &["line 1", "0 v lines"]);
}

#[test]
fn extreme_texture_indices_are_harmless() {
    for vt in ["9223372036854775807", "-9223372036854775808", "0", "5"] {
        assert_eq!(load(format!("vt 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/{vt} 2/{vt} 3/{vt}\n")).triangles.len(), 1);
    }
}

#[test]
fn files_without_faces_are_refused() {
    let mut junk: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2654435761) >> 13) as u8).collect();
    junk[0] = 0x89;
    let capital = load_beside("V 0 0 0\nV 1 0 0\nV 0 1 0\nF 1 2 3\n", &[]);
    refused(capital, &["holds no faces, only statements in capital letters: write f for F"]);
    let no_faces: [&[u8]; 4] = [b"\n\n", b"# only\n# comments", &junk, &[0xff; 99]];
    for bytes in no_faces {
        refused(load_beside(bytes, &[]), &["model.obj: holds no faces", "give an OBJ file with polygons"]);
    }
    for (text, what) in [
        ("", "is empty; give an OBJ file with polygons"),
        ("v 0 0 0\n", "holds no faces, only positions"),
        ("v 0 0 0\nf 1\nf 1 1\nf\np 1\nl 1 1 1\n", "holds no faces, only points and lines"),
        ("v 0 0 0\nl 1 1\n", "holds no faces, only points and lines"),
        ("v 0 0 0\ncstype bspline\nsurf 0 1 0 1 1 1 1 1\n", "holds no faces, only curved surfaces"),
        ("# x\nnewmtl a\nKd 1 0 0\n", "holds no faces, only materials"),
        ("v\0\0\0", "holds no faces, but bytes that are no text"),
    ] {
        refused(load_beside(text, &[]), &["model.obj: ", what]);
    }
}

#[test]
fn a_file_of_another_format_is_called_what_it_is_and_the_message_says_what_to_do() {
    let convert =
        "and only OBJ, PLY, STL and glTF are read: convert it to one of them, for example with Blender or MeshLab";
    let open = "and Mesh::load_obj reads only OBJ: open it with Scene::open";
    let unpack = "and only OBJ, PLY, STL and glTF are read: unpack it and give the file inside";
    let utf8 = "and only UTF-8 is read: save it as UTF-8";
    let numbers = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let stl = |header: &[u8]| {
        let facet = [numbers(&[0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 7.]), vec![0, 0]].concat();
        [header, &vec![b' '; 80 - header.len()], &2_u32.to_le_bytes(), &facet, &facet].concat()
    };
    let utf16 = |text: &str, bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nend_header\nv\nf 1 2 x\n";
    let inside = [b"PK\x03\x04".as_slice(), &[0; 26], b"model.obj", TRIANGLE.as_bytes()].concat();
    let cases: [(&[u8], &str, &str); 26] = [
        (ply.as_bytes(), "a PLY file", open),
        (b"ply\r\nformat ascii 1.0\r\n", "a PLY file", open),
        (b"solid part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n", "an STL file", open),
        (&stl(b"exported"), "an STL file", open),
        (&stl(b"solid exported\nv 1 2\n"), "an STL file", open),
        (b"{\"asset\":{\"version\":\"2.0\"}}", "a glTF file", open),
        (b"  {\n \"bufferViews\": [", "a glTF file", open),
        (b"{\"a\": 1}", "a JSON file", convert),
        (b"glTF\x02\0\0\0\x14\0\0\0", "a glTF file", open),
        (b"Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0", "an FBX file", convert),
        (b"; FBX 7.3.0 project file\n", "an FBX file", convert),
        (b"BLENDER-v293", "a Blender file", "export it from Blender"),
        (b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4\">", "a COLLADA file", convert),
        (b"<!DOCTYPE html>\n<html lang=en>", "a web page", "download the file itself"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "an OFF file", convert),
        (b"\x1f\x8b\x08\0\0\0\0\0", "a gzip archive", unpack),
        (&inside, "a zip archive", unpack), // it is not compressed, so that lines of the OBJ file stand in it
        (b"\x28\xb5\x2f\xfd\x04", "a Zstandard archive", unpack),
        (b"\xfd7zXZ\0\0", "an xz archive", unpack),
        (b"BZh91AY&SY", "a bzip2 archive", unpack),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "a PNG picture", "give the model"),
        (b"\xff\xd8\xff\xe0", "a JPEG picture", "give the model"),
        (b"version https://git-lfs.github.com/spec/v1\noid", "a pointer of Git LFS", "git lfs pull"),
        (&utf16(&format!("\u{feff}{TRIANGLE}"), u16::to_le_bytes), "text in UTF-16", utf8),
        (&utf16(&format!("\u{feff}{TRIANGLE}"), u16::to_be_bytes), "text in UTF-16", utf8),
        (&utf16(TRIANGLE, u16::to_le_bytes), "text in UTF-16", utf8),
    ];
    for (bytes, what, advice) in cases {
        refused(noticed(bytes, &[]), &[&format!("model.obj: this is {what}, "), advice]);
    }
    // What an OBJ file may begin with does not make it another format.
    for first in ["solid facet", "{", "<html", "OFF", "; FBX 7", "//Maya", "0\nsection"] {
        assert_eq!(load(format!("{first}\n{TRIANGLE}")), load(TRIANGLE), "{first}");
    }
    refused(load_beside(format!("solid\nv 0 0 x\n{TRIANGLE}"), &[]), &["line 2: \"x\" is not a number"]);
}

#[test]
fn folders_and_missing_files_are_refused() {
    let folder = TempDir::new().unwrap();
    refused(Mesh::load_obj(folder.path()), &["is a folder"]);
    refused(Mesh::load_obj(&folder.path().join("none.obj")), &["none.obj", "cannot be read"]);
    refused(Scene::open("no/such/model.obj"), &["no/such/model.obj", "no such file", "cornell-box or nave"]);
    refused(Scene::open(""), &["no such file", "cornell-box"]);
    refused(Scene::open("a\0b"), &["no such file"]);
}

#[test]
fn a_scene_from_a_file_brings_no_camera_and_no_radius() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("some model.obj");
    fs::write(&path, TRIANGLE).unwrap();
    let scene = Scene::open(path.to_str().unwrap()).unwrap();
    assert_eq!((scene.name.as_str(), scene.radius), ("some model", None));
    assert_eq!(scene.view, Default::default());
}

#[test]
fn spellings_of_the_same_triangle_load_the_same() {
    let expected = load(TRIANGLE);
    assert_eq!(expected.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(expected.triangles, [[0, 1, 2]]);
    let spellings = [
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "\u{feff}\u{feff}v 0 0 0\n\u{feff}v 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0 # origin\nv 1 0 0 #\n   v\t0  1 0\nf 1 2 3 # first\n",
        "v 0 \\\n 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 \\\n3\n",
        "# C:\\models\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0 0\nv 1 0 0 1\nv 0 1 0 2\nf 1 2 3\n",
        "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0 1 1 7\nf 1 2 3\n",
        "v 0 0 0 0.5 0.5\nv 1 0 0 x y z\nv 0 1 0 1 nan 1\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3\n",
        "o a\ng b\ns 1\nv 0 0 0\nv 1 0 0\nl 1 2 2\nv 0 1 0\np 1 2 3\nf 1 2 3\nl 1 2 3\ng empty\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1// 2/ 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\ng\nusemtl\nf 1 2 3\\",
        "g\no\ns off\nvt 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/ 2/1/ 3/9/\n\u{1a}",
    ];
    for text in spellings {
        assert_eq!(load(text), expected, "{text}");
        assert_eq!(load(text.replace('\n', "\r\n")), expected, "with CRLF: {text}");
        assert_eq!(load(text.replace('\n', "\r")), expected, "with CR: {text}");
    }
    let latin1 = [b"# caf\xe9\no \xff\n".as_slice(), TRIANGLE.as_bytes()].concat();
    assert_eq!(load(latin1), expected);
}

#[test]
fn positions_keep_float64() {
    let mesh = load("v 1000000.0000001 0 0\nv 1 1e15 0\nv 0 1 -1e15\nf 1 2 3\n");
    assert_eq!(mesh.positions[0].x, 1000000.0000001);
}

#[test]
fn concave_faces_keep_their_area_and_winding() {
    // These are outlines with their areas. A fan from the first corner would cover more than the outline, or area
    // outside it.
    let outlines: [(&[[f64; 2]], f64); 5] = [
        (&[[0., 0.], [4., 0.], [1., 1.], [0., 4.]], 4.0), // an arrowhead, which starts at each corner in turn below
        (&[[0., 0.], [4., 0.], [4., 4.], [2., 1.], [0., 4.]], 10.0),
        (&[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [3., 2.], [3., 3.], [0., 3.]], 7.0),
        (&[[0., 0.], [2., 0.], [3., 1.], [2., 2.], [0., 2.], [1., 1.]], 4.0),
        (&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [1., 2.], [0., 2.]], 4.0), // corners in a straight line
    ];
    let planes = [
        (DVec3::X, DVec3::Y),
        (DVec3::Y, DVec3::Z),
        (DVec3::Z, DVec3::X),
        (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.8, 0.0, -0.6)),
        (DVec3::new(2.0, -1.0, 2.0) / 3.0, DVec3::new(2.0, 2.0, -1.0) / 3.0),
    ];
    for (outline, expected) in outlines {
        for (across, up) in planes {
            for start in 0..outline.len() {
                for (reversed, scale, offset) in [(false, 1.0, 0.0), (true, 1.0, 1e6), (false, 1e-6, 0.0)] {
                    let mut points: Vec<DVec3> =
                        outline.iter().map(|[x, y]| (across * *x + up * *y) * scale + offset).collect();
                    points.rotate_left(start);
                    if reversed {
                        points.reverse();
                    }
                    let mut text: String =
                        points.iter().map(|p| format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z)).collect();
                    let face: String = (1..=points.len()).map(|i| format!(" {i}")).collect();
                    text += &format!("f{face}\n");
                    let mesh = load(&text);
                    let normal = across.cross(up) * if reversed { -1.0 } else { 1.0 };
                    let (facing, all) = (area_vector(&mesh).dot(normal) / scale.powi(2), area(&mesh) / scale.powi(2));
                    assert!((facing - expected).abs() < 1e-6, "{facing} of {expected}: {text}");
                    assert!((all - expected).abs() < 1e-6, "{all} of {expected}: {text}");
                }
            }
        }
    }
}

#[test]
fn a_large_face_keeps_its_area_where_it_is_concave_up_to_512_corners_or_convex() {
    for (corners, comb) in [(512, true), (513, false), (65_536, false)] {
        let point = |i: usize| {
            let angle = i as f64 / corners as f64 * std::f64::consts::TAU;
            let radius = if comb && i.is_multiple_of(2) { 1.0 } else { 2.0 };
            format!("v {} {} 0\n", radius * angle.cos(), radius * angle.sin())
        };
        let points: String = (0..corners).map(point).collect();
        let face: String = (1..=corners).map(|i| format!(" {i}")).collect();
        let radii = if comb { 2.0 } else { 4.0 };
        let expected = corners as f64 / 2.0 * radii * (std::f64::consts::TAU / corners as f64).sin();
        let mesh = load(format!("{points}f{face}\n"));
        assert_eq!(mesh.triangles.len(), corners - 2);
        assert!((area(&mesh) - expected).abs() < 1e-9, "{} of {expected}", area(&mesh));
        assert!((area_vector(&mesh).z - expected).abs() < 1e-9);
    }
}

#[test]
fn faces_without_area_are_harmless() {
    let points = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nv 1e-300 0 0\n";
    for face in ["1 1 1", "1 2 3", "1 2 3 4", "1 1 1 1", "1 2 3 4 5", "1 1 1 1 1 1", "5 4 3 2 1 2 3 4", "1 6 1 6 1"] {
        let mesh = load(format!("{points}f {face}\n"));
        assert_eq!(area(&mesh), 0.0, "{face}");
        assert!(mesh.vertex_normals().iter().all(|n| *n == DVec3::Y), "{face}");
    }
}

#[test]
fn faces_that_cross_themselves_and_faces_of_many_corners_do_not_panic() {
    let mut random = randomness();
    for corners in [4, 5, 6, 9, 30, 90, 300, 3000] {
        for grid in [2, 5, 1000] {
            let mut text = String::new();
            for _ in 0..corners {
                text += &format!("v {} {} {}\n", random(grid), random(grid), random(3));
            }
            text += "f";
            (1..=corners).for_each(|i| text += &format!(" {i}"));
            load(&text);
        }
    }
    // The corners go around five points, each time slightly beside them, so no two corners are equal. Clipping ears
    // would take minutes here.
    let beside =
        |i: usize| format!("v {} {:e} 0\n", [0, 4, 4, 2, 0][i % 5], [0., 0., 4., 1., 4.][i % 5] + i as f64 * 1e-13);
    let points: String = (0..65_536).map(beside).collect();
    let corners: String = (1..=65_536).map(|i| format!(" {i}")).collect();
    assert_eq!(load(format!("{points}f{corners}\n")).triangles.len(), 65_534);
    let many = format!("{TRIANGLE}f{}\n", " 1 2 3".repeat(30_000));
    refused(load_beside(many, &[]), &["line 5", "65536 corners"]);
}

#[test]
fn vertex_normals_come_from_the_file_or_from_the_triangles() {
    // Two triangles meet at a right angle, and the second is twice as large. Each has its own vertices on the common
    // edge.
    let bent = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 0 0\nv 0 0 1\nv 0 2 0\nf 1 2 3\nf 5 4 6\n";
    let normals = load(bent).vertex_normals();
    assert_eq!(normals.len(), 6);
    let shared = DVec3::new(2.0, 1.0, 0.0).normalize();
    for i in [0, 1, 3, 4] {
        assert!(normals[i].distance(shared) < 1e-15, "{}", normals[i]);
    }
    assert_eq!((normals[2], normals[5]), (DVec3::Y, DVec3::X));

    // These normals are from the file. They are normalised whatever their length, and each pair of position and normal
    // gives one vertex. A corner without a normal has that of its triangles.
    let given = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1e300 0 0\nvn 0 -1e-320 0\nvn 0 0 0\nf 1//1 2//2 3\nf 1//2 2//2 3//3\n";
    let (mesh, _) = noticed(given, &[]).unwrap();
    let found: Vec<_> = mesh.positions.iter().copied().zip(mesh.vertex_normals()).collect();
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    assert_eq!(found, [(o, x), (x, -y), (y, z), (o, -y), (y, z)]);
}

const MTL: &str = "newmtl red\nKd 1 0 0\nnewmtl none\nillum 2.0\nd -halo 0.5\nKa spectral a.rfl\nnewmtl a name #2\n\
    Kd 0.25 # grey\nnewmtl wild\nKd -1 7 0.5\n";

#[test]
fn a_mesh_cut_finer_is_the_same_surface() {
    let coarse = Scene::open("cornell-box").unwrap().mesh;
    let fine = coarse.subdivided();
    assert_eq!(fine.triangles.len(), 4 * coarse.triangles.len());
    assert_eq!(fine.bounds(), coarse.bounds());
    assert!((area(&fine) / area(&coarse) - 1.0).abs() < 1e-12);
    for (before, after) in coarse.groups.iter().zip(&fine.groups) {
        assert_eq!((before.colour, 4 * before.triangles.end), (after.colour, after.triangles.end));
    }
    let cross = |mesh: &Mesh, triangle: &[u32; 3]| {
        let [a, b, c] = corners(mesh, triangle);
        (b - a).cross(c - a)
    };
    for (i, triangle) in coarse.triangles.iter().enumerate() {
        let whole = cross(&coarse, triangle);
        for part in &fine.triangles[4 * i..4 * i + 4] {
            // Each part has a quarter of the triangle's area and the same winding.
            assert!((4.0 * cross(&fine, part) - whole).length() <= 1e-9 * whole.length());
        }
    }
    // Two triangles share a side, so there are 4 corners and 5 sides.
    let square = load("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nf 1//1 2//1 3//1 4//1\n").subdivided();
    assert_eq!((square.positions.len(), square.triangles.len()), (9, 8));
    assert!(square.vertex_normals().iter().all(|&n| n == DVec3::Z));
}

#[test]
fn materials_give_colours_and_triangles_are_sorted_by_them() {
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nusemtl red\nf 2 3 4\nf 1 2 4\n\
        usemtl a name #2\nf 1 3 4\ng x\nusemtl\tred\nf 3 2 1\nusemtl wild\nusemtl none\nf 4 3 2\n";
    let files: &[(&str, &[u8])] = &[("m.mtl", MTL.as_bytes())];
    let bright = "m.mtl: line 10: Kd is above 1; it is taken as 1; write colours from 0 to 1";
    let (mesh, notices) = noticed(obj, files).unwrap();
    assert_eq!(notices, [bright]);
    let (white, red) = ([1.0; 3], [1.0, 0.0, 0.0]);
    let group = |colour, triangles| Group { colour, triangles };
    assert_eq!(mesh.groups, [group(white, 0..2), group(red, 2..5), group([0.25; 3], 5..6)]);
    assert_eq!(corners(&mesh, &mesh.triangles[0]), [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(corners(&mesh, &mesh.triangles[4]), [DVec3::Y, DVec3::X, DVec3::ZERO]);

    let (clamped, notices) = noticed(format!("mtllib m.mtl\r\nusemtl wild\r\n{TRIANGLE}"), files).unwrap();
    assert_eq!((colours(&clamped), notices), (vec![[0.0, 1.0, 0.5]], vec![bright.into()]));
}

#[test]
fn a_bad_normal_is_no_normal_and_is_told_with_count_and_first_line() {
    let same_as_without = load(TRIANGLE).vertex_normals();
    let replaced = "the triangles give the normal there";
    let nan = "is not a finite number";
    for (vn, what) in [
        ("vn nan 0 0", &format!("\"nan\" {nan}")),
        ("vn 0 -inf 0", &format!("\"-inf\" {nan}")),
        ("vn 0 0 1e999", &format!("\"1e999\" {nan}")),
        ("vn -nan(ind) 0 0", &"\"-nan(ind)\" is not a number".to_string()),
        ("vn 1,0 0 0", &"\"1,0\" is not a number; write a decimal point".to_string()),
        ("vn 0 1", &"vn needs three numbers".to_string()),
        ("vn", &"vn needs three numbers".to_string()),
        ("vn 0 -0 0.0", &"this vn has no length".to_string()),
    ] {
        let obj = format!("{vn}\nvn 0 0 -2\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//2\n");
        let (mesh, notices) = noticed(obj, &[]).unwrap();
        assert_eq!(notices, [format!("model.obj: line 1: {what}; {replaced}")]);
        // The next normal keeps its index.
        assert_eq!(mesh.vertex_normals(), [DVec3::Z, DVec3::Z, -DVec3::Z], "{vn}");
    }
    for bad in ["4", "-4", "0", "9223372036854775807", "-9223372036854775808", "99999999999999999999", "x", "1.0"] {
        let (mesh, notices) = noticed(format!("{TRIANGLE}f 1//{bad} 2//{bad} 3//{bad}\n"), &[]).unwrap();
        let [notice] = &notices[..] else { panic!("{bad}: {notices:?}") };
        assert!(notice.starts_with("model.obj: line 5: ") && notice.contains(bad), "{notice}");
        assert!(notice.ends_with(&format!(" (the first of 3 such corners); {replaced}")), "{notice}");
        assert_eq!((mesh.triangles.len(), mesh.vertex_normals()), (2, same_as_without.clone()), "{bad}");
    }
    // Several lines and both kinds make one notice for each kind.
    let both = format!("{TRIANGLE}vn x\nvn 0 0 0\nvn 0 0 1\nvn\nf 1//1 2//9 3//3\n");
    let expected = [
        format!("model.obj: line 5: \"x\" is not a number (the first of 3 such normals); {replaced}"),
        format!("model.obj: line 9: index 9 is out of range; 4 vn lines stand before it, counted from 1; {replaced}"),
    ];
    assert_eq!(noticed(both, &[]).unwrap().1, expected);
}

#[test]
fn an_unknown_material_is_white_and_is_told() {
    let files: &[(&str, &[u8])] = &[("m.mtl", MTL.as_bytes())];
    let white = "its triangles are white";
    let two = " (the first of 2 such materials)";
    for (head, notice) in [
        ("usemtl red\n", format!("model.obj: line 1: no material file defines \"red\"; {white}")),
        (
            "mtllib m.mtl\nusemtl red\nusemtl blue\n",
            format!("model.obj: line 3: no material file defines \"blue\"; {white}"),
        ),
        (
            "usemtl blue\nusemtl green\nmtllib m.mtl\nusemtl blue\n",
            format!("model.obj: line 1: no material file defines \"blue\"{two}; {white}"),
        ),
    ] {
        let (mesh, notices) = noticed(format!("{head}{TRIANGLE}"), files).unwrap();
        assert_eq!((colours(&mesh), notices), (vec![[1.0; 3]], vec![notice]));
    }
    // A usemtl without a name means no material.
    assert_eq!(noticed(format!("mtllib m.mtl\nusemtl\n{TRIANGLE}"), files).unwrap().1, [""; 0]);
}

#[test]
fn textures_colours_above_1_and_faces_of_two_corners_are_told() {
    let mtl = "newmtl a\nKd 200 30 30\nmap_Kd wood.png\nnewmtl unused\nKd 9 9 9\nmap_Kd wall.png\n";
    let files: &[(&str, &[u8])] = &[("m.mtl", mtl.as_bytes())];
    let (mesh, notices) = noticed(format!("mtllib m.mtl\nusemtl a\n{TRIANGLE}f 1 2\nf 3\n"), files).unwrap();
    assert_eq!(colours(&mesh), [[1.0; 3]]);
    let expected = [
        "model.obj: line 7: a face needs 3 corners (the first of 2 such faces); it is left out",
        "m.mtl: line 2: Kd is above 1; it is taken as 1; write colours from 0 to 1",
        "m.mtl: line 3: texture \"wood.png\" is not beside the model; its material has the colour of Kd",
    ];
    let told = |line: &str| notices.iter().any(|notice| notice.ends_with(line));
    assert!(notices.len() == 3 && expected.iter().all(|line| told(line)), "{notices:?}");
}

#[test]
fn quotes_around_names_and_comments_right_after_numbers_are_no_part_of_them() {
    let files: &[(&str, &[u8])] = &[("m.mtl", b"newmtl wire 1\nKd 1 0 0#red\n")];
    let obj = "mtllib \"m.mtl\"\nv 0 0 0#origin\nv 1 0 0\nv 0 1 0\nusemtl \"wire 1\"\nf 1 2 3#first\n";
    let (mesh, notices) = noticed(obj, files).unwrap();
    assert_eq!((colours(&mesh), notices), (vec![[1.0, 0.0, 0.0]], vec![]));
}

#[test]
fn one_or_several_material_files_are_found_in_the_folder() {
    let files =
        [("a.mtl", "newmtl a\nKd 0 0 1"), ("b c.mtl", "newmtl a\nKd 1 1 0\nnewmtl b\nKd 0 1 0"), ("sub/d.MTL", MTL)];
    let colour = |head: &str| colours(&load_beside(format!("{head}\n{TRIANGLE}"), &files).unwrap())[0];
    assert_eq!(colour("mtllib a.mtl\nmtllib b c.mtl\nusemtl b"), [0.0, 1.0, 0.0]);
    assert_eq!(colour("mtllib a.mtl\nmtllib a.mtl\nmtllib b c.mtl\nusemtl a"), [0.0, 0.0, 1.0]);
    assert_eq!(colour("mtllib ./a.mtl sub/d.MTL\nusemtl red"), [1.0, 0.0, 0.0]);
    assert_eq!(colour("mtllib sub\\d.MTL\nusemtl red"), [1.0, 0.0, 0.0]);
}

#[test]
fn a_material_file_is_found_beside_the_model_by_the_last_part_of_its_name() {
    let files = [("foo bar.mtl", "newmtl a\nKd 1 0 0"), ("b.mtl", "newmtl a\nKd 0 1 0\nnewmtl b\nKd 0 0 1")];
    for name in [
        "foo bar.mtl",
        "./foo bar.mtl",
        ".\\foo bar.mtl  ",
        "\"foo bar.mtl\"",
        "\"C:\\Users\\A B\\models\\foo bar.mtl\"",
        "C:\\Users\\A B\\models\\foo bar.mtl\r",
        "C:/Users/A B/foo bar.mtl",
        "\\\\server\\share\\foo bar.mtl",
        "/home/somebody/foo bar.mtl",
        "../textures/foo bar.mtl",
        "materials/foo bar.mtl",
        "Foo Bar.MTL",
        "D:\\FOO BAR.mtl",
        "b.mtl/../foo bar.mtl",
        "foo bar.mtl # walls",
        "./FOO bar.mtl\t#walls # b",
    ] {
        let mesh = load_beside(format!("mtllib {name}\nusemtl a\n{TRIANGLE}"), &files).unwrap();
        assert_eq!(colours(&mesh), [[1.0, 0.0, 0.0]], "{name}");
    }
    // These are several names, each of which may have a folder.
    for (names, colour) in [("b.mtl C:\\x\\b.mtl", [0.0, 1.0, 0.0]), ("x/B.MTL ../b.mtl", [0.0, 1.0, 0.0])] {
        let mesh = load_beside(format!("mtllib {names}\nusemtl a\n{TRIANGLE}"), &files).unwrap();
        assert_eq!(colours(&mesh), [colour], "{names}");
    }
    let some: &[(&str, &[u8])] = &[("b.mtl", b"newmtl b\nKd 0 0 1")];
    let (mesh, notices) = noticed(format!("mtllib none.mtl b.mtl\nusemtl b\n{TRIANGLE}"), some).unwrap();
    assert_eq!(colours(&mesh), [[0.0, 0.0, 1.0]]);
    assert_eq!(
        notices,
        ["model.obj: line 1: material file \"none.mtl\" is not beside the model; its materials are white"]
    );
    // A name in another case counts only if it is one file's.
    #[cfg(target_os = "linux")]
    {
        let two: &[(&str, &[u8])] = &[("A.mtl", b"newmtl b\nKd 0 0 1"), ("a.MTL", b"newmtl b\nKd 0 1 0")];
        let (mesh, notices) = noticed(format!("mtllib a.mtl\nusemtl b\n{TRIANGLE}"), two).unwrap();
        assert_eq!((colours(&mesh), notices.len()), (vec![[1.0; 3]], 1), "{notices:?}");
    }
}

#[test]
#[cfg(unix)]
fn names_that_are_not_utf8_are_bytes_and_stay_apart() {
    use std::os::unix::ffi::OsStrExt;
    let folder = TempDir::new().unwrap();
    let file = |name: &[u8]| folder.path().join(std::ffi::OsStr::from_bytes(name));
    fs::write(file(b"caf\xe9.mtl"), b"newmtl \xe8\nKd 1 0 0\nnewmtl \xe9\nKd 0 1 0\n").unwrap();
    fs::write(file("h\u{e9}.mtl".as_bytes()), "newmtl h\nKd 0 0 1\n").unwrap();
    // The names of the second file and of its material are the same letters in UTF-8 and in Latin-1.
    let obj = [b"mtllib caf\xe9.mtl\nmtllib h\xe9.mtl\n".as_slice(), TRIANGLE.as_bytes()].concat();
    let obj = [&obj, b"usemtl \xe8\nf 1 2 3\nusemtl \xe9 \nf 1 2 3\nusemtl h\nf 1 2 3".as_slice()].concat();
    let model = file(b"mod\xe8le.obj");
    fs::write(&model, obj).unwrap();
    let scene = Scene::open(&model).unwrap();
    assert_eq!(colours(&scene.mesh), [[1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!((scene.name.as_str(), scene.notices.len()), ("mod\u{fffd}le", 0), "{:?}", scene.notices);
    let missing = [b"mtllib \xfc\n".as_slice(), TRIANGLE.as_bytes()].concat();
    assert!(noticed(missing, &[]).unwrap().1[0].contains("line 1: material file \"\u{fffd}\" is not beside"));
    refused(Scene::open(file(b"\xff.obj")), &["\u{fffd}.obj: no such file"]);
}

#[test]
fn a_bad_material_file_is_white_and_is_told_once_with_count_and_first_line() {
    let colour = "its material is white";
    let library = "its materials are white";
    let bad: [(&[u8], String); 13] = [
        (b"\n\nKd 1 1 1\n", format!("line 3: Kd belongs after a newmtl; {colour}")),
        (b"newmtl a\nKd nan 0 0\n", format!("line 2: \"nan\" is not a finite number; {colour}")),
        (b"newmtl a\nKd 0 1e999 0\n", format!("line 2: \"1e999\" is not a finite number; {colour}")),
        (b"newmtl a\nKd 1 1\n", format!("line 2: Kd needs three numbers, red green blue; {colour}")),
        (b"newmtl a\nKd\n", format!("line 2: Kd needs three numbers, red green blue; {colour}")),
        (b"newmtl a\nKd 0,5 0,5 0,5\n", format!("line 2: \"0,5\" is not a number; write a decimal point; {colour}")),
        (
            b"newmtl a\nKd spectral a.rfl 1\n",
            format!("line 2: Kd spectral is not read, only Kd red green blue; {colour}"),
        ),
        (b"newmtl a\nKd xyz 1 1 1\n", format!("line 2: Kd xyz is not read, only Kd red green blue; {colour}")),
        (
            b"newmtl a\rKd x\rnewmtl b\rKd 1 2\rKd y\r",
            format!("line 2: \"x\" is not a number (the first of 3 such colours); {colour}"),
        ),
        (b"\xff\xfen\0e\0w\0", format!("this is text in UTF-16, and only UTF-8 is read: save it as UTF-8; {library}")),
        (b"\x89PNG\r\n\x1a\n", format!("this is a PNG picture, and not MTL; {library}")),
        (
            &[b' '; 3 << 20],
            format!("line 1: more than 2097152 bytes on one line; give a text file, OBJ or MTL; {library}"),
        ),
        (b"newmtl\nKd 1 0 0\n", String::new()),
    ];
    for (mtl, notice) in bad {
        let (mesh, notices) = noticed(format!("mtllib m.mtl\n{TRIANGLE}"), &[("m.mtl", mtl)]).unwrap();
        let expected = if notice.is_empty() { vec![] } else { vec![format!("m.mtl: {notice}")] };
        assert_eq!((colours(&mesh), notices), (vec![[1.0; 3]], expected));
    }
    // The other colours of the file are read.
    let mtl = b"newmtl b\nKd x\nnewmtl a\nKd 1 0 0\n".as_slice();
    let (mesh, notices) = noticed(format!("mtllib m.mtl\nusemtl a\n{TRIANGLE}"), &[("m.mtl", mtl)]).unwrap();
    assert_eq!((colours(&mesh), notices.len()), (vec![[1.0, 0.0, 0.0]], 1));

    let told = |head: &str, files: &[(&str, &[u8])]| {
        let (mesh, notices) = noticed(format!("{head}\nusemtl a\n{TRIANGLE}"), files).unwrap();
        assert_eq!(colours(&mesh), [[1.0; 3]], "{head}");
        let [notice] = <[String; 1]>::try_from(notices).unwrap_or_else(|notices| panic!("{head}: {notices:?}"));
        notice
    };
    let missing = "material file \"m.mtl\" is not beside the model";
    assert_eq!(told("mtllib m.mtl", &[]), format!("model.obj: line 1: {missing}; {library}"));
    assert_eq!(
        told("\nmtllib m.mtl\nmtllib n.mtl", &[]),
        format!("model.obj: line 2: {missing} (the first of 2 such material files); {library}")
    );
    assert_eq!(told("mtllib", &[]), format!("model.obj: line 1: mtllib names no file; {library}"));
    assert_eq!(
        told("mtllib sub", &[("sub/m.mtl", MTL.as_bytes())]),
        format!("model.obj: line 1: material file \"sub\" is not a file; {library}")
    );
    for name in ["..", ".", "/", "C:\\", "a\0b", "\u{1b}[2J", &"x".repeat(70_000)] {
        let notice = told(&format!("mtllib {name}"), &[]);
        assert!(notice.starts_with("model.obj: line 1: material file \"") && notice.len() < 300, "{notice}");
        assert!(!notice.contains(char::is_control), "{notice:?}");
    }
    let many: String = (0..300).map(|i| format!("mtllib {i}.mtl\n")).collect();
    let (_, notices) = noticed(format!("{many}\nusemtl a\n{TRIANGLE}"), &[]).unwrap();
    let first = "material file \"0.mtl\" is not beside the model (the first of 200 such material files)";
    let excess = "this is material file 201, and only 200 are read: join them (the first of 100 such material files)";
    assert_eq!(
        notices,
        [format!("model.obj: line 1: {first}; {library}"), format!("model.obj: line 201: {excess}; {library}")]
    );
}

#[test]
fn material_files_outside_the_models_folder_are_not_opened() {
    let folder = TempDir::new().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    fs::write(folder.path().join("secret.mtl"), MTL).unwrap();
    let model = inside.join("model.obj");
    let load = |name: &str| {
        fs::write(&model, format!("mtllib {name}\nusemtl red\n{TRIANGLE}")).unwrap();
        let (mesh, notices) = Mesh::load_obj(&model).unwrap();
        (colours(&mesh)[0], notices.concat())
    };
    let white = |name: &str, why: &str| {
        let (colour, notice) = load(name);
        assert_eq!(colour, [1.0; 3], "{name}");
        assert!(notice.contains("line 1") && notice.contains(why), "{name}: {notice}");
    };
    let red = |name: &str| assert_eq!(load(name), ([1.0, 0.0, 0.0], String::new()), "{name}");
    let absolute = folder.path().join("secret.mtl");
    let outside =
        ["../secret.mtl", "..\\secret.mtl", "a/../../secret.mtl", "C:\\secret.mtl", absolute.to_str().unwrap()];
    for name in outside {
        white(name, "secret.mtl\" is not beside the model");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&absolute, inside.join("link.mtl")).unwrap();
        std::os::unix::fs::symlink(folder.path(), inside.join("sub")).unwrap();
        white("link.mtl", "leads out of the model's folder");
        white("LINK.mtl", "leads out of the model's folder");
        white("sub/secret.mtl", "leads out of the model's folder");
        // Opening a pipe would wait for ever, and a device may never end.
        assert!(Command::new("mkfifo").arg(inside.join("pipe.mtl")).status().unwrap().success());
        white("pipe.mtl", "is not a file");
        white("../x/PIPE.mtl", "is not a file");
        std::os::unix::fs::symlink("/dev/zero", inside.join("zero.mtl")).unwrap();
        white("zero.mtl", "leads out of the model's folder");
        fs::write(inside.join("m.mtl"), MTL).unwrap();
        std::os::unix::fs::symlink("m.mtl", inside.join("alias.mtl")).unwrap();
        red("alias.mtl");
        // Some package stores make a folder of links to a model and its material.
        let links = folder.path().join("links");
        fs::create_dir(&links).unwrap();
        red("m.mtl");
        for name in ["model.obj", "m.mtl"] {
            std::os::unix::fs::symlink(inside.join(name), links.join(name)).unwrap();
            let (mesh, notices) = Mesh::load_obj(&links.join("model.obj")).unwrap();
            assert_eq!((colours(&mesh)[0], notices.len()), ([1.0, 0.0, 0.0], 0));
        }
    }
    // The file of that name beside the model is read in place of the one outside.
    fs::write(inside.join("secret.mtl"), MTL).unwrap();
    outside.into_iter().for_each(red);
}

#[test]
fn damaged_files_load_or_are_refused_in_one_line() {
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1e2 0\nv -1.5 1 0 1 1 1\nvn 0 0 1\nvt 0 0\ng a\nusemtl b\n\
        f 1/1/1 2//1 3 \\\n 4\nf -1 -2 -3 -4 1 2\r\nl 1 2\n";
    let mtl = "newmtl b\nKd 0.5 1 0\nKd 1\nillum 2\n# x\nnewmtl c d\nKd 1e3 0 -1";
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("model.obj");
    let mut random = randomness();
    let (mut loaded, mut not) = (0, 0);
    for _ in 0..1000 {
        let mut damaged = |text: &str| {
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..random(4) {
                let at = random(bytes.len() as u64) as usize;
                match random(3) {
                    0 => bytes[at] = random(256) as u8,
                    1 => bytes.insert(at, b"0123456789-/ \n\\.efnv#"[random(21) as usize]),
                    _ => drop(bytes.remove(at)),
                }
            }
            bytes
        };
        fs::write(&path, damaged(obj)).unwrap();
        fs::write(folder.path().join("m.mtl"), damaged(mtl)).unwrap();
        match Mesh::load_obj(&path) {
            Ok((mesh, notices)) => {
                loaded += 1;
                assert!(notices.len() <= 9 && notices.iter().all(|notice| notice.lines().count() == 1), "{notices:?}");
                assert!(mesh.vertex_normals().iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
            }
            error => {
                not += 1;
                refused(error, &[]);
            }
        }
    }
    assert!(loaded > 100 && not > 100, "{loaded} loaded, {not} refused: too little or too much damage");
}

/// Returns a function that gives a fixed sequence of numbers, each below its argument.
fn randomness() -> impl FnMut(u64) -> u64 {
    let mut state = 1_u64;
    move |below| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) % below
    }
}

#[test]
fn a_mesh_made_in_code_is_checked() {
    let points = || vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    refused(Mesh::new(points(), vec![]), &["at least one triangle"]);
    refused(Mesh::new(points(), vec![[0, 1, 3]]), &["triangle 0", "3 positions"]);
    refused(Mesh::new(vec![DVec3::NAN; 3], vec![[0, 1, 2]]), &["position 0", "finite"]);
    refused(Mesh::new(vec![DVec3::splat(2e15); 3], vec![[0, 1, 2]]), &["position 0", "1e15"]);
    let mesh = Mesh::new(points(), vec![[0, 1, 2]]).unwrap();
    let group = |colour, triangles| vec![Group { colour, triangles }];
    refused(mesh.clone().with_groups(vec![]), &["groups cover 0 of 1"]);
    refused(mesh.clone().with_groups(group([0.5; 3], 0..2)), &["groups cover 2 of 1"]);
    refused(mesh.clone().with_groups(group([f32::NAN; 3], 0..1)), &["[0, 1]"]);
    refused(mesh.clone().with_normals(vec![DVec3::X]), &["one finite normal"]);
    assert_eq!(mesh.bounds(), (DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(mesh.diagonal(), 2_f64.sqrt());
}

#[test]
fn the_cornell_box_has_the_published_measurements() {
    let scene = Scene::open("cornell-box").unwrap();
    let mesh = &scene.mesh;
    assert_eq!(mesh.bounds(), (DVec3::ZERO, DVec3::new(556.0, 548.8, 559.2)));
    assert_eq!(mesh.triangles.len(), 38);
    assert_eq!(scene.radius, Some(150.0));

    // The publication gives the blocks only by their corners. To within two millimetres these make squares and boxes:
    // about 165 x 165 x 165 and 165 x 330 x 165, turned by about 18 and 17 degrees.
    let top = |height: f64| {
        let mut found: Vec<DVec3> = mesh.positions.iter().copied().filter(|p| p.y == height).collect();
        found.sort_by(|a, b| a.x.total_cmp(&b.x));
        found.dedup();
        found
    };
    for height in [165.0, 330.0] {
        let corners = top(height);
        assert_eq!(corners.len(), 4);
        for (a, b) in [(0, 1), (0, 2), (1, 3), (2, 3)] {
            let side = corners[a].distance(corners[b]);
            assert!((side - 166.0).abs() < 2.0, "{side} at {height}");
        }
        // Each block stands on the floor.
        for corner in corners {
            assert!(mesh.positions.contains(&corner.with_y(0.0)));
        }
    }

    // Every face of the room faces its inside, and every face of a block faces away from the block's axis.
    let (room, short, tall) =
        (DVec3::new(278.0, 274.0, 280.0), DVec3::new(186.0, 82.5, 169.0), DVec3::new(368.5, 165.0, 351.5));
    let mut areas: HashMap<&str, f64> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = corners(mesh, triangle);
        let normal = (b - a).cross(c - a);
        let middle = (a + b + c) / 3.0;
        let near = |centre: DVec3| (middle - centre).with_y(0.0).length() < 120.0 && middle.y <= 2.0 * centre.y;
        let on_floor = a.y.max(b.y).max(c.y) == 0.0;
        let (part, away_from) = match () {
            _ if near(short) && !on_floor => ("short", short),
            _ if near(tall) && !on_floor => ("tall", tall),
            _ if (a.y + b.y + c.y) / 3.0 > 548.0 => ("ceiling", room),
            _ => ("walls", room),
        };
        let outward = normal.dot(middle - away_from);
        assert!(if away_from == room { outward < 0.0 } else { outward > 0.0 }, "{part}: {a} {b} {c}");
        *areas.entry(part).or_default() += normal.length() / 2.0;
    }
    // The light fills its opening, so together they cover the whole ceiling exactly once.
    assert!((areas["ceiling"] - 556.0 * 559.2).abs() < 1e-6);
    for (part, height) in [("short", 165.0), ("tall", 330.0)] {
        let expected = 166.0 * 166.0 + 4.0 * 166.0 * height;
        assert!((areas[part] / expected - 1.0).abs() < 0.01, "{part}: {}", areas[part]);
    }
    // The colours are white, red on the left of the picture, green on the right, and the light.
    assert_eq!(colours(mesh), [[0.73; 3], [0.63, 0.065, 0.05], [0.14, 0.45, 0.091], [0.78; 3]]);
    let x_of = |group: usize| mesh.triangles[mesh.groups[group].triangles.start].map(|i| mesh.positions[i as usize].x);
    assert!(x_of(1).iter().all(|x| *x > 549.0) && x_of(2).iter().all(|x| *x == 0.0));
    // The shipped file must equal the built-in scene.
    assert_eq!(Mesh::load_obj(&shipped("cornell_box.obj")).unwrap(), (mesh.clone(), Vec::new()));
}

/// Returns the nave, the camera for a picture of it, and the direction through the middle of each pixel.
fn nave(width: u32, height: u32) -> (Mesh, Camera, Vec<DVec3>) {
    let Scene { mesh, view, .. } = Scene::open("nave").unwrap();
    let (camera, notices) = view.camera(&mesh, width, height).unwrap();
    assert_eq!(notices, [""; 0]);
    let direction = |i: u32| {
        let (u, v) = (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        let r = camera.ray(u / f64::from(width), v / f64::from(height)).1;
        r.x * camera.right + r.y * camera.up + r.z * camera.forward
    };
    let directions = (0..width * height).map(direction).collect();
    (mesh, camera, directions)
}

/// Returns every hit along a ray, with the nearest first.
fn hits(tracer: &Tracer, origin: DVec3, direction: DVec3, end: f64) -> Vec<hbao::reference::trace::Hit> {
    let mut start = 0.0;
    std::iter::from_fn(|| {
        let hit = tracer.nearest(origin, direction, start..=end)?;
        start = hit.t + 1e-6;
        Some(hit)
    })
    .collect()
}

#[test]
fn the_nave_is_as_large_as_said_and_the_same_everywhere() {
    let scene = Scene::open("nave").unwrap();
    let mesh = &scene.mesh;
    assert_eq!((scene.name.as_str(), scene.radius), ("nave", Some(1.5)));
    assert!((15_000..=25_000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
    assert_eq!(mesh.groups.len(), 8);
    assert!(mesh.groups.iter().all(|group| !group.triangles.is_empty()));
    let (low, high) = mesh.bounds();
    assert!((high - low - DVec3::new(38.62, 14.35, 17.0)).abs().max_element() < 1e-9, "{low} {high}");
    assert_eq!(mesh, &Scene::open("nave").unwrap().mesh);
    // This is the FNV-1a hash of every bit. It must be the same on every platform.
    let coordinates = mesh.positions.iter().flat_map(|p| p.to_array()).map(f64::to_bits);
    let words = coordinates.chain(mesh.triangles.iter().flatten().map(|&i| u64::from(i)));
    let hash = words
        .flat_map(u64::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    assert_eq!(hash, 0x6b46_1357_c727_b919, "{hash:#x}");
}

#[test]
fn the_nave_has_no_sliver_and_no_two_faces_in_one_place() {
    let (mesh, ..) = nave(1, 1);
    let tracer = Tracer::new(&mesh);
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = corners(&mesh, triangle);
        let doubled_area = (b - a).cross(c - a);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        assert!(doubled_area.length() / longest > 1e-3, "triangle {i} is a sliver: {a} {b} {c}");
        // Rays pass through points of the triangle, from a millimetre on one side to a millimetre on the other.
        let n = doubled_area.normalize();
        for [u, v, w] in [[1.0, 1.0, 1.0], [8.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 1.0, 8.0]] {
            let point = (u * a + v * b + w * c) / (u + v + w);
            for hit in hits(&tracer, point - 1e-3 * n, n, 2e-3) {
                let [d, e, f] = corners(&mesh, &mesh.triangles[hit.triangle]);
                let parallel = (e - d).cross(f - d).normalize().dot(n).abs();
                assert!(hit.triangle == i || parallel < 0.999, "two faces at {point}, {i} and {}", hit.triangle);
            }
        }
    }
}

#[test]
fn the_nave_is_closed() {
    let (mesh, camera, directions) = nave(64, 48);
    let tracer = Tracer::new(&mesh);
    for &direction in &directions {
        assert!(tracer.nearest(camera.eye, direction, camera.near..=camera.far).is_some(), "open to {direction}");
    }
    // There is no gap from other places either: in the nave high and low, in an aisle, the choir and the apse.
    for eye in
        [[-10.0, 1.0, 0.3], [-3.0, 12.0, 1.0], [6.2, 5.0, 6.0], [-19.0, 2.0, -6.0], [10.0, 8.0, -1.0], [15.0, 5.0, 0.7]]
    {
        for i in 0..20_000 {
            // The directions are distributed evenly over the sphere by the golden angle.
            let (y, turn) = (1.0 - (f64::from(i) + 0.5) / 10_000.0, f64::from(i) * 2.399963229728653);
            let across = (1.0 - y * y).sqrt();
            let direction = DVec3::new(across * turn.cos(), y, across * turn.sin());
            assert!(tracer.nearest(eye.into(), direction, 0.0..=100.0).is_some(), "{eye:?} sees out to {direction}");
        }
    }
}

#[test]
fn the_nave_is_as_deep_as_sibenik() {
    // Sibenik itself has 3.04, as the nave's module says. Up to a quarter more or less counts as similar.
    let (mesh, camera, directions) = nave(160, 120);
    let tracer = Tracer::new(&mesh);
    let met: usize = directions.iter().map(|&r| hits(&tracer, camera.eye, r, camera.far).len()).sum();
    let mean = met as f64 / directions.len() as f64;
    assert!((0.75 * 3.04..1.25 * 3.04).contains(&mean) && (mean - 3.36).abs() < 0.05, "{mean}");
}

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}
