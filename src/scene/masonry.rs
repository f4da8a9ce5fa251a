//! The parts of which the nave is built: blocks, patches, turned pieces, ribs, and walls with openings.
//!
//! Lengths are in metres, and y points up. Positions are computed with nothing but arithmetic, square roots and libm's
//! sine and cosine, so that they are the same on every platform.

use super::{Group, Mesh};
use crate::Error;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Transforms a wall's own coordinates to world space. In the wall's coordinates x points along the wall, y up, and z
/// into the wall, away from the viewer.
pub(super) type Place<'a> = &'a dyn Fn(DVec3) -> DVec3;

/// The corners of each side of a block, except the underside. The bits of a corner's number, from the lowest, say
/// whether its x, y and z are the high ones.
const STANDING: [[usize; 4]; 5] = [[4, 5, 7, 6], [0, 1, 3, 2], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];

/// An arched opening in a wall: two jambs, and an arch that is half an ellipse.
#[derive(Clone, Copy)]
pub(super) struct Opening {
    /// The position of its middle along the wall.
    pub(super) middle: f64,
    /// Half its width.
    pub(super) half: f64,
    /// The height of its lower edge.
    pub(super) sill: f64,
    /// The height at which the arch begins.
    pub(super) springing: f64,
    /// The height of the arch's crown above the springing.
    pub(super) rise: f64,
    /// How many chords approximate the arch. It must be even.
    pub(super) chords: usize,
}

impl Opening {
    /// Returns the points of the arch, from its left end to its right end.
    pub(super) fn arch(&self) -> Vec<DVec3> {
        let point = |(c, s): (f64, f64)| DVec3::new(self.middle - self.half * c, self.springing + self.rise * s, 0.0);
        (0..=self.chords).map(|i| point(circle(i, 2 * self.chords))).collect()
    }

    /// Returns the points of the outline, from the left end of the sill over the arch to the right end of the sill.
    fn outline(&self) -> Vec<DVec3> {
        let foot = |x: f64| DVec3::new(x, self.sill, 0.0);
        let (left, right) = (foot(self.middle - self.half), foot(self.middle + self.half));
        [left].into_iter().chain(self.arch()).chain([right]).collect()
    }
}

/// Returns the cosine and the sine of `i`/`n` of a full turn. At quarter turns the results are exactly 0, 1 or -1.
/// libm's results would only be nearly 0, and points that should coincide would not.
pub(super) fn circle(i: usize, n: usize) -> (f64, f64) {
    match (4 * i / n % 4, 4 * i % n) {
        (0, 0) => (1.0, 0.0),
        (1, 0) => (0.0, 1.0),
        (2, 0) => (-1.0, 0.0),
        (3, 0) => (0.0, -1.0),
        _ => {
            let angle = TAU * i as f64 / n as f64;
            (libm::cos(angle), libm::sin(angle))
        }
    }
}

/// The triangles built so far, each with the index of its colour.
pub(super) struct Masonry {
    triangles: Vec<(usize, [DVec3; 3])>,
    /// The index of the colour of the triangles that are added next.
    colour: usize,
}

impl Masonry {
    pub(super) fn new() -> Masonry {
        Masonry { triangles: Vec::new(), colour: 0 }
    }

    /// Sets the material of the triangles that are added next, as an index into the colours.
    pub(super) fn made_of(&mut self, colour: usize) -> &mut Masonry {
        self.colour = colour;
        self
    }

    /// Adds everything that `build` adds, and its mirror image across z = 0.
    pub(super) fn mirrored(&mut self, build: impl FnOnce(&mut Masonry)) {
        let start = self.triangles.len();
        build(self);
        let mirror = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        let copies: Vec<_> = self.triangles[start..].iter().map(|(colour, t)| (*colour, t.map(mirror))).collect();
        self.triangles.extend(copies);
    }

