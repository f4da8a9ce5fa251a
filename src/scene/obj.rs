//! OBJ files into meshes.
//!
//! The file is read statement by statement and none of it is kept but what a mesh is made of: positions, normals, and
//! triangles cut as soon as their face is read. So memory follows from what the file says, not from its length: at
//! worst 20 bytes for one of the file (`tests/memory.rs`), for a file of nothing but large faces of short indices, and
//! none for what is not understood. Nothing is set aside for a number that the file claims.
//!
//! It is read here and not by tobj, which tests compare with this: on whole files tobj 4.0.5
//! - keeps some hundred bytes for a face, whose statement may have eight;
//! - names no lines in its errors;
//! - panics on `vt` and `vn` indices before the first, or near 2^63;
//! - accepts NaN and infinity;
//! - makes triangles of polylines (`l 1 2 3`), and fans of concave faces;
//! - passes over a corner without a normal, so that normals no longer stand beside their positions;
//! - silently loses the first line after a byte order mark, and with it every index is off by one;
//! - refuses continued lines, comments after a statement, tabs after `usemtl`, bytes that are not UTF-8, and colours
//!   on some positions only.
//!
//! Not read: texture coordinates, colours and weights that follow a position, and curved surfaces.

use super::mesh::{FARTHEST, Group, Mesh};
use super::mtl::{self, MOST_LIBRARIES, WHITE};
use super::polygon::Triangulator;
use super::statement::{Statement, Statements, number, quoted};
use crate::Error;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Faces with more corners are refused.
const MOST_CORNERS: usize = 1 << 16;

/// Positions, vertices and triangles have indices of 32 bits.
const MOST: usize = u32::MAX as usize;

/// No normal.
const NONE: u32 = u32::MAX;

/// What has been read of a model.
#[derive(Default)]
struct Model {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    mesh: Vertices,
    triangles: Vec<[u32; 3]>,
    /// Each material's number, from 1 on in order of appearance; 0 is no material.
    materials: HashMap<Box<str>, u32>,
    /// From this triangle on, this material.
    uses: Vec<(u32, u32)>,
    /// What `mtllib` statements name, with the line: each name once, since some exporters repeat it before each object.
    libraries: Vec<(u64, String)>,
}

/// The vertices of a mesh: a position and a normal, each pair once, in the order in which faces use them.
#[derive(Default)]
struct Vertices {
    of: HashMap<[u32; 2], u32>,
    positions: Vec<DVec3>,
    /// Empty until a corner has one.
    normals: Vec<DVec3>,
}

impl Mesh {
    /// Reads an OBJ file and the MTL files that it names, which must lie in its folder. Pipes and devices are read too.
    ///
    /// Polygons are triangulated, concave ones too up to 512 corners; larger ones are cut as if they were convex.
    /// Points and lines are passed over; a material that no MTL file defines is white. Positions keep float64. Not
    /// finite or past 1e15 in magnitude, they are refused; so are lines and statements longer than 2 MiB, faces of
    /// more than 65536 corners, and more than 200 MTL files.
    pub fn load_obj(path: &Path) -> Result<Mesh, Error> {
        if path.is_dir() {
            return Err(Error::input(path, "is a folder; name an OBJ file"));
        }
        let file = File::open(path).map_err(|e| Error::input(path, format!("cannot be read: {e}")))?;
        // The model's folder: where it was found, and where it really lies if that is a link.
        let folders = [Some(path.to_path_buf()), path.canonicalize().ok()].into_iter().flatten().map(|path| match path
            .parent()
        {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
            _ => PathBuf::from("."),
        });
        let folders: Vec<PathBuf> = folders.collect();
        let mut seen = HashSet::new();
        read(BufReader::new(file), path, |name| {
            let mut files = mtl::libraries(&folders, name)?;
            files.retain(|file| seen.insert(file.clone()));
            let open = |path: PathBuf| match File::open(&path) {
                Ok(file) => Ok((path, BufReader::new(file))),
                Err(e) => Err(format!("material file {} cannot be read ({e})", quoted(name))),
            };
            files.into_iter().map(open).collect()
        })
    }

    /// Reads a model from memory or from a stream, as [`Mesh::load_obj`] reads a file. `name` stands in messages;
    /// `open` is asked for what each `mtllib` statement names, after all of the model has been read.
    pub fn read_obj<M: BufRead>(
        obj: impl BufRead,
        name: &Path,
        mut open: impl FnMut(&str) -> io::Result<M>,
    ) -> Result<Mesh, Error> {
        read(obj, name, |library| match open(library) {
            Ok(file) => Ok(vec![(name.with_file_name(library), file)]),
            Err(e) => Err(format!("material file {} cannot be read ({e})", quoted(library))),
        })
    }
}

