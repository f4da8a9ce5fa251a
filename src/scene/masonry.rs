//! What the nave is built of: blocks, patches, turned pieces, ribs, and walls with openings.
//!
//! Lengths are metres, y is up. Only arithmetic, square roots and libm's sine and cosine, which are the same on every
//! platform.

use super::{Group, Mesh};
use crate::Error;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// From a wall's own coordinates to the world: x along the wall, y up, z into the wall, away from who looks at it.
pub(super) type Place<'a> = &'a dyn Fn(DVec3) -> DVec3;

/// The sides of a block but its underside: which corners, whose bits say where x, y and z are high.
const STANDING: [[usize; 4]; 5] = [[4, 5, 7, 6], [0, 1, 3, 2], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];

/// An arched opening: two jambs and an arch, half an ellipse.
#[derive(Clone, Copy)]
pub(super) struct Opening {
    /// Its middle along the wall.
    pub(super) middle: f64,
    /// Half its width.
    pub(super) half: f64,
    /// The height of its foot.
    pub(super) sill: f64,
    /// The height at which the arch begins.
    pub(super) springing: f64,
    /// From there to the arch's crown.
    pub(super) rise: f64,
    /// How many chords the arch has, an even number.
    pub(super) chords: usize,
}

impl Opening {
    /// The arch from the left springing to the right.
    pub(super) fn arch(&self) -> Vec<DVec3> {
        let point = |(c, s): (f64, f64)| DVec3::new(self.middle - self.half * c, self.springing + self.rise * s, 0.0);
        (0..=self.chords).map(|i| point(circle(i, 2 * self.chords))).collect()
    }

    /// From the left foot over the arch to the right foot.
    fn outline(&self) -> Vec<DVec3> {
        let foot = |x: f64| DVec3::new(x, self.sill, 0.0);
        let (left, right) = (foot(self.middle - self.half), foot(self.middle + self.half));
        [left].into_iter().chain(self.arch()).chain([right]).collect()
    }
}

/// Part `i` of `n` of a turn: cosine and sine. Exact at the quarters, where libm's cosine is only nearly zero: ends and
/// poles meet.
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

/// Triangles, each of a colour.
pub(super) struct Masonry {
    triangles: Vec<(usize, [DVec3; 3])>,
    colour: usize,
}

impl Masonry {
    pub(super) fn new() -> Masonry {
        Masonry { triangles: Vec::new(), colour: 0 }
    }

    /// What follows has this one of the colours.
    pub(super) fn of(&mut self, colour: usize) -> &mut Masonry {
        self.colour = colour;
        self
    }

    /// What `build` builds, and its mirror image across z = 0.
    pub(super) fn mirrored(&mut self, build: impl FnOnce(&mut Masonry)) {
        let start = self.triangles.len();
        build(self);
        let mirror = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        let copies: Vec<_> = self.triangles[start..].iter().map(|(colour, t)| (*colour, t.map(mirror))).collect();
        self.triangles.extend(copies);
    }

    fn triangle(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        // At a pole a quad has a side without length, and one without height is none.
        if a != b && b != c && c != a {
            self.triangles.push((self.colour, [a, b, c]));
        }
    }

    /// The quad a, b, c, d, split from a to c.
    pub(super) fn quad(&mut self, [a, b, c, d]: [DVec3; 4]) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// `rows` by `columns` quads between the points at (0, 0) to (rows, columns). They are split alike to both sides of
    /// the middle, so that the edges run along both diagonals, as a vault's groins do.
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

    /// A block in a wall's coordinates, from its lowest corner to its highest.
    pub(super) fn block_at(&mut self, place: Place, low: [f64; 3], high: [f64; 3]) {
        self.sides(place, low, high, &[[0, 1, 5, 4]]);
        self.sides(place, low, high, &STANDING);
    }

    /// A block, from its lowest corner to its highest.
    pub(super) fn block(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.block_at(&|p| p, low, high);
    }

    /// A block that stands in what is below it, so that it has no underside.
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

    /// A turned piece about an upright axis through `foot`: a profile of (radius, height), from part `arc[0]` to part
    /// `arc[1]` of `sides` around.
    pub(super) fn lathe(&mut self, foot: DVec3, sides: usize, arc: [usize; 2], profile: &[[f64; 2]]) {
        self.patch(profile.len() - 1, arc[1] - arc[0], |i, j| {
            let ([radius, height], (c, s)) = (profile[i], circle(arc[0] + j, sides));
            foot + DVec3::new(radius * c, height, radius * s)
        });
    }

    /// A moulding along x: a profile of (height, z).
    pub(super) fn moulding(&mut self, x: [f64; 2], profile: &[[f64; 2]]) {
        self.patch(profile.len() - 1, 1, |i, j| DVec3::new(x[j], profile[i][0], profile[i][1]));
    }

    /// A rib along a curved path: `across` is half its width as a vector, and it reaches from `outward` beyond the path
    /// to `inward` within, as seen from `centre`.
    pub(super) fn rib(&mut self, path: &[DVec3], across: DVec3, centre: DVec3, [outward, inward]: [f64; 2]) {
        let section = [(across, outward), (across, -inward), (-across, -inward), (-across, outward)];
        // Without the outer side, which is within the vault.
        self.patch(path.len() - 1, 3, |i, j| path[i] + section[j].0 + section[j].1 * (path[i] - centre).normalize());
    }

    /// A rib on a wall's arch, which shows its outer side too.
    pub(super) fn archivolt(&mut self, path: &[DVec3], across: DVec3, centre: DVec3, [outward, inward]: [f64; 2]) {
        self.rib(path, across, centre, [outward, inward]);
        let outer = |i: usize| path[i] + outward * (path[i] - centre).normalize();
        self.patch(path.len() - 1, 1, |i, j| outer(i) + [across, -across][j]);
    }

    /// The face at depth `z` of a wall from x[0] to x[1] and y[0] to y[1], around its opening.
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

    /// The inside of an opening from depth z[0] to depth z[1], without its sill.
    fn reveal(&mut self, place: Place, z: [f64; 2], opening: &Opening) {
        let outline = opening.outline();
        self.patch(outline.len() - 1, 1, |i, j| place(outline[i].with_z(z[j])));
    }

    /// A wall of some thickness with an opening through it.
    pub(super) fn archway(&mut self, place: Place, x: [f64; 2], y: [f64; 2], thickness: f64, opening: &Opening) {
        self.face(place, x, y, 0.0, opening);
        self.face(place, x, y, thickness, opening);
        self.reveal(place, [0.0, thickness], opening);
    }

    /// A wall's face with a recess, closed at its back by a pane of another colour.
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
        // Strips between the two sides of the outline, from the sill up to the crown.
        for i in 0..outline.len() / 2 {
            let opposite = outline.len() - 1 - i;
            self.quad([i, opposite, opposite - 1, i + 1].map(|i| place(outline[i].with_z(depth))));
        }
        self.colour = wall;
    }

    /// The mesh, one group for each of the colours.
    pub(super) fn mesh(mut self, colours: &[[f32; 3]]) -> Result<Mesh, Error> {
        self.triangles.sort_by_key(|(colour, _)| *colour);
        let (mut positions, mut known) = (Vec::new(), HashMap::new());
        // Adding zero makes -0 and 0 the same.
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
