//! Moves the camera, and writes it as the flags of the command line.

use glam::{DQuat, DVec3};
use hbao::Error;
use hbao::scene::{Lens, Mesh, View};
use std::f64::consts::{FRAC_PI_4, PI};

/// The smallest angle between the direction of view and the direction up that turning leaves, in radians.
const LEAST_TILT: f64 = 0.02;

/// The field of view of a perspective view that follows an orthographic one.
const USUAL_LENS: Lens = Lens::FovY(FRAC_PI_4);

/// Where the eye is and what it looks at. Every number is one that the command line can hold, so that the command that
/// is copied has the same camera to the bit.
#[derive(Clone)]
pub(super) struct Eye {
    view: View,
    eye: DVec3,
    target: DVec3,
    up: DVec3,
    lens: Lens,
    /// The perspective lens to which the orthographic view goes back.
    perspective: Lens,
}

impl Eye {
    /// Completes the view for a scene.
    pub(super) fn new(view: &View, mesh: &Mesh, size: (u32, u32)) -> Result<Eye, Error> {
        let lens = settled(view.lens.unwrap_or(USUAL_LENS));
        let view = View { lens: Some(lens), ..view.clone() };
        let (camera, _) = view.camera(mesh, size.0, size.1)?;
        let (low, high) = mesh.bounds();
        let target = view.pivot(&camera, mesh).or(view.target).unwrap_or(low.midpoint(high));
        let perspective = if matches!(lens, Lens::FovY(_) | Lens::Frustum(_)) { lens } else { USUAL_LENS };
        let mut all = Eye { eye: camera.eye, target, up: view.up.unwrap_or(DVec3::Y), lens, perspective, view };
        if all.view.eye.is_none() {
            all.settle();
        }
        Ok(all)
    }

    /// The view, in which only near and far may be open.
    pub(super) fn view(&self) -> View {
        View {
            eye: Some(self.eye),
            target: Some(self.target),
            up: Some(self.up),
            lens: Some(self.lens),
            near: self.view.near,
            far: self.view.far,
            direction_only: false,
        }
    }

    /// The camera's flags for the command line.
    pub(super) fn flags(&self) -> Vec<(&'static str, String)> {
        let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let mut flags = vec![("--eye", list(&self.eye.to_array())), ("--target", list(&self.target.to_array()))];
        flags.push(("--up", list(&self.up.to_array())));
        flags.push(match self.lens {
            Lens::FovY(angle) => ("--fov-y", degrees(angle).to_string()),
            Lens::Height(height) => ("--ortho", height.to_string()),
            Lens::Frustum(edges) => ("--frustum", list(&edges)),
            Lens::OrthoFrustum(edges) => ("--ortho-frustum", list(&edges)),
            // The library may learn others, which this program does not make.
            _ => ("--fov-y", degrees(FRAC_PI_4).to_string()),
        });
        flags.extend(self.view.near.map(|near| ("--near", near.to_string())));
        flags.extend(self.view.far.map(|far| ("--far", far.to_string())));
        flags
    }

    /// Whether the view is a perspective one.
    pub(super) fn is_perspective(&self) -> bool {
        matches!(self.lens, Lens::FovY(_) | Lens::Frustum(_))
    }

    /// Moves the eye about its target, by angles to the right and up, so that the scene follows the pointer.
    pub(super) fn orbit(&mut self, right: f64, up: f64) {
        let offset = self.eye - self.target;
        self.eye = self.target + self.turned(offset, right, up);
        self.settle();
    }

    /// Turns the direction of view, by angles to the right and up.
    pub(super) fn look(&mut self, right: f64, up: f64) {
        let offset = self.eye - self.target;
        self.target = self.eye - self.turned(offset, -right, -up);
        self.settle();
    }

    /// Moves the eye and its target in the plane of the picture, by shares of the picture's height.
    pub(super) fn pan(&mut self, right: f64, up: f64) {
        let (axis, up_axis) = self.axes();
        let by = (axis * -right + up_axis * -up) * self.height();
        (self.eye, self.target) = (self.eye + by, self.target + by);
        self.settle();
    }

