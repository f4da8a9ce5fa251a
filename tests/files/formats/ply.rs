//! PLY files as scanners and other programs write them, and hostile ones.

use super::{Noticed, Refused, Triangles, Verdict, hold_all, open};
use glam::dvec3;

/// Strips of triangles, as in the files of the Stanford models.
pub(super) const STRIPS: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
    property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n\
    1 1 0\n8 0 1 2 3 -1 0 1 2\n";

/// A file of text with these elements after its vertices, and with these lines.
fn text(more: &str, lines: &str) -> Vec<u8> {
    let vertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    format!("ply\nformat ascii 1.0\n{vertices}{more}end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n{lines}").into_bytes()
}

const FACES: &str = "element face 1\nproperty list uchar int vertex_indices\n";

/// A binary file with these elements, then these bytes.
fn binary(elements: &str, bytes: &[u8]) -> Vec<u8> {
    [format!("ply\nformat binary_little_endian 1.0\n{elements}end_header\n").as_bytes(), bytes].concat()
}

fn vertices(count: u64) -> String {
    format!("element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n")
}

#[test]
fn every_kind_of_ply_file_has_its_verdict() {
    let face = "element face 1\nproperty list uchar int vertex_index\n";
    let colours = "ply\nformat ascii 1.0\nelement vertex 3\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        property double z\nproperty double x\nproperty double y\nelement face 1\nproperty uchar flags\n\
        property list uint8 uint16 vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        255 0 0 1 2 3\n0 255 0 4 5 6\n0 0 255 7 8 10\n1 3 0 1 2 2 0.5 0.5\n";
    let normals = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n0 0 0 0 0 1\n1 0 0 nan 0 1\n0 1 0 0 0 0\n3 0 1 2\n";
    let three: Vec<u8> = [0., 0., 0., 1., 0., 0., 0., 1., 0_f32].iter().flat_map(|x| x.to_le_bytes()).collect();
    let zero = binary(
        &format!("element nothing 18446744073709551615\n{}{FACES}", vertices(3)),
        &[&three[..], &[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]].concat(),
    );
    let long = format!("comment {}\n", "x".repeat(3 << 20));
    let cases: Vec<(&str, Vec<u8>, Verdict)> = vec![
        ("a quadrilateral", text(FACES, "4 0 1 2 3\n"), Triangles(2)),
        ("the name vertex_index", text(face, "3 0 1 2\n"), Triangles(1)),
        ("line ends of Windows", String::from_utf8(text(FACES, "3 0 1 2\n")).unwrap().replace('\n', "\r\n").into(), Triangles(1)),
        ("line ends of the old Macintosh", String::from_utf8(text(FACES, "3 0 1 2\n")).unwrap().replace('\n', "\r").into(), Triangles(1)),
        ("no line end at the end, and blank lines", text(FACES, "\n\n 3\t0 1 2"), Triangles(1)),
        ("strips", STRIPS.into(), Triangles(3)),
        ("colours, other orders and types", colours.into(), Triangles(1)),
        ("bad normals", normals.into(), Noticed(1, &["line 14: its normal has no direction (the first of 2 such"])),
        ("other elements", text(&format!("element camera 2\nproperty float a\n{FACES}element edge 1\nproperty int v\n"), "1\nnan\n3 0 1 2\n7\n"), Triangles(1)),
        ("no records of an element without properties, however many", zero, Triangles(1)),
        ("a face of two corners", text("element face 2\nproperty list uchar int vertex_indices\n", "2 0 1\n3 0 1 2\n"), Noticed(1, &["line 14: a face needs 3 corners"])),
        ("a texture", text(&format!("comment TextureFile scan.png\n{FACES}"), "3 0 1 2\n"), Noticed(1, &["line 7: the texture of a PLY file is not read; the surface has the"])),
        ("list counts of float", text("element face 1\nproperty list float double vertex_indices\n", "3 0 1 2\n"), Triangles(1)),
        // Hostile files.
        ("points alone", text("", ""), Refused(&["holds points and no faces", "MeshLab"])),
        ("no vertices", b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n".into(), Refused(&["lacks a property x"])),
        ("no elements", b"ply\nformat ascii 1.0\nend_header\n".into(), Refused(&["no points and no faces"])),
        ("only faces of two corners", text(FACES, "2 0 1\n"), Refused(&["no faces of 3 corners"])),
        ("an index too large", text(FACES, "3 0 1 4\n"), Refused(&["line 14", "index 4", "4 vertices"])),
        ("an index below 0", text(FACES, "3 0 1 -1\n"), Refused(&["line 14", "index -1"])),
        ("an index that is no whole number", text(FACES, "3 0 1 1.5\n"), Refused(&["index 1.5"])),
        ("an index that is no number", text(FACES, "3 0 1 nan\n"), Refused(&["index NaN"])),
        ("a list of -1", text("element face 1\nproperty list char int vertex_indices\n", "-1 0\n"), Refused(&["a list cannot have -1 entries"])),
        ("a list of four thousand million", text("element face 1\nproperty list uint int vertex_indices\n", "4294967295 0\n"), Refused(&["65536 corners"])),
        ("too few numbers", text(FACES, "3 0 1\n"), Refused(&["line 14: fewer numbers"])),
        ("too many numbers", text(FACES, "3 0 1 2 3\n"), Refused(&["line 14: more numbers"])),
        ("nan", String::from_utf8(text(FACES, "3 0 1 2\n")).unwrap().replace("1 1 0", "1 nan 0").into(), Refused(&["line 12", "NaN is not a finite number"])),
        ("too far away", String::from_utf8(text(FACES, "3 0 1 2\n")).unwrap().replace("1 1 0", "1 1e300 0").into(), Refused(&["line 12", "past 1e15"])),
        ("no number", String::from_utf8(text(FACES, "3 0 1 2\n")).unwrap().replace("1 1 0", "1 0x1 0").into(), Refused(&["line 12", "\"0x1\" is not a number"])),
        ("a text that is cut short", text("element face 2\nproperty list uchar int vertex_indices\n", "3 0 1 2\n"), Refused(&["cut short"])),
        ("a header that is cut short", b"ply\nformat ascii 1.0\nelement vertex 3\n".into(), Refused(&["before end_header"])),
        ("a claim of 2^64 vertices", binary(&vertices(u64::MAX), &three), Refused(&["cut short", "vertex"])),
        ("a claim beyond 64 bits", binary("element vertex 99999999999999999999\n", &three), Refused(&["is no number of records"])),
        ("a claim of 2^40 vertices", binary(&vertices(1 << 40), &three), Refused(&["vertex"])),
        ("a claim of a thousand million faces", binary(&format!("{}element face 1000000000\nproperty list uchar int vertex_indices\n", vertices(3)), &three), Refused(&["face"])),
        ("binary data that are cut short", binary(&format!("{}{FACES}", vertices(3)), &[&three[..], &[3, 0, 0]].concat()), Refused(&["cut short"])),
        ("an unknown format", b"ply\nformat binary_middle_endian 1.0\nend_header\n".into(), Refused(&["line 2", "binary_middle_endian"])),
        ("an unknown version", b"ply\nformat ascii 2.0\nend_header\n".into(), Refused(&["line 2", "2.0"])),
        ("no format", b"ply\nend_header\n".into(), Refused(&["no line format"])),
        ("an unknown type", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int128 x\nend_header\n".into(), Refused(&["line 4", "int128"])),
        ("a property of no element", b"ply\nformat ascii 1.0\nproperty int x\nend_header\n".into(), Refused(&["line 3", "before the first element"])),
        ("vertices twice", binary(&format!("{}{}", vertices(1), vertices(1)), &three), Refused(&["second element"])),
        ("a property twice", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int x\nend_header\n".into(), Refused(&["second property"])),
        ("coordinates that are lists", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list int int x\nproperty int y\nproperty int z\nend_header\n1 1 1 1\n".into(), Refused(&["one number"])),
        ("faces before vertices", binary(&format!("{FACES}{}", vertices(3)), &three), Refused(&["after the faces"])),
        ("faces without a list", text("element face 1\nproperty int a\n", "1\n"), Refused(&["lacks a list vertex_indices"])),
        ("a line without end", [b"ply\nformat ascii 1.0\n", long.as_bytes()].concat(), Refused(&["line 3: more than 2097152 bytes"])),
        ("an unknown line with a control character", b"ply\nformat ascii 1.0\nhello\x1b[31m\n".into(), Refused(&["line 3", "no line of a PLY header"])),
    ];
    hold_all(&cases);
}

#[test]
fn numbers_of_every_type_and_order_are_read_as_they_are() {
    let elements = "element vertex 3\nproperty double x\nproperty short y\nproperty uint z\n\
        element face 1\nproperty list ushort char vertex_indices\n";
    for big in [false, true] {
        let mut bytes = Vec::new();
        let mut put = |little: &[u8]| match big {
            true => bytes.extend(little.iter().rev()),
            false => bytes.extend(little),
        };
        for (x, y, z) in [(0.1, -2, 4_000_000_000), (1e-3, 300, 1), (1000000.0000001, 5, 6)] {
            put(&f64::to_le_bytes(x));
            put(&i16::to_le_bytes(y));
            put(&u32::to_le_bytes(z));
        }
        put(&3_u16.to_le_bytes());
        (0..3_u8).for_each(|i| put(&[i]));
        let order = if big { "big" } else { "little" };
        let head = format!("ply\nformat binary_{order}_endian 1.0\n{elements}end_header\n");
        let mesh = open(&[head.as_bytes(), &bytes].concat(), &[]).unwrap().mesh;
        let expected = [dvec3(0.1, -2.0, 4e9), dvec3(1e-3, 300.0, 1.0), dvec3(1000000.0000001, 5.0, 6.0)];
        assert_eq!((mesh.positions.as_slice(), mesh.triangles.as_slice()), (&expected[..], &[[0, 1, 2]][..]));
    }
}

#[test]
fn normals_and_concave_faces_are_those_of_obj() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n0 0 0 0 0 1\n4 0 0 0 0 1\n4 4 0 0 0 1\n2 1 0 0 1 1\n0 4 0 0 0 1\n5 0 1 2 3 4\n";
    let obj = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nvn 0 0 1\nvn 0 1 1\nf 1//1 2//1 3//1 4//2 5//1\n";
    let meshes = [ply, obj].map(|text| open(text.as_bytes(), &[]).unwrap().mesh);
    assert_eq!(super::corners(&meshes[0]), super::corners(&meshes[1]));
    let by_position = |mesh: &hbao::scene::Mesh| {
        let mut normals: Vec<_> =
            mesh.positions.iter().zip(mesh.vertex_normals()).map(|(p, n)| format!("{p} {n}")).collect();
        normals.sort();
        normals
    };
    assert_eq!(by_position(&meshes[0]), by_position(&meshes[1]));
}
