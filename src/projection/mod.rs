//! The projection of a view from eye space to the picture.

mod matrix;

pub use matrix::ProjectionMatrix;

use crate::Error;

/// How eye space is projected to the picture. The view's axis, x = y = 0, need not go through the picture's middle: it
/// does not in a tile of a larger picture, with a jitter for temporal antialiasing, in one eye of a headset, and behind
/// a shifted lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective: all rays start at the eye. The extents are those of the picture at z = 1, so a centred picture
    /// reaches from -tan(fov/2) to tan(fov/2) in x and y.
    Perspective(Extents),
    /// Orthographic: all rays are parallel. The extents are the same at every depth, in scene units.
    Orthographic(Extents),
}

/// The direction of z in eye space, in which x points right and y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Hand {
    /// Left-handed: z points forward, and a normal that faces the eye has n.z < 0 in the middle of the picture.
    Left,
    /// Right-handed, as in classic OpenGL: z points backward, and such a normal has n.z > 0.
    Right,
}

/// The rectangle that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extents {
    half: [f64; 2],
    middle: [f64; 2],
    /// How many times as wide and as high the whole picture is, if this is a part of one.
    whole: [f64; 2],
}

/// The largest distance of the view's axis from the middle of a perspective picture, in halves of the picture's width
/// or height. The shaders compute where a ray goes in float32, relative to the axis. At this distance neighbouring rays
/// of a picture 2000 pixels wide are still told apart to a sixteenth of a pixel.
const FARTHEST_AXIS: f64 = 1000.0;

impl Extents {
    /// The rectangle from `left` to `right` in x and from `bottom` to `top` in y. `left` must be less than `right`, and
    /// `bottom` less than `top`: a rectangle without extent is refused where it is used.
    #[must_use]
    pub const fn new(left: f64, right: f64, bottom: f64, top: f64) -> Extents {
        let half = [(right - left) / 2.0, (top - bottom) / 2.0];
        Extents { half, middle: [(left + right) / 2.0, (bottom + top) / 2.0], whole: [1.0; 2] }
    }

    /// The rectangle from `-half_width` to `half_width` in x and from `-half_height` to `half_height` in y.
    #[must_use]
    pub const fn centred(half_width: f64, half_height: f64) -> Extents {
        Extents { half: [half_width, half_height], middle: [0.0; 2], whole: [1.0; 2] }
    }

    /// Returns half the width and half the height.
    #[must_use]
    pub const fn half(&self) -> [f64; 2] {
        self.half
    }

    /// Returns the point in the middle.
    #[must_use]
    pub const fn middle(&self) -> [f64; 2] {
        self.middle
    }
}

impl Projection {
    /// The centred perspective with this vertical field of view in radians. `aspect` is the picture's width divided by
    /// its height.
    #[must_use]
    pub fn perspective(fov_y: f64, aspect: f64) -> Projection {
        let tan_half_fov_y = (fov_y / 2.0).tan();
        Projection::Perspective(Extents::centred(tan_half_fov_y * aspect, tan_half_fov_y))
    }

    /// The centred orthographic view of this height in scene units. `aspect` is the picture's width divided by its
    /// height.
    #[must_use]
    pub fn orthographic(height: f64, aspect: f64) -> Projection {
        Projection::Orthographic(Extents::centred(height / 2.0 * aspect, height / 2.0))
    }

    /// The perspective of a camera with these intrinsics, for a picture of `size` (width, height) pixels. `focal` is
    /// the focal length in pixels in x and in y. `principal` is the point of the picture that the view's axis goes
    /// through, in pixels from the upper left corner of the picture, y down. The centre of the first pixel is (0.5,
    /// 0.5).
    #[must_use]
    pub fn from_intrinsics(focal: [f64; 2], principal: [f64; 2], size: (u32, u32)) -> Projection {
        let [[fx, fy], [cx, cy], [width, height]] = [focal, principal, [size.0.into(), size.1.into()]];
        Projection::Perspective(Extents::new(-cx / fx, (width - cx) / fx, (cy - height) / fy, cy / fy))
    }

    /// Returns the rectangle that the picture shows: in perspective at z = 1, otherwise in scene units.
    #[must_use]
    pub fn extents(&self) -> Extents {
        match *self {
            Projection::Perspective(extents) | Projection::Orthographic(extents) => extents,
        }
    }

