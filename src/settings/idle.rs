//! Settings that change nothing in ambient occlusion as the other settings stand, and why.

use super::{Method, MethodBlur, Settings};
use std::fmt;

/// Why a setting changes nothing in ambient occlusion. It is displayed as the end of a sentence, in the command line's
/// words: `with --blur 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Idle {
    /// The method does not read it.
    Method(Method),
    /// It is about the blur, and there is none.
    NoBlur,
    /// The method has a blur of its own, whose size is fixed.
    OwnBlur(Method),
    /// At half resolution the texels are those of the half-size depth already.
    HalfResolution,
    /// A pixel with one depth sample holds one surface.
    OneSample,
}

impl fmt::Display for Idle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Idle::Method(method) => write!(f, "with --method {}", method.name()),
            Idle::NoBlur => write!(f, "with --blur 0"),
            Idle::OwnBlur(method) => {
                write!(f, "with --method {}, whose own blur is 4x4 (0 turns it off)", method.name())
            }
            Idle::HalfResolution => write!(f, "with --half-res, whose texels are those of the half-size depth"),
            Idle::OneSample => write!(f, "with --msaa 1"),
        }
    }
}

impl Settings {
    /// Why the setting of this name (a name of [`KNOBS`](super::KNOBS)) changes nothing in ambient occlusion as the
    /// others stand; `None` where it matters. Settings of the G-buffer always matter.
    #[must_use]
    pub fn idle(&self, knob: &str) -> Option<Idle> {
        if !self.method.reads(knob) {
            return Some(Idle::Method(self.method));
        }
        match knob {
            "blur-kernel" | "blur-depth-sigma" | "edges" if self.blur == 0 => Some(Idle::NoBlur),
            "blur" if self.blur > 0 && self.method.facts().blur == MethodBlur::Crysis => {
                Some(Idle::OwnBlur(self.method))
            }
            "ssao-depth" if self.half_res => Some(Idle::HalfResolution),
            "edges" if self.msaa == 1 => Some(Idle::OneSample),
            _ => None,
        }
    }
}
