//! The panel beside the image, and the line below it.

use super::costs::bytes;
use super::graph;
use super::knobs::{self, PRESETS, Preset};
use super::state::{Compare, Viewer};
use super::truth;
use crate::picture;
use eframe::egui::{self, Color32, RichText, TextEdit, Ui};
use hbao::settings::Settings;
use std::path::PathBuf;

/// The panel's width, in points.
pub(super) const WIDTH: f32 = 384.0;

/// The height of what stands below the settings, in points.
const FILES: f32 = 168.0;

/// Shows the panel.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let spacing = ui.spacing_mut();
    (spacing.slider_width, spacing.item_spacing.x, spacing.button_padding.x) = (104.0, 6.0, 5.0);
    ui.add_space(6.0);
    shown(viewer, ui);
    ui.separator();
    tabs(viewer, ui);
    let room = ui.available_height() - FILES;
    let area = egui::ScrollArea::vertical().max_height(room).min_scrolled_height(room).auto_shrink([false, false]);
    area.show(ui, |ui| {
        knobs::show(viewer, ui);
        times(viewer, ui);
    });
    ui.separator();
    files(viewer, ui);
}

/// What is shown: the image, and of which side.
fn shown(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        let spacing = ui.spacing_mut();
        (spacing.item_spacing.x, spacing.button_padding.x) = (3.0, 3.0);
        for (at, (name, image)) in picture::names().enumerate() {
            let button = ui.selectable_label(viewer.show.0 == name, name);
            let button = button.on_hover_text(format!("{}\n\nKey {}", image.help.replace('\n', " "), at + 1));
            viewer.note(format!("show {name}"), button.rect);
            if button.clicked() {
                viewer.choose_image(at);
            }
        }
    });
    ui.horizontal(|ui| {
        for (compare, name) in Compare::ALL {
            let button =
                ui.selectable_value(&mut viewer.compare, compare, name).on_hover_text("Key C goes through these");
            viewer.note(format!("compare {name}"), button.rect);
        }
        if viewer.compare == Compare::Difference {
            let gain = egui::Slider::new(&mut viewer.gain, 1.0..=64.0).logarithmic(true).integer().prefix("x ");
            let response = ui.spacing_mut();
            response.slider_width = 60.0;
            let response = ui.add(gain).on_hover_text("By what the difference is multiplied");
            viewer.note("gain", response.rect);
        }
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut viewer.magnified, "magnify").on_hover_text("Key M");
        ui.checkbox(&mut viewer.timed, "times").on_hover_text("Key T: measures each pass; the frame takes longer then");
        let mut perspective = viewer.eye.is_perspective();
        if ui.checkbox(&mut perspective, "perspective").on_hover_text("Key P").changed() {
            viewer.eye.change_projection();
        }
        if ui.button("reset").on_hover_text("Key R: puts the camera back to where it was at the start").clicked() {
            viewer.reset();
        }
        if ui.button("frame").on_hover_text("Key F: frames the whole scene").clicked() {
            viewer.frame_all();
        }
        if ui.button("?").on_hover_text("Lists the keys").clicked() {
            viewer.keys_shown = true;
        }
    });
    truth::panel(viewer, ui);
}

/// The two sides, and the presets of the one in the panel.
fn tabs(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        for (at, name) in ["A", "B"].into_iter().enumerate() {
            let button = ui.selectable_value(&mut viewer.tab, at, RichText::new(format!("  {name}  ")).strong());
            let button = button.on_hover_text("The settings of this side. Key B changes the side");
            viewer.note(format!("tab {name}"), button.rect);
        }
        let other = ["A", "B"][1 - viewer.tab];
        if ui.button(format!("as {other}")).on_hover_text(format!("Takes the settings of {other}")).clicked() {
            viewer.sides[viewer.tab] = viewer.sides[1 - viewer.tab].clone();
        }
        ui.separator();
        for Preset { name, help, of } in PRESETS {
            let button = ui.button(name).on_hover_text(format!("{help}; the radius stays"));
            viewer.note(format!("preset {name}"), button.rect);
            if button.clicked() {
                let settings = viewer.settings();
                let usual = Settings { radius: settings.radius, ..Settings::for_scene(settings.method) };
                viewer.sides[viewer.tab] = of(usual);
            }
        }
        ui.separator();
        let plot = ui.button("plot").on_hover_text("Key V: error against time, of these and of other settings");
        viewer.note("plot", plot.rect);
        if plot.clicked() {
            viewer.sweep_shown = !viewer.sweep_shown;
        }
    });
}

/// How long the passes took, and how many samples a pixel has.
fn times(viewer: &Viewer, ui: &mut Ui) {
    let Some(drawn) = &viewer.drawn else { return };
    if drawn.sides.iter().all(|side| side.times.is_empty()) {
        return;
    }
    ui.separator();
    egui::Grid::new("times").striped(true).num_columns(1 + 2 * drawn.sides.len()).spacing([8.0, 2.0]).show(ui, |ui| {
        ui.strong("pass");
        for side in names(viewer) {
            ui.strong(format!("{side} GPU ms"));
            ui.strong(format!("{side} clock ms"));
        }
        ui.end_row();
        let mut passes: Vec<&str> = Vec::new();
        for time in drawn.sides.iter().flat_map(|side| &side.times) {
            if !passes.contains(&time.name) {
                passes.push(time.name);
            }
        }
        for pass in passes {
            ui.horizontal(|ui| {
                graph::swatch(ui, graph::colour(&viewer.costs, pass));
                ui.label(pass);
            });
            for side in &drawn.sides {
                let time = side.times.iter().find(|time| time.name == pass);
                let cell = |ms: Option<f64>| ms.map_or_else(|| "-".into(), |ms| format!("{ms:.2}"));
                ui.label(cell(time.and_then(|time| time.gpu_ms)));
                ui.label(cell(time.map(|time| time.wall_ms)));
            }
            ui.end_row();
        }
        ui.strong("all");
        for side in &drawn.sides {
            ui.label("");
            ui.strong(format!("{:.2}", side.times.iter().map(|time| time.wall_ms).sum::<f64>()));
        }
        ui.end_row();
    });
}

