//! Runs the command line as its users do, and checks what it writes, what it prints and how it fails.

use crate::rig::command::{names, notices, of_arguments};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use hbao::image::{Image, exr, png};
use hbao::rotation_tile;
use hbao::settings::{KNOBS, Kind, Knob, Method, Settings};

const SMALL: &str = "96x72";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder to write to")
}

/// Runs the command in `folder`.
fn hbao<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    of_arguments(folder, arguments).output().expect("the command runs")
}

/// Runs `hbao render --size 96x72` with these arguments, which are separated by spaces. The command must succeed.
/// Returns its stderr.
fn render(folder: &Path, arguments: &str) -> String {
    let all: Vec<_> = ["render", "--size", SMALL].into_iter().chain(arguments.split_whitespace()).collect();
    let output = hbao(folder, &all);
    let stderr = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments}: stdout must be empty");
    assert!(stderr.lines().all(|line| line.starts_with("hbao: ")), "{stderr}");
    stderr
}

/// Returns the settings with which a file says that it was made.
fn settings_text(path: &Path) -> String {
    let pairs = match path.extension().and_then(OsStr::to_str) {
        Some("png") => png::read_text(path),
        _ => exr::read_text(path),
    };
    let pairs = pairs.expect("text");
    pairs.into_iter().find(|(keyword, _)| keyword == "hbao").expect("the settings").1
}

fn covered(folder: &Path) -> Vec<bool> {
    render(folder, "-o covered.exr --show depth");
    exr::read::<f32>(&folder.join("covered.exr")).unwrap().texels.iter().map(|z| z.is_finite()).collect()
}

mod images {
    use super::*;

    #[test]
    fn the_built_in_scene_renders_with_nothing_but_a_name() {
        let folder = folder();
        let output = hbao(folder.path(), &["render", "-o", "cornell.png"]);
        assert!(output.status.success());
        let image: Image<[u8; 3]> = png::read(&folder.path().join("cornell.png")).unwrap();
        assert_eq!((image.width, image.height), (1600, 1200));
        // The red wall is on the left, the green one on the right.
        let [left, right] = [300, 1260].map(|x| image.at(x, 600));
        assert!(left[0] / 2 > left[1] && right[1] / 2 > right[0], "{left:?} {right:?}");
        assert_eq!(names(folder.path()), ["cornell.png"]);
    }

