//! Whatever the command line contains, the command does it, or refuses it in one line and leaves nothing behind. The
//! tests try every file of `tests/hostile/command_lines`, which has one argument on each line. They also try random
//! commands from the command's grammar: a hundredth as many as `HBAO_FUZZ_CASES` sets. Finally, whatever the command is
//! given to read, it must end and use little memory.

use crate::rig::command::{HBAO, by, hbao, of_arguments, with_shader_cache};
use crate::rig::random::Draw;
use hbao::settings::Method;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::sync::Mutex;

fn hostile() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile")
}

/// Returns the sorted paths of the files of a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Runs a command in an empty folder, and asserts what must hold for every command. Returns its exit code.
fn run(arguments: &[OsString]) -> i32 {
    let folder = tempfile::tempdir().unwrap();
    let output = with_shader_cache(&mut of_arguments(folder.path(), arguments)).output().unwrap();
    let code = holds(&output, &format!("{arguments:?}"));
    let left = files(folder.path());
    assert!(code == 0 || left.is_empty(), "{arguments:?}: it failed, but left {left:?}");
    assert!(left.iter().all(|path| !path.to_str().unwrap().ends_with(".tmp")), "{arguments:?}: {left:?}");
    code
}

/// Checks that the exit code says success, failure or wrong usage, that every line on stderr is the command's own, and
/// that a command that did not succeed gives its reason in exactly one line. Returns the exit code.
fn holds(output: &Output, what: &str) -> i32 {
    let stderr = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code().unwrap_or_else(|| panic!("{what}: {}: {stderr}", output.status));
    assert!((0..=2).contains(&code), "{what}: {code}: {stderr}");
    assert!(!stderr.chars().any(|c| c.is_control() && c != '\n'), "{what}: {stderr:?}");
    let mut errors = 0;
    for line in stderr.split_terminator('\n') {
        let Some(line) = line.strip_prefix("hbao: ") else { panic!("{what}: a line not of hbao: {stderr}") };
        const NOTICES: [&str; 11] = [
            ", OpenGL ",
            " has no effect ",
            " covered pixels, ",
            " per pixel, not the ",
            "is parallel to the direction of view",
            "nothing is in view",
            "is clipped",
            "is used",
            "; the triangles give the normal there",
            "; its materials are white",
            "; its triangles are white",
        ];
        errors += i32::from(!NOTICES.iter().any(|notice| line.contains(notice)));
    }
    assert!(code == 0 || errors == 1, "{what}: exit code {code}, {errors} lines with a reason: {stderr}");
    code
}

/// The flags that most verbs take, with values in range, and with values at the limit of the range or beyond it.
const FLAGS: &[(&str, &[&str], &[&str])] = &[
    (
        "--size",
        &["8x8", "1x1", "1x9", "7x3"],
        &["0x0", "4294967295x4294967295", "4294967296x1", "65536x65536", "8X8", "8x8x8", "x", "-1x1"],
    ),
    ("--eye", &["0,0,-3", "1,2,3"], &["0,0", "1e999,0,0", "nan,0,0", "1e308,-1e308,1e308", "5e-324,0,0", ",,"]),
    ("--target", &["0.3,0.3,0"], &["0,0,0,0", "inf,0,0", "1e300,0,0", ""]),
    ("--up", &["0,1,0", "0,0,1"], &["0,0,0", "1e-320,0,0", "1e308,1e308,1e308", "a,b,c"]),
    ("--fov-y", &["1", "60", "175"], &["0", "180", "-1", "nan", "1e-300", "174.99999999999999999"]),
    ("--ortho", &["2", "1e-6"], &["0", "-0", "inf", "1e308", "5e-324"]),
    ("--near", &["1e-3", "0.5"], &["0", "-1", "nan", "1e308", "5e-324"]),
    ("--far", &["100", "1e6"], &["0", "inf", "1e-300", "1e308"]),
    ("--method", Method::NAMES, &["HBAO", "gtao", "hbao ", ""]),
    ("--radius", &["1", "2%", "1e6"], &["0", "-1", "nan", "%", "1e999", "1e308", "5e-324", "1e308%", "5e-324%"]),
    ("--directions", &["1", "4"], &["0", "65", "4294967296", "-1", "4.0", "0x4"]),
    ("--steps", &["1", "4"], &["0", "257", "4294967295", "18446744073709551616"]),
    ("--rays", &["1", "2"], &["0", "65", "1e2"]),
    ("--bias", &["0", "30", "89"], &["90", "-1", "nan", "89.00000000000001", "5e-324"]),
    ("--strength", &["1", "3"], &["0", "inf", "1e308", "5e-324"]),
    ("--attenuation", &["quadratic", "linear", "none"], &["cubic"]),
    ("--snap", &["step", "sample", "none"], &["steps"]),
    ("--clamp", &["position", "depth"], &["edge"]),
    ("--exit", &["paper", "shorten"], &["early"]),
    ("--grounding", &["sample", "direction"], &["x"]),
    ("--normals", &["derivative", "vertex"], &["face"]),
    ("--jitter", &["tile", "none"], &["noise"]),
    ("--blur", &["0", "3", "9"], &["1", "2", "43", "4294967297", "-9"]),
    ("--blur-kernel", &["separable", "full"], &["box"]),
    ("--blur-depth-sigma", &["1", "1e-6"], &["0", "nan", "1e308", "5e-324", ""]),
    ("--msaa", &["1", "4"], &["0", "3", "16", "4294967295"]),
    ("--edges", &["supersample", "off"], &["on"]),
    ("--half-res", &[], &["--half-res=maybe", "--half-res=true", "--half-res"]),
    ("--ssao-samples", &["8", "24"], &["9", "0"]),
    ("--depth-format", &["r32f", "r16f"], &["r8"]),
    ("--ao-format", &["r8", "r16f", "r32f"], &["rgba8"]),
    ("--normal-format", &["rgba8-snorm", "rgba16f"], &["none"]),
    ("--backend", &["auto", "egl", "osmesa"], &["wgl", ""]),
    ("--truth-rays", &["2", "16"], &["0", "1", "3", "65538", "4294967295", "4294967296", "-2"]),
    ("--runs", &["1"], &["0", "1001", "4294967295", "18446744073709551616", "1.5"]),
    ("--show", &["final", "ao", "ao-raw", "color", "depth", "normals", "edges", "exits"], &["all", ""]),
    ("--apply", &["all", "ambient"], &["none"]),
    ("--dump", &["dumped"], &["none/dumped", ""]),
    ("--timings", &["t.json", "-"], &["t.png", "none/t.json", ""]),
    ("--json", &["j.json"], &["j", "none/j.json"]),
    ("--max-error", &["0.5"], &["0", "nan", "-1", "inf"]),
    ("--max-ms", &["5"], &["0", "nan", "1e999"]),
    ("--only", &["figure1"], &["", "figure2", "table,,"]),
    ("--models", &[], &["none", "/dev/null", ""]),
    ("-o", &["out.png", "out.exr", "-"], &["out", ".png", "none/out.png", "", ".", "/", "out.png/"]),
];

