//! Describes settings in a few words.

use hbao::Settings;
use hbao::settings::MethodBlur;

/// Describes in a few words what distinguishes these settings from others of the same method.
pub(crate) fn words(s: &Settings) -> String {
    let counts: Vec<String> = s.method.counts(s).iter().map(u32::to_string).collect();
    let samples = counts.join("/");
    let mut extras = Vec::new();
    if s.half_res {
        extras.push("half".to_string());
    }
    if s.method.facts().blur == MethodBlur::Gaussian {
        extras.push(format!("blur {}", s.blur));
    }
    let own = Settings::for_method(s.method);
    for (knob, value, usual) in [("strength", s.strength, own.strength), ("spacing", s.spacing, own.spacing)] {
        if s.method.reads(knob) && value != usual {
            extras.push(format!("{knob} {value}"));
        }
    }
    for (value, usual) in [
        (s.exit.name(), own.exit.name()),
        (s.zenith.name(), own.zenith.name()),
        (s.quadrature.name(), own.quadrature.name()),
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