    /// Returns half the picture's width and height. In perspective they are measured at z = 1; in an orthographic view
    /// they are the same at every depth, in scene units.
    #[must_use]
    pub fn half_extents(&self) -> [f64; 2] {
        self.extents().half
    }

    /// Returns half the picture's width and height at depth z, in scene units.
    #[must_use]
    pub fn half_extents_at(&self, z: f64) -> [f64; 2] {
        self.half_extents().map(|half| half * self.growth(z))
    }

    /// Returns x and y of the point in the middle of the picture at depth z, in scene units.
    #[must_use]
    pub fn middle_at(&self, z: f64) -> [f64; 2] {
        self.extents().middle.map(|middle| middle * self.growth(z))
    }

    /// Returns whether the projection is perspective, so that rays start at the eye and do not run in parallel.
    #[must_use]
    pub fn is_perspective(&self) -> bool {
        matches!(self, Projection::Perspective { .. })
    }

    /// Returns the projection of a part of this picture, whose size is `picture` (width, height) in pixels. The part is
    /// `size` pixels large, and its lower left pixel is `corner` (x, y) in the picture, y up.
    ///
    /// Ambient occlusion of the part equals that of the same pixels in the picture, up to rounding, if `corner` is a
    /// multiple of 8 in x and y, so that the rotation tile and the texels of half resolution stay where they are; if
    /// the part holds everything that the samples of those pixels read: see [`crate::Settings::guard_band`]; and if it
    /// does not reach beyond the picture, at whose border samples are clamped.
    #[must_use]
    pub fn part(&self, picture: (u32, u32), corner: (i64, i64), size: (u32, u32)) -> Projection {
        let Extents { mut half, mut middle, mut whole } = self.extents();
        let axes = [(picture.0, corner.0, size.0), (picture.1, corner.1, size.1)];
        for (axis, (picture, corner, size)) in axes.into_iter().enumerate() {
            let (picture, corner, size) = (f64::from(picture), corner as f64, f64::from(size));
            middle[axis] += half[axis] * ((2.0 * corner + size - picture) / picture);
            half[axis] *= size / picture;
            whole[axis] *= picture / size;
        }
        let extents = Extents { half, middle, whole };
        if self.is_perspective() { Projection::Perspective(extents) } else { Projection::Orthographic(extents) }
    }

    /// Refuses a projection of which no picture can be made.
    ///
    /// # Errors
    /// [`Error::Usage`] for a picture without extent, for numbers that are not finite, and for a perspective whose axis
    /// lies more than 1000 halves of the picture's width or height from its middle.
    pub fn check(&self) -> Result<(), Error> {
        let Extents { half: [x, y], middle, .. } = self.extents();
        if !(x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0) {
            return Err(Error::Usage(format!(
                "projection: half the picture's width is {x} and half its height {y}, and both must be finite and above 0; \
                 a field of view is given in radians"
            )));
        }
        let far = |middle: f64, half: f64| self.is_perspective() && middle.abs() / half > FARTHEST_AXIS;
        if !middle.iter().all(|c| c.is_finite()) || far(middle[0], x) || far(middle[1], y) {
            return Err(Error::Usage(format!(
                "projection: the view's axis must lie within {FARTHEST_AXIS} halves of the picture's size from its middle, \
                 which is at {middle:?}"
            )));
        }
        Ok(())
    }

    /// Returns where the origin of x and y, to which the shaders' positions are relative, lies in the picture: (0, 0)
    /// is its lower left corner and (1, 1) its upper right. In perspective the origin is on the view's axis. In an
    /// orthographic view, which looks the same from everywhere, it is in the middle of the picture, so that float32
    /// loses nothing far from the axis.
    pub(crate) fn origin_in_picture(&self) -> [f64; 2] {
        let Extents { half, middle, .. } = self.extents();
        let along = |axis: usize| if self.is_perspective() { (1.0 - middle[axis] / half[axis]) / 2.0 } else { 0.5 };
        [along(0), along(1)]
    }

    /// Returns how many times as wide and as high the whole picture is, if this is a part of one.
    pub(crate) fn whole(&self) -> [f64; 2] {
        self.extents().whole
    }

    /// Returns the height of the whole picture, of which this may be a part: in perspective at z = 1, otherwise in
    /// scene units.
    pub(crate) fn whole_height(&self) -> f64 {
        2.0 * self.half_extents()[1] * self.whole()[1]
    }

