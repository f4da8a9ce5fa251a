//! OBJ files into meshes.
//!
//! tobj reads the numbers, the corners of faces, and unites corners that share position and normal. It is given a
//! plain dialect of the file only (`v x y z`, `vn x y z`, `f v//vn ...` with indices counted from 1), because on whole
//! files tobj 4.0.5
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
use super::mtl::{self, WHITE};
use super::polygon::Triangulator;
use super::statement::{number, quoted, statements};
use crate::Error;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Faces with more corners are refused: cutting a polygon may take the square of their number.
const MOST_CORNERS: usize = 1 << 16;

/// A material file: where it lies and what it holds.
pub(super) type Library = (PathBuf, Vec<u8>);

/// What a file says, in the dialect that tobj reads without surprises.
struct Plain {
    /// `v`, `vn` and `f` statements. Normal 1 is (0, 0, 0), for corners without one.
    text: String,
    /// The names of materials in order of appearance.
    materials: Vec<String>,
    /// From this face on, this material.
    uses: Vec<(usize, usize)>,
    /// What `mtllib` statements name, with the line.
    libraries: Vec<(usize, String)>,
}

impl Mesh {
    /// Reads an OBJ file and the MTL files that it names, which must lie in its folder.
    ///
    /// Polygons are triangulated, concave ones too; points and lines are passed over; a material that no MTL file
    /// defines is white. Positions keep float64. Not finite or past 1e15 in magnitude, they are refused.
    pub fn load_obj(path: &Path) -> Result<Mesh, Error> {
        if path.is_dir() {
            return Err(Error::input(path, "is a folder; name an OBJ file"));
        }
        let bytes = std::fs::read(path).map_err(|e| Error::input(path, format!("cannot be read: {e}")))?;
        // The model's folder: where it was found, and where it really lies if that is a link.
        let folders = [Some(path.to_path_buf()), path.canonicalize().ok()].into_iter().flatten().map(|path| match path
            .parent()
        {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
            _ => PathBuf::from("."),
        });
        let folders: Vec<PathBuf> = folders.collect();
        let mut seen = HashSet::new();
        read(&bytes, path, |name| {
            let mut files = mtl::libraries(&folders, name)?;
            files.retain(|file| seen.insert(file.clone())); // some exporters repeat mtllib before each object
            let open = |file: PathBuf| match std::fs::read(&file) {
                Ok(bytes) => Ok((file, bytes)),
                Err(e) => Err(format!("material file {} cannot be read ({e})", quoted(name))),
            };
            files.into_iter().map(open).collect()
        })
    }
}

/// Reads a model from memory. `open` fetches what a `mtllib` statement names; `path` is for messages.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    mut open: impl FnMut(&str) -> Result<Vec<Library>, String>,
) -> Result<Mesh, Error> {
    let on_line = |line, what| Error::input(path, format!("line {line}: {what}"));
    let plain = simplify(&String::from_utf8_lossy(bytes)).map_err(|(line, what)| on_line(line, what))?;

    let mut colours = HashMap::new();
    for (line, name) in &plain.libraries {
        for (file, bytes) in open(name).map_err(|what| on_line(*line, what))? {
            for (material, colour) in mtl::colours(&bytes, &file)? {
                colours.entry(material).or_insert(colour); // of several files the first that has it, as OBJ says
            }
        }
    }

    let options = tobj::LoadOptions { single_index: true, ..Default::default() };
    let none = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut plain.text.as_bytes(), &options, none)
        .map_err(|e| Error::input(path, format!("{e}; is it an OBJ file?")))?;
    // Without `o`, `g` and `usemtl` there is one model.
    let model = models.into_iter().next().map(|model| model.mesh).unwrap_or_default();
    if model.indices.is_empty() {
        return Err(Error::input(path, "holds no faces; give an OBJ file with polygons"));
    }
    let colour_of: Vec<[f32; 3]> =
        plain.materials.iter().map(|name| colours.get(name).copied().unwrap_or(WHITE)).collect();
    let mesh = build(&model, &plain.uses, &colour_of);
    mesh.map_err(|e| Error::input(path, e.to_string()))
}

/// Checks each statement that matters and rewrites it; otherwise the line and what is wrong there.
fn simplify(text: &str) -> Result<Plain, (usize, String)> {
    let mut plain =
        Plain { text: String::from("vn 0 0 0\n"), materials: Vec::new(), uses: Vec::new(), libraries: Vec::new() };
    let mut material_of: HashMap<String, usize> = HashMap::new();
    let (mut positions, mut normals, mut faces, mut corners) = (0_usize, 0_usize, 0_usize, 0_usize);
    for (line, statement) in statements(text) {
        let refuse = |what: String| (line, what);
        match statement.keyword() {
            "v" => {
                triple("v", FARTHEST, statement.words(), &mut plain.text).map_err(refuse)?;
                positions += 1;
            }
            "vn" => {
                triple("vn", f64::MAX, statement.words(), &mut plain.text).map_err(refuse)?;
                normals += 1;
            }
            "f" => {
                let start = plain.text.len();
                let count = face(statement.words(), positions, normals, &mut plain.text).map_err(refuse)?;
                // One corner is a point and two are a line: nothing to see.
                if count < 3 {
                    plain.text.truncate(start);
                    continue;
                }
                faces += 1;
                corners += count;
                if corners > u32::MAX as usize {
                    return Err(refuse("the faces have more than 4294967295 corners; split the model".into()));
                }
            }
            "usemtl" => {
                let next = plain.materials.len();
                let material = *material_of.entry(statement.name().to_owned()).or_insert(next);
                if material == next {
                    plain.materials.push(statement.name().to_owned());
                }
                plain.uses.push((faces, material));
            }
            "mtllib" => plain.libraries.push((line, statement.name().to_owned())),
            _ => {}
        }
    }
    Ok(plain)
}

