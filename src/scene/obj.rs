//! Reads OBJ files into meshes.
//!
//! tobj makes the vertices and triangles, from text that [`Guard`] writes while it reads the file. Only the parts of a
//! mesh are kept: positions, normals and triangles. The memory that is needed therefore depends on what the file
//! contains: statements that are not understood need none, and the worst case is 40 bytes of memory for each byte of
//! the file (`tests/memory.rs`). No memory is reserved because of a number that the file claims.
//!
//! Only geometry can make a file invalid. Normals and materials that cannot be read are left out, each kind with a
//! notice.
//!
//! Weights that follow a position, and curved surfaces are ignored.

use super::find::{Found as FoundFile, expected, folders_of, spellings};
use super::foreign;
use super::guard::{Found, Guard, Use};
use super::mesh::{Group, Mesh};
use super::mtl::{self, MOST_LIBRARIES, WHITE};
use super::notices::{Kind, Notices};
use super::skin::Textures;
use super::statement::{on_line, quoted};
use super::texture::Skin;
use crate::Error;
use glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A model that has been read, without its material files.
struct Model {
    /// What tobj has made, in the order of the file.
    objects: Vec<tobj::Model>,
    found: Found,
}

/// How the triangles of a material look.
#[derive(Clone, Copy)]
struct Look {
    colour: [f32; 3],
    /// False if the triangles are left out.
    visible: bool,
    /// The number of the skin. 0 is no texture.
    skin: u32,
}

/// The looks of all materials, by their numbers, and the skins.
struct Looks {
    of: Vec<Look>,
    skins: Vec<Skin>,
}

/// The parts of a mesh, in the order of the file. The last three lists are empty if the model has nothing of that kind.
#[derive(Default)]
struct Parts {
    triangles: Vec<[u32; 3]>,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    coordinates: Vec<DVec2>,
    colours: Vec<[f32; 3]>,
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
    /// Textures (`map_Kd`, `map_d`; PNG, JPEG, TGA or BMP) are looked for in the same way, beside the MTL file first. A
    /// material whose texture cannot be read has its colour `Kd`, and nothing is cut out of it. Triangles of a material
    /// with `d` below 1/2 are left out.
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
    /// corners, and a file without faces that are seen.
    pub fn load_obj(path: &Path) -> Result<(Mesh, Vec<String>), Error> {
        if path.is_dir() {
            return Err(Error::input(path, "is a folder; name an OBJ file"));
        }
        let file = File::open(path).map_err(|e| cannot_read(path, &e))?;
        let (mesh, notices, _) = Mesh::from_obj(BufReader::new(file), path)?;
        Ok((mesh, notices))
    }

    /// Reads an OBJ file that has been opened, as [`Mesh::load_obj`] does. Also returns the files that it names.
    pub(super) fn from_obj(file: impl BufRead, path: &Path) -> Result<(Mesh, Vec<String>, Vec<PathBuf>), Error> {
        let folders = folders_of(path);
        let mut seen = HashSet::new();
        let (mut textures, mut named) = (Textures::new(folders.clone()), Vec::new());
        let (mesh, notices) = read(file, path, &mut textures, |name| {
            let mut files = mtl::libraries(&folders, name);
            for file in &files {
                named.extend(file.as_ref().map_or_else(|_| expected(&folders, name), |file| Some(file.real.clone())));
            }
            files.retain(|file| file.as_ref().map_or(true, |file| seen.insert(file.real.clone())));
            let open = |file: Result<FoundFile, String>| {
                let file = file?;
                let opened = File::open(file.real).map_err(|e| mtl::cannot_read(name, &e))?;
                Ok((file.shown, BufReader::new(opened)))
            };
            files.into_iter().map(open).collect()
        })?;
        Ok((mesh, notices, named.into_iter().chain(textures.into_files()).collect()))
    }