    /// Returns the factor by which the extents at z = 1 grow up to depth z.
    fn growth(&self, z: f64) -> f64 {
        if self.is_perspective() { z } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centred_extents_are_the_symmetric_projection() {
        for aspect in [0.37, 1.0, 4.0 / 3.0, 97.0 / 61.0] {
            for fov in [1.0_f64, 45.0, 50.0, 120.0, 175.0].map(f64::to_radians) {
                let symmetric = Projection::perspective(fov, aspect);
                let [x, y] = symmetric.half_extents();
                assert_eq!(Projection::Perspective(Extents::new(-x, x, -y, y)), symmetric);
            }
            let symmetric = Projection::orthographic(3.7, aspect);
            let [x, y] = symmetric.half_extents();
            assert_eq!(Projection::Orthographic(Extents::new(-x, x, -y, y)), symmetric);
        }
    }

    #[test]
    fn intrinsics_are_in_pixels_from_the_upper_left_corner() {
        let centred = Projection::perspective(1.0, 1.5);
        let focal = 200.0 / 0.5_f64.tan();
        assert_eq!(Projection::from_intrinsics([focal; 2], [300.0, 200.0], (600, 400)), centred);
        // The axis goes through a point right of the middle and above it.
        let aside = Projection::from_intrinsics([100.0, 50.0], [400.0, 150.0], (600, 400));
        assert_eq!(aside, Projection::Perspective(Extents::new(-4.0, 2.0, -5.0, 3.0)));
    }

    #[test]
    fn the_parts_of_a_picture_show_its_points_where_the_picture_does() {
        let size = (1601, 777);
        let extents = Extents::new(-0.3, 0.9, 0.2, 0.7);
        for picture in [Projection::Perspective(extents), Projection::Orthographic(extents)] {
            for (corner, of) in [((0, 0), (1601, 777)), ((800, 8), (13, 64)), ((-24, -8), (1700, 800))] {
                let part = picture.part(size, corner, of);
                // The pixel (x, y) of the picture is the pixel (x, y) - corner of the part.
                let at = |projection: Projection, (width, height): (u32, u32), x: f64, y: f64| {
                    let ([half_x, half_y], [left, low]) = (projection.half_extents_at(2.0), projection.middle_at(2.0));
                    let (u, v) = (2.0 * x / f64::from(width) - 1.0, 2.0 * y / f64::from(height) - 1.0);
                    [left + u * half_x, low + v * half_y]
                };
                for (x, y) in [(0.0, 0.0), (812.5, 40.25), (1601.0, 777.0)] {
                    let [a, b] = at(picture, size, x, y);
                    let [c, d] = at(part, of, x - corner.0 as f64, y - corner.1 as f64);
                    assert!((a - c).abs() + (b - d).abs() < 1e-12, "{part:?}");
                }
                let [width, height] = part.whole();
                assert!((width * f64::from(of.0) - 1601.0).abs() + (height * f64::from(of.1) - 777.0).abs() < 1e-9);
            }
        }
        let centred = Projection::perspective(1.0, 1.5);
        assert_eq!(centred.part(size, (0, 0), size), centred);
    }

    #[test]
    fn projections_of_which_no_picture_can_be_made_are_refused() {
        let nan = f64::NAN;
        for [left, right, bottom, top] in [
            [1.0, 1.0, 0.0, 1.0],
            [1.0, -1.0, 0.0, 1.0],
            [-1.0, 1.0, 1.0, 0.0],
            [nan, 1.0, 0.0, 1.0],
            [-1.0, f64::INFINITY, 0.0, 1.0],
            [f64::NEG_INFINITY, f64::INFINITY, 0.0, 1.0],
            [-1e308, 1e308, 0.0, 1.0],
        ] {
            let extents = Extents::new(left, right, bottom, top);
            for projection in [Projection::Perspective(extents), Projection::Orthographic(extents)] {
                let message = projection.check().unwrap_err().to_string();
                assert!(message.contains("finite and above 0"), "{message}");
            }
        }
        let aside = Extents::new(10.0, 10.01, 0.0, 1.0);
        assert!(Projection::Perspective(aside).check().unwrap_err().to_string().contains("the view's axis"));
        Projection::Orthographic(aside).check().unwrap();
        Projection::Perspective(Extents::new(10.0, 10.03, 0.0, 1.0)).check().unwrap();
    }
}