/// Values that are valid for no flag.
const ANYWHERE: [&str; 22] = [
    "",
    " ",
    "nan",
    "-",
    "--",
    "=",
    "%",
    "-0",
    "1e999",
    "9223372036854775808",
    "1,2",
    "\u{feff}8",
    "\u{ff18}",
    "a\nb",
    "a\r\nhbao: b",
    "\x1b[2J",
    "'",
    "\\",
    "--help=1",
    "-h8",
    "true",
    "\u{202e}",
];

/// Whether a verb has a flag.
fn offered(verb: &str, flag: &str) -> bool {
    static HELP: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());
    let mut help = HELP.lock().unwrap();
    let text = help.entry(verb.into()).or_insert_with(|| {
        let output = hbao(Path::new("."), &format!("{verb} --help")).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    });
    text.contains(&format!("{flag} "))
}

/// Draws a random command from the grammar.
fn draw(choices: &mut Draw, seeds: &[PathBuf]) -> Vec<OsString> {
    let verb =
        *choices.one(&["render", "render", "truth", "truth", "truth", "trade", "tune", "bench", "paper", "info"]);
    // Verbs that take long are only drawn with arguments that are refused.
    let short = matches!(verb, "render" | "truth");
    // Kind 0 has flags in range and a scene that can be rendered, kind 1 has a file of the corpus instead, and kind 2
    // has flags out of range.
    let kind = if short { choices.below(3) } else { 2 };
    let mut arguments: Vec<OsString> = vec![verb.into()];
    if short || choices.below(2) == 0 {
        arguments.extend(["--size".into(), "8x8".into(), "-o".into(), if short { "out.png" } else { "out" }.into()]);
    }
    for i in 0..1 + choices.below(4) {
        let (flag, good, bad) = *choices.one(FLAGS);
        let wild = kind == 2 && (i == 0 || choices.below(3) == 0);
        let taken = arguments.iter().any(|argument| argument == flag);
        if !wild && (taken || good.is_empty() || !offered(verb, flag)) {
            continue;
        }
        if taken {
            // Of a flag given twice the last value counts, so the first one, which would not be tried, is removed.
            let at = arguments.iter().position(|argument| argument == flag).unwrap();
            arguments.drain(at..(at + 2).min(arguments.len()));
        }
        let value: OsString = match choices.below(8) {
            _ if !wild => (*choices.one(good)).into(),
            0 => (*choices.one(&ANYWHERE)).into(),
            1 => "9".repeat(5000).into(),
            2 => OsString::from_vec(b"\xff\xfe8".into()),
            _ => (*choices.one(bad)).into(),
        };
        let joined = value.to_str().is_some_and(|value| value.starts_with(flag));
        arguments.extend((!joined).then(|| flag.into()));
        arguments.push(value);
    }
    match kind {
        0 => arguments.extend((choices.below(2) == 0).then(|| "nave".into())),
        1 if choices.below(2) == 0 => arguments.push(choices.one(seeds).into()),
        1 => arguments.extend(["--settings".into(), choices.one(seeds).into()]),
        _ if choices.below(2) == 0 => arguments.push((*choices.one(&ANYWHERE)).into()),
        _ => arguments.push((*choices.one(&["/dev/null", "/", ".", "/dev/zero", "missing.obj"])).into()),
    }
    arguments
}

