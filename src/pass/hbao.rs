//! Horizon-based ambient occlusion, ShaderX7 6.2 (Eq. 6.2.9).

use super::method::{SAMPLING, Shader, TANGENT, bias, sampling};
use crate::gl::{Defines, source};
use crate::settings::Settings;

pub(super) fn shader(settings: &Settings, defines: Defines) -> Shader {
    Shader {
        pieces: vec![SAMPLING, TANGENT, source!("hbao.frag")],
        defines: bias(settings, sampling(settings, defines)).word("GROUNDING", settings.grounding.name()),
    }
}
