//! Cameras that a glTF file moves.

use super::path::{BESIDE_ROUNDED, frames_between};
use super::{Lens, View};
use glam::{DAffine3, DQuat, DVec3, DVec4};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The motion of a camera in a glTF file: the animation of the camera's node, and of the nodes that this hangs on.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraMotion {
    /// The nodes from the root down to the camera's.
    pub(super) nodes: Vec<MovingNode>,
    pub(super) lens: Lens,
    pub(super) near: Option<f64>,
    pub(super) far: Option<f64>,
    /// The times in seconds between which something moves.
    pub(super) times: [f64; 2],
}

/// The transform of a node to its parent, and how its parts move.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MovingNode {
    /// The transform at rest, if nothing moves it.
    pub(super) rest: DAffine3,
    /// Translation, rotation and scale at rest. None if the node has a matrix, whose parts cannot move.
    pub(super) parts: Option<(DVec3, DQuat, DVec3)>,
    pub(super) translation: Option<Arc<Track>>,
    pub(super) rotation: Option<Arc<Track>>,
    pub(super) scale: Option<Arc<Track>>,
}

/// Values at rising times, and what lies between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    /// Seconds; at least one.
    pub(super) times: Vec<f64>,
    /// One value for each time. With cubic splines three: the tangent that comes in, the value, and the tangent that
    /// goes out. Vectors have a fourth component of 0.
    pub(super) values: Vec<DVec4>,
    pub(super) between: Between,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Between {
    Step,
    Linear,
    CubicSpline,
}

impl CameraMotion {
    /// Returns the numbers of the frames, of which frame i stands at the time i / fps, or `None` if none lies within
    /// the animation. `fps` must be above 0.
    #[must_use]
    pub fn frames(&self, fps: f64) -> Option<RangeInclusive<u32>> {
        frames_between(self.times, fps, BESIDE_ROUNDED)
    }

    /// Returns the view at a time in seconds. Before the animation it is that of its start, and after it that of its
    /// end. `None` if the camera has no direction then.
    #[must_use]
    pub fn view(&self, time: f64) -> Option<View> {
        let to_world = self.nodes.iter().fold(DAffine3::IDENTITY, |parent, node| parent * node.at(time));
        let place = placed(to_world)?;
        Some(View { lens: Some(self.lens), near: self.near, far: self.far, ..place })
    }
}

/// Returns the view of a camera that stands at the origin of these axes and looks along their -z. Their scale does not
/// matter.
pub(super) fn placed(to_world: DAffine3) -> Option<View> {
    let direction = |axis: DVec3| to_world.transform_vector3(axis).try_normalize();
    let eye = to_world.translation;
    // The target is so far away that rounding it turns the view by less than rounding the eye.
    let target = eye + direction(DVec3::NEG_Z)? * eye.abs().max_element().max(1.0);
    Some(View {
        eye: Some(eye),
        target: Some(target),
        up: Some(direction(DVec3::Y)?),
        direction_only: true,
        ..View::default()
    })
}

impl MovingNode {
    fn at(&self, time: f64) -> DAffine3 {
        let Some((translation, rotation, scale)) = self.parts else { return self.rest };
        let vector = |track: &Option<Arc<Track>>, rest| track.as_ref().map_or(rest, |track| track.at(time).truncate());
        let rotation = self.rotation.as_ref().map_or(rotation, |track| track.rotation_at(time));
        let (scale, translation) = (vector(&self.scale, scale), vector(&self.translation, translation));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}

impl Track {
    /// Returns the time of the first value and that of the last.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.times.first(), self.times.last()].map(|time| time.copied().unwrap_or(0.0))
    }

    /// Returns the numbers of the values around a time, and the share of the way from the first to the second.
    fn around(&self, time: f64) -> (usize, usize, f64) {
        let after = self.times.partition_point(|&at| at <= time);
        let (from, to) = (after.saturating_sub(1), after.min(self.times.len() - 1));
        let share = if to > from && after > 0 { (time - self.times[from]) / self.span(from) } else { 0.0 };
        (from, to, share)
    }

    fn span(&self, from: usize) -> f64 {
        self.times[from + 1] - self.times[from]
    }

    fn at(&self, time: f64) -> DVec4 {
        let (from, to, share) = self.around(time);
        match self.between {
            Between::Step => self.values[from],
            Between::Linear => self.values[from].lerp(self.values[to], share),
            Between::CubicSpline => self.cubic(from, to, share),
        }
    }

    fn rotation_at(&self, time: f64) -> DQuat {
        let (from, to, share) = self.around(time);
        let rotation = |value: DVec4| {
            let length = value.length();
            if length > 0.0 { DQuat::from_vec4(value / length) } else { DQuat::IDENTITY }
        };
        match self.between {
            Between::Linear if to > from => rotation(self.values[from]).slerp(rotation(self.values[to]), share),
            _ => rotation(self.at(time)),
        }
    }

