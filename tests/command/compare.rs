//! `hbao compare` measures the difference of two pictures that any program may have written, and fails past a bound.

use crate::rig::command::{cached, names, texts};
use ::exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image as ExrImage, WritableImage, f16};
use ::png::{BitDepth, ColorType, Encoder};
use hbao::image::{Image, exr, png};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A picture of black and white, with the top row first. Every kind of file can hold it exactly.
const WIDTH: usize = 5;
const WHITE: [u8; 15] = [1, 0, 0, 1, 1, 1, 1, 0, 0, 1, 0, 1, 1, 0, 0];

/// The same picture as a grey PNG that is interlaced (Adam7), which no encoder at hand writes.
const INTERLACED: [u8; 78] = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00, 0x00,
    0x05, 0x00, 0x00, 0x00, 0x03, 0x08, 0x00, 0x00, 0x00, 0x01, 0x09, 0x5a, 0xaa, 0xb2, 0x00, 0x00, 0x00, 0x15, 0x49,
    0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0xf8, 0xcf, 0xf0, 0x9f, 0x01, 0x08, 0xfe, 0x83, 0x31, 0x90, 0xfc, 0x0f, 0xc2,
    0x00, 0x51, 0xc4, 0x07, 0xf9, 0x30, 0x46, 0x7f, 0x08, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42,
    0x60, 0x82,
];

/// Writes a PNG of any kind. `bytes` holds its rows from the top.
fn write_png(path: &Path, size: (usize, usize), color: ColorType, depth: BitDepth, bytes: &[u8]) {
    let mut encoder = Encoder::new(fs::File::create(path).unwrap(), size.0 as u32, size.1 as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ColorType::Indexed {
        // The palette has white before black.
        encoder.set_palette(vec![255, 255, 255, 0, 0, 0]);
    }
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
}

/// Writes a grey PNG with 8 bits and one row.
fn write_row(path: &Path, bytes: &[u8]) {
    write_png(path, (bytes.len(), 1), ColorType::Grayscale, BitDepth::Eight, bytes);
}

/// Writes an EXR with these channels. The rows of each begin at the top.
fn write_exr(path: &Path, width: usize, all: &[(&str, FlatSamples)]) {
    let height = all[0].1.len() / width;
    let list = all.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
    ExrImage::from_channels((width, height), AnyChannels::sort(list)).write().to_file(path).unwrap();
}

/// Runs the command, and returns its exit code and what it wrote to stdout and to stderr.
fn compare(folder: &Path, arguments: &str) -> (i32, [String; 2]) {
    let output = cached(folder, &format!("compare {arguments}"));
    (output.status.code().unwrap(), texts(&output))
}

/// Runs the command, which must succeed without a notice, and returns its measures.
fn measures(folder: &Path, arguments: &str) -> Value {
    let (code, [_, stderr]) = compare(folder, &format!("{arguments} --json m.json"));
    assert_eq!((code, &*stderr), (0, ""), "{arguments}");
    serde_json::from_slice(&fs::read(folder.join("m.json")).unwrap()).unwrap()
}

#[test]
fn one_picture_in_files_of_every_kind_is_equal() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let each = |texel: &dyn Fn(u8) -> Vec<u8>| WHITE.iter().flat_map(|&white| texel(255 * white)).collect::<Vec<u8>>();
    let bits = |flip: u8| -> Vec<u8> {
        let row = |row: &[u8]| (0..WIDTH).map(|x| (row[x] ^ flip) << (7 - x)).sum();
        WHITE.chunks(WIDTH).map(row).collect()
    };
    for (name, color, depth, bytes) in [
        ("grey", ColorType::Grayscale, BitDepth::Eight, each(&|v| vec![v])),
        ("grey1", ColorType::Grayscale, BitDepth::One, bits(0)),
        ("grey16", ColorType::Grayscale, BitDepth::Sixteen, each(&|v| vec![v; 2])),
        ("grey-alpha", ColorType::GrayscaleAlpha, BitDepth::Eight, each(&|v| vec![v, 255])),
        ("palette", ColorType::Indexed, BitDepth::One, bits(1)),
        ("rgb", ColorType::Rgb, BitDepth::Eight, each(&|v| vec![v; 3])),
        ("rgb16", ColorType::Rgb, BitDepth::Sixteen, each(&|v| vec![v; 6])),
        ("rgba", ColorType::Rgba, BitDepth::Eight, each(&|v| vec![v, v, v, 255])),
        ("rgba16", ColorType::Rgba, BitDepth::Sixteen, each(&|v| vec![v, v, v, v, v, v, 255, 255])),
    ] {
        write_png(&at(&format!("{name}.png")), (WIDTH, 3), color, depth, &bytes);
    }
    fs::write(at("interlaced.png"), INTERLACED).unwrap();
    let half = FlatSamples::F16(WHITE.iter().map(|&v| f16::from_f32(f32::from(v))).collect());
    let float = FlatSamples::F32(WHITE.iter().map(|&v| f32::from(v)).collect());
    let ones = FlatSamples::F16(vec![f16::ONE; 15]);
    let number = FlatSamples::U32(WHITE.iter().map(|&v| u32::from(v)).collect());
    write_exr(&at("y.exr"), WIDTH, &[("Y", float.clone())]);
    write_exr(&at("half.exr"), WIDTH, &[("Y", half.clone())]);
    write_exr(&at("named.exr"), WIDTH, &[("AO", number)]);
    write_exr(&at("rgb.exr"), WIDTH, &["R", "G", "B"].map(|name| (name, half.clone())));
    let alpha = [("R", half.clone()), ("G", half.clone()), ("B", float), ("A", ones)];
    write_exr(&at("rgba.exr"), WIDTH, &alpha);

    let files = names(folder.path());
    assert_eq!(files.len(), 15);
    // Each file is compared with the next one, and with the grey one.
    for (a, b) in files.iter().zip(files.iter().cycle().skip(1)).chain(files.iter().map(|a| (a, &files[0]))) {
        let (code, [stdout, stderr]) = compare(folder.path(), &format!("{a} {b} --max-rmse 0 --max-pixels 0"));
        assert_eq!((code, &*stderr), (0, ""), "{a} {b}: {stdout}");
        assert!(stdout.contains("PSNR                    inf\n") && stdout.contains("0 of 15\n"), "{a} {b}: {stdout}");
    }
    // The same files, one sample of which differs.
    let mut other = each(&|v| vec![v]);
    other[7] = 51;
    write_png(&at("other"), (WIDTH, 3), ColorType::Grayscale, BitDepth::Eight, &other);
    for file in &files {
        let measured = measures(folder.path(), &format!("other {file}"));
        assert!((measured["max"].as_f64().unwrap() - 0.2).abs() < 1e-12, "{file}: {measured}");
        assert!((measured["bias"].as_f64().unwrap() - 0.2 / 15.0).abs() < 1e-12, "{file}: {measured}");
        assert_eq!((&measured["pixels_over_tolerance"], &measured["pixels"]), (&1.into(), &15.into()), "{file}");
    }
}

