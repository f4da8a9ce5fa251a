//! Makes a camera from the values that the user gives. All other values follow from the scene.

use super::mesh::FARTHEST;
use super::{Camera, Extents, Mesh, Projection};
use crate::Error;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_4;

/// The words in a notice of [`View::camera`] that say that the picture will be empty.
pub const NOTHING_IN_VIEW: &str = "nothing is in view";

/// The smallest length that a camera's settings may have, in scene units. Its square still fits float32.
const SMALLEST: f64 = 1e-15;
/// When a scene is framed, its bounding box leaves this share of the picture's half size free on each side.
const MARGIN: f64 = 0.05;
/// The smallest near depth that is chosen, as a share of the scene's farthest depth. Everything that lies further from
/// the camera than that is never clipped.
const NEAR_OF_FAR: f64 = 1e-4;
/// The share of the depth of the nearest and the farthest vertex by which the planes are moved away from them, so that
/// rounding clips neither.
const STAND_OFF: f64 = 1e-3;

/// The largest magnitude of the extents of a perspective picture at z = 1, and its smallest width and height. A field
/// of view of 1 to 175 degrees with the driver's largest sizes lies within them.
const WIDEST_FRUSTUM: f64 = 1e6;
const NARROWEST_FRUSTUM: f64 = 1e-6;
/// The largest distance of the view's axis from the middle of a perspective picture, in halves of the picture's size:
/// that of [`Projection::check`].
const FARTHEST_ASIDE: f64 = 1000.0;

/// The known values of a camera. [`View::camera`] derives the values that are `None` from the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// The eye's position in world space.
    pub eye: Option<DVec3>,
    /// The point in world space that the view's axis goes through. In a centred picture it is in the middle.
    pub target: Option<DVec3>,
    /// The direction in world space that points up in the picture. The default is (0, 1, 0).
    pub up: Option<DVec3>,
    /// The field of view, the height or the extents. The default is a field of view of 45 degrees.
    pub lens: Option<Lens>,
    /// The smallest visible z, in scene units, 1e-15 to 1e15.
    pub near: Option<f64>,
    /// The largest visible z, in scene units, 1e-15 to 1e15.
    pub far: Option<f64>,
    /// Whether the target tells only where the eye looks, and `up` only how the picture is turned: those of a matrix or
    /// of a glTF camera. Then the target's distance means nothing, and `up` need not be the scene's.
    pub direction_only: bool,
}

/// How much the picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lens {
    /// Perspective: the vertical field of view in radians, 1 to 175 degrees.
    FovY(f64),
    /// Orthographic: the picture's height in scene units, 1e-15 to 1e15.
    Height(f64),
    /// Perspective: the left, right, bottom and top edge of the picture at z = 1. They are at most 1e6 in magnitude,
    /// the picture is at least 1e-6 wide and high, and the view's axis lies at most 1000 halves of the width or height
    /// from the middle. The shape of pixels follows from the extents and the picture's size.
    Frustum([f64; 4]),
    /// Orthographic: the left, right, bottom and top edge of the picture in scene units, at most 1e15 in magnitude. The
    /// picture is at least 1e-15 wide and high.
    OrthoFrustum([f64; 4]),
}

impl View {
    /// Returns this view, completed from `scene`, the scene's own view. For example, if only the eye is given, it looks
    /// at the scene's own target. `scene`'s near and far are not used if this view has an eye or a target, because they
    /// suit only the scene's own position of the camera.
    #[must_use]
    pub fn or(&self, scene: &View) -> View {
        let moved = self.eye.is_some() || self.target.is_some();
        let unless_moved = |z: Option<f64>| if moved { None } else { z };
        View {
            eye: self.eye.or(scene.eye),
            target: self.target.or(scene.target),
            up: self.up.or(scene.up),
            lens: self.lens.or(scene.lens),
            near: self.near.or(unless_moved(scene.near)),
            far: self.far.or(unless_moved(scene.far)),
            direction_only: if self.target.is_some() { self.direction_only } else { scene.direction_only },
        }
    }

    /// Returns the point about which this view turns around the scene, if `camera` is its camera: the target, or the
    /// scene's centre without one. If the target tells only a direction, it is the point of the view's axis that is
    /// nearest to the centre of the scene's bounding box, so that a turn begins with this view. `None` if that point
    /// does not lie before the eye.
    #[must_use]
    pub fn pivot(&self, camera: &Camera, mesh: &Mesh) -> Option<DVec3> {
        let (low, high) = mesh.bounds();
        let centre = low.midpoint(high);
        if !self.direction_only {
            return Some(self.target.unwrap_or(centre));
        }
        let distance = (centre - camera.eye).dot(camera.forward);
        (distance >= SMALLEST).then(|| camera.eye + distance * camera.forward)
    }

