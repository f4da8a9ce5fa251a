//! Settings in a few words.

use hbao::Settings;
use hbao::settings::Method;

/// What distinguishes settings from others of their method, in a few words.
pub(crate) fn words(s: &Settings) -> String {
    let samples = match s.method {
        Method::Ssao => format!("{}", s.ssao_samples),
        Method::RayMarch => format!("{}/{}/{}", s.directions, s.rays, s.steps),
        Method::None => String::new(),
        _ => format!("{}/{}", s.directions, s.steps),
    };
    let mut extras = Vec::new();
    if s.half_res {
        extras.push("half".to_string());
    }
    if s.method != Method::Ssao && s.method != Method::None {
        extras.push(format!("blur {}", s.blur));
    }
    let own = Settings::for_method(s.method);
    for (value, usual) in [
        (s.blur_kernel.name(), own.blur_kernel.name()),
        (s.ao_format.name(), own.ao_format.name()),
        (s.normal_format.name(), own.normal_format.name()),
        (s.depth_format.name(), own.depth_format.name()),
    ] {
        if value != usual {
            extras.push(value.into());
        }
    }
    format!("{samples:<9} {}", extras.join(", "))
}