#[test]
fn the_measures_are_those_worked_out_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    write_row(&folder.path().join("a.png"), &[51, 102, 0, 0]);
    write_row(&folder.path().join("b.png"), &[0, 0, 51, 0]);
    let measured = measures(folder.path(), "a.png b.png");
    let holds = |name: &str, expected: f64| {
        let got = measured[name].as_f64().unwrap();
        assert!((got - expected).abs() < 1e-9, "{name}: {got}, expected {expected}");
    };
    let rmse = (6.0f64 * 0.04 / 4.0).sqrt();
    holds("rmse", rmse);
    holds("mae", 0.2);
    holds("max", 0.4);
    holds("bias", 0.1);
    holds("psnr", 10.0 * (1.0 / 0.06f64).log10());
    assert!(measured["flip"].as_f64().is_some_and(|flip| flip > 0.0 && flip < 1.0), "{measured}");
    assert_eq!((&measured["size"], &measured["channels"]), (&serde_json::json!([4, 1]), &serde_json::json!(["Y"])));
    // An infinite number has no place in JSON.
    let equal = measures(folder.path(), "a.png a.png");
    assert!(equal["psnr"].is_null() && equal["rmse"] == 0.0 && equal["flip"].as_f64() < Some(1e-6), "{equal}");
}

