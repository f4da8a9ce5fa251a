//! Reads OBJ files into meshes.
//!
//! tobj makes the vertices and triangles, from text that [`Guard`] writes while it reads the file. Only the parts of a
//! mesh are kept: positions, normals and triangles. The memory that is needed therefore depends on what the file
//! contains: statements that are not understood need none, and the worst case is 24 bytes of memory for each byte of
//! the file (`tests/memory.rs`). No memory is reserved because of a number that the file claims.
//!
//! Only geometry can make a file invalid. Normals and materials that cannot be read are left out, each kind with a
//! notice.
//!
//! Texture coordinates, colours and weights that follow a position, and curved surfaces are ignored.

use super::foreign;
use super::guard::{Found, Guard};
use super::mesh::{Group, Mesh};
use super::mtl::{self, MOST_LIBRARIES, WHITE};
use super::notices::{Kind, Notices};
use super::statement::{on_line, quoted};
use crate::Error;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// A model that has been read, without its material files.
struct Model {
    /// What tobj has made, in the order of the file.
    objects: Vec<tobj::Model>,
    found: Found,
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
    let mut notices = std::mem::take(&mut model.found.notices);
    let colours = model.colours(path, open, &mut notices);
    let mesh = model.into_mesh(&colours).map_err(|e| Error::input(path, e.to_string()))?;
    Ok((mesh, notices.lines()))
}

fn cannot_read(path: &Path, error: &io::Error) -> Error {
    Error::input(path, format!("cannot be read: {error}"))
}

impl Model {
    /// Reads an OBJ file, which begins with `head`.
    fn of(obj: impl BufRead, path: &Path, head: &[u8]) -> Result<Model, Error> {
        let mut guard = Guard::new(obj, path);
        let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
        let read = tobj::load_obj_buf(&mut guard, &options, |_| Ok(Default::default()));
        let found = guard.finish()?;
        // tobj accepts whatever the guard writes, so that this is no error which a file can cause.
        let (objects, _) = read.map_err(|e| Error::input(path, format!("cannot be read: {e}")))?;
        if found.triangles == 0 {
            Err(Error::input(path, no_faces(&found, head)))
        } else {
            Ok(Model { objects, found })
        }
    }

    /// Reads the material files, which `open` opens, and returns the colour of each material by its number.
    fn colours<M: BufRead>(
        &self,
        path: &Path,
        mut open: impl FnMut(&[u8]) -> Vec<Result<(PathBuf, M), String>>,
        notices: &mut Notices,
    ) -> Vec<[f32; 3]> {
        let mut colour_of = vec![WHITE; self.found.materials.len() + 1];
        let mut known = HashSet::new();
        let mut count = 0;
        let notice = |line: u64, what: String| Error::input(path, on_line(line, what)).to_string();
        'libraries: for (line, name) in &self.found.libraries {
            let files = if name.is_empty() { vec![Err("mtllib names no file".into())] } else { open(name) };
            for file in files {
                if count == MOST_LIBRARIES {
                    notices.add(Kind::Excess, || notice(*line, mtl::too_many_libraries()));
                    break 'libraries;
                }
                count += 1;
                match file {
                    Err(why) => notices.add(Kind::Library, || notice(*line, why)),
                    Ok((path, file)) => {
                        for (material, colour) in mtl::colours(file, &path, &self.found.materials, notices) {
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
                self.found.materials.iter().filter(|(name, (number, _))| !name.is_empty() && !known.contains(number));
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
        let Model { objects, found: Found { uses, triangles: count, .. } } = self;
        let mut triangles = Vec::with_capacity(count);
        let vertices = objects.iter().map(|object| object.mesh.positions.len() / 3).sum();
        let (mut positions, mut normals) = (Vec::with_capacity(vertices), Vec::new());
        for tobj::Model { mesh: object, .. } in objects {
            let first = positions.len() as u32;
            triangles.extend(object.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| first + i)));
            positions.extend(object.positions.chunks_exact(3).map(DVec3::from_slice));
            if !object.normals.is_empty() {
                normals.resize(first as usize, DVec3::ZERO); // the vertices before this object have no normal
                normals.extend(object.normals.chunks_exact(3).map(DVec3::from_slice));
            }
        }
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
        let mesh = Mesh::new(positions, sorted)?.with_groups(ranges)?;
        if normals.is_empty() { Ok(mesh) } else { mesh.with_normals(normals) }
    }
}

/// Returns the message for a file without faces.
fn no_faces(found: &Found, head: &[u8]) -> String {
    let what = match found.instead {
        _ if head.is_empty() => return "is empty; give an OBJ file with polygons".into(),
        Some(instead) => format!("holds no faces, only {instead}"),
        None if found.positions > 0 => "holds no faces, only positions".into(),
        None if foreign::is_binary(head) => "holds no faces, but bytes that are no text".into(),
        None => "holds no faces".into(),
    };
    format!("{what}; give an OBJ file with polygons")
}
