//! `--tile` writes what the whole picture holds there. `--frustum` and `--ortho-frustum` with centred extents write
//! what `--fov-y` and `--ortho` write.

use crate::rig::command::{cached, names, texts};
use glam::DVec3;
use hbao::Settings;
use hbao::image::{Image, exr, png};
use hbao::reference::{self, TwinInputs, blur};
use hbao::scene::{Lens, Scene, View};
use std::fs;
use std::path::Path;

/// Both sides are odd.
const SIZE: (u32, u32) = (201, 151);

/// Renders and dumps into a folder; returns the notices.
fn render(folder: &Path, name: &str, arguments: &str) -> String {
    let (width, height) = SIZE;
    let output =
        cached(folder, &format!("render nave -o {name}.png --dump {name} --size {width}x{height} {arguments}"));
    let [_, stderr] = texts(&output);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    stderr
}

fn floats(folder: &Path, file: &str) -> Image<f32> {
    exr::read(&folder.join(file)).unwrap()
}

/// Returns the settings that an image was rendered with.
fn settings(file: &Path) -> Settings {
    let text = exr::read_text(file).unwrap().into_iter().find(|(keyword, _)| keyword == "hbao").unwrap().1;
    let mut settings = Settings::default();
    settings.read_toml(&text).unwrap();
    settings
}

/// Returns the first pixel of share `index` of `count` of a side, as the specification has it.
fn first(side: u32, index: u32, count: u32) -> usize {
    (side * index / count) as usize
}

/// Returns the pixels of a tile, y up, as its lower left corner and its size.
fn pixels([x, n, y, m]: [u32; 4]) -> ((usize, usize), (usize, usize)) {
    let (left, right) = (first(SIZE.0, x, n), first(SIZE.0, x + 1, n));
    let (top, below) = (first(SIZE.1, y, m), first(SIZE.1, y + 1, m));
    ((left, SIZE.1 as usize - below), (right - left, below - top))
}

/// The pixels of a whole picture at which the methods' roundings and comparisons are in doubt, before and after the
/// blur.
fn ambiguous(folder: &Path, lens: Lens) -> [Image<bool>; 2] {
    let settings = settings(&folder.join("whole/ao.exr"));
    let scene = Scene::open("nave").unwrap();
    let view = View { lens: Some(lens), ..View::default() }.or(&scene.view);
    let camera = view.camera(&scene.mesh, SIZE.0, SIZE.1).unwrap().0;
    let depth = floats(folder, "whole/depth.exr");
    let normals: Image<[f32; 3]> = exr::read(&folder.join("whole/normals.exr")).unwrap();
    let tile: Image<[f32; 3]> = exr::read(&folder.join("whole/rotation.exr")).unwrap();
    let (projection, near) = (camera.projection, camera.near);
    let inputs = TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
    let raw = reference::ambiguous(&inputs, &settings).unwrap();
    let ao = floats(folder, "whole/ao_raw.exr").map(f64::from);
    let blurred = blur::ambiguous(&ao, &depth, &[], projection, &settings).unwrap();
    // The blur spreads what is in doubt.
    let (reach, scale) = (settings.blur_reach() as usize, depth.width.div_ceil(raw.width));
    let blurred = Image::from_fn(blurred.width, blurred.height, |x, y| {
        let along =
            |at: usize, texels: usize| (at.saturating_sub(reach) / scale)..((at + reach) / scale + 1).min(texels);
        blurred.at(x, y) || along(y, raw.height).any(|j| along(x, raw.width).any(|i| raw.at(i, j)))
    });
    [raw, blurred]
}

/// Asserts that a tile's image is the part of the whole one, except for pixels in doubt. One pixel of 1000, or two, may
/// differ.
fn hold_part(tile: &Image<f32>, whole: &Image<f32>, doubtful: &Image<bool>, tolerance: f32, at: (usize, usize)) {
    let mut off = Vec::new();
    for y in 0..tile.height {
        for x in 0..tile.width {
            let (a, b) = (tile.at(x, y), whole.at(at.0 + x, at.1 + y));
            let differ = a.is_finite() != b.is_finite() || (a.is_finite() && (a - b).abs() > tolerance * b.max(1.0));
            if differ && !doubtful.at(at.0 + x, at.1 + y) {
                off.push((x, y, a, b));
            }
        }
    }
    assert!(off.len() <= (tile.texels.len() / 1000).max(2), "{} of {}: {off:?}", off.len(), tile.texels.len());
}

