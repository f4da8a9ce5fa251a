//! Stands between an OBJ file and tobj, which makes the mesh. tobj reads only what this guard writes: triangles with
//! positive indices, positions, and a normal and a texture coordinate for every corner or for none.
//!
//! tobj 4.0.5 has the following faults, none of which such text meets. It
//! - does not name lines in its errors;
//! - panics on `vt` and `vn` indices that point before the first element, or are near 2^63;
//! - accepts NaN and infinity;
//! - makes triangles of polylines (`l 1 2 3`), and fans of concave faces, and divides positions by their weights;
//! - adds nothing to its list of normals for a corner that has none, so that normals no longer match their positions;
//! - silently loses the first line after a byte order mark, which shifts every index by one;
//! - refuses continued lines, comments after a statement, tabs after `usemtl`, bytes that are not UTF-8, and files that
//!   give colours to some positions only;
//! - keeps 104 bytes for each face until its object ends, and several hundred for each object and material. The
//!   guard therefore ends an object after [`OBJECT`] triangles, and keeps the materials of triangles itself.

use super::mesh::FARTHEST;
use super::mtl::{MOST_LIBRARIES, Materials, WHITE, too_many_libraries};
use super::notices::{Kind, Notices};
use super::polygon::{MOST_CORNERS, Triangulator};
use super::statement::{Statement, Statements, number, quoted};
use super::texture::FARTHEST_COORDINATE;
use crate::Error;
use glam::DVec3;
use std::collections::HashSet;
use std::io::{self, BufRead, ErrorKind, Read};
use std::path::Path;

/// The most positions or normals, and corners of triangles, whose indices have 32 bits.
const MOST: usize = u32::MAX as usize;

/// How many triangles make one of tobj's objects, which share no vertices.
const OBJECT: usize = 1 << 16;

/// The index of a corner that has no normal.
const NONE: u32 = u32::MAX;

/// The text for tobj is made in pieces of about this many bytes.
const PIECE: usize = 1 << 14;

/// What the file holds besides what tobj reads from it.
#[derive(Default)]
pub(super) struct Found {
    /// The number of triangles.
    pub(super) triangles: usize,
    /// The number of positions.
    pub(super) positions: usize,
    /// The materials that `usemtl` statements name.
    pub(super) materials: Materials,
    /// Which triangles have which material.
    pub(super) uses: Vec<Use>,
    /// The names in `mtllib` statements, with their lines. Each name is listed once, since some exporters repeat the
    /// statement before each object. At most [`MOST_LIBRARIES`] names are kept.
    pub(super) libraries: Vec<(u64, Box<[u8]>)>,
    /// What a file without faces holds in their place.
    pub(super) instead: Option<&'static str>,
    pub(super) notices: Notices,
    /// Notices that matter only if a texture is used.
    pub(super) texture_notices: Notices,
    /// The colours that follow positions, by the number of the position. Empty if there are none.
    pub(super) colours: Vec<[f32; 3]>,
    /// The positions of each triangle's corners, from the triangle on before which the first colour stands.
    pub(super) coloured: Option<(usize, Vec<[u32; 3]>)>,
}

/// Triangles that have one material, up to those of the next `Use`.
#[derive(Clone, Copy, Default)]
pub(super) struct Use {
    /// The number of the first triangle.
    pub(super) first: u32,
    pub(super) material: u32,
    /// The line of the first triangle if these triangles lack texture coordinates, so that no texture can be laid on
    /// them, or 0 if they have them at all corners.
    pub(super) bare: u64,
}

/// Reads an OBJ file statement by statement, and gives tobj what it can read of it.
pub(super) struct Guard<'a, R> {
    statements: Statements<'a, R>,
    writer: Writer,
    /// How much of the text has been read.
    read: usize,
    error: Option<Error>,
}

