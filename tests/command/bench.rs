//! `hbao bench` measures and reports. No test asserts how fast anything is.

use crate::rig;
use crate::rig::command::{hbao, texts};
use hbao::context::{Backend, Context};
use hbao::scene::Scene;
use hbao::{Pipeline, Request, Settings};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn bench(folder: &Path, arguments: &str) -> Output {
    hbao(folder, &format!("bench {arguments}")).output().unwrap()
}

/// Returns standard output, standard error, and what `--json b.json` wrote.
fn measured(arguments: &str) -> (String, String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let output = bench(folder.path(), &format!("{arguments} --json b.json"));
    let [stdout, stderr] = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let text = std::fs::read_to_string(folder.path().join("b.json")).unwrap();
    (stdout, stderr, serde_json::from_str(&text).unwrap())
}

fn rows<'a>(report: &'a Value, mode: &str) -> Vec<&'a Value> {
    report["rows"].as_array().unwrap().iter().filter(|row| row["mode"] == mode).collect()
}

fn number(row: &Value, name: &str) -> f64 {
    row[name].as_f64().unwrap_or_else(|| panic!("{name}: {row}"))
}

#[test]
fn it_measures_what_the_papers_did_and_writes_the_contracts_fields() {
    let (text, _, report) = measured("--size 64x48 --runs 1");
    assert!(report["renderer"].is_string() && report["scene"] == "nave");
    for row in report["rows"].as_array().unwrap() {
        for name in ["method", "directions", "steps", "msaa", "blur", "mode", "column", "size", "triangles", "rays"] {
            assert!(!row[name].is_null(), "{name}: {row}");
        }
        let (frame, ao, blur) = (number(row, "frame_ms"), number(row, "ao_ms"), number(row, "blur_ms"));
        assert!((number(row, "fps") - 1e3 / frame).abs() < 1e-9 && number(row, "compile_ms") >= 0.0);
        assert_eq!(blur > 0.0, number(row, "blur") > 0.0, "{row}");
        let [low, high] = [0, 1].map(|i| row["spread"]["frame_ms"][i].as_f64().unwrap());
        assert!(low <= frame && frame <= high, "{row}");
        // If there is no AO pass, nothing may be measured of it.
        let has_ao = row["method"] != "none";
        assert_eq!(ao > 0.0, has_ao, "{row}");
        for name in ["floor_ms", "mpixels_per_s", "ao_to_floor", "floor_ns_per_fetch", "ns_per_sample"] {
            assert_eq!(row[name].is_f64(), has_ao, "{name}: {row}");
        }
    }

    for (mode, half, msaa) in [("half", true, 1), ("msaa1", false, 1), ("msaa4", false, 4)] {
        let cells: Vec<_> = rows(&report, mode)
            .iter()
            .map(|row| {
                assert_eq!([&row["half_res"], &row["msaa"]], [&Value::from(half), &Value::from(msaa)]);
                assert_eq!(row["size"], serde_json::json!([64, 48]));
                let name = |field: &str| row[field].as_str().unwrap();
                (name("column"), name("method"), number(row, "directions"), number(row, "steps"), number(row, "blur"))
            })
            .collect();
        let wanted = [
            ("no AO/no blur", "none", 0.0, 0.0, 0.0),
            ("no AO", "none", 0.0, 0.0, 9.0),
            ("4/4", "hbao", 4.0, 4.0, 9.0),
            ("8/8", "hbao", 8.0, 8.0, 9.0),
            ("16/16", "hbao", 16.0, 16.0, 9.0),
        ];
        assert_eq!(cells, wanted, "{mode}");
    }
    let fetches: Vec<_> = rows(&report, "figure1")
        .iter()
        .map(|row| (row["method"].as_str().unwrap(), number(row, "fetches_per_pixel")))
        .collect();
    // First come the two methods of the talk's figure, then every other method with its own defaults.
    let figure = [("hbao-talk", 64.0), ("ray-march", 256.0)];
    let others = rig::methods().map(|method| (method.name(), method.samples(&Settings::for_method(method)).into()));
    let others = others.filter(|other| !figure.contains(other));
    assert_eq!(fetches, figure.into_iter().chain(others).collect::<Vec<_>>());
    let crysis = rows(&report, "crysis");
    assert_eq!(crysis.len(), 3);
    for row in crysis {
        assert_eq!([&row["steps"], &row["blur"], &row["size"][0], &row["size"][1]], [16, 4, 1280, 720]);
    }
    let series = |name: &str, field: &str| -> Vec<f64> {
        let scaling = rows(&report, "scaling");
        scaling.iter().filter(|row| row["column"] == name).map(|row| number(row, field)).collect()
    };
    assert_eq!(series("samples", "fetches_per_pixel"), [16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0]);
    let triangles = series("triangles", "triangles");
    assert!(triangles.len() == 4 && triangles.windows(2).all(|pair| pair[1] == 4.0 * pair[0]), "{triangles:?}");
    assert_eq!(series("pixels", "msaa"), [1.0; 7]);
    assert_eq!(report["exponents"].as_array().unwrap().len(), 6);

    // The ratios must be the quotients of the rows' times.
    let of = |mode: &str, column: &str| {
        let row = rows(&report, mode).into_iter().find(|row| row["column"] == column);
        number(row.unwrap(), "ao_ms")
    };
    let ratios = report["ratios"].as_array().unwrap();
    for (name, card, then, here) in [
        ("AO 16/16 over 8/8, 1x", "8800 Ultra", 3.169, of("msaa1", "16/16") / of("msaa1", "8/8")),
        ("AO at half over full resolution, 8/8", "8800 GT", 0.141, of("half", "8/8") / of("msaa1", "8/8")),
        ("ray-march over hbao-talk", "8800 Ultra", 4.467, of("figure1", "ray-march") / of("figure1", "hbao-talk")),
    ] {
        let ratio = ratios.iter().find(|ratio| ratio["ratio"] == name).unwrap();
        assert!((number(ratio, "here") - here).abs() < 1e-9, "{ratio}");
        assert!((number(&ratio["papers"], card) - then).abs() < 1e-3, "{ratio}");
        assert!(
            text.lines().any(|line| line.starts_with(name) && line.contains(&format!("{card} {then:.2}"))),
            "{text}"
        );
    }
    for part in
        ["1x MSAA, frames/s", "4x MSAA, 8800 GT ", "The two papers disagree", " 36.7 ", "2008, 8800 GTX", "grows as"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn parts_can_be_chosen_and_settings_that_the_cases_set_are_said_to_have_no_effect() {
    let (text, stderr, report) =
        measured("cornell-box --size 40x30 --runs 1 --only crysis,figure1 --steps 3 --half-res --radius 80");
    let modes: Vec<_> = report["rows"].as_array().unwrap().iter().map(|row| row["mode"].as_str().unwrap()).collect();
    assert_eq!(modes, [vec!["figure1"; rig::methods().count()], vec!["crysis"; 3]].concat());
    assert!(
        text.starts_with("Figure 1") && !text.contains("Table 6.2.1, whole") && !text.contains("Scaling"),
        "{text}"
    );
    for flag in ["--steps has no effect", "--half-res has no effect"] {
        assert!(stderr.contains(flag), "{stderr}");
    }
    assert!(!stderr.contains("--radius has no effect") && report["scene"] == "cornell-box", "{stderr}");
}

#[test]
fn the_frame_without_ao_blurs_an_open_image() {
    let context = Context::open(Backend::Auto).unwrap();
    let scene = Scene::open("cornell-box").unwrap();
    let (camera, _) = scene.view.camera(&scene.mesh, 64, 48).unwrap();
    for half_res in [false, true] {
        let settings = Settings { half_res, ..Settings::default() }.resolved(scene.mesh.diagonal());
        let request = Request { without_ao: true, edges: true, timings: true, ..Request::default() };
        let mut pipeline = Pipeline::new(context.gl(), (64, 48), &settings, request).unwrap();
        let passes: Vec<_> = pipeline.render(&scene.mesh, &camera).unwrap().into_iter().map(|time| time.name).collect();
        assert_eq!(passes, ["gbuffer", "resolve", "background", "edges", "blur_x", "blur_y", "blur_edges"]);
        assert_eq!(pipeline.ao().unwrap().texels, [1.0; 64 * 48]);
        assert!(pipeline.edges().unwrap().texels.contains(&true));
    }
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        ("--runs 0", "--runs: '0' is not a whole number from 1 to 1000"),
        ("--runs many", "--runs: 'many'"),
        ("--only tables", "--only: 'tables' is not one of table, figure1, crysis, scaling, embedding"),
        ("--only table,", "--only: '' is not one of"),
        ("--json b.txt", "must end in .json"),
        ("--json none/b.json", "the folder none does not exist"),
        ("--json b.json none.obj", "no such file"),
        ("--json b.json --depth-format r16f --far 70000", "depth-format r16f"),
        ("--json b.json --only scaling --size 999999x2", "this driver takes 1x1 to"),
    ] {
        let output = bench(folder.path(), arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments}: {stderr}");
        let lines: Vec<_> =
            stderr.lines().filter(|line| !line.contains("OpenGL 4") && !line.contains("left out")).collect();
        assert!(lines.len() == 1 && lines[0].contains(part), "{arguments}: {stderr}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn it_measures_what_changes_and_inputs_of_an_application_cost() {
    let (text, _, report) = measured("--size 64x48 --runs 2 --only embedding");
    assert_eq!(report["rows"], serde_json::json!([]));
    let names = |list: &str, name: &str| {
        let all = report[list].as_array().unwrap().iter();
        all.map(|one| one[name].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    let settings = names("changes", "setting");
    for name in ["radius", "strength", "bias", "blur-depth-sigma"] {
        assert!(settings.contains(&name.to_string()) && text.contains(name), "{settings:?}");
    }
    for change in report["changes"].as_array().unwrap() {
        assert_eq!(change["runs"].as_array().unwrap().len(), 2);
        assert!(change["added_ms"].is_f64());
    }
    // Linear depth with normals needs no pass; each other form needs the one that it is there for.
    for (i, cost) in report["inputs"].as_array().unwrap().iter().enumerate() {
        let [linear, rebuilt] = ["linear_depth_ms", "rebuilt_normals_ms"].map(|name| number(cost, name) > 0.0);
        assert_eq!([linear, rebuilt], [i >= 2, i == 1], "{cost}");
        assert!(number(cost, "ao_ms") > 0.0);
    }
    assert_eq!(names("inputs", "inputs").len(), 6);
    // In an orthographic view, linear depth is left.
    let (_, _, report) = measured("--size 32x24 --runs 1 --only embedding --ortho 10");
    assert_eq!(report["inputs"].as_array().unwrap().len(), 3);
}