fn hold_tiles(arguments: &str, lens: Lens, tiles: &[[u32; 4]]) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let arguments = format!("{arguments} --msaa 1");
    render(folder, "whole", &arguments);
    let [raw_doubt, doubt] = ambiguous(folder, lens);
    let none = doubt.map(|_| false);
    let [ao, raw, depth] = ["ao", "ao_raw", "depth"].map(|name| floats(folder, &format!("whole/{name}.exr")));
    let step = 1.001 / 255.0;
    for &tile in tiles {
        let [x, n, y, m] = tile;
        let notices = render(folder, "tile", &format!("{arguments} --tile {x}/{n},{y}/{m}"));
        let (corner, (width, height)) = pixels(tile);
        let text = format!("{arguments} {tile:?} {notices}");
        let [part, part_raw, part_depth] =
            ["ao", "ao_raw", "depth"].map(|name| floats(folder, &format!("tile/{name}.exr")));
        assert_eq!((part.width, part.height, part_depth.width), (width, height, width), "{text}");
        hold_part(&part_depth, &depth, &none, 1e-4, corner);
        hold_part(&part, &ao, &doubt, step, corner);
        let scale = if raw.width == ao.width { 1 } else { 2 };
        let first = (corner.0.div_ceil(scale), corner.1.div_ceil(scale));
        let size = ((corner.0 + width).div_ceil(scale) - first.0, (corner.1 + height).div_ceil(scale) - first.1);
        assert_eq!((part_raw.width, part_raw.height), size, "{text}");
        hold_part(&part_raw, &raw, &raw_doubt, step, first);
        let rotations = ["whole", "tile"].map(|name| exr::read::<[f32; 3]>(&folder.join(name).join("rotation.exr")));
        let [a, b] = rotations.map(Result::unwrap);
        assert_eq!(a, b, "{text}");
    }
}

const TILES: [[u32; 4]; 3] = [[2, 3, 1, 2], [0, 3, 0, 2], [3, 7, 2, 5]];

#[test]
fn tiles_are_their_part_of_the_whole_picture() {
    let lens = Scene::open("nave").unwrap().view.lens.unwrap();
    hold_tiles("", lens, &TILES);
    hold_tiles("--blur 21 --exit shorten --steps 12", lens, &TILES);
    hold_tiles("--half-res", lens, &TILES);
    hold_tiles("--half-res --blur-kernel full --blur 21 --snap sample", lens, &TILES[1..]);
}

#[test]
fn tiles_of_every_other_method_are_their_part_of_the_whole_picture() {
    let lens = Scene::open("nave").unwrap().view.lens.unwrap();
    for arguments in
        ["ssao", "ssao --half-res", "ssao --ssao-depth half", "hbao-talk", "microsphere", "crease --half-res"]
    {
        hold_tiles(&format!("--method {arguments}"), lens, &TILES[..2]);
    }
}

#[test]
fn tiles_of_off_centre_and_of_orthographic_pictures_are_their_part_of_the_whole() {
    hold_tiles("--frustum=-0.2,0.9,-0.1,0.6", Lens::Frustum([-0.2, 0.9, -0.1, 0.6]), &TILES[..2]);
    hold_tiles("--ortho 12 --half-res", Lens::Height(12.0), &TILES[..2]);
    hold_tiles("--ortho-frustum=-8,3,-2,5", Lens::OrthoFrustum([-8.0, 3.0, -2.0, 5.0]), &TILES[..2]);
}

#[test]
fn all_tiles_together_make_the_whole_picture() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The depth samples of edge pixels are of the whole picture too.
    render(folder, "whole", "--method ssao");
    let whole: Image<[u8; 3]> = png::read(&folder.join("whole.png")).unwrap();
    let mut seen = Image::filled(whole.width, whole.height, [7; 3]);
    for x in 0..3 {
        for y in 0..2 {
            render(folder, "tile", &format!("--method ssao --tile {x}/3,{y}/2"));
            let tile: Image<[u8; 3]> = png::read(&folder.join("tile.png")).unwrap();
            let ((left, low), size) = pixels([x, 3, y, 2]);
            assert_eq!((tile.width, tile.height), size);
            for j in 0..size.1 {
                for i in 0..size.0 {
                    seen.texels[(low + j) * whole.width + left + i] = tile.at(i, j);
                }
            }
        }
    }
    let far = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1);
    let off = seen.texels.iter().zip(&whole.texels).filter(far).count();
    assert!(off <= whole.texels.len() / 200, "{off} of {}", whole.texels.len());
}