/// Writes the text for tobj.
#[derive(Default)]
struct Writer {
    text: Vec<u8>,
    /// The positions, from which faces are divided into triangles.
    positions: Vec<DVec3>,
    /// The number of normals in the file. In the text there is one more if there are any: the first one stands for an
    /// unknown normal.
    normals: usize,
    /// The number of texture coordinates in the file. In the text there is one more, as for normals.
    coordinates: usize,
    /// The numbers of those that give no point of a texture.
    bad_coordinates: HashSet<u32>,
    found: Found,
    face: Face,
}

/// The face that is being read. Its memory is kept from one face to the next.
struct Face {
    /// The indices of the position, the texture coordinate and the normal of each corner, counted from 0.
    corners: Vec<[u32; 3]>,
    points: Vec<DVec3>,
    triangulator: Triangulator,
}

impl Default for Face {
    fn default() -> Face {
        Face { corners: Vec::new(), points: Vec::new(), triangulator: Triangulator::new() }
    }
}

impl Found {
    /// Changes what the next triangles have, as `change` makes it of what the triangles before have.
    fn use_from_here(&mut self, change: impl FnOnce(Use) -> Use) {
        let first = self.triangles as u32;
        let last = self.uses.last().copied().unwrap_or_default();
        if self.uses.last().is_some_and(|last| last.first == first) {
            self.uses.pop(); // no triangle has it
        }
        self.uses.push(Use { first, ..change(last) });
    }
}

impl<'a, R: BufRead> Guard<'a, R> {
    /// Guards `obj`. `path` names it in messages.
    pub(super) fn new(obj: R, path: &'a Path) -> Guard<'a, R> {
        Guard { statements: Statements::new(obj, path), writer: Writer::default(), read: 0, error: None }
    }

    /// Returns what was found in the file, which tobj has read to its end.
    ///
    /// # Errors
    /// What is wrong with the file. tobj knows only that there is an error.
    pub(super) fn finish(self) -> Result<Found, Error> {
        let Writer { positions, found, .. } = self.writer;
        self.error.map_or(Ok(Found { positions: positions.len(), ..found }), Err)
    }

    /// Writes at least [`PIECE`] bytes, or all that is left.
    fn write(&mut self) -> Result<(), Error> {
        while self.writer.text.len() < PIECE {
            let Some(statement) = self.statements.next()? else { break };
            self.writer.statement(&statement).map_err(|what| statement.refuse(what))?;
        }
        Ok(())
    }
}

impl<R: BufRead> BufRead for Guard<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.writer.text.len() {
            self.writer.text.clear();
            self.read = 0;
            if let Err(error) = self.write() {
                self.error = Some(error);
                return Err(ErrorKind::InvalidData.into());
            }
        }
        Ok(&self.writer.text[self.read..])
    }

    fn consume(&mut self, bytes: usize) {
        self.read += bytes;
    }
}

impl<R: BufRead> Read for Guard<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}

