//! Reads glTF 2 files, and GLB files, which hold the same in one binary file.
//!
//! The JSON is read by serde_json into the types of [`json`]. The crate gltf (1.4) keeps transforms and cameras in
//! float32, reads only positions of float32, refuses files that need `KHR_mesh_quantization`, and asserts and unwraps
//! where a stride or a sparse accessor is wrong.
//!
//! A glTF file can describe far more triangles than it has bytes, because nodes share meshes. Their number is limited
//! before they are laid out.

mod animation;
mod data;
mod json;
mod materials;

use super::motion::placed;
use super::mtl::WHITE;
use super::notices::{Kind, Notices};
use super::parts::{MOST, Parts};
use super::source::{Source, fill};
use super::texture::{FARTHEST_COORDINATE, Skin};
use super::{CameraMotion, Lens, Mesh, View};
use crate::Error;
use animation::Animations;
use data::Data;
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3};
use json::{Node, Primitive, Root};
use materials::{Look, Materials, encoded};
use std::collections::HashSet;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};

/// A mesh, and the cameras and those that move, with their names.
type Model = (Mesh, Vec<(String, View)>, Vec<(String, CameraMotion)>);

/// The deepest nesting of brackets in JSON, which is the deepest that serde_json reads.
const DEEPEST: u32 = 128;
/// The most bytes of JSON.
const MOST_JSON: u64 = 1 << 29;
/// The triangles, and the positions, that the nodes of a small file may lay out. A file of more bytes may lay out as
/// many as it has bytes.
const MOST_LAID_OUT: usize = 1 << 25;

const TEXT_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// Extensions that a file may require, because they do not change the shape of surfaces or are read. So are all that
/// begin with [`OF_MATERIALS`].
const KNOWN: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "KHR_xmp_json_ld",
    "EXT_texture_webp",
    "EXT_texture_avif",
    "MSFT_texture_dds",
];
const OF_MATERIALS: &str = "KHR_materials_";

