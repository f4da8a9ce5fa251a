//! `hbao image` gives a picture that another program rendered the ambient occlusion that `hbao render` gives the scene,
//! whatever the conventions of its depth and normals, and says what looks wrong in them.

use crate::rig::command::{cached, names, notices, texts};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, Vec2, WritableImage, f16,
};
use ::png::{BitDepth, ColorType, Encoder};
use glam::{DMat3, DVec3};
use hbao::image::{Image, exr, png};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SIZE: (usize, usize) = (97, 61);

/// The camera, R, and near plane of the Cornell box in these tests.
const CORNELL: &str = "--fov-y 40 --radius 150";

/// What `hbao render` makes of a scene in float, with one sample per pixel.
struct Dump {
    folder: TempDir,
    depth: Image<f32>,
    normals: Image<[f32; 3]>,
    ao: Image<f32>,
}

/// Renders a scene and dumps its images into the folder `d`.
fn dump(scene: &str, more: &str) -> Dump {
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = SIZE;
    let formats = "--msaa 1 --normal-format rgba16f --ao-format r32f --quiet";
    let output = cached(
        folder.path(),
        &format!("render {scene} -o final.png --dump d --size {width}x{height} {formats} {more}"),
    );
    assert_eq!(output.status.code(), Some(0), "{more}: {}", texts(&output)[1]);
    let at = |name: &str| folder.path().join("d").join(name);
    let (depth, normals) = (exr::read(&at("depth.exr")).unwrap(), exr::read(&at("normals.exr")).unwrap());
    let ao = exr::read(&at("ao.exr")).unwrap();
    Dump { folder, depth, normals, ao }
}

impl Dump {
    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the command, which must succeed. Returns its notices, and visibility.
    fn image(&self, arguments: &str) -> (Vec<String>, Image<f32>) {
        let output = cached(self.folder.path(), &format!("image -o out.exr --ao-format r32f {arguments}"));
        let [_, stderr] = texts(&output);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
        let told = notices(&stderr).into_iter().map(|line| line.trim_start_matches("hbao: ").to_string()).collect();
        (told, exr::read(&self.path("out.exr")).unwrap())
    }

    /// Runs the command, which must tell nothing, and returns visibility.
    fn silent(&self, arguments: &str) -> Image<f32> {
        let (told, image) = self.image(arguments);
        assert!(told.is_empty(), "{arguments}: {told:?}");
        image
    }

    fn write_depth(&self, name: &str, channel: &str, texels: &Image<f32>) {
        write_parts(&self.path(name), None, vec![layer(None, texels.width, &[(channel, floats(texels))])]);
    }

    fn write_normals(&self, name: &str, texels: &Image<[f32; 3]>) {
        fs::write(self.path(name), exr::encode(texels, &[]).unwrap()).unwrap();
    }
}

/// Returns the samples of an image in the order of files.
fn floats(image: &Image<f32>) -> FlatSamples {
    let (width, height) = (image.width, image.height);
    FlatSamples::F32((0..width * height).map(|i| image.at(i % width, height - 1 - i / width)).collect())
}

fn halves(image: &Image<f32>) -> FlatSamples {
    let (width, height) = (image.width, image.height);
    let sample = |i: usize| f16::from_f32(image.at(i % width, height - 1 - i / width));
    FlatSamples::F16((0..width * height).map(sample).collect())
}

type Part = Layer<AnyChannels<FlatSamples>>;

/// A part of a file. Its channels have the order of files.
fn layer(name: Option<&str>, width: usize, channels: &[(&str, FlatSamples)]) -> Part {
    let size = (width, channels[0].1.len() / width);
    let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
    let blocks = if name.is_some() { Blocks::Tiles(Vec2(32, 16)) } else { Blocks::ScanLines };
    let encoding = Encoding { compression: Compression::ZIP16, blocks, line_order: LineOrder::Increasing };
    let attributes = name.map(LayerAttributes::named).unwrap_or_default();
    Layer::new(size, attributes, encoding, AnyChannels::sort(list))
}

/// Writes the parts of a picture. Without a display window it is the first part's.
fn write_parts(path: &Path, display: Option<IntegerBounds>, parts: Vec<Part>) {
    let display = display.unwrap_or_else(|| IntegerBounds::from_dimensions(parts[0].size));
    ExrImage::from_layers(ImageAttributes::new(display), parts).write().to_file(path).unwrap();
}

/// Returns the share of pixels at which two images differ by more than `tolerance`.
fn share_off(a: &Image<f32>, b: &Image<f32>, tolerance: f32) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let off = a.texels.iter().zip(&b.texels).filter(|(a, b)| (**a - **b).abs() > tolerance).count();
    off as f64 / a.texels.len() as f64
}

/// Asserts that visibility is that of the rendering. Conventions round depth and normals in other ways, which moves
/// visibility by far less than 1e-3, except where a sample is taken or not because of it.
#[track_caller]
fn same(got: &Image<f32>, expected: &Image<f32>, what: &str) {
    let off = share_off(got, expected, 1e-3);
    assert!(off <= 0.005, "{what}: {off} of the pixels are off");
    assert!(expected.texels.iter().any(|&a| a < 0.7), "{what}: nothing occludes");
}

mod same_as_render {
    use super::*;

