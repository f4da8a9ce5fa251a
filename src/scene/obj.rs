//! Reads OBJ files into meshes.
//!
//! The file is read statement by statement. It keeps only the parts of a mesh: positions, normals, and triangles, into
//! which each face is divided as soon as it is read. The memory that is needed therefore depends on what the file
//! contains: statements that are not understood need none, and the worst case is 20 bytes of memory for each byte of
//! the file (`tests/memory.rs`), which occurs in a file of large faces with short indices. No memory is reserved
//! because of a number that the file claims.
//!
//! This reader exists because tobj has the following faults. The tests compare the two on the files that both can read.
//! tobj 4.0.5
//! - keeps some hundred bytes for each face, whose statement may have only eight;
//! - does not name lines in its errors;
//! - panics on `vt` and `vn` indices that point before the first element, or are near 2^63;
//! - accepts NaN and infinity;
//! - makes triangles of polylines (`l 1 2 3`), and fans of concave faces;
//! - adds nothing to its list of normals for a corner that has none, so that normals no longer match their positions;
//! - silently loses the first line after a byte order mark, which shifts every index by one;
//! - refuses continued lines, comments after a statement, tabs after `usemtl`, bytes that are not UTF-8, and files that
//!   give colours to some positions only.
//!
//! Only geometry can make a file invalid. Normals and materials that cannot be read are left out, each kind with a
//! notice.
//!
//! Texture coordinates, colours and weights that follow a position, and curved surfaces are ignored.

use super::foreign;
use super::mesh::{FARTHEST, Group, Mesh};
use super::mtl::{self, MOST_LIBRARIES, Materials, WHITE};
use super::notices::{Kind, Notices};
use super::polygon::Triangulator;
use super::statement::{Statement, Statements, number, on_line, quoted};
use crate::Error;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The most corners of a face. Faces with more are refused.
const MOST_CORNERS: usize = 1 << 16;

/// The most positions, normals, vertices or triangles, whose indices have 32 bits.
const MOST: usize = u32::MAX as usize;

/// The index of a corner that has no normal.
const NONE: u32 = u32::MAX;

/// The parts of a model that have been read so far.
#[derive(Default)]
struct Model {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    mesh: Vertices,
    triangles: Vec<[u32; 3]>,
    /// The materials that `usemtl` statements name.
    materials: Materials,
    /// Each entry (t, m) says that the triangles from number t on have material m.
    uses: Vec<(u32, u32)>,
    /// The names in `mtllib` statements, with their lines. Each name is listed once, since some exporters repeat the
    /// statement before each object. At most [`MOST_LIBRARIES`] names are kept.
    libraries: Vec<(u64, Box<[u8]>)>,
    /// What a file without faces holds in their place.
    instead: Option<&'static str>,
    notices: Notices,
}

/// The vertices of the mesh. Each pair of a position and a normal occurs once, in the order in which faces use them.
#[derive(Default)]
struct Vertices {
    /// The number of the vertex for each pair of indices in the file.
    number_of: HashMap<[u32; 2], u32>,
    positions: Vec<DVec3>,
    /// The normals. Empty until a corner has one.
    normals: Vec<DVec3>,
}

