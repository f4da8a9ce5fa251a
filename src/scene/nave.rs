//! The built-in nave: a generated church interior. It replaces the model of the cathedral of Sibenik if that is not
//! available.
//!
//! Lengths are in metres. x points east, y up and z south, and the floor of the nave is at y = 0. The northern half is
//! the mirror image of the southern half.
//!
//! - The nave reaches from x = -20 to 7 and is 7.2 wide. It has six bays of 4.5. Each bay has, on both sides and from
//!   below: a round arch on columns (abacus at 4.0, crown at 5.75), two openings of a gallery with balusters (6.7 to
//!   8.9), and a window of the clerestory. A groin vault with ribs covers the bay (10.4 to 14.0). Pews stand on both
//!   sides of a carpet. The west wall has a door and a window.
//! - The aisles, one on each side, reach from z = 4.4 to 8. Their floors are 0.15 higher. They have groin vaults with
//!   ribs (4.0 to 6.3) between the arcade and pilasters, and one window per bay. A screen with balusters closes the
//!   last bay, where an altar stands before a niche.
//! - The choir reaches from x = 7 to 14. Its floor is at 1.35, nine steps up, of which seven are round. It lies behind
//!   the chancel arch (6 wide, 10.2 high) and a screen with balusters. It has stalls, two windows on each side, and a
//!   barrel vault up to 11.05.
//! - The apse is a half circle about x = 14.25 with a radius of 3.2. It has five windows, a cornice, a conch (half a
//!   dome) up to 9.7, and the altar.
//!
//! There is no outside: walls have no backs, and windows are recesses with panes. Parts that meet overlap by `INTO`,
//! so that there is no gap between them and no two faces coincide.
//!
//! The depth complexity, which is the mean number of triangles that a ray from the eye meets, is 3.36 at 160x120 from
//! the scene's own camera. That of Sibenik, seen from (-15.5, -10.5, 0) towards (10, -9, 0) with the same field of view
//! of 60 degrees, is 3.04. Both were measured with one float64 ray through the middle of each pixel. After each hit the
//! ray continues at 1e-6 of the depth behind it.

use super::masonry::{Masonry, Opening, circle};
use super::{Lens, Mesh, Scene, View};
use crate::Error;
use glam::{DVec3, dvec3};

// The materials, as indices into COLOURS.
const WALL: usize = 0;
const COLUMN: usize = 1;
const VAULT: usize = 2;
const FLOOR: usize = 3;
const CARPET: usize = 4;
const WOOD: usize = 5;
const MARBLE: usize = 6;
const GLASS: usize = 7;

/// The colour of each material: red, green and blue.
const COLOURS: [[f32; 3]; 8] = [
    [0.73, 0.71, 0.65],
    [0.77, 0.75, 0.69],
    [0.82, 0.80, 0.74],
    [0.62, 0.58, 0.53],
    [0.52, 0.17, 0.14],
    [0.45, 0.30, 0.18],
    [0.84, 0.83, 0.80],
    [0.52, 0.60, 0.68],
];

/// The ends of the nave and the aisles in x.
const WEST: f64 = -20.0;
const EAST: f64 = 7.0;
/// How many bays the nave has, and the length of one.
const BAYS: usize = 6;
const BAY: f64 = 4.5;
/// The length by which parts reach into other parts that they meet.
const INTO: f64 = 0.05;

/// Distances from the middle, in z: the nave's walls, the faces of these walls in the aisles, and the outer walls of
/// the aisles.
const NAVE: f64 = 3.6;
const OUTER: f64 = 4.4;
const AISLE: f64 = 8.0;

/// The heights of the floors of the aisles, under the chancel arch, and of choir and apse.
const AISLE_FLOOR: f64 = 0.15;
const SILL_FLOOR: f64 = 1.2;
const CHOIR_FLOOR: f64 = 1.35;
/// The x at which the arch before the apse begins, and the apse's radius.
const CHOIR_END: f64 = 14.0;
const APSE: f64 = 3.2;