/// Reads a model. `open` fetches what a `mtllib` statement names, each file with its path; `path` is for messages.
fn read<M: BufRead>(
    obj: impl BufRead,
    path: &Path,
    mut open: impl FnMut(&str) -> Result<Vec<(PathBuf, M)>, String>,
) -> Result<Mesh, Error> {
    let mut model = Model::default();
    let mut statements = Statements::new(obj, path);
    let mut face = Face::default();
    while let Some(statement) = statements.next()? {
        model.read(&statement, &mut face).map_err(|what| statement.refuse(what))?;
    }
    if model.triangles.is_empty() {
        return Err(Error::input(path, "holds no faces; give an OBJ file with polygons"));
    }
    let mut colour_of = vec![WHITE; model.materials.len() + 1];
    let mut known = HashSet::new();
    let mut count = 0;
    for (line, name) in &model.libraries {
        let on_line = |what| Error::input(path, format!("line {line}: {what}"));
        let files = open(name).map_err(on_line)?;
        count += files.len();
        if count > MOST_LIBRARIES {
            return Err(on_line(too_many_libraries()));
        }
        for (path, file) in files {
            for (material, colour) in mtl::colours(file, &path, &model.materials)? {
                // Of several files the first that has it, as OBJ says.
                if known.insert(material) {
                    colour_of[material as usize] = colour;
                }
            }
        }
    }
    model.into_mesh(&colour_of).map_err(|e| Error::input(path, e.to_string()))
}

fn too_many_libraries() -> String {
    format!("more than {MOST_LIBRARIES} material files; join them into one")
}

/// The face at hand; keeps its memory from one to the next.
struct Face {
    /// A position and a normal each, counted from 0.
    corners: Vec<[u32; 2]>,
    points: Vec<DVec3>,
    triangulator: Triangulator,
}

impl Default for Face {
    fn default() -> Face {
        Face { corners: Vec::new(), points: Vec::new(), triangulator: Triangulator::new() }
    }
}