    /// The file holds normals that were made unit vectors, so that float32 rounds once more than in a rendering. The
    /// greatest difference that was seen is 2.4e-7.
    #[test]
    fn the_files_of_dump_give_the_images_of_the_rendering() {
        for (scene, camera, radius) in [
            ("cornell-box", "--fov-y 40", 150.0),
            ("nave", "--fov-y 60", 3.0),
            ("nave", "--ortho 12", 1.0),
            ("nave", "--frustum=-0.2,0.9,-0.1,0.6", 3.0),
            ("nave", "--ortho-frustum=-8,3,-2,5", 1.0),
        ] {
            for more in ["", "--half-res --blur 13", "--method hbao-view", "--method ray-march --near 0.4"] {
                let flags = format!("{camera} --radius {radius} --exit shorten {more}");
                let flags = if more.contains("ray") { flags.replace("--exit shorten", "") } else { flags };
                let dumped = dump(scene, &flags);
                let files = "d/depth.exr d/normals.exr --normals-are left";
                let ao = dumped.silent(&format!("{files} {flags}"));
                assert!(share_off(&ao, &dumped.ao, 1e-5) == 0.0, "{flags}");
                let raw: Image<f32> = exr::read(&dumped.path("d/ao_raw.exr")).unwrap();
                // A flag of the blur is told to have no effect.
                let (_, got) = dumped.image(&format!("{files} {flags} --show ao-raw"));
                assert!(share_off(&got, &raw, 1e-5) == 0.0, "{flags}: raw");
                // The comparison fails where something differs.
                assert!(raw.width != ao.width || share_off(&ao, &raw, 1e-5) > 0.1, "{flags}");
            }
        }
    }

    /// In the default formats a rendering reads normals of 8 bits, whose lengths differ. Visibility is rounded to 8
    /// bits, so that a rounding may tip over.
    #[test]
    fn the_default_formats_give_the_same_to_a_step_of_8_bits() {
        let folder = tempfile::tempdir().unwrap();
        let run = |arguments: &str| {
            let output = cached(folder.path(), arguments);
            assert_eq!(output.status.code(), Some(0), "{}", texts(&output)[1]);
        };
        for method in ["hbao", "hbao-talk", "ssao", "microsphere", "crease"] {
            let flags = format!("{CORNELL} --method {method}");
            run(&format!("render -o final.png --dump d --size 97x61 --msaa 1 {flags}"));
            run(&format!("image d/depth.exr d/normals.exr --normals-are left -o out.exr {flags}"));
            let [expected, got] = ["d/ao.exr", "out.exr"].map(|name| exr::read(&folder.path().join(name)).unwrap());
            assert!(share_off(&got, &expected, 1.001 / 255.0) == 0.0, "{method}");
            assert!(share_off(&got, &expected, 1e-5) < 0.01, "{method}");
            run(&format!(
                "image d/depth.exr d/normals.exr --normals-are left -o out.png --show final --color d/color.png {flags}"
            ));
            let [expected, got]: [Image<[u8; 3]>; 2] =
                ["final.png", "out.png"].map(|name| png::read(&folder.path().join(name)).unwrap());
            let far = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1);
            assert_eq!(got.texels.iter().zip(&expected.texels).filter(far).count(), 0, "{method}: final");
        }
    }
}

/// The committed files were written by `tests/command/openexr/write.py` with the library of the OpenEXR project, from a
/// rendering of 48x36 pixels.
#[test]
fn the_files_of_another_library_give_what_render_gives() {
    let files = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/command/openexr");
    let [parts, layers, reversed] =
        ["parts", "layers", "reversed"].map(|name| files.join(name).with_extension("exr").display().to_string());
    let camera = "--fov-y 40 --radius 150 --exit shorten";
    let view = "0.782755554,-0.481954422,0.393717763,1,0.548798867,0.832888888,-0.0715255476,2,\
                -0.293451096,0.272058882,0.916444444,3,0,0,0,1";
    let dumped = dump("cornell-box", &format!("{camera} --size 48x36"));
    for arguments in [
        format!("{parts} {parts} --depth-is distance"),
        format!("{layers} {layers} --normals-are world --view-matrix {view}"),
        format!("{reversed} {parts} --depth-is hardware --near 10 --far inf --reversed"),
    ] {
        let got = dumped.silent(&format!("{arguments} {camera}"));
        same(&got, &dumped.ao, &arguments);
    }
}

mod conventions {
    use super::*;

    /// z of eye space at one pixel, in a function of z and of the length of the pixel's ray r.
    fn converted(depth: &Image<f32>, f: impl Fn(f64, f64) -> f64) -> Image<f32> {
        let tan_y = 20f64.to_radians().tan();
        let half = [tan_y * 97.0 / 61.0, tan_y];
        Image::from_fn(depth.width, depth.height, |x, y| {
            let [x_ray, y_ray] = [(x, 97.0, half[0]), (y, 61.0, half[1])]
                .map(|(at, pixels, half)| half * (2.0 * (at as f64 + 0.5) / pixels - 1.0));
            f(depth.at(x, y).into(), (x_ray * x_ray + y_ray * y_ray + 1.0).sqrt()) as f32
        })
    }

    #[test]
    fn depth_of_every_kind_gives_the_occlusion_of_z() {
        let dumped = dump("cornell-box", CORNELL);
        let (near, far) = (100.0, 4000.0);
        let inverse = move |z: f64, far: f64| (1.0 / near - 1.0 / z) / (1.0 / near - 1.0 / far);
        let none = |z: f64, other: f64, value: f64| if z == f64::INFINITY { other } else { value };
        let tan = 20f64.to_radians().tan();
        let matrix =
            |z_row: &str| format!("--projection {},0,0,0,0,{},0,0,0,0,{z_row},0,0,-1,0", 61.0 / 97.0 / tan, 1.0 / tan);
        let fov = "--fov-y 40".to_string();
        let (a, b) = (-(far + near) / (far - near), -2.0 * far * near / (far - near));
        type Stored<'a> = Box<dyn Fn(f64, f64) -> f64 + 'a>;
        let cases: [(Stored, String); 11] = [
            (Box::new(|z, _| none(z, 1e10, z)), fov.clone()),
            (Box::new(|z, _| none(z, 2e4, z)), format!("{fov} --background 20000")),
            (Box::new(|z, _| none(z, 0.0, z)), format!("{fov} --background 0")),
            (Box::new(|z, _| -z), format!("{fov} --depth-is -z")),
            (Box::new(|z, _| none(z, 1e10, -z)), format!("{fov} --depth-is=-z")),
            (Box::new(|z, ray| none(z, 1e10, z * ray)), format!("{fov} --depth-is distance")),
            (
                Box::new(|z, _| none(z, 1.0, inverse(z, far))),
                format!("{fov} --depth-is hardware --near {near} --far {far}"),
            ),
            (
                Box::new(|z, _| none(z, 0.0, near / z)),
                format!("{fov} --depth-is hardware --near {near} --far inf --reversed"),
            ),
            (
                Box::new(|z, _| none(z, 1.0, inverse(z, far))),
                format!("{} --depth-is hardware", matrix(&format!("{a},{b}"))),
            ),
            (
                Box::new(|z, _| none(z, 0.0, near / z)),
                format!("{} --depth-is hardware --clip-range 0..1", matrix(&format!("0,{near}"))),
            ),
            (Box::new(|z, _| none(z, f64::INFINITY, z)), format!("--intrinsics {0},{0},48.5,30.5", 30.5 / tan)),
        ];
        assert!(dumped.depth.texels.contains(&f32::INFINITY));
        for (i, (stored, flags)) in cases.iter().enumerate() {
            dumped.write_depth("z.exr", "Z", &converted(&dumped.depth, stored));
            let got = dumped.silent(&format!("z.exr d/normals.exr --normals-are left --radius 150 {flags}"));
            same(&got, &dumped.ao, flags);
            // Taken as z, distance is another surface.
            if i == 5 {
                let (_, wrong) = dumped.image(&format!("z.exr d/normals.exr --normals-are left --radius 150 {fov}"));
                assert!(share_off(&wrong, &dumped.ao, 1e-3) > 0.1);
            }
        }
    }

