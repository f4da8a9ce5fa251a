//! Horizon-based ambient occlusion as the SIGGRAPH 2008 talk has it (Eq. 3).

use super::method::{SAMPLING, Shader, TANGENT, bias, sampling};
use crate::gl::{Defines, source};
use crate::settings::Settings;

pub(super) fn shader(settings: &Settings, defines: Defines) -> Shader {
    Shader {
        pieces: vec![SAMPLING, TANGENT, source!("hbao_talk.frag")],
        defines: bias(settings, sampling(settings, defines)),
    }
}