    /// Returns the camera for a picture of `width` by `height` pixels, and notices for the user, each of one line.
    ///
    /// - Without an eye, the whole bounding box of `mesh` is framed. It is seen from the front (from +z if y is up),
    ///   and somewhat from the right and from above. In an orthographic view the height decides how much of it is in
    ///   the picture. If the extents are not centred, the eye stands aside, so that the picture still shows the box.
    /// - Without a target, the eye looks at the centre of the bounding box.
    /// - Without a near or far plane, the planes are chosen so that they enclose the scene, except that near is at
    ///   least 1e-4 of the farthest z.
    ///
    /// # Errors
    /// [`Error::Usage`] for what [`View::check`] refuses, for a picture without pixels, for an eye at the centre of the
    /// scene without a target, and for a near plane that leaves no room for a far plane below 1e15.
    pub fn camera(&self, mesh: &Mesh, width: u32, height: u32) -> Result<(Camera, Vec<String>), Error> {
        self.check()?;
        if width == 0 || height == 0 {
            return usage(format!("--size {width}x{height} has no pixels; give at least 1x1"));
        }
        let mut notices = Vec::new();
        let aspect = f64::from(width) / f64::from(height);
        let projection = self.lens.unwrap_or(Lens::FovY(FRAC_PI_4)).projection(aspect);

        let up = self.up.map_or(DVec3::Y, unit);
        let bounds = mesh.bounds();
        let target = self.target.unwrap_or(bounds.0.midpoint(bounds.1));
        let forward = match self.eye {
            Some(eye) if eye == target => {
                return usage(
                    "--eye is the scene's centre, where it would look; give --target, or another --eye".into(),
                );
            }
            Some(eye) => unit(target - eye),
            None => framing_direction(up),
        };
        let (right, picture_up) = upright(forward, up, &mut notices);
        let axes = Camera { eye: target, right, up: picture_up, forward, projection, near: 0.0, far: 0.0 };
        if self.eye.is_none() && is_a_point(&axes, bounds) {
            notices.push(
                format!(
                    "the scene is too small to be framed at its distance from the origin: {NOTHING_IN_VIEW}; scale it up, or \
                     give --eye"
                ),
            );
        }
        let eye = self.eye.unwrap_or_else(|| target - axes.direction_to_world(framing_offset(&axes, bounds)));

        let camera = Camera { eye, ..axes };
        let (near, far) = self.planes(&camera, mesh, &mut notices)?;
        Ok((Camera { near, far, ..camera }, notices))
    }

    /// Refuses a view that is wrong whatever the scene is.
    ///
    /// # Errors
    /// [`Error::Usage`] for numbers out of range, for an eye that is also the target, for an `up` of zero, and for a
    /// near plane that is not nearer than the far plane. The message names the command's flag, such as `--eye`.
    pub fn check(&self) -> Result<(), Error> {
        for (flag, point) in [("--eye", self.eye), ("--target", self.target), ("--up", self.up)] {
            if let Some(p) = point
                && !p.abs().cmple(DVec3::splat(FARTHEST)).all()
            {
                return usage(format!(
                    "{flag} {} must be finite, at most 1e15 in magnitude",
                    p.to_array().map(number).join(",")
                ));
            }
        }
        if self.eye.is_some() && self.eye == self.target {
            return usage("--eye is the same point as --target, so it looks nowhere; move one of them".into());
        }
        if self.up == Some(DVec3::ZERO) {
            return usage("--up 0,0,0 is not a direction; try --up 0,1,0".into());
        }
        match self.lens {
            // The limits are converted as the command converts its flag, so that 1 and 175 themselves are allowed.
            Some(Lens::FovY(fov)) if !(1_f64.to_radians()..=175_f64.to_radians()).contains(&fov) => {
                return usage(format!("--fov-y {} must be from 1 to 175 degrees", number(rounded(fov.to_degrees()))));
            }
            Some(Lens::Height(h)) if !(SMALLEST..=FARTHEST).contains(&h) => {
                return usage(format!("--ortho {} must be from 1e-15 to 1e15 scene units", number(h)));
            }
            Some(Lens::Frustum(edges)) => check_extents("--frustum", edges, WIDEST_FRUSTUM, NARROWEST_FRUSTUM, true)?,
            Some(Lens::OrthoFrustum(edges)) => check_extents("--ortho-frustum", edges, FARTHEST, SMALLEST, false)?,
            _ => {}
        }
        for (flag, z) in [("--near", self.near), ("--far", self.far)] {
            if let Some(z) = z
                && !(SMALLEST..=FARTHEST).contains(&z)
            {
                return usage(format!("{flag} {} must be from 1e-15 to 1e15 scene units", number(z)));
            }
        }
        match (self.near, self.far) {
            (Some(near), Some(far)) if near >= far => {
                usage(format!("--near {} must be less than --far {}", number(near), number(far)))
            }
            _ => Ok(()),
        }
    }

