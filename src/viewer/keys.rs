//! The keys, each with what it does, from which the list that `?` shows is made.

use super::anatomy;
use super::state::{Compare, Viewer};
use super::truth;
use eframe::egui::{self, Key, Modifiers};

/// What a key does at once.
type Act = fn(&mut Viewer, &egui::Context);

/// A key that acts once when it is pressed.
struct Row {
    key: Key,
    /// How the list names the key.
    name: &'static str,
    help: &'static str,
    act: Act,
}

const fn row(key: Key, name: &'static str, help: &'static str, act: Act) -> Row {
    Row { key, name, help, act }
}

static ROWS: &[Row] = &[
    row(Key::R, "R", "Put the camera back to where it was at the start", |viewer, _| viewer.reset()),
    row(Key::F, "F", "Frame the whole scene", |viewer, _| viewer.frame_all()),
    row(Key::P, "P", "Change between a perspective and an orthographic view", |viewer, _| {
        viewer.eye.change_projection();
    }),
    row(Key::C, "C", "Compare: one side, A beside B, or their difference", |viewer, _| {
        viewer.compare = viewer.compare.next();
    }),
    row(Key::B, "B", "Change to the settings of the other side", |viewer, _| viewer.tab = 1 - viewer.tab),
    row(Key::M, "M", "Magnify the pixels under the pointer and show their values", |viewer, _| {
        viewer.magnified = !viewer.magnified;
    }),
    row(Key::G, "G", "Ray-traced truth: off, in numbers, beside the image, alone, its errors", |viewer, _| {
        truth::next(viewer);
    }),
    row(Key::X, "X", "Take the clicked pixel apart: directions, samples, what each adds", |viewer, _| {
        anatomy::switch(viewer);
    }),
    row(Key::OpenBracket, "[", "Show the previous direction of that pixel", |viewer, _| anatomy::turn(viewer, -1)),
    row(Key::CloseBracket, "]", "Show the next direction of that pixel", |viewer, _| anatomy::turn(viewer, 1)),
    row(Key::T, "T", "Measure the time of each pass", |viewer, _| viewer.timed = !viewer.timed),
    row(Key::V, "V", "Show or hide error against time", |viewer, _| viewer.sweep_shown = !viewer.sweep_shown),
    row(Key::Y, "Y", "Copy the command that renders this image", |viewer, context| {
        context.copy_text(viewer.command());
        viewer.said = "The command was copied.".into();
    }),
    row(Key::Questionmark, "?", "Show or hide this list", |viewer, _| viewer.keys_shown = !viewer.keys_shown),
    row(Key::Escape, "Esc", "Close this list, and the message of an error", |viewer, _| {
        viewer.keys_shown = false;
        viewer.message = None;
    }),
];

/// What else there is to press.
const OTHERS: [(&str, &str); 8] = [
    ("1 to 8", "Choose the image: final, ao, ao-raw, color, depth, normals, edges, exits"),
    ("W S A D E Q", "Fly forward, backward, left, right, up, down, while held; faster with Shift"),
    ("left drag", "Turn the scene about the camera's target; with Shift, look around"),
    ("right drag", "Move the camera sideways; so does a drag with the middle button"),
    ("wheel", "Move towards the target, or show less in an orthographic view"),
    ("Tab, arrows", "Go through the panel, and change what is chosen there"),
    ("Ctrl S", "Save the image"),
    ("Ctrl Q", "Close the window"),
];

/// The keys of the images, in the order of `--show`.
const DIGITS: [Key; 8] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8];

/// The keys that fly, with the direction of each: right, up, forward.
const FLY: [(Key, [f64; 3]); 6] = [
    (Key::D, [1.0, 0.0, 0.0]),
    (Key::A, [-1.0, 0.0, 0.0]),
    (Key::E, [0.0, 1.0, 0.0]),
    (Key::Q, [0.0, -1.0, 0.0]),
    (Key::W, [0.0, 0.0, 1.0]),
    (Key::S, [0.0, 0.0, -1.0]),
];

/// How far a key flies in a second, in distances between the eye and its target.
const SPEED: f64 = 0.4;
/// The longest time between two frames for which flying makes up, in seconds.
const LONGEST_STEP: f64 = 0.1;

/// Does what the pressed keys say, unless a text is being written. Returns whether the camera flies.
pub(super) fn act(viewer: &mut Viewer, context: &egui::Context) -> bool {
    if context.input(|input| input.modifiers.command && input.key_pressed(Key::S)) {
        viewer.save_image();
    }
    if context.input(|input| input.modifiers.command && input.key_pressed(Key::Q)) {
        context.send_viewport_cmd(egui::ViewportCommand::Close);
    }
    if context.text_edit_focused() || context.input(|input| input.modifiers.command || input.modifiers.alt) {
        return false;
    }
    for row in ROWS {
        if context.input(|input| input.key_pressed(row.key)) {
            (row.act)(viewer, context);
        }
    }
    // Where ? is typed with Shift, some systems report a slash.
    if context.input_mut(|input| input.consume_key(Modifiers::SHIFT, Key::Slash)) {
        viewer.keys_shown = !viewer.keys_shown;
    }
    for (show, key) in DIGITS.into_iter().enumerate() {
        if context.input(|input| input.key_pressed(key)) {
            viewer.choose_image(show);
        }
    }
    let (step, fast) = context.input(|input| (f64::from(input.stable_dt), input.modifiers.shift));
    let step = step.min(LONGEST_STEP) * SPEED * if fast { 4.0 } else { 1.0 };
    let held = FLY.iter().filter(|(key, _)| context.input(|input| input.key_down(*key)));
    let way = held.fold([0.0; 3], |[x, y, z], (_, [dx, dy, dz])| [x + dx, y + dy, z + dz]);
    if way == [0.0; 3] {
        return false;
    }
    viewer.eye.fly(way.map(|part| part * step));
    context.request_repaint();
    true
}

/// Shows the list of keys.
pub(super) fn list(viewer: &mut Viewer, context: &egui::Context) {
    let mut shown = viewer.keys_shown;
    let window = egui::Window::new("Keys").collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).open(&mut shown).show(context, |ui| {
        egui::Grid::new("keys").num_columns(2).spacing([24.0, 6.0]).show(ui, |ui| {
            let rows = OTHERS.into_iter().chain(ROWS.iter().map(|row| (row.name, row.help)));
            for (name, help) in rows {
                ui.strong(name);
                ui.label(help);
                ui.end_row();
            }
        });
    });
    viewer.keys_shown = shown;
}

impl Compare {
    /// The next way to compare.
    fn next(self) -> Compare {
        match self {
            Compare::One => Compare::Split,
            Compare::Split => Compare::Difference,
            Compare::Difference => Compare::One,
        }
    }
}
