//! Ray marching over the depth image, the brute force of ShaderX7 6.2.

use super::method::Shader;
use crate::gl::{Defines, source};
use crate::settings::Settings;

pub(super) fn shader(settings: &Settings, defines: Defines) -> Shader {
    Shader { pieces: vec![source!("ray_march.frag")], defines: defines.value("N_R", settings.rays) }
}
