//! Small scenes that only the report needs. They are the scenes that the papers draw as diagrams, made of triangles.

use super::subject::Subject;
use glam::{DVec3, dvec3};
use hbao::scene::{Lens, Mesh, View};
use hbao::settings::Method;
use hbao::{Error, Projection, Settings};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::rc::Rc;

/// The angle bias of the figures on creases, in degrees. It is larger than the angle between two facets of the vault.
pub(super) const BIAS_DEGREES: f64 = 30.0;
/// The number of flat strips of the vault in the figures on creases. The strips meet at 18 degrees.
pub(super) const FACETS: u32 = 10;

/// Makes a mesh of quadrilaterals, each of two triangles.
fn quads(quads: impl IntoIterator<Item = [DVec3; 4]>) -> Result<Mesh, Error> {
    let positions: Vec<DVec3> = quads.into_iter().flatten().collect();
    let triangles = (0..positions.len() as u32).step_by(4).flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]);
    let triangles = triangles.collect();
    Mesh::new(positions, triangles)
}

fn subject(key: &'static str, name: &str, mesh: Mesh, eye: DVec3, target: DVec3, radius: f64) -> Subject {
    let view =
        View { eye: Some(eye), target: Some(target), lens: Some(Lens::FovY(40f64.to_radians())), ..View::default() };
    Subject { name: name.into(), key, mesh: Rc::new(mesh), view, radius, arguments: None }
}

/// Returns the lens whose horizontal field of view is 90 degrees. With this field of view the offsets of `ssao` fill a
/// ball in a square picture, because their x is in units of the picture's width and their z in units of 2 P.z.
///
/// A camera's field of view is limited, so a picture that is far higher than wide gets less than 90 degrees
/// horizontally.
fn right_angle(size: (u32, u32)) -> Lens {
    let fov_y = 2.0 * (f64::from(size.1) / f64::from(size.0)).atan();
    Lens::FovY(fov_y.clamp(1.5f64.to_radians(), 174f64.to_radians()))
}

/// Makes two half planes that meet in a vertical line in the middle of the picture. Each is turned away from the eye by
/// `away` radians: 0 gives a wall, PI/4 the outer edge of a box, -PI/4 the inner corner of a room. The horizontal field
/// of view is 90 degrees.
pub(super) fn fold(key: &'static str, name: &str, away: f64, size: (u32, u32)) -> Result<Subject, Error> {
    let (high, wide) = (400.0, 400.0);
    let side = |sign: f64| {
        let end = dvec3(sign * wide * away.cos(), 0.0, -wide * away.sin());
        let up = dvec3(0.0, high, 0.0);
        [-up, end - up, end + up, up]
    };
    let mesh = quads([side(-1.0), side(1.0)])?;
    let mut fold = subject(key, name, mesh, dvec3(0.0, 0.0, 30.0), DVec3::ZERO, 3.0);
    fold.view.lens = Some(right_angle(size));
    Ok(fold)
}

/// Makes the flat wall, the corner of a room and the edge of a box, each with the share of the space around its middle
/// that is solid, as the paper draws it.
pub(super) fn folds(size: (u32, u32)) -> Result<[(Subject, f64); 3], Error> {
    Ok([
        (fold("wall", "wall", 0.0, size)?, 0.5),
        (fold("corner", "corner", -FRAC_PI_4, size)?, 0.75),
        (fold("edge", "edge", FRAC_PI_4, size)?, 0.25),
    ])
}

/// Makes a floor that is seen at a slant and fills the picture.
pub(super) fn floor() -> Result<Subject, Error> {
    let far = 500.0;
    let mesh = quads([[dvec3(-far, 0.0, -far), dvec3(far, 0.0, -far), dvec3(far, 0.0, far), dvec3(-far, 0.0, far)]])?;
    Ok(subject("floor", "floor", mesh, dvec3(0.0, 6.0, 8.0), DVec3::ZERO, 1.0))
}

/// Half the width of the floor inside the rim of [`pit`].
const PIT: f64 = 1.0;

