//! Checks what the command line refuses: each case with one line and its exit code, and without writing a file.

use crate::rig::command::{names, notices, of_arguments};
use std::fs;

/// The models, settings and other files that the cases name.
const FILES: &[(&str, &[u8])] = &[
    ("good.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ("far.obj", b"v 0 0 0\nv 1e5 0 0\nv 0 1e5 0\nf 1 2 3\n"),
    ("malformed.obj", b"v 0 0 zero\nf 1 2 3\n"),
    ("binary.obj", b"v \xff\xfe\x00\x01 0 0\nf 1 2 3\n"),
    ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
    ("negative.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n"),
    ("nan.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
    ("inf.obj", b"v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n"),
    ("overflow.obj", b"v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n"),
    ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
    ("empty.obj", b""),
    ("bunny.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"),
    ("utf16.obj", b"\xff\xfef\0 \x001\0"),
    ("malformed.toml", b"steps = = 3\n"),
    ("unknown.toml", b"stepz = 3\n"),
    ("range.toml", b"# a comment\nbias = 3\nsteps = 300\n"),
    ("method.toml", b"method = \"voxels\"\n"),
    ("table.toml", b"[settings]\nsteps = 3\n"),
    ("point.obj", b"v 1 2 3\nf 1 1 1\n"),
    ("binary.toml", b"\x89PNG\r\n\x1a\n\x00\xff\xfe"),
    ("file", b"not a folder"),
];

/// The exit codes of the command.
const FAILED: i32 = 1;
const USAGE: i32 = 2;

/// Runs `hbao render` on each case: (exit code, arguments, what the one line must contain). If the arguments contain no
/// `-o`, one is added.
fn refuses(cases: &[(i32, &str, &str)]) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in FILES {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    fs::create_dir(folder.path().join("taken.png")).unwrap();
    let before = names(folder.path());
    for (code, arguments, part) in cases {
        let mut all: Vec<_> = arguments.split_whitespace().collect();
        if !all.contains(&"-o") {
            all.extend(["-o", "out.png", "--dump", "new", "--timings", "t.json"]);
        }
        if !all.iter().any(|argument| argument.starts_with("--size")) {
            all.extend(["--size", "64x48"]);
        }
        let output = of_arguments(folder.path(), &[&["render"], &all[..]].concat()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        let lines = notices(&stderr);
        assert_eq!(output.status.code(), Some(*code), "{arguments}: {stderr}");
        assert_eq!(lines.len(), 1, "{arguments}: {stderr}");
        assert!(lines[0].starts_with("hbao: ") && lines[0].contains(part), "{arguments}: no {part:?} in: {stderr}");
        assert!(output.stdout.is_empty(), "{arguments}");
        assert_eq!(names(folder.path()), before, "{arguments}: a file was left behind");
    }
}

#[test]
fn scenes_that_make_no_sense() {
    refuses(&[
        (FAILED, "missing.obj", "missing.obj: no such file"),
        (FAILED, "malformed.obj", "malformed.obj: "),
        (FAILED, "binary.obj", "binary.obj: "),
        (FAILED, "range.obj", "range.obj: "),
        (FAILED, "negative.obj", "negative.obj: "),
        (FAILED, "nan.obj", "nan.obj: "),
        (FAILED, "inf.obj", "inf.obj: "),
        (FAILED, "overflow.obj", "overflow.obj: "),
        (FAILED, "points.obj", "points.obj: holds no faces, only positions"),
        (FAILED, "empty.obj", "empty.obj: is empty"),
        (FAILED, "bunny.ply", "bunny.ply: its element vertex lacks a property x, y or z"),
        (FAILED, "utf16.obj", "utf16.obj: this is text in UTF-16, and only UTF-8 is read: save it as UTF-8"),
        (FAILED, "taken.png", "taken.png: "),
        (FAILED, "naves", "cornell-box or nave"),
    ]);
}

#[test]
fn extents_and_tiles_that_make_no_sense() {
    refuses(&[
        (USAGE, "--frustum 1,2,3", "--frustum: '1,2,3' is not L,R,B,T"),
        (USAGE, "--frustum 1,2,3,4,5", "--frustum: '1,2,3,4,5' is not L,R,B,T"),
        (USAGE, "--frustum wide", "--frustum: 'wide' is not L,R,B,T"),
        (USAGE, "--frustum 1,1,0,1", "the left edge, the first number, must be less than the right"),
        (USAGE, "--frustum 1,-1,0,1", "the left edge, the first number, must be less than the right"),
        (USAGE, "--frustum -1,1,1,0", "the bottom edge, the third number, must be less than the top"),
        (USAGE, "--frustum nan,1,0,1", "must be finite"),
        (USAGE, "--frustum -1,1,0,NaN", "must be finite"),
        (USAGE, "--frustum -inf,inf,0,1", "must be finite"),
        (USAGE, "--frustum -1,1e300,0,1", "at most 1e6"),
        (USAGE, "--frustum 0,1e-7,0,1", "by at least 1e-6"),
        (USAGE, "--frustum 10,10.001,0,1", "the view's axis"),
        (USAGE, "--frustum 0,1,-10.001,-10", "the view's axis"),
        (USAGE, "--frustum 0 1 0 1", "the numbers of --frustum are separated by commas"),
        (USAGE, "--frustum 0,1,0,1 --fov-y 45", "cannot be used with"),
        (USAGE, "--frustum 0,1,0,1 --ortho 1", "cannot be used with"),
        (USAGE, "--frustum 0,1,0,1 --ortho-frustum 0,1,0,1", "cannot be used with"),
        (USAGE, "--ortho-frustum 0,1,0", "--ortho-frustum: '0,1,0' is not L,R,B,T"),
        (USAGE, "--ortho-frustum 0,0,0,1", "the left edge"),
        (USAGE, "--ortho-frustum 0,1,0,inf", "must be finite"),
        (USAGE, "--ortho-frustum 0,1e16,0,1", "at most 1e15"),
        (USAGE, "--tile 1", "--tile: '1' is not X/N,Y/M"),
        (USAGE, "--tile 0/2", "--tile: '0/2' is not X/N,Y/M"),
        (USAGE, "--tile 0/2,0/2,0/2", "is not X/N,Y/M"),
        (USAGE, "--tile -1/2,0/1", "--tile: '-1/2,0/1' is not X/N,Y/M"),
        (USAGE, "--tile 0.5/2,0/1", "is not X/N,Y/M"),
        (USAGE, "--tile 0/99999999999,0/1", "is not X/N,Y/M"),
        (USAGE, "--tile 2/2,0/1", "has no such column: the 2 columns are numbered 0 to 1"),
        (USAGE, "--tile 0/1,5/3", "has no such row: the 3 rows are numbered 0 to 2"),
        (USAGE, "--tile 0/0,0/1", "has no columns"),
        (USAGE, "--tile 0/65,0/1", "is empty: the image has 64 pixel columns and not 65"),
        (USAGE, "--tile 0/1,0/4294967295", "is empty: the image has 48 pixel rows"),
        (USAGE, "--tile 0/2,0/1 --method ray-march", "ray-march"),
        (USAGE, "--size 300000x10 --tile 0/100,0/1", "up to 262144x262144 pixels"),
        (USAGE, "--size 200000x10 --tile 0/2,0/1", "give smaller tiles"),
        (USAGE, "--size 30000x30000 --tile 0/9,0/9 --radius 1e9", "give smaller tiles"),
    ]);
}

#[test]
fn sizes_and_cameras_out_of_range() {
    refuses(&[
        (USAGE, "--size 0x0", "--size: '0x0'"),
        (USAGE, "--size 0x5", "--size: '0x5'"),
        (USAGE, "--size 5x0", "--size: '5x0'"),
        (USAGE, "--size 99999999999x1", "--size: '99999999999x1'"),
        (USAGE, "--size 100000x100000", "16384x16384"),
        (USAGE, "--size=-3x4", "--size: '-3x4'"),
        (USAGE, "--size big", "--size: 'big' is not WxH"),
        (USAGE, "--size 3x4x5", "--size: "),
        (USAGE, "--eye 1,2,3 --target 1,2,3", "--eye is the same point as --target"),
        (USAGE, "--eye 1,2", "--eye: '1,2' is not X,Y,Z"),
        (USAGE, "--eye 1,nan,2", "--eye 1,NaN,2 must be finite"),
        (USAGE, "--target inf,0,0", "--target inf,0,0 must be finite"),
        (USAGE, "--up 0,0,0", "--up 0,0,0 is not a direction"),
        (USAGE, "--fov-y 0", "from 1 to 175 degrees"),
        (USAGE, "--fov-y 176", "from 1 to 175 degrees"),
        (USAGE, "--fov-y nan", "from 1 to 175 degrees"),
        (USAGE, "--fov-y wide", "--fov-y: 'wide' is not a number"),
        (USAGE, "--ortho 0", "--ortho"),
        (USAGE, "--ortho -1", "--ortho"),
        (USAGE, "--fov-y 45 --ortho 3", "--ortho <HEIGHT>"),
        (USAGE, "--near 3 --far 3", "--near 3 must be less than --far 3"),
        (USAGE, "--near 4.5 --far 3.0", "--near 4.5 must be less than --far 3"),
        (USAGE, "--fov-y 179", "--fov-y 179 must be from 1 to 175 degrees"),
        (USAGE, "--near 0", "--near"),
        (USAGE, "--far inf", "--far"),
        // This is refused before the scene is looked for.
        (USAGE, "missing.obj --near 4 --far 3", "--near"),
    ]);
}

#[test]
fn settings_out_of_range() {
    refuses(&[
        (USAGE, "--directions 0", "--directions: '0' is not a whole number from 1 to 64"),
        (USAGE, "--directions 65", "--directions: '65' is not a whole number from 1 to 64"),
        (USAGE, "--steps 0", "--steps: '0' is not a whole number from 1 to 256"),
        (USAGE, "--steps 257", "--steps: "),
        (USAGE, "--bias -1", "--bias: '-1' is not an angle from 0 to 89"),
        (USAGE, "--bias 90", "--bias: "),
        (USAGE, "--blur 2", "--blur: '2' is neither 0 nor an odd number from 3 to 41"),
        (USAGE, "--blur 4", "--blur: "),
        (USAGE, "--blur 43", "--blur: "),
        (USAGE, "--radius 0", "--radius: "),
        (USAGE, "--radius -1", "--radius: "),
        (USAGE, "--radius nan", "--radius: "),
        (USAGE, "--radius inf", "--radius: "),
        (USAGE, "--radius 0%", "--radius: "),
        (USAGE, "--strength 0", "--strength: "),
        (USAGE, "--blur-depth-sigma 0", "--blur-depth-sigma: "),
        (USAGE, "--attenuation cubic", "--attenuation: 'cubic' is not one of quadratic, linear, none"),
        (USAGE, "--snap steps", "--snap: "),
        (USAGE, "--method gtao", "--method: 'gtao' is not one of"),
        (USAGE, "--show everything", "--show: 'everything' is not one of final, ao,"),
        (USAGE, "--apply none", "--apply: "),
        (USAGE, "--backend wgl", "--backend: 'wgl' is not one of auto, egl, osmesa, glx"),
        (USAGE, "--depth-format r8", "--depth-format: "),
        (USAGE, "--no-such-flag", "unexpected argument '--no-such-flag'"),
        (USAGE, "--step 3", "unexpected argument '--step' found; a similar argument exists: '--steps'"),
        (USAGE, "--steps", "a value is required for '--steps <N>'"),
        (USAGE, "--steps --blur 3", "a value is required for '--steps <N>'"),
        (USAGE, "--radius -1%", "--radius: '-1%' is not a length above 0"),
        (
            USAGE,
            "--radius 5px",
            "write it in scene units, such as 1.5, as a percentage of the scene's size, such as 5%, or",
        ),
        (USAGE, "--step 3 --steps 4", "unexpected argument '--step'"),
        (USAGE, "far.obj --depth-format r16f", "r16f holds depths to 60000"),
        (USAGE, "--depth-format r16f --far 70000", "r16f holds depths to 60000"),
        (
            USAGE,
            "--depth-format r16f --near 6e-5",
            "r16f holds depths from 6.1e-5, and the near plane is 6.0e-5: use r32f",
        ),
    ]);
}

#[test]
fn settings_files_that_make_no_sense() {
    refuses(&[
        (
            FAILED,
            "--settings missing.toml",
            "missing.toml: no such file: give a TOML file, or a PNG or EXR that hbao wrote",
        ),
        (FAILED, "--settings missing.png", "missing.png: no such file: give a TOML file"),
        (FAILED, "--settings taken.png", "taken.png: it is a folder: give a TOML file"),
        (FAILED, "--settings .", ".: it is a folder: give a TOML file"),
        (FAILED, "--settings file/s.toml", "file/s.toml: it cannot be read, not a directory"),
        (FAILED, "--settings malformed.toml", "malformed.toml: line 1: "),
        (FAILED, "--settings unknown.toml", "unknown.toml: line 1: unknown setting 'stepz'"),
        (FAILED, "--settings range.toml", "range.toml: line 3: steps: '300' is not a whole number from 1 to 256"),
        (FAILED, "--settings method.toml", "method.toml: line 1: method: "),
        (FAILED, "--settings binary.toml", "binary.toml: "),
        (FAILED, "--settings table.toml", "table.toml: line 1: unknown setting 'settings'"),
        (FAILED, "point.obj", "point.obj: all its points coincide"),
        #[cfg(unix)]
        (FAILED, "--settings /dev/zero", "/dev/zero: too long"),
    ]);
}

#[test]
fn outputs_that_cannot_be_written() {
    refuses(&[
        (USAGE, "-o out", "must end in .png or .exr, or be - for a PNG on standard output"),
        (USAGE, "-o out.jpg", "must end in .png or .exr, or be - for a PNG on standard output"),
        (USAGE, "-o .png", "must end in .png or .exr, or be - for a PNG on standard output"),
        (FAILED, "-o none/out.png", "the folder none does not exist"),
        (FAILED, "-o taken.png", "it is a folder"),
        (FAILED, "-o file/out.png", "cannot write file/out.png"),
        (FAILED, "-o out.png --dump none/new", "cannot write none/new"),
        (FAILED, "-o out.png --dump file", "it is a file, where a folder is wanted"),
        (FAILED, "-o new/color.png --dump new", "two outputs have this name"),
        (USAGE, "-o out.png --timings far.obj far.obj", "its name must end in .json"),
        (USAGE, "-o out.png --timings unknown.toml", "its name must end in .json"),
        (FAILED, "-o out.png --dump new --timings none/t.json", "the folder none does not exist"),
        #[cfg(target_os = "linux")]
        (FAILED, "-o /proc/x.png", "cannot write /proc/x.png"),
    ]);
}

#[test]
fn values_out_of_range_and_settings_that_exclude_each_other_are_refused() {
    refuses(&[
        (USAGE, "--msaa 3", "--msaa: '3' is not one of 1, 2, 4, 8"),
        (USAGE, "--edges on", "--edges: 'on' is not one of supersample, off"),
        (USAGE, "--half-res=maybe", "--half-res: 'maybe' is neither true nor false"),
        (USAGE, "--method hbao-view --snap step", "give --snap sample, or --spacing 1"),
        (USAGE, "--method hbao-view --snap step --spacing 2", "with spacing 2 no two steps are alike"),
        (USAGE, "--method hbao-view --spacing 5", "--spacing: '5' is not a number from 1 to 4"),
        (USAGE, "--method voxels", "--method: 'voxels' is not one of hbao, hbao-talk"),
        (USAGE, "--rays 0", "--rays: '0' is not a whole number from 1 to 64"),
        (USAGE, "--rays 65", "--rays: "),
        (USAGE, "--ssao-rotation spin", "--ssao-rotation: 'spin' is not one of matrix, mirror"),
        (USAGE, "--ssao-samples 9", "--ssao-samples: '9' is not one of 8, 16, 24"),
        // An error is not preceded by a notice.
        (USAGE, "--edges off --steps 0", "--steps: "),
    ]);
}