#[test]
fn a_tile_without_ambient_occlusion_and_one_without_surfaces_are_written_too() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for show in ["color", "depth", "normals", "edges"] {
        let arguments = format!("render -o {show}.png --show {show} --size 64x48 --tile 3/5,0/5");
        let output = cached(folder, &arguments);
        let [_, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let greys = "the greys of a PNG of depth are those of this tile alone: write EXR to put tiles together";
        assert_eq!(stderr.contains(greys), show == "depth", "{stderr}");
        let size = png::read::<[u8; 3]>(&folder.join(format!("{show}.png"))).map_or_else(
            |_| {
                let grey: Image<u8> = png::read(&folder.join(format!("{show}.png"))).unwrap();
                (grey.width, grey.height)
            },
            |image| (image.width, image.height),
        );
        assert_eq!(size, (13, 9), "{show}");
    }
    fs::write(folder.join("small.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let output = cached(
        folder,
        "render small.obj -o none.png --size 60x60 --eye 0.3,0.3,9 --target 0.3,0.3,0 --fov-y 60 --tile 0/4,0/4",
    );
    let [_, stderr] = texts(&output);
    assert!(output.status.success() && stderr.contains("no surface lies in this tile"), "{stderr}");
    assert_eq!(png::read::<[u8; 3]>(&folder.join("none.png")).unwrap().texels, vec![[255; 3]; 225]);
}

/// The extents of the projection of these settings, as one types them.
fn typed(lens: Lens, size: (u32, u32)) -> String {
    let mesh = hbao::scene::Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap();
    let camera = View { lens: Some(lens), ..View::default() }.camera(&mesh, size.0, size.1).unwrap().0;
    let [x, y] = camera.projection.half_extents();
    format!("{:?},{x:?},{:?},{y:?}", -x, -y)
}

#[test]
fn centred_extents_write_the_files_of_the_field_of_view_and_of_the_height_to_the_bit() {
    let size = (97, 61);
    for (symmetric, extents) in [
        ("--fov-y 50", format!("--frustum={}", typed(Lens::FovY(50f64.to_radians()), size))),
        ("--ortho 600", format!("--ortho-frustum={}", typed(Lens::Height(600.0), size))),
    ] {
        for more in ["", "--half-res", "--method ssao"] {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path();
            for (name, lens) in [("a", symmetric), ("b", extents.as_str())] {
                let arguments = format!("render -o {name}.png --dump {name} --size 97x61 {lens} {more}");
                let output = cached(folder, &arguments);
                assert_eq!(output.status.code(), Some(0), "{arguments}: {}", texts(&output)[1]);
            }
            let files = names(&folder.join("a"));
            assert_eq!(files, names(&folder.join("b")));
            for file in files
                .iter()
                .map(|file| ("a/".to_string() + file, "b/".to_string() + file))
                .chain([("a.png".to_string(), "b.png".to_string())])
            {
                let same = fs::read(folder.join(&file.0)).unwrap() == fs::read(folder.join(&file.1)).unwrap();
                assert!(same, "{file:?} {extents} {more}");
            }
        }
    }
}

#[test]
fn extents_and_tiles_are_in_the_metadata_and_truth_takes_the_extents() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let output = cached(folder, "render -o a.png --size 64x48 --frustum=-0.1,0.3,-0.2,0.25 --tile 1/2,0/1");
    assert!(output.status.success(), "{}", texts(&output)[1]);
    let text = png::read_text(&folder.join("a.png")).unwrap().into_iter().find(|(k, _)| k == "hbao").unwrap().1;
    for line in ["frustum = [-0.1, 0.3, -0.2, 0.25]", "tile = \"1/2,0/1\"", "size = [64, 48]"] {
        assert!(text.lines().any(|one| one == line), "{line} is not in {text}");
    }
    let output = cached(folder, "truth -o t.exr --size 24x16 --frustum=-0.1,0.3,-0.2,0.25 --truth-rays 2");
    assert!(output.status.success(), "{}", texts(&output)[1]);
}