    #[test]
    fn every_image_opens_elsewhere_in_its_size_and_layout() {
        let folder = folder();
        for show in ["final", "ao", "ao-raw", "color", "depth", "normals", "edges", "exits"] {
            let rgb = matches!(show, "final" | "color" | "normals" | "exits");
            for extension in ["png", "exr"] {
                let name = format!("{show}.{extension}");
                assert_eq!(notices(&render(folder.path(), &format!("-o {name} --show {show}"))), [""; 0]);
                let path = folder.path().join(&name);
                if extension == "png" {
                    let other = image::open(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
                    assert_eq!((other.width(), other.height()), (96, 72), "{name}");
                    let color = if rgb { image::ColorType::Rgb8 } else { image::ColorType::L8 };
                    assert_eq!(other.color(), color, "{name}");
                } else if rgb {
                    // The crate `image` can read only those EXR files that have colours.
                    let other = image::open(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
                    assert_eq!((other.width(), other.height()), (96, 72), "{name}");
                    exr::read::<[f32; 3]>(&path).unwrap();
                } else {
                    let read = exr::read::<f32>(&path).unwrap();
                    assert_eq!((read.width, read.height), (96, 72), "{name}");
                }
            }
        }
    }

    #[test]
    fn png_and_exr_show_the_same() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        for show in ["final", "color"] {
            render(folder.path(), &format!("-o a.png --show {show}"));
            render(folder.path(), &format!("-o a.exr --show {show}"));
            let bytes = png::read::<[u8; 3]>(&at("a.png")).unwrap();
            let floats = exr::read::<[f32; 3]>(&at("a.exr")).unwrap();
            assert_eq!(bytes.map(|c| c.map(|x| f32::from(x) / 255.0)), floats);
        }
        render(folder.path(), "-o a.png --show ao");
        render(folder.path(), "-o a.exr --show ao");
        let floats = exr::read::<f32>(&at("a.exr")).unwrap();
        let bytes = png::read::<u8>(&at("a.png")).unwrap();
        // Drivers may multiply by a rounded 1/255.
        let same = |(&b, a): (&u8, &f32)| (f32::from(b) / 255.0 - a).abs() < 1e-6;
        assert!(bytes.texels.iter().zip(&floats.texels).all(same));
        assert!(floats.texels.iter().any(|&a| a < 0.8) && floats.texels.iter().all(|a| (0.0..=1.0).contains(a)));
    }

    #[test]
    fn background_is_told_apart_in_depths_and_normals() {
        let folder = folder();
        let covered = covered(folder.path());
        assert!(covered.contains(&true) && covered.contains(&false), "the picture must show the box and background");
        render(folder.path(), "-o depth.png --show depth");
        render(folder.path(), "-o normals.png --show normals");
        render(folder.path(), "-o normals.exr --show normals");
        let depth = png::read::<u8>(&folder.path().join("depth.png")).unwrap().texels;
        let colours = png::read::<[u8; 3]>(&folder.path().join("normals.png")).unwrap().texels;
        let normals = exr::read::<[f32; 3]>(&folder.path().join("normals.exr")).unwrap().texels;
        for (i, &covered) in covered.iter().enumerate() {
            assert_eq!(depth[i] == 255, !covered);
            assert_eq!(colours[i] == [0; 3], !covered);
            let length = normals[i].iter().map(|x| x * x).sum::<f32>();
            assert!(if covered { (length - 1.0).abs() < 1e-5 } else { length == 0.0 });
        }
        let nearest = depth.iter().min().unwrap();
        let farthest = depth.iter().filter(|&&z| z < 255).max().unwrap();
        assert_eq!((*nearest, *farthest), (0, 254));
    }

    #[test]
    fn ambient_light_alone_is_darkened_where_asked() {
        let folder = folder();
        let read = |arguments: &str| {
            render(folder.path(), &format!("-o a.png {arguments}"));
            png::read::<[u8; 3]>(&folder.path().join("a.png")).unwrap().texels
        };
        let (all, ambient, color) = (read(""), read("--apply ambient"), read("--show color"));
        let ordered =
            all.iter().zip(&ambient).zip(&color).all(|((a, b), c)| (0..3).all(|i| a[i] <= b[i] && b[i] <= c[i]));
        assert!(ordered && all != ambient && ambient != color);
    }

    #[test]
    fn numbers_beyond_float32_give_visibility_all_the_same() {
        let folder = folder();
        let read = |arguments: &str| {
            render(folder.path(), &format!("-o a.exr --show ao --ao-format r32f {arguments}"));
            let ao = exr::read::<f32>(&folder.path().join("a.exr")).unwrap().texels;
            assert!(ao.iter().all(|a| (0.0..=1.0).contains(a)), "{arguments}");
            ao
        };
        assert!(read("--radius 1e-300").iter().all(|&a| a == 1.0), "no occluder is that near");
        assert_eq!(read("--blur-depth-sigma 1e-300 --jitter none"), read("--blur-depth-sigma 1e-25 --jitter none"));
        assert_eq!(read("--strength 1e300 --blur 0"), read("--strength 1e38 --blur 0"));
        read("--radius 1e300");
        read("--blur-depth-sigma 1e300");
    }

    #[test]
    fn edges_are_white_on_silhouettes_and_absent_without_msaa() {
        let folder = folder();
        let read = |arguments: &str| {
            render(folder.path(), &format!("-o edges.png --show edges {arguments}"));
            render(folder.path(), &format!("-o edges.exr --show edges {arguments}"));
            let edges = png::read::<u8>(&folder.path().join("edges.png")).unwrap();
            let float = exr::read::<f32>(&folder.path().join("edges.exr")).unwrap();
            assert_eq!(edges.map(|e| f32::from(e) / 255.0), float);
            assert!(edges.texels.iter().all(|&e| e == 0 || e == 255));
            edges
        };
        assert!(read("--msaa 1").texels.iter().all(|&e| e == 0));
        let edges = read("");
        let white = edges.texels.iter().filter(|&&e| e == 255).count();
        assert!(white > 50 && white < edges.texels.len() / 10, "{white}");
        assert_eq!(edges, read("--edges off --blur 0 --half-res"), "edges do not depend on the blur");
        let dumped = |arguments: &str| {
            render(folder.path(), &format!("-o a.png --dump d {arguments}"));
            png::read::<u8>(&folder.path().join("d/edges.png")).unwrap()
        };
        for arguments in ["", "--method ssao --radius 1", "--method ssao --ssao-samples 8 --half-res", "--method none"]
        {
            assert_eq!(read(arguments), dumped(arguments), "{arguments}");
        }
        assert!(read("--blur-depth-sigma 1e-9").texels.iter().filter(|&&e| e == 255).count() > white);
    }

    #[test]
    fn the_samples_given_are_stored_and_are_said_where_they_differ_from_those_asked_for() {
        let folder = folder();
        for asked in [1, 2, 4, 8] {
            let said = render(folder.path(), &format!("-o a.png --msaa {asked} --timings t.json"));
            let json = fs::read(folder.path().join("t.json")).unwrap();
            let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
            let given = json["msaa"]["given"].as_u64().unwrap();
            assert!([1, 2, 4, 8].contains(&given) && json["msaa"]["asked"] == asked);
            let samples = if given == 1 { "sample" } else { "samples" };
            let notice = format!("hbao: the driver gives {given} {samples} per pixel, not the {asked} of --msaa");
            let expected = if given == asked { Vec::new() } else { vec![notice.as_str()] };
            assert_eq!(notices(&said), expected);
            let text = settings_text(&folder.path().join("a.png"));
            let stored = [format!("msaa = {asked}\n"), format!("samples = {given}\n")];
            assert!(stored.iter().all(|line| text.contains(line)), "{text}");
        }
    }

    #[test]
    fn half_resolution_keeps_the_size_and_its_raw_image_is_half_as_large() {
        let folder = folder();
        let size = |name: &str| {
            let image = exr::read::<f32>(&folder.path().join(name)).unwrap();
            (image.width, image.height)
        };
        let arguments = ["render", "-o", "a.exr", "--show", "ao", "--size", "97x61", "--half-res", "--dump", "d"];
        assert_eq!(hbao(folder.path(), &arguments).status.code(), Some(0));
        assert_eq!((size("a.exr"), size("d/ao_raw.exr")), ((97, 61), (49, 31)));
        let arguments = [&arguments[..], &["--blur", "0"]].concat();
        assert_eq!(hbao(folder.path(), &arguments).status.code(), Some(0));
        let bytes = |name: &str| fs::read(folder.path().join("d").join(name)).unwrap();
        assert_eq!(bytes("ao.exr"), bytes("ao_raw.exr"), "without a blur it stays at half size");
    }

    #[test]
    fn a_camera_with_negative_numbers_after_a_space_or_an_equals_sign_is_the_same() {
        let folder = folder();
        render(folder.path(), "-o a.png --eye -200,300,-600 --target 278,273,280");
        render(folder.path(), "-o b.png --eye=-200,300,-600 --target=278,273,280");
        render(folder.path(), "-o c.png --ortho 700");
        let [a, b, c] = ["a.png", "b.png", "c.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
        assert!(a == b && a != c);
    }

    #[test]
    fn an_obj_file_is_framed_whole() {
        let folder = folder();
        fs::write(folder.path().join("it.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 2 4\n")
            .unwrap();
        render(folder.path(), "it.obj -o it.exr --show depth");
        let depth = exr::read::<f32>(&folder.path().join("it.exr")).unwrap();
        let inside = depth.texels.iter().filter(|z| z.is_finite()).count();
        assert!(inside > depth.texels.len() / 20, "{inside} pixels");
        let border = |x, y| x == 0 || y == 0 || x == depth.width - 1 || y == depth.height - 1;
        for y in 0..depth.height {
            assert!((0..depth.width).all(|x| !border(x, y) || depth.at(x, y).is_infinite()));
        }
    }
}

mod dumps {
    use super::*;

    #[test]
    fn a_dump_holds_every_image_in_its_channels() {
        let folder = folder();
        render(folder.path(), "-o final.png --dump all --directions 5");
        let at = |name: &str| folder.path().join("all").join(name);
        let all = ["ao.exr", "ao_raw.exr", "color.png", "depth.exr", "edges.png", "normals.exr", "rotation.exr"];
        assert_eq!(names(&folder.path().join("all")), all);
        for name in ["ao.exr", "ao_raw.exr", "depth.exr"] {
            let image = exr::read::<f32>(&at(name)).unwrap();
            assert_eq!((image.width, image.height), (96, 72));
            assert!(exr::read::<[f32; 3]>(&at(name)).is_err(), "{name} has Y and nothing else");
        }
        exr::read::<[f32; 3]>(&at("normals.exr")).unwrap();
        png::read::<[u8; 3]>(&at("color.png")).unwrap();
        png::read::<u8>(&at("edges.png")).unwrap();
        let tile = rotation_tile(&Settings { directions: 5, ..Settings::default() });
        assert_eq!(exr::read::<[f32; 3]>(&at("rotation.exr")).unwrap(), tile);
        assert!(all.iter().all(|name| settings_text(&at(name)).contains("directions = 5")));
    }

    #[test]
    fn a_dump_holds_what_show_would_write() {
        let folder = folder();
        render(folder.path(), "-o ao.exr --show ao --dump all/");
        render(folder.path(), "-o raw.exr --show ao-raw --dump ./all");
        for (one, dumped) in [("ao.exr", "all/ao.exr"), ("raw.exr", "all/ao_raw.exr")] {
            assert_eq!(fs::read(folder.path().join(one)).unwrap(), fs::read(folder.path().join(dumped)).unwrap());
        }
    }

    #[test]
    fn without_a_blur_ambient_occlusion_is_as_it_was_before_it() {
        let folder = folder();
        let read = |blur: &str| {
            render(folder.path(), &format!("-o a.png --dump d --blur {blur}"));
            ["ao.exr", "ao_raw.exr"].map(|name| fs::read(folder.path().join("d").join(name)).unwrap())
        };
        let ([ao, raw], [blurred, unblurred]) = (read("0"), read("9"));
        assert!(ao == raw && blurred != unblurred);
    }
}

mod repeatable {
    use super::*;

    #[test]
    fn two_runs_and_both_backends_write_the_same_bytes() {
        let folder = folder();
        for (name, backend) in [("a", "egl"), ("b", "egl"), ("c", "osmesa")] {
            let stderr = render(folder.path(), &format!("-o {name}.png --dump {name} --backend {backend}"));
            assert!(stderr.starts_with(&format!("hbao: {backend}: ")), "{stderr}");
        }
        let bytes = |path: PathBuf| fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for other in ["b", "c"] {
            let at = |name: &str| folder.path().join(name);
            assert!(bytes(at("a.png")) == bytes(at(&format!("{other}.png"))), "{other}.png");
            for name in names(&at("a")) {
                assert!(bytes(at("a").join(&name)) == bytes(at(other).join(&name)), "{other}: {name}");
            }
        }
    }

    #[test]
    fn a_files_own_settings_render_it_again() {
        let folder = folder();
        let given = "--radius 3.5% --directions 6 --steps 5 --bias 11.3 --strength 1.7 --attenuation linear \
                     --snap sample --clamp depth --grounding direction --normals vertex --blur 5 --blur-kernel full \
                     --blur-depth-sigma 7.25 --ao-format r32f --normal-format rgba16f";
        for extension in ["png", "exr"] {
            let [first, again, straight, plain] =
                ["first", "again", "straight", "plain"].map(|name| format!("{name}.{extension}"));
            render(folder.path(), &format!("-o {first} --show ao {given}"));
            fs::write(folder.path().join("made.toml"), settings_text(&folder.path().join(&first))).unwrap();
            render(folder.path(), &format!("-o {again} --show ao --settings made.toml"));
            render(folder.path(), &format!("-o {straight} --show ao --settings {first}"));
            render(folder.path(), &format!("-o {plain} --show ao"));
            let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
            assert!(bytes(&first) == bytes(&again) && bytes(&first) == bytes(&straight));
            assert!(bytes(&first) != bytes(&plain));
        }
    }

    #[test]
    fn normals_turn_the_curve_of_ssao_off_unless_a_flag_or_a_file_gives_it() {
        let folder = folder();
        // Files of earlier versions hold both keys.
        fs::write(folder.path().join("old.toml"), "method = \"ssao\"\nssao-normals = \"on\"\nssao-curve = \"on\"\n")
            .unwrap();
        fs::write(folder.path().join("new.toml"), "method = \"ssao\"\nssao-normals = \"on\"\n").unwrap();
        let visibility = |arguments: &str| {
            render(folder.path(), &format!("-o a.exr --show ao --ao-format r32f {arguments}"));
            exr::read::<f32>(&folder.path().join("a.exr")).unwrap().texels
        };
        let off = visibility("--method ssao --ssao-normals on --ssao-curve off");
        let on = visibility("--method ssao --ssao-normals on --ssao-curve on");
        let open = |texels: &[f32]| texels.iter().filter(|&&a| a == 1.0).count();
        assert!(2 * open(&off) < open(&on), "{} {} of {}", open(&off), open(&on), on.len());
        for (arguments, expected) in [
            ("--method ssao --ssao-normals on", &off),
            ("--settings new.toml", &off),
            ("--settings old.toml", &on),
            ("--settings old.toml --ssao-curve off", &off),
            ("--settings new.toml --ssao-curve on", &on),
        ] {
            let got = visibility(arguments);
            assert!(got == *expected, "{arguments}");
            // The image's own settings make it again.
            assert!(visibility("--settings a.exr") == got, "{arguments}");
        }
        let without = visibility("--method ssao");
        assert!(without == visibility("--method ssao --ssao-curve on"));
        assert!(without != visibility("--method ssao --ssao-curve off"));
    }

    #[test]
    fn a_file_says_from_where_it_was_seen() {
        let folder = folder();
        render(folder.path(), "-o a.exr --eye -200,300,-600 --target 278,273,280 --fov-y 50 --near 1 --far 5000");
        let text = settings_text(&folder.path().join("a.exr"));
        let table: toml::Table = text.parse().unwrap();
        let seen = table["render"].as_table().unwrap();
        assert_eq!(seen["scene"].as_str(), Some("cornell-box"));
        assert_eq!(seen["fov-y"].as_float(), Some(50.0));
        assert_eq!((seen["near"].as_float(), seen["far"].as_float()), (Some(1.0), Some(5000.0)));
        let point = |key: &str| {
            let numbers = seen[key].as_array().unwrap().iter().map(|x| x.as_float().unwrap().to_string());
            numbers.collect::<Vec<_>>().join(",")
        };
        let (eye, target, up) = (point("eye"), point("target"), point("up"));
        assert_eq!(eye, "-200,300,-600");
        render(
            folder.path(),
            &format!("-o b.png --eye {eye} --target {target} --up {up} --fov-y 50 --near 1 --far 5000"),
        );
        render(folder.path(), "-o c.png --eye -200,300,-600 --target 278,273,280 --fov-y 50 --near 1 --far 5000");
        let read = |name: &str| png::read::<[u8; 3]>(&folder.path().join(name)).unwrap().texels;
        let differ = read("b.png").iter().zip(read("c.png")).filter(|&(&b, c)| b != c).count();
        assert!(differ < 96 * 72 / 100, "{differ} pixels");
    }
}

mod settings {
    use super::*;

    /// Returns the notices about flags without effect.
    fn effects(stderr: &str) -> Vec<&str> {
        notices(stderr).into_iter().filter(|notice| notice.contains(" no effect ")).collect()
    }

    #[test]
    fn flags_win_over_the_file_and_the_file_over_the_scenes_own_radius() {
        let folder = folder();
        fs::write(folder.path().join("s.toml"), "radius = 40\nsteps = 3\n").unwrap();
        let made = |arguments: &str| {
            render(folder.path(), &format!("-o a.png {arguments}"));
            settings_text(&folder.path().join("a.png"))
        };
        let has = |text: &str, radius: &str, steps: &str| {
            text.contains(&format!("radius = {radius}\n")) && text.contains(&format!("steps = {steps}\n"))
        };
        assert!(has(&made(""), "150.0", "8"));
        assert!(has(&made("--settings s.toml"), "40.0", "3"));
        assert!(has(&made("--steps 4 --settings s.toml --radius 2%"), "\"2%\"", "4"));
    }

    #[test]
    fn a_flag_without_effect_is_said_in_one_line() {
        let folder = folder();
        for (arguments, flag) in [
            ("--blur-kernel full --blur 0", "--blur-kernel"),
            ("--blur 0 --blur-depth-sigma 2", "--blur-depth-sigma"),
            ("--show ao --apply ambient", "--apply"),
            ("--show depth --steps 3", "--steps"),
            ("--show ao-raw --blur 5", "--blur"),
            ("--blur 0 --edges off", "--edges"),
            ("--show ao-raw --edges off", "--edges"),
            ("--show depth --half-res", "--half-res"),
            ("--half-res --method none", "--half-res"),
            ("--rays 4", "--rays"),
            ("--grounding direction --method hbao-talk", "--grounding"),
            ("--exit paper --method ssao", "--exit"),
            ("--show depth --exit shorten", "--exit"),
            ("--show exits --blur 5", "--blur"),
            ("--show depth --timings t.json --steps 3", "--steps"),
            ("--show ao-raw --timings t.json --blur 5", "--blur"),
            ("--bias 9 --method ray-march", "--bias"),
            ("--grounding direction --method hbao-view", "--grounding"),
            ("--spacing 2", "--spacing"),
            ("--zenith view", "--zenith"),
            ("--quadrature end", "--quadrature"),
            ("--snap none --method ray-march", "--snap"),
            ("--attenuation none --method crease", "--attenuation"),
            ("--radius 9 --method none", "--radius"),
            ("--radius 9 --method ssao", "--radius"),
            ("--directions 9 --method ssao", "--directions"),
            ("--blur 5 --method ssao", "--blur"),
            ("--show edges --method ssao --radius 3", "--radius"),
            ("--show edges --radius 3 --blur-depth-sigma 2", "--radius"),
            ("--blur-kernel full --method ssao", "--blur-kernel"),
            ("--ssao-rotation matrix", "--ssao-rotation"),
            ("--ssao-depth full", "--ssao-depth"),
            ("--ssao-normals off", "--ssao-normals"),
            ("--ssao-samples 16", "--ssao-samples"),
            ("--ssao-curve on", "--ssao-curve"),
        ] {
            let stderr = render(folder.path(), &format!("-o a.png {arguments}"));
            let notices = effects(&stderr);
            let [notice] = notices[..] else { panic!("{arguments}: {notices:?}") };
            assert!(notice.starts_with(&format!("hbao: {flag} has no effect ")), "{arguments}: {notice}");
        }
        for arguments in [
            "--edges off",
            "--half-res",
            "--half-res=false",
            "--show edges --blur-depth-sigma 3",
            "--show edges --method none --blur-depth-sigma 3",
            "--show edges --method none --radius 3",
            "--show edges --method ssao --ssao-samples 8",
            "--show ao --method none --blur-depth-sigma 3 --dump d",
            "--blur-kernel full",
            "--exit shorten",
            "--method hbao",
            "--method ray-march --rays 2 --attenuation linear",
            "--method hbao-talk --bias 9 --snap none",
            "--method microsphere --clamp depth",
            "--method hbao-view --zenith axis --spacing 2 --quadrature mean",
            "--method hbao-view --snap step --spacing 1",
            "--method ssao --blur 0",
            "--method ssao --ssao-samples 8 --ssao-curve off --jitter none --blur-depth-sigma 9",
            "--apply all",
            "--show ao --steps 3",
            "--show ao-raw --blur 0",
        ] {
            assert_eq!(effects(&render(folder.path(), &format!("-o a.png {arguments}"))), [""; 0], "{arguments}");
        }
    }

    #[test]
    fn every_setting_that_a_method_does_not_read_is_said_to_have_no_effect() {
        let folder = folder();
        for &method in Method::ALL {
            let unread: Vec<_> = KNOBS.iter().filter(|knob| !method.reads(knob.name)).collect();
            let defaults = Settings::for_method(method);
            // A setting that is computed from others has no text of its own.
            let any = |knob: &Knob| match knob.kind {
                Kind::Word(words) => words[0],
                _ => "1",
            };
            let value =
                |knob: &Knob| Some(knob.text(&defaults)).filter(|text| !text.is_empty()).unwrap_or(any(knob).into());
            let flags: String = unread.iter().map(|knob| format!(" --{}={}", knob.name, value(knob))).collect();
            let stderr = render(folder.path(), &format!("-o a.png --method {}{flags}", method.name()));
            let said: Vec<_> = effects(&stderr).iter().map(|line| line.split(" has no").next().unwrap()).collect();
            let expected: Vec<_> = unread.iter().map(|knob| format!("hbao: --{}", knob.name)).collect();
            assert_eq!(said, expected, "{}", method.name());
        }
    }

    #[test]
    fn help_lists_every_knob_with_its_range_and_default() {
        let output = hbao(Path::new("."), &["render", "--help"]);
        assert_eq!(output.status.code(), Some(0));
        let help = String::from_utf8(output.stdout).unwrap();
        for knob in KNOBS {
            let flag = match knob.kind {
                Kind::Switch => format!("--{}[=<BOOL>]", knob.name),
                _ => format!("--{} <{}>", knob.name, knob.value),
            };
            let line = help.lines().find(|line| line.contains(&flag));
            assert!(line.is_some_and(|line| line.contains(knob.help) && line.contains("default: ")), "{}", knob.name);
        }
        assert!(
            help.contains("[1 to 64; default: 8]")
                && help.contains("[quadratic, linear, none; default: quadratic; hbao-talk linear]")
        );
    }
}

mod timings {
    use super::*;

    /// Renders with `--timings`, and returns what its file holds.
    fn rendered(folder: &Path, arguments: &str) -> serde_json::Value {
        render(folder, &format!("-o a.png --timings t.json {arguments}"));
        serde_json::from_slice(&fs::read(folder.join("t.json")).unwrap()).unwrap()
    }

    /// Returns the names of the passes.
    fn names(json: &serde_json::Value) -> Vec<String> {
        json["passes"].as_array().unwrap().iter().map(|pass| pass["name"].as_str().unwrap().into()).collect()
    }

    #[test]
    fn timings_have_the_contracts_fields_and_a_row_for_each_pass() {
        let folder = folder();
        let passes = |arguments: &str| {
            let json = rendered(folder.path(), arguments);
            assert_eq!(json["backend"], "egl");
            assert!(json["renderer"].as_str().is_some_and(|renderer| !renderer.is_empty()));
            assert_eq!(json["size"], serde_json::json!([96, 72]));
            let passes = json["passes"].as_array().unwrap();
            assert!(passes.iter().all(|pass| pass["gpu_ms"].is_null() || pass["gpu_ms"].as_f64() > Some(0.0)));
            let total: f64 = passes.iter().map(|pass| pass["wall_ms"].as_f64().unwrap()).sum();
            assert!((json["total_ms"].as_f64().unwrap() - total).abs() < 1e-9 && total > 0.0);
            names(&json)
        };
        let holds = |passes: &[String], names: &[&str]| names.iter().all(|name| passes.iter().any(|pass| pass == name));
        let all = passes("--backend egl");
        assert!(holds(&all, &["gbuffer", "resolve", "ao", "edges", "blur_x", "blur_y", "blur_edges", "composite"]));
        let plain = passes("--backend egl --msaa 1");
        assert!(["resolve", "edges", "blur_edges"].iter().all(|name| !holds(&plain, &[name])), "{plain:?}");
        assert!(!holds(&passes("--edges off"), &["blur_edges"]));
        let few = passes("--backend egl --show ao --blur 0");
        assert!(holds(&few, &["gbuffer", "ao"]), "{few:?}");
        let not = ["edges", "blur_x", "blur_y", "blur_edges", "composite"];
        assert!(not.iter().all(|name| !holds(&few, &[name])), "{few:?}");
    }

    #[test]
    fn timings_run_only_the_passes_that_the_written_images_need() {
        let folder = folder();
        let passes = |arguments: &str| names(&rendered(folder.path(), &format!("--backend egl --msaa 4 {arguments}")));
        for image in ["depth", "normals", "color"] {
            assert_eq!(passes(&format!("--show {image}")), ["gbuffer", "resolve"], "{image}");
        }
        assert_eq!(passes("--show edges"), ["gbuffer", "resolve", "background", "edges"]);
        assert_eq!(passes("--show ao-raw"), ["gbuffer", "resolve", "background", "ao"]);
        let dumped = passes("--show depth --dump d");
        assert!(
            ["ao", "edges", "blur_x", "blur_y", "blur_edges"].iter().all(|&name| dumped.contains(&name.to_string()))
        );
        assert!(!dumped.contains(&"composite".into()), "{dumped:?}");
    }
}

mod the_command {
    use super::*;

    #[test]
    fn version_and_help_are_printed_and_succeed() {
        for (arguments, part) in
            [(&["--version"][..], env!("CARGO_PKG_VERSION")), (&["--help"], "render"), (&["info", "--help"], "backend")]
        {
            let output = hbao(Path::new("."), arguments);
            assert_eq!(output.status.code(), Some(0));
            assert!(String::from_utf8(output.stdout).unwrap().contains(part) && output.stderr.is_empty());
        }
    }

    #[test]
    fn info_tells_of_the_backends() {
        let output = hbao(Path::new("."), &["info"]);
        assert_eq!(output.status.code(), Some(0));
        let text = String::from_utf8(output.stdout).unwrap();
        for part in ["egl: ", "osmesa: ", "vendor", "GLSL", "samples", "timer query", "renders      r8, r16f, r32f"] {
            assert!(text.contains(part), "no {part:?} in: {text}");
        }
    }

    #[test]
    fn info_says_that_softpipe_loses_negative_normals() {
        let output = of_arguments(Path::new("."), &["info"])
            .envs([("GALLIUM_DRIVER", "softpipe"), ("LIBGL_ALWAYS_SOFTWARE", "true")])
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.matches("  does not     rgba8-snorm").count(), 2, "{text}");
    }

    #[test]
    fn info_fails_in_one_line_where_no_backend_works() {
        let output = of_arguments(Path::new("."), &["info"])
            .envs([("GALLIUM_DRIVER", "nonsense"), ("LIBGL_ALWAYS_SOFTWARE", "true")])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 3, "one line for each backend");
        let stderr = String::from_utf8(output.stderr).unwrap();
        // libEGL may print a warning of its own.
        let ours: Vec<_> = stderr.lines().filter(|line| !line.starts_with("libEGL")).collect();
        assert!(ours.len() == 1 && ours[0].starts_with("hbao: no backend works"), "{stderr}");
    }

    #[test]
    #[cfg(unix)]
    fn a_reader_that_has_left_is_no_panic() {
        use std::process::Stdio;
        for arguments in
            [&["--help"][..], &["info"], &["render", "-o", "x.jpg"], &["render", "--size", SMALL, "-o", "a.png"]]
        {
            let folder = folder();
            let (reader, writer) = std::io::pipe().unwrap();
            let mut child = of_arguments(folder.path(), arguments);
            child.stdin(Stdio::null());
            child.stdout(writer.try_clone().unwrap()).stderr(writer);
            drop(reader);
            let code = child.status().unwrap().code();
            assert_eq!(code, Some(if arguments.contains(&"x.jpg") { 2 } else { 0 }), "{arguments:?}");
        }
    }
}

mod truth {
    use super::*;

