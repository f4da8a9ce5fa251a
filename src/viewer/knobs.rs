//! The widgets of the settings, one for each of [`KNOBS`], made from its kind.

use super::state::Viewer;
use eframe::egui::{self, ComboBox, Response, Slider, SliderClamping, Ui};
use hbao::settings::{AoFormat, Exit, KNOBS, Kind, Knob, Method, NormalFormat, Radius, Settings};
use std::ops::RangeInclusive;

/// The units of the radius: what follows the number in its text, and how the panel names them.
const UNITS: [(&str, &str); 3] = [("", "units"), ("%", "% of scene"), ("%view", "% of view")];

/// Shows all settings of the side in the panel, and takes their changes.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let mut settings = viewer.settings().clone();
    let diagonal = viewer.scene.mesh.diagonal();
    for knob in KNOBS {
        let idle = settings.idle(knob.name);
        let row = ui.horizontal(|ui| {
            let accepts = format!("{}\n\n--{}: {}", knob.help, knob.name, knob.kind);
            let label = ui.add_enabled(idle.is_none(), egui::Label::new(knob.name).truncate());
            let indent = (118.0 - label.rect.width()).max(0.0);
            ui.add_space(indent);
            let widget = ui.add_enabled_ui(idle.is_none(), |ui| widget(knob, &mut settings, diagonal, ui)).inner;
            for part in [label, widget.clone()] {
                let part = part.on_hover_text(&accepts);
                if let Some(idle) = idle {
                    part.on_disabled_hover_text(format!("It has no effect {idle}.\n\n{accepts}"));
                }
            }
            widget
        });
        viewer.note(format!("knob {}", knob.name), row.inner.rect);
    }
    viewer.sides[viewer.tab] = settings;
}

/// The widget of one setting. Whatever it accepts, the setting does.
fn widget(knob: &'static Knob, settings: &mut Settings, diagonal: f64, ui: &mut Ui) -> Response {
    match knob.kind {
        Kind::Count(low, high) => slider(knob, settings, f64::from(low)..=f64::from(high), ui, |slider| {
            slider.integer().logarithmic(high > 64)
        }),
        Kind::OddOrZero(_, high) => {
            // Even numbers are between those that are accepted.
            let odd = |x: f64| if x < 2.0 { 0.0 } else { (x / 2.0).floor() * 2.0 + 1.0 };
            let mut value = number(knob, settings);
            let range = 0.0..=f64::from(high);
            let response = ui.add(Slider::new(&mut value, range).integer().clamping(SliderClamping::Always));
            if response.changed() {
                put(knob, settings, &odd(value).clamp(0.0, f64::from(high)).to_string());
            }
            response
        }
        Kind::Degrees(low, high) => slider(knob, settings, low..=high, ui, |slider| slider.suffix("°").max_decimals(1)),
        Kind::Number(low, high) => slider(knob, settings, low..=high, ui, |slider| slider.max_decimals(2)),
        Kind::Positive if knob.name == "blur-depth-sigma" => depth_sigma(knob, settings, diagonal, ui),
        Kind::Positive => slider(knob, settings, 0.05..=20.0, ui, |slider| slider.logarithmic(true)),
        Kind::Length => radius(knob, settings, diagonal, ui),
        Kind::OneOf(numbers) => {
            let words: Vec<String> = numbers.iter().map(u32::to_string).collect();
            choice(knob, settings, words.iter().map(String::as_str), ui)
        }
        Kind::Word(words) => choice(knob, settings, words.iter().copied(), ui),
        Kind::Switch => {
            let mut on = knob.text(settings) == "true";
            let response = ui.checkbox(&mut on, "");
            if response.changed() {
                put(knob, settings, &on.to_string());
            }
            response
        }
        // The library may learn other kinds: they are shown, and changed on the command line only.
        _ => ui.label(knob.text(settings)),
    }
}

/// The number of a setting; 0 for one without.
fn number(knob: &Knob, settings: &Settings) -> f64 {
    let text = knob.text(settings);
    text.trim_end_matches("view").trim_end_matches('%').parse().unwrap_or(0.0)
}

/// Sets a setting to a text. The widgets make only texts that it accepts.
fn put(knob: &Knob, settings: &mut Settings, text: &str) {
    let _ = knob.set(settings, text);
}

/// A slider. A value beyond its range, which the command line gave, stays until it is changed.
fn slider(
    knob: &Knob,
    settings: &mut Settings,
    range: RangeInclusive<f64>,
    ui: &mut Ui,
    made: impl FnOnce(Slider<'_>) -> Slider<'_>,
) -> Response {
    let mut value = number(knob, settings);
    let response = ui.add(made(Slider::new(&mut value, range)).clamping(SliderClamping::Edits));
    if response.changed() {
        put(knob, settings, &value.to_string());
    }
    response
}

/// Words of which one is chosen.
fn choice<'a>(knob: &Knob, settings: &mut Settings, words: impl Iterator<Item = &'a str>, ui: &mut Ui) -> Response {
    let now = knob.text(settings);
    let shown = if now.is_empty() { "by itself".into() } else { now.clone() };
    let combo = ComboBox::from_id_salt(knob.name).width(130.0).selected_text(shown);
    let list = combo.show_ui(ui, |ui| {
        for word in words {
            if ui.selectable_label(word == now, word).clicked() {
                match Method::ALL.iter().find(|method| knob.name == "method" && method.name() == word) {
                    Some(&method) => *settings = with_method(settings, method),
                    None => put(knob, settings, word),
                }
            }
        }
    });
    list.response
}

