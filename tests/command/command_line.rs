//! The command line itself: its help, its words for mistakes, flags that every subcommand has, completions for shells,
//! and where output may go.

use crate::rig::command::{HBAO, by, cached, names, of_arguments, texts, with_shader_cache};
use crate::rig::process::skip;
use hbao::image::{Image, exr, png};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};

const VERBS: [&str; 11] =
    ["render", "truth", "trade", "tune", "bench", "paper", "compare", "image", "view", "info", "completions"];

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Runs a command line that must succeed.
fn succeeds(folder: &Path, arguments: &str) -> [String; 2] {
    let output = cached(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned())
}

/// Runs a command line with these arguments, which may have any bytes.
fn run<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    with_shader_cache(&mut of_arguments(folder, arguments)).output().unwrap()
}

/// Runs each wrong command line: (exit code, arguments, what its one line must contain).
fn refuses(cases: &[(i32, &str, &str)]) {
    let folder = folder();
    for (code, arguments, part) in cases {
        let output = cached(folder.path(), arguments);
        let [_, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(*code), "{arguments}: {stderr}");
        assert!(stderr.starts_with("hbao: ") && stderr.lines().count() == 1, "{arguments}: {stderr}");
        assert!(stderr.contains(part), "{arguments}: no {part:?} in: {stderr}");
        assert!(names(folder.path()).is_empty(), "{arguments}: a file was left behind");
    }
}

mod help {
    use super::*;

    #[cfg(not(feature = "view"))]
    #[test]
    fn a_command_without_its_viewer_says_how_to_get_it() {
        refuses(&[(2, "view nave", "cargo run --release --features view -- view")]);
    }

    #[test]
    fn the_command_alone_prints_its_help_and_says_that_a_subcommand_is_missing() {
        let output = cached(Path::new("."), "");
        let [stdout, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stdout, texts(&cached(Path::new("."), "--help"))[0]);
        assert!(stderr.starts_with("hbao: a subcommand is missing, as in 'hbao render -o a.png'"), "{stderr}");
        assert!(VERBS.iter().all(|verb| stdout.contains(&format!("\n  {verb} "))), "{stdout}");
    }

    #[test]
    fn help_is_a_subcommand_too() {
        for (arguments, same) in [("help", "--help"), ("help render", "render --help"), ("help tune", "tune --help")] {
            let [helped, stderr] = succeeds(Path::new("."), arguments);
            assert_eq!(helped, succeeds(Path::new("."), same)[0], "{arguments}");
            assert!(stderr.is_empty());
        }
    }

    #[test]
    fn help_says_which_snap_is_blotchy_and_that_every_subcommand_can_be_quiet() {
        let [help, _] = succeeds(Path::new("."), "render --help");
        let snap = help.lines().find(|line| line.contains("--snap <SNAP>")).unwrap();
        assert!(snap.contains("1 to 2 texels") && snap.contains("blotchy"), "{snap}");
        for verb in VERBS {
            assert!(succeeds(Path::new("."), &format!("{verb} --help"))[0].contains("--quiet"), "{verb}");
        }
        for (verb, has) in [("render", true), ("truth", true), ("tune", false)] {
            let [help, _] = succeeds(Path::new("."), &format!("{verb} --help"));
            assert_eq!(help.contains("--no-metadata"), has, "{verb}");
        }
    }
}

mod mistakes {
    use super::*;

    #[test]
    fn a_missing_subcommand_is_named_as_such() {
        refuses(&[
            (2, "-o a.png", "a subcommand is missing, as in 'hbao render -o a.png'"),
            (2, "--size 8x8 -o a.png", "a subcommand is missing, as in 'hbao render --size 8x8 -o a.png'"),
            (2, "--quiet", "a subcommand is missing"),
            (2, "model.obj", "a subcommand is missing before 'model.obj', as in 'hbao render model.obj -o a.png'"),
            (2, "nave -o a.png", "as in 'hbao render nave -o a.png'"),
            (2, "--size 8x8 render -o a.png", "'--size' stands before the subcommand: write it after 'hbao render'"),
            (2, "rendr", "unrecognized subcommand 'rendr'; a similar subcommand exists: 'render'"),
            (2, "xyz", "the subcommands are render, truth, trade"),
            (2, "help xyz", "unrecognized subcommand 'xyz'"),
        ]);
    }

