//! The twin of the method that the settings name, with its counts and factors evaluated.

use super::sampling::{EXACT, MethodScene, Pixel};
use super::twin::{Converged, Occlusion, Twin};
use crate::settings::method::methods;
use crate::settings::{Method, Settings};

macro_rules! twins {
    ($($(#[$doc:meta])* $variant:ident = $name:literal { twin: [$($twin:ident)?], $($other:tt)* })+) => {
        /// Returns the twin of a method; `None` if A = 1 everywhere.
        fn twin(method: Method) -> Option<Twin> {
            match method {
                $(Method::$variant => [$(super::$twin::TWIN)?].into_iter().next()),+
            }
        }
    };
}
methods!(twins);

/// A method in the form A = 1 - scale * (sum of its occlusion over all directions, or over all samples).
pub(super) struct Terms {
    pub(super) occlusion: Occlusion,
    /// The number of directions, or of samples.
    pub(super) count: u32,
    scale: f64,
    /// Whether the method ends with A^2 + A (6.1).
    curve: bool,
    pub(super) converged: Option<Converged>,
}

impl Terms {
    /// Returns the method of these settings; `None` if A = 1 everywhere.
    pub(super) fn of(settings: &Settings) -> Option<Terms> {
        let twin = twin(settings.method)?;
        Some(Terms {
            occlusion: twin.occlusion,
            count: (twin.count)(settings),
            scale: (twin.scale)(settings),
            curve: (twin.curve)(settings),
            converged: twin.converged,
        })
    }

    /// Returns A at a pixel, before any blur.
    pub(super) fn at(&self, scene: &MethodScene, pixel: &Pixel) -> f64 {
        if pixel.exits_early(EXACT) {
            return 1.0;
        }
        let term = |k| (self.occlusion)(scene, pixel, k, EXACT, &mut ());
        self.visibility((0..self.count).map(term).sum())
    }

    /// Returns A for this sum of occlusion over all directions or samples.
    pub(super) fn visibility(&self, occlusion: f64) -> f64 {
        let open = (1.0 - self.scale * occlusion).clamp(0.0, 1.0);
        if self.curve { (open * open + open).min(1.0) } else { open }
    }

    /// Returns the most that A can change if the sum of occlusion changes by 1. A^2 + A is steepest at the point where
    /// it reaches 1, with a slope of sqrt(5).
    pub(super) fn steepest(&self) -> f64 {
        if self.curve { 5f64.sqrt() * self.scale } else { self.scale }
    }
}
