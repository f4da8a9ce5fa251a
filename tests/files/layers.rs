//! Pictures of many layers, as renderers write them, are read channel by channel within their display window.

use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, Vec2, WritableImage, f16,
};
use hbao::image::{Image, Layers, exr};
use std::fs;
use std::path::Path;

const TILES: Blocks = Blocks::Tiles(Vec2(4, 3));

type Part = Layer<AnyChannels<FlatSamples>>;

/// A part of this size whose channels hold 1000 times their index plus 10 times the row plus the column, counted from
/// the top.
fn part(name: &str, size: (usize, usize), at: (i32, i32), blocks: Blocks, channels: &[&str]) -> Part {
    let samples = |i: usize| {
        let texels = (0..size.0 * size.1).map(move |at| 1000 * i + 10 * (at / size.0) + at % size.0);
        match i % 3 {
            0 => FlatSamples::F32(texels.map(|v| v as f32).collect()),
            1 => FlatSamples::F16(texels.map(|v| f16::from_f32(v as f32)).collect()),
            _ => FlatSamples::U32(texels.map(|v| v as u32).collect()),
        }
    };
    let list = channels.iter().enumerate().map(|(i, name)| AnyChannel::new(*name, samples(i))).collect();
    let encoding = Encoding { compression: Compression::ZIP1, blocks, line_order: LineOrder::Increasing };
    let attributes = LayerAttributes::named(name).with_position(Vec2(at.0, at.1));
    Layer::new(size, attributes, encoding, AnyChannels::sort(list))
}

fn write(path: &Path, display: IntegerBounds, parts: Vec<Part>) {
    ExrImage::from_layers(ImageAttributes::new(display), parts).write().to_file(path).unwrap();
}

/// Reads the channel of this name.
fn read(path: &Path, name: &str, outside: f32) -> Image<f32> {
    let picture = Layers::open(path).unwrap();
    let channel = picture.names().position(|found| found == name).unwrap_or_else(|| {
        panic!("no {name} in {:?}", picture.names().collect::<Vec<_>>());
    });
    picture.read(&[channel], outside).unwrap().remove(0)
}

#[test]
fn channels_of_all_parts_are_read_by_name_with_their_rows_from_the_bottom() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    let size = (7, 5);
    let (one, two) = (["A", "N.X", "N.Y", "Z"], ["two.Z", "u"]);
    let parts = vec![part("one", size, (0, 0), Blocks::ScanLines, &one), part("two", size, (0, 0), TILES, &two)];
    write(&path, IntegerBounds::from_dimensions(size), parts);
    let names: Vec<String> = Layers::open(&path).unwrap().names().map(String::from).collect();
    assert_eq!(names, ["one.A", "one.N.X", "one.N.Y", "one.Z", "two.Z", "two.u"]);
    for (name, index) in [("one.A", 0), ("one.N.X", 1), ("one.N.Y", 2), ("one.Z", 3), ("two.Z", 0), ("two.u", 1)] {
        let image = read(&path, name, -1.0);
        let expected = Image::from_fn(7, 5, |x, y| (1000 * index + 10 * (4 - y) + x) as f32);
        assert!(image == expected, "{name}: {image:?}");
        let picture = Layers::open(&path).unwrap();
        assert_eq!(picture.is_half(names.iter().position(|found| found == name).unwrap()), index == 1, "{name}");
    }
    // Several at once, in any order, and one of them twice.
    let images = Layers::open(&path).unwrap().read(&[5, 0, 5], 0.0).unwrap();
    let corners: Vec<f32> = images.iter().map(|image| image.at(0, 4)).collect();
    assert_eq!(corners, [1000.0, 0.0, 1000.0]);
}