/// The names of the sides of the image on the screen.
fn names(viewer: &Viewer) -> &'static [&'static str] {
    match (viewer.drawn.as_ref().map_or(1, |drawn| drawn.sides.len()), viewer.tab) {
        (1, 0) => &["A"],
        (1, _) => &["B"],
        _ => &["A", "B"],
    }
}

/// The model, and the files that can be written.
fn files(viewer: &mut Viewer, ui: &mut Ui) {
    let row = |ui: &mut Ui, text: &mut String, name: &str, help: &str| {
        let mut pressed = false;
        let rects = ui.horizontal(|ui| {
            let field = ui.add(TextEdit::singleline(text).desired_width(250.0)).on_hover_text(help);
            let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            let button = ui.button(name).on_hover_text(help);
            pressed = entered || button.clicked();
            [field.rect, button.rect]
        });
        (pressed, rects.inner)
    };
    let (mut model, mut image, mut settings) =
        (viewer.model_text.clone(), viewer.image_text.clone(), viewer.settings_text.clone());
    let opened = row(
        ui,
        &mut model,
        "open",
        "A model (OBJ, PLY, STL, glTF), cornell-box or nave. A file can also be dropped on the window",
    );
    let saved = row(ui, &mut image, "save image", "The image of the side in the panel: a PNG, or an EXR with floats");
    let stored = row(ui, &mut settings, "save settings", "The settings of the side in the panel, for --settings");
    (viewer.model_text, viewer.image_text, viewer.settings_text) = (model, image, settings);
    for (name, (_, [field, button])) in [("open", opened), ("save image", saved), ("save settings", stored)] {
        viewer.note(format!("field {name}"), field);
        viewer.note(name, button);
    }
    if opened.0 {
        viewer.open(&PathBuf::from(viewer.model_text.trim()));
    }
    if saved.0 {
        viewer.save_image();
    }
    if stored.0 {
        viewer.save_settings();
    }
    let mut command = viewer.command();
    ui.horizontal_top(|ui| {
        let copy = ui.button("copy").on_hover_text("Key Y: copies the command that renders this image, bit for bit");
        viewer.note("copy", copy.rect);
        if copy.clicked() {
            ui.ctx().copy_text(command.clone());
            viewer.said = "The command was copied.".into();
        }
        let field = TextEdit::multiline(&mut command).font(egui::FontId::proportional(11.0)).desired_rows(3);
        egui::ScrollArea::vertical().id_salt("command").max_height(58.0).show(ui, |ui| {
            ui.add(field.desired_width(f32::INFINITY).interactive(false));
        });
    });
}

/// What went wrong, over the image, so that nothing else moves.
pub(super) fn message(viewer: &mut Viewer, context: &egui::Context) {
    let Some(message) = viewer.message.clone() else { return };
    let area = egui::Area::new(egui::Id::unique("message")).anchor(egui::Align2::LEFT_BOTTOM, [12.0, -38.0]);
    area.show(context, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width((context.content_rect().width() - WIDTH - 48.0).max(120.0));
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(message).color(Color32::from_rgb(255, 150, 130)));
                let close = ui.button("close").on_hover_text("Key Esc");
                viewer.note("close message", close.rect);
                if close.clicked() {
                    viewer.message = None;
                }
            });
        });
    });
}

/// The line below the image: what the image is, how long it took, and what was done last.
pub(super) fn status(viewer: &Viewer, ui: &mut Ui) {
    let mut parts = vec![match &viewer.drawn {
        None => "Rendering ...".into(),
        Some(drawn) => {
            let (width, height) = drawn.job.size;
            let count = |settings: &Settings| settings.method.samples(settings).to_string();
            let samples: Vec<String> = drawn.job.sides.iter().map(count).collect();
            let depths: Vec<String> = drawn.sides.iter().map(|side| side.samples.to_string()).collect();
            let size = match drawn.job.divisor {
                1 => format!("{width}x{height}"),
                divisor => format!("{width}x{height}, 1/{divisor} of it while moving"),
            };
            let held = drawn.sides.iter().map(|side| bytes(side.texture_bytes + side.triangle_bytes));
            format!(
                "{size}, {:.0} ms, {} samples a pixel, msaa {}, {} on the GPU",
                1e3 * drawn.seconds,
                samples.join(" and "),
                depths.join(" and "),
                held.collect::<Vec<_>>().join(" and ")
            )
        }
    }];
    let sides = viewer.drawn.iter().flat_map(|drawn| &drawn.sides);
    parts.extend(
        names(viewer).iter().zip(sides).filter_map(|(name, side)| Some(format!("{name}: {}", side.exits.as_ref()?))),
    );
    parts.extend(viewer.drawn.iter().filter_map(|drawn| drawn.notices.first().cloned()));
    parts.extend(Some(viewer.said.clone()).filter(|said| !said.is_empty()));
    ui.add(egui::Label::new(parts.join("   |   ")).truncate());
}
