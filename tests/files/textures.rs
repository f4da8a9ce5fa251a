//! Tests of textures: the options of `map_Kd` and `map_d`, and every kind of file, each with its verdict.

use hbao::scene::{Mesh, Scene};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";

/// Writes pictures that are right, and some that are not.
fn write_pictures(folder: &Path) {
    let rgba = image::RgbaImage::from_fn(4, 2, |x, _| image::Rgba([200, 100, 50, if x < 2 { 0 } else { 255 }]));
    let rgb = image::DynamicImage::from(rgba.clone()).to_rgb8();
    rgba.save(folder.join("alpha.png")).unwrap();
    rgba.save(folder.join("alpha.tga")).unwrap();
    rgb.save(folder.join("a picture.jpg")).unwrap();
    rgb.save(folder.join("rgb.bmp")).unwrap();
    rgb.save(folder.join("-x.png")).unwrap();
    rgb.save(folder.join("7.png")).unwrap();
    fs::copy(folder.join("rgb.bmp"), folder.join("bmp named.png")).unwrap();
    fs::copy(folder.join("7.png"), folder.join("8")).unwrap();
    let png = fs::read(folder.join("alpha.png")).unwrap();
    fs::write(folder.join("cut short.png"), &png[..png.len() / 2]).unwrap();
    fs::write(folder.join("empty.png"), "").unwrap();
    fs::write(folder.join("text.png"), "no picture\n").unwrap();
    fs::write(folder.join("text.tga"), "no picture\n").unwrap();
    let mut wide = png.clone();
    wide[16..20].copy_from_slice(&100_000_u32.to_be_bytes());
    fs::write(folder.join("claims 100000.png"), wide).unwrap();
    image::GrayImage::new(16_385, 1).save(folder.join("16385.png")).unwrap();
    let mut bmp = fs::read(folder.join("rgb.bmp")).unwrap();
    bmp[18..26].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]);
    fs::write(folder.join("claims 2_31.bmp"), bmp).unwrap();
    fs::write(folder.join("gif.png"), b"GIF89a\x01\0\x01\0\0\0\0;").unwrap();
    fs::create_dir(folder.join("folder.png")).unwrap();
}

/// Reads the model with a material of these statements, and returns the mesh and what is told.
fn read(folder: &Path, statements: &str) -> (Mesh, Vec<String>) {
    fs::write(folder.join("m.obj"), OBJ).unwrap();
    fs::write(folder.join("m.mtl"), format!("newmtl a\n{statements}\n")).unwrap();
    let Scene { mesh, notices, .. } = Scene::open(folder.join("m.obj")).unwrap();
    (mesh, notices)
}

