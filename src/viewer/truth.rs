//! The ray-traced truth of the view on the screen: its switch, its image, and the errors of the sides against it.

use super::anatomy;
use super::label::{divide, label};
use super::state::{Compare, UPRIGHT, Viewer, color_image};
use super::tracing::{Look, RAYS_OF_PASS, Tracing, Wanted};
use crate::heat::{self, HEAT};
use crate::picture::{self, byte};
use eframe::egui::{self, Align2, Color32, Painter, ProgressBar, Rect, TextureOptions, Ui, pos2, vec2};
use hbao::image::Image;
use hbao::measure::errors::{Comparison, Errors, too_noisy};
use hbao::settings::Settings;
use serde_json::{Value, json};

const LOOKS: [(Look, &str, &str); 5] = [
    (Look::Off, "off", "Traces nothing"),
    (Look::Numbers, "numbers", "Shows ambient occlusion, and its errors in numbers"),
    (Look::Beside, "beside", "The image to the left of the divider, the truth to its right"),
    (Look::Alone, "alone", "Shows the truth"),
    (
        Look::Error,
        "error",
        "Shows where ambient occlusion differs from the truth, in the colours of hbao compare --heat",
    ),
];

/// The numbers of rays that can be chosen.
const RAYS: [u32; 5] = [64, 256, 1024, 4096, 16384];

/// The colour of the background in a map of errors.
const NOTHING: u8 = 48;

/// The switch, and what is known so far.
pub(super) fn panel(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label("truth").on_hover_text(
            "Ray-traced ambient occlusion of this view, with the radius and the attenuation of the side in the panel, as \
             hbao truth computes it. Key G goes through the choices.",
        );
        for (look, name, help) in LOOKS {
            let button = ui.selectable_label(viewer.truth.look == look, name).on_hover_text(help);
            viewer.note(format!("truth {name}"), button.rect);
            if button.clicked() {
                choose(viewer, look);
            }
        }
        ui.separator();
        anatomy::button(viewer, ui);
    });
    if viewer.truth.look == Look::Off {
        return;
    }
    ui.horizontal(|ui| {
        ui.label("rays").on_hover_text("How many rays each pixel gets");
        for rays in RAYS {
            let button = ui.selectable_value(&mut viewer.truth.rays, rays, rays.to_string());
            viewer.note(format!("truth {rays} rays"), button.rect);
        }
    });
    let bar = ProgressBar::new(progress(viewer) as f32).desired_width(ui.available_width() - 8.0);
    let bar = ui.add(bar.text(how_far(viewer)));
    viewer.note("truth progress", bar.rect);
    for line in in_words(viewer) {
        ui.label(line).on_hover_text(
            "RMSE: the root of the mean squared difference of ambient occlusion from the truth, over all pixels that show \
             a surface; 0 is exact. Bias: the mean difference, above 0 where the image is too light. Noise: the part of the \
             error that comes from the truth's own rays.",
        );
    }
}

/// Goes on to the next way to look at the truth.
pub(super) fn next(viewer: &mut Viewer) {
    let at = LOOKS.iter().position(|(look, ..)| *look == viewer.truth.look).unwrap_or(0);
    choose(viewer, LOOKS[(at + 1) % LOOKS.len()].0);
}

fn choose(viewer: &mut Viewer, look: Look) {
    // Beside the truth, which is visibility, other images say little.
    if viewer.truth.look == Look::Off && !viewer.show.0.starts_with("ao") {
        viewer.truth.before = Some(viewer.show);
        viewer.show = picture::names().find(|(name, _)| *name == "ao").unwrap_or(viewer.show);
        viewer.said = "The image is ao now, which can be compared with the truth.".into();
    }
    if look == Look::Off
        && let Some(before) = viewer.truth.before.take()
        && viewer.show.0 == "ao"
    {
        viewer.show = before;
        viewer.said.clear();
    }
    viewer.truth.look = look;
    viewer.truth.stale = true;
}

/// The share of the work that is done.
fn progress(viewer: &Viewer) -> f64 {
    let (Some(tracing), Some(wanted)) = (&viewer.truth.tracing, &viewer.truth.wanted) else { return 0.0 };
    let pixels = f64::from(wanted.size.0) * f64::from(wanted.size.1);
    (tracing.done() as f64 / (pixels * f64::from(wanted.rays / RAYS_OF_PASS))).min(1.0)
}

fn how_far(viewer: &Viewer) -> String {
    match &viewer.truth.refined {
        _ if viewer.truth.wanted.is_none() => "begins when nothing moves".into(),
        None => "preparing the scene".into(),
        Some(refined) if refined.rays == 0 => "first look".into(),
        Some(refined) => format!("{} rays, {:.1} s", refined.rays, refined.seconds),
    }
}

