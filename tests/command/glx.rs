//! Contexts by GLX, on an X display without a screen.

use crate::rig::command::{hbao, texts};
use crate::rig::process::skip;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the command with arguments under Xvfb, in this folder. `None` if Xvfb is missing and not required.
fn under_xvfb(folder: &Path, arguments: &str) -> Option<Output> {
    if Command::new("xvfb-run").arg("--help").output().is_err() {
        skip("xvfb-run", "xvfb xauth");
        return None;
    }
    let mut run = Command::new("xvfb-run");
    run.args(["-a", env!("CARGO_BIN_EXE_hbao")]).args(arguments.split_whitespace()).current_dir(folder);
    Some(run.env("LIBGL_ALWAYS_SOFTWARE", "1").output().unwrap())
}

#[test]
fn images_are_those_of_egl_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in
        ["cornell-box", "nave --method ssao --half-res", "nave --ortho 12 --show ao --msaa 1 --exit shorten"]
    {
        let arguments = format!("render {arguments} --size 80x60 --no-metadata");
        let Some(output) = under_xvfb(folder.path(), &format!("{arguments} --backend glx -o glx.png")) else { return };
        let [_, stderr] = texts(&output);
        assert!(output.status.success() && stderr.contains("hbao: glx: llvmpipe"), "{stderr}");
        let output = hbao(folder.path(), &format!("{arguments} --backend egl -o egl.png")).output().unwrap();
        assert!(output.status.success(), "{}", texts(&output)[1]);
        let [glx, egl] = ["glx.png", "egl.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
        assert!(glx == egl, "{arguments}");
    }
}

#[test]
fn every_verb_takes_it_and_info_tells_it_apart() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        ("info", "glx: llvmpipe"),
        ("trade cornell-box --size 16x12 --truth-rays 2 --runs 1 --backend glx", "glx: llvmpipe"),
        ("bench --only embedding --size 16x12 --runs 1 --backend glx", "glx: llvmpipe"),
    ] {
        let Some(output) = under_xvfb(folder.path(), arguments) else { return };
        let [stdout, stderr] = texts(&output);
        assert!(output.status.success() && (stdout + &stderr).contains(part), "{arguments}: {stderr}");
    }
}

#[test]
fn without_a_display_one_line_says_what_to_set() {
    let folder = tempfile::tempdir().unwrap();
    for (display, part) in [(None, "DISPLAY names no X display"), (Some(":987"), "':987' cannot be opened")] {
        let mut run = hbao(folder.path(), "render -o a.png --size 8x6 --backend glx");
        match display {
            None => run.env_remove("DISPLAY"),
            Some(name) => run.env("DISPLAY", name),
        };
        let output = run.output().unwrap();
        let [_, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.lines().count() == 1 && stderr.starts_with("hbao: glx: ") && stderr.contains(part), "{stderr}");
    }
}
