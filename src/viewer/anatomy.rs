//! How the clicked pixel got its value: its samples in the image, and the slice of one of its directions in a window.

use super::knobs::short;
use super::plot::{self, BLUE, RED, SURFACE, degrees, rounded};
use super::section::{Kind, Section};
use super::state::Viewer;
use eframe::egui::{self, Color32, DragValue, Grid, Painter, Pos2, Rect, RichText, ScrollArea, Shape, Stroke, Ui};
use eframe::egui::{pos2, vec2};
use glam::{DVec2, dvec2};
use hbao::reference::anatomy::Fate;
use hbao::settings::Method;
use serde_json::{Value, json};

/// The width of the window, in points.
const WIDTH: f32 = 384.0;

/// Turns it on or off.
pub(super) fn switch(viewer: &mut Viewer) {
    viewer.inspection.is_on = !viewer.inspection.is_on;
    viewer.inspection.stale = true;
}

/// The switch in the panel.
pub(super) fn button(viewer: &mut Viewer, ui: &mut Ui) {
    let button = ui.selectable_label(viewer.inspection.is_on, "anatomy");
    let button = button.on_hover_text("Key X: click a pixel to see its samples, and how it got its value");
    viewer.note("anatomy", button.rect);
    if button.clicked() {
        switch(viewer);
    }
}

/// Shows another direction.
pub(super) fn turn(viewer: &mut Viewer, by: i32) {
    if let Some(Ok(section)) = &viewer.inspection.found
        && section.directions > 0
    {
        let count = section.directions as i32;
        viewer.inspection.direction = (section.direction as i32 + by).rem_euclid(count) as u32;
        viewer.inspection.stale = true;
    }
}

/// Chooses the pixel at a point of the window.
pub(super) fn choose(viewer: &mut Viewer, area: Rect, at: Pos2) {
    if !viewer.inspection.is_on {
        return;
    }
    let share = (at - area.min) / area.size();
    let of = |share: f32, size: u32| ((f64::from(share) * f64::from(size)) as u32).min(size.saturating_sub(1));
    viewer.inspection.pixel = Some((of(share.x, viewer.size.0), of(1.0 - share.y, viewer.size.1)));
    viewer.inspection.stale = true;
}

/// The pixel, y up.
fn pixel(viewer: &Viewer) -> (u32, u32) {
    let (width, height) = viewer.size;
    let (x, y) = viewer.inspection.pixel.unwrap_or((width / 2, height / 2));
    (x.min(width.saturating_sub(1)), y.min(height.saturating_sub(1)))
}

/// Takes the pixel apart again if something has changed.
fn follow(viewer: &mut Viewer) {
    let side = std::mem::replace(&mut viewer.inspection.side, viewer.tab);
    if !std::mem::take(&mut viewer.inspection.stale) && side == viewer.tab {
        return;
    }
    viewer.inspection.found = None;
    let at = pixel(viewer);
    let Some(drawn) = viewer.drawn.as_ref().filter(|_| viewer.inspection.is_on) else { return };
    let side = drawn.sides.get(if drawn.sides.len() == 2 { viewer.tab } else { 0 });
    let Some(inspected) = side.and_then(|side| side.inspected.as_ref()) else { return };
    let section = Section::of(inspected, at, drawn.job.size, viewer.inspection.direction);
    viewer.inspection.found = Some(section);
}

/// Draws the samples over the image.
pub(super) fn paint(viewer: &Viewer, painter: &Painter, area: Rect) {
    let Some(found) = viewer.inspection.found.as_ref().filter(|_| viewer.inspection.is_on) else { return };
    let Ok(section) = found else {
        let (x, y) = pixel(viewer);
        let share = vec2((x as f32 + 0.5) / viewer.size.0 as f32, 1.0 - (y as f32 + 0.5) / viewer.size.1 as f32);
        return plot::mark(painter, area.min + share * area.size(), 5.0, Kind::Ignored);
    };
    let texel = vec2(area.width() / section.texels.0 as f32, area.height() / section.texels.1 as f32);
    let middle = dvec2(section.texel.0 as f64 + 0.5, section.texel.1 as f64 + 0.5);
    let at = |offset: DVec2| {
        let place = middle + offset;
        pos2(area.left() + place.x as f32 * texel.x, area.bottom() - place.y as f32 * texel.y)
    };
    let centre = at(DVec2::ZERO);
    let radius = section.start.radius_px;
    if radius != DVec2::ZERO {
        let circle = (0..=96).map(|i| at(radius * DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 96.0)));
        let circle: Vec<Pos2> = circle.collect();
        for (width, colour) in [(3.0, Color32::BLACK), (1.2, Color32::WHITE)] {
            painter.add(Shape::line(circle.clone(), Stroke::new(width, colour)));
        }
    }
    if let Some(cut) = &section.cut {
        let end = at(cut.slice.direction * radius);
        painter.line_segment([centre, end], Stroke::new(3.5, Color32::BLACK));
        painter.line_segment([centre, end], Stroke::new(1.8, Color32::YELLOW));
    }
    for mark in &section.marks {
        plot::mark(painter, at(mark.at), if mark.is_shown { 5.0 } else { 2.6 }, mark.kind);
    }
    painter.circle(centre, 4.0, Color32::WHITE, Stroke::new(1.5, Color32::BLACK));
}