    /// In an orthographic view depth of a depth buffer is linear, and distance is z.
    #[test]
    fn depth_of_every_kind_gives_the_occlusion_of_z_in_orthographic_views() {
        let dumped = dump("nave", "--ortho 12 --radius 1 --exit shorten");
        let (near, far) = (0.0, 65.0);
        let over = |z: f32| if z == f32::INFINITY { 1.0 } else { (z - near) / (far - near) };
        let half = [6.0 * 97.0 / 61.0, 6.0];
        let matrix = format!(
            "--projection {},0,0,0,0,{},0,0,0,0,{},{},0,0,0,1",
            1.0 / half[0],
            1.0 / half[1],
            -2.0 / (far - near),
            -(far + near) / (far - near)
        );
        let planes = format!("--near {near} --far {far}");
        for (texels, flags) in [
            (dumped.depth.clone(), "--ortho 12 --depth-is distance".to_string()),
            (dumped.depth.map(over), format!("--ortho 12 --depth-is hardware {planes}")),
            (dumped.depth.map(|z| 1.0 - over(z)), format!("--ortho 12 --depth-is hardware {planes} --reversed")),
            (dumped.depth.map(over), format!("{matrix} --depth-is hardware")),
        ] {
            dumped.write_depth("z.exr", "Z", &texels);
            let got =
                dumped.silent(&format!("z.exr d/normals.exr --normals-are left --radius 1 --exit shorten {flags}"));
            same(&got, &dumped.ao, &flags);
        }
    }

