//! `hbao tune` finds the settings that a view needs, and the error that it states for them must be true.

use crate::rig::command::cached;
use hbao::context::{Backend, Context};
use hbao::image::{Image, exr};
use hbao::measure::errors::Errors;
use hbao::scene::{CORNELL_BOX, Scene};
use hbao::settings::{DepthFormat, Edges, KNOBS, Method};
use hbao::{Pipeline, Request, Settings};
use serde_json::Value;
use std::fs;
use std::path::Path;

const RAYS: &str = "--truth-rays 32";

/// Tunes into t.toml and t.json, which must succeed. Returns the settings, the report and the messages.
fn tune(folder: &Path, arguments: &str) -> (Settings, Value, String) {
    let output = cached(folder, &format!("tune {arguments} {RAYS} --runs 1 -o t.toml --json t.json"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {stderr}");
    let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let mut settings = Settings::default();
    settings.read_toml(&text("t.toml")).unwrap();
    (settings, serde_json::from_str(&text("t.json")).unwrap(), stderr + &String::from_utf8(output.stdout).unwrap())
}

fn rows(report: &Value) -> &[Value] {
    report["rows"].as_array().unwrap()
}

fn best(report: &Value) -> &Value {
    let mut all = rows(report).iter().filter(|row| row["verdict"] == "best");
    let best = all.next().unwrap();
    assert!(all.next().is_none(), "more than one row is the best");
    best
}

/// Returns the RMSE of what `render` makes with t.toml, computed from the files that `render` and `truth` write.
fn rendered_rmse(folder: &Path, view: &str, truth: &str) -> f64 {
    for arguments in [
        format!("render {view} --settings t.toml -o a.png --dump dumped"),
        format!("truth {view} {truth} {RAYS} -o truth.exr"),
    ] {
        let output = cached(folder, &arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |name: &str| -> Image<f32> { exr::read(&folder.join(name)).unwrap() };
    let covered = read("dumped/depth.exr").map(|z| z.is_finite());
    Errors::of(&read("dumped/ao.exr"), &read("truth.exr"), &covered).unwrap().rmse
}

#[test]
fn the_image_of_the_file_written_has_the_rmse_promised() {
    for (view, goal) in [
        ("nave --size 48x36", "--max-error 0.2"),
        ("cornell-box --size 48x36 --radius 120", "--max-error 0.15 --method hbao --blur 5"),
        (
            "cornell-box --size 47x35 --radius 120",
            "--max-ms 1000 --method hbao --half-res --directions 4 --jitter tile",
        ),
        ("cornell-box --size 40x30", "--max-error 0.2 --method ssao --msaa 2"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (settings, report, said) = tune(folder.path(), &format!("{view} {goal}"));
        let promised = best(&report)["rmse"].as_f64().unwrap();
        let found = rendered_rmse(folder.path(), view, "");
        assert!((promised - found).abs() < 1e-6, "{view}: {promised} promised, {found} rendered");
        assert!(said.contains(&format!("{promised:.4}")), "{said}");
        // The file also states the error of the settings.
        let table: toml::Table = fs::read_to_string(folder.path().join("t.toml")).unwrap().parse().unwrap();
        assert!((table["render"]["rmse"].as_float().unwrap() - promised).abs() < 1e-12);
        let same = |knob: &str| best(&report)[knob] == KNOBS.iter().find(|k| k.name == knob).unwrap().text(&settings);
        assert!(same("method") && same("jitter") && same("edges"), "{}", settings.to_toml());
    }
}

#[test]
fn the_library_reads_the_file_and_renders_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (settings, report, _) =
        tune(folder.path(), "cornell-box --size 48x36 --max-error 0.15 --method hbao --steps 4 --jitter none");
    // The radius is in scene units, because the library does not know how large a scene is.
    let radius = settings.radius.units().unwrap();
    assert!(radius > 0.0);
    let found = rendered_rmse(folder.path(), "cornell-box --size 48x36", "");
    let scene = Scene::open(CORNELL_BOX).unwrap();
    let (camera, _) = scene.view.camera(&scene.mesh, 48, 36).unwrap();
    let context = Context::open(Backend::Auto).unwrap();
    let mut pipeline = Pipeline::new(context.gl(), (48, 36), &settings, Request::default()).unwrap();
    pipeline.render(&scene.mesh, &camera).unwrap();
    let covered = pipeline.depth().unwrap().map(|z| z.is_finite());
    let truth = exr::read::<f32>(&folder.path().join("truth.exr")).unwrap();
    let embedded = Errors::of(&pipeline.ao().unwrap(), &truth, &covered).unwrap().rmse;
    assert!((embedded - found).abs() < 1e-6 && best(&report)["rmse"].as_f64().unwrap() <= 0.15);
}

#[test]
fn what_was_given_is_kept_and_the_rest_is_searched() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("given.toml"), "blur = 13\nbias = 10\n").unwrap();
    let (settings, report, _) = tune(
        folder.path(),
        "nave --size 32x24 --max-ms 1000 --method hbao-talk --settings given.toml --directions 3 --strength 1.25 --msaa 1",
    );
    assert_eq!((settings.method, settings.directions, settings.blur, settings.msaa), (Method::HbaoTalk, 3, 13, 1));
    assert_eq!((settings.strength, settings.bias.to_degrees().round()), (1.25, 10.0));
    assert_eq!(report["pinned"], serde_json::json!(["method", "directions", "bias", "strength", "blur", "msaa"]));
    let all = rows(&report);
    assert!(all.iter().all(|row| row["method"] == "hbao-talk" && row["directions"] == 3 && row["blur"] == 13));
    let differ = |knob: &str| all.iter().any(|row| row[knob] != all[0][knob]);
    assert!(differ("steps") && differ("half_res") && differ("jitter") && differ("depth_format"));
    // A file that sets every knob leaves one candidate.
    fs::copy(folder.path().join("t.toml"), folder.path().join("all.toml")).unwrap();
    let (again, report, _) = tune(folder.path(), "nave --size 32x24 --max-ms 1000 --settings all.toml");
    assert_eq!((again, rows(&report).len()), (settings, 1));
}

#[test]
fn without_an_edge_pixel_no_blur_goes_around_samples() {
    let folder = tempfile::tempdir().unwrap();
    // This view looks into a corner where two walls meet and no silhouette is visible.
    let corner = "--size 40x30 --eye 278,273,200 --target 550,273,559 --fov-y 30 --max-error 0.2 --blur 9 --steps 8 --method hbao";
    let (settings, report, said) = tune(folder.path(), corner);
    assert_eq!(report["view"]["edge_pixels"], 0);
    assert!(report["view"]["samples"].as_u64().unwrap() > 1, "pixels should have several samples");
    assert_eq!((settings.edges, settings.msaa), (Edges::Off, 4));
    assert!(said.contains("no pixel is an edge: edges = \"off\""), "{said}");
    assert!(rows(&report).iter().all(|row| row["edges"] == "off"));
    let (settings, ..) = tune(folder.path(), &format!("{corner} --edges supersample"));
    assert_eq!(settings.edges, Edges::Supersample, "a setting that is given is kept");
}

#[test]
fn settings_that_exit_early_at_most_texels_are_rejected_unrendered() {
    let folder = tempfile::tempdir().unwrap();
    let (settings, report, said) =
        tune(folder.path(), "cornell-box --size 40x30 --radius 90 --max-error 0.3 --method hbao --exit paper");
    let most = report["view"]["radius_px"][1].as_f64().unwrap();
    assert!(most > 3.0 && most < 9.0, "{most}");
    let count =
        said.lines().find(|line| line.contains("at more than half of the texels a step is below a texel")).unwrap();
    let mut rejected = 0;
    for row in rows(&report) {
        let below = row["exit_share"].as_f64().unwrap() > 0.5;
        // R covers the most texels at the nearest surface. If a step is too short there, it is too short everywhere.
        let texel = if row["half_res"] == true { 2.0 } else { 1.0 };
        assert!(below || most / (row["steps"].as_f64().unwrap() + 1.0) / texel > 0.999, "{row}");
        assert_eq!(row["verdict"] == "steps-below-texel", below, "{row}");
        assert!(!below || row["rmse"].is_null() && row["ms"].is_null(), "{row}");
        rejected += usize::from(below);
    }
    assert!(count.trim_start().starts_with(&format!("{rejected} not rendered: ")), "{count}");
    assert!(most / f64::from(settings.steps + 1) >= 0.999 && best(&report)["exit_share"].as_f64() <= Some(0.5));
    // If the exit is not given, steps that would be too short are also shortened.
    let (_, report, _) = tune(folder.path(), "cornell-box --size 40x30 --radius 90 --max-error 0.3 --method hbao");
    let shortened = |row: &&Value| row["exit"] == "shorten" && !row["rmse"].is_null();
    assert!(rows(&report).iter().any(|row| shortened(&row) && row["exit_share"] == 0.0));
    assert!(best(&report)["exit_share"].as_f64() <= Some(0.5));
    // If the radius is below a texel, all of them are rejected, and A = 1 is chosen because it costs nothing.
    let (settings, report, said) = tune(folder.path(), "cornell-box --size 40x30 --radius 1 --max-error 0.5");
    assert!(said.contains("R covers less than 2 texels") && settings.method == Method::None);
    assert!(rows(&report).iter().all(|row| row["method"] != "hbao" || row["rmse"].is_null()));
}

#[test]
fn a_looser_error_is_reached_with_less_and_every_row_says_what_became_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut rendered = usize::MAX;
    for limit in [0.2, 0.25, 0.9] {
        let (settings, report, said) = tune(folder.path(), &format!("nave --size 48x36 --max-error {limit}"));
        let all = rows(&report);
        let with = |row: &&Value| row["rmse"].is_number();
        assert!(all.iter().filter(with).count() <= rendered, "{limit}: rendered more than for a tighter error");
        rendered = all.iter().filter(with).count();
        for row in all {
            let verdict = row["verdict"].as_str().unwrap();
            let rmse = row["rmse"].as_f64();
            match verdict {
                "more-work" | "steps-below-texel" => assert!(rmse.is_none() && row["ms"].is_null(), "{row}"),
                "too-inaccurate" => assert!(rmse.unwrap() > limit, "{row}"),
                "best" => assert!(rmse.unwrap() <= limit && row["runs"] == 4 && row["mae"].is_number(), "{row}"),
                "no-gain" | "slower" | "less-accurate" | "wider-than-needed" => {
                    assert!(rmse.unwrap() <= limit, "{row}")
                }
                other => panic!("{other}: {row}"),
            }
        }
        assert_eq!((report["max_error"].as_f64(), report["max_ms"].as_f64()), (Some(limit), None));
        assert!(said.contains(&format!("{} settings considered", all.len())), "{said}");
        assert_eq!(said.lines().filter(|line| line.starts_with("* ")).count(), 1, "{said}");
        // A 16-bit depth may win. Formats wider than the defaults are not chosen if the defaults reach the error.
        assert!(settings.ao_format == Settings::default().ao_format, "{limit}");
        assert!(settings.normal_format == Settings::default().normal_format, "{limit}");
    }
    assert!(rendered < 5, "A = 1 reaches the loosest error, so few settings should be rendered");
}

#[test]
fn a_depth_beyond_16_bits_is_not_rendered_in_them() {
    let folder = tempfile::tempdir().unwrap();
    let (settings, report, _) = tune(
        folder.path(),
        "cornell-box --size 24x18 --far 70000 --max-ms 1000 --method crease --directions 4 --jitter none",
    );
    assert_eq!(settings.depth_format, DepthFormat::R32f);
    let narrow: Vec<_> = rows(&report).iter().filter(|row| row["depth_format"] == "r16f").collect();
    assert!(!narrow.is_empty() && narrow.iter().all(|row| row["verdict"] == "depth-format"));
}

#[test]
fn what_cannot_be_reached_ends_in_one_line_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let backend = |line: &&str| !line.starts_with("hbao: egl: ") && !line.starts_with("hbao: osmesa: ");
    for (code, arguments, parts) in [
        (
            1,
            "nave --size 24x18 --max-error 1e-6 -o t.toml --method ssao --ssao-samples 8",
            vec!["has an RMSE of at most 0.000001", "the least is 0.", "raise --max-error, or set fewer settings"],
        ),
        (
            1,
            "nave --size 24x18 --max-ms 1e-9 -o t.toml --method crease --directions 2 --steps 2 --blur 0 --jitter none",
            vec!["the fastest takes ", "crease 2/2"],
        ),
        (
            1,
            "nave --size 24x18 --eye 0,9,900 --target 0,9,2000 --max-ms 9 -o t.toml",
            vec!["nothing is in view: no part of the scene lies in the picture"],
        ),
        (
            1,
            "nave --size 24x18 --max-ms 9 -o t.toml --method hbao --steps 99 --exit paper",
            vec![
                "combinations of settings",
                "a step is below a texel",
                "leave out --exit paper, or give a larger --radius",
            ],
        ),
        (2, "nave -o t.toml", vec!["tune needs a goal: give --max-error E or --max-ms T"]),
        (2, "nave --max-error 0.1 --max-ms 5 -o t.toml", vec!["give only one of them"]),
        (2, "nave --max-error 0 -o t.toml", vec!["--max-error: '0' is not a finite number above 0"]),
        (2, "nave --max-error=-1 -o t.toml", vec!["--max-error: '-1' is not"]),
        (2, "nave --max-ms inf -o t.toml", vec!["--max-ms: 'inf' is not"]),
        (2, "nave --max-ms NaN -o t.toml", vec!["--max-ms: 'NaN' is not"]),
        (2, "nave --max-ms 5", vec!["--output"]),
        (2, "nave --max-ms 5 -o t.png", vec!["--output t.png: its name must end in .toml"]),
        (2, "nave --max-ms 5 -o t.toml --json t.txt", vec!["--json t.txt: its name must end in .json"]),
        (2, "nave --max-ms 5 -o t.toml --runs 0", vec!["--runs: "]),
        (2, "nave --max-ms 5 -o t.toml --truth-rays 3", vec!["--truth-rays: "]),
        (2, "nave --size 24x18 --max-ms 5 -o t.toml --half-res --blur 0", vec!["half-res with blur 0"]),
        (1, "missing.obj --max-ms 5 -o t.toml", vec!["missing.obj: no such file"]),
        (1, "nave --max-ms 5 -o none/t.toml", vec!["the folder none does not exist"]),
    ] {
        let output = cached(folder.path(), &format!("tune {arguments}"));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments}: {stderr}");
        let last = stderr.lines().last().unwrap();
        assert!(parts.iter().all(|part| last.contains(part)), "{arguments}: no {parts:?} in {stderr}");
        let view = |line: &&str| !line.starts_with("hbao: view: ") && !line.starts_with("hbao: truth: ");
        let behind = |line: &&str| !line.contains("lies behind the camera");
        let lines = stderr.lines().filter(backend).filter(view).filter(behind).count();
        assert!(lines == 1 && output.stdout.is_empty(), "{arguments}: {stderr}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{arguments}");
    }
}

#[test]
fn noise_that_would_be_taken_for_error_and_flags_without_effect_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "tune nave --size 24x18 --max-error 0.5 --rays 3 -o t.toml --truth-rays 2 --runs 1";
    let stderr = String::from_utf8(cached(folder.path(), arguments).stderr).unwrap();
    assert!(stderr.contains("is more than a fifth of an error of 0.50000: give more --truth-rays"), "{stderr}");
    assert!(stderr.contains("--rays has no effect on the settings found, of --method none"), "{stderr}");
}
