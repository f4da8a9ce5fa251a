//! Camera paths: views that change from frame to frame.

use super::{Lens, View};
use crate::Error;
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// The largest number of a frame.
const MOST_FRAMES: f64 = 1e7;

/// By how much of a frame a key's time may lie beside that of a frame and still be that frame's.
const BESIDE: f64 = 1e-6;

/// The same for times that were rounded to float32, as those of glTF files are.
pub(super) const BESIDE_ROUNDED: f64 = 1e-3;

/// A view at a moment of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// The moment in seconds. The times of a path's keys rise.
    pub time: f64,
    /// The eye's position in world space.
    pub eye: DVec3,
    /// The point in world space that the view's axis goes through.
    pub target: DVec3,
    /// The direction in world space that points up in the picture. Either all keys of a path have one or none.
    pub up: Option<DVec3>,
    /// The vertical field of view in radians. Either all keys of a path have one or none.
    pub fov_y: Option<f64>,
}

/// How eye and target move between two keys. The direction up and the field of view change linearly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Interpolation {
    /// On a straight line.
    Linear,
    /// On a centripetal Catmull-Rom spline through all keys (Yuksel, Schaefer and Keyser 2011), which has no loops and
    /// no cusps between two keys.
    #[default]
    CatmullRom,
}

/// A camera path through keys. Frame i stands at the time i / fps.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keys: Vec<Key>,
    interpolation: Interpolation,
    fps: f64,
}

impl CameraPath {
    /// Makes a path.
    ///
    /// # Errors
    /// [`Error::Usage`] without a key, for numbers that are not finite, for times that are below 0 or do not rise, for
    /// `up` or `fov_y` at some keys only, for a key whose view [`View::check`] refuses, for a number of frames per
    /// second that is not above 0, and for a path that has no frame or ends after frame 10,000,000. The message counts
    /// keys from 0.
    pub fn new(keys: Vec<Key>, interpolation: Interpolation, fps: f64) -> Result<CameraPath, Error> {
        let refuse = |what: String| Err(Error::Usage(what));
        if !(fps.is_finite() && fps > 0.0) {
            return refuse(format!("{fps} frames per second: the number must be above 0"));
        }
        let Some(first) = keys.first() else { return refuse("it has no keys".into()) };
        for (i, key) in keys.iter().enumerate() {
            let numbers = [key.time, key.fov_y.unwrap_or(1.0)];
            let points = [key.eye, key.target, key.up.unwrap_or(DVec3::Y)];
            if !numbers.iter().all(|x| x.is_finite()) || !points.iter().all(|p| p.is_finite()) {
                return refuse(format!("key {i} has numbers that are not finite"));
            }
            if key.time < 0.0 {
                return refuse(format!("key {i} has the time {}, and times start at 0 or later", key.time));
            }
            let seen = view(key.eye, key.target, key.up, key.fov_y).check();
            seen.map_err(|error| of_key(&format!("key {i}"), &error))?;
            for (name, has, others) in
                [("up", key.up.is_some(), first.up.is_some()), ("fov_y", key.fov_y.is_some(), first.fov_y.is_some())]
            {
                if has != others {
                    let [with, without] = if has { [i, 0] } else { [0, i] };
                    return refuse(format!(
                        "key {with} has {name} and key {without} has not: give it to all or to none"
                    ));
                }
            }
        }
        if let Some(i) = keys.windows(2).position(|pair| pair[1].time <= pair[0].time) {
            let [before, time] = [keys[i].time, keys[i + 1].time];
            return refuse(format!(
                "key {} has the time {time}, which is not above {before}, that of the key before",
                i + 1
            ));
        }
        let path = CameraPath { keys, interpolation, fps };
        let [start, end] = ends(path.times(), fps, BESIDE);
        if end > MOST_FRAMES {
            return refuse(format!("it ends at frame {end:.0}, and paths may have frames up to {MOST_FRAMES:.0}"));
        }
        if start > end {
            return refuse(format!("no frame lies between its first and its last key at {fps} frames per second"));
        }
        Ok(path)
    }

    /// Returns the numbers of the frames: those whose times lie from the first key to the last.
    #[must_use]
    pub fn frames(&self) -> RangeInclusive<u32> {
        frames_between(self.times(), self.fps, BESIDE).unwrap_or(0..=0)
    }

    /// Returns the time of the first key and that of the last.
    fn times(&self) -> [f64; 2] {
        [self.keys.first(), self.keys.last()].map(|key| key.map_or(0.0, |key| key.time))
    }