    #[test]
    fn normals_of_every_kind_give_the_occlusion_of_eye_space() {
        let dumped = dump("cornell-box", CORNELL);
        let right = dumped.normals.map(|[x, y, z]| [x, y, -z]);
        let cv = dumped.normals.map(|[x, y, z]| [x, -y, z]);
        // A view matrix that turns, and moves, which normals must not notice.
        let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.8, -0.5).normalize(), 2.1);
        let world = |eye: &Image<[f32; 3]>| {
            eye.map(|n| (turn.transpose() * DVec3::from(n.map(f64::from))).as_vec3().to_array())
        };
        let row = |i: usize| format!("{},{},{},{}", turn.row(i).x, turn.row(i).y, turn.row(i).z, 10 * i);
        let view = format!("{},{},{},0,0,0,1", row(0), row(1), row(2));
        fs::write(dumped.path("view.txt"), format!("[[{}]]\n", view.replace(',', " \n "))).unwrap();
        for (texels, flags) in [
            (dumped.normals.clone(), "--normals-are left".to_string()),
            (right.clone(), String::new()),
            (cv.clone(), "--normals-are cv".to_string()),
            (right.map(|n| n.map(|c| 0.5 * c + 0.5)), "--normals-encoding biased".to_string()),
            (right.map(|n| n.map(|c| 7.0 * c)), String::new()),
            (world(&right), format!("--normals-are world --view-matrix {view}")),
            (world(&right), "--normals-are world --view-matrix view.txt --view-axes gl".to_string()),
            (world(&cv), "--normals-are world --view-matrix view.txt --view-axes cv".to_string()),
        ] {
            dumped.write_normals("n.exr", &texels);
            let got = dumped.silent(&format!("d/depth.exr n.exr {CORNELL} {flags}"));
            same(&got, &dumped.ao, &flags);
        }
        // 16 bits turn a normal by at most 2^-16 sqrt(3); 8 bits turn it by 256 times as much, which moves the sines of
        // tangents by 0.007 each.
        for (depth, tolerance) in [(BitDepth::Sixteen, 1e-3), (BitDepth::Eight, 0.02)] {
            let mut encoder = Encoder::new(fs::File::create(dumped.path("n.png")).unwrap(), 97, 61);
            encoder.set_color(ColorType::Rgb);
            encoder.set_depth(depth);
            let rows = (0..61).rev().flat_map(|y| (0..97).map(move |x| (x, y)));
            let bytes: Vec<u8> = rows
                .flat_map(|(x, y)| right.at(x, y).map(|c| 0.5 * f64::from(c) + 0.5))
                .flat_map(|c| match depth {
                    BitDepth::Sixteen => ((c * 65535.0).round() as u16).to_be_bytes().to_vec(),
                    _ => vec![(c * 255.0).round() as u8],
                })
                .collect();
            encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
            let got = dumped.silent(&format!("d/depth.exr n.png {CORNELL}"));
            assert!(share_off(&got, &dumped.ao, tolerance) <= 0.005, "{depth:?}");
        }
        let wrong = dumped.image(&format!("d/depth.exr d/normals.exr {CORNELL}")).1;
        assert!(share_off(&wrong, &dumped.ao, 0.02) > 0.1, "normals of the other hand make a difference");
    }

    #[test]
    fn the_channels_of_renderers_are_found_among_others() {
        let dumped = dump("cornell-box", CORNELL);
        let planes: Vec<Image<f32>> =
            (0..3).map(|i| dumped.normals.map(|n| n[i] * if i == 2 { -1.0 } else { 1.0 })).collect();
        let junk = dumped.depth.map(|_| 3.0);
        let (z, other) = (floats(&dumped.depth), floats(&junk));
        let normal = |names: [&'static str; 3]| names.into_iter().zip(planes.iter().map(floats)).collect::<Vec<_>>();
        let with =
            |more: &[(&'static str, FlatSamples)], normals: Vec<(&'static str, FlatSamples)>| [more, &normals].concat();
        let color = ["R", "G", "B", "A"].map(|name| (name, other.clone()));
        let flags = "--radius 150 --fov-y 40";
        let single = |channels: Vec<(&str, FlatSamples)>| vec![layer(None, 97, &channels)];
        let cases: Vec<(Vec<Part>, &str)> = vec![
            // Z beside colour and a layer of normals.
            (single(with(&[&color[..], &[("Z", z.clone())]].concat(), normal(["N.X", "N.Y", "N.Z"]))), ""),
            // Blender's layers. The Z of Normal is no depth.
            (
                single(with(
                    &[
                        ("ViewLayer.Combined.R", other.clone()),
                        ("ViewLayer.Combined.G", other.clone()),
                        ("ViewLayer.Combined.B", other.clone()),
                        ("ViewLayer.Depth.Z", z.clone()),
                    ],
                    normal(["ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z"]),
                )),
                "",
            ),
            // Any names, by flags.
            (
                single(with(&[("Z", other.clone()), ("depth", z.clone())], normal(["a", "b", "c"]))),
                "--depth-channel depth --normals-channels a,b,c",
            ),
            (
                single(with(
                    &[("Z", other.clone()), ("left.Z", z.clone())],
                    [normal(["left.X", "left.Y", "v"]), normal(["q.R", "q.G", "q.B"])].concat(),
                )),
                "--depth-channel left.Z --normals-channels q",
            ),
            // Parts in tiles. The channel of the first is named as that of the second.
            (
                vec![
                    layer(Some("beauty"), 97, &color),
                    layer(Some("depth"), 97, &[("Z", z.clone())]),
                    layer(Some("normal"), 97, &normal(["x", "y", "z"])),
                ],
                "",
            ),
        ];
        for (i, (parts, more)) in cases.into_iter().enumerate() {
            write_parts(&dumped.path("many.exr"), None, parts);
            let got = dumped.silent(&format!("many.exr many.exr {flags} {more}"));
            same(&got, &dumped.ao, &format!("case {i}"));
        }
        let (_, wrong) = dumped.image(&format!("many.exr many.exr {flags} --depth-channel beauty.R"));
        assert!(share_off(&wrong, &dumped.ao, 1e-3) > 0.1, "the wrong channel makes a difference");
    }

    #[test]
    fn half_floats_and_whole_numbers_are_depth_too() {
        let dumped = dump("cornell-box", CORNELL);
        let none = |z: f32| if z == f32::INFINITY { 65504.0 } else { z };
        let write = |samples| write_parts(&dumped.path("z.exr"), None, vec![layer(None, 97, &[("V", samples)])]);
        let files = "z.exr d/normals.exr --normals-are left";
        write(halves(&dumped.depth.map(none)));
        let got = dumped.silent(&format!("{files} {CORNELL} --background 65504"));
        // Half floats are 0.5 apart at these depths, a twentieth of the width of a pixel.
        assert!(share_off(&got, &dumped.ao, 0.03) <= 0.005, "{}", share_off(&got, &dumped.ao, 0.03));
        let FlatSamples::F32(texels) = floats(&dumped.depth.map(|z| none(z) * 1000.0)) else { unreachable!() };
        write(FlatSamples::U32(texels.iter().map(|&z| z as u32).collect()));
        let got = dumped.silent(&format!("{files} --fov-y 40 --radius 150000 --background 65000000"));
        same(&got, &dumped.ao, "whole numbers");
        // Normals are not rebuilt well from half floats, which is told.
        write(halves(&dumped.depth.map(none)));
        let (told, _) = dumped.image(&format!("z.exr {CORNELL} --background 65504"));
        assert!(told.len() == 1 && told[0].contains("half floats"), "{told:?}");
    }

    #[test]
    fn nothing_is_where_a_part_has_no_data() {
        let dumped = dump("cornell-box", CORNELL);
        let ((left, low), (width, height)) = ((30, 20), (40, 25));
        let cut = dumped.depth.part((left, low), (width, height));
        let display = IntegerBounds::new((-7, 12), SIZE);
        let mut part = layer(None, width, &[("Z", floats(&cut))]);
        let top = SIZE.1 - low - height;
        part.attributes.layer_position = Vec2(left as i32 - 7, top as i32 + 12);
        write_parts(&dumped.path("cut.exr"), Some(display), vec![part]);
        let inside = |x: usize, y: usize| (left..left + width).contains(&x) && (low..low + height).contains(&y);
        let full = Image::from_fn(SIZE.0, SIZE.1, |x, y| if inside(x, y) { dumped.depth.at(x, y) } else { 1e10 });
        dumped.write_depth("full.exr", "Z", &full);
        let [cut, full] = ["cut", "full"]
            .map(|name| dumped.silent(&format!("{name}.exr d/normals.exr --normals-are left {CORNELL}")));
        assert!(cut == full && share_off(&cut, &dumped.ao, 1e-3) > 0.1);
    }
}

mod notices_of_what_is_hardly_meant {
    use super::*;

    /// Runs the command, which must tell exactly one thing that contains `part`.
    fn tells(dumped: &Dump, arguments: &str, part: &str) {
        let (told, _) = dumped.image(arguments);
        assert!(told.len() == 1 && told[0].contains(part), "{arguments}: no {part:?} alone in {told:?}");
    }

    #[test]
    fn inputs_that_do_not_fit_are_told_with_the_flag_that_makes_them_fit() {
        let dumped = dump("cornell-box", CORNELL);
        let left = "d/depth.exr d/normals.exr --normals-are left";
        tells(&dumped, &format!("d/depth.exr d/normals.exr {CORNELL}"), "give --normals-are left");
        tells(&dumped, &format!("{left} {CORNELL} --normals-encoding biased"), "give --normals-encoding signed");
        dumped.write_normals("n.exr", &dumped.normals.map(|[x, y, z]| [x, -y, z]));
        tells(&dumped, &format!("d/depth.exr n.exr --normals-are left {CORNELL}"), "the y of NORMALS");
        dumped.write_normals("n.exr", &dumped.normals.map(|[x, y, z]| [-x, -y, -z]));
        tells(&dumped, &format!("d/depth.exr n.exr --normals-are left {CORNELL}"), "face away from the eye");
        dumped.write_normals("n.exr", &dumped.normals.map(|[x, y, z]| [z, x, y]));
        tells(&dumped, &format!("d/depth.exr n.exr --normals-are left {CORNELL}"), "turned by 120 degrees");
        dumped.write_normals("n.exr", &dumped.normals.map(|_| [0.0; 3]));
        tells(&dumped, &format!("d/depth.exr n.exr {CORNELL}"), "NORMALS are 0 at");
        // A quarter turn about each of two axes, whose transpose is another turn.
        let turned = dumped.normals.map(|[x, y, z]| [-z, x, y]);
        dumped.write_normals("n.exr", &turned);
        let world = format!("d/depth.exr n.exr --normals-are world {CORNELL} --view-matrix");
        assert!(dumped.image(&format!("{world} 0,1,0,0,0,0,1,0,1,0,0,0,0,0,0,1")).0.is_empty());
        tells(&dumped, &format!("{world} 0,0,1,0,1,0,0,0,0,1,0,0,0,0,0,1"), "--view-matrix row by row");

        let reversed = dumped.depth.map(|z| if z == f32::INFINITY { 0.0 } else { 1.0 / z });
        dumped.write_depth("z.exr", "Z", &reversed);
        let hardware = format!("z.exr d/normals.exr --normals-are left {CORNELL} --depth-is hardware --near 1");
        tells(&dumped, &format!("{hardware} --far 1e6"), "give --reversed");
        let standard = reversed.map(|d| 1.0 - d);
        dumped.write_depth("z.exr", "Z", &standard);
        tells(&dumped, &format!("{hardware} --far inf --reversed"), "leave out --reversed");
        tells(&dumped, "z.exr --fov-y 40 --method ssao", "like the values of a depth buffer");
    }

    #[test]
    fn results_of_1_are_told_with_their_reason() {
        let dumped = dump("cornell-box", CORNELL);
        let left = "d/depth.exr d/normals.exr --normals-are left --fov-y 40";
        tells(&dumped, &format!("{left} --radius 0.1"), "give a larger --radius");
        tells(&dumped, &format!("{left} --radius 1e5"), "give a smaller --radius");
        let nothing = format!("{left} --radius 150 --background 1");
        tells(&dumped, &nothing, "no pixel of DEPTH holds a surface");
        assert!(dumped.image(&nothing).1.texels.iter().all(|&a| a == 1.0));
        tells(&dumped, &format!("d/depth.exr {CORNELL}"), "rebuilt from depth");
    }

    #[test]
    fn pixels_that_are_not_square_are_told_where_the_camera_takes_them_as_square() {
        let dumped = dump("cornell-box", CORNELL);
        let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(SIZE));
        attributes.pixel_aspect = 2.0;
        let parts = vec![layer(None, 97, &[("Z", floats(&dumped.depth))])];
        ExrImage::from_layers(attributes, parts).write().to_file(dumped.path("wide.exr")).unwrap();
        let files = "wide.exr d/normals.exr --normals-are left --radius 150";
        tells(&dumped, &format!("{files} --fov-y 40"), "its pixels are 2 times as wide as high");
        let tan = 20f64.to_radians().tan();
        let (right, top) = (tan * 97.0 / 61.0, tan);
        dumped.silent(&format!("{files} --frustum={},{right},{},{top}", -right, -top));
    }

    #[test]
    fn flags_without_effect_are_told() {
        let dumped = dump("cornell-box", CORNELL);
        let left = format!("d/depth.exr d/normals.exr --normals-are left {CORNELL}");
        for (flags, flag) in [
            ("--msaa 4", "--msaa"),
            ("--edges off", "--edges"),
            ("--normals vertex", "--normals"),
            ("--depth-format r16f", "--depth-format"),
            ("--normal-format rgba16f", "--normal-format"),
            ("--rays 3", "--rays"),
            ("--show ao-raw --blur 21", "--blur"),
            ("--near 3", "--near"),
            ("--far 3", "--far"),
            ("--reversed", "--reversed"),
            ("--clip-range 0..1", "--clip-range"),
            ("--view-axes cv", "--view-axes"),
            ("--color d/color.png", "--color"),
        ] {
            tells(&dumped, &format!("{left} {flags}"), &format!("{flag} has no effect"));
        }
        let normals = "d/depth.exr d/normals.exr --normals-are left --fov-y 40 --method";
        tells(&dumped, &format!("{normals} ssao"), "NORMALS have no effect with --method ssao");
        dumped.silent(&format!("{normals} ssao --ssao-normals on"));
        let (told, _) = dumped.image(&format!("d/depth.exr {CORNELL} --normals-encoding signed"));
        assert!(told.iter().any(|line| line == "--normals-encoding has no effect without NORMALS"), "{told:?}");
    }

    /// A picture larger than what is looked at is judged by its middle.
    #[test]
    fn large_pictures_are_judged_by_their_middle() {
        let folder = tempfile::tempdir().unwrap();
        let (width, height) = (2200, 24);
        // A wall to the left and one to the right, which meet at z = 2 in the middle.
        let depth = Image::from_fn(width, height, |x, _| {
            let slope = (2.0 * (x as f32 + 0.5) / width as f32 - 1.0) * 1.5;
            2.0 / (1.0 + slope.abs())
        });
        let normals = Image::from_fn(width, height, |x, _| {
            let side = if x < width / 2 { 1.0 } else { -1.0 };
            [side / 2f32.sqrt(), 0.0, -1.0 / 2f32.sqrt()]
        });
        for (name, bytes) in [("z.exr", exr::encode(&depth, &[])), ("n.exr", exr::encode(&normals, &[]))] {
            fs::write(folder.path().join(name), bytes.unwrap()).unwrap();
        }
        let tall = 1.5 * height as f64 / width as f64;
        let flags = format!("--frustum=-1.5,1.5,{},{} --radius 0.3 --exit shorten", -tall, tall);
        for (space, part) in [("left", None), ("right", Some("give --normals-are left"))] {
            let output = cached(folder.path(), &format!("image z.exr n.exr -o a.png --normals-are {space} {flags}"));
            let [_, stderr] = texts(&output);
            let told = notices(&stderr);
            assert_eq!(output.status.code(), Some(0), "{stderr}");
            assert_eq!(told.len(), usize::from(part.is_some()), "{stderr}");
            assert!(part.is_none_or(|part| told[0].contains(part)), "{stderr}");
        }
    }
}

