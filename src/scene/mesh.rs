//! The triangle mesh: the one kind of geometry that is rendered, traced and measured.

use super::texture::Skin;
use crate::Error;
use glam::{DVec2, DVec3};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::ops::Range;

/// The largest magnitude of a coordinate, in scene units. Squares of distances between such points still fit float32.
pub(super) const FARTHEST: f64 = 1e15;

/// A triangle mesh in world space, in scene units and float64. [`Mesh::new`] ensures that it has at least one triangle,
/// that its positions are finite, and that its indices are in range; who changes its fields must keep that, and the
/// groups' promise. [`Mesh::with_groups`] checks new groups.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The positions of the vertices, each coordinate at most 1e15 in magnitude.
    pub positions: Vec<DVec3>,
    /// The triangles, each as three indices into `positions`. Their winding has no meaning: both sides of a triangle
    /// are visible, and both occlude.
    pub triangles: Vec<[u32; 3]>,
    /// The colours. Each group is a run of `triangles`, and the groups cover all triangles in order.
    pub groups: Vec<Group>,
    /// The normals as they were given, of any length, one for each position. A normal is (0, 0, 0) if it is unknown.
    /// The list is empty if no normals were given.
    normals: Vec<DVec3>,
    /// The texture coordinates, one for each position, with v up. Empty if no texture is used.
    coordinates: Vec<DVec2>,
    /// The colours of the vertices, one for each position, by which those of the groups are multiplied. Empty if all
    /// are white.
    colours: Vec<[f32; 3]>,
    /// The textures of each group. Empty if no texture is used.
    skins: Vec<Skin>,
}

/// A run of triangles of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Red, green and blue in [0, 1], as they are in the file. They are not converted between colour spaces.
    pub colour: [f32; 3],
    /// The range of triangles in [`Mesh::triangles`].
    pub triangles: Range<usize>,
}