#[test]
fn a_picture_is_its_display_window_wherever_its_data_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("window.exr");
    // The data begin left of the display window and below its upper edge, and end below its lower edge.
    let display = IntegerBounds::new((100, -20), (6, 4));
    write(&path, display, vec![part("only", (5, 6), (98, -19), TILES, &["Z"])]);
    let image = read(&path, "Z", 7.5);
    let expected = Image::from_fn(6, 4, |x, y| {
        let row = 3 - y;
        if x < 3 && row >= 1 { (10 * (row - 1) + x + 2) as f32 } else { 7.5 }
    });
    assert_eq!(image, expected);
    // They may be elsewhere altogether.
    write(&path, display, vec![part("only", (5, 6), (300, 300), Blocks::ScanLines, &["Z"])]);
    assert_eq!(read(&path, "Z", 7.5), Image::filled(6, 4, 7.5));
}

#[test]
fn a_small_file_with_a_large_display_window_is_refused_before_memory_is_set_aside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.exr");
    write(&path, IntegerBounds::new((0, 0), (1 << 20, 1 << 20)), vec![part("only", (4, 4), (0, 0), TILES, &["Z"])]);
    let message = Layers::open(&path).err().unwrap().to_string();
    assert!(message.ends_with("it has 1048576x1048576 pixels, and at most 33554432 are read: cut it up"), "{message}");
}

#[test]
fn a_file_that_lies_about_its_blocks_leaves_no_pixel_that_looks_like_a_sample() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("twice.exr");
    let size = (4, 2);
    write(&path, IntegerBounds::from_dimensions(size), vec![part("only", size, (0, 0), Blocks::ScanLines, &["Z"])]);
    let mut bytes = fs::read(&path).unwrap();
    // Both entries of the table of blocks lead to the first block. The table stands before the blocks.
    let block = u64::from_le_bytes(bytes[bytes.len() - 8..].try_into().unwrap());
    assert!(block > 0);
    let start = (0..bytes.len() - 16)
        .find(|&i| {
            let entry = |i: usize| u64::from_le_bytes(bytes[i..i + 8].try_into().unwrap());
            entry(i) == i as u64 + 16 && entry(i + 8) > entry(i) && entry(i + 8) < bytes.len() as u64
        })
        .unwrap();
    let first: [u8; 8] = bytes[start..start + 8].try_into().unwrap();
    bytes[start + 8..start + 16].copy_from_slice(&first);
    fs::write(&path, &bytes).unwrap();
    let image = read(&path, "Z", 0.0);
    assert_eq!(image.texels[4..], [0.0, 1.0, 2.0, 3.0]);
    assert!(image.texels[..4].iter().all(|z| z.is_nan()), "{image:?}");
}

#[test]
fn damaged_files_are_errors_or_pictures_and_no_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.exr");
    let parts =
        vec![part("a", (7, 5), (1, 1), TILES, &["Z", "u"]), part("b", (6, 4), (0, 0), Blocks::ScanLines, &["Y"])];
    write(&path, IntegerBounds::from_dimensions((8, 6)), parts);
    let whole = fs::read(&path).unwrap();
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let picture = Layers::open(&path)?;
        let all: Vec<usize> = (0..picture.names().count()).collect();
        picture.read(&all, 0.0)
    };
    assert_eq!(read(&whole).unwrap().len(), 3);
    for length in (0..whole.len()).step_by(3) {
        assert!(read(&whole[..length]).is_err(), "{length} bytes of {}", whole.len());
    }
    for place in 0..whole.len() {
        for damage in [0x01, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[place] ^= damage;
            drop(read(&bytes));
        }
    }
}

#[test]
fn a_file_that_the_command_writes_has_one_channel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("depth.exr");
    let image = Image::from_fn(3, 2, |x, y| (x + 3 * y) as f32);
    fs::write(&path, exr::encode(&image, &[]).unwrap()).unwrap();
    assert_eq!(Layers::open(&path).unwrap().names().collect::<Vec<_>>(), ["Y"]);
    assert_eq!(read(&path, "Y", 0.0), image);
}
