//! `hbao sequence` renders what `hbao render` renders, goes on where it was interrupted, and shares its frames.

use crate::rig::command::{cached, hbao, names, notices, texts, with_shader_cache};
use hbao::image::{Image, exr, png};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, SystemTime};

const PATH: &str = r#"{"fps": 4, "keys": [
    {"time": 0, "eye": [0, 1.7, 8], "target": [0, 2, 0], "fov_y": 60},
    {"time": 1, "eye": [2, 1.7, 4], "target": [0, 2, -4], "fov_y": 50},
    {"time": 2, "eye": [0, 3, 0], "target": [0, 2, -10], "fov_y": 60}]}"#;

const SMALL: &str = "--size 48x36 --msaa 1";

/// Runs the verb with success, and returns its notices.
fn sequence(folder: &Path, arguments: &str) -> String {
    let output = cached(folder, &format!("sequence {arguments}"));
    let [stdout, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    assert_eq!(stdout, "");
    notices(&stderr).join("\n")
}

fn refused(folder: &Path, arguments: &str) -> String {
    let output = cached(folder, &format!("sequence {arguments}"));
    let [_, stderr] = texts(&output);
    assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments}: {stderr}");
    assert_eq!(notices(&stderr).len(), 1, "one line: {stderr}");
    stderr
}

fn with_path() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.json"), PATH).unwrap();
    folder
}

