//! What the images cost: the graph of times, the memory, and error against time.

use crate::{Window, written_by};
use serde_json::Value;

#[test]
fn the_graph_grows_with_frames_that_are_timed_and_then_the_window_rests() {
    let Some(mut window) = Window::open("--method ssao") else { return };
    let first = window.settled(|_| true);
    assert_eq!(first["timed_frames"], 0);
    // Depth, normals, colour, the depth buffer, the final image and the stencil have 4 bytes a pixel, and the images of
    // ambient occlusion 1.
    let bytes = |line: &Value| line["image"]["texture_bytes"][0].as_u64().unwrap();
    let pixels = 420 * 560;
    assert!((20 * pixels..40 * pixels).contains(&bytes(&first)), "{first}");
    window.xdotool("key t");
    window.settled(|line| line["widgets"]["times by GPU"].is_array());
    // Frames whose shaders are compiled are left out. A drag to and fro gives at least one other.
    let mut frames = 0;
    while frames < 3 {
        window.drag("image", [0.5, 0.3], [0.7, 0.35]);
        window.drag("image", [0.7, 0.35], [0.5, 0.3]);
        frames = window.settled(|_| true)["timed_frames"].as_u64().unwrap();
    }
    let turned = window.settled(|_| true);
    assert!(turned["widgets"]["graph A"].is_array() && turned["widgets"]["graph B"].is_null());
    window.xdotool("key c");
    let both = window.settled(|line| line["widgets"]["graph B"].is_array());
    assert_eq!(both["image"]["texture_bytes"].as_array().unwrap().len(), 2);
    window.click("times by GPU");
    // With nothing to do, there are no more frames.
    window.rest();
    window.xdotool("key t");
    window.settled(|line| line["widgets"]["graph A"].is_null());
    window.close();
}

#[test]
fn memory_follows_the_settings_of_the_side() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    let bytes = |line: &Value| line["image"]["texture_bytes"][0].as_u64().unwrap();
    window.xdotool("key b");
    window.settled(|line| line["tab"] == 1);
    // At half resolution, ambient occlusion has smaller images, but also depth of half the size and a second stencil.
    window.click("preset fast");
    let half = window.settled(|line| line["settings"][1].as_str().unwrap().contains("half-res = true"));
    assert_ne!(bytes(&half), bytes(&first));
    window.close();
}

#[test]
fn error_against_time_is_measured_while_the_window_goes_on_and_a_point_gives_its_settings() {
    let Some(mut window) = Window::open("--radius 80") else { return };
    let first = window.settled(|_| true);
    window.xdotool("key v");
    window.rest();
    window.click("sweep start");
    let points = |line: &Value| line["sweep"]["points"].as_array().map_or(0, Vec::len);
    let some = window.wait(|line| points(line) >= 4);
    assert_eq!(some["sweep"]["ended"], false);
    // The window goes on meanwhile: another image is shown before the measurement has ended.
    window.xdotool("key 2");
    let shown = window.settled(|line| line["show"] == "ao");
    assert_eq!(shown["sweep"]["ended"], false, "{}", shown["sweep"]["done"]);
    // The first point is A, with one sample per pixel.
    let settings = |line: &Value, at: usize| line["sweep"]["points"][at][0].as_str().unwrap().to_string();
    assert_eq!(settings(&some, 0), first["settings"][0].as_str().unwrap());
    let ended = window.wait(|line| line["sweep"]["ended"] == true);
    assert!(ended["sweep"]["error"].is_null() && points(&ended) > 50, "{}", ended["sweep"]);
    let row = |at: usize, field: usize| ended["sweep"]["points"][at][field].clone();
    let number = |at: usize, field: usize| row(at, field).as_f64().unwrap();
    let front: Vec<usize> = (0..points(&ended)).filter(|&at| row(at, 3) == true).collect();
    assert!(front.len() > 2, "{front:?}");
    for &at in &front {
        let beats = |other: usize| number(other, 1) < number(at, 1) && number(other, 2) < number(at, 2);
        assert!(!front.iter().any(|&other| beats(other)), "{at} is beaten");
    }
    // The command that is shown measures the same errors.
    let command = ended["sweep"]["command"].as_str().unwrap().replacen(" trade ", " trade --json trade.json ", 1);
    let report: Value = serde_json::from_slice(&written_by(&command, "trade.json")).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert!(rows.len() > 50, "{command}");
    for rmse in rows.iter().map(|row| row["rmse"].as_f64().unwrap()) {
        assert!((0..points(&ended)).any(|at| (number(at, 2) - rmse).abs() < 1e-9), "{rmse}: {command}");
    }
    // The point with the least error, whose mark no other covers.
    let best = (0..points(&ended)).min_by(|&a, &b| number(a, 2).total_cmp(&number(b, 2))).unwrap();
    window.click(&format!("sweep point {best}"));
    let taken = window.settled(|line| line["settings"][0] != first["settings"][0]);
    let taken = taken["settings"][0].as_str().unwrap();
    assert!(
        (0..points(&ended)).any(|at| settings(&ended, at) == taken && number(at, 2) < 1.1 * number(best, 2)),
        "{taken}"
    );
    window.close();
}

#[test]
fn a_measurement_that_is_cancelled_keeps_its_points() {
    let Some(mut window) = Window::open("") else { return };
    window.xdotool("key v");
    window.rest();
    window.click("sweep start");
    window.wait(|line| line["sweep"]["points"].as_array().is_some_and(|points| !points.is_empty()));
    window.click("sweep cancel");
    let ended = window.wait(|line| line["sweep"]["ended"] == true);
    let points = ended["sweep"]["points"].as_array().unwrap().len();
    assert!((1..50).contains(&points) && ended["sweep"]["error"].is_null(), "{points}");
    window.xdotool("key v");
    window.wait(|line| line["widgets"]["sweep start"].is_null());
    window.close();
}
