//! A section through the depth image along one direction of a pixel, as a drawing.
//!
//! A point is drawn at its distance from P across, |D.xy|, and at its height towards the eye, -D.z, both divided by R.
//! So elevations above P and distances from P are true.

use super::canvas::Canvas;
use super::specimen::{self, Place, RADIUS};
use glam::{DVec2, DVec3, dvec2};
use hbao::reference::anatomy::{Anatomy, Slice, Start};

/// A direction of a pixel, and what is around it.
pub(super) struct Section {
    pub(super) start: Start,
    pub(super) slice: Slice,
    /// The horizontal direction of the section in eye space: that of the tangent.
    heading: DVec2,
    /// The points of the depth image along the direction.
    pub(super) profile: Profile,
}

/// The points of the depth image along a line, relative to P in eye space: one list for each part of the line without
/// background.
pub(super) type Profile = Vec<Vec<DVec3>>;

/// Cuts the whole depth image along a direction through a pixel.
pub(super) fn profile(anatomy: &Anatomy, pixel: (usize, usize), towards: DVec2) -> Option<Profile> {
    let reach = specimen::SIZE.0.max(specimen::SIZE.1) as i32;
    let points = anatomy.profile(pixel, towards, -reach..=reach)?;
    let parts = points.split(Option::is_none).filter(|part| part.len() > 1);
    Some(parts.map(|part| part.iter().flatten().copied().collect()).collect())
}

impl Section {
    /// Takes the section of a place. `None` if the pixel shows background.
    pub(super) fn new(anatomy: &Anatomy, Place { pixel, k }: Place) -> Option<Section> {
        let (start, slice) = (anatomy.start(pixel)?, anatomy.slice(pixel, k)?);
        let heading = anatomy.tangent(pixel, slice.stride)?.truncate().normalize_or_zero();
        let profile = profile(anatomy, pixel, slice.direction)?;
        Some(Section { start, slice, heading, profile })
    }

    /// Returns where D = S - P is drawn.
    #[allow(non_snake_case)]
    pub(super) fn at(&self, D: DVec3) -> DVec2 {
        let across = D.truncate();
        dvec2(across.length() * if across.dot(self.heading) < 0.0 { -1.0 } else { 1.0 }, -D.z) / RADIUS
    }

    /// Draws the surface, and what lies behind it.
    pub(super) fn surface(&self, canvas: &mut Canvas) {
        ground(canvas, &self.profile, self.start.P, &|d| self.at(d));
    }

    /// Draws the point P and the sphere of radius R about it.
    pub(super) fn sphere(&self, canvas: &mut Canvas) {
        canvas.circle("dg-thin dg-dash", DVec2::ZERO, 1.0);
        canvas.dot("dg-mark", DVec2::ZERO, 4.5);
        canvas.label(DVec2::ZERO, -90.0, "P");
        canvas.label(DVec2::from_angle(2.4), 140.0, format!("R = {RADIUS:.0}"));
    }

    /// Returns the unit vector at an elevation, given by its sine, in the section's direction.
    pub(super) fn elevated(sine: f64) -> DVec2 {
        DVec2::from_angle(sine.asin())
    }
}

/// Draws the surface of the depth image through these points, and fills what lies behind it as seen from the eye. `at`
/// says where a point relative to P is drawn.
#[allow(non_snake_case)]
pub(super) fn ground(canvas: &mut Canvas, profile: &Profile, P: DVec3, at: &dyn Fn(DVec3) -> DVec2) {
    for part in profile {
        let surface = part.iter().map(|&D| at(D));
        // Each line of sight goes on behind the surface to beyond the frame.
        let behind = part.iter().rev().map(|&D| at(D + 100.0 * RADIUS * (P + D).normalize_or_zero()));
        canvas.area("dg-solid", &surface.chain(behind).collect::<Vec<_>>());
    }
    for part in profile {
        canvas.path("dg-surface", &part.iter().map(|&D| at(D)).collect::<Vec<_>>());
    }
}

/// Writes an angle, given by its sine, in degrees.
pub(super) fn degrees(sine: f64) -> String {
    format!("{:.1}°", sine.asin().to_degrees())
}

/// Writes a number as an index below the line.
pub(super) fn index(number: u32) -> String {
    let digit = |c: char| char::from_u32(0x2080 + c.to_digit(10).unwrap_or_default()).unwrap_or(c);
    number.to_string().chars().map(digit).collect()
}