/// The height at which the arcades' arches and the aisles' vaults begin, and the rise of these vaults.
const ARCADE: f64 = 4.0;
const AISLE_RISE: f64 = 2.3;
/// The heights at which the gallery and the clerestory begin.
const GALLERY: f64 = 6.7;
const CLERESTORY: f64 = 8.9;
/// The height at which the nave's vault begins, and its rise.
const VAULT_FOOT: f64 = 10.4;
const VAULT_RISE: f64 = 3.6;
/// How many rows of quads the vault of one bay has in x and in z, in the nave and in the aisles. This is also the
/// number of chords of its ribs. It must be even.
const VAULT_CELLS: usize = 10;
const AISLE_CELLS: usize = 6;
/// The heights of the walls in the nave and in the aisles. Walls end above the vaults that hide their upper ends.
const NAVE_TOP: f64 = 14.3;
const AISLE_TOP: f64 = 6.6;

pub(super) fn scene() -> Result<Scene, Error> {
    Ok(Scene {
        name: super::NAVE.into(),
        mesh: mesh()?,
        view: View {
            eye: Some(dvec3(-16.5, 1.9, 0.0)),
            target: Some(dvec3(10.0, 5.6, 0.0)),
            up: Some(DVec3::Y),
            lens: Some(Lens::FovY(60_f64.to_radians())),
            ..View::default()
        },
        // This is somewhat more than the width of the columns' capitals. With this radius creases and contacts darken,
        // and the middles of walls and floors stay light.
        radius: Some(1.5),
        notices: Vec::new(),
        cameras: Vec::new(),
        motions: Vec::new(),
        files: Vec::new(),
    })
}

fn mesh() -> Result<Mesh, Error> {
    let mut masonry = Masonry::new();
    floors(&mut masonry);
    masonry.mirrored(|m| {
        for k in 0..=BAYS {
            bay_line(m, WEST + BAY * k as f64);
        }
        for k in 0..BAYS {
            bay(m, WEST + BAY * (k as f64 + 0.5));
        }
        string_courses(m);
        aisle_ends(m);
        screens(m);
        pews(m);
        choir_side(m);
    });
    vault(&mut masonry);
    ends(&mut masonry);
    apse(&mut masonry);
    altar(&mut masonry);
    masonry.mesh(&COLOURS)
}

/// Adds the floors, and the steps up to the choir.
fn floors(m: &mut Masonry) {
    let east = EAST + 0.1;
    let strip = |m: &mut Masonry, y: f64, z: [f64; 2]| {
        m.patch(1, 1, |i, j| dvec3([WEST - INTO, east][i], y, z[j]));
    };
    strip(m.made_of(CARPET), 0.0, [-0.8, 0.8]);
    m.made_of(FLOOR).mirrored(|m| {
        strip(m, 0.0, [0.8, 3.25]);
        strip(m, AISLE_FLOOR, [3.2, AISLE + INTO]);
        // The step from the nave up to the columns.
        m.patch(1, 1, |i, j| dvec3([WEST - INTO, east][i], [-INTO, AISLE_FLOOR][j], 3.2));
    });
    // This adds the round steps, then the floor under the chancel arch, then the floor of choir and apse.
    const STEPS: usize = 7;
    let mut profile = Vec::new();
    for k in 0..STEPS {
        let radius = 1.3 + 0.3 * (STEPS - 1 - k) as f64;
        profile.push([radius, if k == 0 { -INTO } else { 0.15 * k as f64 }]);
        profile.push([radius, 0.15 * (k + 1) as f64]);
    }
    profile.push([0.0, 0.15 * STEPS as f64]);
    m.lathe(dvec3(EAST - INTO, 0.0, 0.0), 32, [8, 24], &profile);
    m.plinth([EAST - 0.1, -INTO, -3.1], [EAST + 0.75, SILL_FLOOR, 3.1]);
    m.plinth([EAST + 0.7, -INTO, -NAVE - 0.1], [CHOIR_END + 4.0, CHOIR_FLOOR, NAVE + 0.1]);
}