/// Copies three numbers, each finite and at most `most` in magnitude. What follows them (a weight, a colour) is not.
fn triple<'a>(
    keyword: &str,
    most: f64,
    mut words: impl Iterator<Item = &'a str>,
    out: &mut String,
) -> Result<(), String> {
    out.push_str(keyword);
    for _ in 0..3 {
        let word = words.next().ok_or_else(|| format!("{keyword} needs three numbers"))?;
        if number(word)?.abs() > most {
            return Err(format!("{} is past {most:e} in magnitude; scale the model down", quoted(word)));
        }
        out.push(' ');
        out.push_str(word);
    }
    out.push('\n');
    Ok(())
}

/// Copies the corners of a face as `v//vn` and returns their number.
fn face<'a>(
    words: impl Iterator<Item = &'a str>,
    positions: usize,
    normals: usize,
    out: &mut String,
) -> Result<usize, String> {
    out.push('f');
    let mut count = 0;
    for word in words {
        let mut parts = word.split('/');
        let (position, _texture, normal) = (parts.next().unwrap_or(""), parts.next(), parts.next().unwrap_or(""));
        let no_corner = || format!("{} is not a corner; write v, v/vt, v//vn or v/vt/vn", quoted(word));
        if parts.next().is_some() {
            return Err(no_corner());
        }
        let read = |part: &str| part.parse::<i64>().map_err(|_| no_corner());
        let v = index(read(position)?, positions, "v")?;
        let vn = if normal.is_empty() { 0 } else { index(read(normal)?, normals, "vn")? };
        let _ = write!(out, " {v}//{}", vn + 1); // ours are one further on: see `Plain::text`
        count += 1;
        if count > MOST_CORNERS {
            return Err(format!("a face of more than {MOST_CORNERS} corners; triangulate it before exporting"));
        }
    }
    out.push('\n');
    Ok(count)
}

/// An index from 1 on: as it stands, or counted back from the last of `count` when negative.
fn index(i: i64, count: usize, of: &str) -> Result<usize, String> {
    let from_one = if i < 0 { i64::try_from(count).unwrap_or(i64::MAX).checked_add(i + 1) } else { Some(i) };
    match from_one.and_then(|i| usize::try_from(i).ok()) {
        Some(i) if (1..=count).contains(&i) => Ok(i),
        _ => Err(format!("index {i} is out of range; {count} {of} lines stand before it, counted from 1")),
    }
}

/// Triangles from tobj's polygons, sorted by colour.
fn build(model: &tobj::Mesh, uses: &[(usize, usize)], colour_of: &[[f32; 3]]) -> Result<Mesh, Error> {
    let vectors = |flat: &[f64]| -> Vec<DVec3> { flat.chunks_exact(3).map(DVec3::from_slice).collect() };
    let positions = vectors(&model.positions);
    let triangles_only = model.face_arities.is_empty();
    let faces = if triangles_only { model.indices.len() / 3 } else { model.face_arities.len() };

    let mut groups: Vec<([f32; 3], Vec<[u32; 3]>)> = Vec::new();
    let mut group_of: HashMap<[u32; 3], usize> = HashMap::new();
    let (mut colour, mut group) = (WHITE, None);
    let mut uses = uses.iter().peekable();
    let mut triangulator = Triangulator::new();
    let mut corners = Vec::new();
    let mut indices = model.indices.as_slice();
    for face in 0..faces {
        while let Some((_, material)) = uses.next_if(|(first, _)| *first <= face) {
            (colour, group) = (colour_of[*material], None);
        }
        // Looked up once a face needs it, so that no group is empty.
        let group = *group.get_or_insert_with(|| {
            *group_of.entry(colour.map(f32::to_bits)).or_insert_with(|| {
                groups.push((colour, Vec::new()));
                groups.len() - 1
            })
        });
        let (these, rest) = indices.split_at(if triangles_only { 3 } else { model.face_arities[face] as usize });
        indices = rest;
        corners.clear();
        corners.extend(these.iter().map(|&i| positions[i as usize]));
        let cut = triangulator.triangles(&corners).chunks_exact(3);
        groups[group].1.extend(cut.map(|t| [t[0], t[1], t[2]].map(|i| these[i as usize])));
    }

    let mut triangles = Vec::with_capacity(groups.iter().map(|(_, triangles)| triangles.len()).sum());
    let mut ranges = Vec::with_capacity(groups.len());
    for (colour, mut of_this_colour) in groups {
        let start = triangles.len();
        triangles.append(&mut of_this_colour);
        ranges.push(Group { colour, triangles: start..triangles.len() });
    }
    Mesh::new(positions, triangles)?.with_groups(ranges)?.with_normals(vectors(&model.normals))
}