    #[test]
    fn numbers_and_scenes_that_are_one_too_many_are_told_apart() {
        refuses(&[
            (2, "render --eye 1 2 3 -o a.png", "the numbers of --eye are separated by commas: --eye 1,2,3"),
            (
                2,
                "render -o a.png --target 1 -2 3e2",
                "the numbers of --target are separated by commas: --target 1,-2,3e2",
            ),
            (2, "render -o a.png --up 0, 1, 0", "the numbers of --up are separated by commas: --up 0,1,0"),
            (2, "render --eye 1 2", "is required"),
            (2, "render --eye 1 2 -o a.png", "--eye: '1' is not X,Y,Z, three numbers separated by commas"),
            (2, "render nave --size 40 30 -o a.png", "the numbers of --size are separated by an x: --size 40x30"),
            (2, "render --size -1x5 -o a.png", "--size: '-1x5' is not WxH"),
            (2, "render a.obj b.obj -o a.png", "two scenes are given, 'a.obj' and 'b.obj': render takes one"),
            (2, "render --half-res true nave -o a.png", "two scenes are given, 'true' and 'nave'"),
            (2, "paper nave -o report", "unexpected argument 'nave' found"),
        ]);
    }

    #[test]
    fn a_flag_that_does_not_exist_brings_the_one_that_is_meant_or_none() {
        refuses(&[
            (2, "render -blur 9 -o a.png", "write two dashes, '--blur'"),
            (2, "render -size=9x9 -o a.png", "write two dashes, '--size'"),
            (2, "render -output a.png", "write two dashes, '--output'"),
            (2, "info -quiet", "write two dashes, '--quiet'"),
            (2, "render --colour -o a.png", "unexpected argument '--colour' found; write '--show color' (see"),
            (2, "render --depth -o a.png", "write '--show depth'"),
            (2, "render --width 9 -o a.png", "write '--size WxH', such as '--size 800x600'"),
            (2, "render --radios 9 -o a.png", "a similar argument exists: '--radius'"),
            (2, "render --fov 9 -o a.png", "a similar argument exists: '--fov-y'"),
            (2, "render --colours -o a.png", "unexpected argument '--colours' found (see"),
            (
                2,
                "render -o a.png --truth-rays 4",
                "render does not take '--truth-rays'; truth, trade, tune, paper, sequence take it",
            ),
            (2, "info --max-ms=4", "info does not take '--max-ms'; tune takes it"),
            (2, "completions csh", "'csh' is not one of bash, elvish, fish, powershell, zsh"),
        ]);
    }
}

mod repeated {
    use super::*;

    #[test]
    fn of_a_flag_that_is_given_twice_the_last_value_counts() {
        let folder = folder();
        let once = "render nave -o a.png --size 9x7 --show ao --msaa 1 --steps 4 --half-res --eye 0,1,2 --fov-y 50";
        let twice = "render nave -o b.png --size 99x9 --show depth -o a.png --msaa 4 --steps 3 --half-res=false \
                     --eye -9,8,7 --fov-y 9 --half-res --half-res --size 9x7 --show ao --msaa 1 --steps 4 --eye 0,1,2 \
                     --fov-y 50 --quiet --quiet --backend egl --backend auto";
        succeeds(folder.path(), once);
        let expected = fs::read(folder.path().join("a.png")).unwrap();
        fs::remove_file(folder.path().join("a.png")).unwrap();
        succeeds(folder.path(), twice);
        assert_eq!(names(folder.path()), ["a.png"]);
        assert!(fs::read(folder.path().join("a.png")).unwrap() == expected);
        // Flags that exclude each other still do: the last one cannot be meant to replace another flag.
        refuses(&[(2, "render -o a.png --fov-y 40 --ortho 3", "cannot be used with")]);
    }
}

