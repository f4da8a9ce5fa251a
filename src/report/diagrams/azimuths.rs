//! The hemisphere about a normal in three dimensions, with azimuth and elevation in the eye's frame.

use super::canvas::Canvas;
use super::section::{Section, degrees};
use super::specimen::Place;
use glam::{DVec2, DVec3, dvec2};
use hbao::reference::anatomy::Anatomy;
use std::f64::consts::TAU;

/// The angle in radians by which the onlooker looks down onto the XY plane.
const DOWN: f64 = 0.42;
/// The angle in radians from the drawing's right at which the direction is seen, towards the onlooker.
const ASIDE: f64 = 0.6;

/// Returns where a vector of eye space is drawn. The way to the eye, -z, points up. The onlooker has turned about it by
/// an angle.
fn drawn(v: DVec3, turn: f64) -> DVec2 {
    let (sin, cos) = turn.sin_cos();
    let (right, away) = (v.x * cos + v.y * sin, v.y * cos - v.x * sin);
    dvec2(right, -v.z * DOWN.cos() + away * DOWN.sin())
}

/// Draws the hemisphere of a place: the eye's axes, the tangent plane, the normal, and the direction to the horizon
/// with its angles. The axis and the elevation have the names that the paper gives them.
pub(super) fn hemisphere(
    anatomy: &Anatomy,
    place: Place,
    section: &Section,
    [axis, elevation]: [&str; 2],
) -> Option<String> {
    let turns = || (0..=72).map(|i| TAU * f64::from(i) / 72.0);
    let flat = |angle: f64| DVec2::from_angle(angle).extend(0.0);
    let n = section.start.normal;
    // The tangents in all directions, and the outline of the sphere's half above them.
    let tangents =
        turns().map(|angle| Some(anatomy.tangent(place.pixel, DVec2::from_angle(angle))?.normalize_or_zero()));
    let tangents = tangents.collect::<Option<Vec<DVec3>>>()?;
    let tangent = anatomy.tangent(place.pixel, section.slice.stride)?.normalize_or_zero();
    let theta = tangent.truncate().to_angle();
    let drawn = |v: DVec3| drawn(v, theta + ASIDE);
    let ring: Vec<DVec2> = tangents.iter().map(|&t| drawn(t)).collect();
    let raised = |angle: f64| DVec2::from_angle(theta).extend(0.0) * angle.cos() - DVec3::Z * angle.sin();
    let (h, t) = (section.slice.sin_h().asin(), section.slice.sin_t.asin());
    let omega = raised(h);

    let floor =
        turns().map(|angle| drawn(flat(angle))).chain(ring.iter().copied()).fold(0.0, |low: f64, p| low.min(p.y));
    let mut canvas = Canvas::new(560.0, 420.0, dvec2(-1.4, floor - 0.25), dvec2(1.5, 1.35));
    canvas.area("dg-solid", &turns().map(|angle| drawn(flat(angle))).collect::<Vec<_>>());
    canvas.path("dg-thin", &turns().map(|angle| drawn(flat(angle))).collect::<Vec<_>>());
    canvas.area("dg-tint", &ring);
    canvas.path("dg-blue", &ring);
    // Two half circles over the normal make the dome.
    for along in [tangent, n.cross(tangent)] {
        let half = (0..=36).map(|i| DVec2::from_angle(TAU * f64::from(i) / 72.0)).map(|c| drawn(c.x * along + c.y * n));
        canvas.path("dg-thin dg-dash", &half.collect::<Vec<_>>());
    }
    for (way, name) in [(DVec3::X, "X"), (DVec3::Y, "Y")] {
        canvas.arrow("dg-ink", DVec2::ZERO, drawn(1.2 * way));
        canvas.label(drawn(1.2 * way), 0.0, name);
    }
    let up = drawn(-1.25 * DVec3::Z);
    canvas.arrow("dg-ink", DVec2::ZERO, up);
    canvas.label(up, 0.0, if axis == "Z" { "-Z, to the eye".into() } else { format!("{axis}, to the eye") });
    canvas.arrow("dg-green", DVec2::ZERO, drawn(1.1 * n));
    canvas.label(drawn(1.1 * n), 90.0, "n");

    let arc = |from: f64, to: f64, at: &dyn Fn(f64) -> DVec3| -> Vec<DVec2> {
        (0..=24).map(|i| drawn(at(from + (to - from) * f64::from(i) / 24.0))).collect()
    };
    canvas.line("dg-thin dg-dash", DVec2::ZERO, drawn(flat(theta)));
    let azimuth = arc(0.0, theta, &|angle| 0.45 * flat(angle));
    canvas.path("dg-ink", &azimuth);
    canvas.arrow("dg-blue", DVec2::ZERO, drawn(tangent));
    canvas.arrow("dg-red", DVec2::ZERO, drawn(omega));
    let risen = arc(0.0, h, &|angle| 0.8 * raised(angle));
    canvas.path("dg-red", &risen);
    let tilted = arc(0.0, t, &|angle| 0.62 * raised(angle));
    canvas.path("dg-blue", &tilted);
    canvas.dot("dg-mark", DVec2::ZERO, 4.0);
    canvas.label(DVec2::ZERO, -120.0, "P");
    canvas.label(drawn(omega), 45.0, "ω");
    canvas.label(drawn(tangent), -20.0, "T");
    canvas.label(risen[12], 0.0, format!("{elevation} = h(θ) = {}", degrees(section.slice.sin_h())));
    canvas.label(azimuth[12], -60.0, format!("θ = {:.1}°", theta.to_degrees()));
    canvas.label(tilted[12], -20.0, format!("t(θ) = {}", degrees(section.slice.sin_t)));
    Some(canvas.finish())
}