/// The settings with another method. Those that were the earlier method's defaults become those of the new one.
fn with_method(settings: &Settings, method: Method) -> Settings {
    let earlier = Settings::for_scene(settings.method);
    let mut changed = Settings::for_scene(method);
    for knob in KNOBS.iter().filter(|knob| knob.name != "method") {
        let text = knob.text(settings);
        if text != knob.text(&earlier) && !text.is_empty() {
            put(knob, &mut changed, &text);
        }
    }
    changed
}

/// The radius: a number on a logarithmic scale, and its unit.
fn radius(knob: &Knob, settings: &mut Settings, diagonal: f64, ui: &mut Ui) -> Response {
    let unit = match settings.radius {
        Radius::Percent(_) => 1,
        Radius::OfView(_) => 2,
        _ => 0,
    };
    let range = if unit == 0 { diagonal * 1e-4..=diagonal } else { 0.01..=100.0 };
    let mut value = number(knob, settings);
    let made = Slider::new(&mut value, range).logarithmic(true).clamping(SliderClamping::Edits);
    let response = ui.add(made.custom_formatter(|value, _| short(value)));
    if response.changed() {
        put(knob, settings, &format!("{}{}", short(value), UNITS[unit].0));
    }
    ComboBox::from_id_salt("radius unit").width(74.0).selected_text(UNITS[unit].1).show_ui(ui, |ui| {
        for (at, (end, name)) in UNITS.iter().enumerate() {
            if ui.selectable_label(at == unit, *name).clicked() && at != unit {
                let value = match (unit, at) {
                    (0, 1) => short(100.0 * value / diagonal),
                    (1, 0) => short(value / 100.0 * diagonal),
                    // Only the camera tells what a share of the view is in units: the usual share is the start.
                    _ => short(if at == 0 { 0.05 * diagonal } else { 5.0 }),
                };
                put(knob, settings, &format!("{value}{end}"));
            }
        }
    });
    response
}

/// A number with four digits.
pub(super) fn short(value: f64) -> String {
    format!("{value:.3e}").parse::<f64>().unwrap_or(value).to_string()
}

/// The depth sigma of the blur, which follows from other settings unless it is given.
fn depth_sigma(knob: &Knob, settings: &mut Settings, diagonal: f64, ui: &mut Ui) -> Response {
    let mut own = settings.blur_depth_sigma.is_some();
    let check = ui.checkbox(&mut own, if settings.blur_depth_sigma.is_some() { "" } else { "from other settings" });
    if check.changed() {
        settings.blur_depth_sigma = None;
        if own {
            put(knob, settings, &short(diagonal * 0.0125));
        }
    }
    if settings.blur_depth_sigma.is_none() {
        return check;
    }
    let range = diagonal * 1e-5..=diagonal;
    let mut value = number(knob, settings);
    let made = Slider::new(&mut value, range).logarithmic(true).clamping(SliderClamping::Edits);
    let response = ui.add(made.custom_formatter(|value, _| short(value)));
    if response.changed() {
        put(knob, settings, &short(value));
    }
    response
}

/// Settings that a button gives.
pub(super) struct Preset {
    pub(super) name: &'static str,
    pub(super) help: &'static str,
    /// Makes the settings from the method's defaults.
    pub(super) of: fn(Settings) -> Settings,
}

/// The presets of every method.
pub(super) const PRESETS: [Preset; 3] = [
    Preset { name: "default", help: "The defaults of the method", of: |usual| usual },
    Preset {
        name: "fast",
        help: "4 directions of 4 steps at half resolution, 8 samples for ssao, one depth sample per pixel",
        of: |usual| Settings {
            directions: 4,
            steps: 4,
            rays: 2,
            ssao_samples: 8,
            half_res: true,
            msaa: 1,
            exit: Exit::Shorten,
            ..usual
        },
    },
    Preset {
        name: "accurate",
        help: "16 directions of 16 steps, 24 samples for ssao, steps of a texel at least, finer texture formats",
        of: |usual| Settings {
            directions: 16,
            steps: 16,
            rays: 8,
            ssao_samples: 24,
            exit: Exit::Shorten,
            ao_format: AoFormat::R16f,
            normal_format: NormalFormat::Rgba16f,
            ..usual
        },
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_method_brings_its_defaults_and_keeps_what_was_changed() {
        let mut talk = Settings::for_scene(Method::HbaoTalk);
        talk.directions = 5;
        let hbao = with_method(&talk, Method::Hbao);
        assert_eq!(hbao, Settings { directions: 5, ..Settings::for_scene(Method::Hbao) });
        for &from in Method::ALL {
            for &to in Method::ALL {
                with_method(&Settings::for_scene(from), to).validate().unwrap();
            }
        }
    }

    #[test]
    fn every_preset_is_accepted_with_every_method() {
        for &method in Method::ALL {
            for Preset { name, of, .. } in PRESETS {
                let settings = of(Settings::for_scene(method));
                settings.validate().unwrap_or_else(|error| panic!("{name} {}: {error}", method.name()));
            }
        }
    }

    #[test]
    fn numbers_of_the_radius_keep_four_digits() {
        assert_eq!([short(152.34567), short(0.00012345), short(5.0)], ["152.3", "0.0001234", "5"]);
    }
}
