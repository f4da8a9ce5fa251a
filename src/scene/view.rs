//! From what the user says about the camera, as much or as little as it is, to a camera.

use super::mesh::FARTHEST;
use super::{Camera, Mesh, Projection};
use crate::Error;
use glam::DVec3;
use std::f64::consts::FRAC_PI_4;

/// The smallest length that a camera's settings may name, scene units: float32 still holds its square.
const SMALLEST: f64 = 1e-15;
/// A framed scene's bounding box leaves this part of the picture's half size free on each side.
const MARGIN: f64 = 0.05;
/// The nearest depth that is never clipped, relative to the scene's farthest.
const NEAR_OF_FAR: f64 = 1e-4;
/// How far the planes stand off from the nearest and farthest vertex, relative, so that rounding clips neither.
const STAND_OFF: f64 = 1e-3;

/// What is known about the camera. What is missing follows from the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Where the eye stands, world space.
    pub eye: Option<DVec3>,
    /// The point in the middle of the picture.
    pub target: Option<DVec3>,
    /// The direction that is up in the picture; (0, 1, 0) when missing.
    pub up: Option<DVec3>,
    /// The field of view or the height; 45 degrees when missing.
    pub lens: Option<Lens>,
    /// The smallest visible z, scene units.
    pub near: Option<f64>,
    /// The largest visible z, scene units.
    pub far: Option<f64>,
}

/// How much the picture shows from bottom to top.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lens {
    /// Perspective: the vertical field of view in radians, 1 to 175 degrees.
    FovY(f64),
    /// Orthographic: the picture's height in scene units, 1e-15 to 1e15.
    Height(f64),
}

impl View {
    /// This view, with what it does not say taken from `scene`'s own: so `--eye` alone looks from there at the
    /// scene's own target. Near and far belong to where the camera stands; where this view moves it, `scene`'s are
    /// left out.
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
        }
    }

    /// The camera for a picture of `width` by `height` pixels, and notices for the user, one line each.
    ///
    /// Without an eye the whole bounding box is framed, seen from the front (+z where y is up), somewhat from the
    /// right and above; orthographic, as much of it as the height allows. Without a target the eye looks at the box's
    /// centre. Without near and far they enclose the scene, except for what is nearer than 1e-4 of its farthest z.
    pub fn camera(&self, mesh: &Mesh, width: u32, height: u32) -> Result<(Camera, Vec<String>), Error> {
        self.check()?;
        if width == 0 || height == 0 {
            return usage(format!("a picture of {width}x{height} pixels has none; give a size of at least 1x1"));
        }
        let mut notices = Vec::new();
        let aspect = f64::from(width) / f64::from(height);
        let projection = self.lens.unwrap_or(Lens::FovY(FRAC_PI_4)).projection(aspect);

        let up = self.up.map_or(DVec3::Y, unit);
        let bounds = mesh.bounds();
        let target = self.target.unwrap_or(bounds.0.midpoint(bounds.1));
        let forward = match self.eye {
            Some(eye) if eye == target => {
                return usage("looking nowhere: --eye is the scene's centre, and no --target is given; move it".into());
            }
            Some(eye) => unit(target - eye),
            None => framing_direction(up),
        };
        let (right, picture_up) = upright(forward, up, &mut notices);
        let axes = Camera { eye: target, right, up: picture_up, forward, projection, near: 0.0, far: 0.0 };
        if self.eye.is_none() && is_a_point(&axes, bounds) {
            notices.push(
                "the scene is no larger than a point there: nothing is in view; scale it up, or give --eye".into(),
            );
        }
        let eye = self.eye.unwrap_or_else(|| target - forward * framing_distance(&axes, bounds));

        let camera = Camera { eye, ..axes };
        let (near, far) = self.planes(&camera, mesh, &mut notices)?;
        Ok((Camera { near, far, ..camera }, notices))
    }

    /// Refuses what no scene can make sense of: numbers out of range, an eye that is its own target.
    pub fn check(&self) -> Result<(), Error> {
        for (flag, point) in [("--eye", self.eye), ("--target", self.target), ("--up", self.up)] {
            if let Some(p) = point
                && !p.abs().cmple(DVec3::splat(FARTHEST)).all()
            {
                return usage(format!("{flag} {},{},{} must be finite, at most 1e15 in magnitude", p.x, p.y, p.z));
            }
        }
        if self.eye.is_some() && self.eye == self.target {
            return usage("looking nowhere: --eye is the same point as --target; move one of them".into());
        }
        if self.up == Some(DVec3::ZERO) {
            return usage("--up 0,0,0 is no direction; try 0,1,0".into());
        }
        match self.lens {
            // The same conversion on both sides, so that 1 and 175 are themselves allowed.
            Some(Lens::FovY(fov)) if !(1_f64.to_radians()..=175_f64.to_radians()).contains(&fov) => {
                return usage(format!("--fov-y {} must be from 1 to 175 degrees", fov.to_degrees()));
            }
            Some(Lens::Height(h)) if !(SMALLEST..=FARTHEST).contains(&h) => {
                return usage(format!("--ortho {h:?} must be from 1e-15 to 1e15 scene units"));
            }
            _ => {}
        }
        for (flag, z) in [("--near", self.near), ("--far", self.far)] {
            if let Some(z) = z
                && !(SMALLEST..=FARTHEST).contains(&z)
            {
                return usage(format!("{flag} {z:?} must be from 1e-15 to 1e15 scene units"));
            }
        }
        match (self.near, self.far) {
            (Some(near), Some(far)) if near >= far => usage(format!("--near {near:?} must be less than --far {far:?}")),
            _ => Ok(()),
        }
    }

    /// Near and far: the user's, or around the scene.
    fn planes(&self, camera: &Camera, mesh: &Mesh, notices: &mut Vec<String>) -> Result<(f64, f64), Error> {
        let depths = mesh.positions.iter().map(|&p| camera.to_eye(p).z);
        let (nearest, farthest) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        if farthest < SMALLEST {
            notices.push("the whole scene lies behind the camera: nothing is in view".into());
        }
        let scene_far = if farthest < SMALLEST { 1.0 } else { farthest };
        let far = self.far.unwrap_or((scene_far * (1.0 + STAND_OFF)).min(FARTHEST));
        // From the scene's farthest z or from a given far, whichever is less.
        let least_near = NEAR_OF_FAR * scene_far.min(far);
        let near = self.near.unwrap_or((nearest * (1.0 - STAND_OFF)).max(least_near));
        if near < far {
            if far < farthest && self.far.is_none() {
                notices.push("the scene reaches beyond 1e15 from the camera: what lies there is clipped".into());
            }
            return Ok((near, far));
        }
        // Only one of the two is given, or neither, and the scene's own other does not fit.
        match self.near {
            Some(near) if near * 2.0 <= FARTHEST => {
                notices.push(format!("--near {near:?} lies beyond the whole scene: nothing is in view"));
                Ok((near, near * 2.0))
            }
            Some(near) => usage(format!("--near {near:?} leaves no room below 1e15, the greatest --far")),
            None => {
                let beyond = match self.far {
                    Some(far) => format!("--far {far:?}"),
                    None => "1e15 from the camera, the farthest that is drawn".into(),
                };
                notices.push(format!("the whole scene lies beyond {beyond}: nothing is in view"));
                Ok((far * NEAR_OF_FAR, far))
            }
        }
    }
}