mod outputs {
    use super::*;

    #[test]
    fn what_is_written_holds_its_settings_and_the_names_of_its_files() {
        let dumped = dump("cornell-box", CORNELL);
        fs::create_dir(dumped.path("in")).unwrap();
        fs::rename(dumped.path("d/depth.exr"), dumped.path("in/z.exr")).unwrap();
        let base = "in/z.exr d/normals.exr --normals-are left";
        let first = dumped.silent(&format!("{base} {CORNELL} --directions 5"));
        let text = |name: &str| exr::read_text(&dumped.path(name)).unwrap();
        let stored = text("out.exr").into_iter().find(|(keyword, _)| keyword == "hbao").unwrap().1;
        for line in
            ["radius = 150.0", "directions = 5", "image = \"z.exr\"", "normals = \"normals.exr\"", "fov-y = 40.0"]
        {
            assert!(stored.lines().any(|one| one == line), "{line} is not in {stored}");
        }
        fs::rename(dumped.path("out.exr"), dumped.path("first.exr")).unwrap();
        // The settings of a picture give it again.
        assert!(dumped.silent(&format!("{base} --fov-y 40 --settings first.exr")) == first);
        dumped.silent(&format!("{base} {CORNELL} --no-metadata"));
        assert!(text("out.exr").iter().all(|(keyword, _)| keyword != "hbao"));
    }

