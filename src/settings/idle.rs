//! Tells which settings have no effect on ambient occlusion, given the values of the others, and why.

use super::{Method, MethodBlur, Settings};
use std::fmt;

/// Why a setting has no effect on ambient occlusion. It is displayed as the end of a sentence, in the words of the
/// command line: `with --blur 0`, as in `--blur-kernel has no effect with --blur 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Idle {
    /// The method does not read the setting.
    Method(Method),
    /// The setting belongs to the blur, and the blur is off.
    NoBlur,
    /// The method has its own blur, whose size is fixed.
    OwnBlur(Method),
    /// The setting chooses between full-size and half-size depth. At half resolution the method reads the same depths
    /// with both, those of the pixels (2i, 2j).
    HalfResolution,
    /// The setting concerns pixels that hold several surfaces, and a pixel with one depth sample holds only one.
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
    /// Returns why the setting of this name (a name of [`KNOBS`](super::KNOBS)) has no effect on ambient occlusion,
    /// given the values of the other settings. `None` if it has an effect. Settings of the G-buffer always have an
    /// effect.
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