    /// Returns the point of the cubic Hermite spline between two values.
    fn cubic(&self, from: usize, to: usize, t: f64) -> DVec4 {
        let value = |at: usize| self.values[3 * at + 1];
        if from == to {
            return value(from);
        }
        let span = self.span(from);
        let (out, into) = (span * self.values[3 * from + 2], span * self.values[3 * to]);
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * value(from)
            + (t3 - 2.0 * t2 + t) * out
            + (3.0 * t2 - 2.0 * t3) * value(to)
            + (t3 - t2) * into
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    fn track(times: &[f64], values: &[[f64; 4]], between: Between) -> Arc<Track> {
        let values = values.iter().map(|&value| DVec4::from_array(value)).collect();
        Arc::new(Track { times: times.into(), values, between })
    }

    #[test]
    fn values_between_keys_are_stepped_linear_or_cubic_and_stand_still_outside() {
        let values = [[0.0, 0.0, 0.0, 0.0], [4.0, 0.0, 8.0, 0.0]];
        let [step, linear] = [Between::Step, Between::Linear].map(|between| track(&[1.0, 3.0], &values, between));
        for (time, stepped, on_line) in
            [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.5, 0.0, 1.0), (3.0, 4.0, 4.0), (9.0, 4.0, 4.0)]
        {
            assert_eq!((step.at(time).x, linear.at(time).x), (stepped, on_line), "{time}");
        }
        // x(t) = t^3 on [1, 3] is its own Hermite spline: the tangents are its slopes.
        let cube = |t: f64| [[3.0 * t * t, 0.0, 0.0, 0.0], [t * t * t, 0.0, 0.0, 0.0], [3.0 * t * t, 0.0, 0.0, 0.0]];
        let cubic = track(&[1.0, 3.0], &[cube(1.0), cube(3.0)].concat(), Between::CubicSpline);
        for time in [1.0, 1.25, 2.0, 2.9, 3.0] {
            assert!((cubic.at(time).x - time * time * time).abs() < 1e-12, "{time}: {}", cubic.at(time).x);
        }
        assert_eq!((cubic.at(0.0).x, cubic.at(5.0).x), (1.0, 27.0));
    }

    #[test]
    fn a_rotation_turns_evenly_by_the_shorter_way() {
        let half = |angle: f64| [0.0, (angle / 2.0).sin(), 0.0, (angle / 2.0).cos()];
        let turned = track(&[0.0, 2.0], &[half(0.0), half(FRAC_PI_2).map(|x| -x)], Between::Linear);
        let eighth = turned.rotation_at(1.0) * DVec3::Z;
        let expected = DVec3::new(FRAC_PI_4.sin(), 0.0, FRAC_PI_4.cos());
        assert!(eighth.distance(expected) < 1e-12, "{eighth}");
    }

    #[test]
    fn a_camera_hangs_on_the_nodes_above_it() {
        let still = |translation: DVec3| MovingNode {
            rest: DAffine3::from_translation(translation),
            parts: Some((translation, DQuat::IDENTITY, DVec3::ONE)),
            translation: None,
            rotation: None,
            scale: None,
        };
        let turned = track(&[0.0, 1.0], &[[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]], Between::Linear);
        let arm = MovingNode { rotation: Some(turned), ..still(DVec3::Y) };
        let nodes = vec![arm, still(DVec3::new(0.0, 0.0, 5.0))];
        let motion = CameraMotion { nodes, lens: Lens::FovY(1.0), near: Some(0.5), far: None, times: [0.0, 1.0] };
        assert_eq!(motion.frames(24.0), Some(0..=24));
        // An end that float32 has rounded down is still that of its frame.
        let rounded = |frame: f64| CameraMotion { times: [0.0, f64::from((frame / 24.0) as f32)], ..motion.clone() };
        for frame in 1..=1000 {
            assert_eq!(rounded(f64::from(frame)).frames(24.0), Some(0..=frame));
        }
        for (time, eye) in [(0.0, [0.0, 1.0, 5.0]), (0.5, [5.0, 1.0, 0.0]), (1.0, [0.0, 1.0, -5.0])] {
            let view = motion.view(time).unwrap();
            assert!(view.eye.unwrap().distance(DVec3::from(eye)) < 1e-12, "{view:?}");
            let forward = (view.target.unwrap() - view.eye.unwrap()).normalize();
            assert!(forward.distance(DVec3::new(-eye[0], 0.0, -eye[2]) / 5.0) < 1e-12, "{view:?}");
            assert_eq!((view.lens, view.near, view.far), (Some(Lens::FovY(1.0)), Some(0.5), None));
        }
    }
}