#[test]
fn every_command_is_carried_out_or_refused_in_one_line() {
    for path in files(&hostile().join("command_lines")) {
        let text = fs::read_to_string(&path).unwrap();
        let corpus = hostile();
        let arguments: Vec<OsString> =
            text.lines().map(|line| line.replace("CORPUS", corpus.to_str().unwrap()).into()).collect();
        let name = path.file_name().unwrap().to_str().unwrap();
        let expected: i32 = name.split('_').next().unwrap().parse().unwrap();
        assert_eq!(run(&arguments), expected, "{name}: {arguments:?}");
    }
    let folders = ["obj", "mtl", "settings", "pictures"].map(|folder| files(&hostile().join(folder)));
    let cases = std::env::var("HBAO_FUZZ_CASES").map_or(300, |cases| cases.parse::<usize>().unwrap() / 100);
    let (mut choices, mut codes) = (Draw::new(1), [0; 3]);
    for _ in 0..cases {
        let arguments = draw(&mut choices, &folders.concat());
        codes[run(&arguments) as usize] += 1;
    }
    println!("{cases} commands: {} done, {} failed, {} refused", codes[0], codes[1], codes[2]);
    assert!(codes.iter().all(|&count| count * 20 > cases), "{codes:?}");
}

/// Runs `hbao` with at most this many KiB of address space, and with `input` on its standard input.
fn within(kib: u32, arguments: &str, input: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    let line = format!("ulimit -v {kib} && exec \"$0\" {arguments}");
    let mut child = by("sh", folder.path())
        .args(["-c", &line, HBAO])
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Writing fails if the command has seen enough and has closed the pipe.
    drop(input(&mut child.stdin.take().unwrap()));
    let output = child.wait_with_output().unwrap();
    let code = holds(&output, arguments);
    assert!(code == 0 || files(folder.path()).is_empty(), "{arguments}: it failed, but left a file");
    (code, String::from_utf8_lossy(&output.stderr).into_owned())
}

const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
#[cfg(target_os = "linux")]
fn what_never_ends_is_refused_and_a_pipe_is_read_in_little_memory() {
    let nothing = |_: &mut dyn Write| Ok(());
    let truth = "truth -o out.exr --size 4x4 --truth-rays 2";
    let little = 200 << 10;
    for (arguments, what) in [
        (format!("{truth} /dev/zero"), "/dev/zero: line 1: more than 2097152 bytes"),
        (format!("{truth} /dev/urandom --settings /dev/zero"), "/dev/zero: too long"),
    ] {
        let (code, stderr) = within(little, &arguments, nothing);
        assert!(code == 1 && stderr.contains(what), "{arguments}: {stderr}");
    }
    let piped = |over: &'static [u8]| {
        within(little, &format!("{truth} /dev/stdin"), move |pipe| {
            let block = over.repeat((1 << 20) / over.len());
            (0..300).try_for_each(|_| pipe.write_all(&block))
        })
    };
    for (over, what) in [
        (b"foo 1 2 3\n".as_slice(), "/dev/stdin: holds no faces"),
        (b"\n", "/dev/stdin: holds no faces"),
        (b"abcdefgh", "/dev/stdin: line 1: more than 2097152 bytes"),
        (b"v 1 2\n", "/dev/stdin: line 1: v needs three numbers"),
    ] {
        let (code, stderr) = piped(over);
        assert!(code == 1 && stderr.contains(what), "{:?}: {stderr}", over.escape_ascii());
    }
    let (code, stderr) = within(little, &format!("{truth} /dev/stdin"), |pipe| pipe.write_all(TRIANGLE));
    assert_eq!(code, 0, "{stderr}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_machine_without_enough_memory_ends_the_command_in_one_line() {
    let nothing = |_: &mut dyn Write| Ok(());
    let large = "truth -o out.exr --size 8192x8192 --truth-rays 2";
    let (code, stderr) = within(400 << 10, large, nothing);
    assert!(code == 1 && stderr.contains("out of memory: "), "{stderr}");
    let (code, stderr) = within(200 << 10, "truth -o out.exr --size 4x4 /dev/stdin", |pipe| {
        let vertices = b"v 0 0 0\n".repeat(1 << 17);
        (0..100).try_for_each(|_| pipe.write_all(&vertices))
    });
    assert!(code == 1 && stderr.contains("out of memory: "), "{stderr}");
}