#[test]
fn a_bound_that_is_exceeded_exits_with_1_in_one_line_and_still_writes_the_heat_map() {
    let folder = tempfile::tempdir().unwrap();
    // The steps of 8 bits by which pixels differ, and the colours that --help gives them.
    let steps: [(u8, [u8; 3]); 8] = [
        (0, [0, 0, 0]),
        (1, [0, 0, 160]),
        (2, [0, 160, 255]),
        (4, [0, 160, 255]),
        (16, [0, 200, 0]),
        (64, [255, 230, 0]),
        (65, [255, 0, 0]),
        (255, [255, 0, 0]),
    ];
    write_row(&folder.path().join("a.png"), &steps.map(|(step, _)| step));
    write_row(&folder.path().join("b.png"), &[0; 8]);
    for (bounds, code) in [
        ("", 0),
        ("--max-rmse 1", 0),
        ("--max-rmse 0.3", 1),
        ("--max-pixels 7", 0),
        ("--max-pixels 6", 1),
        ("--tolerance 1", 0),
        ("--tolerance 254/255", 1),
        ("--tolerance 64/255 --max-pixels 2", 0),
        ("--tolerance 63/255 --max-pixels 2", 1),
        ("--tolerance 0.0157 --max-pixels 4 --max-rmse 0.3", 1),
    ] {
        let (got, [stdout, stderr]) =
            compare(folder.path(), &format!("a.png b.png {bounds} --heat heat.png --json m.json"));
        assert_eq!(got, code, "{bounds}: {stdout}{stderr}");
        assert!(stdout.contains("RMSE                    0.37620\n"), "{bounds}: {stdout}");
        if code == 1 {
            assert!(
                stderr.starts_with("hbao: a.png: it differs from b.png: ") && stderr.lines().count() == 1,
                "{stderr}"
            );
        } else {
            assert_eq!(stderr, "", "{bounds}");
        }
        let heat = png::read::<[u8; 3]>(&folder.path().join("heat.png")).unwrap();
        assert_eq!(heat.texels, steps.map(|(_, colour)| colour), "{bounds}");
        let measured: Value = serde_json::from_slice(&fs::read(folder.path().join("m.json")).unwrap()).unwrap();
        assert_eq!(measured["within_bounds"], code == 0, "{bounds}");
        fs::remove_file(folder.path().join("heat.png")).unwrap();
    }
}

#[test]
fn infinities_and_nans_are_equal_to_themselves_and_reported_against_everything_else() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, texels: [f32; 4]| {
        let image = Image { width: 4, height: 1, texels: texels.to_vec() };
        fs::write(folder.path().join(name), exr::encode(&image, &[]).unwrap()).unwrap();
    };
    write("a.exr", [f32::INFINITY, f32::NAN, f32::NEG_INFINITY, 7.5]);
    write("b.exr", [f32::INFINITY, f32::INFINITY, f32::INFINITY, 7.0]);
    let (code, [stdout, stderr]) = compare(folder.path(), "a.exr a.exr --max-rmse 0 --max-pixels 0");
    assert_eq!((code, &*stderr), (0, ""), "{stdout}");
    let measured = measures(folder.path(), "a.exr b.exr --heat h.png");
    // Of the four pixels, one has equal infinities and one can be subtracted.
    assert_eq!((&measured["pixels_not_finite"], &measured["pixels_over_tolerance"]), (&2.into(), &3.into()));
    assert_eq!((measured["mae"].as_f64(), measured["max"].as_f64()), (Some(0.25), Some(0.5)));
    assert!(measured["flip"].is_null());
    let heat = png::read::<[u8; 3]>(&folder.path().join("h.png")).unwrap().texels;
    let magenta: Vec<bool> = heat.iter().map(|&colour| colour == [255, 0, 255]).collect();
    assert_eq!(magenta, [false, true, true, false]);
    for (bounds, code) in [("--max-rmse 1e9", 1), ("--tolerance 1e9", 1), ("--tolerance 1e9 --max-pixels 2", 0)] {
        let (got, [stdout, stderr]) = compare(folder.path(), &format!("a.exr b.exr {bounds}"));
        assert_eq!(got, code, "{bounds}: {stdout}{stderr}");
        assert!(stdout.contains("2 pixels, left out of the measures"), "{stdout}");
    }
    // If nothing can be subtracted, there is no error to tell.
    write("c.exr", [1.0; 4]);
    write("d.exr", [f32::NAN; 4]);
    let (code, [stdout, _]) = compare(folder.path(), "c.exr d.exr");
    assert!(code == 0 && stdout.contains("RMSE                    none\n"), "{stdout}");
    assert_eq!(compare(folder.path(), "c.exr d.exr --max-rmse 1").0, 1);
}

#[test]
fn channels_of_one_file_alone_are_told_and_alpha_counts_where_it_is_not_opaque() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let plane = |value: f32| FlatSamples::F32(vec![value; 2]);
    write_exr(&at("rgbz.exr"), 2, &[("R", plane(0.5)), ("G", plane(0.5)), ("B", plane(0.5)), ("Z", plane(9.0))]);
    write_exr(&at("rgb.exr"), 2, &["R", "G", "B"].map(|name| (name, plane(0.5))));
    write_exr(&at("rgba.exr"), 2, &["R", "G", "B", "A"].map(|name| (name, plane(0.5))));
    write_exr(&at("uv.exr"), 2, &["u", "v"].map(|name| (name, plane(0.5))));
    let (code, [stdout, stderr]) = compare(folder.path(), "rgbz.exr rgb.exr");
    assert_eq!((code, &*stderr), (0, "hbao: only one of the files has Z: only R, G, B is compared\n"), "{stdout}");
    // A golden image with a channel that is not there any more is no success.
    for bound in ["--max-rmse 1", "--max-pixels 9", "--tolerance 1"] {
        let (code, [_, stderr]) = compare(folder.path(), &format!("rgbz.exr rgb.exr {bound}"));
        assert!(code == 1 && stderr.contains("only one of them has Z, which no bound allows"), "{stderr}");
    }
    let measured = measures(folder.path(), "rgb.exr rgba.exr");
    assert_eq!(
        (&measured["channels"], measured["bias"].as_f64()),
        (&serde_json::json!(["R", "G", "B", "A"]), Some(0.125))
    );
    let (code, [stdout, stderr]) = compare(folder.path(), "uv.exr rgb.exr");
    assert_eq!((code, &*stdout, stderr.lines().count()), (1, "", 1), "{stderr}");
    assert!(stderr.contains("no channel in common: one has u, v, the other B, G, R"), "{stderr}");
}

