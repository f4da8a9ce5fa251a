//! The parts of a mesh, while they are being read from a PLY, STL or glTF file.

use super::mesh::{FARTHEST, Group, Mesh};
use super::texture::Skin;
use crate::Error;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// The most positions, and corners of triangles, whose indices have 32 bits.
pub(super) const MOST: usize = u32::MAX as usize;

/// The parts of a mesh. The normals, and the colours and texture coordinates of vertices, are as many as the positions,
/// or none.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) colours: Vec<[f32; 3]>,
    pub(super) coordinates: Vec<DVec2>,
    /// The looks, and the triangles of each.
    groups: Vec<(PartLook, Vec<[u32; 3]>)>,
    group_of: HashMap<([u32; 3], SkinNumber), usize>,
    /// The skins after the first, which has no texture, and their numbers by their keys.
    skins: Vec<Skin>,
    skin_of: HashMap<String, SkinNumber>,
}

/// The number of a skin.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(super) struct SkinNumber(usize);

/// The colour of triangles, and their skin.
type PartLook = ([f32; 3], SkinNumber);

impl Parts {
    /// Returns the number of a skin, which is kept.
    pub(super) fn skin(&mut self, skin: Skin) -> SkinNumber {
        if skin == Skin::default() {
            return SkinNumber::default();
        }
        let next = SkinNumber(self.skins.len() + 1);
        let number = *self.skin_of.entry(skin.key()).or_insert(next);
        if number == next {
            self.skins.push(skin);
        }
        number
    }

    /// Returns the list of the triangles that have this colour and this skin.
    pub(super) fn triangles_of(&mut self, colour: [f32; 3], skin: SkinNumber) -> &mut Vec<[u32; 3]> {
        let group = *self.group_of.entry((colour.map(f32::to_bits), skin)).or_insert(self.groups.len());
        if group == self.groups.len() {
            self.groups.push(((colour, skin), Vec::new()));
        }
        &mut self.groups[group].1
    }

    /// Returns whether there is no triangle.
    pub(super) fn is_empty(&self) -> bool {
        self.groups.iter().all(|(_, triangles)| triangles.is_empty())
    }

    /// Makes the mesh, without the positions that no triangle uses. `path` names the file in messages.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no triangle, or if a position is not finite or above 1e15 in magnitude.
    pub(super) fn into_mesh(self, path: &Path) -> Result<Mesh, Error> {
        let Parts { mut positions, mut normals, mut colours, mut coordinates, groups, skins: known, .. } = self;
        let mut skins: Vec<Skin> = Vec::new();
        let mut ranges: Vec<Group> = Vec::new();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        let all: usize = groups.iter().map(|(_, triangles)| triangles.len()).sum();
        for ((colour, SkinNumber(skin)), of_colour) in groups.into_iter().filter(|(_, triangles)| !triangles.is_empty())
        {
            let start = triangles.len();
            if start == 0 {
                triangles = of_colour;
                triangles.reserve_exact(all - triangles.len());
            } else {
                triangles.extend(of_colour);
            }
            ranges.push(Group { colour, triangles: start..triangles.len() });
            skins.push(skin.checked_sub(1).map_or_else(Skin::default, |after_first| known[after_first].clone()));
        }
        if let Some(used) = used(positions.len(), &triangles) {
            renumber(&mut triangles, &used);
            keep(&mut positions, &used);
            keep(&mut normals, &used);
            keep(&mut colours, &used);
            keep(&mut coordinates, &used);
        }
        let mesh = Mesh::new(positions, triangles).and_then(|mesh| mesh.with_groups(ranges));
        let mesh = mesh.and_then(|mesh| if normals.is_empty() { Ok(mesh) } else { mesh.with_normals(normals) });
        let mesh = mesh.map_err(|e| Error::input(path, e.to_string()))?;
        let mesh = if coordinates.is_empty() { mesh } else { mesh.with_skins(skins, coordinates) };
        Ok(if colours.is_empty() { mesh } else { mesh.with_vertex_colours(colours) })
    }
}

/// Returns which positions triangles use, or `None` if they use all. The others would widen the bounds of the mesh.
fn used(positions: usize, triangles: &[[u32; 3]]) -> Option<Vec<bool>> {
    let mut used = vec![false; positions];
    triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
    used.contains(&false).then_some(used)
}

/// Changes indices of positions to those of the positions that are used.
fn renumber(triangles: &mut [[u32; 3]], used: &[bool]) {
    let mut new = Vec::with_capacity(used.len());
    let mut count = 0;
    for &used in used {
        new.push(count);
        count += u32::from(used);
    }
    triangles.iter_mut().flatten().for_each(|i| *i = new[*i as usize]);
}

/// Keeps the entries of the positions that are used.
fn keep<T>(list: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    list.retain(|_| used.next() == Some(&true));
}

/// Refuses a coordinate that is not finite or too far away.
pub(super) fn check(x: f64) -> Result<(), String> {
    if x.abs() <= FARTHEST {
        Ok(())
    } else if x.is_finite() {
        Err(format!("{x:e} is past {FARTHEST:e} in magnitude; scale the model down"))
    } else {
        Err(format!("{x} is not a finite number"))
    }
}