impl Mesh {
    /// Makes a white mesh without normals.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no triangle, if a coordinate is not finite or above 1e15 in magnitude, or if an
    /// index is out of range.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Mesh, Error> {
        if triangles.is_empty() {
            return Err(Error::Usage("a mesh needs at least one triangle".into()));
        }
        // The comparison is written so that NaN is refused too.
        if let Some(i) = positions.iter().position(|p| !(p.abs().cmple(DVec3::splat(FARTHEST)).all())) {
            return Err(Error::Usage(format!("position {i} of the mesh is not finite, or past 1e15 in magnitude")));
        }
        let out_of_range = |t: &[u32; 3]| t.iter().any(|&i| i as usize >= positions.len());
        if let Some(i) = triangles.iter().position(out_of_range) {
            let count = positions.len();
            return Err(Error::Usage(format!(
                "triangle {i} of the mesh has an index out of range; there are {count} positions"
            )));
        }
        let white = Group { colour: [1.0; 3], triangles: 0..triangles.len() };
        Ok(Mesh {
            positions,
            triangles,
            groups: vec![white],
            normals: Vec::new(),
            coordinates: Vec::new(),
            colours: Vec::new(),
            skins: Vec::new(),
        })
    }

    /// Gives the mesh these colours.
    ///
    /// # Errors
    /// [`Error::Usage`] unless the groups cover all triangles in order, without a gap or an overlap, and the colours
    /// lie in [0, 1].
    pub fn with_groups(mut self, groups: Vec<Group>) -> Result<Mesh, Error> {
        let mut covered = 0;
        for group in &groups {
            let Range { start, end } = group.triangles;
            let colour_fits = group.colour.iter().all(|x| (0.0..=1.0).contains(x));
            if start != covered || end < start || !colour_fits {
                return Err(Error::Usage(format!(
                    "the group of triangles {start}..{end} must start at {covered}, and its colour lie in [0, 1]"
                )));
            }
            covered = end;
        }
        if covered != self.triangles.len() {
            return Err(Error::Usage(format!("groups cover {covered} of {} triangles", self.triangles.len())));
        }
        self.groups = groups;
        self.skins = Vec::new();
        Ok(self)
    }

    /// Gives the mesh one skin for each group, and one texture coordinate for each position.
    pub(super) fn with_skins(mut self, skins: Vec<Skin>, coordinates: Vec<DVec2>) -> Mesh {
        assert!(skins.len() == self.groups.len() && coordinates.len() == self.positions.len());
        if skins.iter().any(|skin| *skin != Skin::default()) {
            (self.skins, self.coordinates) = (skins, coordinates);
        }
        self
    }

    /// Gives the mesh one colour for each position.
    pub(super) fn with_vertex_colours(mut self, colours: Vec<[f32; 3]>) -> Mesh {
        assert_eq!(colours.len(), self.positions.len());
        if colours.iter().any(|&colour| colour != [1.0; 3]) {
            self.colours = colours;
        }
        self
    }

    /// Returns the textures of each group, or nothing if no texture is used.
    pub(crate) fn skins(&self) -> &[Skin] {
        &self.skins
    }

    /// Returns the texture coordinates, one for each position, or nothing if no texture is used.
    pub(crate) fn coordinates(&self) -> &[DVec2] {
        &self.coordinates
    }

    /// Returns the colours of the vertices, one for each position, or nothing if all are white.
    pub(crate) fn vertex_colours(&self) -> &[[f32; 3]] {
        &self.colours
    }

    /// Returns whether a texture cuts the surface away at a point of a triangle, or of its plane.
    pub(crate) fn is_cut(&self, triangle: usize, barycentric: DVec3) -> bool {
        !self.skins.is_empty()
            && self
                .skins
                .get(self.group_of(triangle))
                .and_then(|skin| skin.cut.as_ref())
                .is_some_and(|map| map.cuts(self.coordinate(triangle, barycentric)))
    }

    /// Returns the colour of the material at a point of a triangle, or of its plane.
    pub(crate) fn diffuse(&self, triangle: usize, barycentric: DVec3) -> [f32; 3] {
        let group = self.group_of(triangle);
        let mut colour = self.groups.get(group).map_or([1.0; 3], |group| group.colour);
        let mut times = |by: [f32; 3]| (0..3).for_each(|channel| colour[channel] *= by[channel]);
        if !self.colours.is_empty() {
            let [a, b, c] =
                self.triangles[triangle].map(|i| DVec3::from_array(self.colours[i as usize].map(f64::from)));
            let mixed = barycentric.x * a + barycentric.y * b + barycentric.z * c;
            times(mixed.clamp(DVec3::ZERO, DVec3::ONE).as_vec3().to_array());
        }
        if let Some(map) = self.skins.get(group).and_then(|skin| skin.colour.as_ref()) {
            times(map.colour(self.coordinate(triangle, barycentric)));
        }
        colour
    }

    fn coordinate(&self, triangle: usize, barycentric: DVec3) -> DVec2 {
        let [a, b, c] = self.triangles[triangle].map(|i| self.coordinates[i as usize]);
        barycentric.x * a + barycentric.y * b + barycentric.z * c
    }

    /// Returns the number of the group to which a triangle belongs.
    fn group_of(&self, triangle: usize) -> usize {
        self.groups.partition_point(|group| group.triangles.end <= triangle)
    }

    /// Gives the mesh these normals, one per position. They may have any length, and an unknown normal is (0, 0, 0).
    ///
    /// # Errors
    /// [`Error::Usage`] unless there are as many normals as positions, all of them finite.
    pub fn with_normals(mut self, normals: Vec<DVec3>) -> Result<Mesh, Error> {
        if normals.len() != self.positions.len() || !normals.iter().all(|n| n.is_finite()) {
            return Err(Error::Usage("a mesh needs one finite normal per position".into()));
        }
        self.normals = if normals.iter().all(|&n| n == DVec3::ZERO) { Vec::new() } else { normals };
        Ok(self)
    }

    /// Computes a unit normal for each position. It is the normal that the mesh was given. If that is unknown, it is
    /// the mean of the normals of all triangles that meet at this point, weighted by their areas. A point at which all
    /// triangles have zero area gets (0, 1, 0).
    ///
    /// The normals are not stored, because rendering uses the normals of the triangles by default.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let given = self.normals.iter().map(|&n| unit(n)).collect::<Vec<_>>();
        if !given.is_empty() && given.iter().all(Option::is_some) {
            return given.into_iter().flatten().collect();
        }
        // Vertices at the same position are one point of the surface, even if their normals or materials differ. Adding
        // zero turns -0 into 0.
        let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
        let mut sums: HashMap<[u64; 3], DVec3> = HashMap::with_capacity(self.positions.len());
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let doubled_area = (b - a).cross(c - a);
            for p in [a, b, c] {
                *sums.entry(key(p)).or_default() += doubled_area;
            }
        }
        let averaged = |p: &DVec3| sums.get(&key(*p)).copied().and_then(unit).unwrap_or(DVec3::Y);
        let known = given.into_iter().chain(std::iter::repeat(None));
        self.positions.iter().zip(known).map(|(p, n)| n.unwrap_or_else(|| averaged(p))).collect()
    }

    /// Returns the same surface, with every triangle divided into four at the middles of its sides.
    #[must_use]
    pub fn subdivided(&self) -> Mesh {
        let (mut positions, mut coordinates) = (self.positions.clone(), self.coordinates.clone());
        let (mut colours, skins) = (self.colours.clone(), self.skins.clone());
        let mut normals: Vec<DVec3> = self.normals.iter().map(|&n| unit(n).unwrap_or_default()).collect();
        // The middle of each side, by the indices of its ends, so that triangles that share a side share its middle.
        let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(2 * self.triangles.len());
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let [a, b] = [a, b].map(|i| i as usize);
                if let (Some(&n), Some(&m)) = (normals.get(a), normals.get(b)) {
                    let known = n != DVec3::ZERO && m != DVec3::ZERO;
                    normals.push(if known { n.midpoint(m) } else { DVec3::ZERO });
                }
                if !coordinates.is_empty() {
                    coordinates.push(coordinates[a].midpoint(coordinates[b]));
                }
                if !colours.is_empty() {
                    colours.push([0, 1, 2].map(|i| f32::midpoint(colours[a][i], colours[b][i])));
                }
                positions.push(positions[a].midpoint(positions[b]));
                (positions.len() - 1) as u32
            })
        };
        let mut triangles = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        let of_four = |Range { start, end }: &Range<usize>| 4 * start..4 * end;
        let groups = self.groups.iter().map(|g| Group { colour: g.colour, triangles: of_four(&g.triangles) }).collect();
        Mesh { positions, triangles, groups, normals, coordinates, colours, skins }
    }

    /// Returns the SHA-256 of all that the mesh holds, in hexadecimal. Two meshes with the same one give the same
    /// pictures.
    #[must_use]
    pub fn sha256(&self) -> String {
        let Mesh { positions, triangles, groups, normals, coordinates, colours, skins } = self;
        let mut hash = Sha256::new();
        // Each list begins with its length, so that no two meshes give the same bytes.
        hash.update(positions.len().to_le_bytes());
        positions.iter().flat_map(DVec3::to_array).for_each(|x| hash.update(x.to_le_bytes()));
        hash.update(normals.len().to_le_bytes());
        normals.iter().flat_map(DVec3::to_array).for_each(|x| hash.update(x.to_le_bytes()));
        hash.update(coordinates.len().to_le_bytes());
        coordinates.iter().flat_map(DVec2::to_array).for_each(|x| hash.update(x.to_le_bytes()));
        hash.update(colours.len().to_le_bytes());
        colours.iter().flatten().for_each(|x| hash.update(x.to_le_bytes()));
        hash.update(triangles.len().to_le_bytes());
        triangles.iter().flatten().for_each(|i| hash.update(i.to_le_bytes()));
        hash.update(groups.len().to_le_bytes());
        for Group { colour, triangles } in groups {
            colour.iter().for_each(|x| hash.update(x.to_le_bytes()));
            hash.update(triangles.end.to_le_bytes());
        }
        for Skin { colour, cut } in skins {
            for map in [colour, cut] {
                hash.update([u8::from(map.is_some())]);
                map.iter().for_each(|map| map.hash(&mut hash));
            }
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Returns the bounding box of all positions, as its smallest and its largest corner.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.positions.iter().fold(empty, |(low, high), &p| (low.min(p), high.max(p)))
    }

    /// Returns the length of the bounding box's diagonal, in scene units.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        low.distance(high)
    }
}

/// Returns the unit vector along `n`, or `None` if `n` is zero. `n` is scaled first, so that its length neither
/// overflows nor underflows.
fn unit(n: DVec3) -> Option<DVec3> {
    let largest = n.abs().max_element();
    (largest > 0.0).then(|| (n / largest).normalize())
}
