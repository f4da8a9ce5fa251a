//! Whatever a file contains, it is read, or it is refused in one line. This is tested with every file of the corpus in
//! `tests/hostile`, and with mutations of them from a fixed seed. `HBAO_FUZZ_CASES` sets the number of mutations of
//! each kind of file. `tests/fuzz/run` continues with a fuzzer that is guided by coverage.

#[path = "hostile/promises.rs"]
mod promises;
#[path = "rig/random.rs"]
#[allow(dead_code, unreachable_pub)]
mod random;

use glam::DVec3;
use hbao::scene::Mesh;
use random::Draw;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

/// Returns the files of one folder of the corpus, sorted by name.
fn corpus(folder: &str) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(tests().join("hostile").join(folder)).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        paths.map(|path| (path.file_name().unwrap().to_str().unwrap().into(), fs::read(path).unwrap())).collect();
    files.sort();
    assert!(files.len() > 10, "the corpus of {folder} is missing");
    files
}

/// Returns how many mutations to try.
fn cases(default: u64) -> u64 {
    std::env::var("HBAO_FUZZ_CASES").map_or(default, |cases| cases.parse().unwrap())
}

/// Returns the words of the fuzzer's dictionary, which has one quoted string per line.
fn dictionary() -> Vec<Vec<u8>> {
    let text = fs::read_to_string(tests().join("hostile/dictionary")).unwrap();
    let word = |line: &str| {
        let mut rest = line.strip_prefix('"').unwrap().strip_suffix('"').unwrap();
        let mut word = Vec::new();
        while let Some(c) = rest.chars().next() {
            let (byte, length) = match rest.strip_prefix("\\x") {
                Some(digits) => (u8::from_str_radix(&digits[..2], 16).unwrap(), 4),
                None if c == '\\' => (rest.as_bytes()[1], 2),
                None => (rest.as_bytes()[0], 1),
            };
            word.push(byte);
            rest = &rest[length..];
        }
        word
    };
    text.lines().map(word).collect()
}

/// Returns a file of the corpus with up to six changes: to bytes, words or whole stretches, or with parts of another
/// file.
fn mutated(files: &[(String, Vec<u8>)], words: &[Vec<u8>], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = draw.one(files).1.clone();
    for _ in 0..1 + draw.below(6) {
        let at = draw.below(bytes.len() + 1);
        let end = at + draw.below((bytes.len() - at).min(40) + 1);
        match draw.below(9) {
            0 if at < bytes.len() => bytes[at] ^= 1 << draw.below(8),
            1 if at < bytes.len() => bytes[at] = draw.below(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => drop(bytes.splice(at..at, draw.one(words).iter().copied())),
            4 => {
                // This replaces the word at this place.
                let space = |byte: &u8| byte.is_ascii_whitespace() || b"/=[]".contains(byte);
                let start = bytes[..at].iter().rposition(space).map_or(0, |place| place + 1);
                let end = bytes[at..].iter().position(space).map_or(bytes.len(), |place| at + place);
                drop(bytes.splice(start..end, draw.one(words).iter().copied()));
            }
            5 => {
                let most = if draw.below(20) == 0 { 3000 } else { 5 };
                let part = bytes[at..end].repeat(1 + draw.below(most));
                drop(bytes.splice(at..at, part));
            }
            6 => {
                let other = &draw.one(files).1;
                let cut = draw.below(other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[cut..]);
            }
            7 => {
                let mut lines: Vec<Vec<u8>> =
                    bytes.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
                let (one, other) = (draw.below(lines.len()), draw.below(lines.len()));
                if one != other {
                    lines.swap(one, other);
                }
                bytes = lines.concat();
            }
            8 if draw.below(4) == 0 => bytes.truncate(at),
            _ => {}
        }
    }
    bytes
}

/// Prints the input if the test panics while this value exists.
struct Tried<'a>(&'a [u8]);

impl Drop for Tried<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the input, {} bytes: {}", self.0.len(), self.0[..self.0.len().min(4000)].escape_ascii());
        }
    }
}