mod quiet {
    use super::*;

    #[test]
    fn quiet_runs_write_results_and_errors_and_nothing_else() {
        let folder = folder();
        for arguments in [
            "render --quiet -o a.png --size 9x7 --steps 3 --show depth",
            "--quiet render -o a.png --size 9x7 --up 0,0,1 --eye 0,0,-9 --target 0,0,0",
            "truth --quiet -o t.exr --size 9x7 --truth-rays 2 --steps 3",
            "tune --quiet nave --size 24x18 --max-error 0.9 --truth-rays 2 --runs 1 --rays 3 --method none -o t.toml",
            "bench --quiet --only figure1 --size 9x7 --runs 1",
            "info --quiet",
        ] {
            let [stdout, stderr] = succeeds(folder.path(), arguments);
            assert!(stderr.is_empty(), "{arguments}: {stderr}");
            let results = ["tune", "bench", "info"].iter().any(|verb| arguments.starts_with(verb));
            assert_eq!(results, !stdout.is_empty(), "{arguments}: {stdout}");
        }
        refuses(&[
            (1, "render --quiet missing.obj -o a.png", "missing.obj: no such file"),
            (2, "truth --quiet -o t.exr --truth-rays 3", "--truth-rays"),
        ]);
    }
}

mod completions {
    use super::*;

    #[test]
    fn every_shell_gets_a_script_that_names_the_subcommands_and_flags() {
        for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
            let [script, stderr] = succeeds(Path::new("."), &format!("completions {shell}"));
            assert!(stderr.is_empty());
            for word in VERBS.iter().chain(&["blur-kernel", "truth-rays", "separable"]) {
                assert!(script.contains(word), "{shell}: no {word}");
            }
        }
    }

    #[test]
    fn bash_accepts_its_script_and_completes_with_it() {
        let folder = folder();
        let [script, _] = succeeds(Path::new("."), "completions bash");
        fs::write(folder.path().join("script"), script).unwrap();
        let complete = "source ./script && COMP_WORDS=(hbao render --blur-kernel s) COMP_CWORD=3 && \
                        _hbao hbao s --blur-kernel && echo \"${COMPREPLY[@]}\"";
        for (arguments, printed) in [(&["-n", "script"][..], ""), (&["-c", complete], "separable\n")] {
            let Ok(output) = by("bash", folder.path()).args(arguments).output() else { return skip("bash", "bash") };
            let [stdout, stderr] = texts(&output);
            assert!(output.status.success(), "{stderr}");
            assert_eq!(stdout, printed);
        }
    }
}

mod standard_output {
    use super::*;

    /// Runs a command line in a folder, with its standard output redirected to a file, and returns the file's bytes.
    fn redirected(folder: &Path, arguments: &str) -> Vec<u8> {
        let line = format!("exec \"$0\" {arguments} > caught");
        let output = with_shader_cache(by("sh", folder).args(["-c", &line, HBAO])).output().unwrap();
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        fs::read(folder.join("caught")).unwrap()
    }

    #[test]
    #[cfg(unix)]
    fn a_dash_and_dev_stdout_write_a_png_to_standard_output() {
        let folder = folder();
        for verb in ["render --show ao --size 9x7", "truth --size 9x7 --truth-rays 2"] {
            succeeds(folder.path(), &format!("{verb} -o a.png"));
            let expected = fs::read(folder.path().join("a.png")).unwrap();
            assert_eq!(png::read::<u8>(&folder.path().join("a.png")).unwrap().width, 9);
            for name in ["-", "/dev/stdout"] {
                let piped = cached(folder.path(), &format!("{verb} -o {name}"));
                assert!(piped.status.success() && piped.stdout == expected, "{verb} {name} in a pipe");
                assert!(redirected(folder.path(), &format!("{verb} -o {name}")) == expected, "{verb} {name} in a file");
            }
        }
        assert_eq!(names(folder.path()), ["a.png", "caught"]);
    }