/// The bytes of each frame, in the order of their names.
fn frames(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let all = names(folder).into_iter().filter(|name| name.ends_with(".png"));
    all.map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

#[test]
fn a_frame_is_what_render_renders_with_its_camera() {
    let folder = with_path();
    let folder = folder.path();
    let told = sequence(folder, &format!("nave --path walk.json -o f.##.png {SMALL} --interpolation linear"));
    assert!(told.contains("frames 0 to 8: 9 rendered"), "{told}");
    let expected: Vec<String> = (0..9).map(|i| format!("f.0{i}.png")).collect();
    assert_eq!(frames(folder).into_iter().map(|(name, _)| name).collect::<Vec<_>>(), expected);
    // Halfway between the second key and the third.
    let camera = "--eye 1,2.35,2 --target 0,2,-7 --fov-y 55";
    let output = cached(folder, &format!("render nave -o one.png {SMALL} {camera}"));
    assert_eq!(output.status.code(), Some(0));
    let [a, b]: [Image<[u8; 3]>; 2] = ["one.png", "f.06.png"].map(|name| png::read(&folder.join(name)).unwrap());
    assert_eq!(a.texels, b.texels);
    // A path's direction up and the flags' lens are used too.
    let sideways = PATH
        .replace(r#", "fov_y": 60}"#, r#", "up": [1, 0, 0]}"#)
        .replace(r#", "fov_y": 50}"#, r#", "up": [1, 0, 0]}"#);
    fs::write(folder.join("up.json"), sideways).unwrap();
    sequence(folder, &format!("nave --path up.json -o up.#.png {SMALL} --fov-y 70 --frames 0"));
    let camera = "--eye 0,1.7,8 --target 0,2,0 --up 1,0,0 --fov-y 70";
    cached(folder, &format!("render nave -o one.png {SMALL} {camera}"));
    let [a, b]: [Image<[u8; 3]>; 2] = ["one.png", "up.0.png"].map(|name| png::read(&folder.join(name)).unwrap());
    assert_eq!(a.texels, b.texels);
}

#[test]
fn a_table_and_an_object_of_the_same_keys_give_the_same_frames() {
    let folder = with_path();
    let folder = folder.path();
    let rows = "time,eye_x,eye_y,eye_z,target_x,target_y,target_z,fov_y\r\n0, 0,1.7,8, 0,2,0, 60\r\n1, 2,1.7,4, 0,2,-4, 50\r\n\
                2, 0,3,0, 0,2,-10, 60\r\n";
    fs::write(folder.join("walk.csv"), rows).unwrap();
    fs::create_dir(folder.join("json")).unwrap();
    fs::create_dir(folder.join("csv")).unwrap();
    sequence(folder, &format!("nave --path walk.json -o json/#.png {SMALL}"));
    sequence(folder, &format!("nave --path walk.csv -o csv/#.png {SMALL} --fps 4"));
    let [a, b] = ["json", "csv"].map(|name| frames(&folder.join(name)));
    assert_eq!(a.len(), 9);
    assert!(a == b);
    assert!(a[1].1 != a[2].1);
}

#[test]
fn a_killed_run_goes_on_and_ends_with_the_bytes_of_an_unbroken_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    ["unbroken", "killed"].iter().for_each(|name| fs::create_dir(folder.join(name)).unwrap());
    let arguments = |name: &str| {
        format!("sequence --turntable 100 --size 320x240 -o {name}/turn.####.png --log {name}/log.jsonl --msaa 1")
    };
    assert_eq!(cached(folder, &arguments("unbroken")).status.code(), Some(0));
    // The moment follows from the clock, so that it is another in each run.
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
    let kill_at = 5 + now.subsec_nanos() as usize / 1000 % 80;
    let mut command = hbao(folder, &arguments("killed"));
    let mut child = with_shader_cache(&mut command).stderr(Stdio::null()).spawn().unwrap();
    while frames(&folder.join("killed")).len() < kill_at {
        assert!(child.try_wait().unwrap().is_none(), "it ended before frame {kill_at}");
        thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = frames(&folder.join("killed"));
    assert!((kill_at..100).contains(&before.len()), "{kill_at} {}", before.len());
    let [_, stderr] = texts(&cached(folder, &arguments("killed")));
    let rest = 100 - before.len();
    let said = format!("frames 0 to 99: {rest} rendered");
    assert!(stderr.contains(&said) && stderr.contains(&format!("{} were there already", before.len())), "{stderr}");
    let [a, b] = ["unbroken", "killed"].map(|name| frames(&folder.join(name)));
    assert_eq!(a.len(), 100);
    assert!(a == b, "killed after {kill_at} frames");
}

#[test]
fn only_frames_that_show_something_else_are_rendered_again() {
    let folder = with_path();
    let folder = folder.path();
    let square = "v -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nf 1 2 3 4\nv 0 0 0\nv 0 2 0\nv 1 2 0\nf 5 6 7\n";
    fs::write(folder.join("a.obj"), square).unwrap();
    let run = |more: &str| -> Vec<u32> {
        fs::remove_file(folder.join("log.jsonl")).ok();
        let arguments = format!("a.obj --turntable 4 -o #.png --size 32x24 --log log.jsonl --radius 1 {more}");
        sequence(folder, &arguments);
        let log = fs::read_to_string(folder.join("log.jsonl")).unwrap();
        let lines = log.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let rendered = lines.filter(|line| line["rendered"] == true);
        rendered.map(|line| u32::try_from(line["frame"].as_u64().unwrap()).unwrap()).collect()
    };
    assert_eq!(run(""), [0, 1, 2, 3]);
    assert_eq!(run(""), [0; 0]);
    assert_eq!(run("--steps 9"), [0, 1, 2, 3]);
    assert_eq!(run("--steps 9 --show ao"), [0, 1, 2, 3]);
    assert_eq!(run("--steps 9 --show ao"), [0; 0]);
    assert_eq!(run("--show ao --apply ambient"), [0, 1, 2, 3]);
    assert_eq!(run(""), [0, 1, 2, 3]);
    // A vertex moved, and a colour given by a file of materials.
    fs::write(folder.join("a.obj"), square.replace("v 1 2 0", "v 1 2 0.1")).unwrap();
    assert_eq!(run(""), [0, 1, 2, 3]);
    fs::write(folder.join("a.obj"), format!("mtllib a.mtl\nusemtl m\n{square}")).unwrap();
    fs::write(folder.join("a.mtl"), "newmtl m\nKd 1 0 0\n").unwrap();
    assert_eq!(run(""), [0, 1, 2, 3]);
    fs::write(folder.join("a.mtl"), "newmtl m\nKd 1 0.5 0\n").unwrap();
    assert_eq!(run(""), [0, 1, 2, 3]);
    assert_eq!(run(""), [0; 0]);
    // A texture is laid over the triangle, and then has another colour.
    let texture =
        |red: u8| fs::write(folder.join("t.png"), png::encode(&Image::filled(1, 1, [red, 9, 9]), &[]).unwrap());
    texture(200).unwrap();
    fs::write(folder.join("a.mtl"), "newmtl m\nKd 1 0.5 0\nmap_Kd t.png\n").unwrap();
    let laid = square.replace("f 5 6 7", "vt 0 0\nvt 1 0\nvt 0 1\nf 5/1 6/2 7/3");
    fs::write(folder.join("a.obj"), format!("mtllib a.mtl\nusemtl m\n{laid}")).unwrap();
    assert_eq!(run(""), [0, 1, 2, 3]);
    assert_eq!(run(""), [0; 0]);
    texture(100).unwrap();
    assert_eq!(run(""), [0, 1, 2, 3]);
    assert_eq!(run(""), [0; 0]);
    // A file that was cut short, one of somebody else, and one that is missing.
    let bytes = fs::read(folder.join("0.png")).unwrap();
    fs::write(folder.join("0.png"), &bytes[..bytes.len() - 40]).unwrap();
    fs::write(folder.join("1.png"), "hello").unwrap();
    fs::remove_file(folder.join("3.png")).unwrap();
    assert_eq!(run(""), [0, 1, 3]);
    assert_eq!(fs::read(folder.join("0.png")).unwrap(), bytes);
    assert_eq!(run("--no-metadata"), [0, 1, 2, 3]);
    assert_eq!(run("--no-metadata"), [0, 1, 2, 3]);
}

#[test]
fn chunks_and_contexts_share_the_frames_and_give_the_same_bytes() {
    let folder = with_path();
    let folder = folder.path();
    ["whole", "parts", "side"].iter().for_each(|name| fs::create_dir(folder.join(name)).unwrap());
    let arguments = |name: &str| format!("nave --path walk.json -o {name}/#.png {SMALL}");
    sequence(folder, &arguments("whole"));
    let mut before = 0;
    for (chunk, count) in [(0, 2), (1, 2), (2, 2), (3, 3)] {
        sequence(folder, &format!("{} --chunk {chunk}/4", arguments("parts")));
        let found = frames(&folder.join("parts")).len();
        assert_eq!(found - before, count, "chunk {chunk} of 9 frames in 4");
        before = found;
    }
    sequence(folder, &format!("{} --contexts 3", arguments("side")));
    let whole = frames(&folder.join("whole"));
    for name in ["parts", "side"] {
        assert!(frames(&folder.join(name)) == whole, "{name}");
    }
    fs::create_dir(folder.join("few")).unwrap();
    sequence(folder, &format!("{} --frames 1-8,3", arguments("few")));
    assert_eq!(names(&folder.join("few")), ["1.png", "4.png", "7.png"]);
    let told = sequence(folder, &format!("{} --frames 1-2 --chunk 0/9", arguments("few")));
    assert!(told.contains("no frame is in this chunk"), "{told}");
}

#[test]
fn the_log_tells_the_error_against_the_truth_and_the_share_of_early_exits() {
    let folder = with_path();
    let folder = folder.path();
    let camera = "--eye 0,1.7,8 --target 0,2,0 --fov-y 60";
    let set = "--size 48x36 --msaa 1 --radius 0.4 --show ao";
    sequence(folder, &format!("nave --path walk.json -o #.exr {set} --frames 0 --truth-rays 16 --log log.jsonl"));
    for verb in ["render nave -o ao.exr", "render nave -o depth.exr", "truth nave -o truth.exr --truth-rays 16"] {
        let set = match verb {
            "render nave -o depth.exr" => set.replace("--show ao", "--show depth"),
            verb if verb.starts_with("truth") => set.replace("--show ao", ""),
            _ => set.into(),
        };
        assert_eq!(cached(folder, &format!("{verb} {set} {camera}")).status.code(), Some(0), "{verb}");
    }
    let [ao, depth, truth]: [Image<f32>; 3] =
        ["ao.exr", "depth.exr", "truth.exr"].map(|name| exr::read(&folder.join(name)).unwrap());
    let covered: Vec<usize> = (0..ao.texels.len()).filter(|&i| depth.texels[i].is_finite()).collect();
    let squares = covered.iter().map(|&i| f64::from(ao.texels[i] - truth.texels[i]).powi(2)).sum::<f64>();
    let rmse = (squares / covered.len() as f64).sqrt();
    let line: serde_json::Value = serde_json::from_str(&fs::read_to_string(folder.join("log.jsonl")).unwrap()).unwrap();
    assert!((line["rmse"].as_f64().unwrap() - rmse).abs() < 1e-6, "{line} {rmse}");
    assert!(line["noise_rmse"].as_f64().unwrap() > 0.01, "{line}");
    // The chapter's exit: R cot(fov/2) H / (2 z) / 9 steps below 1 texel.
    let farthest = 0.4 * 36.0 / (2.0 * 30_f64.to_radians().tan() * 9.0);
    let exits = covered.iter().filter(|&&i| f64::from(depth.texels[i]) > farthest).count() as f64;
    assert!((line["early_exits"].as_f64().unwrap() - exits / covered.len() as f64).abs() < 1e-3, "{line}");
    assert!(exits > 0.0);
}

#[test]
fn a_run_with_a_truth_goes_on_until_the_log_has_the_error_of_each_frame() {
    let folder = with_path();
    let folder = folder.path();
    let run = |rays: &str| -> Vec<(u64, bool)> {
        let before = fs::read_to_string(folder.join("log.jsonl")).unwrap_or_default();
        sequence(folder, &format!("nave --path walk.json -o #.png {SMALL} --frames 0-2 --log log.jsonl {rays}"));
        let after = fs::read_to_string(folder.join("log.jsonl")).unwrap();
        let lines = after[before.len()..].lines().filter(|line| !line.is_empty());
        let lines = lines.map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let mut lines: Vec<_> = lines.map(|l| (l["frame"].as_u64().unwrap(), l["rmse"].is_number())).collect();
        lines.sort_unstable();
        lines
    };
    assert_eq!(run(""), [(0, false), (1, false), (2, false)]);
    let bytes = frames(folder);
    // The frames are there, and their errors are not.
    assert_eq!(run("--truth-rays 4"), [(0, true), (1, true), (2, true)]);
    assert!(frames(folder) == bytes);
    assert_eq!(run("--truth-rays 4"), [(0, false), (1, false), (2, false)], "all was traced");
    assert_eq!(run("--truth-rays 8"), [(0, true), (1, true), (2, true)], "a truth of other rays");
    // The run was killed while it wrote the last line.
    let log = fs::read_to_string(folder.join("log.jsonl")).unwrap();
    let kept: Vec<&str> = log.lines().filter(|line| !line.is_empty() && line.contains("rmse")).collect();
    let cut = kept[5].len() / 2;
    fs::write(folder.join("log.jsonl"), format!("{}\n{}", kept[3..5].join("\n"), &kept[5][..cut])).unwrap();
    assert_eq!(run("--truth-rays 8"), [(0, false), (1, false), (2, true)]);
    let told = sequence(folder, &format!("nave --path walk.json -o #.png {SMALL} --frames 0 --truth-rays 4"));
    assert!(told.contains("--truth-rays has no effect without --log"), "{told}");
}

#[test]
fn frames_of_an_earlier_longer_motion_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let run =
        |frames: u32| sequence(folder.path(), &format!("nave --turntable {frames} -o f#.png {SMALL} --show depth"));
    assert!(!run(3).contains("no frame of this motion"));
    let told = run(2);
    assert!(told.contains("f2.png is no frame of this motion: an earlier one may have had more frames"), "{told}");
}

#[test]
fn notices_of_many_frames_are_said_once_with_their_number() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Two of these look away from the box, and the rest at it.
    let path = "time,eye_x,eye_y,eye_z,target_x,target_y,target_z\n0,278,273,-800,278,273,0\n1,278,273,-800,278,273,-900\n\
                2,278,273,-800,278,273,-900\n3,278,273,-800,278,273,0\n";
    fs::write(folder.join("p.csv"), path).unwrap();
    let told = sequence(folder, "--path p.csv --fps 1 --interpolation linear -o #.png --size 32x24 --show depth");
    let expected =
        "hbao: in 2 of 4 frames, the first is frame 1: the whole scene lies behind the camera: nothing is in view";
    assert!(told.lines().any(|line| line == expected), "{told}");
    assert_eq!(told.lines().count(), 2, "{told}");
}

#[test]
fn a_wrong_rate_is_wrong_usage_and_a_wrong_path_is_not() {
    let folder = with_path();
    let folder = folder.path();
    for fps in ["0", "-1", "nan", "inf", "1e9"] {
        let output = cached(folder, &format!("sequence --path walk.json -o #.png --fps {fps}"));
        let [_, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(2), "{fps}: {stderr}");
        assert!(stderr.contains("--fps ") && !stderr.contains("walk.json"), "{stderr}");
    }
    fs::write(folder.join("zero.json"), PATH.replace(r#""fps": 4"#, r#""fps": 0"#)).unwrap();
    let output = cached(folder, "sequence --path zero.json -o #.png");
    assert_eq!(output.status.code(), Some(1));
    assert!(texts(&output)[1].contains("zero.json"), "{}", texts(&output)[1]);
    assert_eq!(cached(folder, &format!("sequence --path zero.json -o #.png --fps 1 {SMALL}")).status.code(), Some(0));
}

#[test]
fn what_is_no_sequence_is_refused_in_one_line() {
    let folder = with_path();
    let folder = folder.path();
    let key = r#"{"time": 0, "eye": [0,0,0], "target": [0,0,1]}"#;
    let csv = "time,eye_x,eye_y,eye_z,target_x,target_y,target_z";
    for (name, text) in [
        ("empty.json", "".into()),
        ("list.json", "[1, 2]".into()),
        ("no-keys.json", "{}".into()),
        ("broken.json", "{\"keys\": [".into()),
        ("mistyped.json", format!("{{\"key\": [{key}]}}")),
        ("word.json", r#"{"keys": [{"time": "now", "eye": [0,0,0], "target": [0,0,1]}]}"#.into()),
        ("short.json", r#"{"keys": [{"time": 0, "eye": [0,0], "target": [0,0,1]}]}"#.into()),
        ("kind.json", format!(r#"{{"interpolation": "bezier", "keys": [{key}]}}"#)),
        ("same.json", r#"{"keys": [{"time": 0, "eye": [0,0,0], "target": [0,0,0]}]}"#.into()),
        (
            "wide.json",
            r#"{"keys": [{"time": 0, "eye": [0,0,0], "target": [0,0,1], "fov_y": 50},
            {"time": 1, "eye": [0,0,0], "target": [0,0,1], "fov_y": 176}]}"#
                .into(),
        ),
        ("through.csv", format!("{csv}\n0,0,0,0,1,0,0\n1,2,0,0,1,0,0\n")),
        ("none.csv", csv.into()),
        ("words.csv", format!("{csv}\n0,1,2,3,4,5,six\n")),
        ("lacks.csv", "time,eye_x\n0,1\n".into()),
        ("other.csv", "t,x,y,z\n0,1,2,3\n".into()),
        ("ragged.csv", format!("{csv}\n0,1,2\n")),
        ("ups.csv", format!("{csv},up_x\n0,1,2,3,4,5,6,7\n")),
    ] {
        let text: String = text;
        fs::write(folder.join(name), text).unwrap();
    }
    fs::write(folder.join("bytes.json"), [0xff, 0xfe, 0, 1]).unwrap();
    for (arguments, said) in [
        ("--path empty.json -o #.png", "no camera path: its first line lacks the column time"),
        ("--path list.json -o #.png", "it must be an object with \"keys\""),
        ("--path no-keys.json -o #.png", "it has no list \"keys\""),
        ("--path broken.json -o #.png", "no camera path: EOF while parsing"),
        ("--path mistyped.json -o #.png", "the path has \"key\", which is not one of fps, interpolation, keys"),
        ("--path word.json -o #.png", "time of key 0 is not a number"),
        ("--path short.json -o #.png", "eye of key 0 is not a list of three numbers"),
        ("--path kind.json -o #.png", "interpolation \"bezier\" is not one of"),
        ("--path same.json -o #.png", "same.json: no camera path: key 0: eye is the same point as target"),
        ("--path wide.json -o #.png", "key 1: fov_y 176 must be from 1 to 175 degrees"),
        (
            "--path through.csv -o #.png --interpolation linear",
            "frame 12, between key 0 and key 1: eye is the same point as target",
        ),
        ("--path none.csv -o #.png", "it has no keys"),
        ("--path words.csv -o #.png", "target_z of key 0 is 'six'"),
        ("--path lacks.csv -o #.png", "its first line lacks the column eye_y"),
        ("--path other.csv -o #.png", "holds 't'; or give JSON"),
        ("--path ragged.csv -o #.png", "no camera path: CSV error"),
        ("--path ups.csv -o #.png", "all of up_x, up_y and up_z, or none"),
        ("--path bytes.json -o #.png", "it is not text in UTF-8"),
        ("--path missing.json -o #.png", "missing.json: it cannot be read"),
        ("--path walk.json -o frame.png", "must hold the signs ####"),
        ("--path walk.json -o #-#.png", "only one row of the signs"),
        ("--path walk.json -o #####################.png", "more signs # than a number has digits"),
        ("--path walk.json -o ####.jpg", "must end in .png or .exr"),
        ("--path walk.json -o nowhere/#.png", "the folder nowhere does not exist"),
        ("--path walk.json -o #.png --frames 3-1", "has its first frame, 3, after its last, 1"),
        ("--path walk.json -o #.png --frames 3-99", "they are 0 to 8"),
        ("--path walk.json -o #.png --frames 1-2,0", "is not A-B,STEP"),
        ("--path walk.json -o #.png --frames all", "is not A-B,STEP"),
        ("--path walk.json -o #.png --chunk 4/4", "from 0 to N - 1, of N"),
        ("--path walk.json -o #.png --chunk 1", "from 0 to N - 1, of N"),
        ("--path walk.json -o #.png --contexts 0", "not a whole number from 1 to 64"),
        ("--path walk.json -o #.png --fps 0", "--fps 0: 0 frames per second: the number must be above 0"),
        ("--path walk.json -o #.png --fov-y 50", "--path tells the field of view"),
        ("--path walk.json -o #.png --eye 1,2,3", "cannot be used with"),
        ("--path walk.json --turntable 3 -o #.png", "cannot be used with"),
        ("--turntable 0 -o #.png", "not a whole number from 1"),
        ("-o #.png", "give --path, a file of keys, or --turntable, a number of frames, or --camera"),
        ("--turntable 2", "--output"),
    ] {
        let stderr = refused(folder, arguments);
        assert!(stderr.contains(said), "{arguments}: {stderr}");
    }
    assert!(frames(folder).is_empty(), "nothing is written: {:?}", names(folder));
}
