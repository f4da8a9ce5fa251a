//! Screen-space ambient occlusion as Crysis has it, ShaderX7 6.1.

use super::method::Shader;
use crate::gl::{Defines, source};
use crate::settings::{Settings, SsaoDepth, Toggle};

pub(super) fn shader(settings: &Settings, defines: Defines) -> Shader {
    let n = settings.ssao_samples;
    // l_i, growing on across the octets. Compiled in as numbers: a power for each sample would cost.
    let lengths: Vec<String> =
        (1..=n as i32).map(|i| format!("{:?}", (0.01 * (1.0 + 2.4 / f64::from(n)).powi(i)) as f32)).collect();
    let mut defines = defines
        .value("N_SAMPLES", n)
        .value("LENGTHS", lengths.join(", "))
        .word("ROTATION", settings.ssao_rotation.name());
    for (name, on) in [
        ("HALF_DEPTH", settings.ssao_depth == SsaoDepth::Half),
        ("NORMALS", settings.ssao_normals == Toggle::On),
        ("CURVE", settings.ssao_curve == Toggle::On),
    ] {
        if on {
            defines = defines.value(name, 1);
        }
    }
    Shader { pieces: vec![source!("ssao.frag")], defines }
}