    #[test]
    #[cfg(unix)]
    fn what_goes_to_standard_output_is_alone_there() {
        let folder = folder();
        let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
        let bench = "bench --only figure1 --size 9x7 --runs 1 --json";
        for name in ["-", "/dev/stdout"] {
            let output = cached(folder.path(), &format!("{bench} {name}"));
            assert!(json(&output.stdout)["rows"].is_array());
            assert!(texts(&output)[1].contains("Figure 1 of the talk"), "the tables go to stderr");
            assert!(json(&redirected(folder.path(), &format!("{bench} {name}")))["rows"].is_array());
        }
        let [stdout, stderr] = succeeds(folder.path(), &format!("{bench} - --quiet"));
        assert!(json(stdout.as_bytes())["rows"].is_array() && stderr.is_empty());
        let timings = cached(folder.path(), "render -o a.png --size 9x7 --timings -");
        assert!(json(&timings.stdout)["passes"].is_array());
        refuses(&[
            (1, "render --size 9x7 -o - --timings -", "standard output: two outputs have this name"),
            (1, "render --size 9x7 -o /dev/stdout --timings -", "standard output: two outputs have this name"),
        ]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_terminal_gets_no_image() {
        let folder = folder();
        let line = format!("'{HBAO}' render --size 9x7 -o -");
        let mut script = by("script", folder.path());
        script.args(["-qec", &line, "/dev/null"]).stdin(Stdio::null());
        let Ok(output) = script.output() else { return skip("script", "bsdutils") };
        let [stdout, _] = texts(&output);
        assert_eq!(output.status.code(), Some(2), "{stdout}");
        assert!(stdout.starts_with("hbao: --output -: standard output is a terminal") && stdout.lines().count() == 1);
    }
}

mod metadata {
    use super::*;

    /// The images that these tests write.
    const IMAGES: [(&str, &str); 3] = [
        ("a.png", "render it.obj --size 9x7 --dump d -o"),
        ("a.exr", "render it.obj --size 9x7 --show ao -o"),
        ("t.exr", "truth it.obj --size 9x7 --truth-rays 2 -o"),
    ];

    #[test]
    fn the_same_scene_in_two_folders_gives_the_same_bytes() {
        let [here, there] = [folder(), folder()];
        for folder in [&here, &there] {
            fs::write(folder.path().join("it.obj"), TRIANGLE).unwrap();
        }
        let absolute = there.path().join("it.obj");
        for (name, arguments) in IMAGES {
            succeeds(here.path(), &format!("{arguments} {name}"));
            let by_path = arguments.replace("it.obj", absolute.to_str().unwrap());
            succeeds(there.path(), &format!("{by_path} {name}"));
        }
        for name in ["a.png", "a.exr", "t.exr", "d/ao.exr", "d/color.png"] {
            let [ours, theirs] = [&here, &there].map(|folder| fs::read(folder.path().join(name)).unwrap());
            assert!(ours == theirs, "{name}");
        }
        let [text, _] = [0, 1].map(|_| png::read_text(&there.path().join("a.png")).unwrap());
        assert!(text.iter().any(|(_, text)| text.contains("scene = \"it.obj\"\n")), "{text:?}");
    }

    #[test]
    fn no_file_that_is_written_names_a_folder() {
        let folder = folder();
        let scene = folder.path().join("it.obj");
        fs::write(&scene, TRIANGLE).unwrap();
        let scene = scene.to_str().unwrap();
        let goal = "--size 9x7 --max-error 0.9 --truth-rays 2 --runs 1 --method none -o t.toml --json t.json";
        succeeds(folder.path(), &format!("tune {scene} {goal}"));
        let bench = "--size 9x7 --runs 1 --only figure1 --json b.json";
        succeeds(folder.path(), &format!("bench {scene} {bench}"));
        for name in ["t.toml", "t.json", "b.json"] {
            let text = fs::read_to_string(folder.path().join(name)).unwrap();
            assert!(!text.contains(folder.path().to_str().unwrap()), "{name}: {text}");
        }
    }

    #[test]
    fn without_metadata_an_image_holds_pixels_alone() {
        let folder = folder();
        fs::write(folder.path().join("it.obj"), TRIANGLE).unwrap();
        for (name, arguments) in IMAGES {
            succeeds(folder.path(), &format!("{arguments} with-{name}"));
            succeeds(folder.path(), &format!("{arguments} {name} --no-metadata"));
            let [bare, with] = [name.into(), format!("with-{name}")].map(|name| folder.path().join(name));
            if name.ends_with(".png") {
                assert!(png::read_text(&bare).unwrap().is_empty() && !png::read_text(&with).unwrap().is_empty());
                assert!(png::read::<[u8; 3]>(&bare).unwrap() == png::read(&with).unwrap());
            } else {
                assert_eq!(exr::read_text(&bare).unwrap(), []);
                assert!(exr::read::<f32>(&bare).unwrap() == exr::read(&with).unwrap());
            }
            let output = cached(folder.path(), &format!("render -o b.png --size 9x7 --settings {name}"));
            assert!(texts(&output)[1].contains("no settings in it"), "{}", texts(&output)[1]);
        }
        assert_eq!(exr::read_text(&folder.path().join("d/ao.exr")).unwrap(), []);
        assert_eq!(png::read_text(&folder.path().join("d/color.png")).unwrap(), []);
    }
}

#[cfg(target_os = "linux")]
mod names_that_are_not_utf8 {
    use super::*;
    use std::os::unix::ffi::OsStringExt as _;

    /// A file name with a byte that no UTF-8 text has.
    fn odd(extension: &str) -> OsString {
        OsString::from_vec([b"caf\xe9", extension.as_bytes()].concat())
    }

    /// Runs a command line in which each word that begins with `%` stands for [`odd`] with this extension.
    fn run_odd(folder: &Path, arguments: &str) {
        let word = |word: &str| word.strip_prefix('%').map_or_else(|| word.into(), odd);
        let arguments: Vec<OsString> = arguments.split_whitespace().map(word).collect();
        let output = run(folder, &arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }

    #[test]
    fn every_output_and_settings_file_can_have_one() {
        let folder = folder();
        let written = |names: &[&str]| {
            for extension in names {
                let path = folder.path().join(odd(extension));
                assert!(path.exists(), "{}", path.display());
                if path.is_file() {
                    fs::remove_file(path).unwrap();
                }
            }
        };
        run_odd(folder.path(), "render --size 9x7 -o %.png --dump %.dumped --timings %.json");
        assert_eq!(
            png::read::<[u8; 3]>(&folder.path().join(odd(".png"))).map(|image: Image<_>| image.width).unwrap(),
            9
        );
        assert!(folder.path().join(odd(".dumped")).join("ao.exr").exists());
        run_odd(folder.path(), "render --size 9x7 -o %.exr --settings %.png");
        run_odd(folder.path(), "render --size 9x7 -o a.png --settings %.exr");
        written(&[".png", ".json", ".exr"]);
        run_odd(folder.path(), "truth --size 9x7 --truth-rays 2 -o %.exr");
        written(&[".exr"]);
        run_odd(folder.path(), "trade nave --size 9x7 --truth-rays 2 --runs 1 --json %.json --csv %.csv --plot %.svg");
        written(&[".json", ".csv", ".svg"]);
        run_odd(
            folder.path(),
            "tune nave --size 9x7 --truth-rays 2 --runs 1 --max-error 0.9 --method none -o %.toml --json %.json",
        );
        run_odd(folder.path(), "render --size 9x7 -o a.png --settings %.toml");
        written(&[".toml", ".json"]);
        run_odd(folder.path(), "bench --size 9x7 --runs 1 --only figure1 --json %.json");
        written(&[".json"]);
        // What is refused is refused for another reason, before any work.
        let arguments = [OsStr::new("paper"), OsStr::new("-o"), &odd("/none/report")];
        let [_, stderr] = texts(&run(folder.path(), &arguments));
        assert!(stderr.contains("the folder cannot be made"), "{stderr}");
    }
}