/// Reads a glTF file of text.
pub(super) fn read_text(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Model, Error> {
    let mut text = (&mut source.bytes).take(MOST_JSON + 1);
    // A byte order mark is no JSON, but some editors write it.
    let start = text.fill_buf().unwrap_or_default();
    if start.starts_with("\u{feff}".as_bytes()) {
        text.consume(3);
    }
    let root = parse(&mut text);
    if text.limit() == 0 {
        return Err(source.refuse(format!("more than {MOST_JSON} bytes of JSON; export it as GLB")));
    }
    root.and_then(|root| read(&root, &source, None, notices)).map_err(|what| source.refuse(what))
}

/// Reads a GLB file.
pub(super) fn read_binary(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Model, Error> {
    let parts = chunks(&mut source);
    parts.and_then(|(root, binary)| read(&root, &source, binary, notices)).map_err(|what| source.refuse(what))
}

/// Reads the two parts of a GLB file.
fn chunks<R: BufRead>(source: &mut Source<R>) -> Result<(Root, Option<Vec<u8>>), String> {
    let bytes = &mut source.bytes;
    let mut numbers = [0; 12];
    if !fill(bytes, &mut numbers)? {
        return Err("this GLB file ends inside its header".into());
    }
    let [_, version, length] = [0, 4, 8].map(|at| number(&numbers[at..]));
    if version != 2 {
        return Err(format!("this is glTF {version}, and only glTF 2 is read: export it as glTF 2"));
    }
    if let Some(holds) = source.length.filter(|&holds| holds < u64::from(length)) {
        return Err(format!("this GLB file claims {length} bytes, and has {holds}: it has been cut short"));
    }
    let left = length.saturating_sub(12);
    let Some((kind, size)) = chunk(bytes, left)? else { return Err("this GLB file holds no JSON".into()) };
    if kind != TEXT_CHUNK || u64::from(size) > MOST_JSON {
        return Err(format!("this GLB file does not begin with JSON, or with more than {MOST_JSON} bytes of it"));
    }
    let mut text = bytes.take(size.into());
    let root = parse(&mut text)?;
    if text.limit() > 0 {
        return Err("this GLB file ends inside its JSON: it has been cut short".into());
    }
    let left = left.saturating_sub(8).saturating_sub(size);
    let binary = match chunk(bytes, left)? {
        Some((BINARY_CHUNK, size)) => {
            let mut binary = Vec::new();
            // The size is that of a part of the file if the file's length is known.
            binary.reserve_exact(if source.length.is_some() { size as usize } else { 0 });
            bytes.take(size.into()).read_to_end(&mut binary).map_err(|e| format!("cannot be read: {e}"))?;
            if binary.len() < size as usize {
                return Err("this GLB file ends inside its binary part: it has been cut short".into());
            }
            Some(binary)
        }
        _ => None,
    };
    Ok((root, binary))
}

/// Reads the head of a part of a GLB file, of which `left` bytes are left: its kind and its size.
fn chunk(bytes: &mut impl BufRead, left: u32) -> Result<Option<(u32, u32)>, String> {
    let mut numbers = [0; 8];
    if left < 8 || !fill(bytes, &mut numbers)? {
        return Ok(None);
    }
    let [size, kind] = [0, 4].map(|at| number(&numbers[at..]));
    if size > left - 8 {
        return Err(format!("a part of this GLB file claims {size} bytes, and {} are left", left - 8));
    }
    Ok(Some((kind, size)))
}

fn number(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Parses the JSON, to the end of `text`.
fn parse(text: &mut impl Read) -> Result<Root, String> {
    let text = Shallow { text, depth: 0, string: false, escaped: false };
    let root: Root = serde_json::from_reader(BufReader::new(text)).map_err(|e| {
        match e.io_error_kind() {
            Some(ErrorKind::InvalidData) => return format!("this is no glTF 2: {e}"),
            Some(_) => return format!("cannot be read: {e}"),
            None => {}
        }
        let (line, column) = (e.line(), e.column());
        let what = e.to_string();
        let what = what.rsplit_once(" at line ").map_or(what.as_str(), |(what, _)| what);
        format!("this is no glTF 2: line {line}, column {column}: {}", Error::shown(what))
    })?;
    if !root.asset.version.starts_with("2.") {
        let version = Error::shown(&root.asset.version);
        return Err(format!("this is glTF {version}, and only glTF 2 is read: export it as glTF 2"));
    }
    match root
        .extensions_required
        .iter()
        .find(|name| !name.starts_with(OF_MATERIALS) && !KNOWN.contains(&name.as_str()))
    {
        None => Ok(root),
        Some(name) => {
            let name = Error::shown(name);
            Err(format!("it requires the extension {name}, which is not read: export it without"))
        }
    }
}

/// Reads JSON whose brackets are not nested too deeply. serde_json keeps a byte for each open bracket of what it skips.
struct Shallow<R> {
    text: R,
    depth: u32,
    /// Whether the text stands in a string, and after a backslash.
    string: bool,
    escaped: bool,
}

impl<R: Read> Read for Shallow<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.text.read(buffer)?;
        for &byte in &buffer[..count] {
            match (self.string, byte) {
                _ if std::mem::take(&mut self.escaped) => {}
                (true, b'\\') => self.escaped = true,
                (_, b'"') => self.string = !self.string,
                (false, b'[' | b'{') => self.depth += 1,
                (false, b']' | b'}') => self.depth = self.depth.saturating_sub(1),
                _ => {}
            }
            if self.depth > DEEPEST {
                let what = format!("its JSON has brackets more than {DEEPEST} deep");
                return Err(io::Error::new(ErrorKind::InvalidData, what));
            }
        }
        Ok(count)
    }
}

/// Lays out the scene of a file.
fn read<R>(root: &Root, source: &Source<R>, binary: Option<Vec<u8>>, notices: &mut Notices) -> Result<Model, String> {
    let most = root.buffers.iter().fold(0_u64, |sum, buffer| sum.saturating_add(buffer.byte_length));
    let most = most.min(binary.as_ref().map_or(source.length.unwrap_or(0), |binary| binary.len() as u64));
    let mut layout = Layout {
        root,
        data: Data::new(root, source.path, binary),
        materials: Materials::new(root),
        parts: Parts::default(),
        cameras: Vec::new(),
        corners: 0,
        most: (most as usize).clamp(MOST_LAID_OUT, MOST / 3),
        notices,
        notice: &|what| source.refuse(what).to_string(),
    };
    let mut parents: Vec<Option<u32>> = vec![None; root.nodes.len()];
    let mut seen = vec![false; root.nodes.len()];
    let mut open: Vec<(u32, DAffine3)> =
        roots(root)?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    while let Some((number, parent)) = open.pop() {
        let node = root.nodes.get(number as usize).ok_or_else(|| format!("there is no node {number}"))?;
        if std::mem::replace(&mut seen[number as usize], true) {
            return Err(format!("node {number} stands twice in the tree of nodes"));
        }
        let to_world = parent * local(node).ok_or_else(|| format!("node {number} has a matrix that is not affine"))?;
        layout.node(number, node, to_world).map_err(|what| format!("node {number}: {what}"))?;
        for &child in node.children.iter().rev() {
            if let Some(parent) = parents.get_mut(child as usize) {
                *parent = Some(number);
            }
            open.push((child, to_world));
        }
    }
    let Layout { parts, cameras: nodes_of_cameras, notices, mut data, notice, .. } = layout;
    if parts.is_empty() && notices.has(Kind::Invisible) {
        return Err(
            "its scene holds no triangles that are seen: alpha is below the cutoff in the materials of all".into()
        );
    } else if parts.is_empty() {
        return Err("its scene holds no triangles; export the meshes with it".into());
    }
    let mut known = HashSet::new();
    let (mut cameras, mut motions, mut animations) = (Vec::new(), Vec::new(), Animations::new(root));
    for (i, (mut name, view, node)) in nodes_of_cameras.into_iter().enumerate() {
        if name.is_empty() || !known.insert(name.clone()) {
            name = format!("{name}#{i}");
            known.insert(name.clone());
        }
        let nodes = std::iter::successors(Some(node), |&node| parents[node as usize]);
        let why = match animations.of_camera(nodes, &view, &mut data) {
            Ok(None) => None,
            Ok(Some((motion, more))) => {
                motions.push((name.clone(), motion));
                more.map(String::from)
            }
            Err(why) => Some(format!("its camera stands still: {why}")),
        };
        if let Some(why) = why {
            notices.add(Kind::Motion, || notice(format!("node {node}: {why}")));
        }
        cameras.push((name, view));
    }
    for node in animations.others() {
        let what = format!("node {node}: an animation moves it, and only those of cameras are read");
        notices.add(Kind::Pose, || notice(what));
    }
    let mesh = parts.into_mesh(source.path).map_err(|e| match e {
        Error::Input { what, .. } => what,
        e => e.to_string(),
    })?;
    Ok((mesh, cameras, motions))
}

/// Returns the roots of the default scene: the first one if none is the default, and all trees if there is no scene.
fn roots(root: &Root) -> Result<Vec<u32>, String> {
    let number = root.scene.unwrap_or(0);
    match root.scenes.get(number as usize) {
        Some(scene) => Ok(scene.nodes.to_vec()),
        None if root.scenes.is_empty() && number == 0 => {
            let children: HashSet<u32> = root.nodes.iter().flat_map(|node| node.children.iter().copied()).collect();
            Ok((0..root.nodes.len() as u32).filter(|node| !children.contains(node)).collect())
        }
        None => Err(format!("there is no scene {number}")),
    }
}

/// Returns the transform of a node to its parent, or `None` if it is not affine.
fn local(node: &Node) -> Option<DAffine3> {
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix);
        return (matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0]).then(|| DAffine3::from_mat4(matrix));
    }
    let (translation, rotation, scale) = parts_of(node);
    Some(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// Returns the translation, the rotation and the scale of a node that has no matrix.
fn parts_of(node: &Node) -> (DVec3, DQuat, DVec3) {
    let vector = |of: &Option<Box<[f64; 3]>>, default| of.as_deref().map_or(default, |v| DVec3::from_array(*v));
    let rotation = node.rotation.as_deref().map_or(DQuat::IDENTITY, |q| DQuat::from_array(*q));
    // A rotation of float32 numbers has not quite the length 1.
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    (vector(&node.translation, DVec3::ZERO), rotation, vector(&node.scale, DVec3::ONE))
}

/// The scene that is being laid out.
struct Layout<'a> {
    root: &'a Root,
    data: Data<'a>,
    materials: Materials<'a>,
    parts: Parts,
    /// The cameras: their names, their views, and their nodes.
    cameras: Vec<(String, View, u32)>,
    /// The number of corners of triangles, and of strips and fans.
    corners: u64,
    /// The most triangles, and the most positions.
    most: usize,
    notices: &'a mut Notices,
    notice: &'a dyn Fn(String) -> String,
}