    #[test]
    fn colours_of_every_kind_are_darkened_and_a_png_may_go_to_standard_output() {
        let dumped = dump("cornell-box", CORNELL);
        let planes = [0.5, 1.5, 0.25].map(|c| floats(&dumped.depth.map(|_| c)));
        let channels: Vec<_> = ["a.R", "a.G", "a.B"].into_iter().zip(planes).collect();
        write_parts(&dumped.path("c.exr"), None, vec![layer(None, 97, &channels)]);
        let base = format!("image d/depth.exr d/normals.exr --normals-are left {CORNELL} --ao-format r32f");
        for more in ["", "--half-res --blur 0"] {
            let run = |arguments: &str| {
                let output = cached(dumped.folder.path(), &format!("{base} {more} {arguments}"));
                assert_eq!(output.status.code(), Some(0), "{arguments}: {}", texts(&output)[1]);
                output
            };
            run("-o ao.exr");
            let ao: Image<f32> = exr::read(&dumped.path("ao.exr")).unwrap();
            let scale = if more.is_empty() { 1 } else { 2 };
            run("-o c_final.exr --show final --color c.exr --timings t.json");
            let got: Image<[f32; 3]> = exr::read(&dumped.path("c_final.exr")).unwrap();
            let expected = Image::from_fn(97, 61, |x, y| {
                let a = ao.at(x / scale, y / scale);
                [0.5 * a, 1.5 * a, 0.25 * a]
            });
            assert_eq!(got, expected, "{more}");
            let times: serde_json::Value = serde_json::from_slice(&fs::read(dumped.path("t.json")).unwrap()).unwrap();
            let passes: Vec<&str> =
                times["passes"].as_array().unwrap().iter().map(|pass| pass["name"].as_str().unwrap()).collect();
            assert!(passes.contains(&"ao") && passes.contains(&"blur_x") == more.is_empty(), "{passes:?}");
            assert_eq!(times["size"], serde_json::json!([97, 61]));
            let output = run("-o - --show final --color c.exr");
            fs::write(dumped.path("out.png"), &output.stdout).unwrap();
            let png: Image<[u8; 3]> = png::read(&dumped.path("out.png")).unwrap();
            // 1.5 is brighter than a PNG can hold.
            let byte = |c: f32| (255.0 * c.min(1.0)).round() as u8;
            assert_eq!(png, expected.map(|c| c.map(byte)), "{more}");
        }
        // A grey picture is three times the same.
        fs::write(dumped.path("grey.png"), png::encode(&Image::filled(97, 61, 255u8), &[]).unwrap()).unwrap();
        let output = cached(dumped.folder.path(), &format!("{base} -o out.exr --show final --color grey.png"));
        assert_eq!(output.status.code(), Some(0), "{}", texts(&output)[1]);
        let got: Image<[f32; 3]> = exr::read(&dumped.path("out.exr")).unwrap();
        assert_eq!(got, dumped.silent(&base["image ".len()..]).map(|a| [a; 3]));
    }
}

mod refusals {
    use super::*;