    #[test]
    fn truth_writes_visibility_and_says_its_noise_without_a_context() {
        let folder = folder();
        let arguments = ["truth", "-o", "t.exr", "--size", "24x18", "--truth-rays", "64", "--radius", "150"];
        let output = hbao(folder.path(), &arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        assert!(
            stderr.lines().count() == 1 && stderr.contains("64 rays each") && stderr.contains("noise 0.0"),
            "{stderr}"
        );
        let image = exr::read::<f32>(&folder.path().join("t.exr")).unwrap();
        assert_eq!((image.width, image.height), (24, 18));
        let least = image.texels.iter().copied().fold(1.0, f32::min);
        assert!(image.texels.iter().all(|a| (0.0..=1.0).contains(a)) && least < 0.7, "{least}");
        // The result is the same in every run, whatever the number of threads.
        let again = folder.path().join("again");
        fs::create_dir(&again).unwrap();
        hbao(&again, &arguments);
        assert_eq!(fs::read(again.join("t.exr")).unwrap(), fs::read(folder.path().join("t.exr")).unwrap());
        let text = settings_text(&{
            hbao(folder.path(), &[&arguments[..2], &["t.png"], &arguments[3..]].concat());
            folder.path().join("t.png")
        });
        assert!(text.contains("truth-rays = 64\n") && text.contains("noise_rmse = 0.0"), "{text}");
        assert!(text.contains("weight = \"uniform\"\n"), "{text}");
    }

    #[test]
    fn truth_with_the_cosine_weight_is_another_image_and_says_so() {
        let folder = folder();
        let images = ["uniform", "cosine"].map(|weight| -> Image<u8> {
            let name = format!("{weight}.png");
            let arguments = format!("truth -o {name} --size 24x18 --truth-rays 64 --radius 150 --weight {weight}");
            let output = hbao(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
            assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
            let path = folder.path().join(name);
            assert!(settings_text(&path).contains(&format!("weight = \"{weight}\"\n")));
            png::read(&path).unwrap()
        });
        let moved = images[0].texels.iter().zip(&images[1].texels).filter(|(a, b)| a.abs_diff(**b) > 5).count();
        assert!(moved > 20, "{moved}");
        let output = hbao(folder.path(), &["truth", "-o", "t.png", "--weight", "sine"]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains("--weight: 'sine' is not one of uniform, cosine"), "{stderr}");
    }

    #[test]
    fn what_cannot_be_traced_is_refused_and_what_rays_do_not_read_is_said() {
        let folder = folder();
        for (rays, code) in [("3", 2), ("0", 2), ("many", 2), ("65538", 2)] {
            let output = hbao(folder.path(), &["truth", "-o", "t.exr", "--truth-rays", rays]);
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(code), "{stderr}");
            assert!(stderr.contains("--truth-rays: ") && stderr.lines().count() == 1, "{stderr}");
        }
        let arguments = ["truth", "-o", "t.exr", "--size", "4x3", "--truth-rays", "2", "--steps", "3"];
        let stderr = String::from_utf8(hbao(folder.path(), &arguments).stderr).unwrap();
        assert!(stderr.contains("--steps has no effect on rays"), "{stderr}");
        assert_eq!(names(folder.path()), ["t.exr"]);
    }
}

/// Results that hardly anybody means are written, and a notice says why they are so.
mod unmeant {
    use super::*;