    /// Moves the eye towards its target, or shows less of an orthographic view: both lengths are multiplied.
    pub(super) fn zoom(&mut self, factor: f64) {
        match &mut self.lens {
            Lens::Height(height) => *height = (*height * factor).clamp(1e-12, 1e12),
            Lens::OrthoFrustum(edges) => edges.iter_mut().for_each(|edge| *edge = (*edge * factor).clamp(-1e12, 1e12)),
            _ => self.eye = self.target + (self.eye - self.target) * factor,
        }
        self.settle();
    }

    /// Moves the eye and its target to the right, up and forward, by shares of their distance.
    pub(super) fn fly(&mut self, [right, up, forward]: [f64; 3]) {
        let (axis, up_axis) = self.axes();
        let ahead = self.target - self.eye;
        let by = (axis * right + up_axis * up) * ahead.length() + ahead * forward;
        (self.eye, self.target) = (self.eye + by, self.target + by);
        self.settle();
    }

    /// Moves the eye, or chooses the height of an orthographic view, so that the whole scene is in the picture. The
    /// direction of view becomes the usual one.
    pub(super) fn frame(&mut self, mesh: &Mesh, size: (u32, u32)) -> Result<(), Error> {
        let lens = if self.is_perspective() { self.lens } else { Lens::Height(mesh.diagonal().clamp(1e-12, 1e12)) };
        let view = View { up: Some(self.up), lens: Some(lens), ..View::default() };
        *self = Eye { perspective: self.perspective, ..Eye::new(&view, mesh, size)? };
        Ok(())
    }

    /// Changes between a perspective and an orthographic view, which show the same at the target's distance.
    pub(super) fn change_projection(&mut self) {
        self.lens =
            if self.is_perspective() { Lens::Height(self.height().clamp(1e-12, 1e12)) } else { self.perspective };
        self.settle();
    }

    /// The height of the picture at the target's distance, in scene units.
    fn height(&self) -> f64 {
        let distance = (self.target - self.eye).length();
        match self.lens {
            Lens::FovY(angle) => 2.0 * distance * (angle / 2.0).tan(),
            Lens::Height(height) => height,
            Lens::Frustum([.., bottom, top]) => distance * (top - bottom),
            Lens::OrthoFrustum([.., bottom, top]) => top - bottom,
            _ => distance,
        }
    }