impl Lens {
    fn projection(self, aspect: f64) -> Projection {
        match self {
            Lens::FovY(fov) => {
                let tan_half_fov_y = (fov / 2.0).tan();
                Projection::Perspective { tan_half_fov_x: tan_half_fov_y * aspect, tan_half_fov_y }
            }
            Lens::Height(height) => {
                Projection::Orthographic { half_width: height / 2.0 * aspect, half_height: height / 2.0 }
            }
        }
    }
}

fn usage<T>(what: String) -> Result<T, Error> {
    Err(Error::Usage(what))
}

/// The unit vector along `v`, which is not zero. Scaled first, so that its length neither over- nor underflows.
fn unit(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}

/// The picture's right and up. Where `up` lies along the view, the axis most across the view serves instead.
fn upright(forward: DVec3, up: DVec3, notices: &mut Vec<String>) -> (DVec3, DVec3) {
    // A microradian: far from rounding, and nobody aims so.
    const PARALLEL: f64 = 1e-6;
    let mut right = forward.cross(up);
    if right.length() < PARALLEL {
        // -z comes first, so that a plan seen from above has x to the right.
        let across = |a: &DVec3, b: &DVec3| forward.dot(*a).abs().total_cmp(&forward.dot(*b).abs());
        let other = [DVec3::NEG_Z, DVec3::X, DVec3::Y].into_iter().min_by(across).unwrap_or(DVec3::NEG_Z);
        right = forward.cross(other);
        notices.push(format!("--up lies along the view; {},{},{} is up instead", other.x, other.y, other.z));
    }
    let right = right.normalize();
    (right, right.cross(forward))
}

/// The direction of view that shows a model from its front, somewhat from the right and above. Its front is towards
/// +z where y is up, and towards -y where z is up, as models have it.
fn framing_direction(up: DVec3) -> DVec3 {
    let front = if up.z.abs() > 0.9 { DVec3::NEG_Y * up.z.signum() } else { DVec3::Z };
    let right = up.cross(front).normalize();
    let front = right.cross(up);
    -(right * 0.5 + up * 0.4 + front).normalize()
}

/// The corners of a box, from the camera's eye.
fn corners(axes: &Camera, (low, high): (DVec3, DVec3)) -> impl Iterator<Item = DVec3> + Clone {
    (0..8).map(move |i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        axes.to_eye(DVec3::new(pick(0), pick(1), pick(2)))
    })
}

/// A scene that is a point, as far as float64 can tell there, is looked at from some distance all the same.
fn is_a_point(axes: &Camera, bounds: (DVec3, DVec3)) -> bool {
    let size = corners(axes, bounds).map(DVec3::length).fold(0.0, f64::max);
    size <= (1e-9 * axes.eye.length()).max(SMALLEST)
}

/// How far before the target the eye of `axes` must stand to have the whole box in the picture.
fn framing_distance(axes: &Camera, bounds: (DVec3, DVec3)) -> f64 {
    let corners = corners(axes, bounds);
    let size = corners.clone().map(DVec3::length).fold(0.0, f64::max);
    let size = if is_a_point(axes, bounds) { axes.eye.length().max(1.0) * 1e-3 } else { size };
    let clearance = 0.1 * size;
    corners
        .map(|corner| match axes.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => {
                let across = (corner.x / tan_half_fov_x).abs().max((corner.y / tan_half_fov_y).abs());
                (across / (1.0 - MARGIN)).max(clearance) - corner.z
            }
            Projection::Orthographic { .. } => clearance - corner.z,
        })
        .fold(clearance, f64::max)
}
