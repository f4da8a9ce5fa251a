//! The tree keeps the rules that make it easy to find one's way in.

use hbao::settings::Method;
use std::collections::{BTreeMap, BTreeSet};
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

/// The text of a Rust file without its comments, strings and unit tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let mut code = String::new();
    let mut in_string = false;
    for line in text.lines() {
        let mut characters = line.chars().peekable();
        while let Some(c) = characters.next() {
            match c {
                '\\' if in_string => _ = characters.next(),
                '"' => in_string = !in_string,
                _ if in_string => {}
                '\'' if characters.peek() == Some(&'"') => _ = characters.next(),
                '/' if characters.peek() == Some(&'/') => break,
                _ => code.push(c),
            }
        }
        code.push('\n');
    }
    code
}

/// The paths of a `use` tree, nested braces too: `a::{b, c::{d, e}}` is a::b, a::c::d and a::c::e. What is imported
/// under another name is told by its own.
fn leaves(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else {
        let path = tree.split(" as ").next().unwrap().trim();
        return if path.is_empty() { Vec::new() } else { vec![path.to_string()] };
    };
    let (prefix, list) = (
        &tree[..open],
        tree[open + 1..].trim_end().strip_suffix('}').unwrap_or_else(|| panic!("no import: use {tree}")),
    );
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    parts.into_iter().flat_map(leaves).map(|leaf| format!("{prefix}{leaf}").replace(' ', "")).collect()
}

/// The paths that a file's code imports with `use`, and those that it writes out. `again`: only those that it exports
/// again.
fn paths(code: &str, again: bool) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find("use ") {
        let before = rest[..at].rsplit('\n').next().unwrap_or("").trim();
        let after = &rest[at + 4..];
        let end = after.find(';').unwrap_or(after.len());
        let exported = before == "pub" || before.starts_with("pub(") && before.ends_with(')');
        // Otherwise these letters end another word.
        let imports = exported || before.is_empty();
        if imports && (exported || !again) {
            found.extend(leaves(&after[..end].replace('\n', " ")));
        }
        rest = if imports { &after[end..] } else { after };
    }
    if !again {
        for start in ["crate::", "super::"] {
            for (at, _) in code.match_indices(start) {
                let whole = code[..at].chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':');
                let end = code[at..].find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
                let path = code[at..at + end.unwrap_or(code.len() - at)].trim_end_matches(':');
                if whole && path.contains("::") {
                    found.push(path.to_string());
                }
            }
        }
    }
    found
}

/// The modules of the crate and of the command, which are one tree: their paths, and the files' code. The root has the
/// empty path and is both `lib.rs` and `main.rs`.
struct Modules(BTreeMap<Vec<String>, (String, String)>);

impl Modules {
    fn read() -> Modules {
        let sources = files("src").into_iter().filter(|file| file.ends_with(".rs") && file != "src/main.rs");
        Modules::of(sources.map(|file| (file.clone(), read(&file))))
    }

    /// The modules of files, given as their names and texts.
    fn of(files: impl IntoIterator<Item = (String, String)>) -> Modules {
        let module = |(file, text): (String, String)| {
            let name = file.strip_prefix("src/").unwrap().strip_suffix(".rs").unwrap();
            let path = name.trim_end_matches("/mod").split('/').map(String::from).collect();
            (if name == "lib" { Vec::new() } else { path }, (file, code(&text)))
        };
        Modules(files.into_iter().map(module).collect())
    }

    /// The module that a path written in `from` leads to. Names that a module exports again lead on to where they come
    /// from. None where the path leads out of the crate.
    fn resolve(&self, from: &[String], path: &str) -> Option<Vec<String>> {
        let mut segments: Vec<&str> = path.split("::").collect();
        let mut at = match *segments.first()? {
            "crate" | "hbao" => Vec::new(),
            "self" => from.to_vec(),
            "super" => from[..from.len().checked_sub(1)?].to_vec(),
            first => {
                // A child, in a path without a start.
                let child = [from, &[first.to_string()]].concat();
                if !self.0.contains_key(&child) {
                    return None;
                }
                segments.insert(0, "self");
                from.to_vec()
            }
        };
        for (i, segment) in segments.iter().enumerate().skip(1) {
            if *segment == "super" {
                at.pop();
                continue;
            }
            let child = [at.as_slice(), &[segment.to_string()]].concat();
            if self.0.contains_key(&child) {
                at = child;
                continue;
            }
            let (_, text) = &self.0[&at];
            let last = |path: &String| path.rsplit("::").next() == Some(segment);
            let exported = paths(text, true).into_iter().find(|path| last(path));
            return match exported.filter(|exported| *exported != segments[i..].join("::")) {
                Some(exported) => self.resolve(&at, &exported).or(Some(at)),
                None => Some(at),
            };
        }
        Some(at)
    }

    /// The modules that each module imports from, itself aside.
    fn imports(&self) -> BTreeMap<&[String], BTreeSet<Vec<String>>> {
        let of = |(path, (_, text)): (&Vec<String>, &(String, String))| {
            paths(text, false).iter().filter_map(|written| self.resolve(path, written)).collect()
        };
        self.0.iter().map(|entry| (entry.0.as_slice(), of(entry))).collect()
    }
}