impl Mesh {
    /// Reads an OBJ file and the MTL files that it names, and returns the mesh and the notices about it. The OBJ file
    /// may also be a pipe or a device.
    ///
    /// Polygons are divided into triangles. This is correct for concave polygons of up to 512 corners; larger ones are
    /// treated as convex. Points and lines are ignored. Positions are kept in float64.
    ///
    /// MTL files are looked for in the folder of the model and below it, under the name that the model gives, and in
    /// the folder itself under the last part of that name, in another case too if only one file has it so. Files
    /// elsewhere are not opened. Materials that no MTL file defines, or that give no red, green and blue, are white.
    /// Normals that are not three finite numbers, that have no length or that a corner names by a wrong index are
    /// unknown, as if the file had none there.
    ///
    /// Each notice is one line about one kind of thing that was left out in this way. It names the file and the line of
    /// the first such thing, and how many there are.
    ///
    /// # Errors
    /// [`Error::Input`] if the OBJ file cannot be read or its geometry is invalid. The message names the file and, if
    /// there is one, the line; if the file has another format, it names the format. Also refused are coordinates that
    /// are not finite or above 1e15 in magnitude, lines and statements longer than 2 MiB, faces of more than 65536
    /// corners, and a file without faces.
    pub fn load_obj(path: &Path) -> Result<(Mesh, Vec<String>), Error> {
        if path.is_dir() {
            return Err(Error::input(path, "is a folder; name an OBJ file"));
        }
        let file = File::open(path).map_err(|e| cannot_read(path, &e))?;
        // The model's folders: the one in its path, and the one in which the file lies if the path is a symbolic link.
        let folders = [Some(path.to_path_buf()), path.canonicalize().ok()].into_iter().flatten().map(|path| match path
            .parent()
        {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
            _ => PathBuf::from("."),
        });
        let folders: Vec<PathBuf> = folders.collect();
        let mut seen = HashSet::new();
        read(BufReader::new(file), path, |name| {
            let mut files = mtl::libraries(&folders, name);
            files.retain(|file| file.as_ref().map_or(true, |file| seen.insert(file.real.clone())));
            let open = |file: Result<mtl::Found, String>| {
                let file = file?;
                let opened = File::open(file.real).map_err(|e| mtl::cannot_read(name, &e))?;
                Ok((file.shown, BufReader::new(opened)))
            };
            files.into_iter().map(open).collect()
        })
    }

    /// Reads a model from memory or from a stream, as [`Mesh::load_obj`] reads a file. Messages call it `name`. After
    /// the whole model has been read, `open` is called with the name in each `mtllib` statement, and opens that file.
    /// If it fails, the materials of that file are white, and a notice says so. On Unix a name has the bytes that are
    /// in the model.
    ///
    /// # Errors
    /// The same as for [`Mesh::load_obj`].
    pub fn read_obj<M: BufRead>(
        obj: impl BufRead,
        name: &Path,
        mut open: impl FnMut(&OsStr) -> io::Result<M>,
    ) -> Result<(Mesh, Vec<String>), Error> {
        read(obj, name, |library| {
            let file = &mtl::spellings(library)[0];
            vec![match open(file) {
                Ok(opened) => Ok((name.with_file_name(file), opened)),
                Err(e) => Err(mtl::cannot_read(library, &e)),
            }]
        })
    }
}

/// Reads a model. `open` opens the files that a `mtllib` statement names, and returns each with its path, or why it is
/// not opened. `path` names the model in messages.
fn read<M: BufRead>(
    obj: impl BufRead,
    path: &Path,
    open: impl FnMut(&[u8]) -> Vec<Result<(PathBuf, M), String>>,
) -> Result<(Mesh, Vec<String>), Error> {
    let (head, obj) = foreign::head(obj).map_err(|e| cannot_read(path, &e))?;
    let other = |(what, advice)| Error::input(path, format!("this is {what}, {advice}"));
    if let Some(format) = foreign::certain(&head) {
        return Err(other(format));
    }
    let mut model = Model::of(obj, path, &head).map_err(|e| foreign::likely(&head).map_or(e, other))?;
    let mut notices = std::mem::take(&mut model.notices);
    let colours = model.colours(path, open, &mut notices);
    let mesh = model.into_mesh(&colours).map_err(|e| Error::input(path, e.to_string()))?;
    Ok((mesh, notices.lines()))
}

fn cannot_read(path: &Path, error: &io::Error) -> Error {
    Error::input(path, format!("cannot be read: {error}"))
}

fn too_many_libraries() -> String {
    format!("this is material file {}, and only {MOST_LIBRARIES} are read: join them", MOST_LIBRARIES + 1)
}

/// The face that is being read. Its memory is kept from one face to the next.
struct Face {
    /// The indices of the position and the normal of each corner, counted from 0.
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
    /// Reads the statements of an OBJ file, which begins with `head`.
    fn of(obj: impl BufRead, path: &Path, head: &[u8]) -> Result<Model, Error> {
        let mut model = Model::default();
        let mut statements = Statements::new(obj, path);
        let mut face = Face::default();
        while let Some(statement) = statements.next()? {
            model.read(&statement, &mut face).map_err(|what| statement.refuse(what))?;
        }
        if model.triangles.is_empty() { Err(Error::input(path, model.no_faces(head))) } else { Ok(model) }
    }