/// Reads a grey PNG as visibility.
fn grey(folder: &Path, name: &str) -> Image<f32> {
    let image: Image<u8> = png::read(&folder.join(name)).unwrap();
    image.map(|byte| f32::from(byte) / 255.0)
}

#[test]
fn a_picture_that_is_rendered_in_tiles_is_the_one_in_one_piece() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let lens = Lens::FovY(50_f64.to_radians());
    for arguments in ["", "--half-res --blur 21", "--method ssao", "--method hbao-view --blur 0", "--radius 12%view"] {
        let arguments = format!("{arguments} --msaa 1 --fov-y 50");
        render(folder, "whole", &arguments);
        let [raw_doubt, doubt] = ambiguous(folder, lens);
        for (show, file, doubt) in [("ao", "ao", &doubt), ("ao-raw", "ao_raw", &raw_doubt)] {
            let whole = floats(folder, &format!("whole/{file}.exr"));
            let (width, height) = SIZE;
            let tiles =
                format!("render nave -o tiles.png --size {width}x{height} {arguments} --show {show} --tile-size 64");
            let output = cached(folder, &tiles);
            assert_eq!(output.status.code(), Some(0), "{tiles}: {:?}", texts(&output));
            let tiles = grey(folder, "tiles.png");
            assert_eq!((tiles.width, tiles.height), (whole.width, whole.height), "{arguments} {show}");
            // Half a step of 8 bits is rounding.
            hold_part(&tiles, &whole, doubt, 1.501 / 255.0, (0, 0));
            assert!(tiles.texels.iter().any(|&a| a < 0.9), "{arguments} {show}");
        }
    }
}

#[test]
fn a_size_above_the_drivers_limit_is_rendered_in_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let arguments = "--size 17000x40 --fov-y 50 --msaa 1 --blur 0 --radius 2 --exit shorten --show ao";
    for more in ["-o whole.png", "-o left.png --tile 0/2,0/1", "-o right.png --tile 1/2,0/1"] {
        let output = cached(folder, &format!("render nave {arguments} {more}"));
        assert_eq!(output.status.code(), Some(0), "{more}: {:?}", texts(&output));
    }
    let [whole, left, right]: [Image<u8>; 3] =
        ["whole", "left", "right"].map(|name| png::read(&folder.join(name).with_extension("png")).unwrap());
    assert_eq!((whole.width, whole.height), (17000, 40));
    let joined = Image::from_fn(17000, 40, |x, y| if x < 8500 { left.at(x, y) } else { right.at(x - 8500, y) });
    let off = whole.texels.iter().zip(&joined.texels).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert!(off <= 17000 * 40 / 1000, "{off}");
    assert!(whole.texels.iter().any(|&a| a < 200));
    let stored =
        |name: &str| png::read_text(&folder.join(name)).unwrap().into_iter().find(|(k, _)| k == "hbao").unwrap().1;
    let table: toml::Table = stored("whole.png").parse().unwrap();
    assert_eq!(table["render"]["size"].as_array().unwrap().len(), 2);
    assert!(!table["render"].as_table().unwrap().contains_key("tile"));
}

#[test]
fn what_cannot_be_rendered_in_tiles_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (arguments, said) in [
        ("-o a.exr --tile-size 64", "an EXR is written in one piece: render its parts by --tile instead"),
        ("-o a.png --tile-size 64 --show depth", "the greys of a PNG of depth depend on the whole image"),
        ("-o a.png --tile-size 64 --dump all", "--dump and --timings are of an image in one piece"),
        ("-o a.png --tile-size 64 --method ray-march", "a part of a picture cannot be rendered by ray-march"),
        ("-o a.png --tile-size 63", "--tile-size: '63' is not a whole number from 64 to 65536"),
        ("-o a.png --tile-size 64 --tile 0/2,0/2", "cannot be used with"),
        ("-o a.png --size 17000x16000 --radius 1e6", "give a smaller --radius or a smaller --size"),
        ("-o a.png --size 300000x10", "an image may have up to 262144x262144 pixels"),
    ] {
        let output = cached(folder, &format!("render nave --size 96x64 {arguments}"));
        let [_, stderr] = texts(&output);
        assert!(matches!(output.status.code(), Some(1 | 2)) && stderr.contains(said), "{arguments}: {stderr}");
        assert!(names(folder).is_empty(), "{arguments}: {:?}", names(folder));
    }
}