impl Layout<'_> {
    fn node(&mut self, number: u32, node: &Node, to_world: DAffine3) -> Result<(), String> {
        let root = self.root;
        if let Some(camera) = node.camera {
            let camera = root.cameras.get(camera as usize).ok_or_else(|| format!("there is no camera {camera}"))?;
            let name = node.name.as_deref().or(camera.name.as_deref()).unwrap_or_default();
            let view = view(camera, to_world);
            match view.as_ref().map(View::check) {
                Some(Ok(())) => self.cameras.extend(view.map(|view| (name.to_string(), view, number))),
                refused => {
                    let why = match refused {
                        Some(Err(e)) => e.to_string(),
                        _ => "it is neither perspective nor orthographic, or has no direction".into(),
                    };
                    let what = format!("node {number}: its camera cannot be used: {why}");
                    self.notices.add(Kind::Camera, || (self.notice)(what));
                }
            }
        }
        let Some(shape) = node.mesh else { return Ok(()) };
        let shape = root.meshes.get(shape as usize).ok_or_else(|| format!("there is no mesh {shape}"))?;
        let told = |what: &str| (self.notice)(format!("node {number}: {what}"));
        if node.extensions.instancing.is_some() {
            self.notices.add(Kind::Instances, || told("EXT_mesh_gpu_instancing is not read"));
        }
        for primitive in shape.primitives.iter() {
            if node.skin.is_some() || primitive.targets.is_some() {
                self.notices.add(Kind::Pose, || told("skins and morph targets are not read"));
            }
            match (primitive.mode, primitive.attributes.position) {
                (7.., _) => return Err(format!("there is no mode {}", primitive.mode)),
                (0..=3, _) => self.notices.add(Kind::Primitive, || told("points and lines are not read")),
                (_, None) => self.notices.add(Kind::Primitive, || told("a primitive without POSITION")),
                (_, Some(position)) => self.primitive(number, primitive, position, to_world)?,
            }
        }
        Ok(())
    }

    fn primitive(&mut self, node: u32, primitive: &Primitive, position: u32, to_world: DAffine3) -> Result<(), String> {
        let look = self.materials.look(primitive.material, &mut self.data, self.notices, self.notice)?;
        if !look.visible {
            return Ok(());
        }
        let count = self.data.accessor(position)?.count;
        let corners = match primitive.indices {
            Some(indices) => self.data.accessor(indices)?.count,
            None => count,
        };
        let first = self.parts.positions.len();
        let most = self.most as u64;
        if count > most - first as u64 || corners > 3 * most - self.corners {
            return Err(format!("more than {most} triangles or positions, counted once for each node that shows them"));
        }
        self.corners += corners;
        let mut positions = self.data.vectors(position, count as usize)?;
        let normals = match primitive.attributes.normal {
            Some(normal) => self.data.vectors(normal, count as usize)?,
            None => Vec::new(),
        };
        let colours = match primitive.attributes.colour {
            Some(colour) => {
                if self.data.lowest_alpha(colour, count as usize)? < look.least_alpha {
                    let what = "the alpha of vertices is not read, and it is below the cutoff of their material";
                    self.notices.add(Kind::VertexAlpha, || (self.notice)(format!("node {node}: {what}")));
                }
                self.data.colours(colour, count as usize)?
            }
            None => Vec::new(),
        };
        let indices = primitive.indices.map(|indices| self.data.indices(indices)).transpose()?;
        if let Some(i) = indices.iter().flatten().find(|&&i| u64::from(i) >= count) {
            return Err(format!("index {i} is out of range; there are {count} positions, counted from 0"));
        }
        let (coordinates, skin) = self.laid(node, primitive, look.clone(), count as usize)?;
        let skin = self.parts.skin(skin);
        let at = |i: usize| indices.as_ref().map_or(i as u32, |indices| indices[i]) + first as u32;
        let corners = corners as usize;
        let triangles = self.parts.triangles_of(look.colour, skin);
        match primitive.mode {
            4 if corners.is_multiple_of(3) => {
                triangles.reserve(corners / 3);
                triangles.extend((0..corners / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2].map(at)));
            }
            4 => return Err(format!("{corners} corners make no triangles; their number is no multiple of 3")),
            5 => {
                let turned = |i: usize| if i.is_multiple_of(2) { [i, i + 1, i + 2] } else { [i + 1, i, i + 2] };
                let strip = (0..corners.saturating_sub(2)).map(|i| turned(i).map(at));
                // Strips are joined by triangles without area.
                triangles.extend(strip.filter(|&[a, b, c]| a != b && b != c && c != a));
            }
            _ => triangles.extend((1..corners.saturating_sub(1)).map(|i| [0, i, i + 1].map(at))),
        }

        if to_world != DAffine3::IDENTITY {
            positions.iter_mut().for_each(|p| *p = to_world.transform_point3(*p));
        }
        if !normals.is_empty() || !self.parts.normals.is_empty() {
            self.parts.normals.resize(first, DVec3::ZERO); // the positions before have no normals
            let to_world = of_normals(to_world.matrix3);
            self.parts.normals.extend(normals.into_iter().map(|n| {
                let n = to_world * n;
                if n.is_finite() { n } else { DVec3::ZERO }
            }));
            self.parts.normals.resize(first + positions.len(), DVec3::ZERO);
        }
        if !colours.is_empty() || !self.parts.colours.is_empty() {
            self.parts.colours.resize(first, WHITE);
            self.parts.colours.extend(colours.into_iter().map(|colour| colour.to_array().map(encoded)));
            self.parts.colours.resize(first + positions.len(), WHITE);
        }
        if !coordinates.is_empty() || !self.parts.coordinates.is_empty() {
            self.parts.coordinates.resize(first, DVec2::ZERO);
            self.parts.coordinates.extend(coordinates);
            self.parts.coordinates.resize(first + positions.len(), DVec2::ZERO);
        }
        if first == 0 {
            self.parts.positions = positions;
        } else {
            self.parts.positions.extend(positions);
        }
        Ok(())
    }

    /// Returns the coordinates of a primitive's `count` positions in the texture of its look, and the skin. Without
    /// coordinates there is no skin.
    fn laid(
        &mut self,
        node: u32,
        primitive: &Primitive,
        look: Look,
        count: usize,
    ) -> Result<(Vec<DVec2>, Skin), String> {
        let Some(coordinates) = look.coordinates else { return Ok((Vec::new(), Skin::default())) };
        let set = coordinates.set;
        let why = match primitive.attributes.coordinates(set) {
            None => format!("a primitive lacks TEXCOORD_{set}, and its material has a texture"),
            Some(accessor) => {
                let placed: Vec<DVec2> =
                    self.data.coordinates(accessor, count)?.into_iter().map(|at| coordinates.placed(at)).collect();
                // The comparison is written so that NaN is refused too.
                if placed.iter().all(|at| at.abs().max_element() <= FARTHEST_COORDINATE && at.is_finite()) {
                    return Ok((placed, look.skin));
                }
                format!("a primitive has texture coordinates past {FARTHEST_COORDINATE:e} in magnitude, or not finite")
            }
        };
        self.notices.add(Kind::Bare, || (self.notice)(format!("node {node}: {why}")));
        Ok((Vec::new(), Skin::default()))
    }
}

/// Returns the transform of normals that belongs to one of positions: its transposed inverse times its determinant's
/// magnitude, which exists even if the inverse does not.
fn of_normals(m: DMat3) -> DMat3 {
    if m == DMat3::IDENTITY {
        return m;
    }
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}

/// Returns the view of a camera.
fn view(camera: &json::Camera, to_world: DAffine3) -> Option<View> {
    let (lens, near, far) = match (&camera.perspective, &camera.orthographic) {
        (Some(camera), _) => (Lens::FovY(camera.yfov), camera.znear, camera.zfar),
        (None, Some(camera)) => (Lens::Height(2.0 * camera.ymag), camera.znear, Some(camera.zfar)),
        (None, None) => return None,
    };
    // An orthographic camera may see from its own plane on, which the view's planes exclude.
    let near = (near > 0.0).then_some(near);
    Some(View { lens: Some(lens), near, far, ..placed(to_world)? })
}