/// Shows the window with the numbers and the slice.
pub(super) fn window(viewer: &mut Viewer, context: &egui::Context) {
    follow(viewer);
    if !viewer.inspection.is_on {
        return;
    }
    let mut open = true;
    let height = context.content_rect().height();
    let window = egui::Window::new("Anatomy of a pixel").open(&mut open).resizable(false).default_pos([10.0, 40.0]);
    let shown = window.show(context, |ui| {
        ui.set_width(WIDTH);
        ScrollArea::vertical()
            .max_height(height - 120.0)
            .min_scrolled_height(height - 120.0)
            .show(ui, |ui| contents(viewer, ui));
    });
    if let Some(shown) = shown {
        viewer.note("anatomy window", shown.response.rect);
    }
    if !open {
        switch(viewer);
    }
}

fn contents(viewer: &mut Viewer, ui: &mut Ui) {
    let (x, y) = pixel(viewer);
    let top = viewer.size.1 - 1 - y.min(viewer.size.1 - 1);
    let place = format!("Pixel x {x}, y {top} from the top left");
    let section = match viewer.inspection.found.take() {
        Some(Ok(section)) => section,
        Some(Err(why)) => {
            ui.strong(place);
            ui.label(&why);
            viewer.inspection.found = Some(Err(why));
            return;
        }
        None => {
            ui.label("Rendering ...");
            return;
        }
    };
    ui.strong(format!("{place}, by {}", section.method.name()));
    summary(ui, &section);
    directions(viewer, ui, &section);
    if let (Some(cut), Some(radius)) = (&section.cut, section.radius) {
        let rect = plot::show(ui, cut, radius);
        viewer.note("anatomy plot", rect);
    }
    if section.directions > 0 {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for (kind, text) in legend(section.method) {
                plot::legend(ui, kind, text);
            }
            if section.cut.is_some() {
                plot::legend_line(ui, SURFACE, "depth image");
                plot::legend_line(ui, BLUE, "tangent t");
                plot::legend_line(ui, RED, "horizon h");
            }
        });
    }
    if section.cut.is_some() {
        samples(ui, &section);
    }
    viewer.inspection.found = Some(Ok(section));
}

