//! Reads PLY files: text, and binary in both byte orders. Only one record at a time is in memory besides the mesh.
//!
//! The crate ply-rs-bw (4.0) reads a line of any length into memory, and makes an object with lists of its own for each
//! face, which a guard in front of it cannot change. [`Body`] reads the numbers in its place.

mod body;
mod header;

use super::Mesh;
use super::mtl::WHITE;
use super::notices::{Kind, Notices};
use super::parts::{MOST, Parts, SkinNumber, check};
use super::polygon::{MOST_CORNERS, Triangulator};
use super::source::Source;
use super::statement::on_line;
use crate::Error;
use body::Body;
use glam::DVec3;
use header::{Element, Header, Property};
use std::io::BufRead;

/// What a property of a vertex is, by the number of its axis or channel.
#[derive(Clone, Copy)]
enum Role {
    Position(usize),
    Normal(usize),
    Colour(usize),
    Other,
}

/// Reads a PLY file.
pub(super) fn read(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Mesh, Error> {
    let header = Header::read(&mut source.bytes).map_err(|what| source.refuse(what))?;
    if let Some(length) = source.length {
        header.check_length(length).map_err(|what| source.refuse(what))?;
    }
    let path = source.path;
    let refuse = |what: String| Error::input(path, what);
    if let Some(line) = header.texture {
        let what = on_line(line, "the texture of a PLY file is not read");
        notices.add(Kind::PlyTexture, || refuse(what).to_string());
    }
    let mut reader = Reader {
        // How many records the file can hold is known, or they are not believed.
        believed: source.length.is_some(),
        body: Body::new(&mut source.bytes, header.order, header.lines),
        parts: Parts::default(),
        triangulator: Triangulator::new(),
        notices,
        notice: &|what| refuse(what).to_string(),
    };
    let mut faces = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => reader.vertices(element),
            "face" => {
                faces |= element.count > 0;
                reader.faces(element)
            }
            "tristrips" => {
                faces |= element.count > 0;
                reader.strips(element)
            }
            _ => reader.skip(element),
        }
        .map_err(refuse)?;
    }
    let parts = reader.parts;
    if parts.is_empty() {
        let what = match (faces, parts.positions.is_empty()) {
            (true, _) => "holds no faces of 3 corners",
            (false, true) => "holds no points and no faces",
            (false, false) => "holds points and no faces: make a surface of them, for example with MeshLab",
        };
        return Err(refuse(what.into()));
    }
    parts.into_mesh(path)
}

struct Reader<'a, R> {
    believed: bool,
    body: Body<R>,
    parts: Parts,
    triangulator: Triangulator,
    notices: &'a mut Notices,
    notice: &'a dyn Fn(String) -> String,
}

