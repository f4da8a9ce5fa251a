//! What moves the camera and the divider, the size of the window, and the images that are saved.

use crate::{Window, by_the_command};
use serde_json::{Value, json};

/// The numbers of one of the camera's flags in the command of a frame.
fn flag(frame: &Value, name: &str) -> Vec<f64> {
    let command = frame["command"].as_str().unwrap();
    let mut words = command.split(' ').skip_while(|word| *word != name).skip(1);
    words.next().unwrap().split(',').map(|number| number.parse().unwrap()).collect()
}

/// By how much the eye and the target have moved from one frame to another.
fn moved(from: &Value, to: &Value) -> [Vec<f64>; 2] {
    let difference = |name: &str| flag(to, name).iter().zip(flag(from, name)).map(|(to, from)| to - from).collect();
    ["--eye", "--target"].map(difference)
}

fn assert_near(a: &[f64], b: &[f64]) {
    assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02), "{a:?} {b:?}");
}

#[test]
fn a_drag_with_the_right_or_the_middle_button_moves_the_camera_sideways() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    for button in [3, 2] {
        window.drag_by(button, "image", [0.5, 0.5], [0.6, 0.4]);
        let panned = window.settled(|line| line["command"] != first["command"]);
        // The camera of the box looks along z, and its right is -x. The scene follows the pointer to the right and up.
        let [eye, target] = moved(&first, &panned);
        assert_near(&eye, &target);
        assert!(eye[0] > 1.0 && eye[1] < -1.0 && eye[2] == 0.0, "{eye:?}");
        assert_ne!(panned["image"]["hash"], first["image"]["hash"]);
        window.xdotool("key r");
        window.settled(|line| line["command"] == first["command"]);
    }
    window.close();
}

#[test]
fn the_wheel_moves_towards_the_target_and_back() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    let middle = window.point("image", [0.5, 0.5]);
    window.xdotool(&format!("mousemove {middle} click 4 click 4"));
    let near = window.settled(|line| line["command"] != first["command"]);
    let [eye, target] = moved(&first, &near);
    assert!(eye[2] > 1.0 && target == [0.0; 3], "{eye:?} {target:?}");
    // The wheel moves smoothly, in some frames.
    window.xdotool("click 5 click 5 click 5 click 5");
    window.settled(|line| moved(&first, line)[0][2] < -1.0);
    // Over the panel it moves nothing.
    window.xdotool("key r");
    let reset = window.settled(|line| line["command"] == first["command"]);
    let panel = window.point("knob radius", [0.5, 0.5]);
    window.xdotool(&format!("mousemove {panel} click 5 click 5"));
    let scrolled = window.settled(|line| line["widgets"]["knob radius"] != reset["widgets"]["knob radius"]);
    assert_eq!(scrolled["command"], first["command"]);
    window.close();
}

#[test]
fn each_key_of_flight_moves_the_camera_its_own_way() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    // The camera of the box looks along z, and its right is -x.
    let ways = [("w", 2, 1.0), ("s", 2, -1.0), ("d", 0, -1.0), ("a", 0, 1.0), ("e", 1, 1.0), ("q", 1, -1.0)];
    for (key, axis, sign) in ways {
        window.xdotool(&format!("keydown {key} sleep 0.2 keyup {key}"));
        let flown = window.settled(|line| line["command"] != first["command"]);
        let [eye, target] = moved(&first, &flown);
        assert_near(&eye, &target);
        for (at, by) in eye.iter().enumerate() {
            assert!(if at == axis { by * sign > 1.0 } else { by.abs() < 0.02 }, "{key}: {eye:?}");
        }
        window.xdotool("key r");
        window.settled(|line| line["command"] == first["command"]);
    }
    window.close();
}

#[test]
fn a_drag_of_the_divider_moves_it_and_not_the_camera() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    window.xdotool("key c");
    window.settled(|line| line["image"]["sides"] == 2 && line["widgets"]["divider"].is_array());
    let share = |line: &Value| {
        let [image, divider] = ["image", "divider"].map(|name| line["widgets"][name].clone());
        let number = |rectangle: &Value, at: usize| rectangle[at].as_f64().unwrap();
        (number(&divider, 0) + number(&divider, 2) / 2.0 - number(&image, 0)) / number(&image, 2)
    };
    window.drag("image", [0.5, 0.5], [0.2, 0.6]);
    let dragged = window.settled(|line| (share(line) - 0.2).abs() < 0.02);
    assert_eq!(dragged["command"], first["command"]);
    // It stays inside the image.
    window.drag("image", [0.2, 0.5], [0.0, 0.5]);
    window.settled(|line| (0.0..0.05).contains(&share(line)));
    window.close();
}

#[test]
fn the_image_fills_a_window_of_another_size() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    let size = |line: &Value| [0, 1].map(|at| line["image"]["size"][at].as_i64().unwrap());
    let (mut earlier, mut besides) = (size(&first), Vec::new());
    for (width, height) in [(1000, 500), (660, 700)] {
        window.xdotool(&format!("search --onlyvisible --name hbao windowsize {width} {height}"));
        let resized = window.settled(|line| {
            let (size, place) = (size(line), &line["widgets"]["image"]);
            size != earlier && [2, 3].map(|at| place[at].as_f64().unwrap()) == size.map(|side| side as f64)
        });
        earlier = size(&resized);
        let flag = format!("--size {}x{} ", earlier[0], earlier[1]);
        assert!(resized["command"].as_str().unwrap().contains(&flag), "{flag}");
        besides.push([width - earlier[0], height - earlier[1]]);
    }
    // What is beside and below the image stays as large as it was.
    assert_eq!(besides[0], besides[1]);
    window.close();
}

#[test]
fn a_saved_exr_is_that_of_the_command() {
    let Some(mut window) = Window::open("--method ssao --msaa 1") else { return };
    window.xdotool("key 3");
    window.settled(|line| line["show"] == "ao-raw");
    window.write("field save image", "raw.exr");
    let shown = window.settled(|line| line["command"].as_str().unwrap().contains("-o raw.exr"));
    window.click("save image");
    window.wait(|line| line["said"] == json!("The image was saved as raw.exr."));
    let saved = std::fs::read(window.path("raw.exr")).unwrap();
    assert_eq!(saved, by_the_command(&shown, "raw.exr"), "{}", shown["command"]);
    window.close();
}
