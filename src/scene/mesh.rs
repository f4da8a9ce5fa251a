//! Triangles: the one shape that everything else renders, traces and measures.

use crate::Error;
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;

/// The largest magnitude of a coordinate, scene units. Squares of what is made from it still fit float32's range.
pub(super) const FARTHEST: f64 = 1e15;

/// A triangle mesh in world space, scene units, float64. Made by [`Mesh::new`], it holds at least one triangle, its
/// positions are finite and its indices in range.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Positions, at most 1e15 in magnitude on each axis.
    pub positions: Vec<DVec3>,
    /// Three indices into `positions` each. Winding says nothing: both sides are visible and both occlude.
    pub triangles: Vec<[u32; 3]>,
    /// One run of `triangles` per colour; together they cover all, in order.
    pub groups: Vec<Group>,
    /// As given: one per position, (0, 0, 0) where unknown; or empty.
    normals: Vec<DVec3>,
}

/// The triangles of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Red, green and blue in [0, 1], as in the file: no colour space is applied.
    pub colour: [f32; 3],
    /// Which of the mesh's triangles.
    pub triangles: Range<usize>,
}

impl Mesh {
    /// A white mesh, checked: positions finite and at most 1e15 in magnitude, indices in range, one triangle or more.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Mesh, Error> {
        if triangles.is_empty() {
            return Err(Error::Usage("a mesh needs at least one triangle".into()));
        }
        // Written so that NaN is refused too.
        if let Some(i) = positions.iter().position(|p| !(p.abs().cmple(DVec3::splat(FARTHEST)).all())) {
            return Err(Error::Usage(format!("position {i} of the mesh is not finite or past 1e15 in magnitude")));
        }
        let out_of_range = |t: &[u32; 3]| t.iter().any(|&i| i as usize >= positions.len());
        if let Some(i) = triangles.iter().position(out_of_range) {
            let count = positions.len();
            return Err(Error::Usage(format!("triangle {i} of the mesh has an index past its {count} positions")));
        }
        let white = Group { colour: [1.0; 3], triangles: 0..triangles.len() };
        Ok(Mesh { positions, triangles, groups: vec![white], normals: Vec::new() })
    }

    /// The same mesh with these colours. The groups must cover all triangles, in order, without gap or overlap.
    pub fn with_groups(mut self, groups: Vec<Group>) -> Result<Mesh, Error> {
        let mut covered = 0;
        for group in &groups {
            let Range { start, end } = group.triangles;
            let colour_fits = group.colour.iter().all(|x| (0.0..=1.0).contains(x));
            if start != covered || end < start || !colour_fits {
                return Err(Error::Usage(format!("the group of triangles {start}..{end} leaves a gap or [0, 1]")));
            }
            covered = end;
        }
        if covered != self.triangles.len() {
            return Err(Error::Usage(format!("groups cover {covered} of {} triangles", self.triangles.len())));
        }
        self.groups = groups;
        Ok(self)
    }

    /// The same mesh with these normals: one per position, finite, of any length; (0, 0, 0) where unknown.
    pub fn with_normals(mut self, normals: Vec<DVec3>) -> Result<Mesh, Error> {
        if normals.len() != self.positions.len() || !normals.iter().all(|n| n.is_finite()) {
            return Err(Error::Usage("a mesh needs one finite normal per position".into()));
        }
        self.normals = if normals.iter().all(|&n| n == DVec3::ZERO) { Vec::new() } else { normals };
        Ok(self)
    }

    /// A unit normal for each position: the file's where it has one, else the mean of the normals of the triangles
    /// that meet in that point, weighted by their areas.
    ///
    /// Computed on demand, since rendering takes its normals from the triangles unless told otherwise. A point where
    /// all triangles have zero area gets (0, 1, 0).
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let given = self.normals.iter().map(|&n| unit(n)).collect::<Vec<_>>();
        if !given.is_empty() && given.iter().all(Option::is_some) {
            return given.into_iter().flatten().collect();
        }
        // Positions that differ in their normals or materials only are one point of the surface. Adding zero makes
        // -0 and 0 the same.
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

    /// The same surface with every triangle cut in four at the middles of its sides.
    #[must_use]
    pub fn subdivided(&self) -> Mesh {
        let mut positions = self.positions.clone();
        let mut normals: Vec<DVec3> = self.normals.iter().map(|&n| unit(n).unwrap_or_default()).collect();
        // Triangles that share a side share its middle.
        let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(2 * self.triangles.len());
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let [a, b] = [a, b].map(|i| i as usize);
                if let (Some(&n), Some(&m)) = (normals.get(a), normals.get(b)) {
                    let known = n != DVec3::ZERO && m != DVec3::ZERO;
                    normals.push(if known { n.midpoint(m) } else { DVec3::ZERO });
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
        Mesh { positions, triangles, groups, normals }
    }

    /// The corners of the bounding box of all positions, smallest and largest.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.positions.iter().fold(empty, |(low, high), &p| (low.min(p), high.max(p)))
    }

    /// The length of the bounding box's diagonal, scene units.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        low.distance(high)
    }
}

/// The unit vector along `n`, none for zero. Scaled first, so that no length over- or underflows.
fn unit(n: DVec3) -> Option<DVec3> {
    let largest = n.abs().max_element();
    (largest > 0.0).then(|| (n / largest).normalize())
}