/// What the marks mean for a method.
fn legend(method: Method) -> [(Kind, &'static str); 4] {
    let [occludes, open, beyond, ignored] = match method {
        Method::RayMarch => ["stops a ray", "free", "beyond R", "own texel or background"],
        Method::Ssao => ["hidden point", "open point", "out of the depth range", "ignored"],
        _ => ["raises h", "below h", "beyond R", "own texel or background"],
    };
    [(Kind::Occludes, occludes), (Kind::Open, open), (Kind::Beyond, beyond), (Kind::Ignored, ignored)]
}

/// The numbers of the pixel as a whole.
fn summary(ui: &mut Ui, section: &Section) {
    let start = &section.start;
    let shader = section.shader.map_or(String::new(), |a| format!(", {a:.4} shader"));
    ui.label(format!("A before the blur: {:.4} float64 twin{shader}", section.twin));
    let [nx, ny, nz] = start.normal.to_array();
    ui.label(format!("depth z = {} scene units, normal ({nx:.2}, {ny:.2}, {nz:.2})", short(start.P.z)));
    if let Some(radius) = section.radius.filter(|_| start.radius_px != DVec2::ZERO) {
        let [x, y] = start.radius_px.to_array();
        let [step, _] = start.step_px.to_array();
        let steps = start.steps;
        ui.label(format!("R = {} scene units = {x:.1} x {y:.1} texels; {steps} steps of {step:.1}", short(radius)));
    }
    if section.cut.is_some() {
        let [cos, sin, b] = start.jitter;
        let angle = sin.atan2(cos).to_degrees();
        ui.label(format!("jitter: directions turned by {angle:.1}°, samples {b:.2} steps farther"));
    }
    if start.exits_early {
        let text =
            "The method exits early here: A = 1 whatever the samples say, because its steps are shorter than a texel.";
        ui.label(RichText::new(text).color(Color32::from_rgb(255, 180, 60)));
    }
    if section.directions == 0 {
        ui.label(format!(
            "The anatomy of {} is not shown: it looks for no horizon, marches no rays and compares no points.",
            section.method.name()
        ));
    }
    let sum: f64 = section.occlusions.iter().sum();
    match section.method {
        Method::Ssao if section.directions > 0 => {
            let open = section.marks.iter().filter(|mark| mark.kind == Kind::Open).count();
            ui.label(format!(
                "{open} of {} points are open, that is, in front of the depth image",
                section.marks.len()
            ));
        }
        Method::RayMarch => {
            ui.label(format!("{sum:.4} of {} rays are stopped, each counted by its W", section.rays));
        }
        _ if section.directions > 0 && !start.exits_early => {
            let (count, strength) = (section.directions, section.strength);
            let a = (1.0 - sum * strength / f64::from(count)).clamp(0.0, 1.0);
            let sum = rounded(sum, 4);
            ui.label(format!("A = 1 - {strength:.2}/{count} x {sum}, the sum over the directions, = {a:.4}"));
        }
        _ => {}
    }
}

/// The choice of the direction.
fn directions(viewer: &mut Viewer, ui: &mut Ui, section: &Section) {
    if section.directions < 2 {
        return;
    }
    ui.horizontal(|ui| {
        ui.label(if section.method == Method::RayMarch { "azimuth" } else { "direction" });
        let mut shown = section.direction + 1;
        for (name, by) in [("[", -1), ("]", 1)] {
            let button = ui.button(name).on_hover_text("Keys [ and ]");
            viewer.note(format!("anatomy {name}"), button.rect);
            if button.clicked() {
                shown = (section.direction as i32 + by).rem_euclid(section.directions as i32) as u32 + 1;
            }
        }
        let drag = ui.add(DragValue::new(&mut shown).range(1..=section.directions));
        viewer.note("anatomy direction", drag.rect);
        let adds = section.occlusions.get(section.direction as usize).copied().unwrap_or(0.0);
        ui.label(format!("of {}; it adds {}", section.directions, rounded(adds, 4)));
        if shown != section.direction + 1 {
            viewer.inspection.direction = shown - 1;
            viewer.inspection.stale = true;
            ui.ctx().request_repaint();
        }
    });
}

/// The samples of the direction in a table.
fn samples(ui: &mut Ui, section: &Section) {
    let (Some(cut), Some(radius)) = (&section.cut, section.radius) else { return };
    let heads = [
        ("i", "The number of the sample"),
        ("|D|/R", "The distance from P, in units of R"),
        ("phi", "The elevation of the sample"),
        ("t", "The tangent that it is measured from"),
        ("W", "The attenuation"),
        ("adds", "What it adds to the occlusion of the direction"),
        ("", ""),
    ];
    ui.separator();
    Grid::new("samples").striped(true).num_columns(heads.len()).spacing([10.0, 1.0]).min_col_width(24.0).show(
        ui,
        |ui| {
            for (head, help) in heads {
                ui.strong(head).on_hover_text(help);
            }
            ui.end_row();
            for sample in &cut.slice.samples {
                ui.label(sample.index.to_string());
                match &sample.found {
                    Some(found) => {
                        ui.label(format!("{:.3}", found.D.length() / radius));
                        ui.label(degrees(found.sin_phi));
                        ui.label(degrees(found.sin_t));
                        ui.label(if sample.fate == Fate::BeyondRadius {
                            "-".into()
                        } else {
                            format!("{:.3}", found.weight)
                        });
                    }
                    None => (0..4).for_each(|_| drop(ui.label("-"))),
                }
                ui.label(rounded(sample.contribution, 4));
                ui.label(in_words(sample.fate));
                ui.end_row();
            }
        },
    );
}

fn in_words(fate: Fate) -> &'static str {
    match fate {
        Fate::OwnTexel => "own texel",
        Fate::Background => "background",
        Fate::BeyondRadius => "beyond R",
        Fate::BelowHorizon => "below h",
        Fate::Raises => "raises h",
    }
}

/// What the log holds of it.
pub(super) fn log(viewer: &Viewer) -> Value {
    if !viewer.inspection.is_on {
        return Value::Null;
    }
    let (x, y) = pixel(viewer);
    let pixel = [x, viewer.size.1 - 1 - y.min(viewer.size.1 - 1)];
    let section = match &viewer.inspection.found {
        Some(Ok(section)) => section,
        Some(Err(why)) => return json!({ "pixel": pixel, "message": why }),
        None => return json!({ "pixel": pixel }),
    };
    let samples = section.cut.iter().flat_map(|cut| &cut.slice.samples);
    let samples = samples.map(|sample| json!([sample.index, in_words(sample.fate), sample.contribution]));
    json!({
        "pixel": pixel,
        "method": section.method.name(),
        "twin": section.twin,
        "shader": section.shader,
        "exits": section.start.exits_early,
        "direction": section.direction,
        "occlusions": section.occlusions,
        "samples": samples.collect::<Vec<_>>(),
        "marks": section.marks.len(),
    })
}