    /// The picture's axes to the right and up.
    fn axes(&self) -> (DVec3, DVec3) {
        let forward = (self.target - self.eye).normalize_or(DVec3::Z);
        let right = forward.cross(self.up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        (right, right.cross(forward))
    }

    /// Turns the way from the target to the eye. It does not come nearer to the direction up than [`LEAST_TILT`].
    fn turned(&self, offset: DVec3, right: f64, up: f64) -> DVec3 {
        let axis = self.up.normalize_or(DVec3::Y);
        let tilt = offset.angle_between(axis);
        let tilted = (tilt + up).clamp(LEAST_TILT, PI - LEAST_TILT);
        let (across, _) = self.axes();
        let turn = DQuat::from_axis_angle(axis, -right) * DQuat::from_axis_angle(across, tilted - tilt);
        turn * offset
    }

    /// Rounds the eye, its target and the size of the view to some six digits of their distance, so that the command is
    /// short.
    fn settle(&mut self) {
        let distance = (self.eye - self.target).length().max(1e-12);
        let places = (6.0 - distance.log10().ceil()).clamp(0.0, 18.0) as usize;
        let round = |x: f64| format!("{x:.places$}").parse().unwrap_or(x);
        let rounded = [self.eye, self.target].map(|point| DVec3::from_array(point.to_array().map(round)));
        if rounded[0] != rounded[1] {
            [self.eye, self.target] = rounded;
        }
        if let Lens::Height(height) = &mut self.lens {
            *height = format!("{height:.5e}").parse().unwrap_or(*height);
        }
    }
}

/// Degrees that the command line reads as this angle, if there are any near to it.
fn degrees(angle: f64) -> f64 {
    let exact = angle.to_degrees();
    let near = [(exact * 1e10).round() / 1e10, exact, exact.next_up(), exact.next_down()];
    near.into_iter().find(|degrees| degrees.to_radians() == angle).unwrap_or(near[0])
}

/// The lens with an angle that degrees can express.
fn settled(lens: Lens) -> Lens {
    if let Lens::FovY(angle) = lens { Lens::FovY(degrees(angle).to_radians()) } else { lens }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hbao::scene::{Camera, NAVE, Scene};

    fn eye() -> (Eye, Scene) {
        let scene = Scene::open(NAVE).unwrap();
        (Eye::new(&scene.view, &scene.mesh, (64, 48)).unwrap(), scene)
    }

    fn camera(eye: &Eye, scene: &Scene) -> Camera {
        eye.view().camera(&scene.mesh, 64, 48).unwrap().0
    }

    #[test]
    fn a_turn_keeps_the_distance_and_never_passes_the_zenith() {
        let (mut eye, scene) = eye();
        let distance = eye.eye.distance(eye.target);
        eye.orbit(0.3, -9.0);
        assert!((eye.eye.distance(eye.target) - distance).abs() < 1e-4);
        assert!(camera(&eye, &scene).up.y > 0.0);
        let place = eye.eye;
        eye.look(0.5, 0.1);
        assert_eq!(eye.eye, place);
    }

    #[test]
    fn the_scene_follows_the_pointer() {
        let (start, scene) = eye();
        let before = camera(&start, &scene);
        // A point before the target, and the target itself.
        let (near, target) = (before.eye + before.forward * 5.0, start.target);
        let at = |camera: &Camera, point| camera.project(camera.to_eye(point));
        let mut turned = start.clone();
        turned.orbit(0.1, 0.05);
        let moved = at(&camera(&turned, &scene), near) - at(&before, near);
        assert!(moved.x > 0.01 && moved.y > 0.005, "{moved}");
        let mut looked = start.clone();
        looked.look(0.1, 0.05);
        let moved = at(&camera(&looked, &scene), near) - at(&before, near);
        assert!(moved.x > 0.01 && moved.y > 0.005, "{moved}");
        let mut panned = start.clone();
        panned.pan(0.25, 0.125);
        let moved = at(&camera(&panned, &scene), target) - at(&before, target);
        assert!((moved.x - 0.25 * 48.0 / 64.0).abs() < 1e-4 && (moved.y - 0.125).abs() < 1e-4, "{moved}");
    }

    #[test]
    fn the_flags_hold_the_camera_to_the_bit() {
        let (mut eye, _) = eye();
        for step in 0..40 {
            match step % 5 {
                0 => eye.orbit(0.123, 0.045),
                1 => eye.zoom(0.93),
                2 => eye.pan(0.11, -0.07),
                3 => eye.fly([0.01, 0.02, 0.03]),
                _ => eye.change_projection(),
            }
            let numbers = |text: &str| text.split(',').map(|number| number.parse().unwrap()).collect::<Vec<f64>>();
            for (flag, text) in eye.flags() {
                let expected = match flag {
                    "--eye" => eye.eye.to_array().to_vec(),
                    "--target" => eye.target.to_array().to_vec(),
                    "--up" => eye.up.to_array().to_vec(),
                    _ => match eye.lens {
                        Lens::FovY(angle) => {
                            assert_eq!(numbers(&text)[0].to_radians(), angle);
                            continue;
                        }
                        Lens::Height(height) => vec![height],
                        lens => panic!("{lens:?}"),
                    },
                };
                assert_eq!(numbers(&text), expected, "{flag}");
            }
        }
    }

    #[test]
    fn the_whole_scene_is_framed_in_both_projections() {
        let (mut eye, scene) = eye();
        for _ in 0..2 {
            eye.frame(&scene.mesh, (64, 48)).unwrap();
            let camera = camera(&eye, &scene);
            for &position in &scene.mesh.positions {
                let at = camera.project(camera.to_eye(position));
                assert!(at.min_element() >= 0.0 && at.max_element() <= 1.0, "{at}");
            }
            eye.change_projection();
        }
    }
}