/// Returns whether a point in world space is on the floor inside the rim of [`pit`].
pub(super) fn on_floor_of_pit(p: DVec3) -> bool {
    p.y.abs() < 0.01 && p.x.abs().max(p.z.abs()) < PIT
}

/// Makes a floor with a square rim that stands upright on it, seen from straight above: Figure 6.2.4 in three
/// dimensions. Seen from the floor inside, the rim hides low points beyond it, although these points lie above the
/// height field. If `solid` is true, the rim is a block that reaches to the horizon, and no point beyond it is free.
///
/// The horizontal field of view is 90 degrees. The radius is the length of the longest offset of `ssao`; it is larger
/// than the pit.
pub(super) fn pit(size: (u32, u32), solid: bool) -> Result<Subject, Error> {
    let (half, high, far, eye) = (PIT, 1.6, 60.0, 14.0);
    let thick = if solid { far - half } else { 0.25 };
    let floor = [dvec3(-far, 0.0, -far), dvec3(far, 0.0, -far), dvec3(far, 0.0, far), dvec3(-far, 0.0, far)];
    let mut all = vec![floor];
    for turn in 0..4 {
        let turned = |p: DVec3| glam::DQuat::from_rotation_y(f64::from(turn) * PI / 2.0) * p;
        let [near, away, wide] = [half, half + thick, half + thick];
        let up = |p: DVec3| p + high * DVec3::Y;
        let [a, b] = [dvec3(near, 0.0, -wide), dvec3(near, 0.0, wide)];
        let [c, d] = [dvec3(away, 0.0, wide), dvec3(away, 0.0, -wide)];
        for quad in [[a, b, up(b), up(a)], [c, d, up(d), up(c)], [up(a), up(b), up(c), up(d)]] {
            all.push(quad.map(turned));
        }
    }
    // The depth sigma of `ssao` is a quarter of its reach.
    let view = Projection::perspective(FRAC_PI_2, 1.0);
    let reach = 4.0 * Settings::for_method(Method::Ssao).depth_sigma(view)?.at(eye);
    let (key, name) = if solid { ("hole", "hole in a block") } else { ("pit", "pit behind a thin rim") };
    let mut pit = subject(key, name, quads(all)?, dvec3(0.0, eye, 0.0), DVec3::ZERO, reach);
    pit.view.lens = Some(right_angle(size));
    pit.view.up = Some(DVec3::NEG_Z);
    Ok(pit)
}

/// The boards of [`wall_behind`]: the share of the wall's distance at which they stand, in numbers and in words.
pub(super) const BOARDS: [(f64, &str); 3] = [
    (0.25, "at 1/4 of the wall's distance"),
    (0.5, "at 1/2 of the wall's distance"),
    (0.75, "at 3/4 of the wall's distance"),
];

/// Makes a wall that faces the eye and fills the picture, and, if `board` is given, a square board in front of it, at
/// this share of the wall's distance. All boards cover the same part of the picture. The horizontal field of view is 90
/// degrees.
pub(super) fn wall_behind(board: Option<f64>, size: (u32, u32)) -> Result<Subject, Error> {
    let (far, wide) = (30.0, 400.0);
    let square = |half: f64, z: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| dvec3(half * x, half * y, z))
    };
    let wall = square(wide, 0.0);
    let board = board.map(|nearness| square(0.3 * far * nearness, far * (1.0 - nearness)));
    let mut subject =
        subject("board", "board", quads([wall].into_iter().chain(board))?, dvec3(0.0, 0.0, far), DVec3::ZERO, 3.0);
    subject.view.lens = Some(right_angle(size));
    Ok(subject)
}

/// R at the ledge of [`ledge`].
pub(super) const LEDGE_RADIUS: f64 = 3.0;