#[test]
fn every_texture_and_option_is_read_or_told_in_one_line() {
    let folder = TempDir::new().unwrap();
    write_pictures(folder.path());
    let whole = "needs";
    // What is told of each statement; nothing if it is read.
    let cases: [(&str, &str); 46] = [
        ("map_Kd alpha.png", ""),
        ("map_Kd alpha.tga", ""),
        ("map_Kd a picture.jpg", ""),
        ("map_Kd \"a picture.jpg\"", ""),
        ("map_Kd rgb.bmp", ""),
        ("map_Kd RGB.BMP", ""),
        ("map_Kd C:\\textures\\rgb.bmp", ""),
        ("map_Kd ../rgb.bmp", ""),
        ("map_Kd bmp named.png", ""),
        ("map_Kd -x.png", ""),
        ("map_Kd -s 2 7.png", ""),
        ("map_Kd -s 2 2 8", ""),
        ("map_Kd -s 1 1 1 -o 0.5 0.5 0 -t 0 0 0 -clamp on rgb.bmp", ""),
        ("map_Kd -mm 0.1 0.9 -blendu on -blendv off -cc off -texres 64 -boost 2 rgb.bmp", ""),
        ("map_d alpha.png", ""),
        ("map_d -imfchan m alpha.png", ""),
        ("map_d -imfchan l -bm 1 rgb.bmp", ""),
        ("map_Kd none.png\nmap_Kd rgb.bmp", ""),
        ("map_Kd none.png", "line 2: texture \"none.png\" is not beside the model; its material has the colour of Kd"),
        ("map_Kd a picture.png", "\"a picture.png\" is not beside the model"),
        ("map_Kd cut short.png", "\"cut short.png\" cannot be read"),
        ("map_Kd empty.png", "\"empty.png\" is no PNG, JPEG, TGA or BMP picture"),
        ("map_Kd text.png", "\"text.png\" is no PNG, JPEG, TGA or BMP picture"),
        ("map_Kd text.tga", "\"text.tga\" cannot be read"),
        ("map_Kd gif.png", "\"gif.png\" is no PNG, JPEG, TGA or BMP picture"),
        ("map_Kd folder.png", "\"folder.png\" is not a file"),
        ("map_Kd claims 100000.png", "\"claims 100000.png\" cannot be read"),
        ("map_Kd 16385.png", "\"16385.png\" is larger than 16384x16384"),
        ("map_Kd claims 2_31.bmp", "\"claims 2_31.bmp\" "),
        ("map_d none.png", "\"none.png\" is not beside the model; nothing is cut out of its material"),
        ("map_d text.png", "\"text.png\" is no PNG, JPEG, TGA or BMP picture; nothing is cut out of its material"),
        ("map_Kd /etc/passwd", "\"/etc/passwd\" is not beside the model"),
        ("map_Kd", "line 2: map_Kd names no file; its material"),
        ("map_Kd -s 1", "names no file"),
        ("map_Kd -s 1 1 1", "texture \"1\" is not beside the model"),
        ("map_Kd -s x.png", "\"-s\" needs a value"),
        ("map_Kd -mm 1 rgb.bmp", "\"-mm\" needs two numbers"),
        ("map_Kd -clamp yes rgb.bmp", "\"-clamp\" is on or off, not \"yes\""),
        ("map_d -imfchan z rgb.bmp", "\"-imfchan\" is r, g, b, m or l, not \"z\""),
        ("map_Kd -s nan rgb.bmp", whole),
        ("map_Kd \u{1b}[2J.png", "texture \"\\u{1b}[2J.png\" is not beside"),
        ("map_Bump rgb.bmp\nmap_Ks rgb.bmp", "line 2: \"map_Bump\" is not read (the first of 2 such statements)"),
        ("d x", "line 2: \"x\" is not a number; its material is opaque"),
        ("d", "line 2: d needs a number; its material is opaque"),
        ("d 0.5\nTr 0.5\nillum 2\nNs 10\nKs 1 1 1", ""),
        ("refl -type sphere rgb.bmp", "\"refl\" is not read"),
    ];
    for (statements, what) in cases {
        let (mesh, notices) = read(folder.path(), statements);
        assert_eq!(mesh.triangles.len(), 1);
        match &notices[..] {
            [] => assert!(what.is_empty(), "nothing is told of {statements:?}"),
            [notice] => {
                assert!(!what.is_empty() && notice.contains(what), "{statements:?}: {notice}");
                assert!(notice.contains("m.mtl: line ") && !notice.contains(char::is_control), "{notice:?}");
            }
            more => panic!("{statements:?}: {more:?}"),
        }
    }
}

#[test]
fn a_surface_below_half_opacity_is_left_out_and_a_model_of_nothing_else_is_refused() {
    let folder = TempDir::new().unwrap();
    let obj = format!("{OBJ}usemtl b\nv 9 9 9\nf 1 2 4\n");
    fs::write(folder.path().join("m.obj"), obj).unwrap();
    for (b, triangles) in [
        ("d 0.5", 2),
        ("d 0.49", 1),
        ("Tr 0.51", 1),
        ("Tr 0.5", 2),
        ("d 0\nd 1", 2),
        ("d -halo 0.3", 1),
        ("d 1\nTr 1", 2),
        ("Tr 1\nd 1", 2),
        ("d 0\nTr 0", 1),
    ] {
        fs::write(folder.path().join("m.mtl"), format!("newmtl a\nKd 1 0 0\nnewmtl b\n{b}\n")).unwrap();
        let Scene { mesh, notices, .. } = Scene::open(folder.path().join("m.obj")).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (triangles, 3 * triangles), "{b}");
        let told = "m.mtl: line 4: d is below 1/2; its triangles are left out";
        assert_eq!(notices.iter().filter(|notice| notice.ends_with(told)).count(), 2 - triangles, "{b}: {notices:?}");
    }
    fs::write(folder.path().join("m.mtl"), "newmtl a\nd 0\nnewmtl b\nd 0\n").unwrap();
    let refused = Scene::open(folder.path().join("m.obj")).unwrap_err().to_string();
    assert!(
        refused.ends_with("m.obj: holds no faces that are seen: d is below 1/2 in the materials of all"),
        "{refused}"
    );
}