    /// Returns the near and the far plane: those that the view gives, or otherwise those that enclose the scene.
    fn planes(&self, camera: &Camera, mesh: &Mesh, notices: &mut Vec<String>) -> Result<(f64, f64), Error> {
        let depths = mesh.positions.iter().map(|&p| camera.to_eye(p).z);
        let (nearest, farthest) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        if farthest < SMALLEST {
            notices.push(format!("the whole scene lies behind the camera: {NOTHING_IN_VIEW}"));
        }
        let scene_far = if farthest < SMALLEST { 1.0 } else { farthest };
        let far = self.far.unwrap_or((scene_far * (1.0 + STAND_OFF)).min(FARTHEST));
        // The smallest near that is chosen: a share of the scene's farthest z or of a given far, whichever is less.
        let least_near = NEAR_OF_FAR * scene_far.min(far);
        let near = self.near.unwrap_or((nearest * (1.0 - STAND_OFF)).max(least_near));
        if near < far {
            if far < farthest && self.far.is_none() {
                notices.push("the scene reaches beyond 1e15 from the camera: the part beyond is clipped".into());
            }
            return Ok((near, far));
        }
        // `check` has ruled out that both planes are given in the wrong order. So either one of them follows from the
        // scene and does not fit the other, or both follow from the scene, which then lies beyond 1e15.
        match self.near {
            Some(near) if near * 2.0 <= FARTHEST => {
                notices.push(format!("--near {} lies beyond the whole scene: {NOTHING_IN_VIEW}", number(near)));
                Ok((near, near * 2.0))
            }
            Some(near) => {
                usage(format!("--near {} is too close to 1e15, the largest --far; give a smaller one", number(near)))
            }
            None => {
                let beyond = match self.far {
                    Some(far) => format!("--far {}", number(far)),
                    None => "1e15 from the camera, the largest depth that is drawn".into(),
                };
                notices.push(format!("the whole scene lies beyond {beyond}: {NOTHING_IN_VIEW}"));
                Ok((far * NEAR_OF_FAR, far))
            }
        }
    }
}

impl Lens {
    /// Returns the projection of a picture whose width is `aspect` times its height. [`View::check`] refuses numbers
    /// out of range.
    #[must_use]
    pub fn projection(self, aspect: f64) -> Projection {
        match self {
            Lens::FovY(fov) => Projection::perspective(fov, aspect),
            Lens::Height(height) => Projection::orthographic(height, aspect),
            Lens::Frustum([left, right, bottom, top]) => {
                Projection::Perspective(Extents::new(left, right, bottom, top))
            }
            Lens::OrthoFrustum([left, right, bottom, top]) => {
                Projection::Orthographic(Extents::new(left, right, bottom, top))
            }
        }
    }
}

/// Refuses the extents of a picture, given by this flag, if they exceed `most` in magnitude, or if the picture is less
/// than `least` wide or high. In perspective the view's axis must not lie too far from the picture's middle.
fn check_extents(flag: &str, edges: [f64; 4], most: f64, least: f64, perspective: bool) -> Result<(), Error> {
    let given = format!("{flag} {}", edges.map(number).join(","));
    if !edges.iter().all(|edge| edge.abs() <= most) {
        return usage(format!("{given} must be finite, at most {most:e} in magnitude"));
    }
    let [left, right, bottom, top] = edges;
    for (low, high, names) in [
        (left, right, "left edge, the first number, must be less than the right, the second"),
        (bottom, top, "bottom edge, the third number, must be less than the top, the fourth"),
    ] {
        if high - low < least {
            return usage(format!("{given}: the {names}, by at least {least:e}"));
        }
        if perspective && (low + high).abs() / (high - low) > FARTHEST_ASIDE {
            return usage(format!(
                "{given}: the view's axis, 0,0, is more than {FARTHEST_ASIDE} times as far from the picture's middle as the \
                 picture's edges are; turn the camera towards the picture"
            ));
        }
    }
    Ok(())
}