    /// Returns the view of a frame. Before the first key it is that of the first, and after the last that of the last.
    #[must_use]
    pub fn view(&self, frame: u32) -> View {
        let time = f64::from(frame) / self.fps;
        let (from, to) = self.around(frame);
        let (a, b) = (&self.keys[from], &self.keys[to]);
        let share = if to > from { (time - a.time) / (b.time - a.time) } else { 0.0 };
        let mix = |a: f64, b: f64| a + share * (b - a);
        let point = |of: fn(&Key) -> DVec3| match self.interpolation {
            _ if from == to => of(a),
            Interpolation::Linear => of(a).lerp(of(b), share),
            Interpolation::CatmullRom => {
                let neighbour = |at: Option<usize>| at.and_then(|at| self.keys.get(at)).map(of);
                let around = [neighbour(from.checked_sub(1)), neighbour(Some(to + 1))];
                centripetal(around, [of(a), of(b)], share)
            }
        };
        let up = a.up.zip(b.up).map(|(a, b)| a.normalize_or_zero().lerp(b.normalize_or_zero(), share));
        let fov_y = a.fov_y.zip(b.fov_y).map(|(a, b)| mix(a, b));
        view(point(|key| key.eye), point(|key| key.target), up, fov_y)
    }

    /// Refuses frames whose view is wrong although those of the keys are right: between two keys, the eye may pass
    /// through the target, or the direction up through zero.
    ///
    /// # Errors
    /// [`Error::Usage`] for the first of the frames whose view [`View::check`] refuses. The message names the keys
    /// beside it, counted from 0.
    pub fn check(&self, frames: impl IntoIterator<Item = u32>) -> Result<(), Error> {
        frames.into_iter().try_for_each(|frame| {
            let (from, to) = self.around(frame);
            let place = || format!("frame {frame}, between key {from} and key {to}");
            self.view(frame).check().map_err(|error| of_key(&place(), &error))
        })
    }

    /// Returns the numbers of the keys before and after a frame.
    fn around(&self, frame: u32) -> (usize, usize) {
        let time = f64::from(frame) / self.fps;
        let after = self.keys.partition_point(|key| key.time <= time);
        (after.saturating_sub(1), after.min(self.keys.len() - 1))
    }
}

/// Returns the number of the first frame and that of the last between two times, if frame i stands at the time i / fps.
/// A time may lie this much of a frame beside that of a frame, and still be that frame's.
fn ends([start, end]: [f64; 2], fps: f64, beside: f64) -> [f64; 2] {
    [(start * fps - beside).ceil(), (end * fps + beside).floor()]
}

/// Returns the numbers of the frames between two times in seconds, if frame i stands at the time i / fps. `None` if
/// there is no such frame, or one after frame 10,000,000.
pub(super) fn frames_between(times: [f64; 2], fps: f64, beside: f64) -> Option<RangeInclusive<u32>> {
    let [start, end] = ends(times, fps, beside);
    (start >= 0.0 && start <= end && end <= MOST_FRAMES).then_some(start as u32..=end as u32)
}

fn view(eye: DVec3, target: DVec3, up: Option<DVec3>, fov_y: Option<f64>) -> View {
    View { eye: Some(eye), target: Some(target), up, lens: fov_y.map(Lens::FovY), ..View::default() }
}

/// Returns the error of a view with its place in the path. A view's errors name the command's flags, and a key's
/// fields have the same names.
fn of_key(place: &str, error: &Error) -> Error {
    Error::Usage(format!("{place}: {}", error.to_string().replace("--fov-y", "fov_y").replace("--", "")))
}

/// Returns the point at this share of the way from the first of two points to the second, on the centripetal
/// Catmull-Rom spline through them and the points before and after them. At an end of the spline, where there is no
/// such point, the other one is mirrored.
fn centripetal([before, after]: [Option<DVec3>; 2], [a, b]: [DVec3; 2], share: f64) -> DVec3 {
    // Two points that are one leave no room for a curve.
    let apart = |from: DVec3, to: DVec3| from.distance(to).sqrt();
    let between = apart(a, b);
    if between == 0.0 {
        return a;
    }
    let before = before.filter(|&p| p != a).unwrap_or(2.0 * a - b);
    let after = after.filter(|&p| p != b).unwrap_or(2.0 * b - a);
    // The knots, and the pyramid of linear interpolations between them (Barry and Goldman 1988).
    let knots = [-apart(before, a), 0.0, between, between + apart(b, after)];
    let t = share * between;
    let mix = |p: DVec3, q: DVec3, i: usize, j: usize| p.lerp(q, (t - knots[i]) / (knots[j] - knots[i]));
    let [first, second, third] = [mix(before, a, 0, 1), mix(a, b, 1, 2), mix(b, after, 2, 3)];
    mix(mix(first, second, 0, 2), mix(second, third, 1, 3), 1, 2)
}