    fn triangle(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        // At a pole a side of a quad has length 0, and if the quad's height is 0, two sides have. The triangles that
        // would have no area are left out.
        if a != b && b != c && c != a {
            self.triangles.push((self.colour, [a, b, c]));
        }
    }

    /// Adds the quad a, b, c, d, as two triangles that share the side from a to c.
    pub(super) fn quad(&mut self, [a, b, c, d]: [DVec3; 4]) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// Adds `rows` by `columns` quads. `point(i, j)` gives their corners, for i from 0 to `rows` and j from 0 to
    /// `columns`. The quads are split symmetrically about the middles of the patch, so that the edges inside them run
    /// along its two diagonals, as the groins of a vault do.
    pub(super) fn patch(&mut self, rows: usize, columns: usize, point: impl Fn(usize, usize) -> DVec3) {
        for i in 0..rows {
            for j in 0..columns {
                let corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                let [a, b, c, d] = corners;
                let turned = (2 * i < rows) != (2 * j < columns);
                self.quad(if turned { [b, c, d, a] } else { corners });
            }
        }
    }

    /// Adds a block in a wall's coordinates. `low` and `high` are its corners of lowest and highest coordinates.
    pub(super) fn block_at(&mut self, place: Place, low: [f64; 3], high: [f64; 3]) {
        self.sides(place, low, high, &[[0, 1, 5, 4]]);
        self.sides(place, low, high, &STANDING);
    }

    /// Adds a block. `low` and `high` are its corners of lowest and highest coordinates.
    pub(super) fn block(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.block_at(&|p| p, low, high);
    }

    /// Adds a block without an underside, for a block that reaches into what is below it.
    pub(super) fn plinth(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.sides(&|p| p, low, high, &STANDING);
    }