/// Makes a floor whose right half is higher by R/2, seen from straight above without perspective. The ledge is in the
/// middle of the picture.
pub(super) fn ledge() -> Result<Subject, Error> {
    let (far, high) = (100.0, LEDGE_RADIUS / 2.0);
    let level = |left: f64, right: f64, y: f64| {
        [dvec3(left, y, -far), dvec3(right, y, -far), dvec3(right, y, far), dvec3(left, y, far)]
    };
    let mesh = quads([level(-far, 0.0, 0.0), level(0.0, far, high)])?;
    let mut ledge = subject("ledge", "ledge", mesh, dvec3(0.0, 20.0, 0.0), DVec3::ZERO, LEDGE_RADIUS);
    ledge.view.up = Some(DVec3::NEG_Z);
    ledge.view.lens = Some(Lens::Height(4.0 * LEDGE_RADIUS));
    Ok(ledge)
}

/// Makes the inside of a half pipe whose half circle has `facets` flat strips, seen from straight below or along its
/// length. It is a round vault of low tessellation: neighbouring facets meet at an angle of PI / facets.
pub(super) fn vault(facets: u32, along: bool) -> Result<Subject, Error> {
    let (radius, long) = (4.0, 30.0);
    let at = |i: u32, z: f64| {
        let angle = PI * f64::from(i) / f64::from(facets);
        dvec3(radius * angle.cos(), radius * angle.sin(), z)
    };
    let mesh = quads((0..facets).map(|i| [at(i, 4.0), at(i + 1, 4.0), at(i + 1, -long), at(i, -long)]))?;
    let ([eye, target], name) = if along {
        ([dvec3(0.0, 0.8, 3.0), dvec3(0.0, 2.2, -8.0)], "seen along its length")
    } else {
        ([dvec3(0.0, 0.4, -13.0), dvec3(0.0, 4.0, -13.0)], "seen from below")
    };
    let mut vault = subject("vault", &format!("vault of {facets} facets, {name}"), mesh, eye, target, 1.5);
    vault.view.up = Some(if along { DVec3::Y } else { DVec3::Z });
    vault.view.lens = Some(Lens::FovY(if along { 40f64 } else { 80f64 }.to_radians()));
    Ok(vault)
}

/// Makes a valley of two equally steep planes that meet at a right angle, seen from far above.
pub(super) fn valley() -> Result<Subject, Error> {
    let (wide, long) = (40.0, 200.0);
    let side = |sign: f64| {
        [dvec3(0.0, 0.0, -long), dvec3(0.0, 0.0, long), dvec3(sign * wide, wide, long), dvec3(sign * wide, wide, -long)]
    };
    let mut valley =
        subject("valley", "valley", quads([side(-1.0), side(1.0)])?, dvec3(0.0, 60.0, 0.0), DVec3::ZERO, 4.0);
    valley.view.up = Some(DVec3::NEG_Z);
    Ok(valley)
}

/// Makes a ball with `facets` facets around its axis and half as many from pole to pole. It is convex, so nothing
/// occludes any facet.
pub(super) fn ball(facets: u32) -> Result<Subject, Error> {
    let rings = facets / 2;
    let at = |i: u32, j: u32| {
        let (turn, down) = (TAU * f64::from(i % facets) / f64::from(facets), PI * f64::from(j) / f64::from(rings));
        dvec3(down.sin() * turn.cos(), down.cos(), down.sin() * turn.sin())
    };
    let index = |i: u32, j: u32| match j {
        0 => 0,
        j if j == rings => 1,
        j => 2 + (j - 1) * facets + i % facets,
    };
    let mut positions = vec![DVec3::Y, DVec3::NEG_Y];
    positions.extend((1..rings).flat_map(|j| (0..facets).map(move |i| (i, j))).map(|(i, j)| at(i, j)));
    let mut triangles = Vec::new();
    for j in 0..rings {
        for i in 0..facets {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles
                .extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]));
        }
    }
    let mesh = Mesh::new(positions, triangles)?;
    Ok(subject("ball", &format!("ball of {facets} facets"), mesh, dvec3(0.6, 0.9, 3.2), DVec3::ZERO, 0.5))
}