/// A turn of the camera about an axis through the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turntable {
    /// The eye's position in frame 0.
    pub eye: DVec3,
    /// The point that the camera looks at.
    pub target: DVec3,
    /// The direction of the axis.
    pub axis: DVec3,
    /// The direction that points up in the picture of frame 0. It turns with the eye.
    pub up: DVec3,
    /// The number of frames of a whole turn, at least 1.
    pub frames: u32,
}

impl Turntable {
    /// Returns the view of a frame: the camera has turned by 2 pi `frame` / `frames`, counterclockwise as seen from
    /// above.
    #[must_use]
    pub fn view(&self, frame: u32) -> View {
        let Turntable { eye, target, axis, up, frames } = *self;
        let angle = TAU * f64::from(frame % frames.max(1)) / f64::from(frames.max(1));
        // libm's sine and cosine are the same everywhere.
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let axis = axis.normalize_or_zero();
        // Rodrigues' formula, without the loss of digits for an angle of 0 and for a vector along the axis.
        let turned = |v: DVec3| {
            if frame.is_multiple_of(frames.max(1)) || axis.cross(v) == DVec3::ZERO {
                return v;
            }
            let along = axis.dot(v) * axis;
            along + cosine * (v - along) + sine * axis.cross(v)
        };
        view(target + turned(eye - target), target, Some(turned(up)), None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f64, x: f64, y: f64) -> Key {
        Key { time, eye: DVec3::new(x, y, 0.0), target: DVec3::new(x, y, -1.0), up: None, fov_y: None }
    }

    fn path(keys: &[Key], interpolation: Interpolation, fps: f64) -> CameraPath {
        CameraPath::new(keys.to_vec(), interpolation, fps).unwrap()
    }

    #[test]
    fn frames_stand_at_multiples_of_the_time_of_one() {
        let keys = [key(0.0, 0.0, 0.0), key(1.0, 24.0, 0.0), key(3.0, 48.0, 0.0)];
        let linear = path(&keys, Interpolation::Linear, 24.0);
        assert_eq!(linear.frames(), 0..=72);
        for (frame, x) in [(0, 0.0), (1, 1.0), (24, 24.0), (25, 24.5), (72, 48.0), (99, 48.0)] {
            let eye = linear.view(frame).eye.unwrap();
            assert!((eye.x - x).abs() < 1e-12, "{frame}: {eye}");
        }
        // A path that starts late has no frame before.
        assert_eq!(path(&[key(0.5, 0.0, 0.0), key(1.0, 1.0, 0.0)], Interpolation::Linear, 10.0).frames(), 5..=10);
        assert_eq!(path(&[key(0.0, 0.0, 0.0)], Interpolation::CatmullRom, 24.0).frames(), 0..=0);
        // 1/24 is no binary number: the last frame is none too few.
        assert_eq!(
            path(&[key(0.0, 0.0, 0.0), key(99.0 / 24.0, 1.0, 0.0)], Interpolation::Linear, 24.0).frames(),
            0..=99
        );
    }

    #[test]
    fn the_spline_goes_through_its_keys_smoothly_and_is_straight_where_they_are() {
        let keys = [key(0.0, 0.0, 0.0), key(1.0, 1.0, 2.0), key(2.0, 5.0, 1.0), key(3.0, 6.0, 6.0)];
        let spline = path(&keys, Interpolation::CatmullRom, 1000.0);
        for (frame, key) in [(0, keys[0]), (1000, keys[1]), (2000, keys[2]), (3000, keys[3])] {
            assert!(spline.view(frame).eye.unwrap().distance(key.eye) < 1e-12, "{frame}");
        }
        // The direction of motion does not jump at a key.
        let direction =
            |frame: u32| (spline.view(frame + 1).eye.unwrap() - spline.view(frame).eye.unwrap()).normalize();
        for frame in [1000, 2000] {
            assert!(direction(frame - 1).dot(direction(frame)) > 0.9999, "{frame}");
        }
        let straight =
            path(&[key(0.0, 0.0, 0.0), key(1.0, 1.0, 1.0), key(2.0, 2.0, 2.0)], Interpolation::CatmullRom, 10.0);
        for frame in 0..=20 {
            let eye = straight.view(frame).eye.unwrap();
            assert!(eye.distance(DVec3::new(0.1, 0.1, 0.0) * f64::from(frame)) < 1e-12, "{frame}: {eye}");
        }
    }

    #[test]
    fn the_spline_has_the_middle_that_is_worked_out_by_hand() {
        // Four corners of a unit square: all knots are 1 apart, where the spline is the uniform one, whose middle is
        // (9 (b + c) - (a + d)) / 16.
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let middle = centripetal([Some(a), Some(d)], [b, c], 0.5);
        assert!(middle.distance(DVec3::new(18.0 / 16.0, 0.5, 0.0)) < 1e-15, "{middle}");
        // Points that are one neither divide by 0 nor move.
        assert_eq!(centripetal([Some(a), Some(d)], [b, b], 0.3), b);
        assert!(centripetal([Some(b), Some(c)], [b, c], 0.25).distance(b.lerp(c, 0.25)) < 1e-15);
    }

    #[test]
    fn a_turntable_turns_once_about_the_target() {
        let table = Turntable {
            eye: DVec3::new(3.0, 5.0, 2.0),
            target: DVec3::new(1.0, 1.0, 2.0),
            axis: DVec3::Y * 7.0,
            up: DVec3::new(0.5, 1.0, 0.0),
            frames: 4,
        };
        let eyes: Vec<DVec3> = (0..5).map(|frame| table.view(frame).eye.unwrap()).collect();
        // From x to -z: counterclockwise as seen from +y, where z points down.
        let expected = [[3.0, 5.0, 2.0], [1.0, 5.0, 0.0], [-1.0, 5.0, 2.0], [1.0, 5.0, 4.0], [3.0, 5.0, 2.0]];
        for (eye, expected) in eyes.iter().zip(expected) {
            assert!(eye.distance(DVec3::from(expected)) < 1e-12, "{eyes:?}");
        }
        assert_eq!(eyes[0], eyes[4]);
        // A tilted direction up turns with the eye, and one along the axis stays what it is.
        assert!(table.view(1).up.unwrap().distance(DVec3::new(0.0, 1.0, -0.5)) < 1e-12);
        let upright = Turntable { up: DVec3::Y * 7.0, ..table };
        assert!((0..4).all(|frame| upright.view(frame).up == Some(DVec3::Y * 7.0)));
    }

    #[test]
    fn a_frame_with_a_wrong_view_between_right_keys_is_refused_with_its_keys() {
        let keys = [0.0, 1.0, 2.0].map(|time| Key { eye: DVec3::new(time, 0.0, time - 1.5), ..key(time, 0.0, 0.0) });
        let keys = keys.map(|key| Key { target: DVec3::new(1.5, 0.0, 0.0), ..key });
        let linear = path(&keys, Interpolation::Linear, 2.0);
        let error = linear.check(linear.frames()).unwrap_err().to_string();
        assert!(error.contains("frame 3, between key 1 and key 2: eye is the same point as target"), "{error}");
        assert!(linear.check([0, 1, 2, 4]).is_ok());
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let good = [key(0.0, 0.0, 0.0), key(1.0, 1.0, 0.0)];
        let with = |change: fn(&mut Key)| {
            let mut keys = good.to_vec();
            change(&mut keys[1]);
            keys
        };
        for (keys, fps, said) in [
            (Vec::new(), 24.0, "it has no keys"),
            (good.to_vec(), 0.0, "must be above 0"),
            (good.to_vec(), f64::NAN, "must be above 0"),
            (with(|key| key.time = 0.0), 24.0, "key 1 has the time 0, which is not above 0"),
            (with(|key| key.time = 1e9), 24.0, "it ends at frame 24000000000"),
            (with(|key| key.eye.x = f64::NAN), 24.0, "key 1 has numbers that are not finite"),
            (with(|key| key.up = Some(DVec3::Y)), 24.0, "key 1 has up and key 0 has not"),
            (with(|key| key.fov_y = Some(1.0)), 24.0, "key 1 has fov_y and key 0 has not"),
            (with(|key| key.fov_y = Some(3.1)), 24.0, "key 1: fov_y 177.6"),
            (with(|key| key.target = key.eye), 24.0, "key 1: eye is the same point as target"),
            (with(|key| key.up = Some(DVec3::ZERO)), 24.0, "key 1: up 0,0,0 is not a direction"),
            (vec![key(0.3, 0.0, 0.0), key(0.7, 1.0, 0.0)], 1.0, "no frame lies between"),
            (vec![key(-1.0, 0.0, 0.0)], 1.0, "key 0 has the time -1"),
        ] {
            let error = CameraPath::new(keys, Interpolation::Linear, fps).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