/// Tries every file of a folder, and mutations of them. The name of a file starts with 0 if it must be accepted, and
/// with 1 if it must be refused. For pictures, 0 means that the file has text, and for material files, that there is no
/// notice about the file. Both outcomes must be frequent among the mutations, or else these are too wild or too tame.
fn hold(folder: &str, seed: u64, default: u64, promise: impl Fn(&[u8]) -> bool) {
    let (files, words) = (corpus(folder), dictionary());
    let mut accepted = 0;
    let mut otherwise = Vec::new();
    for (name, bytes) in &files {
        let _tried = Tried(name.as_bytes());
        let outcome = if promise(bytes) { "0_" } else { "1_" };
        if !name.starts_with(outcome) {
            otherwise.push(format!("{outcome} {folder}/{name}"));
        }
    }
    assert!(otherwise.is_empty(), "the outcomes contradict the names of these files:\n{}", otherwise.join("\n"));
    let (cases, mut draw) = (cases(default), Draw::new(seed.into()));
    for _ in 0..cases {
        let bytes = mutated(&files, &words, &mut draw);
        let _tried = Tried(&bytes);
        accepted += u64::from(promise(&bytes));
    }
    println!("{folder}: {} files, {cases} mutations, {accepted} of them accepted", files.len());
    assert!(accepted * 50 > cases && accepted * 50 < 49 * cases, "{accepted} of {cases} accepted");
}

/// The materials for the models, and the model for the materials.
const MTL: &[u8] = b"newmtl a\nKd 0.5 1 0\nnewmtl b\nKd 1\n";
const OBJ: &[u8] = b"mtllib m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b c\nf 1 2 3\n";

#[test]
fn a_model_is_a_mesh_that_holds_together_or_is_refused_in_one_line() {
    hold("obj", 1, 30_000, |obj| promises::model(obj, MTL).is_some());
}

#[test]
fn a_model_of_another_format_holds_together_or_is_refused_in_one_line() {
    hold("formats", 6, 30_000, promises::any_model);
}

#[test]
fn a_material_file_gives_colours_or_a_notice_and_refuses_no_model() {
    hold("mtl", 2, 30_000, |mtl| {
        let notices = promises::model(OBJ, mtl).expect("the model is refused because of its materials");
        !notices.iter().any(|notice| notice.starts_with("m: "))
    });
}

#[test]
fn a_settings_file_gives_settings_that_a_file_keeps_or_is_refused_in_one_line() {
    hold("settings", 3, 30_000, |bytes| promises::settings(&String::from_utf8_lossy(bytes)));
}

#[test]
fn a_picture_is_read_or_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture");
    hold("pictures", 4, 3_000, |bytes| {
        fs::write(&path, bytes).unwrap();
        promises::picture(&path)
    });
}

#[test]
fn models_that_tobj_reads_too_are_read_as_it_reads_them() {
    let mut draw = Draw::new(5);
    for _ in 0..300 {
        let mut text = String::new();
        let (positions, normals) = (3 + draw.below(9), 1 + draw.below(4));
        let number = |draw: &mut Draw| (draw.below(2001) as f64 - 1000.0) / 7.0;
        for keyword in std::iter::repeat_n("v", positions).chain(std::iter::repeat_n("vn", normals)) {
            let [x, y, z] = std::array::from_fn(|_| number(&mut draw));
            text += &format!("{keyword} {x} {y} {z:e}\n");
        }
        for _ in 0..1 + draw.below(12) {
            let mut index = |count: usize| {
                let i = 1 + draw.below(count) as i64;
                if i % 3 == 0 { i - count as i64 - 1 } else { i }
            };
            text += "f";
            (0..3).for_each(|_| text += &format!(" {}//{}", index(positions), index(normals)));
            text += "\n";
        }
        let (ours, notices) = Mesh::read_obj(text.as_bytes(), Path::new("model.obj"), |_| Ok(MTL)).unwrap();
        assert!(notices.is_empty(), "{notices:?}: {text}");
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let (theirs, _) = tobj::load_obj_buf(&mut Cursor::new(&text), &options, |_| unreachable!()).unwrap();
        let vectors = |flat: &[f64]| flat.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>();
        let [tobj::Model { mesh: theirs, .. }] = &theirs[..] else { panic!("{} models: {text}", theirs.len()) };
        let triangles = theirs.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let theirs = Mesh::new(vectors(&theirs.positions), triangles).unwrap().with_normals(vectors(&theirs.normals));
        assert_eq!(ours, theirs.unwrap(), "{text}");
    }
}
