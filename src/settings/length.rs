//! The radius of influence as it is set, and lengths as they are in a view.

use crate::Error;

/// R, the distance beyond which nothing occludes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Radius {
    /// A length in scene units.
    Units(f64),
    /// A percentage of the diagonal of the scene's bounding box. Only a command or an application that has a scene can
    /// use it: see [`Settings::resolved`](super::Settings::resolved).
    Percent(f64),
    /// A share f of the height of the whole view, so that R covers the same number of pixels everywhere: R(P) = 2 f P.z
    /// tan(fov_y/2), which grows with depth; in an orthographic view f times its height. A method takes its steps
    /// everywhere or nowhere then: with 8 steps and the default, 0.05, pictures must be at least 180 pixels high, and
    /// 360 at half resolution ([`Settings::exit_depth`](super::Settings::exit_depth)).
    OfView(f64),
}

impl Radius {
    /// Checks that the number is finite and above 0.
    pub(super) fn check(self) -> Result<(), Error> {
        let (Radius::Units(number) | Radius::Percent(number) | Radius::OfView(number)) = self;
        if number.is_finite() && number > 0.0 {
            return Ok(());
        }
        Err(Error::Usage(format!("radius: {self:?} must be finite and above 0")))
    }

    /// Returns R in scene units, if it is set so.
    #[must_use]
    pub fn units(self) -> Option<f64> {
        match self {
            Radius::Units(radius) => Some(radius),
            Radius::Percent(_) | Radius::OfView(_) => None,
        }
    }
}

/// A length in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Length {
    /// The same everywhere, in scene units.
    Units(f64),
    /// A share of the depth at the pixel.
    OfDepth(f64),
}

impl Length {
    /// Returns the length in scene units at depth `z`.
    #[must_use]
    pub fn at(self, z: f64) -> f64 {
        match self {
            Length::Units(length) => length,
            Length::OfDepth(share) => share * z,
        }
    }

    /// Returns the length times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Length {
        match self {
            Length::Units(length) => Length::Units(length * factor),
            Length::OfDepth(share) => Length::OfDepth(share * factor),
        }
    }
}