impl<R: BufRead> Reader<'_, R> {
    fn vertices(&mut self, element: &Element) -> Result<(), String> {
        let roles: Vec<Role> = element.properties.iter().map(role).collect();
        let has =
            |wanted: fn(Role) -> Option<usize>| (0..3).all(|axis| roles.iter().any(|&role| wanted(role) == Some(axis)));
        if !has(|role| if let Role::Position(axis) = role { Some(axis) } else { None }) {
            return Err("its element vertex lacks a property x, y or z that is one number".into());
        }
        let normals = has(|role| if let Role::Normal(axis) = role { Some(axis) } else { None });
        let colours = has(|role| if let Role::Colour(axis) = role { Some(axis) } else { None });
        if element.count > MOST as u64 {
            return Err(format!("more than {MOST} vertices; split the model"));
        }
        if self.believed {
            self.parts.positions.reserve_exact(element.count as usize);
            self.parts.normals.reserve_exact(if normals { element.count as usize } else { 0 });
            self.parts.colours.reserve_exact(if colours { element.count as usize } else { 0 });
        }
        for i in 0..element.count {
            let ([mut position, mut normal], mut colour) = ([DVec3::ZERO; 2], [0.0; 3]);
            self.body.start(element, i)?;
            for (property, &role) in element.properties.iter().zip(&roles) {
                match role {
                    Role::Position(axis) => {
                        let x = self.body.number(property.kind)?;
                        check(x).map_err(|what| self.body.at(what))?;
                        position[axis] = x;
                    }
                    Role::Normal(axis) => normal[axis] = self.body.number(property.kind)?,
                    Role::Colour(channel) => {
                        let x = self.body.number(property.kind)? / property.kind.most();
                        colour[channel] = if x >= 0.0 { x.min(1.0) as f32 } else { 0.0 };
                    }
                    Role::Other => self.body.skip(property)?,
                }
            }
            self.body.end()?;
            self.parts.positions.push(position);
            if colours {
                self.parts.colours.push(colour);
            }
            if normals {
                if !normal.is_finite() || normal == DVec3::ZERO {
                    normal = DVec3::ZERO;
                    let what = self.body.at("its normal has no direction");
                    self.notices.add(Kind::Normal, || (self.notice)(what));
                }
                self.parts.normals.push(normal);
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element) -> Result<(), String> {
        let list = corners_of(element)?;
        if self.believed {
            self.parts.triangles_of(WHITE, SkinNumber::default()).reserve_exact(element.count as usize);
        }
        let (mut corners, mut points): (Vec<u32>, Vec<DVec3>) = (Vec::new(), Vec::new());
        for i in 0..element.count {
            self.body.start(element, i)?;
            for (number, property) in element.properties.iter().enumerate() {
                if number != list {
                    self.body.skip(property)?;
                    continue;
                }
                corners.clear();
                let count = self.body.count(property)?;
                if count > MOST_CORNERS as u64 {
                    let what = format!("a face of more than {MOST_CORNERS} corners; triangulate it before exporting");
                    return Err(self.body.at(what));
                }
                for _ in 0..count {
                    corners.push(self.index(property)?.ok_or_else(|| self.body.at("index -1 is out of range"))?);
                }
            }
            self.body.end()?;
            if corners.len() < 3 {
                let what = self.body.at("a face needs 3 corners");
                self.notices.add(Kind::Face, || (self.notice)(what));
                continue;
            }
            self.room(corners.len())?;
            let positions = &self.parts.positions;
            points.clear();
            points.extend(corners.iter().map(|&i| positions[i as usize]));
            let cut = self.triangulator.triangles(&points);
            let triangles = self.parts.triangles_of(WHITE, SkinNumber::default());
            triangles.extend(cut.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| corners[i as usize])));
        }
        Ok(())
    }

    /// Reads strips of triangles. In a strip each index makes a triangle with the two before it, and -1 begins anew.
    fn strips(&mut self, element: &Element) -> Result<(), String> {
        let list = corners_of(element)?;
        for i in 0..element.count {
            self.body.start(element, i)?;
            for (number, property) in element.properties.iter().enumerate() {
                if number != list {
                    self.body.skip(property)?;
                    continue;
                }
                let (mut last, mut length) = ([0; 2], 0_u64);
                for _ in 0..self.body.count(property)? {
                    let Some(index) = self.index(property)? else {
                        length = 0;
                        continue;
                    };
                    let [a, b] = last;
                    if length >= 2 && a != b && b != index && index != a {
                        self.room(3)?;
                        let turned = if length.is_multiple_of(2) { [a, b, index] } else { [b, a, index] };
                        self.parts.triangles_of(WHITE, SkinNumber::default()).push(turned);
                    }
                    last = [b, index];
                    length += 1;
                }
            }
            self.body.end()?;
        }
        Ok(())
    }

    fn skip(&mut self, element: &Element) -> Result<(), String> {
        if element.properties.is_empty() {
            return Ok(()); // such records have no bytes, however many there are
        }
        for i in 0..element.count {
            self.body.start(element, i)?;
            element.properties.iter().try_for_each(|property| self.body.skip(property))?;
            self.body.end()?;
        }
        Ok(())
    }

    /// Reads an index of a vertex, or -1 as `None`.
    fn index(&mut self, property: &Property) -> Result<Option<u32>, String> {
        let x = self.body.number(property.kind)?;
        let count = self.parts.positions.len();
        match x {
            -1.0 => Ok(None),
            x if x >= 0.0 && x < count as f64 && x.fract() == 0.0 => Ok(Some(x as u32)),
            _ => Err(self.body.at(format!("index {x} is out of range; there are {count} vertices, counted from 0"))),
        }
    }

    /// Refuses more triangles than there may be.
    fn room(&mut self, more: usize) -> Result<(), String> {
        let full = self.parts.triangles_of(WHITE, SkinNumber::default()).len() > MOST / 3 - more;
        if full { Err(format!("more than {} triangles; split the model", MOST / 3)) } else { Ok(()) }
    }
}

fn role(property: &Property) -> Role {
    let axis = |names: [&str; 3]| names.iter().position(|name| *name == property.name);
    let colour = axis(["red", "green", "blue"]).or(axis(["diffuse_red", "diffuse_green", "diffuse_blue"]));
    match (property.count, axis(["x", "y", "z"]), axis(["nx", "ny", "nz"]), colour) {
        (None, Some(axis), ..) => Role::Position(axis),
        (None, _, Some(axis), _) => Role::Normal(axis),
        (None, _, _, Some(channel)) => Role::Colour(channel),
        _ => Role::Other,
    }
}

/// Returns the number of the property that lists the corners.
fn corners_of(element: &Element) -> Result<usize, String> {
    let list = |property: &Property| {
        property.count.is_some() && ["vertex_indices", "vertex_index"].contains(&property.name.as_str())
    };
    let found = element.properties.iter().position(list);
    found
        .or((element.count == 0).then_some(0))
        .ok_or_else(|| format!("its element {} lacks a list vertex_indices", Error::shown(&element.name)))
}