#[test]
fn what_cannot_be_compared_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_row(&at("a.png"), &[1, 2, 3]);
    write_row(&at("wide.png"), &[1, 2, 3, 4]);
    fs::write(at("text.png"), "not a picture").unwrap();
    fs::write(at("empty.png"), "").unwrap();
    let whole = fs::read(at("a.png")).unwrap();
    fs::write(at("cut.png"), &whole[..whole.len() / 2]).unwrap();
    write_exr(&at("a.exr"), 3, &[("Y", FlatSamples::F32(vec![0.0; 3]))]);
    let whole = fs::read(at("a.exr")).unwrap();
    fs::write(at("cut.exr"), &whole[..whole.len() - 5]).unwrap();
    // A picture of few bytes and many pixels: each row of one bit per pixel compresses to next to nothing.
    write_png(
        &at("huge.png"),
        (1 << 16, 1 << 10),
        ColorType::Grayscale,
        BitDepth::One,
        &vec![0; (1 << 13) * (1 << 10)],
    );
    let before = names(folder.path());
    for (code, arguments, part) in [
        (1, "huge.png huge.png", "huge.png: it has 65536x1024 pixels, and at most 33554432 are read"),
        (
            1,
            "a.png wide.png",
            "a.png: compared with wide.png: pictures of different sizes cannot be compared: 3x1 and 4x1",
        ),
        (1, "a.png text.png", "text.png: it is neither a PNG nor an EXR file"),
        (1, "a.png empty.png", "empty.png: it is neither a PNG nor an EXR file"),
        (1, "a.png cut.png", "cut.png: the file is damaged or cut off"),
        (1, "cut.exr a.exr", "cut.exr: the file is damaged or cut off"),
        (1, "a.png none.png", "none.png: no such file"),
        (1, "a.png .", ".: this is a folder, and not a picture"),
        (2, "a.png", "B"),
        (2, "a.png a.png --max-rmse -1", "--max-rmse: '-1' is not a number of at least 0"),
        (2, "a.png a.png --max-rmse nan", "--max-rmse: 'nan'"),
        (2, "a.png a.png --tolerance 1/0", "--tolerance: '1/0'"),
        (2, "a.png a.png --tolerance 1/2/3", "--tolerance: '1/2/3'"),
        (2, "a.png a.png --max-pixels 1.5", "--max-pixels: '1.5' is not a whole number"),
        (2, "a.png wide.png --heat a.png", "--heat a.png: this is one of the pictures to compare"),
        (2, "a.png wide.png --heat ./wide.png", "--heat ./wide.png: this is one of the pictures to compare"),
        (2, "a.png a.png --heat heat.exr", "--heat heat.exr: its name must end in .png"),
        (1, "a.png a.png --heat none/heat.png", "none/heat.png: the folder none does not exist"),
    ] {
        let (got, [stdout, stderr]) = compare(folder.path(), &format!("{arguments} --json m.json"));
        assert_eq!((got, &*stdout, stderr.lines().count()), (code, "", 1), "{arguments}: {stderr}");
        assert!(stderr.starts_with("hbao: ") && stderr.contains(part), "{arguments}: no {part:?} in: {stderr}");
        assert_eq!(names(folder.path()), before, "{arguments}");
    }
}

#[test]
fn a_rendering_is_compared_with_another() {
    let folder = tempfile::tempdir().unwrap();
    for (name, flags) in [("a.exr", "--show ao"), ("b.exr", "--show ao --steps 4"), ("depth.exr", "--show depth")] {
        let output = cached(folder.path(), &format!("render -o {name} --size 48x36 {flags}"));
        assert!(output.status.success());
    }
    assert_eq!(compare(folder.path(), "a.exr a.exr --max-rmse 0").0, 0);
    assert_eq!(compare(folder.path(), "b.exr a.exr --max-rmse 1e-6").0, 1);
    // The background of depth is infinite.
    let (code, [stdout, _]) = compare(folder.path(), "depth.exr depth.exr --max-rmse 0 --max-pixels 0");
    assert_eq!(code, 0, "{stdout}");
}