    /// Reads a model from memory or from a stream, as [`Mesh::load_obj`] reads a file. Messages call it `name`. After
    /// the whole model has been read, `open` is called with the name in each `mtllib` statement, and opens that file.
    /// If it fails, the materials of that file are white, and a notice says so. On Unix a name has the bytes that are
    /// in the model. Textures are not read.
    ///
    /// # Errors
    /// The same as for [`Mesh::load_obj`].
    pub fn read_obj<M: BufRead>(
        obj: impl BufRead,
        name: &Path,
        mut open: impl FnMut(&OsStr) -> io::Result<M>,
    ) -> Result<(Mesh, Vec<String>), Error> {
        read(obj, name, &mut Textures::new(Vec::new()), |library| {
            let file = &spellings(library)[0];
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
    textures: &mut Textures,
    open: impl FnMut(&[u8]) -> Vec<Result<(PathBuf, M), String>>,
) -> Result<(Mesh, Vec<String>), Error> {
    let (head, obj) = foreign::head(obj).map_err(|e| cannot_read(path, &e))?;
    let other = |(what, advice)| Error::input(path, format!("this is {what}, {advice}"));
    if let Some(format) = foreign::certain(&head) {
        return Err(other(format));
    }
    let mut model = Model::of(obj, path, &head).map_err(|e| foreign::likely(&head).map_or(e, other))?;
    let mut notices = std::mem::take(&mut model.found.notices);
    let looks = model.looks(path, open, textures, &mut notices);
    if looks.skins.len() > 1 {
        notices.extend(std::mem::take(&mut model.found.texture_notices));
        model.tell_bare(&looks, path, &mut notices);
    }
    let mesh = model.into_mesh(looks).map_err(|e| match e {
        Error::Usage(what) => Error::input(path, what),
        e => e,
    })?;
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

    /// Reads the material files, which `open` opens, and their textures.
    fn looks<M: BufRead>(
        &self,
        path: &Path,
        mut open: impl FnMut(&[u8]) -> Vec<Result<(PathBuf, M), String>>,
        textures: &mut Textures,
        notices: &mut Notices,
    ) -> Looks {
        let white = Look { colour: WHITE, visible: true, skin: 0 };
        let mut looks = Looks { of: vec![white; self.found.materials.len() + 1], skins: vec![Skin::default()] };
        let mut number_of = HashMap::from([(Skin::default().key(), 0)]);
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
                        for (number, material) in mtl::materials(file, &path, &self.found.materials, notices) {
                            // If several files define a material, the first one counts, as the OBJ format says.
                            if !known.insert(number) {
                                continue;
                            }
                            if let Some(line) = material.invisible {
                                let what = on_line(line, "d is below 1/2");
                                notices.add(Kind::Invisible, || Error::input(&path, what).to_string());
                            }
                            let skin = textures.skin(material.colour_map.as_ref(), material.cut_map.as_ref(), notices);
                            let next = looks.skins.len() as u32;
                            let number_of_skin = *number_of.entry(skin.key()).or_insert(next);
                            if number_of_skin == next {
                                looks.skins.push(skin);
                            }
                            looks.of[number as usize] = Look {
                                colour: material.colour,
                                visible: material.invisible.is_none(),
                                skin: number_of_skin,
                            };
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
        looks
    }

    /// Tells of the triangles on which no texture can be laid, although their material has one.
    fn tell_bare(&self, looks: &Looks, path: &Path, notices: &mut Notices) {
        for (run, Use { material, bare, .. }) in runs(&self.found.uses, self.found.triangles) {
            let look = looks.of[material as usize];
            if bare > 0 && look.visible && look.skin > 0 {
                let what = || on_line(bare, "a triangle lacks texture coordinates, and its material has a texture");
                run.for_each(|_| notices.add(Kind::Bare, || Error::input(path, what()).to_string()));
            }
        }
    }

    /// Makes the mesh. Its triangles are sorted by the looks of their materials.
    fn into_mesh(self, looks: Looks) -> Result<Mesh, Error> {
        let Model { objects, found } = self;
        let uses = found.uses.clone();
        let mut parts = Parts::new(objects, found, looks.skins.len() > 1);
        let runs = |count: usize| {
            let runs = runs(&uses, count).map(|(run, of)| {
                let look = looks.of[of.material as usize];
                (run, if of.bare > 0 { Look { skin: 0, ..look } } else { look })
            });
            runs.filter(|(_, look)| look.visible)
        };
        let key = |look: Look| (look.colour.map(f32::to_bits), look.skin);
        // The looks in the order in which they appear, and how many triangles each has.
        let mut groups: Vec<(Look, usize)> = Vec::new();
        let mut group_of = HashMap::new();
        let count = parts.triangles.len();
        for (run, look) in runs(count) {
            let group = *group_of.entry(key(look)).or_insert(groups.len());
            if group == groups.len() {
                groups.push((look, 0));
            }
            groups[group].1 += run.len();
        }
        let mut end = 0;
        let mut ranges = Vec::with_capacity(groups.len());
        for &(Look { colour, .. }, count) in &groups {
            end += count;
            ranges.push(Group { colour, triangles: end - count..end });
        }
        if ranges.is_empty() {
            return Err(Error::Usage("holds no faces that are seen: d is below 1/2 in the materials of all".into()));
        }
        if ranges.len() > 1 || end < count {
            let mut sorted = vec![[0; 3]; end];
            let mut next: Vec<usize> = ranges.iter().map(|group| group.triangles.start).collect();
            for (run, look) in runs(count) {
                let next = &mut next[group_of[&key(look)]];
                sorted[*next..*next + run.len()].copy_from_slice(&parts.triangles[run.clone()]);
                *next += run.len();
            }
            parts.triangles = sorted;
        }
        if end < count {
            parts.leave_out_the_unused();
        }
        let Parts { triangles, positions, normals, coordinates, colours } = parts;
        let mut mesh = Mesh::new(positions, triangles)?.with_groups(ranges)?;
        if !coordinates.is_empty() {
            let skins = groups.iter().map(|(look, _)| looks.skins[look.skin as usize].clone()).collect();
            mesh = mesh.with_skins(skins, coordinates);
        }
        if !colours.is_empty() {
            mesh = mesh.with_vertex_colours(colours);
        }
        if normals.is_empty() { Ok(mesh) } else { mesh.with_normals(normals) }
    }
}

/// Returns the runs of the `count` triangles that have the same material, without empty ones.
fn runs(uses: &[Use], count: usize) -> impl Iterator<Item = (Range<usize>, Use)> {
    let starts = [Use::default()].into_iter().chain(uses.iter().copied());
    let ends = uses.iter().map(|next| next.first).chain([count as u32]);
    let runs = starts.zip(ends).map(|(of, end)| (of.first as usize..end as usize, of));
    runs.filter(|(run, _)| !run.is_empty())
}

impl Parts {
    /// Joins tobj's objects. Texture coordinates are kept if they are `textured`.
    fn new(objects: Vec<tobj::Model>, found: Found, textured: bool) -> Parts {
        let mut parts = Parts::default();
        parts.triangles.reserve_exact(found.triangles);
        parts.positions.reserve_exact(objects.iter().map(|object| object.mesh.positions.len() / 3).sum());
        for tobj::Model { mesh: object, .. } in objects {
            let first = parts.positions.len();
            let triangle = |t: &[u32]| [t[0], t[1], t[2]].map(|i| first as u32 + i);
            parts.triangles.extend(object.indices.chunks_exact(3).map(triangle));
            parts.positions.extend(object.positions.chunks_exact(3).map(DVec3::from_slice));
            if !object.normals.is_empty() {
                parts.normals.resize(first, DVec3::ZERO); // the vertices before this object have no normal
                parts.normals.extend(object.normals.chunks_exact(3).map(DVec3::from_slice));
            }
            if textured {
                parts.coordinates.extend(object.texcoords.chunks_exact(2).map(DVec2::from_slice));
                parts.coordinates.resize(parts.positions.len(), DVec2::ZERO);
            }
        }
        if let Some((first, corners)) = found.coloured {
            parts.colours = vec![WHITE; parts.positions.len()];
            for (triangle, corners) in parts.triangles[first..].iter().zip(corners) {
                for (&vertex, position) in triangle.iter().zip(corners) {
                    parts.colours[vertex as usize] = *found.colours.get(position as usize).unwrap_or(&WHITE);
                }
            }
        }
        parts
    }

    /// Leaves out the vertices that no triangle has, so that they are no part of the scene's size.
    fn leave_out_the_unused(&mut self) {
        let mut number_of = vec![u32::MAX; self.positions.len()];
        let mut kept = Vec::new();
        for i in self.triangles.iter_mut().flatten() {
            let number = &mut number_of[*i as usize];
            if *number == u32::MAX {
                *number = kept.len() as u32;
                kept.push(*i as usize);
            }
            *i = *number;
        }
        fn picked<T: Copy>(list: &mut Vec<T>, kept: &[usize]) {
            if !list.is_empty() {
                *list = kept.iter().map(|&i| list[i]).collect();
            }
        }
        picked(&mut self.positions, &kept);
        picked(&mut self.normals, &kept);
        picked(&mut self.coordinates, &kept);
        picked(&mut self.colours, &kept);
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