    /// Runs each command line, which must fail with this exit code, in one line that contains `part`, and leave no
    /// file.
    fn refuses(folder: &Path, cases: &[(i32, &str, &str)]) {
        let before = names(folder);
        for (code, arguments, part) in cases {
            let output = cached(folder, &format!("image -o out.png {arguments}"));
            let [_, stderr] = texts(&output);
            assert_eq!(output.status.code(), Some(*code), "{arguments}: {stderr}");
            let lines = notices(&stderr);
            assert!(lines.len() == 1 && lines[0].starts_with("hbao: "), "{arguments}: {stderr}");
            assert!(lines[0].contains(part), "{arguments}: no {part:?} in: {stderr}");
            assert_eq!(names(folder), before, "{arguments}: a file was left behind");
        }
    }

    #[test]
    fn a_camera_and_a_radius_that_needs_no_scene_are_asked_for() {
        let dumped = dump("cornell-box", CORNELL);
        let orthographic = dump("nave", "--ortho 12 --radius 1");
        let metadata = "give one of --fov-y, --ortho, --frustum, --ortho-frustum, --intrinsics, --projection; \
                        hbao rendered this file with --fov-y 40.0";
        refuses(
            dumped.folder.path(),
            &[
                (2, "", "DEPTH"),
                (2, "d/depth.exr --radius 1", metadata),
                (2, "d/depth.exr --fov-y 40 --radius 7%", "such as 7%view"),
                (2, "d/depth.exr --fov-y 40 -o d/../d/depth.exr", "would replace a picture that is read"),
                (2, "d/depth.exr d/normals.exr --fov-y 40 -o d/normals.exr", "would replace a picture that is read"),
                (2, "d/depth.exr --fov-y 40 --ortho 3 --radius 1", "cannot be used with"),
                (2, "d/depth.exr --fov-y 40 --intrinsics 1,1,1,1 --radius 1", "cannot be used with"),
                (2, "d/depth.exr --fov-y 180 --radius 1", "must be from 1 to 175 degrees"),
                (2, "d/depth.exr --intrinsics 1,1,1 --radius 1", "four numbers separated by commas"),
                (2, "d/depth.exr --intrinsics=-1,1,1,1 --radius 1", "the focal lengths must be above 0"),
                (2, "d/depth.exr --projection 1,2,3 --radius 1", "3 numbers are given, and a matrix has 16"),
                (2, "d/depth.exr --projection none.txt --radius 1", "'none.txt' is neither 16 numbers"),
                (2, "d/depth.exr --projection d/color.png --radius 1", "'d/color.png' is neither 16 numbers"),
                (
                    2,
                    "d/depth.exr --projection 1,0,0,0,0,1,0,0,0,0,1,-1,0,0,1,0 d/color.png --radius 1 --depth-is hardware --near 3",
                    "needs the planes of the camera, --near and --far, or neither with --projection",
                ),
                (
                    2,
                    "d/depth.exr --projection 1,0,0,0,0,1,0,0,0,0,-1,-1,0,0,0,0 --radius 1",
                    "--projection: the projection matrix",
                ),
                (
                    2,
                    "d/depth.exr --fov-y 40 --radius 1 --depth-is hardware",
                    "needs the planes of the camera, --near and --far",
                ),
                (2, "d/depth.exr --fov-y 40 --radius 1 --depth-is depth", "not one of z, -z, distance, hardware"),
                (
                    2,
                    "d/depth.exr --fov-y 40 --radius 1 --background nan",
                    "--background must be a number of at least 0",
                ),
                (2, "d/depth.exr --fov-y 40 --radius 1 --method ray-march", "give its z as --near"),
                (2, "d/depth.exr --fov-y 40 --radius 1 --show color", "not one of ao, ao-raw, final"),
                (2, "d/depth.exr --fov-y 40 --radius 1 --show final", "give --color PICTURE"),
                (2, "d/depth.exr d/normals.exr --fov-y 40 --radius 1 --normals-are world", "needs --view-matrix"),
                (
                    2,
                    "d/depth.exr d/normals.exr --fov-y 40 --radius 1 --normals-are world --view-matrix 1,0,0,0,0,1,0,0,0,0,1,0,5,5,5,1",
                    "its last row must be 0,0,0,1",
                ),
                (
                    2,
                    "d/depth.exr d/normals.exr --fov-y 40 --radius 1 --normals-are world --view-matrix 1,0,0,0,0,2,0,0,0,0,1,0,0,0,0,1",
                    "the view matrix is no rotation",
                ),
                (
                    2,
                    "d/depth.exr d/normals.exr d/normals.exr --fov-y 40 --radius 1",
                    "unexpected argument 'd/normals.exr'",
                ),
            ],
        );
        let metadata = "hbao rendered this file with --ortho 12.0";
        refuses(orthographic.folder.path(), &[(2, "d/depth.exr --radius 1", metadata)]);
    }

    #[test]
    fn depths_that_cannot_be_meant_are_refused_with_their_place() {
        let dumped = dump("cornell-box", CORNELL);
        let with = |name: &str, z: f32| {
            let mut depth = dumped.depth.clone();
            depth.texels[58 * 97 + 11] = z;
            dumped.write_depth(name, "Z", &depth);
        };
        with("nan.exr", f32::NAN);
        with("zero.exr", 0.0);
        with("minus.exr", -3.5);
        dumped.write_depth("negative.exr", "Z", &dumped.depth.map(|z| -z));
        dumped.write_depth("all_negative.exr", "Z", &dumped.depth.map(|z| if z < 1e9 { -z } else { z }));
        let mut normals = dumped.normals.clone();
        let middle = 30 * 97 + 48;
        normals.texels[middle] = [0.0, f32::NAN, 0.0];
        dumped.write_normals("nan_normal.exr", &normals);
        let place = "at pixel 11,2, counted from 0,0 at the upper left";
        let hardware = format!("d/depth.exr {CORNELL} --depth-is hardware --near 1 --far 9");
        refuses(
            dumped.folder.path(),
            &[
                (1, &format!("nan.exr {CORNELL}"), &format!("nan.exr: depth is NaN {place}")),
                (1, &format!("zero.exr {CORNELL}"), &format!("zero.exr: depth is 0 {place}: give --background 0 if")),
                (1, &format!("minus.exr {CORNELL}"), &format!("minus.exr: depth is -3.5 {place}, and must be above 0")),
                (1, &format!("negative.exr {CORNELL}"), "every depth is negative, such as -"),
                (1, &format!("all_negative.exr {CORNELL}"), "give --depth-is -z"),
                (1, &format!("d/depth.exr {CORNELL} --depth-is -z"), "give --depth-is z"),
                (1, &hardware, "and a depth buffer has values from 0 to 1: leave out --depth-is hardware"),
                (
                    1,
                    &format!("d/depth.exr nan_normal.exr {CORNELL}"),
                    "the normal is NaN or infinite at pixel 48,30, counted from 0,0 at the upper left, where a surface is",
                ),
            ],
        );
    }

