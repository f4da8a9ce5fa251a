//! The tree keeps the rules that make it easy to find one's way in.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below a folder, as paths from the root with slashes.
fn files(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    assert!(!found.is_empty());
    found
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap()
}

/// What a file of the library uses of the crate: the first segment of each `crate::` path, nested braces included.
fn used(text: &str) -> BTreeSet<String> {
    let mut used = BTreeSet::new();
    for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
        for rest in line.split("crate::").skip(1) {
            let first = |path: &str| {
                let path = path.trim_start();
                path[..path.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(path.len())].to_string()
            };
            match rest.strip_prefix('{') {
                Some(list) => used.extend(list.split('}').next().unwrap().split(',').map(first)),
                None => _ = used.insert(first(rest)),
            }
        }
    }
    used
}

/// Asserts that the files below `folder` use nothing of the crate but `allowed`.
#[track_caller]
fn uses_only(folder: &str, allowed: &[&str]) {
    for path in files(folder).iter().filter(|path| path.ends_with(".rs")) {
        for name in used(&read(path)) {
            assert!(allowed.contains(&name.as_str()), "{path} uses crate::{name}; {folder} may use {allowed:?}");
        }
    }
}

#[test]
fn every_shader_has_its_pass_and_every_pass_that_computes_has_its_twin() {
    // What only moves or marks texels has nothing to be compared with.
    const WITHOUT_TWIN: [&str; 5] = ["background", "composite", "half_depth", "probe", "resolve"];
    let shaders: Vec<String> =
        files("glsl").iter().filter_map(|path| Some(path.strip_suffix(".frag")?.into())).collect();
    assert!(shaders.contains(&"glsl/hbao".into()) && shaders.contains(&"glsl/blur".into()));
    for shader in shaders {
        let name = shader.strip_prefix("glsl/").unwrap();
        let pass = format!("src/pass/{name}.rs");
        assert!(root().join(&pass).is_file(), "{shader}.frag has no {pass}");
        assert!(read(&pass).contains(&format!("source!(\"{name}.frag\")")), "{pass} does not use its shader");
        if !WITHOUT_TWIN.contains(&name) {
            let twin = format!("src/reference/{name}.rs");
            assert!(root().join(&twin).is_file(), "{shader}.frag has no twin {twin}");
            let text = read(&format!("{shader}.frag"));
            let first_lines: Vec<&str> = text.lines().take_while(|line| line.starts_with("//")).collect();
            let comment = first_lines.join(" ").replace("// ", "");
            assert!(comment.contains(&twin), "{shader}.frag does not name its twin {twin}: {comment}");
            assert!(read(&twin).contains(&format!("glsl/{name}.frag")), "{twin} does not name its shader");
        }
    }
}

#[test]
fn the_reference_imports_no_opengl_and_no_shader() {
    uses_only("src/reference", &["scene", "image", "settings", "reference", "Error"]);
    for path in files("src/reference") {
        assert!(!read(&path).contains("glow"), "{path}");
    }
}

#[test]
fn scenes_images_and_settings_know_nothing_of_rendering() {
    uses_only("src/scene", &["scene", "settings", "Error"]);
    uses_only("src/image", &["image", "settings", "Error"]);
    assert_eq!(used(&read("src/settings.rs")), BTreeSet::from(["Error".into()]));
    uses_only("src/settings", &["settings", "Error"]);
}

#[test]
fn nothing_imports_the_command_or_the_viewer() {
    for path in files("src") {
        if !path.starts_with("src/cli") && !path.starts_with("src/viewer") && path != "src/main.rs" {
            for room in ["cli", "viewer"] {
                assert!(!used(&read(&path)).contains(room), "{path} imports {room}");
            }
        }
    }
}

#[test]
fn no_file_is_long_and_none_is_a_drawer() {
    for path in files("src").into_iter().chain(files("glsl")) {
        let lines = read(&path).lines().count();
        assert!(lines <= 500, "{path} has {lines} lines");
    }
    for path in files("src").into_iter().chain(files("tests")).chain(files("glsl")) {
        for part in path.split(['/', '.']) {
            assert!(!["utils", "util", "common", "helpers", "helper", "misc"].contains(&part), "{path}");
        }
    }
}

#[test]
fn no_line_of_comment_is_wider_than_code_may_be() {
    // rustfmt leaves comments as they are. These are still to be wrapped.
    const WIDER: [&str; 8] = [
        "src/scene/",
        "src/image/",
        "src/cli/paper/",
        "tests/hostile",
        "tests/memory.rs",
        "tests/stability",
        "tests/extremes.rs",
        "tests/rig/surfaces.rs",
    ];
    for path in files("src").into_iter().chain(files("tests")).chain(files("glsl")) {
        let source = [".rs", ".vert", ".frag", ".glsl"].iter().any(|end| path.ends_with(end));
        if source && !WIDER.iter().any(|start| path.starts_with(start)) {
            for (number, line) in (1..).zip(read(&path).lines()) {
                let comment = line.trim_start().starts_with("//");
                assert!(!comment || line.chars().count() <= 120, "{path}:{number}: {} columns", line.chars().count());
            }
        }
    }
}

#[test]
fn the_top_level_holds_only_what_belongs_there() {
    const FILES: [&str; 6] = ["Cargo.toml", "Cargo.lock", "README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];
    const FOLDERS: [&str; 4] = ["src", "glsl", "models", "tests"];
    // What git knows: a picture that somebody rendered here is not the repository's.
    let Ok(listing) = Command::new("git").args(["ls-tree", "-z", "--name-only", "HEAD"]).current_dir(root()).output()
    else {
        return;
    };
    // Nor is an unpacked archive a repository.
    for name in String::from_utf8(listing.stdout).unwrap().split_terminator('\0') {
        let allowed: &[&str] = if root().join(name).is_dir() { &FOLDERS } else { &FILES };
        assert!(name.starts_with('.') || allowed.contains(&name), "{name} does not belong at the top level");
    }
}

#[test]
fn the_rules_would_notice_an_import() {
    let text = "use crate::{gl, Error};\n// crate::cli\nfn f() { crate::pass::hbao::f() }\npub(crate) fn g() {}";
    assert_eq!(used(text), ["Error", "gl", "pass"].map(String::from).into());
}
