//! Checks that the command reads scenes as other programs write and name them: what is left out of a scene stops no
//! verb, and is told in one line for each kind.

use crate::rig::command::{cached, hbao, notices, of_arguments, texts, with_shader_cache};
use std::fs;
use tempfile::TempDir;

/// A triangle whose material file is missing and whose normals are bad.
const LACKING: &str = "mtllib C:\\Users\\a b\\none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 0\nvn 0 0 0\nusemtl red\n\
    f 1//1 2//1 3//7\n";

/// What is told about a model of this content, whatever verb reads it.
fn told(path: &str) -> [String; 3] {
    let triangles = "the triangles give the normal there";
    [
        format!("hbao: {path}: line 5: \"nan\" is not a finite number (the first of 2 such normals); {triangles}"),
        format!(
            "hbao: {path}: line 8: index 7 is out of range; 2 vn lines stand before it, counted from 1; {triangles}"
        ),
        format!(
            "hbao: {path}: line 1: material file \"C:/Users/a b/none.mtl\" is not beside the model; \
             its materials are white"
        ),
    ]
}

#[test]
fn every_verb_tells_what_is_left_out_of_a_scene_and_goes_on() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("m.obj"), LACKING).unwrap();
    for arguments in
        ["render m.obj -o out.png --size 8x8", "truth m.obj -o out.exr --size 8x8 --truth-rays 2 --normals vertex"]
    {
        let output = cached(folder.path(), arguments);
        let [_, stderr] = texts(&output);
        assert!(output.status.success(), "{arguments}: {stderr}");
        let lines: Vec<_> = notices(&stderr).into_iter().filter(|line| line.contains("m.obj")).collect();
        assert_eq!(lines, told("m.obj"), "{arguments}");
    }
    // These verbs take long. Each is stopped by a size that no driver has, after it has read the scene.
    for verb in ["bench", "trade", "tune -o t.toml --max-error 0.1"] {
        let output = cached(folder.path(), &format!("{verb} m.obj --size 100000x100000"));
        let [_, stderr] = texts(&output);
        assert!(!output.status.success(), "{verb}: {stderr}");
        assert_eq!(notices(&stderr)[..3], told("m.obj"), "{verb}");
    }
    // The report is stopped by its next model.
    let models = folder.path().join("models");
    fs::create_dir(&models).unwrap();
    fs::write(models.join("dragon.obj"), LACKING).unwrap();
    fs::write(models.join("sponza.obj"), "f 1 2 3\n").unwrap();
    let output = cached(folder.path(), "paper -o report --size 64x48 --models models");
    let [_, stderr] = texts(&output);
    let lines = notices(&stderr);
    assert_eq!(lines[..3], told("models/dragon.obj"), "{stderr}");
    assert!(lines[3].starts_with("hbao: models/sponza.obj: line 1: index 1 is out of range"), "{stderr}");
}

#[test]
fn a_scene_that_lacks_nothing_has_no_notice() {
    let folder = TempDir::new().unwrap();
    // Two triangles meet at a right angle, so that they occlude each other.
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nusemtl red\nf 1//1 2//1 3//1\nf 1 3 4\n";
    fs::write(folder.path().join("m.obj"), obj.replace('\n', "\r")).unwrap();
    fs::write(folder.path().join("M.MTL"), "newmtl red\rKd 1 0 0\r").unwrap();
    let output = cached(folder.path(), "truth m.obj -o out.exr --size 16x16 --truth-rays 16 --radius 1");
    let [_, stderr] = texts(&output);
    assert!(output.status.success() && stderr.lines().count() == 1 && !stderr.contains("m.obj"), "{stderr}");
}

#[test]
#[cfg(target_os = "linux")]
fn scenes_and_settings_may_have_names_that_are_not_utf8() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;
    let folder = TempDir::new().unwrap();
    let [scene, settings] = [b"caf\xe9.obj".as_slice(), b"caf\xe9.toml"].map(OsStr::from_bytes);
    fs::write(folder.path().join(scene), LACKING).unwrap();
    fs::write(folder.path().join(settings), "steps = 3\n").unwrap();
    let of = |words: &str| words.split_whitespace().map(OsString::from).collect::<Vec<_>>();
    for verb in ["render --size 8x8 -o out.png", "truth --size 8x8 --truth-rays 2 -o out.exr"] {
        let mut arguments = of(verb);
        arguments.extend([scene.into(), "--settings".into(), settings.into()]);
        let output = with_shader_cache(&mut of_arguments(folder.path(), &arguments)).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{verb}: {stderr}");
        let lines: Vec<_> = notices(&stderr).into_iter().filter(|line| line.contains(".obj")).collect();
        assert_eq!(lines, told("caf\u{fffd}.obj"), "{verb}");
    }
    let missing: Vec<OsString> = [of("truth -o out.exr"), vec![OsStr::from_bytes(b"\xff\n.obj").into()]].concat();
    let output = of_arguments(folder.path(), &missing).output().unwrap();
    let [_, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.starts_with("hbao: \u{fffd} .obj: no such file") && stderr.lines().count() == 1, "{stderr}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_scene_on_standard_input_finds_its_materials_if_it_is_a_file() {
    let folder = TempDir::new().unwrap();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let path = folder.path().join("m.obj");
    fs::write(&path, obj).unwrap();
    fs::write(folder.path().join("m.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    let run = |input: std::process::Stdio| {
        let mut command = hbao(folder.path(), "truth /dev/stdin -o out.exr --size 8x8 --truth-rays 2");
        let [_, stderr] = texts(&command.stdin(input).output().unwrap());
        stderr
    };
    let stderr = run(fs::File::open(&path).unwrap().into());
    assert!(stderr.starts_with("hbao: truth: "), "{stderr}");
    // A pipe has no folder.
    let mut echo = std::process::Command::new("cat").arg(&path).stdout(std::process::Stdio::piped()).spawn().unwrap();
    let stderr = run(echo.stdout.take().unwrap().into());
    assert!(echo.wait().unwrap().success());
    assert!(
        stderr.starts_with("hbao: /dev/stdin: line 1: material file \"m.mtl\" is not beside the model"),
        "{stderr}"
    );
}
