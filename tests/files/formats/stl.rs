//! STL files as other programs write them, and hostile ones.

use super::{Noticed, Refused, Triangles, Verdict, hold_all, open, sample};
use crate::written;

const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

fn text(facets: &str) -> Vec<u8> {
    format!("solid part\n{facets}endsolid part\n").into_bytes()
}

/// A binary file with this header, which claims this many triangles.
fn binary(header: &[u8], count: u32, triangles: &[[f32; 9]]) -> Vec<u8> {
    let mut file = header.to_vec();
    file.resize(80, b' ');
    file.extend(count.to_le_bytes());
    for triangle in triangles {
        file.extend([0; 12]);
        file.extend(triangle.iter().flat_map(|x| x.to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}

const TRIANGLE: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
const FLAT: [f32; 9] = [0., 0., 0., 1., 0., 0., 2., 0., 0.];

#[test]
fn every_kind_of_stl_file_has_its_verdict() {
    let mut infinite = TRIANGLE;
    infinite[4] = f32::INFINITY;
    let mut far = TRIANGLE;
    far[4] = 1e30;
    let mut coloured = binary(b"", 1, &[TRIANGLE]);
    *coloured.last_mut().unwrap() = 0x80;
    let upper = String::from_utf8(text(FACET)).unwrap().to_uppercase();
    let cases: Vec<(&str, Vec<u8>, Verdict)> = vec![
        ("text", text(FACET), Triangles(1)),
        ("capital letters, as old programs write them", upper.into(), Triangles(1)),
        ("line ends of Windows", String::from_utf8(text(FACET)).unwrap().replace('\n', "\r\n").into(), Triangles(1)),
        ("two solids", [text(FACET), text(FACET)].concat(), Triangles(2)),
        ("binary", binary(b"exported", 1, &[TRIANGLE]), Triangles(1)),
        ("a binary header that begins with solid", binary(b"solid part\nfacet", 2, &[TRIANGLE; 2]), Triangles(2)),
        ("bytes after the triangles", [binary(b"", 1, &[TRIANGLE]), vec![0; 9]].concat(), Triangles(1)),
        (
            "flat triangles",
            binary(b"", 3, &[TRIANGLE, FLAT, FLAT]),
            Noticed(1, &["triangle 2: it has no area (the first of 2"]),
        ),
        (
            "flat triangles of text",
            text(&format!("{FACET}{}", FACET.replace("0 1 0", "2 0 0"))),
            Noticed(1, &["line 15: a triangle without area"]),
        ),
        ("a triangle of Magics", binary(b"COLOR=rgba", 1, &[TRIANGLE]), Noticed(1, &["colours of STL"])),
        ("a triangle of VisCAM", coloured, Noticed(1, &["colours of STL"])),
        ("no endsolid", format!("solid\n{FACET}").into(), Noticed(1, &["does not end with endsolid"])),
        // Hostile files.
        ("only flat triangles", binary(b"", 1, &[FLAT]), Refused(&["without area"])),
        ("no triangles", binary(b"", 0, &[]), Refused(&["holds no triangles"])),
        ("a solid without triangles", text(""), Refused(&["holds no triangles"])),
        (
            "a claim of four thousand million triangles",
            binary(b"", u32::MAX, &[TRIANGLE; 2]),
            Refused(&["claims 4294967295 triangles", "after 2", "cut short"]),
        ),
        ("one triangle less than claimed", binary(b"", 3, &[TRIANGLE; 2]), Refused(&["claims 3", "after 2"])),
        ("infinity", binary(b"", 1, &[infinite]), Refused(&["triangle 1: inf is not a finite number"])),
        ("too far away", binary(b"", 1, &[far]), Refused(&["triangle 1", "past 1e15"])),
        (
            "nan in text",
            text(&FACET.replace("1 0 0", "1 nan 0")),
            Refused(&["line 5", "\"nan\" is not a finite number"]),
        ),
        ("two corners", text(&FACET.replace("vertex 1 0 0\n", "")), Refused(&["line 7", "three corners"])),
        ("four corners", text(&FACET.replace("endloop", "vertex 1 1 0")), Refused(&["line 7", "three corners"])),
        (
            "a corner of two numbers",
            text(&FACET.replace("vertex 1 0 0", "vertex 1 0")),
            Refused(&["line 5", "three numbers"]),
        ),
        (
            "a facet in a facet",
            text(&format!("facet\n{FACET}")),
            Refused(&["line 3", "the facet of line 2 has not ended"]),
        ),
        ("text that is cut short", text(FACET)[..54].into(), Refused(&["cut short"])),
        (
            "another statement",
            text(&FACET.replace("outer", "inner")),
            Refused(&["line 3", "\"inner\" is no statement of STL"]),
        ),
        ("a line without end", format!("solid\nfacet {}", "x".repeat(3 << 20)).into(), Refused(&["2097152 bytes"])),
    ];
    hold_all(&cases);
}

#[test]
fn corners_at_the_same_position_are_one_vertex() {
    let mesh = sample();
    for file in [written::stl(&mesh), written::text_stl(&mesh).into_bytes()] {
        let read = open(&file, &[]).unwrap().mesh;
        assert_eq!((read.positions.len(), read.triangles.len()), (5, 5));
    }
    let mut other = TRIANGLE;
    other[1] = -0.0;
    other[8] = 1.0;
    assert_eq!(open(&binary(b"", 2, &[TRIANGLE, other]), &[]).unwrap().mesh.positions.len(), 4);
}

#[test]
fn text_keeps_float64() {
    let mesh = open(&text(&FACET.replace("1 0 0", "1000000.0000001 0 0")), &[]).unwrap().mesh;
    assert_eq!(mesh.positions[1].x, 1000000.0000001);
}