    /// Returns the only notice of a rendering.
    fn notice(folder: &Path, arguments: &str) -> String {
        let stderr = render(folder, arguments);
        match notices(&stderr)[..] {
            [notice] => notice.into(),
            ref others => panic!("{arguments}: {others:?}"),
        }
    }

    fn mean(folder: &Path, name: &str) -> f64 {
        let image: Image<f32> = exr::read(&folder.join(name)).unwrap();
        image.texels.iter().map(|&a| f64::from(a)).sum::<f64>() / image.texels.len() as f64
    }

    #[test]
    fn the_texels_that_exit_early_are_shown_and_their_visibility_is_1() {
        let folder = folder();
        for flags in ["--steps 24", "--steps 12 --half-res"] {
            let said = notice(folder.path(), &format!("-o exits.png --show exits --size 160x120 {flags}"));
            render(folder.path(), &format!("-o raw.exr --show ao-raw --size 160x120 {flags}"));
            let shown = png::read::<[u8; 3]>(&folder.path().join("exits.png")).unwrap();
            let raw = exr::read::<f32>(&folder.path().join("raw.exr")).unwrap();
            let all: Vec<_> = shown.texels.iter().zip(&raw.texels).filter(|(texel, _)| **texel != [0; 3]).collect();
            let exits = all.iter().filter(|(texel, _)| **texel == [255, 140, 0]).inspect(|(_, a)| assert_eq!(**a, 1.0));
            let share = 100.0 * exits.count() as f64 / all.len() as f64;
            assert!(share > 5.0 && share < 95.0, "{share}");
            let grey = |a: f32| [(255.0 * a).round() as u8; 3];
            assert!(all.iter().all(|(texel, a)| **texel == [255, 140, 0] || **texel == grey(**a)));
            let number = said.split("visibility is 1 at ").nth(1).and_then(|rest| rest.split('%').next()).unwrap();
            assert!((number.parse::<f64>().unwrap() - share).abs() < 0.51, "{share} {said}");
        }
        let said = notice(folder.path(), "-o none.png --show exits --method ray-march --rays 1 --directions 2");
        assert!(said.contains("ray-march never exits early"), "{said}");
    }

