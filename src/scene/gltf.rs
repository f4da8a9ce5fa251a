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
mod file;
mod json;
mod materials;

use super::motion::placed;
use super::mtl::WHITE;
use super::notices::{Kind, Notices};
use super::parts::{MOST, Parts};
use super::source::{Contents, Source};
use super::texture::{FARTHEST_COORDINATE, Skin};
use super::{Lens, View};
use crate::Error;
use animation::Animations;
use data::Data;
use file::{MOST_JSON, chunks, parse};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3};
use json::{Node, Primitive, Root};
use materials::{Look, Materials, encoded};
use std::collections::HashSet;
use std::io::{BufRead, Read};

/// The triangles, and the positions, that the nodes of a small file may lay out. A file of more bytes may lay out as
/// many as it has bytes.
const MOST_LAID_OUT: usize = 1 << 25;

/// The most primitives, counted once for each node that shows them.
const MOST_VISITS: u64 = 1 << 24;

/// Reads a glTF file of text.
pub(super) fn read_text(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Contents, Error> {
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
pub(super) fn read_binary(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Contents, Error> {
    let parts = chunks(&mut source);
    parts.and_then(|(root, binary)| read(&root, &source, binary, notices)).map_err(|what| source.refuse(what))
}

/// Lays out the scene of a file.
fn read<R>(
    root: &Root,
    source: &Source<R>,
    binary: Option<Vec<u8>>,
    notices: &mut Notices,
) -> Result<Contents, String> {
    let most = root.buffers.iter().fold(0_u64, |sum, buffer| sum.saturating_add(buffer.byte_length));
    let most = most.min(binary.as_ref().map_or(source.length.unwrap_or(0), |binary| binary.len() as u64));
    let mut layout = Layout {
        root,
        data: Data::new(root, source.path, binary),
        materials: Materials::new(root),
        parts: Parts::default(),
        cameras: Vec::new(),
        corners: 0,
        visits: 0,
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
        layout.node(number, node, to_world).map_err(|what| format!("{}: {what}", called(root, number)))?;
        for &child in node.children.iter().rev() {
            if let Some(parent) = parents.get_mut(child as usize) {
                *parent = Some(number);
            }
            open.push((child, to_world));
        }
    }
    let Layout { parts, cameras: nodes_of_cameras, notices, mut data, notice, materials, .. } = layout;
    drop(materials); // it keeps a picture
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
        if name.is_empty() || known.contains(&name) {
            name = format!("{name}#{i}");
        }
        while !known.insert(name.clone()) {
            name.push('#');
        }
        let nodes = std::iter::successors(Some(node), |&node| parents[node as usize]);
        let why = match animations.of_camera(nodes, &view, &mut data) {
            Ok(None) => None,
            Ok(Some((motion, ambiguous))) => {
                motions.push((name.clone(), motion));
                ambiguous
                    .then(|| "several animations move the same of its camera, and the first of them is read".into())
            }
            Err(why) => Some(format!("its camera stands still: {why}")),
        };
        if let Some(why) = why {
            notices.add(Kind::Motion, || notice(format!("{}: {why}", called(root, node))));
        }
        cameras.push((name, view));
    }
    if let Some(animation) = animations.of_pointer() {
        let what = format!("animation {animation}: KHR_animation_pointer is not read");
        notices.add(Kind::Motion, || notice(what));
    }
    // The nodes that have a mesh, or one below them.
    let mut carries = vec![false; root.nodes.len()];
    for number in (0..root.nodes.len()).filter(|&number| seen[number] && root.nodes[number].mesh.is_some()) {
        let mut next = Some(number as u32);
        while let Some(node) = next.filter(|&node| !std::mem::replace(&mut carries[node as usize], true)) {
            next = parents[node as usize];
        }
    }
    for node in animations.moved().filter(|&node| carries.get(node as usize) == Some(&true)) {
        let what = format!("{}: an animation moves it, and only those of cameras are read", called(root, node));
        notices.add(Kind::Pose, || notice(what));
    }
    let mesh = parts.into_mesh(source.path).map_err(|e| match e {
        Error::Input { what, .. } => what,
        e => e.to_string(),
    })?;
    Ok(Contents { mesh, cameras, motions, files: data.into_files().into_iter().collect(), notices: Vec::new() })
}

/// Returns what messages call a node.
fn called(root: &Root, number: u32) -> String {
    let name = root.nodes.get(number as usize).and_then(|node| node.name.as_deref());
    name.map_or_else(|| format!("node {number}"), |name| format!("node {number} '{}'", Error::shown(name)))
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
    /// The number of primitives, counted once for each node that shows them.
    visits: u64,
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
                    let what = format!("{}: its camera cannot be used: {why}", called(root, number));
                    self.notices.add(Kind::Camera, || (self.notice)(what));
                }
            }
        }
        let Some(shape) = node.mesh else { return Ok(()) };
        let shape = root.meshes.get(shape as usize).ok_or_else(|| format!("there is no mesh {shape}"))?;
        let told = |what: &str| (self.notice)(format!("{}: {what}", called(root, number)));
        if node.extensions.instancing.is_some() {
            self.notices.add(Kind::Instances, || told("EXT_mesh_gpu_instancing is not read"));
        }
        self.visits += shape.primitives.len() as u64;
        if self.visits > MOST_VISITS {
            return Err(format!("more than {MOST_VISITS} primitives, counted once for each node that shows them"));
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
                if look.alpha * self.data.lowest_alpha(colour, count as usize)? < look.least_alpha {
                    let what = "the alpha of vertices is not read, and it is below the cutoff of their material";
                    self.notices
                        .add(Kind::VertexAlpha, || (self.notice)(format!("{}: {what}", called(self.root, node))));
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
        self.notices.add(Kind::Bare, || (self.notice)(format!("{}: {why}", called(self.root, node))));
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