#[test]
fn bad_texture_coordinates_are_told_only_if_a_texture_is_used() {
    let folder = TempDir::new().unwrap();
    write_pictures(folder.path());
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 0.5\nvt 2e6 0\nvt\nusemtl a\nf 1/1 2/2 3/9\nf 1 2/x 3/-9\n";
    let read = |mtl: &str| {
        fs::write(folder.path().join("m.obj"), obj).unwrap();
        fs::write(folder.path().join("m.mtl"), mtl).unwrap();
        Scene::open(folder.path().join("m.obj")).unwrap().notices
    };
    assert_eq!(read("newmtl a\nKd 1 0 0\n"), [""; 0]);
    let notices = read("newmtl a\nmap_Kd rgb.bmp\n");
    let expected = [
        "m.obj: line 5: \"nan\" is not a finite number (the first of 3 such texture coordinates); no texture is laid on its \
         faces",
        "m.obj: line 10: index 9 is out of range; 4 vt lines stand before it, counted from 1 (the first of 3 such corners); \
         no texture is laid on its face",
        "m.obj: line 10: a triangle lacks texture coordinates, and its material has a texture (the first of 2 such \
         surfaces); no texture is laid on it, and nothing is cut out of it",
    ];
    assert_eq!(notices.len(), 3, "{notices:?}");
    assert!(notices.iter().zip(expected).all(|(notice, end)| notice.ends_with(end)), "{notices:#?}");
}

#[test]
fn a_face_without_texture_coordinates_has_the_colour_of_its_material_and_is_not_cut() {
    let folder = TempDir::new().unwrap();
    write_pictures(folder.path());
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nmap_Kd rgb.bmp\nmap_d alpha.png\nnewmtl plain\nKd 0.5 0.5 0.5\n";
    fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    let read = |faces: &str| {
        let start = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt nan 0\nusemtl a\n";
        fs::write(folder.path().join("m.obj"), format!("{start}{faces}")).unwrap();
        let Scene { mesh, notices, .. } = Scene::open(folder.path().join("m.obj")).unwrap();
        (mesh, notices)
    };
    let (expected, notices) = read("f 1/1 2/2 3/3\nusemtl plain\nf 1 2 4\nusemtl a\nf 2/1 3/2 4/3\n");
    assert_eq!(notices.len(), 1, "only the bad vt is told: {notices:?}");
    // Without any coordinates, with some, with a wrong index, and with one that is no point.
    for corners in ["1 2 4", "1/1 2/2 4", "1/1 2/2 4/9", "1/1 2/2 4/4"] {
        let (mesh, notices) = read(&format!("f 1/1 2/2 3/3\nf {corners}\nf 2/1 3/2 4/3\n"));
        assert_eq!(mesh, expected, "{corners}");
        let told = "m.obj: line 12: a triangle lacks texture coordinates, and its material has a texture; no texture is \
                    laid on it, and nothing is cut out of it";
        assert_eq!(notices.iter().filter(|notice| notice.ends_with(told)).count(), 1, "{corners}: {notices:?}");
    }
}

#[test]
fn vertex_colours_make_another_mesh_and_the_order_of_statements_does_not_matter() {
    let folder = TempDir::new().unwrap();
    let read = |obj: &str| {
        let path = folder.path().join("m.obj");
        fs::write(&path, obj).unwrap();
        Mesh::load_obj(&path).unwrap().0
    };
    let plain = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n");
    let late = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 0 0 0 1 0 0\nf 3 2 4\n");
    let early = read("v 0 0 0\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 4\nf 4 3 2\n");
    assert_ne!(plain, late);
    assert_eq!(late, early);
}