impl Writer {
    /// Writes what tobj has to read of one statement and keeps the rest, or returns what is wrong with it.
    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        let found = &mut self.found;
        match statement.keyword() {
            "v" if self.positions.len() == MOST => return Err(too_large("positions")),
            "v" => {
                let (position, words) = triple("v", FARTHEST, statement.words())?;
                if let Some(colour) = colour(statement) {
                    found.coloured.get_or_insert_with(|| (found.triangles, Vec::new()));
                    found.colours.resize(self.positions.len(), WHITE);
                    found.colours.push(colour);
                }
                self.positions.push(position);
                self.vector("v", words);
            }
            "vn" if self.normals == MOST - 1 => return Err(too_large("normals")),
            "vn" => {
                if self.normals == 0 {
                    self.end_object();
                    self.vector("vn", ["0"; 3]);
                }
                self.normals += 1;
                let normal = triple("vn", f64::MAX, statement.words()).and_then(|(normal, words)| match normal {
                    DVec3::ZERO => Err("this vn has no length".into()),
                    _ => Ok(words),
                });
                // A normal that is left out keeps its place, so that the next ones keep their indices.
                let words = normal.unwrap_or_else(|what| {
                    self.found.notices.add(Kind::Normal, || statement.notice(what));
                    ["0"; 3]
                });
                self.vector("vn", words);
            }
            "vt" if self.coordinates == MOST - 1 => return Err(too_large("texture coordinates")),
            "vt" => {
                if self.coordinates == 0 {
                    self.end_object();
                    self.vector("vt", ["0"; 2]);
                }
                let words = coordinate(statement).unwrap_or_else(|what| {
                    self.found.texture_notices.add(Kind::Coordinate, || statement.notice(what));
                    self.bad_coordinates.insert(self.coordinates as u32);
                    ["0"; 2]
                });
                self.coordinates += 1;
                self.vector("vt", words);
            }
            "f" => self.face(statement)?,
            "usemtl" => {
                let next = (found.materials.len() as u32 + 1, statement.line());
                let (material, _) = match found.materials.get(statement.name()) {
                    Some(&material) => material,
                    None => *found.materials.entry(statement.name().into()).or_insert(next),
                };
                found.use_from_here(|_| Use { material, ..Use::default() });
            }
            "mtllib" => {
                let name = statement.name();
                if !found.libraries.iter().any(|(_, known)| **known == *name) {
                    if found.libraries.len() < MOST_LIBRARIES {
                        found.libraries.push((statement.line(), name.into()));
                    } else {
                        found.notices.add(Kind::Excess, || statement.notice(too_many_libraries()));
                    }
                }
            }
            "p" | "l" => found.instead = Some("points and lines"),
            "surf" | "curv" | "curv2" => found.instead = Some("curved surfaces, which are not read"),
            "newmtl" => found.instead = Some("materials"),
            "F" => found.instead = Some("statements in capital letters: write f for F, and v for V"),
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, statement: &Statement) -> Result<(), String> {
        let Face { corners, points, triangulator } = &mut self.face;
        corners.clear();
        for word in statement.words() {
            if corners.len() == MOST_CORNERS {
                return Err(format!("a face of more than {MOST_CORNERS} corners; triangulate it before exporting"));
            }
            let [v, vt, vn] = corner(word, [self.positions.len(), self.coordinates, self.normals]);
            let vt = vt.unwrap_or_else(|what| {
                self.found.texture_notices.add(Kind::CoordinateIndex, || statement.notice(what));
                NONE
            });
            let vt = if self.bad_coordinates.contains(&vt) { NONE } else { vt };
            let v = v?;
            let vn = vn.unwrap_or_else(|what| {
                self.found.notices.add(Kind::NormalIndex, || statement.notice(what));
                NONE
            });
            corners.push([v, vt, vn]);
        }
        if corners.len() < 3 {
            self.found.instead = Some("faces of fewer than 3 corners");
            self.found.notices.add(Kind::Face, || statement.notice("a face needs 3 corners"));
            return Ok(());
        }
        if self.found.triangles > MOST / 3 - MOST_CORNERS {
            return Err(format!("more than {} triangles; split the model", MOST / 3));
        }
        // A texture is laid on a whole face, or not at all.
        let bare = corners.iter().any(|&[_, vt, _]| vt == NONE);
        if bare {
            corners.iter_mut().for_each(|[_, vt, _]| *vt = NONE);
        }
        if let Some(&last) = self.found.uses.last()
            && (last.bare > 0) != bare
        {
            self.found.use_from_here(|last| Use { bare: if bare { statement.line() } else { 0 }, ..last });
        }
        points.clear();
        points.extend(corners.iter().map(|&[v, ..]| self.positions[v as usize]));
        for triangle in triangulator.triangles(points).chunks_exact(3) {
            if self.found.triangles.is_multiple_of(OBJECT) {
                self.text.extend_from_slice(b"g\n");
            }
            self.found.triangles += 1;
            self.text.push(b'f');
            for &i in triangle {
                let [v, vt, vn] = corners[i as usize];
                self.text.push(b' ');
                push_number(&mut self.text, u64::from(v) + 1);
                if self.coordinates > 0 || self.normals > 0 {
                    self.text.push(b'/');
                }
                if self.coordinates > 0 {
                    push_number(&mut self.text, if vt == NONE { 1 } else { u64::from(vt) + 2 });
                }
                if self.normals > 0 {
                    self.text.push(b'/');
                    push_number(&mut self.text, if vn == NONE { 1 } else { u64::from(vn) + 2 });
                }
            }
            self.text.push(b'\n');
            if let (Some((_, coloured)), &[a, b, c]) = (&mut self.found.coloured, triangle) {
                coloured.push([a, b, c].map(|i| corners[i as usize][0]));
            }
        }
        Ok(())
    }

