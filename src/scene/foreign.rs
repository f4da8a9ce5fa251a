//! Recognises files of other formats by how they begin, so that the message can say what they are and what to do.

use std::io::{self, BufRead, Read as _};

/// How many bytes of a file's beginning are examined.
const HEAD: u64 = 1024;

const CONVERT: &str =
    "and only OBJ, PLY, STL and glTF are read: convert it to one of them, for example with Blender or MeshLab";
const UNPACK: &str = "and only OBJ, PLY, STL and glTF are read: unpack it and give the file inside";
const MODEL: &str = "and no model: give the model";
const DOWNLOAD: &str = "and no model: download the file itself";
const OPEN: &str = "and Mesh::load_obj reads only OBJ: open it with Scene::open";
pub(super) const ENCODE: &str = "and only UTF-8 is read: save it as UTF-8";

/// A format: what a file of it is called, and what to do with it.
pub(super) type Format = (&'static str, &'static str);

const PLY: Format = ("a PLY file", OPEN);
const STL: Format = ("an STL file", OPEN);
const GLTF: Format = ("a glTF file", OPEN);
const FBX: Format = ("an FBX file", CONVERT);
const BLENDER: Format =
    ("a Blender file", "and only OBJ, PLY, STL and glTF are read: export it from Blender as Wavefront OBJ");
const WEB_PAGE: Format = ("a web page", DOWNLOAD);
const UTF16: Format = ("text in UTF-16", ENCODE);

/// Beginnings that no OBJ file has.
const CERTAIN: [(&[u8], Format); 23] = [
    (b"ply\n", PLY),
    (b"ply\r", PLY),
    (b"glTF\x01\0\0\0", GLTF),
    (b"glTF\x02\0\0\0", GLTF),
    (b"Kaydara FBX Binary", FBX),
    (b"BLENDER", BLENDER),
    (b"PXR-USDC", ("a USD file", CONVERT)),
    (b"Ogawa\xff", ("an Alembic file", CONVERT)),
    (b"\xff\xfe", UTF16),
    (b"\xfe\xff", UTF16),
    (b"\x1f\x8b", ("a gzip archive", UNPACK)),
    (b"PK\x03\x04", ("a zip archive", UNPACK)),
    (b"\x28\xb5\x2f\xfd", ("a Zstandard archive", UNPACK)),
    (b"\xfd7zXZ\0", ("an xz archive", UNPACK)),
    (b"BZh91AY&SY", ("a bzip2 archive", UNPACK)),
    (b"7z\xbc\xaf\x27\x1c", ("a 7z archive", UNPACK)),
    (b"Rar!\x1a\x07", ("a RAR archive", UNPACK)),
    (b"\x89PNG\r\n\x1a\n", ("a PNG picture", MODEL)),
    (b"\xff\xd8\xff", ("a JPEG picture", MODEL)),
    (b"\x76\x2f\x31\x01", ("an OpenEXR picture", MODEL)),
    (b"%PDF-", ("a PDF file", MODEL)),
    (b"\x7fELF", ("a program", MODEL)),
    (b"version https://git-lfs", ("a pointer of Git LFS", "and no model: fetch the file with 'git lfs pull'")),
];

/// Beginnings that an OBJ file could have if statements that are not understood are skipped: a word at the beginning,
/// and a word somewhere after it. The case of letters does not matter. The first line that fits counts.
const LIKELY: [(&str, &str, Format); 20] = [
    ("solid", "facet", STL),
    ("{", "\"asset\"", GLTF),
    ("{", "\"accessors\"", GLTF),
    ("{", "\"bufferviews\"", GLTF),
    ("{", "", ("a JSON file", CONVERT)),
    ("<", "<collada", ("a COLLADA file", CONVERT)),
    ("<", "<html", WEB_PAGE),
    ("<", "<!doctype html", WEB_PAGE),
    ("<", "", ("an XML file", CONVERT)),
    ("off", "", ("an OFF file", CONVERT)),
    ("coff", "", ("an OFF file", CONVERT)),
    ("; fbx", "", FBX),
    ("#vrml", "", ("a VRML file", CONVERT)),
    ("#x3d", "", ("an X3D file", CONVERT)),
    ("#usda", "", ("a USD file", CONVERT)),
    ("//maya", "", ("a Maya file", "and only OBJ, PLY, STL and glTF are read: export it from Maya as OBJ")),
    ("xof 0", "", ("a DirectX file", CONVERT)),
    ("0\nsection", "", ("a DXF file", CONVERT)),
    ("0\r\nsection", "", ("a DXF file", CONVERT)),
    ("iso-10303-21", "", ("a STEP file", CONVERT)),
];