    /// Returns the message for a file without faces.
    fn no_faces(&self, head: &[u8]) -> String {
        let found = match self.instead {
            _ if head.is_empty() => return "is empty; give an OBJ file with polygons".into(),
            Some(instead) => format!("holds no faces, only {instead}"),
            None if !self.positions.is_empty() => "holds no faces, only positions".into(),
            None if foreign::is_binary(head) => "holds no faces, but bytes that are no text".into(),
            None => "holds no faces".into(),
        };
        format!("{found}; give an OBJ file with polygons")
    }

    /// Adds one statement to the model, or returns what is wrong with it.
    fn read(&mut self, statement: &Statement, face: &mut Face) -> Result<(), String> {
        match statement.keyword() {
            "v" if self.positions.len() == MOST => return Err(too_large("positions")),
            "v" => self.positions.push(triple("v", FARTHEST, statement.words())?),
            "vn" if self.normals.len() == MOST => return Err(too_large("normals")),
            "vn" => {
                let normal = triple("vn", f64::MAX, statement.words()).and_then(|normal| match normal {
                    DVec3::ZERO => Err("this vn has no length".into()),
                    normal => Ok(normal),
                });
                // A normal that is left out keeps its place, so that the next ones keep their indices.
                self.normals.push(normal.unwrap_or_else(|what| {
                    self.notices.add(Kind::Normal, || statement.notice(what));
                    DVec3::ZERO
                }));
            }
            "f" => self.face(statement, face)?,
            "usemtl" => {
                let next = (self.materials.len() as u32 + 1, statement.line());
                let (material, _) = match self.materials.get(statement.name()) {
                    Some(&material) => material,
                    None => *self.materials.entry(statement.name().into()).or_insert(next),
                };
                let first = self.triangles.len() as u32;
                match self.uses.last_mut() {
                    Some(last) if last.0 == first => last.1 = material, // the previous material has no triangles
                    _ => self.uses.push((first, material)),
                }
            }
            "mtllib" => {
                let name = statement.name();
                if !self.libraries.iter().any(|(_, known)| **known == *name) {
                    if self.libraries.len() < MOST_LIBRARIES {
                        self.libraries.push((statement.line(), name.into()));
                    } else {
                        self.notices.add(Kind::Excess, || statement.notice(too_many_libraries()));
                    }
                }
            }
            "p" | "l" => self.instead = Some("points and lines"),
            "surf" | "curv" | "curv2" => self.instead = Some("curved surfaces, which are not read"),
            "newmtl" => self.instead = Some("materials"),
            "F" => self.instead = Some("statements in capital letters: write f for F, and v for V"),
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
            let (v, vn) = corner(word, self.positions.len(), self.normals.len())?;
            let vn = vn.unwrap_or_else(|what| {
                self.notices.add(Kind::NormalIndex, || statement.notice(what));
                NONE
            });
            face.corners.push([v, vn]);
        }
        if face.corners.len() < 3 {
            self.instead = Some("faces of fewer than 3 corners");
            self.notices.add(Kind::Face, || statement.notice("a face needs 3 corners"));
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

    /// Reads the material files, which `open` opens, and returns the colour of each material by its number.
    fn colours<M: BufRead>(
        &self,
        path: &Path,
        mut open: impl FnMut(&[u8]) -> Vec<Result<(PathBuf, M), String>>,
        notices: &mut Notices,
    ) -> Vec<[f32; 3]> {
        let mut colour_of = vec![WHITE; self.materials.len() + 1];
        let mut known = HashSet::new();
        let mut count = 0;
        let notice = |line: u64, what: String| Error::input(path, on_line(line, what)).to_string();
        'libraries: for (line, name) in &self.libraries {
            let files = if name.is_empty() { vec![Err("mtllib names no file".into())] } else { open(name) };
            for file in files {
                if count == MOST_LIBRARIES {
                    notices.add(Kind::Excess, || notice(*line, too_many_libraries()));
                    break 'libraries;
                }
                count += 1;
                match file {
                    Err(why) => notices.add(Kind::Library, || notice(*line, why)),
                    Ok((path, file)) => {
                        for (material, colour) in mtl::colours(file, &path, &self.materials, notices) {
                            // If several files define a material, the first one counts, as the OBJ format says.
                            if known.insert(material) {
                                colour_of[material as usize] = colour;
                            }
                        }
                    }
                }
            }
        }
        // If a material file was not read, that is why materials are unknown, and its notice is enough.
        if !notices.has(Kind::Library) && !notices.has(Kind::Excess) {
            let unknown =
                self.materials.iter().filter(|(name, (number, _))| !name.is_empty() && !known.contains(number));
            let mut unknown: Vec<_> = unknown.map(|(name, &(_, line))| (line, name)).collect();
            unknown.sort_unstable();
            for (line, name) in unknown {
                let what = || format!("no material file defines {}", quoted(name));
                notices.add(Kind::Material, || notice(line, what()));
            }
        }
        colour_of
    }

    /// Makes the mesh. Its triangles are sorted by the colours of their materials.
    fn into_mesh(self, colour_of: &[[f32; 3]]) -> Result<Mesh, Error> {
        let Model { triangles, uses, .. } = self;
        let Vertices { number_of, positions, mut normals } = self.mesh;
        drop((self.positions, self.normals, number_of)); // a large model needs the memory
        let runs = || {
            let starts = [(0, 0)].into_iter().chain(uses.iter().copied());
            let ends = uses.iter().map(|&(first, _)| first).chain([triangles.len() as u32]);
            let run = starts.zip(ends).map(|((first, material), end)| (first as usize..end as usize, material));
            run.filter(|(run, _)| !run.is_empty()).map(|(run, material)| (run, colour_of[material as usize]))
        };
        // The colours in the order in which they appear, and how many triangles each has.
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
    /// Returns the number of the vertex for this pair of indices. If there is none yet, it is made from the position
    /// and the normal.
    fn vertex(&mut self, corner: [u32; 2], position: DVec3, normal: Option<&DVec3>) -> u32 {
        *self.number_of.entry(corner).or_insert_with(|| {
            if let Some(&normal) = normal {
                self.normals.resize(self.positions.len(), DVec3::ZERO); // the vertices before this one have no normal
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

/// Parses three finite numbers of at most `most` in magnitude. What follows them (a weight, a colour) is ignored.
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

/// Parses one corner of a face into the indices of its position and its normal, counted from 0. `positions` and
/// `normals` are how many of each the file has had so far. If only the normal is wrong, its error is returned in its
/// place.
fn corner(word: &str, positions: usize, normals: usize) -> Result<(u32, Result<u32, String>), String> {
    let mut parts = word.split('/');
    let (position, _texture, normal) = (parts.next().unwrap_or(""), parts.next(), parts.next().unwrap_or(""));
    let no_corner = || format!("{} is not a corner; write v, v/vt, v//vn or v/vt/vn", quoted(word));
    if parts.next().is_some() {
        return Err(no_corner());
    }
    let read = |part: &str| part.parse::<i64>().map_err(|_| no_corner());
    let v = index(read(position)?, positions, "v")?;
    let vn = if normal.is_empty() { Ok(NONE) } else { read(normal).and_then(|i| index(i, normals, "vn")) };
    Ok((v, vn))
}

/// Converts an index of the file to one that is counted from 0. In the file, positive indices are counted from 1, and
/// negative ones back from the last of the `count` elements so far.
fn index(i: i64, count: usize, of: &str) -> Result<u32, String> {
    let from_zero = if i < 0 { i64::try_from(count).unwrap_or(i64::MAX).checked_add(i) } else { i.checked_sub(1) };
    match from_zero.and_then(|i| u32::try_from(i).ok()) {
        Some(i) if (i as usize) < count => Ok(i),
        _ => Err(format!("index {i} is out of range; {count} {of} lines stand before it, counted from 1")),
    }
}