/// Writes a number as most people type it: 10 in place of 10.0, and 1e300 in place of its 301 digits.
fn number(x: f64) -> String {
    let text = format!("{x:?}");
    text.strip_suffix(".0").unwrap_or(&text).into()
}

/// Rounds degrees that were converted from radians to what the user typed.
fn rounded(degrees: f64) -> f64 {
    let short = (degrees * 1e10).round() / 1e10;
    if short.is_finite() && short != 0.0 { short } else { degrees }
}

fn usage<T>(what: String) -> Result<T, Error> {
    Err(Error::Usage(what))
}

/// Returns the unit vector along `v`, which must not be zero. `v` is scaled first, so that its length neither overflows
/// nor underflows.
fn unit(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}

/// Returns the picture's right and up vectors. If `up` is parallel to the direction of view, the axis that is most
/// nearly perpendicular to it takes the place of `up`.
fn upright(forward: DVec3, up: DVec3, notices: &mut Vec<String>) -> (DVec3, DVec3) {
    // Smaller angles between `up` and the direction of view count as parallel, in radians. This is far above rounding
    // errors, and smaller than any angle that is meant.
    const PARALLEL: f64 = 1e-6;
    let mut right = forward.cross(up);
    if right.length() < PARALLEL {
        // -z comes first, and wins a tie, so that a scene seen from above has x to the right.
        let across = |a: &DVec3, b: &DVec3| forward.dot(*a).abs().total_cmp(&forward.dot(*b).abs());
        let other = [DVec3::NEG_Z, DVec3::X, DVec3::Y].into_iter().min_by(across).unwrap_or(DVec3::NEG_Z);
        right = forward.cross(other);
        notices.push(format!(
            "--up is parallel to the direction of view; {},{},{} is up instead",
            other.x, other.y, other.z
        ));
    }
    let right = right.normalize();
    (right, right.cross(forward))
}

/// Returns the direction of view that shows a model from its front, somewhat from the right and from above. The front
/// faces +z if y is up, and -y if z is up, as is usual in models.
fn framing_direction(up: DVec3) -> DVec3 {
    let front = if up.z.abs() > 0.9 { DVec3::NEG_Y * up.z.signum() } else { DVec3::Z };
    let right = up.cross(front).normalize();
    let front = right.cross(up);
    -(right * 0.5 + up * 0.4 + front).normalize()
}

/// Returns the corners of a bounding box, in the camera's eye space.
fn corners(axes: &Camera, (low, high): (DVec3, DVec3)) -> impl Iterator<Item = DVec3> + Clone {
    (0..8).map(move |i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        axes.to_eye(DVec3::new(pick(0), pick(1), pick(2)))
    })
}

/// Returns true if the bounding box is so small that float64 hardly tells it from a point, at its distance from the
/// origin.
fn is_a_point(axes: &Camera, bounds: (DVec3, DVec3)) -> bool {
    let size = corners(axes, bounds).map(DVec3::length).fold(0.0, f64::max);
    size <= (1e-9 * axes.eye.length()).max(SMALLEST)
}

/// Returns the way from the eye to the target in eye space for which the picture shows the whole bounding box, with the
/// target in its middle. The eye of `axes` is the target. A box that is a point also gets a distance above 0.
fn framing_offset(axes: &Camera, bounds: (DVec3, DVec3)) -> DVec3 {
    let corners = corners(axes, bounds);
    let size = corners.clone().map(DVec3::length).fold(0.0, f64::max);
    let size = if is_a_point(axes, bounds) { axes.eye.length().max(1.0) * 1e-3 } else { size };
    let clearance = 0.1 * size;
    let half = DVec2::from(axes.projection.half_extents());
    let distance = corners
        .map(|corner| {
            if axes.projection.is_perspective() {
                // The eye stands aside so that the target is in the middle. A corner behind the target is then that
                // much aside of the middle, too.
                let aside = corner.truncate() - DVec2::from(axes.projection.middle_at(corner.z));
                let across = (aside / half).abs().max_element();
                (across / (1.0 - MARGIN)).max(clearance) - corner.z
            } else {
                clearance - corner.z
            }
        })
        .fold(clearance, f64::max);
    DVec2::from(axes.projection.middle_at(distance)).extend(distance)
}