    /// Ends one of tobj's objects.
    fn end_object(&mut self) {
        self.text.extend_from_slice(b"g\n");
    }

    /// Writes a statement whose `words` are numbers, as the file has them.
    fn vector<const N: usize>(&mut self, keyword: &str, words: [&str; N]) {
        self.text.extend_from_slice(keyword.as_bytes());
        for word in words {
            self.text.push(b' ');
            self.text.extend_from_slice(word.as_bytes());
        }
        self.text.push(b'\n');
    }
}

/// Writes a number. This is much faster than by a formatter.
fn push_number(text: &mut Vec<u8>, mut number: u64) {
    let (mut digits, mut start) = ([b'0'; 20], 20);
    loop {
        start -= 1;
        digits[start] += (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[start..]);
}

fn too_large(of: &str) -> String {
    format!("more than {MOST} {of}; split the model")
}

/// Parses three finite numbers of at most `most` in magnitude. Returns them and their words. What follows them (a
/// weight, a colour) is ignored.
fn triple<'a>(
    keyword: &str,
    most: f64,
    mut words: impl Iterator<Item = &'a str>,
) -> Result<(DVec3, [&'a str; 3]), String> {
    let mut next = || {
        let word = words.next().ok_or_else(|| format!("{keyword} needs three numbers"))?;
        let x = number(word)?;
        if x.abs() > most {
            return Err(format!("{} is past {most:e} in magnitude; scale the model down", quoted(word)));
        }
        Ok((x, word))
    };
    let [x, y, z] = [next()?, next()?, next()?];
    Ok((DVec3::new(x.0, y.0, z.0), [x.1, y.1, z.1]))
}

/// Parses the colour that follows a position, clamped to [0, 1].
fn colour(statement: &Statement) -> Option<[f32; 3]> {
    let mut words = statement.words().skip(3);
    let mut next = || words.next().and_then(|word| number(word).ok()).map(|x| x.clamp(0.0, 1.0) as f32);
    Some([next()?, next()?, next()?])
}

/// Parses the numbers of `vt u v` or `vt u`, and returns their words.
fn coordinate<'a>(statement: &'a Statement) -> Result<[&'a str; 2], String> {
    let mut words = statement.words();
    let u = words.next().ok_or("vt needs two numbers")?;
    let words = [u, words.next().unwrap_or("0")];
    for word in words {
        if number(word)?.abs() > FARTHEST_COORDINATE {
            return Err(format!("{} is past {FARTHEST_COORDINATE:e} in magnitude", quoted(word)));
        }
    }
    Ok(words)
}

/// Parses one corner of a face into the indices of its position, its texture coordinate and its normal, counted from 0.
/// `counts` are how many of each the file has had so far. Only an error of the position makes the face invalid.
fn corner(word: &str, counts: [usize; 3]) -> [Result<u32, String>; 3] {
    let mut parts = word.split('/');
    let parts = [parts.next(), parts.next(), parts.next(), parts.next()];
    let no_corner = || format!("{} is not a corner; write v, v/vt, v//vn or v/vt/vn", quoted(word));
    let read = |which: usize, of: &str| match parts[which] {
        None | Some("") if which > 0 => Ok(NONE),
        part => part.unwrap_or("").parse::<i64>().map_err(|_| no_corner()).and_then(|i| index(i, counts[which], of)),
    };
    let position = if parts[3].is_some() { Err(no_corner()) } else { read(0, "v") };
    [position, read(1, "vt"), read(2, "vn")]
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