impl Model {
    /// Takes in one statement, or says what is wrong with it.
    fn read(&mut self, statement: &Statement, face: &mut Face) -> Result<(), String> {
        match statement.keyword() {
            "v" if self.positions.len() == MOST => return Err(too_large("positions")),
            "v" => self.positions.push(triple("v", FARTHEST, statement.words())?),
            "vn" if self.normals.len() == MOST => return Err(too_large("normals")),
            "vn" => self.normals.push(triple("vn", f64::MAX, statement.words())?),
            "f" => self.face(statement, face)?,
            "usemtl" => {
                let next = self.materials.len() as u32 + 1;
                let material = match self.materials.get(statement.name()) {
                    Some(&material) => material,
                    None => *self.materials.entry(statement.name().into()).or_insert(next),
                };
                let first = self.triangles.len() as u32;
                match self.uses.last_mut() {
                    Some(last) if last.0 == first => last.1 = material, // nothing wore that one
                    _ => self.uses.push((first, material)),
                }
            }
            "mtllib" => {
                let name = statement.name();
                if !self.libraries.iter().any(|(_, known)| known == name) {
                    if self.libraries.len() == MOST_LIBRARIES {
                        return Err(too_many_libraries());
                    }
                    self.libraries.push((statement.line(), name.to_owned()));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, statement: &Statement, face: &mut Face) -> Result<(), String> {
        face.corners.clear();
        for word in statement.words() {
            if face.corners.len() == MOST_CORNERS {
                return Err(format!("a face of more than {MOST_CORNERS} corners; triangulate it before exporting"));
            }
            face.corners.push(corner(word, self.positions.len(), self.normals.len())?);
        }
        // One corner is a point and two are a line: nothing to see.
        if face.corners.len() < 3 {
            return Ok(());
        }
        if self.mesh.positions.len().max(self.triangles.len()) > MOST - MOST_CORNERS {
            return Err(too_large("triangles"));
        }
        face.points.clear();
        face.points.extend(face.corners.iter().map(|&[v, _]| self.positions[v as usize]));
        for corner in &mut face.corners {
            let [v, vn] = *corner;
            corner[0] = self.mesh.vertex(*corner, self.positions[v as usize], self.normals.get(vn as usize));
        }
        let cut = face.triangulator.triangles(&face.points).chunks_exact(3);
        self.triangles.extend(cut.map(|t| [t[0], t[1], t[2]].map(|i| face.corners[i as usize][0])));
        Ok(())
    }

    /// The mesh, its triangles sorted by the colours of their materials.
    fn into_mesh(self, colour_of: &[[f32; 3]]) -> Result<Mesh, Error> {
        let Model { triangles, uses, .. } = self;
        let Vertices { of, positions, mut normals } = self.mesh;
        drop((self.positions, self.normals, of)); // a large model needs the room
        let runs = || {
            let starts = [(0, 0)].into_iter().chain(uses.iter().copied());
            let ends = uses.iter().map(|&(first, _)| first).chain([triangles.len() as u32]);
            let run = starts.zip(ends).map(|((first, material), end)| (first as usize..end as usize, material));
            run.filter(|(run, _)| !run.is_empty()).map(|(run, material)| (run, colour_of[material as usize]))
        };
        // The groups in the order in which their colours appear, and how many triangles each has.
        let mut groups: Vec<([f32; 3], usize)> = Vec::new();
        let mut group_of: HashMap<[u32; 3], usize> = HashMap::new();
        for (run, colour) in runs() {
            let group = *group_of.entry(colour.map(f32::to_bits)).or_insert(groups.len());
            if group == groups.len() {
                groups.push((colour, 0));
            }
            groups[group].1 += run.len();
        }
        let mut end = 0;
        let ranges: Vec<Group> = groups
            .into_iter()
            .map(|(colour, count)| {
                end += count;
                Group { colour, triangles: end - count..end }
            })
            .collect();
        let sorted = if ranges.len() == 1 {
            triangles
        } else {
            let mut sorted = vec![[0; 3]; triangles.len()];
            let mut next: Vec<usize> = ranges.iter().map(|group| group.triangles.start).collect();
            for (run, colour) in runs() {
                let next = &mut next[group_of[&colour.map(f32::to_bits)]];
                sorted[*next..*next + run.len()].copy_from_slice(&triangles[run.clone()]);
                *next += run.len();
            }
            sorted
        };
        if !normals.is_empty() {
            normals.resize(positions.len(), DVec3::ZERO);
        }
        let mesh = Mesh::new(positions, sorted)?.with_groups(ranges)?;
        if normals.is_empty() { Ok(mesh) } else { mesh.with_normals(normals) }
    }
}

impl Vertices {
    /// The number of the vertex of this position and normal, a new one where there was none.
    fn vertex(&mut self, corner: [u32; 2], position: DVec3, normal: Option<&DVec3>) -> u32 {
        *self.of.entry(corner).or_insert_with(|| {
            if let Some(&normal) = normal {
                self.normals.resize(self.positions.len(), DVec3::ZERO); // none of those before had one
                self.normals.push(normal);
            }
            self.positions.push(position);
            (self.positions.len() - 1) as u32
        })
    }
}

fn too_large(of: &str) -> String {
    format!("more than {MOST} {of}; split the model")
}

/// Three numbers, each finite and at most `most` in magnitude. What follows them (a weight, a colour) is not read.
fn triple<'a>(keyword: &str, most: f64, mut words: impl Iterator<Item = &'a str>) -> Result<DVec3, String> {
    let mut next = || {
        let word = words.next().ok_or_else(|| format!("{keyword} needs three numbers"))?;
        let x = number(word)?;
        if x.abs() > most {
            return Err(format!("{} is past {most:e} in magnitude; scale the model down", quoted(word)));
        }
        Ok(x)
    };
    Ok(DVec3::new(next()?, next()?, next()?))
}

/// A corner's position and normal, counted from 0, of so many.
fn corner(word: &str, positions: usize, normals: usize) -> Result<[u32; 2], String> {
    let mut parts = word.split('/');
    let (position, _texture, normal) = (parts.next().unwrap_or(""), parts.next(), parts.next().unwrap_or(""));
    let no_corner = || format!("{} is not a corner; write v, v/vt, v//vn or v/vt/vn", quoted(word));
    if parts.next().is_some() {
        return Err(no_corner());
    }
    let read = |part: &str| part.parse::<i64>().map_err(|_| no_corner());
    let v = index(read(position)?, positions, "v")?;
    let vn = if normal.is_empty() { NONE } else { index(read(normal)?, normals, "vn")? };
    Ok([v, vn])
}

/// An index counted from 0, of one counted from 1 on, or back from the last of `count` when negative.
fn index(i: i64, count: usize, of: &str) -> Result<u32, String> {
    let from_zero = if i < 0 { i64::try_from(count).unwrap_or(i64::MAX).checked_add(i) } else { i.checked_sub(1) };
    match from_zero.and_then(|i| u32::try_from(i).ok()) {
        Some(i) if (i as usize) < count => Ok(i),
        _ => Err(format!("index {i} is out of range; {count} {of} lines stand before it, counted from 1")),
    }
}