    fn sides(&mut self, place: Place, low: [f64; 3], high: [f64; 3], sides: &[[usize; 4]]) {
        let corner = |i: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] });
            place(DVec3::new(x, y, z))
        };
        for side in sides {
            self.quad(side.map(corner));
        }
    }

    /// Adds a turned piece, made by rotating `profile`, points of (radius, height), about the vertical axis through
    /// `foot`. A full turn has `sides` sides; those from number `arc[0]` to number `arc[1]` are added.
    pub(super) fn lathe(&mut self, foot: DVec3, sides: usize, arc: [usize; 2], profile: &[[f64; 2]]) {
        self.patch(profile.len() - 1, arc[1] - arc[0], |i, j| {
            let ([radius, height], (c, s)) = (profile[i], circle(arc[0] + j, sides));
            foot + DVec3::new(radius * c, height, radius * s)
        });
    }

    /// Adds a moulding from x[0] to x[1]. `profile` is its cross section, points of (y, z).
    pub(super) fn moulding(&mut self, x: [f64; 2], profile: &[[f64; 2]]) {
        self.patch(profile.len() - 1, 1, |i, j| DVec3::new(x[j], profile[i][0], profile[i][1]));
    }

    /// Adds a rib along a curved path. `across` is half of its width, as a vector. It reaches from the distance
    /// `outward` outside the path to the distance `inward` inside it; inside is towards `centre`.
    pub(super) fn rib(&mut self, path: &[DVec3], across: DVec3, centre: DVec3, [outward, inward]: [f64; 2]) {
        let section = [(across, outward), (across, -inward), (-across, -inward), (-across, outward)];
        // The outer side is left out, because it is hidden in the vault.
        self.patch(path.len() - 1, 3, |i, j| path[i] + section[j].0 + section[j].1 * (path[i] - centre).normalize());
    }

    /// Adds a rib around an arch in a wall. Unlike a vault's rib, it shows its outer side too.
    pub(super) fn archivolt(&mut self, path: &[DVec3], across: DVec3, centre: DVec3, [outward, inward]: [f64; 2]) {
        self.rib(path, across, centre, [outward, inward]);
        let outer = |i: usize| path[i] + outward * (path[i] - centre).normalize();
        self.patch(path.len() - 1, 1, |i, j| outer(i) + [across, -across][j]);
    }

    /// Adds the face of a wall at the depth `z`, from x[0] to x[1] and y[0] to y[1], except for its opening.
    fn face(&mut self, place: Place, x: [f64; 2], y: [f64; 2], z: f64, opening: &Opening) {
        let [left, right] = [opening.middle - opening.half, opening.middle + opening.half];
        let mut panel = |x: [f64; 2], low: [f64; 2], high: [f64; 2]| {
            let corners = [(x[0], low[0]), (x[1], low[1]), (x[1], high[1]), (x[0], high[0])];
            self.quad(corners.map(|(x, y)| place(DVec3::new(x, y, z))));
        };
        for x in [[x[0], left], [right, x[1]]] {
            panel(x, [y[0]; 2], [opening.sill; 2]);
            panel(x, [opening.sill; 2], [opening.springing; 2]);
            panel(x, [opening.springing; 2], [y[1]; 2]);
        }
        panel([left, right], [y[0]; 2], [opening.sill; 2]);
        for pair in opening.arch().windows(2) {
            panel([pair[0].x, pair[1].x], [pair[0].y, pair[1].y], [y[1]; 2]);
        }
    }

    /// Adds the inside of an opening, from depth z[0] to depth z[1], without its sill.
    fn reveal(&mut self, place: Place, z: [f64; 2], opening: &Opening) {
        let outline = opening.outline();
        self.patch(outline.len() - 1, 1, |i, j| place(outline[i].with_z(z[j])));
    }

    /// Adds a wall of the given thickness, with an opening through it.
    pub(super) fn archway(&mut self, place: Place, x: [f64; 2], y: [f64; 2], thickness: f64, opening: &Opening) {
        self.face(place, x, y, 0.0, opening);
        self.face(place, x, y, thickness, opening);
        self.reveal(place, [0.0, thickness], opening);
    }

    /// Adds the face of a wall with a recess, whose back is closed by a pane. The last argument is the depth of the
    /// recess and the index of the pane's colour.
    pub(super) fn recess(
        &mut self,
        place: Place,
        x: [f64; 2],
        y: [f64; 2],
        opening: &Opening,
        (depth, pane): (f64, usize),
    ) {
        self.face(place, x, y, 0.0, opening);
        self.reveal(place, [0.0, depth], opening);
        let outline = opening.outline();
        let [left, right] = [outline[0], outline[outline.len() - 1]];
        self.quad([left, right, right.with_z(depth), left.with_z(depth)].map(place));
        let wall = std::mem::replace(&mut self.colour, pane);
        // The pane is made of strips between the two sides of the outline, from the sill up to the crown.
        for i in 0..outline.len() / 2 {
            let opposite = outline.len() - 1 - i;
            self.quad([i, opposite, opposite - 1, i + 1].map(|i| place(outline[i].with_z(depth))));
        }
        self.colour = wall;
    }

    /// Makes the mesh, with one group for each of the colours.
    pub(super) fn mesh(mut self, colours: &[[f32; 3]]) -> Result<Mesh, Error> {
        self.triangles.sort_by_key(|(colour, _)| *colour);
        let (mut positions, mut known) = (Vec::new(), HashMap::new());
        // Adding zero turns -0 into 0.
        let mut index = |p: DVec3| {
            let p = p + 0.0;
            *known.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        };
        let triangles: Vec<_> = self.triangles.iter().map(|(_, corners)| corners.map(&mut index)).collect();
        let first = |colour: usize| self.triangles.partition_point(|(c, _)| *c < colour);
        let groups = colours.iter().enumerate().map(|(i, &colour)| Group { colour, triangles: first(i)..first(i + 1) });
        Mesh::new(positions, triangles)?.with_groups(groups.collect())
    }
}