/// Adds the parts between two bays: a column, the shaft above it, the aisle's pilaster, and a rib of the aisle's vault.
fn bay_line(m: &mut Masonry, x: f64) {
    const PROFILE: [[f64; 2]; 11] = [
        [0.50, 0.38],
        [0.53, 0.45],
        [0.48, 0.53],
        [0.42, 0.58],
        [0.36, 0.70],
        [0.33, 2.95],
        [0.39, 2.98],
        [0.39, 3.06],
        [0.34, 3.10],
        [0.40, 3.40],
        [0.56, 3.65],
    ];
    let middle = NAVE.midpoint(OUTER);
    m.made_of(COLUMN).plinth([x - 0.56, AISLE_FLOOR - INTO, middle - 0.56], [x + 0.56, 0.40, middle + 0.56]);
    // At both ends of the nave, only the half of a column that is not inside the wall is built.
    let half = if x == WEST { [9, 15] } else { [3, 9] };
    let around = if x == WEST || x == EAST { half } else { [0, 12] };
    m.lathe(dvec3(x, 0.0, middle), 12, around, &PROFILE);
    m.block([x - 0.62, 3.62, middle - 0.62], [x + 0.62, ARCADE + 0.02, middle + 0.62]);

    m.lathe(dvec3(x, 0.0, NAVE), 12, [6, 12], &[[0.0, ARCADE + 0.25], [0.18, ARCADE + 0.6], [0.18, 10.3]]);
    m.block([x - 0.32, 10.2, NAVE - 0.32], [x + 0.32, VAULT_FOOT + 0.1, NAVE + 0.1]);

    m.plinth([x - 0.25, AISLE_FLOOR - INTO, AISLE - 0.2], [x + 0.25, ARCADE - 0.1, AISLE + INTO]);
    m.block([x - 0.33, ARCADE - 0.2, AISLE - 0.3], [x + 0.33, ARCADE + 0.04, AISLE + 0.1]);
    let foot = dvec3(x, ARCADE, OUTER.midpoint(AISLE));
    m.made_of(VAULT).rib(&arc(foot, aisle_half(0.0), AISLE_RISE, AISLE_CELLS), 0.2 * DVec3::X, foot, [INTO, 0.12]);
}

/// Returns half the extent of an aisle's bay. In z this is half of the whole bay, in x half of the share `along` of it.
fn aisle_half(along: f64) -> DVec3 {
    dvec3(along * BAY / 2.0, 0.0, (AISLE - OUTER) / 2.0 + INTO)
}

/// Returns the points of half an ellipse over its centre `foot`, from `foot - half` to `foot + half`.
fn arc(foot: DVec3, half: DVec3, rise: f64, chords: usize) -> Vec<DVec3> {
    (0..=chords).map(|i| circle(i, 2 * chords)).map(|(c, s)| foot - c * half + s * rise * DVec3::Y).collect()
}