/// The errors in words, one line for each side.
fn in_words(viewer: &Viewer) -> Vec<String> {
    let Some(refined) = viewer.truth.refined.as_ref().filter(|refined| refined.rays > 0) else {
        return vec!["The errors follow once every pixel was traced.".into(), String::new()];
    };
    let line = |(name, error): (&&str, &Result<Errors, String>)| match error {
        Ok(Errors { rmse, bias, .. }) => format!("{name}: RMSE {rmse:.4}, bias {bias:+.4}"),
        Err(why) => format!("{name}: {why}"),
    };
    let errors = &viewer.truth.errors;
    let noisy = errors.iter().flatten().any(|errors| too_noisy(refined.noise, errors.rmse));
    let noisy = if noisy { ", more than a fifth of an error yet" } else { "" };
    let noise = format!("Noise of the truth: {:.4}{noisy}", refined.noise);
    viewer.side_names().iter().zip(errors).map(line).chain([noise]).collect()
}

/// Has the truth of the view on the screen traced, or gives it up if the view is another one now, and takes what is
/// known so far.
pub(super) fn follow(viewer: &mut Viewer, moving: bool, context: &egui::Context) {
    let settings = viewer.settings();
    let settings = Settings { radius: settings.radius, attenuation: settings.attenuation, ..Settings::default() };
    let wanted = Wanted {
        scene: viewer.scene.clone(),
        view: viewer.eye.view(),
        size: viewer.size,
        settings,
        rays: viewer.truth.rays,
    };
    let is_on = viewer.truth.look != Look::Off;
    if viewer.truth.wanted.as_ref().is_some_and(|earlier| !is_on || !earlier.same(&wanted)) {
        viewer.truth.tracing.iter().for_each(Tracing::cancel);
        (viewer.truth.wanted, viewer.truth.refined, viewer.truth.stale) = (None, None, true);
    }
    let settled = viewer.is_current() && viewer.drawn.as_ref().is_some_and(|drawn| drawn.job.divisor == 1);
    if is_on && viewer.truth.wanted.is_none() && settled && !moving {
        if viewer.truth.tracing.is_none() {
            match Tracing::start(context) {
                Ok(tracing) => viewer.truth.tracing = Some(tracing),
                Err(error) => {
                    (viewer.truth.look, viewer.message) = (Look::Off, Some(error.to_string()));
                    return;
                }
            }
        }
        viewer.truth.tracing.iter().for_each(|tracing| tracing.order(wanted.clone()));
        viewer.truth.wanted = Some(wanted);
    }
    match viewer.truth.tracing.as_ref().and_then(Tracing::result) {
        Some(Ok(refined)) => (viewer.truth.refined, viewer.truth.stale) = (Some(refined), true),
        Some(Err(error)) => (viewer.truth.look, viewer.message) = (Look::Off, Some(error.to_string())),
        None => {}
    }
    if std::mem::take(&mut viewer.truth.stale) {
        measure(viewer, context);
        context.request_repaint();
    }
}

/// Compares the sides on the screen with what is known so far, and makes the images of that.
fn measure(viewer: &mut Viewer, context: &egui::Context) {
    viewer.truth.errors.clear();
    viewer.truth.heats.clear();
    let Some(refined) = viewer.truth.refined.clone() else {
        viewer.truth.texture = None;
        return;
    };
    let load =
        |name: String, image: &Image<[u8; 3]>| context.load_texture(name, color_image(image), TextureOptions::NEAREST);
    viewer.truth.texture = Some(load("truth".into(), &refined.visibility.map(|a| [byte(a); 3])));
    let Some(drawn) = viewer.drawn.as_ref().filter(|drawn| drawn.job.divisor == 1) else { return };
    for (at, side) in drawn.sides.iter().enumerate() {
        let Some(ao) = &side.ao else { continue };
        if (ao.width, ao.height) != (refined.visibility.width, refined.visibility.height) {
            let half = "half resolution without a blur is not compared";
            viewer.truth.errors.push(Err(half.into()));
            continue;
        }
        let errors = Comparison::without_flip(ao, &refined.visibility).and_then(|all| all.over(&refined.covered));
        let errors = errors.and_then(|errors| errors.ok_or_else(Errors::of_nothing));
        viewer.truth.errors.push(errors.map_err(|error| error.to_string()));
        if viewer.truth.look == Look::Error {
            let colours = Image::from_fn(ao.width, ao.height, |x, y| match refined.covered.at(x, y) {
                true => heat::colour(f64::from(ao.at(x, y) - refined.visibility.at(x, y)).abs()),
                false => [NOTHING; 3],
            });
            viewer.truth.heats.push(load(format!("error {at}"), &colours));
        }
    }
}