    #[test]
    fn steps_below_a_texel_are_told_with_the_flag_that_helps() {
        let folder = folder();
        for arguments in
            ["--steps 64", "--steps 64 --method crease", "--steps 16 --half-res --radius 300", "--radius 40"]
        {
            let said = notice(folder.path(), &format!("-o a.exr --show ao-raw {arguments}"));
            assert!(said.starts_with("hbao: visibility is 1 at ") && said.contains("--exit shorten"), "{said}");
            let helped = render(folder.path(), &format!("-o b.exr --show ao-raw {arguments} --exit shorten"));
            assert_eq!(notices(&helped), [""; 0], "{arguments}");
            let [before, after] = ["a.exr", "b.exr"].map(|name| mean(folder.path(), name));
            assert!(after < before - 0.005, "{arguments}: {before} {after}");
        }
        let said = notice(folder.path(), "-o a.png --radius 2");
        assert!(said.contains("at 100% of the surface") && said.contains("give a larger --radius or --size"), "{said}");
        assert!(!said.contains("--exit"), "no exit helps: {said}");
        let said = notice(folder.path(), "-o a.png --radius 2 --exit shorten --half-res");
        assert!(said.contains("R is shorter than 2 texels") && said.contains("or no --half-res"), "{said}");
    }

    #[test]
    fn a_radius_past_the_picture_is_told() {
        let folder = folder();
        for radius in ["5000", "1e6"] {
            let said = notice(folder.path(), &format!("-o a.exr --show ao --radius {radius}"));
            assert!(
                said.contains("fall on the picture's border") && said.contains("give a smaller --radius"),
                "{said}"
            );
        }
        let said = notice(folder.path(), "-o a.exr --show ao --radius 1e6");
        assert!(said.contains("fall on the picture's border") && said.contains("give a smaller --radius"), "{said}");
        assert!(mean(folder.path(), "a.exr") > 0.99);
    }