    #[test]
    fn files_that_hold_no_depth_or_normals_are_refused_with_what_they_hold() {
        let dumped = dump("cornell-box", CORNELL);
        let path = |name: &str| dumped.path(name);
        let plane = || floats(&dumped.depth);
        let write = |name: &str, channels: &[&str]| {
            let channels: Vec<_> = channels.iter().map(|channel| (*channel, plane())).collect();
            write_parts(&path(name), None, vec![layer(None, 97, &channels)]);
        };
        write("two.exr", &["a.Z", "b.Z", "c"]);
        write("rgb.exr", &["R", "G", "B"]);
        write("vector.exr", &["X", "Y", "Z"]);
        write("many.exr", &["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"]);
        fs::write(path("text.exr"), "not a picture").unwrap();
        fs::write(path("empty.exr"), "").unwrap();
        let whole = fs::read(path("d/depth.exr")).unwrap();
        fs::write(path("cut.exr"), &whole[..whole.len() / 2]).unwrap();
        fs::write(path("header.exr"), &whole[..200]).unwrap();
        fs::write(path("small.exr"), exr::encode(&Image::filled(96, 61, [0f32, 0.0, -1.0]), &[]).unwrap()).unwrap();
        fs::write(path("grey.png"), png::encode(&Image::filled(97, 61, 3u8), &[]).unwrap()).unwrap();
        let twins = || layer(Some("a"), 97, &[("a.Z", plane())]);
        write_parts(&path("twins.exr"), None, vec![twins(), layer(Some("b"), 97, &[("Z", plane())])]);
        refuses(
            dumped.folder.path(),
            &[
                (
                    1,
                    &format!("two.exr {CORNELL}"),
                    "several of its channels are called Z: give --depth-channel NAME, of the \
                                                    channels a.Z, b.Z, c",
                ),
                (1, &format!("twins.exr {CORNELL}"), "of the channels a.Z, b.Z"),
                (1, &format!("rgb.exr {CORNELL}"), "none of its channels is called Z or Y, and there are several"),
                (1, &format!("vector.exr {CORNELL}"), "give --depth-channel NAME, of the channels X, Y, Z"),
                (1, &format!("two.exr {CORNELL} --depth-channel Z"), "two.exr: it has no channel Z: give"),
                (1, &format!("d/depth.exr d/depth.exr {CORNELL}"), "it has no three channels R, G, B or X, Y, Z"),
                (
                    1,
                    &format!("d/depth.exr many.exr {CORNELL}"),
                    "several of its layers have three channels: give \
                                                                 --normals-channels LAYER, of the channels a.B, a.G",
                ),
                (1, &format!("d/depth.exr many.exr {CORNELL} --normals-channels d"), "it has no three channels d"),
                (1, &format!("d/depth.exr grey.png {CORNELL}"), "grey.png: it has no three channels"),
                (1, &format!("d/color.png {CORNELL}"), "d/color.png: it is a PNG, which holds no depth"),
                (1, &format!("text.exr {CORNELL}"), "text.exr: it is neither a PNG nor an EXR file"),
                (1, &format!("empty.exr {CORNELL}"), "empty.exr: it is neither a PNG nor an EXR file"),
                (1, &format!("cut.exr {CORNELL}"), "cut.exr: the file is damaged or cut off"),
                (1, &format!("header.exr {CORNELL}"), "header.exr: "),
                (1, &format!("none.exr {CORNELL}"), "none.exr: no such file"),
                (1, &format!("/dev/zero {CORNELL}"), "/dev/zero: it is neither a PNG nor an EXR file"),
                (1, &format!(". {CORNELL}"), ".: this is a folder, and not a picture"),
                (1, &format!("d/depth.exr small.exr {CORNELL}"), "small.exr: it has 96x61 pixels, and depth has 97x61"),
                (1, &format!("d/depth.exr {CORNELL} --show final --color small.exr"), "small.exr: it has 96x61 pixels"),
                (1, &format!("d/depth.exr {CORNELL} --show final --color text.exr"), "text.exr: it is neither"),
                (
                    2,
                    &format!("d/depth.exr d/color.png {CORNELL} --normals-encoding signed"),
                    "a PNG holds no negative numbers",
                ),
            ],
        );
    }

    /// Each of these files is a picture that is damaged at one place, or cut off. The command must end in order.
    #[test]
    fn damaged_files_end_in_one_line_or_in_a_picture() {
        let dumped = dump("cornell-box", CORNELL);
        let whole = fs::read(dumped.path("d/depth.exr")).unwrap();
        let mut refused = 0;
        for i in 0..40 {
            let place = i * whole.len() / 40;
            let mut bytes = whole.clone();
            if i % 2 == 0 {
                bytes.truncate(place)
            } else {
                bytes[place] ^= 0xff
            }
            fs::write(dumped.path("damaged.exr"), &bytes).unwrap();
            let output = cached(dumped.folder.path(), &format!("image damaged.exr -o damaged.png {CORNELL} --quiet"));
            let [stdout, stderr] = texts(&output);
            let code = output.status.code().unwrap();
            assert!(code <= 1 && stdout.is_empty() && stderr.lines().count() == code as usize, "{i}: {stderr}");
            assert_eq!(dumped.path("damaged.png").exists(), code == 0, "{i}");
            let _ = fs::remove_file(dumped.path("damaged.png"));
            refused += code;
        }
        assert!(refused >= 20, "{refused}");
    }
}