/// Adds one bay on one side: the arcade's arch, the gallery, the clerestory's window, and the aisle's vault and window.
fn bay(m: &mut Masonry, x: f64) {
    let across = [x - BAY / 2.0, x + BAY / 2.0];
    let wall = |p: DVec3| dvec3(p.x, p.y, NAVE + p.z);
    let arch = Opening {
        middle: x,
        half: BAY / 2.0 - 0.5,
        sill: ARCADE,
        springing: ARCADE,
        rise: BAY / 2.0 - 0.5,
        chords: 12,
    };
    m.made_of(WALL);
    m.archway(&wall, across, [ARCADE, GALLERY], OUTER - NAVE, &arch);
    let path: Vec<_> = arch.arch().into_iter().map(|p| wall(p.with_z((OUTER - NAVE) / 2.0))).collect();
    let centre = dvec3(x, ARCADE, NAVE.midpoint(OUTER));
    m.made_of(COLUMN).archivolt(&path, 0.48 * DVec3::Z, centre, [0.22, 0.06]);

    for middle in [x - BAY / 4.0, x + BAY / 4.0] {
        let across = [middle - BAY / 4.0, middle + BAY / 4.0];
        let opening = Opening { middle, half: 0.7, sill: 7.15, springing: 7.95, rise: 0.6, chords: 6 };
        m.made_of(WALL).recess(&wall, across, [GALLERY, CLERESTORY], &opening, (0.7, WALL));
        for i in [-1.0, 1.0] {
            baluster(m.made_of(COLUMN), dvec3(middle + 0.25 * i, 7.13, NAVE + 0.15), 0.68);
        }
        m.block_at(&wall, [middle - 0.75, 7.78, 0.06], [middle + 0.75, 7.9, 0.24]);
    }

    let window = Opening { middle: x, half: 0.7, sill: 9.8, springing: 11.6, rise: 0.7, chords: 8 };
    m.made_of(WALL).recess(&wall, across, [CLERESTORY, NAVE_TOP], &window, (0.45, GLASS));
    m.made_of(COLUMN).block_at(&wall, [x - 0.06, 9.7, 0.3], [x + 0.06, 12.4, 0.5]);

    let wall = |p: DVec3| dvec3(p.x, p.y, AISLE + p.z);
    let window = Opening { middle: x, half: 0.6, sill: 1.9, springing: 3.7, rise: 0.6, chords: 8 };
    m.made_of(WALL).recess(&wall, across, [AISLE_FLOOR - INTO, AISLE_TOP], &window, (0.45, GLASS));
    m.made_of(COLUMN).block_at(&wall, [x - 0.05, 1.8, 0.3], [x + 0.05, 4.35, 0.5]);
    let foot = dvec3(x, ARCADE, OUTER.midpoint(AISLE));
    groin_vault(m.made_of(VAULT), foot, aisle_half(1.0), AISLE_RISE, AISLE_CELLS);
}

/// Adds a groin vault: two barrel vaults that cross, with a rib along each diagonal. `foot` is the middle of the
/// rectangle that it covers, and `half` is half of the rectangle's diagonal.
fn groin_vault(m: &mut Masonry, foot: DVec3, half: DVec3, rise: f64, cells: usize) {
    m.patch(cells, cells, |i, j| {
        let ((u, high), (v, over)) = (circle(i, 2 * cells), circle(j, 2 * cells));
        foot + dvec3(-u * half.x, rise * high.max(over), -v * half.z)
    });
    for half in [half, half * dvec3(1.0, 1.0, -1.0)] {
        let across = 0.1 * half.cross(DVec3::Y).normalize();
        m.rib(&arc(foot, half, rise, cells), across, foot, [INTO, 0.12]);
    }
    // The boss where the two ribs cross.
    m.lathe(foot + rise * DVec3::Y, 8, [0, 8], &[[0.0, -0.22], [0.22, -0.18], [0.22, 0.02]]);
}

/// Adds a baluster with its foot at `foot`.
fn baluster(m: &mut Masonry, foot: DVec3, height: f64) {
    const PROFILE: [[f64; 2]; 5] = [[0.1, 0.0], [0.05, 0.14], [0.11, 0.4], [0.045, 0.8], [0.09, 1.0]];
    m.lathe(foot, 6, [0, 6], &PROFILE.map(|[radius, y]| [radius, y * height]));
}

