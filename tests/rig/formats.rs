//! Writes meshes in the formats that are read, as simply as each allows.

use glam::DVec3;
use hbao::scene::Mesh;
use std::fmt::Write as _;

/// How the numbers of a PLY file are written.
#[derive(Clone, Copy, PartialEq)]
pub enum Order {
    Text,
    Little,
    Big,
}

fn floats(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize]))
}

/// An OBJ file whose materials stand in `scene.mtl`, and that file.
pub fn obj(mesh: &Mesh) -> [String; 2] {
    let (mut obj, mut mtl) = ("mtllib scene.mtl\n".to_string(), String::new());
    mesh.positions.iter().for_each(|p| writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap());
    for (i, group) in mesh.groups.iter().enumerate() {
        let [r, g, b] = group.colour;
        write!(mtl, "newmtl m{i}\nKd {r} {g} {b}\n").unwrap();
        writeln!(obj, "usemtl m{i}").unwrap();
        for [a, b, c] in &mesh.triangles[group.triangles.clone()] {
            writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        }
    }
    [obj, mtl]
}

/// A PLY file without colours.
pub fn ply(mesh: &Mesh, order: Order) -> Vec<u8> {
    let format = match order {
        Order::Text => "ascii",
        Order::Little => "binary_little_endian",
        Order::Big => "binary_big_endian",
    };
    let (points, faces) = (mesh.positions.len(), mesh.triangles.len());
    let mut file = format!(
        "ply\nformat {format} 1.0\ncomment a test\nelement vertex {points}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let ordered = |bytes: [u8; 4]| match (order, bytes) {
        (Order::Big, [a, b, c, d]) => [d, c, b, a],
        _ => bytes,
    };
    if order == Order::Text {
        mesh.positions.iter().for_each(|p| file.extend(format!("{} {} {}\n", p.x, p.y, p.z).bytes()));
        mesh.triangles.iter().for_each(|[a, b, c]| file.extend(format!("3 {a} {b} {c}\n").bytes()));
        return file;
    }
    mesh.positions.iter().flat_map(|&p| floats(p)).for_each(|x| file.extend(ordered(x.to_le_bytes())));
    for triangle in &mesh.triangles {
        file.push(3);
        triangle.iter().for_each(|i| file.extend(ordered(i.to_le_bytes())));
    }
    file
}

/// A binary STL file.
pub fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut file = vec![b' '; 80];
    file.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in corners(mesh) {
        file.extend([0; 12]);
        file.extend(triangle.iter().flat_map(|&p| floats(p)).flat_map(f32::to_le_bytes));
        file.extend([0; 2]);
    }
    file
}

/// An STL file of text.
pub fn text_stl(mesh: &Mesh) -> String {
    let mut file = "solid test\n".to_string();
    for triangle in corners(mesh) {
        file += " facet normal 0 0 0\n  outer loop\n";
        triangle.iter().for_each(|p| writeln!(file, "   vertex {} {} {}", p.x, p.y, p.z).unwrap());
        file += "  endloop\n endfacet\n";
    }
    file + "endsolid test\n"
}

/// A GLB file of JSON and of binary data, which may be empty.
pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 20 + json.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    let mut file = [b"glTF".as_slice(), &2_u32.to_le_bytes(), &(length as u32).to_le_bytes()].concat();
    file.extend([(json.len() as u32).to_le_bytes(), *b"JSON"].concat());
    file.extend(json);
    if !binary.is_empty() {
        file.extend([(binary.len() as u32).to_le_bytes(), *b"BIN\0"].concat());
        file.extend(binary);
    }
    file
}

/// The JSON and the binary data of a mesh, one primitive for each colour. `nodes` are the nodes in JSON, and `more`
/// other members of the file. Buffer 0 gets this URI, or none.
pub fn gltf(mesh: &Mesh, nodes: &str, more: &str, uri: Option<&str>) -> (String, Vec<u8>) {
    let mut binary: Vec<u8> = mesh.positions.iter().flat_map(|&p| floats(p)).flat_map(f32::to_le_bytes).collect();
    let points = binary.len();
    binary.extend(mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let linear = |x: f32| {
        let x = f64::from(x);
        if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
    };
    let (mut primitives, mut materials, mut accessors) = (
        Vec::new(),
        Vec::new(),
        vec![format!(r#"{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}}"#, mesh.positions.len())],
    );
    for (i, group) in mesh.groups.iter().enumerate() {
        primitives.push(format!(r#"{{"attributes":{{"POSITION":0}},"indices":{},"material":{i}}}"#, i + 1));
        let [r, g, b] = group.colour.map(linear);
        materials.push(format!(r#"{{"pbrMetallicRoughness":{{"baseColorFactor":[{r},{g},{b},1]}}}}"#));
        let (start, count) = (12 * group.triangles.start, 3 * group.triangles.len());
        accessors.push(format!(
            r#"{{"bufferView":1,"byteOffset":{start},"componentType":5125,"count":{count},"type":"SCALAR"}}"#
        ));
    }
    let uri = uri.map(|uri| format!(r#","uri":"{uri}""#)).unwrap_or_default();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{}]}}],"materials":[{}],
"accessors":[{}],"bufferViews":[{{"buffer":0,"byteLength":{points}}},
{{"buffer":0,"byteOffset":{points},"byteLength":{}}}],"buffers":[{{"byteLength":{}{uri}}}]{more}}}"#,
        primitives.join(","),
        materials.join(","),
        accessors.join(","),
        binary.len() - points,
        binary.len()
    );
    (json, binary)
}
