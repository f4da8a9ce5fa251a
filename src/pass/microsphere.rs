//! Micro-spheres (Shanmugam and Arikan 2007) and creases (Fox and Compton 2008), as ShaderX7 6.2 describes them.

use super::method::{SAMPLING, Shader, sampling};
use crate::gl::{Defines, source};
use crate::settings::{Method, Settings};

pub(super) fn shader(settings: &Settings, defines: Defines) -> Shader {
    let defines = sampling(settings, defines);
    Shader {
        pieces: vec![SAMPLING, source!("microsphere.frag")],
        defines: if settings.method == Method::Crease { defines.value("CREASE", 1) } else { defines },
    }
}