/// Adds the mouldings below the gallery and below the clerestory.
fn string_courses(m: &mut Masonry) {
    let x = [WEST - INTO, EAST + INTO];
    // Each point is the height above the course, and how far it projects from the wall.
    let profile = [[-0.2, -INTO], [-0.15, 0.08], [0.0, 0.1], [0.05, 0.24], [0.18, 0.24], [0.22, -INTO]];
    for y in [GALLERY, CLERESTORY] {
        m.made_of(COLUMN).moulding(x, &profile.map(|[above, out]| [y + above, NAVE - out]));
    }
}

/// Adds the nave's vaults, and the ribs between its bays.
fn vault(m: &mut Masonry) {
    let half = dvec3(BAY / 2.0, 0.0, NAVE + INTO);
    m.made_of(VAULT);
    for k in 0..BAYS {
        groin_vault(m, dvec3(WEST + BAY * (k as f64 + 0.5), VAULT_FOOT, 0.0), half, VAULT_RISE, VAULT_CELLS);
    }
    for k in 0..=BAYS {
        let foot = dvec3(WEST + BAY * k as f64, VAULT_FOOT, 0.0);
        m.rib(&arc(foot, half.with_x(0.0), VAULT_RISE, VAULT_CELLS), 0.25 * DVec3::X, foot, [INTO, 0.2]);
    }
}

/// Adds the walls at both ends of an aisle, with a window in the west and an altar in a niche in the east.
fn aisle_ends(m: &mut Masonry) {
    let (across, high) = ([OUTER - INTO, AISLE + INTO], [AISLE_FLOOR - INTO, AISLE_TOP]);
    let opening = Opening { middle: 6.2, half: 0.7, sill: 2.0, springing: 3.8, rise: 0.7, chords: 8 };
    let west = |p: DVec3| dvec3(WEST + INTO - p.z, p.y, p.x);
    m.made_of(WALL).recess(&west, across, high, &opening, (0.5, GLASS));
    let niche = Opening { half: 0.9, sill: 1.0, springing: 3.2, rise: 0.9, ..opening };
    let east = |p: DVec3| dvec3(EAST - INTO + p.z, p.y, p.x);
    m.recess(&east, across, high, &niche, (0.6, WALL));
    // The piers that the arcade's last arches stand on, behind their columns.
    for x in [WEST, EAST] {
        m.plinth([x - 0.15, -INTO, NAVE - INTO], [x + 0.15, ARCADE + 0.01, OUTER + INTO]);
    }
    m.made_of(MARBLE).plinth([EAST - 0.9, AISLE_FLOOR - INTO, 5.2], [EAST, 1.1, 7.2]);
    m.block([EAST - 1.0, 1.05, 5.1], [EAST - 0.02, 1.2, 7.3]);
}

/// Adds the screen before the choir, and the one that closes the aisle's last bay.
fn screens(m: &mut Masonry) {
    screen(m, EAST + 0.3, SILL_FLOOR, [1.3, 3.05], 7);
    screen(m, EAST - BAY, AISLE_FLOOR, [4.7, 7.75], 10);
}

/// Adds a balustrade from z[0] to z[1]: a base, balusters, a rail, and a post at z[0].
fn screen(m: &mut Masonry, x: f64, floor: f64, z: [f64; 2], balusters: usize) {
    m.made_of(MARBLE).plinth([x - 0.14, floor - INTO, z[0]], [x + 0.14, floor + 0.12, z[1]]);
    m.block([x - 0.13, floor + 0.85, z[0]], [x + 0.13, floor + 0.98, z[1]]);
    m.plinth([x - 0.17, floor - INTO, z[0] - 0.2], [x + 0.17, floor + 1.1, z[0] + 0.14]);
    for i in 0..balusters {
        let along = (i as f64 + 1.0) / (balusters as f64 + 0.5);
        baluster(m, dvec3(x, floor + 0.1, z[0] + along * (z[1] - z[0])), 0.77);
    }
}

