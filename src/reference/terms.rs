//! The twin that the settings ask for, with its numbers worked out.

use super::sampling::{Pixel, Shift};
use super::twin::{Converged, Occlusion, Twin};
use crate::settings::method::methods;
use crate::settings::{Method, Settings};

macro_rules! twins {
    ($($(#[$doc:meta])* $variant:ident = $name:literal {
        twin: [$($twin:ident)?],
        shader: [$($file:literal),*],
        define: [$($define:literal)?],
        facts: { $($fact:tt)* }
    })+) => {
        /// The twin of a method; `None` where A = 1 everywhere.
        fn twin(method: Method) -> Option<Twin> {
            match method {
                $(Method::$variant => [$(super::$twin::TWIN)?].into_iter().next()),+
            }
        }
    };
}
methods!(twins);

/// A method: A = 1 - scale times the sum of its occlusion in each direction, or by each sample.
pub(super) struct Terms {
    pub(super) occlusion: Occlusion,
    /// The number of directions or samples.
    pub(super) count: u32,
    scale: f64,
    /// Whether A = 1 where a step is below a texel (6.2, Variable step size).
    early_exit: bool,
    /// Whether it ends with A^2 + A (6.1).
    curve: bool,
    pub(super) converged: Option<Converged>,
}

impl Terms {
    /// `None` where A = 1 everywhere.
    pub(super) fn of(settings: &Settings) -> Option<Terms> {
        let twin = twin(settings.method)?;
        Some(Terms {
            occlusion: twin.occlusion,
            count: (twin.count)(settings),
            scale: (twin.scale)(settings),
            early_exit: settings.method.facts().exits_early,
            curve: (twin.curve)(settings),
            converged: twin.converged,
        })
    }

    /// A, of the sum of all occlusion.
    pub(super) fn visibility(&self, occlusion: f64) -> f64 {
        let open = (1.0 - self.scale * occlusion).clamp(0.0, 1.0);
        if self.curve { (open * open + open).min(1.0) } else { open }
    }

    /// The most that A can change for a change of the occlusion by 1. A^2 + A has its steepest slope, sqrt(5), where it
    /// reaches 1.
    pub(super) fn steepest(&self) -> f64 {
        if self.curve { 5f64.sqrt() * self.scale } else { self.scale }
    }

    /// Whether the pixel is left open because its step is below a texel.
    pub(super) fn exits_early(&self, pixel: &Pixel, shift: Shift) -> bool {
        self.early_exit && pixel.step_px.min_element() < 1.0 + shift.comparison
    }
}