/// Whether the divider has the truth on its right, or the errors of both sides.
pub(super) fn splits(viewer: &Viewer) -> bool {
    viewer.truth.look == Look::Beside || (viewer.truth.look == Look::Error && viewer.truth.heats.len() == 2)
}

/// Paints the truth or the errors over the image, as far as they are known.
pub(super) fn paint(viewer: &Viewer, painter: &Painter, area: Rect) {
    let truth = &viewer.truth;
    let corner = area.left_top() + vec2(8.0, 8.0);
    if !matches!(truth.look, Look::Beside | Look::Alone | Look::Error) {
        return;
    }
    let (Some(refined), Some(texture)) = (&truth.refined, &truth.texture) else {
        label(
            painter,
            area.left_bottom() + vec2(8.0, -8.0),
            Align2::LEFT_BOTTOM,
            "The truth is traced once nothing moves",
        );
        return;
    };
    let image = |painter: &Painter, texture| painter.image(texture, area, UPRIGHT, Color32::WHITE);
    let x = area.left() + viewer.divider * area.width();
    let right = painter.with_clip_rect(Rect::from_min_max(pos2(x, area.top()), area.max));
    let name = match refined.rays {
        0 => "truth, first look".into(),
        rays => format!("truth, {rays} rays"),
    };
    match truth.look {
        Look::Alone => {
            image(painter, texture.id());
            label(painter, corner, Align2::LEFT_TOP, &name);
        }
        Look::Beside => {
            let at = if viewer.textures.len() == 2 { viewer.tab } else { 0 };
            let Some(side) = viewer.textures.get(at) else { return };
            image(painter, side.id());
            image(&right, texture.id());
            divide(painter, x, area, [["A", "B"][viewer.tab], &name]);
        }
        _ => {
            let names = viewer.side_names().map(|name| format!("error of {name}"));
            match (truth.heats.as_slice(), viewer.compare) {
                ([a, b], compare) if compare != Compare::One => {
                    image(painter, a.id());
                    image(&right, b.id());
                    divide(painter, x, area, names.each_ref().map(String::as_str));
                }
                ([first, ..], _) => {
                    image(painter, first.id());
                    label(painter, corner, Align2::LEFT_TOP, &names[0]);
                }
                _ => {}
            }
            colours(painter, area);
        }
    }
}

/// Says what the colours of the errors mean.
fn colours(painter: &Painter, area: Rect) {
    let mut at = area.left_bottom() + vec2(8.0, -8.0);
    let mut below = "0".to_string();
    for (most, [r, g, b]) in HEAT {
        let text = match most {
            0.0 => "0".into(),
            f64::MAX => format!("more than {below}"),
            most => format!("up to {most}/255"),
        };
        below = format!("{most}/255");
        let rect = label(painter, at + vec2(20.0, 0.0), Align2::LEFT_BOTTOM, &text);
        let swatch = Rect::from_min_max(pos2(at.x - 2.0, rect.top()), pos2(at.x + 14.0, rect.bottom()));
        painter.rect_filled(swatch, 2.0, Color32::from_rgb(r, g, b));
        painter.rect_stroke(swatch, 2.0, egui::Stroke::new(1.0, Color32::WHITE), egui::StrokeKind::Outside);
        at.x = rect.right() + 14.0;
    }
}

/// What the log holds of it.
pub(super) fn log(viewer: &Viewer) -> Value {
    let truth = &viewer.truth;
    let name = LOOKS.iter().find(|(look, ..)| *look == truth.look).map_or("", |(_, name, _)| name);
    let known = truth.refined.as_ref().map(|refined| {
        let covered = refined.covered.texels.iter().filter(|&&covered| covered).count();
        json!({ "rays": refined.rays, "noise": refined.noise, "covered": covered, "seconds": refined.seconds })
    });
    let rmse = |errors: &Result<Errors, String>| errors.as_ref().ok().map(|errors| errors.rmse);
    json!({
        "look": name,
        "of": truth.rays,
        "tracing": truth.wanted.is_some() && progress(viewer) < 1.0,
        "progress": progress(viewer),
        "known": known,
        "rmse": truth.errors.iter().map(rmse).collect::<Vec<_>>(),
        "words": if truth.look == Look::Off { Vec::new() } else { in_words(viewer) },
    })
}