/// Adds eight rows of pews.
fn pews(m: &mut Masonry) {
    m.made_of(WOOD);
    for k in 0..8 {
        let x = -9.5 + 1.15 * k as f64;
        m.block([x, 0.3, 1.15], [x + 0.06, 0.92, 3.05]);
        m.block([x + 0.03, 0.4, 1.15], [x + 0.45, 0.46, 3.05]);
        for z in [1.1, 3.0] {
            m.plinth([x - 0.04, -INTO, z], [x + 0.5, 0.98, z + 0.08]);
        }
    }
}

/// Adds one side of the choir: a wall with two windows and a cornice, and stalls.
fn choir_side(m: &mut Masonry) {
    let wall = |p: DVec3| dvec3(p.x, p.y, NAVE + p.z);
    let (start, width) = (EAST + 0.75, (CHOIR_END - EAST - 0.75) / 2.0);
    for k in 0..2 {
        let west = start + width * f64::from(k);
        let window = Opening { middle: west + width / 2.0, half: 0.6, sill: 3.8, springing: 5.6, rise: 0.6, chords: 8 };
        let across = [west, west + width + INTO * f64::from(k)];
        m.made_of(WALL).recess(&wall, across, [CHOIR_FLOOR - INTO, 8.2], &window, (0.45, GLASS));
        m.made_of(COLUMN).block_at(&wall, [window.middle - 0.05, 3.7, 0.3], [window.middle + 0.05, 6.25, 0.5]);
    }
    let z = NAVE;
    m.moulding(
        [start, CHOIR_END + INTO],
        &[[7.0, z + INTO], [7.05, z - 0.1], [7.2, z - 0.12], [7.25, z - 0.25], [7.4, z - 0.25], [7.45, z + INTO]],
    );
    let (x, seat) = ([start + 0.8, CHOIR_END - 0.9], CHOIR_FLOOR - INTO);
    m.made_of(WOOD).plinth([x[0], seat, NAVE - 0.15], [x[1], CHOIR_FLOOR + 1.5, NAVE + INTO]);
    m.plinth([x[0] + 0.02, seat, NAVE - 0.6], [x[1] - 0.02, CHOIR_FLOOR + 0.45, NAVE - 0.1]);
    for k in 0..=5 {
        let x = x[0] - 0.04 + (x[1] - x[0]) * f64::from(k) / 5.0;
        m.plinth([x, seat, NAVE - 0.65], [x + 0.08, CHOIR_FLOOR + 0.95, NAVE - 0.08]);
    }
}

/// Adds the west wall, the chancel arch, the choir's vault, and the arch before the apse.
fn ends(m: &mut Masonry) {
    let west = |p: DVec3| dvec3(WEST + INTO - p.z, p.y, p.x);
    let across = [-NAVE - INTO, NAVE + INTO];
    let door = Opening { middle: 0.0, half: 1.3, sill: 0.1, springing: 3.0, rise: 1.3, chords: 8 };
    m.made_of(WALL).recess(&west, across, [-INTO, CLERESTORY], &door, (0.6, WOOD));
    let window = Opening { middle: 0.0, half: 1.2, sill: 9.5, springing: 11.5, rise: 1.2, chords: 8 };
    m.recess(&west, across, [CLERESTORY, NAVE_TOP], &window, (0.5, GLASS));

    let chancel = |p: DVec3| dvec3(EAST - INTO + p.z, p.y, p.x);
    let arch = Opening { middle: 0.0, half: 3.0, sill: 0.0, springing: 7.2, rise: 3.0, chords: 16 };
    m.archway(&chancel, across, [-INTO, NAVE_TOP], 0.85, &arch);
    archivolt(m, EAST + 0.37, &arch);

    let half = dvec3(0.0, 0.0, NAVE + INTO);
    let foot = |x: f64| dvec3(x, 7.4, 0.0);
    let [start, end] = [EAST + 0.75, CHOIR_END + INTO].map(|x| arc(foot(x), half, half.z, 16));
    m.made_of(VAULT).patch(1, 16, |i, j| [&start, &end][i][j]);
    for x in [9.8, 11.9] {
        m.rib(&arc(foot(x), half, half.z, 16), 0.2 * DVec3::X, foot(x), [INTO, 0.15]);
    }

    let east = |p: DVec3| dvec3(CHOIR_END + p.z, p.y, p.x);
    let arch = Opening { middle: 0.0, half: 3.1, sill: CHOIR_FLOOR, springing: 6.5, rise: 3.1, chords: 16 };
    m.made_of(WALL).archway(&east, across, [CHOIR_FLOOR - INTO, 11.3], 0.3, &arch);
    archivolt(m, CHOIR_END + 0.05, &arch);
}

