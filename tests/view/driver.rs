//! What the drivers say of the window and of the thread that renders, and drivers that have too little.

use crate::rig::command::{hbao, with_shader_cache};
use crate::{Display, Window};
use serde_json::Value;
use std::collections::BTreeSet;

/// How many frames are watched.
const FRAMES: usize = 500;

/// The images, in the order of their keys.
const SHOWS: [&str; 7] = ["final", "ao", "ao-raw", "color", "depth", "normals", "edges"];

/// All complaints in the log.
fn complaints(lines: &[Value]) -> Vec<String> {
    let of = |line: &Value| -> Vec<String> {
        let list = line["gl"].as_array().unwrap_or_else(|| panic!("no driver is heard: {line}"));
        list.iter().map(Value::to_string).collect()
    };
    lines.iter().flat_map(of).collect()
}

#[test]
fn no_driver_complains_in_500_frames_of_all_that_the_window_does() {
    let Some(mut window) = Window::open("--method hbao-view") else { return };
    let first = window.settled(|_| true);
    for round in 0.. {
        // Pointer, slider and divider; methods; images; A beside B and the difference; and sizes.
        window.drag("image", [0.4, 0.5], [0.6, 0.55]);
        window.drag("knob strength", [0.2, 0.5], [0.5, 0.5]);
        for (key, show) in (1..).zip(SHOWS) {
            window.xdotool(&format!("key {key}"));
            window.settled(|line| line["show"] == show);
        }
        window.xdotool("key 1 key c");
        window.drag("image", [0.5, 0.5], [0.3, 0.5]);
        window.xdotool("key --delay 40 b c c m t p p f keydown d sleep 0.3 keyup d");
        for preset in ["fast", "accurate", "default"] {
            window.click(&format!("preset {preset}"));
            window.settled(|_| true);
        }
        window.click("knob method");
        // The list of methods opens below its widget.
        let item = window.point("knob method", [0.3, 1.8 + 1.15 * (round % 6) as f64]);
        window.xdotool(&format!("sleep 0.3 mousemove {item} sleep 0.1 click 1 sleep 0.1"));
        let size = [(900, 640), (820, 590)][round % 2];
        window.xdotool(&format!("search --onlyvisible --name hbao windowsize {} {}", size.0, size.1));
        window.xdotool("key Escape");
        let last = window.settled(|_| true);
        if round > 2 && window.lines().len() >= FRAMES {
            assert_ne!(last["settings"], first["settings"]);
            break;
        }
    }
    let lines = window.lines();
    assert_eq!(complaints(&lines), Vec::<String>::new());
    let seen = |is: &dyn Fn(&Value) -> bool| lines.iter().any(is);
    assert!(seen(&|line| line["image"]["sides"] == 2));
    let method = |line: &Value| line["settings"][0].as_str().unwrap().lines().next().unwrap().to_string();
    let methods: BTreeSet<String> = lines.iter().map(method).collect();
    assert!(methods.len() > 2, "{methods:?}");
    window.close();
}

#[test]
fn an_error_in_either_context_is_heard() {
    for context in ["window", "render"] {
        let Some(mut window) = Window::open_with("", &[("HBAO_PLANT_GL_ERROR", context)]) else { return };
        window.settled(|_| true);
        let heard = complaints(&window.lines());
        let of_context = format!("\"{context}: high: GL_INVALID_ENUM");
        assert!(heard.len() == 1 && heard[0].starts_with(&of_context), "{heard:?}");
        window.close();
    }
}

/// What `hbao view` says on a display where it cannot open a window, in one line after that of its context.
fn refusal(display: &Display, variable: &str, value: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let mut program = hbao(folder.path(), "view");
    with_shader_cache(&mut program).env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    let output = program.env(variable, value).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{value}: {text}");
    let lines: Vec<&str> = text.lines().filter(|line| !line.contains(": llvmpipe")).collect();
    assert!(lines.len() == 1 && lines[0].contains("OpenGL 3.3"), "{value}: {text}");
    lines[0].into()
}

#[test]
fn a_driver_that_has_less_than_opengl_3_3_is_one_line() {
    let Some(display) = Display::start() else { return };
    for version in ["3.2", "2.1"] {
        let line = refusal(&display, "MESA_GL_VERSION_OVERRIDE", version);
        assert!(line.contains("unset MESA_GL_VERSION_OVERRIDE"), "{line}");
    }
}

#[test]
fn a_display_whose_driver_has_less_than_opengl_3_3_is_one_line() {
    // The thread that renders has another driver, which needs no display.
    let Some(display) = Display::start_with(&["+iglx"]) else { return };
    let line = refusal(&display, "LIBGL_ALWAYS_INDIRECT", "1");
    assert!(line.contains("no window can be opened") && line.contains("LIBGL_ALWAYS_SOFTWARE=1"), "{line}");
}