    #[test]
    fn visibility_of_1_everywhere_is_told_whatever_the_method_is() {
        let folder = folder();
        fs::write(folder.path().join("flat.obj"), "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nf 1 2 3 4\n").unwrap();
        for arguments in ["--method ray-march --radius 0.1", "flat.obj --radius 9"] {
            let said = notice(folder.path(), &format!("-o a.png {arguments}"));
            assert!(said.contains("visibility is 1 at every pixel: no sample within R = "), "{said}");
        }
        assert_eq!(notices(&render(folder.path(), "-o a.png --method none")), [""; 0]);
        let output = hbao(folder.path(), &["truth", "flat.obj", "-o", "t.png", "--size", "8x6", "--truth-rays", "2"]);
        assert!(String::from_utf8(output.stderr).unwrap().contains("visibility is 1 at every pixel"));
    }

    #[test]
    fn a_view_of_nothing_says_what_hides_the_scene() {
        let folder = folder();
        fs::write(folder.path().join("no_area.obj"), "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n").unwrap();
        for (arguments, parts) in [
            ("--near 10 --far 20", ["planes at 10 and 20 clip all that would be", "leave out --near and --far"]),
            ("--near 9 --far 20 --show depth", ["planes at 9 and 20 clip", "at depths of 8"]),
            // Only the back wall is in this picture, although other parts of the scene are nearer.
            ("--far 950 --fov-y 10", ["and 950 clip all that would be, at depths of 1", "leave out --far"]),
            (
                "--eye 278,273,-800 --target 278,1073,-700",
                ["no part of the scene lies in the picture", "leave out --eye and --target"],
            ),
            ("--eye 278,273,-800 --target 278,273,-900", ["the whole scene lies behind the camera", ""]),
            ("--near 1e7", ["--near 10000000", "lies beyond the whole scene"]),
            ("--ortho 1e9", ["smaller than a pixel", "a smaller --fov-y or --ortho"]),
            ("no_area.obj", ["no face of the model has an area", ""]),
        ] {
            let said = notice(folder.path(), &format!("-o a.png {arguments}"));
            assert!(said.contains("nothing is in view") && parts.iter().all(|part| said.contains(part)), "{said}");
            let truth = format!("truth -o t.png --size 8x6 --truth-rays 2 {}", arguments.replace("--show depth", ""));
            let output = hbao(folder.path(), &truth.split_whitespace().collect::<Vec<_>>());
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert!(stderr.contains("nothing is in view"), "{stderr}");
        }
        let output = hbao(
            folder.path(),
            &["bench", "cornell-box", "--only", "crysis", "--runs", "1", "--near", "1", "--far", "2"],
        );
        assert!(String::from_utf8(output.stderr).unwrap().contains("nothing is in view: the planes at 1 and 2"));
    }
}