/// Adds the moulding around an arch that spans the church from north to south.
fn archivolt(m: &mut Masonry, x: f64, arch: &Opening) {
    let path: Vec<_> = arch.arch().into_iter().map(|p| dvec3(x, p.y, p.x)).collect();
    m.made_of(COLUMN).archivolt(&path, 0.47 * DVec3::X, dvec3(x, arch.springing, 0.0), [0.25, 0.1]);
}

/// Adds the apse: a round wall with five windows and mouldings, and a quarter of a sphere above it.
fn apse(m: &mut Masonry) {
    let centre = dvec3(CHOIR_END + 0.25, 0.0, 0.0);
    let round = |p: DVec3| {
        let (angle, radius) = (p.x / APSE, APSE + p.z);
        centre + dvec3(radius * libm::cos(angle), p.y, radius * libm::sin(angle))
    };
    let width = std::f64::consts::PI * APSE / 5.0;
    for k in 0..5 {
        let middle = width * (f64::from(k) - 2.0);
        let window = Opening { middle, half: 0.5, sill: 3.2, springing: 4.8, rise: 0.5, chords: 8 };
        let across = [middle - width / 2.0, middle + width / 2.0];
        m.made_of(WALL).recess(&round, across, [CHOIR_FLOOR - INTO, 6.55], &window, (0.4, GLASS));
    }
    let conch: Vec<_> = (0..=8).map(|i| circle(i, 32)).map(|(c, s)| [APSE * c, 6.5 + APSE * s]).collect();
    m.made_of(VAULT).lathe(centre, 40, [30, 50], &conch);
    let cornice = [[3.25, 6.15], [3.1, 6.2], [3.08, 6.35], [2.95, 6.4], [2.95, 6.55], [3.25, 6.6]];
    m.made_of(COLUMN).lathe(centre, 40, [30, 50], &cornice);
    let dado = [[3.25, 2.85], [3.1, 2.9], [3.1, 3.0], [3.25, 3.05]];
    m.lathe(centre, 40, [30, 50], &dado);
}

/// Adds the altar on its two steps, with four candles and a cross.
fn altar(m: &mut Masonry) {
    let floor = CHOIR_FLOOR - INTO;
    m.made_of(FLOOR).plinth([13.0, floor, -2.0], [16.4, 1.5, 2.0]);
    m.plinth([13.35, floor, -1.7], [16.2, 1.65, 1.7]);
    m.made_of(MARBLE).plinth([14.3, 1.6, -1.1], [15.2, 2.6, 1.1]);
    m.block([14.2, 2.55, -1.25], [15.3, 2.7, 1.25]);
    m.made_of(WOOD).mirrored(|m| {
        for z in [0.6, 1.0] {
            let candle = [[0.1, 2.65], [0.1, 2.72], [0.03, 2.78], [0.03, 3.1], [0.07, 3.12], [0.02, 3.16], [0.0, 3.5]];
            m.lathe(dvec3(15.0, 0.0, z), 6, [0, 6], &candle);
        }
    });
    m.plinth([14.97, 2.65, -0.05], [15.07, 3.8, 0.05]);
    m.block([14.96, 3.35, -0.3], [15.08, 3.45, 0.3]);
}