/// Files that import each other in a circle, if there are any. Paths are cut to `depth` parts, so that 2 finds circles
/// between folders of a room. A module and the modules inside it count as one thing: a circle goes through modules that
/// stand side by side.
fn circle(modules: &Modules, depth: usize) -> Option<String> {
    let cut = |path: &[String]| path[..path.len().min(depth)].to_vec();
    let related = |a: &[String], b: &[String]| a.starts_with(b) || b.starts_with(a);
    let mut next: BTreeMap<Vec<String>, BTreeSet<Vec<String>>> = BTreeMap::new();
    for (path, imports) in modules.imports() {
        let imports = imports.iter().map(|import| cut(import)).filter(|import| !related(&cut(path), import));
        next.entry(cut(path)).or_default().extend(imports);
    }
    for start in next.keys() {
        let mut seen = BTreeSet::new();
        let mut open = vec![vec![start.clone()]];
        while let Some(way) = open.pop() {
            for import in &next[&way[way.len() - 1]] {
                let way = [way.as_slice(), std::slice::from_ref(import)].concat();
                if import == start {
                    return Some(way.iter().map(|path| path.join("/")).collect::<Vec<_>>().join(" -> "));
                }
                if seen.insert(import.clone()) {
                    open.push(way);
                }
            }
        }
    }
    None
}

/// The room of a module: the first part of its path.
fn room(path: &[String]) -> &str {
    path.first().map_or("", String::as_str)
}

/// The float64 twin of a shader, both of which name each other.
fn assert_twins(shader: &str) {
    let (shader, twin) = (format!("glsl/{shader}.frag"), format!("src/reference/{shader}.rs"));
    assert!(root().join(&twin).is_file(), "{shader} has no twin {twin}");
    let text = read(&shader);
    let first_lines: Vec<&str> = text.lines().take_while(|line| line.starts_with("//")).collect();
    let comment = first_lines.join(" ").replace("// ", "");
    assert!(comment.contains(&twin), "{shader} does not name its twin {twin}: {comment}");
    assert!(read(&twin).contains(&shader), "{twin} does not name its shader {shader}");
}

#[test]
fn every_shader_has_its_pass_and_every_pass_that_computes_has_its_twin() {
    // These passes move or mark texels and compute nothing that a twin could be compared with.
    const WITHOUT_TWIN: [&str; 7] = ["apply", "background", "composite", "half_depth", "inspect", "probe", "resolve"];
    let of_methods: BTreeSet<&str> =
        Method::ALL.iter().filter_map(|method| method.facts().shader.last()).copied().collect();
    let shaders: Vec<String> = files("glsl")
        .iter()
        .filter_map(|path| Some(path.strip_prefix("glsl/")?.strip_suffix(".frag")?.into()))
        .collect();
    assert!(shaders.contains(&"hbao".into()) && shaders.contains(&"blur".into()));
    for name in &shaders {
        let file = format!("{name}.frag");
        if !of_methods.contains(file.as_str()) {
            let pass = format!("src/pass/{name}.rs");
            assert!(root().join(&pass).is_file(), "glsl/{file} has no {pass} and belongs to no method");
            assert!(read(&pass).contains(&format!("source!(\"{file}\")")), "{pass} does not use its shader");
        }
        if !WITHOUT_TWIN.contains(&name.as_str()) {
            assert_twins(name);
        }
    }
    for shader in of_methods {
        assert!(shaders.iter().any(|name| format!("{name}.frag") == shader), "glsl/{shader} is missing");
    }
}

/// The rooms of the library, and what each may import of the others. `measure` sees images, numbers and a way to
/// render; of the passes it sees the types that stand in the library's interface.
const ROOMS: [(&str, &[&str]); 15] = [
    ("error", &[]),
    ("projection", &["error"]),
    ("encoding", &["error", "projection"]),
    ("threads", &[]),
    ("settings", &["error", "projection"]),
    ("context", &["error", "threads"]),
    ("image", &["error"]),
    ("tile", &["image", "settings"]),
    ("scene", &["error", "projection"]),
    ("gl", &["error"]),
    ("pass", &["error", "encoding", "gl", "projection", "scene", "settings", "tile"]),
    ("ambient_occlusion", &["error", "encoding", "gl", "image", "pass", "projection", "settings"]),
    ("pipeline", &["error", "ambient_occlusion", "encoding", "gl", "image", "pass", "projection", "scene", "settings"]),
    ("reference", &["error", "encoding", "image", "projection", "scene", "settings", "threads"]),
    (
        "measure",
        &[
            "error",
            "ambient_occlusion",
            "encoding",
            "gl",
            "image",
            "pass",
            "pipeline",
            "projection",
            "reference",
            "scene",
            "settings",
            "tile",
        ],
    ),
];
/// The rooms of the command. They may import the library and those before them.
const COMMAND: [&str; 6] = ["terminal", "heat", "picture", "report", "viewer", "cli"];

