//! The truth that the viewer traces, the share that exits early, and the anatomy of a pixel.

use crate::Window;
use crate::rig::command::{HBAO, by, cached, with_shader_cache};
use hbao::image::{Image, exr};
use hbao::reference::TwinInputs;
use hbao::reference::anatomy::Anatomy;
use hbao::rotation_tile;
use hbao::scene::Scene;
use hbao::settings::Settings;
use serde_json::Value;
use std::path::Path;

/// Runs the command that the window shows, with other images and flags.
fn render(folder: &Path, line: &Value, arguments: &str) {
    let command = line["command"].as_str().unwrap();
    let command = command.replacen("hbao", HBAO, 1);
    let command = command.replace(" -o view.png", &format!(" {arguments}"));
    let mut shell = by("sh", folder);
    let output = with_shader_cache(shell.args(["-c", &command])).output().unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Chooses the least number of rays, so that the truth is soon traced to its end.
fn few_rays(window: &mut Window) {
    window.click("truth 64 rays");
    window.wait(|line| line["truth"]["of"] == 64);
}

#[test]
fn the_error_against_the_truth_is_that_of_the_commands() {
    let Some(mut window) = Window::open("") else { return };
    window.settled(|_| true);
    window.xdotool("key g");
    let first = window.settled(|line| line["truth"]["look"] == "numbers" && line["show"] == "ao");
    few_rays(&mut window);
    let coarse = window.wait(|line| line["truth"]["known"]["rays"].as_u64() >= Some(16));
    let last = window.wait(|line| line["truth"]["known"]["rays"] == 64);
    // The noise falls with the root of the number of rays, and the time grows.
    let of = |line: &Value, name: &str| line["truth"]["known"][name].as_f64().unwrap();
    let rays = of(&coarse, "rays");
    let expected = of(&coarse, "noise") * (rays / 64.0).sqrt();
    assert!((of(&last, "noise") / expected - 1.0).abs() < 0.1, "{expected} {last}");
    assert_eq!(last["truth"]["tracing"], false);

    let folder = window.folder.path().to_path_buf();
    render(&folder, &first, "-o ao.exr");
    let command = first["command"].as_str().unwrap();
    let camera = command.split(" --show").next().unwrap().replacen("hbao render", "truth", 1);
    let output = cached(&folder, &format!("{camera} --truth-rays 64 -o truth.exr cornell-box"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let number = |before: &str, after: &str| -> f64 {
        said.split(before).nth(1).unwrap().split(after).next().unwrap().trim().parse().unwrap()
    };
    assert_eq!(of(&last, "covered"), number("truth: ", " covered"));
    let noise = number("noise ", " RMS");
    assert!(cached(&folder, "compare ao.exr truth.exr --json all.json").status.success());
    let compared: Value = serde_json::from_slice(&std::fs::read(folder.join("all.json")).unwrap()).unwrap();
    // The command compares the background too, where both are 1. Noise adds to the squares.
    let pixels = 420.0 * 560.0;
    let squares = compared["rmse"].as_f64().unwrap().powi(2) * pixels / of(&last, "covered") - noise * noise;
    let shown = last["truth"]["rmse"][0].as_f64().unwrap().powi(2) - of(&last, "noise").powi(2);
    assert!((shown / squares - 1.0).abs() < 0.01, "{shown} {squares}");
    window.close();
}

#[test]
fn a_drag_is_answered_while_the_truth_is_traced_and_gives_it_up() {
    let Some(mut window) = Window::open("") else { return };
    window.xdotool("key 2 key g");
    let before =
        window.settled(|line| line["truth"]["tracing"] == true && line["truth"]["progress"].as_f64() > Some(0.0));
    let count = window.lines().len();
    window.drag("image", [0.5, 0.5], [0.7, 0.6]);
    window.settled(|line| line["command"] != before["command"]);
    let lines = window.lines();
    let frames: Vec<&Value> = lines[count..].iter().filter(|line| line["command"] != before["command"]).collect();
    assert!(frames.len() > 2, "{}", frames.len());
    // What was traced for the earlier camera is not shown for the new one.
    let truth = &frames[0]["truth"];
    assert!(truth["known"].is_null() && truth["rmse"] == serde_json::json!([]), "{truth}");
    // It begins again, and looks at it in all ways.
    window.wait(|line| line["truth"]["known"]["rays"] == 16);
    for look in ["beside", "alone", "error"] {
        window.click(&format!("truth {look}"));
        let shown = window.wait(|line| line["truth"]["look"] == look);
        assert!(shown["truth"]["known"]["rays"].as_u64() >= Some(16), "{shown}");
    }
    // A strength is no part of the truth, which goes on, and the radius is.
    window.drag("knob strength", [0.2, 0.5], [0.5, 0.5]);
    let strong = window.settled(|line| line["settings"] != before["settings"]);
    assert!(strong["truth"]["known"]["rays"].as_u64() >= Some(16));
    window.drag("knob radius", [0.3, 0.5], [0.2, 0.5]);
    let lines = window.lines();
    let changed = lines.iter().find(|line| line["settings"] != strong["settings"] && line["truth"]["look"] == "error");
    assert!(
        lines.iter().any(|line| line["settings"] != strong["settings"] && line["truth"]["known"].is_null()),
        "{changed:?}"
    );
    window.click("truth off");
    window.wait(|line| line["truth"]["look"] == "off" && line["truth"]["tracing"] == false);
    window.close();
}

#[test]
fn a_click_shows_the_anatomy_of_that_pixel_with_the_numbers_of_its_twin() {
    for flags in ["--steps 6 --directions 5", "--method hbao-view --half-res"] {
        let Some(mut window) = Window::open(flags) else { return };
        window.xdotool("key 2 key x");
        window.settled(|line| line["anatomy"]["twin"].is_number());
        // The window is moved out of the way, by its title.
        let aside = |line: &Value| line["widgets"]["anatomy window"][0].as_f64() > Some(300.0);
        // A drag is lost if a busy machine draws no frame between its press and its release.
        for _ in 0..5 {
            window.drag("anatomy window", [0.5, 0.03], [1.45, 0.03]);
            window.rest();
            if window.lines().last().is_some_and(aside) {
                break;
            }
        }
        window.wait(aside);
        let at = window.point("image", [0.4, 0.97]);
        let elsewhere = |line: &Value| line["anatomy"]["pixel"] != serde_json::json!([210, 279]);
        // So is a click.
        for _ in 0..5 {
            window.xdotool(&format!("mousemove {at} click 1"));
            window.rest();
            if window.lines().last().is_some_and(elsewhere) {
                break;
            }
        }
        let clicked = window.settled(elsewhere);
        window.xdotool("key bracketright key bracketright");
        let shown = window.settled(|line| line["anatomy"]["direction"] == 2);
        let pixel = &shown["anatomy"]["pixel"];
        assert_eq!(*pixel, clicked["anatomy"]["pixel"]);
        let [x, y] = [0, 1].map(|axis| pixel[axis].as_u64().unwrap());
        let place: Vec<f64> = at.split(' ').map(|number| number.parse().unwrap()).collect();
        let image = &shown["widgets"]["image"];
        let from = [0, 1].map(|axis| place[axis] - image[axis].as_f64().unwrap());
        assert!((from[0] - x as f64).abs() < 1.5 && (from[1] - y as f64).abs() < 1.5, "{from:?} {pixel}");

        // The same pixel by the library, from the images of the command.
        let folder = window.folder.path().to_path_buf();
        for show in ["depth", "normals", "ao-raw"] {
            let line = serde_json::json!({ "command": shown["command"].as_str().unwrap().replace(" --show ao ", " ") });
            render(&folder, &line, &format!("--show {show} -o {show}.exr"));
        }
        let depth: Image<f32> = exr::read(&folder.join("depth.exr")).unwrap();
        let normals: Image<[f32; 3]> = exr::read(&folder.join("normals.exr")).unwrap();
        let raw: Image<f32> = exr::read(&folder.join("ao-raw.exr")).unwrap();
        let scene = Scene::open("cornell-box").unwrap();
        let mut settings = Settings::default();
        settings.read_toml(shown["settings"][0].as_str().unwrap()).unwrap();
        let settings = settings.resolved(scene.mesh.diagonal());
        let (camera, _) = scene.view.camera(&scene.mesh, 420, 560).unwrap();
        let tile = rotation_tile(&settings);
        let (projection, near) = (camera.projection, camera.near);
        let inputs = TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
        let anatomy = Anatomy::new(&inputs, &settings).unwrap();
        let scale = if settings.half_res { 2 } else { 1 };
        let texel = (x as usize / scale, (559 - y as usize) / scale);
        // The window's camera has the angle of view that a flag can hold, which differs in the last digits.
        let same =
            |told: &Value, number: f64| assert!((told.as_f64().unwrap() - number).abs() < 1e-9, "{told} {number}");
        same(&shown["anatomy"]["twin"], anatomy.visibility(texel).unwrap());
        assert_eq!(shown["anatomy"]["shader"].as_f64().unwrap() as f32, raw.at(texel.0, texel.1));
        let slice = anatomy.slice(texel, 2).unwrap();
        same(&shown["anatomy"]["occlusions"][2], slice.occlusion);
        let samples = shown["anatomy"]["samples"].as_array().unwrap();
        assert_eq!(samples.len(), slice.samples.len());
        for (told, sample) in samples.iter().zip(&slice.samples) {
            assert_eq!(told[0], sample.index);
            same(&told[2], sample.contribution);
        }
        // A drag is no click.
        window.drag("image", [0.4, 0.97], [0.35, 0.95]);
        let dragged = window.settled(|line| line["command"] != shown["command"]);
        assert_eq!(dragged["anatomy"]["pixel"], shown["anatomy"]["pixel"]);
        window.close();
    }
}

#[test]
fn methods_without_slices_show_what_they_have_and_the_background_has_nothing() {
    for (method, marks) in [("ssao", true), ("ray-march", true), ("crease", false)] {
        let Some(mut window) = Window::open(&format!("--method {method}")) else { return };
        window.xdotool("key x");
        let shown = window.settled(|line| line["anatomy"]["twin"].is_number());
        assert_eq!(shown["anatomy"]["marks"].as_u64() > Some(0), marks, "{method}");
        assert_eq!(shown["anatomy"]["samples"], serde_json::json!([]));
        if marks {
            // Above the box lies background.
            let at = window.point("image", [0.97, 0.01]);
            window.xdotool(&format!("mousemove {at} click 1"));
            window.wait(|line| line["anatomy"]["message"].as_str().is_some_and(|text| text.contains("background")));
        }
        window.close();
    }
}

#[test]
fn the_share_that_exits_early_is_what_the_command_says() {
    let Some(mut window) = Window::open("--radius 12") else { return };
    window.xdotool("key 8");
    let shown = window.settled(|line| line["show"] == "exits" && line["image"]["exits"][0].is_string());
    let share = |text: &str| -> String {
        let end = text.find('%').unwrap_or_else(|| panic!("{text}"));
        text[..end].rsplit(' ').next().unwrap().into()
    };
    let said = shown["image"]["exits"][0].as_str().unwrap().to_string();
    let command = shown["command"].as_str().unwrap().replacen("hbao ", "", 1);
    let output = cached(window.folder.path(), &command);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let told = told.lines().find(|line| line.contains("visibility is 1 at")).unwrap_or_else(|| panic!("{told}"));
    assert_eq!(share(&said), share(told), "{said} {told}");
    window.close();
    let Some(mut window) = Window::open("--method ssao") else { return };
    window.xdotool("key 8");
    let never = window.settled(|line| line["image"]["exits"][0].is_string());
    assert_eq!(never["image"]["exits"][0], "ssao never exits early");
    window.close();
}
