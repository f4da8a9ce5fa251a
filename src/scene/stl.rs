//! Reads STL files, text and binary. Only one triangle at a time is in memory besides the mesh.
//!
//! The crate stl_io (0.11) reads the numbers of text as float32, and keeps a line of any length in memory. STL is so
//! simple that guarding it would take more than reading it.

use super::Mesh;
use super::notices::{Kind, Notices};
use super::parts::{MOST, Parts, SkinNumber, check};
use super::source::{Source, fill};
use super::statement::{Statement, Statements, number, on_line, quoted};
use crate::Error;
use glam::DVec3;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

const HEADER: usize = 80;
/// The bytes of a triangle: a normal, three corners and an attribute.
const TRIANGLE: usize = 50;

const NO_TRIANGLES: &str = "holds no triangles; give an STL file with triangles";

/// Joins triangles that share a corner. STL gives each triangle its own corners.
#[derive(Default)]
struct Welder {
    parts: Parts,
    vertices: HashMap<[u64; 3], u32>,
    /// The number of triangles, also of those that are left out.
    triangles: u64,
}

impl Welder {
    /// Adds a triangle. Returns false if it has no area, and is left out.
    fn add(&mut self, corners: [DVec3; 3]) -> Result<bool, String> {
        self.triangles += 1;
        corners.iter().flat_map(|p| p.to_array()).try_for_each(check)?;
        let [a, b, c] = corners;
        if (b - a).cross(c - a) == DVec3::ZERO {
            return Ok(false);
        }
        if self.parts.positions.len() > MOST - 3 || self.triangles > MOST as u64 / 3 {
            return Err(format!("more than {} triangles; split the model", MOST / 3));
        }
        let triangle = corners.map(|p| {
            let p = p + 0.0; // -0 becomes 0
            *self.vertices.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                self.parts.positions.push(p);
                self.parts.positions.len() as u32 - 1
            })
        });
        self.parts.triangles_of([1.0; 3], SkinNumber::default()).push(triangle);
        Ok(true)
    }

    fn into_mesh(mut self, refuse: impl Fn(&str) -> Error, path: &Path) -> Result<Mesh, Error> {
        self.vertices = HashMap::new();
        if self.triangles == 0 {
            return Err(refuse(NO_TRIANGLES));
        }
        if self.parts.positions.is_empty() {
            return Err(refuse("all its triangles are without area"));
        }
        self.parts.into_mesh(path)
    }
}

/// Reads a binary STL file.
pub(super) fn read_binary(mut source: Source<impl BufRead>, notices: &mut Notices) -> Result<Mesh, Error> {
    let mut header = [0; HEADER + 4];
    if !fill(&mut source.bytes, &mut header).map_err(|what| source.refuse(what))? {
        return Err(source.refuse("this STL file ends inside its header"));
    }
    let count = u32::from_le_bytes([header[80], header[81], header[82], header[83]]);
    let cut_short = |count: u32, holds: u64| {
        format!("this STL file claims {count} triangles, and ends after {holds}: it has been cut short")
    };
    if let Some(length) = source.length {
        let holds = length.saturating_sub(header.len() as u64) / TRIANGLE as u64;
        if holds < u64::from(count) {
            return Err(source.refuse(cut_short(count, holds)));
        }
    }
    let mut coloured = header.windows(6).any(|word| word == b"COLOR=");
    let mut welder = Welder::default();
    for i in 0..count {
        let mut triangle = [0; TRIANGLE];
        if !fill(&mut source.bytes, &mut triangle).map_err(|what| source.refuse(what))? {
            return Err(source.refuse(cut_short(count, i.into())));
        }
        let float = |at: usize| {
            f64::from(f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]]))
        };
        let corner = |at: usize| DVec3::new(float(at), float(at + 4), float(at + 8));
        let place = |what: String| format!("triangle {}: {what}", i + 1);
        let kept = welder.add([12, 24, 36].map(corner)).map_err(|what| source.refuse(place(what)))?;
        if !kept {
            notices.add(Kind::Facet, || source.refuse(place("it has no area".into())).to_string());
        }
        coloured |= triangle[49] & 0x80 != 0; // the mark of a colour
    }
    if coloured {
        notices.add(Kind::Tints, || source.refuse("the colours of STL files are not read").to_string());
    }
    welder.into_mesh(|what| source.refuse(what), source.path)
}

/// The triangle that is being read from text, and whether its end is still to come.
#[derive(Default)]
struct Facet {
    open: Option<u64>,
    corners: Vec<DVec3>,
}

/// Reads an STL file of text.
pub(super) fn read_text(source: Source<impl BufRead>, notices: &mut Notices) -> Result<Mesh, Error> {
    let Source { bytes, path, .. } = source;
    let mut statements = Statements::new(bytes, path);
    let (mut welder, mut facet, mut ended) = (Welder::default(), Facet::default(), false);
    while let Some(statement) = statements.next()? {
        ended = false;
        match statement.keyword().to_ascii_lowercase().as_str() {
            "solid" | "outer" | "endloop" => {}
            "endsolid" => ended = true,
            "color" => notices.add(Kind::Tints, || statement.notice("the colours of STL files are not read")),
            "facet" => facet.start(statement.line()).map_err(|what| statement.refuse(what))?,
            "vertex" => facet.corner(&statement).map_err(|what| statement.refuse(what))?,
            "endfacet" => {
                let corners = facet.end().map_err(|what| statement.refuse(what))?;
                if !welder.add(corners).map_err(|what| statement.refuse(what))? {
                    notices.add(Kind::Facet, || statement.notice("a triangle without area ends here"));
                }
            }
            other => {
                let what = format!("{} is no statement of STL", quoted(other));
                return Err(statement.refuse(what));
            }
        }
    }
    let refuse = |what: &str| Error::input(path, what);
    if let Some(line) = facet.open {
        return Err(refuse(&on_line(line, "this facet has no end: the file has been cut short")));
    }
    if !ended {
        notices.add(Kind::End, || refuse("it does not end with endsolid").to_string());
    }
    welder.into_mesh(refuse, path)
}

impl Facet {
    fn start(&mut self, line: u64) -> Result<(), String> {
        self.corners.clear();
        match self.open.replace(line) {
            None => Ok(()),
            Some(line) => Err(format!("the facet of line {line} has not ended; write endfacet")),
        }
    }

    fn corner(&mut self, statement: &Statement) -> Result<(), String> {
        if self.open.is_none() || self.corners.len() == 3 {
            return Err("a facet has three corners, between facet and endfacet".into());
        }
        let mut words = statement.words();
        let mut next = || number(words.next().ok_or("vertex needs three numbers")?);
        self.corners.push(DVec3::new(next()?, next()?, next()?));
        Ok(())
    }

    fn end(&mut self) -> Result<[DVec3; 3], String> {
        match (self.open.take(), self.corners.as_slice()) {
            (Some(_), &[a, b, c]) => Ok([a, b, c]),
            _ => Err("a facet has three corners, between facet and endfacet".into()),
        }
    }
}