/// The members of a glTF file, any of which may be the first.
const GLTF_MEMBERS: [&str; 17] = [
    "accessors",
    "animations",
    "asset",
    "buffers",
    "bufferviews",
    "cameras",
    "extensions",
    "extensionsrequired",
    "extensionsused",
    "extras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "scene",
    "scenes",
    "skins",
];

/// The formats of models that are read.
pub(super) enum Model {
    Obj,
    Ply,
    TextStl,
    BinaryStl,
    Gltf,
    Glb,
}

/// Returns the format of a file that begins in this way and has this length, if that is known. A file that no rule fits
/// is an OBJ file, which has no mark.
pub(super) fn model(head: &[u8], length: Option<u64>) -> Model {
    let text = String::from_utf8_lossy(head.strip_prefix("\u{feff}".as_bytes()).unwrap_or(head)).to_ascii_lowercase();
    let text = text.trim_start();
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        Model::Ply
    } else if head.starts_with(b"glTF") {
        Model::Glb
    } else if length.is_some_and(|length| is_length_of_stl(head, length)) || is_binary_stl(head) {
        // A header that begins with "solid" does not make it text.
        Model::BinaryStl
    } else if is_text_stl(text) {
        Model::TextStl
    } else if is_gltf(text) {
        Model::Gltf
    } else {
        Model::Obj
    }
}

/// Whether a file has exactly the length that the number of triangles of a binary STL file asks for.
fn is_length_of_stl(head: &[u8], length: u64) -> bool {
    let count = head.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    count.is_some_and(|count| length == 84 + 50 * u64::from(count))
}

/// Whether the first line of this text begins with `solid`, and the next one is a statement of STL.
fn is_text_stl(text: &str) -> bool {
    let mut lines = text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty());
    let mut word = || lines.next().and_then(|line| line.split_whitespace().next()).unwrap_or_default();
    word() == "solid" && ["facet", "endsolid", "color"].contains(&word())
}

/// Whether this text begins as a JSON object does whose first member is one of glTF, or holds its asset.
fn is_gltf(text: &str) -> bool {
    let Some(text) = text.strip_prefix('{') else { return false };
    let first = text.trim_start().strip_prefix('"').and_then(|text| text.split('"').next()).unwrap_or_default();
    GLTF_MEMBERS.contains(&first) || text.contains("\"asset\"")
}

/// Reads the beginning of a file. Returns it, and the whole file again.
///
/// # Errors
/// The error of `file`.
pub(super) fn head<R: BufRead>(mut file: R) -> io::Result<(Vec<u8>, impl BufRead)> {
    let mut head = Vec::new();
    file.by_ref().take(HEAD).read_to_end(&mut head)?;
    Ok((head.clone(), io::Cursor::new(head).chain(file)))
}

/// Returns the format of a file that begins in this way, if no OBJ or MTL file does.
pub(super) fn certain(head: &[u8]) -> Option<Format> {
    CERTAIN.into_iter().find(|(start, _)| head.starts_with(start)).map(|(_, format)| format)
}

/// Returns the format of a file that begins in this way and cannot be read as an OBJ file.
pub(super) fn likely(head: &[u8]) -> Option<Format> {
    let text = String::from_utf8_lossy(head.strip_prefix("\u{feff}".as_bytes()).unwrap_or(head)).to_ascii_lowercase();
    let text = text.trim_start();
    let named = LIKELY.into_iter().find(|(start, word, _)| text.starts_with(start) && text.contains(word));
    let named = named.map(|(_, _, format)| format);
    named.or(is_binary_stl(head).then_some(STL)).or(is_utf16(head).then_some(UTF16))
}

/// Returns true if a file that begins in this way holds bytes that text does not contain.
pub(super) fn is_binary(head: &[u8]) -> bool {
    head.contains(&0)
}

/// Binary STL has no mark of its own: 80 bytes of anything, the number of triangles, and for each triangle its unit
/// normal, which may be zero, three corners, and two bytes of anything.
fn is_binary_stl(head: &[u8]) -> bool {
    let Some((start, triangles)) = head.split_at_checked(84) else { return false };
    let count = u32::from_le_bytes([start[80], start[81], start[82], start[83]]);
    let fits = |triangle: &[u8]| {
        let mut numbers = triangle.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let length_squared: f32 = numbers.by_ref().take(3).map(|x| x * x).sum();
        let unit = length_squared == 0.0 || (0.9..1.1).contains(&length_squared);
        unit && numbers.all(|x| x == 0.0 || (1e-15..1e15).contains(&x.abs()))
    };
    let mut whole = triangles.chunks_exact(50).take(count as usize).peekable();
    whole.peek().is_some() && whole.all(fits)
}

/// UTF-16 without a byte order mark, as long as its first two characters are ASCII.
fn is_utf16(head: &[u8]) -> bool {
    matches!(head, [a, 0, b, 0, ..] | [0, a, 0, b, ..] if *a != 0 && *b != 0)
}