/// A file that imports one that is not below it, if there is any.
fn upward(modules: &Modules) -> Option<String> {
    let may_import = |from: &str, to: &str| {
        let library = ROOMS.iter().any(|(name, _)| *name == to);
        match (ROOMS.iter().find(|(name, _)| *name == from), COMMAND.iter().position(|name| *name == from)) {
            (Some((_, allowed)), _) => allowed.contains(&to),
            (None, Some(place)) => library || COMMAND[..place].contains(&to),
            (None, None) => panic!("the room src/{from} has no place in the order of rooms: give it one"),
        }
    };
    // The root imports rooms only to hand them on.
    for (path, imports) in modules.imports().iter().filter(|(path, _)| !path.is_empty()) {
        for import in imports.iter().filter(|import| !import.is_empty() && room(import) != room(path)) {
            if !may_import(room(path), room(import)) {
                return Some(format!("{} imports {}", modules.0[*path].0, modules.0[import].0));
            }
        }
    }
    None
}

#[test]
fn rooms_import_only_the_rooms_below_them() {
    assert_eq!(upward(&Modules::read()), None);
}

#[test]
fn no_two_files_import_each_other_by_whatever_way_round() {
    let modules = Modules::read();
    assert_eq!(circle(&modules, usize::MAX), None, "files");
    assert_eq!(circle(&modules, 2), None, "folders");
}

#[test]
fn the_rules_would_notice_a_circle_and_an_import_upwards() {
    let modules =
        |texts: &[(&str, &str)]| Modules::of(texts.iter().map(|(file, text)| ((*file).into(), (*text).into())));
    let root = ("src/lib.rs", "mod gl;\nmod scene;\npub use gl::Texture;");
    let fine = [root, ("src/gl/mod.rs", "pub struct Texture;"), ("src/scene/mod.rs", "mod a;\nmod b;")];
    assert_eq!((circle(&modules(&fine), usize::MAX), upward(&modules(&fine))), (None, None));

    let [a, b] =
        [("src/scene/a.rs", "use super::b::{self, B};"), ("src/scene/b.rs", "use crate::{scene::{a::A}, gl};")];
    assert!(circle(&modules(&[&fine[..], &[a, b]].concat()), usize::MAX).is_some());
    // What a module exports again is imported from where it stands.
    let [again, b] = [("src/scene/mod.rs", "mod a;\nmod b;\npub use a::A;"), ("src/scene/b.rs", "use super::A;")];
    assert!(circle(&modules(&[fine[0], fine[1], again, a, b]), usize::MAX).is_some());
    // Through the folders' own files, where no two files import each other.
    let [c, d] = [("src/scene/c/mod.rs", "use super::d::e::E;"), ("src/scene/c/f.rs", "")];
    let [e, g] = [("src/scene/d/e.rs", ""), ("src/scene/d/mod.rs", "use super::c::f::F;")];
    let folders = modules(&[&fine[..], &[c, d, e, g]].concat());
    assert!(circle(&folders, usize::MAX).is_none() && circle(&folders, 2).is_some());

    let above = ("src/scene/a.rs", "fn f() -> crate::Texture { crate::gl::Texture }");
    let found = upward(&modules(&[&fine[..], &[above]].concat()));
    assert_eq!(found.as_deref(), Some("src/scene/a.rs imports src/gl/mod.rs"));
}

#[test]
fn the_reference_knows_no_opengl() {
    for path in files("src/reference").iter().filter(|path| path.ends_with(".rs")) {
        assert!(!read(path).contains("glow"), "{path}");
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
    // rustfmt leaves comments as they are.
    for path in files("src").into_iter().chain(files("tests")).chain(files("glsl")) {
        let source = [".rs", ".vert", ".frag", ".glsl"].iter().any(|end| path.ends_with(end));
        if source {
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
    let text = "use crate::{gl, a::{B, c::{d, self}}, Error as E};\n// use crate::cli\nfn f() { crate::pass::hbao::f(\"crate::x\") }\n\
                pub(crate) use super::method::{A};\npub(crate) fn g() {}\n#[cfg(test)]\nmod tests { use crate::no; }";
    let text = code(text);
    let found = ["crate::gl", "crate::a::B", "crate::a::c::d", "crate::a::c::self", "crate::Error", "super::method::A"];
    for path in found.into_iter().chain(["crate::pass::hbao::f"]) {
        assert!(paths(&text, false).iter().any(|one| one == path), "{path} of {:?}", paths(&text, false));
    }
    assert!(!paths(&text, false).iter().any(|path| path.contains("cli") || path.contains("no") || path.contains("x")));
    assert_eq!(paths(&text, true), ["super::method::A"]);
}

#[test]
fn every_loop_over_directions_stays_a_loop_where_there_are_too_many_samples() {
    let mut loops = 0;
    for path in files("glsl") {
        let text = read(&path);
        for line in text.lines().filter(|line| line.contains("for (") && line.contains("k = 0")) {
            loops += 1;
            let sampled = text.contains("direction(k, ");
            assert!(!sampled || line.contains("k < direction_count"), "{path}: {line}");
        }
    }
    assert!(loops >= 4, "{loops}");
}
