//! Inputs as engines have them give the ambient occlusion of linear depth and eye-space normals.

mod diagnosed;
mod given_normals;
mod refused;

use crate::rig;
use crate::rig::by_hand::{self, ByHand, Textures, read_red};
use crate::rig::process::in_own_process;
use crate::rig::stored::{Depths, Stored, matrix, upload};
use crate::rig::{SIZE, Shot, everywhere, hold, scenes};
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::scene::Projection;
use hbao::settings::{AoFormat, Method, Radius};
use hbao::{
    AmbientOcclusion, BACKGROUND_R32F, ClipRange, DepthEncoding, DepthSamples, Inputs, NormalEncoding, Settings,
    TextureRef, TextureTarget, Timers, Viewport, reference, rotation_tile,
};
use std::ffi::OsStr;
use std::sync::Arc;

/// The depth and normals of a scene, as the pipeline draws them.
fn seen(gl: &Arc<glow::Context>, shot: &Shot, size: (u32, u32)) -> ByHand {
    let frame = rig::render(gl, shot, size, &settings(shot.radius));
    ByHand { depth: frame.depth, normals: frame.normals, projection: frame.projection }
}

fn settings(radius: f64) -> Settings {
    Settings { blur: 0, ..rig::float_settings(radius) }
}

/// The planes of an engine's camera: well before and behind all surfaces.
fn planes(view: &ByHand) -> [f64; 2] {
    let finite = || view.depth.texels.iter().copied().filter(|z| z.is_finite()).map(f64::from);
    [finite().fold(f64::INFINITY, f64::min) / 20.0, finite().fold(0.0, f64::max) * 10.0]
}

/// Every convention of a depth buffer, for a view with these planes.
fn conventions(projection: Projection, [near, far]: [f64; 2]) -> Vec<(&'static str, DepthEncoding)> {
    let of_matrix = |far, reversed, range, z_axis| DepthEncoding::Matrix {
        projection: matrix(projection, [near, far], reversed, range, z_axis),
        range,
    };
    let mut all = vec![
        ("standard", DepthEncoding::standard(near, far)),
        ("reversed", DepthEncoding::reversed(near, far)),
        ("matrix, [-1, 1], right-handed", of_matrix(far, false, ClipRange::MinusOneToOne, -1.0)),
        ("matrix, [-1, 1], reversed", of_matrix(far, true, ClipRange::MinusOneToOne, -1.0)),
        ("matrix, [0, 1], left-handed", of_matrix(far, false, ClipRange::ZeroToOne, 1.0)),
        ("matrix, [0, 1], reversed", of_matrix(far, true, ClipRange::ZeroToOne, -1.0)),
        ("logarithmic", DepthEncoding::Logarithmic { c: 1.0, far }),
        ("logarithmic, C small", DepthEncoding::Logarithmic { c: 0.001 / near, far }),
    ];
    if projection.is_perspective() {
        let infinite = f64::INFINITY;
        all.extend([
            ("standard, infinite", DepthEncoding::standard(near, infinite)),
            ("reversed, infinite", DepthEncoding::reversed(near, infinite)),
            ("matrix, [0, 1], reversed, infinite", of_matrix(infinite, true, ClipRange::ZeroToOne, -1.0)),
            ("matrix, [-1, 1], infinite", of_matrix(infinite, false, ClipRange::MinusOneToOne, 1.0)),
        ]);
    }
    all
}

/// Computes ambient occlusion with these inputs.
fn occlusion(gl: &Arc<glow::Context>, size: (u32, u32), settings: &Settings, inputs: &Inputs) -> Image<f32> {
    let mut ao = AmbientOcclusion::new(gl.clone(), size, settings).unwrap();
    let visibility = ao.render(inputs).unwrap();
    let texels = read_red(gl, visibility, (size.0 * size.1) as usize);
    Image { width: size.0 as usize, height: size.1 as usize, texels }
}

/// Reads the four channels of a rectangle texture.
fn read_rgba(gl: &glow::Context, image: TextureRef, texels: usize) -> Vec<[f64; 3]> {
    assert_eq!(image.target, TextureTarget::Rectangle);
    let mut bytes = vec![0; 16 * texels];
    // SAFETY: the context is current, and the vector holds four floats for each texel.
    unsafe {
        gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(image.texture));
        let into = glow::PixelPackData::Slice(Some(&mut bytes[..]));
        gl.get_tex_image(glow::TEXTURE_RECTANGLE, 0, glow::RGBA, glow::FLOAT, into);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
    let float = |b: &[u8]| f64::from(f32::from_ne_bytes([b[0], b[1], b[2], b[3]]));
    bytes.chunks_exact(16).map(|b| [float(&b[..4]), float(&b[4..8]), float(&b[8..12])]).collect()
}

/// Compares hardware depth with linear depth of the same stored values. The two differ by the rounding of float32
/// alone. First, the linear depth that the pass makes is within 4e-6 of its twin: the pass takes at most five
/// operations, each within 2^-24, and the exponential of logarithmic depth is within 2^-24 (3 + 2 ln(C far + 1)).
/// Second, ambient occlusion is that of the linear form within section 6's tolerance of 1e-3 where it is not ambiguous,
/// that is, where a shift by 1e-5 does not change it by as much.
fn hold_stored(context: &Context, view: &ByHand, radius: f64, formats: &[Depths], targets: &[TextureTarget]) {
    let gl = context.gl();
    let settings = settings(radius);
    let textures = Textures::new(gl, view, TextureTarget::Rectangle, NormalEncoding::Signed);
    for (name, encoding) in conventions(view.projection, planes(view)) {
        for &format in formats {
            for &target in targets {
                let text = format!("{name}, {format:?}, {target:?}, {:?}\n{encoding:?}", view.projection);
                let stored = Stored::new(gl, view, encoding, format, target);
                let inputs = Inputs { depth: stored.image, depth_encoding: encoding, ..textures.inputs };
                let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings).unwrap();
                let visibility = ao.render(&inputs).unwrap();
                let texels = view.depth.texels.len();
                let got = view.depth.map(|_| 0.0);
                let got = Image { texels: read_red(gl, visibility, texels), ..got };
                let made = read_red(gl, ao.linear_depth().unwrap(), texels);
                for (&made, &expected) in made.iter().zip(&stored.linear.depth.texels) {
                    if expected.is_infinite() {
                        assert_eq!(made, BACKGROUND_R32F, "{text}");
                    } else {
                        let off = f64::from(made) / f64::from(expected) - 1.0;
                        assert!(off.abs() < 4e-6, "{made} in place of {expected}, off by {off:e}\n{text}");
                    }
                }
                let expected = stored.linear.by_shader(gl, &settings);
                let tile = rotation_tile(&settings);
                let inputs = stored.linear.twin_inputs(&tile);
                let ambiguous = reference::ambiguous(&inputs, &settings).unwrap();
                let clear = Image::from_fn(got.width, got.height, |x, y| {
                    stored.linear.depth.at(x, y).is_finite() && !ambiguous.at(x, y)
                });
                let (all, clear_ones) = (
                    stored.linear.covered().texels.iter().filter(|&&c| c).count(),
                    clear.texels.iter().filter(|&&c| c).count(),
                );
                // Coarse depth makes steps of equal depth, and with them more ties.
                assert!(clear_ones * 100 >= all * 90, "{clear_ones} of {all} pixels are clear\n{text}");
                hold("hardware depth", &got, &expected, &clear, everywhere(1e-3), &text);
            }
        }
    }
}

#[test]
fn hardware_depth_of_every_convention_and_format_gives_the_occlusion_of_linear_depth() {
    let context = Context::open(Backend::Egl).unwrap();
    for shot in [scenes::box_on_a_floor(), scenes::box_on_a_floor().orthographic()] {
        let view = seen(context.gl(), &shot, SIZE);
        assert!(view.depth.texels.contains(&f32::INFINITY));
        hold_stored(&context, &view, shot.radius, &Depths::ALL, &[TextureTarget::Texture2d]);
    }
}

/// What an engine has is one line: textures and the matrix that they were drawn with.
#[test]
fn a_matrix_alone_says_projection_depth_and_the_hand_of_normals() {
    let context = Context::open(Backend::Egl).unwrap();
    for shot in [scenes::box_on_a_floor(), scenes::box_on_a_floor().orthographic()] {
        let view = seen(context.gl(), &shot, SIZE);
        let [near, far] = planes(&view);
        let expected = view.by_shader(context.gl(), &settings(shot.radius));
        // An orthographic matrix does not tell its hand.
        let hands: &[f64] = if view.projection.is_perspective() { &[-1.0, 1.0] } else { &[-1.0] };
        for &z_axis in hands {
            let columns = matrix(view.projection, [near, far], false, ClipRange::MinusOneToOne, z_axis);
            let encoding = DepthEncoding::Matrix { projection: columns, range: ClipRange::MinusOneToOne };
            let depth = Stored::new(context.gl(), &view, encoding, Depths::Float, TextureTarget::Rectangle);
            let normals = view.normals.map(|[x, y, z]| [x, y, z * z_axis as f32]);
            let normals = ByHand { normals, ..view.clone() };
            let normals = Textures::new(context.gl(), &normals, TextureTarget::Rectangle, NormalEncoding::Signed);
            let (depth, normals) = (depth.image.texture, normals.inputs.normals.unwrap().texture);
            let inputs = Inputs::from_matrix(depth, normals, TextureTarget::Rectangle, &columns).unwrap();
            let got = occlusion(context.gl(), SIZE, &settings(shot.radius), &inputs);
            let close = |a: &f32, b: &f32| (a - b).abs() < 2e-3;
            let same = got.texels.iter().zip(&expected.texels).filter(|(a, b)| close(a, b)).count();
            assert!(same * 1000 > got.texels.len() * 995, "{z_axis} {same}");
        }
    }
    assert!(Inputs::from_matrix(depth_of(&context), depth_of(&context), TextureTarget::Rectangle, &[0.0; 16]).is_err());
}

/// A texture of which only the name is needed.
fn depth_of(context: &Context) -> glow::Texture {
    // SAFETY: the context is current.
    unsafe { context.gl().create_texture().unwrap() }
}

#[test]
fn hardware_depth_may_be_in_a_rectangle_or_in_a_layer_of_an_array() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let shot = scenes::box_on_a_floor();
    let view = seen(context.gl(), &shot, SIZE);
    let targets = [TextureTarget::Rectangle, TextureTarget::Layer(0), TextureTarget::Layer(2)];
    hold_stored(&context, &view, shot.radius, &[Depths::Bits24AndStencil, Depths::Float], &targets);
}

#[test]
fn softpipe_reads_hardware_depth_too() {
    const TEST: &str = "softpipe_reads_hardware_depth_too";
    let environment = [("GALLIUM_DRIVER", OsStr::new("softpipe")), ("LIBGL_ALWAYS_SOFTWARE", OsStr::new("true"))];
    in_own_process(TEST, &environment, || {
        let context = Context::open(Backend::Osmesa).unwrap();
        assert!(context.describe().contains("softpipe"), "{}", context.describe());
        let shot = scenes::box_on_a_floor();
        let view = seen(context.gl(), &shot, (33, 21));
        let targets = [TextureTarget::Texture2d, TextureTarget::Layer(1)];
        hold_stored(&context, &view, shot.radius, &[Depths::Bits24AndStencil, Depths::Float], &targets);
    });
}

/// The bound: P and a sample S are both off by at most dz, the greatest error of depth in the picture, so that D.z is
/// off by 2 dz. |D| is at least the length of a step in the plane of the picture, step_px z pixel. The sine of a
/// horizon is therefore off by at most 2 dz / |D|, and so is each direction's occlusion, which begins and ends with a
/// sine and is weighted by W <= 1. The tangent, which comes from the normal, is not off. Where depth is off, samples
/// near R or near the horizon may be taken otherwise; that moves A by more at few pixels, at most 1 % of them here.
#[test]
fn what_depth_is_rounded_to_moves_occlusion_within_the_bound_of_its_precision() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::box_on_a_floor();
    let view = seen(context.gl(), &shot, SIZE);
    let settings = settings(shot.radius);
    let linear = view.by_shader(context.gl(), &settings);
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    for (name, encoding) in conventions(view.projection, planes(&view)) {
        for format in Depths::ALL {
            let stored = Stored::new(context.gl(), &view, encoding, format, TextureTarget::Texture2d);
            // How far the rounded depth is off, and how far it may be by the slope of z over d.
            let mut worst: f64 = 0.0;
            for (&z, &rounded) in view.depth.texels.iter().zip(&stored.linear.depth.texels) {
                if z.is_finite() {
                    let z = f64::from(z);
                    let d = rig::stored::encode(encoding, true, z);
                    let slope = (rig::stored::encode(encoding, true, z * 1.0001) - d).abs() / (z * 1e-4);
                    // float32 rounds z itself, too.
                    let allowed = 1.1 * format.error(d) / slope + z * 2f64.powi(-24);
                    let off = (f64::from(rounded) - z).abs();
                    assert!(off <= allowed, "{name}, {format:?}: {z} became {rounded}, {off:e} of {allowed:e}");
                    worst = worst.max(off);
                }
            }
            let inputs = Inputs { depth: stored.image, depth_encoding: encoding, ..textures.inputs };
            let got = occlusion(context.gl(), view.size(), &settings, &inputs);
            let nearest = planes(&view)[0] * 20.0;
            let [half, _] = view.projection.half_extents();
            let pixel = 2.0 * half / f64::from(SIZE.0);
            // The shortest step is one texel, where the method does not exit early.
            let bound = 2.0 * worst / (nearest * pixel) + 1e-3;
            let limits = rig::Limits { tolerance: bound, share: 0.01 };
            println!("{name}, {format:?}: depth off by {worst:.1e}, occlusion by at most {bound:.1e}");
            hold("rounded depth", &got, &linear, &view.covered(), limits, &format!("{name}, {format:?}"));
        }
    }
}

#[test]
fn every_method_reads_hardware_depth() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    // In a row of a floor all pixels have the same depth, and one tie would be a tie of all: the camera is rolled.
    let shot = scenes::box_on_a_floor().rolled();
    let view = seen(gl, &shot, SIZE);
    let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let encoding = DepthEncoding::reversed(planes(&view)[0], f64::INFINITY);
    let stored = Stored::new(gl, &view, encoding, Depths::Float, TextureTarget::Texture2d);
    for method in rig::methods() {
        for half_res in [false, true] {
            let settings = Settings { radius: Radius::Units(shot.radius), half_res, ..rig::raw(method, shot.radius) };
            // The near plane of the encoding is the one at which rays end.
            let inputs = Inputs { depth: stored.image, depth_encoding: encoding, near: 0.0, ..textures.inputs };
            let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings).unwrap();
            let visibility = ao.render(&inputs).unwrap();
            let (width, height) = if half_res { (49, 31) } else { (97, 61) };
            let got = Image { width, height, texels: read_red(gl, visibility, width * height) };
            let linear = Textures::new(gl, &stored.linear, TextureTarget::Rectangle, NormalEncoding::Signed);
            let visibility = ao.render(&Inputs { near: planes(&view)[0], ..linear.inputs }).unwrap();
            let expected = Image { width, height, texels: read_red(gl, visibility, width * height) };
            // On a plane the samples that were clamped to one border are in line with P and equally high, and which of
            // them is the highest is rounding. In `hbao-talk` that decides on the weight, in half of this picture.
            let tile = rotation_tile(&settings);
            let inputs = reference::TwinInputs { near: planes(&view)[0], ..stored.linear.twin_inputs(&tile) };
            let clear = reference::ambiguous(&inputs, &settings).unwrap().map(|ambiguous| !ambiguous);
            let count = clear.texels.iter().filter(|&&clear| clear).count();
            assert!(3 * count > width * height, "{method:?}: {count} pixels are clear");
            hold("hardware depth", &got, &expected, &clear, everywhere(1e-3), &format!("{method:?}, half: {half_res}"));
        }
    }
}

/// Uploads one value per sample by drawing: squares of constant depth, the nearest in the middle. Returns the texture
/// of hardware depth, and one of linear depth, both multisample, and the number of samples.
fn draw_samples(gl: &glow::Context, size: (u32, u32), encoding: DepthEncoding) -> (glow::Texture, glow::Texture, u32) {
    let vertex = "#version 330 core\nuniform vec2 corner; uniform float turn;\nvoid main() {\n\
                  vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;\n\
                  p = mat2(cos(turn), sin(turn), -sin(turn), cos(turn)) * p * corner;\n\
                  gl_Position = vec4(p, 0.0, 1.0); }";
    let fragment = "#version 330 core\nuniform float d; uniform float z; out float o;\n\
                    void main() { gl_FragDepth = d; o = z; }";
    let (w, h) = (size.0 as i32, size.1 as i32);
    // SAFETY: the context is current, in OpenGL's initial state apart from bindings, and all objects exist.
    unsafe {
        let samples = gl.get_parameter_i32(glow::MAX_COLOR_TEXTURE_SAMPLES).min(4);
        let texture = |format: u32| {
            let texture = gl.create_texture().unwrap();
            gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(texture));
            gl.tex_image_2d_multisample(glow::TEXTURE_2D_MULTISAMPLE, samples, format as i32, w, h, true);
            texture
        };
        let (depth, linear) = (texture(glow::DEPTH_COMPONENT32F), texture(glow::R32F));
        let samples = gl.get_tex_level_parameter_i32(glow::TEXTURE_2D_MULTISAMPLE, 0, glow::TEXTURE_SAMPLES) as u32;
        let framebuffer = gl.create_framebuffer().unwrap();
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
        for (point, texture) in [(glow::DEPTH_ATTACHMENT, depth), (glow::COLOR_ATTACHMENT0, linear)] {
            gl.framebuffer_texture_2d(glow::FRAMEBUFFER, point, glow::TEXTURE_2D_MULTISAMPLE, Some(texture), 0);
        }
        assert_eq!(gl.check_framebuffer_status(glow::FRAMEBUFFER), glow::FRAMEBUFFER_COMPLETE);
        let program = gl.create_program().unwrap();
        for (stage, text) in [(glow::VERTEX_SHADER, vertex), (glow::FRAGMENT_SHADER, fragment)] {
            let shader = gl.create_shader(stage).unwrap();
            gl.shader_source(shader, text);
            gl.compile_shader(shader);
            assert!(gl.get_shader_compile_status(shader), "{}", gl.get_shader_info_log(shader));
            gl.attach_shader(program, shader);
        }
        gl.link_program(program);
        gl.use_program(Some(program));
        let vertices = gl.create_vertex_array().unwrap();
        gl.bind_vertex_array(Some(vertices));
        gl.viewport(0, 0, w, h);
        gl.clear_depth_f64(rig::stored::encode(encoding, true, f64::INFINITY));
        gl.clear_color(BACKGROUND_R32F, 0.0, 0.0, 0.0);
        gl.enable(glow::DEPTH_TEST);
        gl.depth_func(glow::ALWAYS);
        gl.clear(glow::DEPTH_BUFFER_BIT | glow::COLOR_BUFFER_BIT);
        let place = |name| gl.get_uniform_location(program, name);
        for (i, z) in [10.0f32, 9.3, 8.9, 8.4].into_iter().enumerate() {
            let half = 0.9 - 0.2 * i as f32;
            gl.uniform_2_f32(place("corner").as_ref(), half, half);
            gl.uniform_1_f32(place("turn").as_ref(), 0.2 + 0.1 * i as f32);
            gl.uniform_1_f32(place("d").as_ref(), rig::stored::encode(encoding, true, z.into()) as f32);
            gl.uniform_1_f32(place("z").as_ref(), z);
            gl.draw_arrays(glow::TRIANGLE_STRIP, 0, 4);
        }
        gl.disable(glow::DEPTH_TEST);
        gl.bind_framebuffer(glow::FRAMEBUFFER, None);
        gl.delete_framebuffer(framebuffer);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        (depth, linear, samples)
    }
}

/// Blur and edges read all samples. The surfaces have constant depths, so that the two forms differ by the rounding of
/// float32 alone, 4e-6 of the depth, as above.
#[test]
fn multisample_hardware_depth_gives_the_occlusion_of_linear_depth_of_the_same_samples() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let projection = by_hand::perspective(60.0, SIZE);
    let flat = ByHand {
        depth: Image::filled(SIZE.0 as usize, SIZE.1 as usize, 9.0),
        normals: Image::filled(SIZE.0 as usize, SIZE.1 as usize, [0.0, 0.0, -1.0]),
        projection,
    };
    let textures = Textures::new(gl, &flat, TextureTarget::Rectangle, NormalEncoding::Signed);
    let settings = Settings { ao_format: AoFormat::R32f, blur: 9, ..rig::float_settings(3.0) };
    for encoding in [
        DepthEncoding::standard(1.0, 100.0),
        DepthEncoding::reversed(1.0, f64::INFINITY),
        DepthEncoding::Logarithmic { c: 1.0, far: 100.0 },
    ] {
        let (hardware, linear, samples) = draw_samples(gl, SIZE, encoding);
        assert!(samples > 1);
        let target = TextureTarget::Multisample(samples);
        let of = |texture, depth_encoding| Inputs {
            depth: TextureRef { texture, target },
            depth_encoding,
            ..textures.inputs
        };
        let expected = occlusion(gl, SIZE, &settings, &of(linear, DepthEncoding::Linear));
        let got = occlusion(gl, SIZE, &settings, &of(hardware, encoding));
        let all = expected.map(|_| true);
        hold("multisample", &got, &expected, &all, everywhere(1e-3), &format!("{encoding:?}"));
        // The same with the first sample resolved by the application, as linear depth was given before.
        let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings).unwrap();
        ao.render(&of(linear, DepthEncoding::Linear)).unwrap();
        let resolved = Inputs {
            depth: ao.linear_depth().unwrap(),
            samples: Some(DepthSamples { texture: linear, samples }),
            ..textures.inputs
        };
        assert!(occlusion(gl, SIZE, &settings, &resolved) == expected);
        // The samples matter.
        let without = occlusion(gl, SIZE, &settings, &Inputs { samples: None, ..resolved });
        assert!(without != expected && expected.texels.iter().any(|&a| a < 0.9), "{encoding:?}");
    }
}

/// Around the viewport the textures hold NaN, which no result may contain.
#[test]
fn a_viewport_in_larger_textures_gives_what_textures_of_its_size_give() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let gl = context.gl();
    let shot = scenes::box_on_a_floor();
    let view = seen(gl, &shot, SIZE);
    let (corner, of) = ((7, 5), (130, 83));
    let viewport = Some(Viewport { x: 7, y: 5, width: SIZE.0, height: SIZE.1 });
    let encoding = DepthEncoding::reversed(planes(&view)[0], f64::INFINITY);
    let stored = Stored::new(gl, &view, encoding, Depths::Float, TextureTarget::Rectangle);
    let bytes = |floats: &[f32]| floats.iter().flat_map(|f| f.to_ne_bytes()).collect::<Vec<u8>>();
    let texels = |f: &dyn Fn(usize) -> Vec<u8>| Image {
        width: view.depth.width,
        height: view.depth.height,
        texels: (0..view.depth.texels.len()).map(f).collect(),
    };
    let depth = texels(&|i| bytes(&[view.depth.texels[i].min(BACKGROUND_R32F)]));
    let hardware = texels(&|i| {
        let z = f64::from(view.depth.texels[i]);
        bytes(&[rig::stored::encode(encoding, true, z) as f32])
    });
    let normals = texels(&|i| [bytes(&view.normals.texels[i]), bytes(&[0.0])].concat());
    let nan = bytes(&[f32::NAN; 4]);
    for target in [TextureTarget::Texture2d, TextureTarget::Rectangle, TextureTarget::Layer(1)] {
        let linear = upload(gl, target, (glow::R32F, glow::RED, glow::FLOAT), &depth, &nan[..4], corner, of);
        let format = (glow::DEPTH_COMPONENT32F, glow::DEPTH_COMPONENT, glow::FLOAT);
        let encoded = upload(gl, target, format, &hardware, &bytes(&[0.7]), corner, of);
        let normals = upload(gl, target, (glow::RGBA32F, glow::RGBA, glow::FLOAT), &normals, &nan, corner, of);
        for settings in [
            rig::float_settings(shot.radius),
            Settings { half_res: true, ..rig::float_settings(3.0 * shot.radius) },
            Settings { blur: 5, ..rig::raw(Method::Ssao, shot.radius) },
        ] {
            let expected = view.by_shader(gl, &settings);
            let inputs = Inputs::new(linear.texture, normals.texture, target, view.projection);
            let inputs = Inputs { viewport, ..inputs };
            let text = format!("{target:?}\n{}", settings.to_toml());
            assert!(occlusion(gl, SIZE, &settings, &inputs) == expected, "{text}");
            let expected = {
                let whole = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
                let inputs = Inputs { depth: stored.image, depth_encoding: encoding, ..whole.inputs };
                occlusion(gl, SIZE, &settings, &inputs)
            };
            let inputs = Inputs { depth: encoded, depth_encoding: encoding, ..inputs };
            assert!(occlusion(gl, SIZE, &settings, &inputs) == expected, "hardware depth, {text}");
        }
    }
}

#[test]
fn a_view_gives_the_same_occlusion_in_any_unit() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let shot = scenes::box_on_a_floor();
    let view = seen(gl, &shot, SIZE);
    let [near, far] = planes(&view);
    let of = |unit: f32| {
        let scaled = ByHand { depth: view.depth.map(|z| z * unit), ..view.clone() };
        let encoding = DepthEncoding::standard(near * f64::from(unit), far * f64::from(unit));
        let stored = Stored::new(gl, &scaled, encoding, Depths::Float, TextureTarget::Texture2d);
        let whole = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let inputs = Inputs { depth: stored.image, depth_encoding: encoding, normals: None, ..whole.inputs };
        occlusion(gl, SIZE, &settings(shot.radius * f64::from(unit)), &inputs)
    };
    // These units are powers of two, by which float32 scales without rounding.
    let expected = of(1.0);
    for unit in [2f32.powi(-20), 2f32.powi(20)] {
        let limits = rig::Limits { tolerance: 1e-3, share: 0.001 };
        hold("scaled", &of(unit), &expected, &view.covered(), limits, &format!("unit {unit}"));
    }
}

/// The application's shadow lookups compare, and its filters blend. Neither may show, and both must stay.
#[test]
fn a_depth_texture_keeps_its_parameters_and_they_do_not_matter() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let shot = scenes::box_on_a_floor();
        let view = seen(gl, &shot, SIZE);
        let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let [near, far] = planes(&view);
        let encoding = DepthEncoding::standard(near, far);
        let stored = Stored::new(gl, &view, encoding, Depths::Bits24AndStencil, TextureTarget::Texture2d);
        let inputs = Inputs { depth: stored.image, depth_encoding: encoding, ..textures.inputs };
        let expected = occlusion(gl, SIZE, &settings(shot.radius), &inputs);
        let parameters = [
            (glow::TEXTURE_COMPARE_MODE, glow::COMPARE_REF_TO_TEXTURE),
            (glow::TEXTURE_COMPARE_FUNC, glow::GREATER),
            (glow::TEXTURE_MIN_FILTER, glow::LINEAR_MIPMAP_LINEAR),
            (glow::TEXTURE_MAG_FILTER, glow::LINEAR),
            (glow::TEXTURE_WRAP_S, glow::REPEAT),
            (glow::TEXTURE_WRAP_T, glow::MIRRORED_REPEAT),
            (glow::TEXTURE_BASE_LEVEL, 0),
            (glow::TEXTURE_MAX_LEVEL, 5),
        ];
        // SAFETY: the context is current, and the texture exists.
        unsafe {
            gl.bind_texture(glow::TEXTURE_2D, Some(stored.image.texture));
            for (parameter, value) in parameters {
                gl.tex_parameter_i32(glow::TEXTURE_2D, parameter, value as i32);
            }
            assert!(occlusion(gl, SIZE, &settings(shot.radius), &inputs) == expected);
            gl.bind_texture(glow::TEXTURE_2D, Some(stored.image.texture));
            for (parameter, value) in parameters {
                assert_eq!(gl.get_tex_parameter_i32(glow::TEXTURE_2D, parameter), value as i32, "0x{parameter:x}");
            }
        }
    }
}

#[test]
fn linear_depth_and_rebuilt_normals_are_passes_of_their_own_where_they_are_needed_only() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let shot = scenes::box_on_a_floor();
    let view = seen(gl, &shot, SIZE);
    let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let [near, far] = planes(&view);
    let encoding = DepthEncoding::standard(near, far);
    let stored = Stored::new(gl, &view, encoding, Depths::Float, TextureTarget::Texture2d);
    let hardware = Inputs { depth: stored.image, depth_encoding: encoding, ..textures.inputs };
    let names = |settings: &Settings, inputs: &Inputs| {
        let mut timers = Timers::new(gl, true).unwrap();
        let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, settings).unwrap();
        ao.render_timed(inputs, &mut timers).unwrap();
        let names: Vec<&str> = timers.take().iter().map(|time| time.name).collect();
        assert_eq!(ao.linear_depth().is_some(), names.contains(&"linear_depth"));
        assert_eq!(ao.rebuilt_normals().is_some(), names.contains(&"rebuilt_normals"));
        names
    };
    let hbao = settings(shot.radius);
    let without = |inputs: Inputs| Inputs { normals: None, ..inputs };
    assert_eq!(names(&hbao, &textures.inputs), ["background", "ao"]);
    assert_eq!(names(&hbao, &hardware), ["linear_depth", "background", "ao"]);
    assert_eq!(names(&hbao, &without(hardware)), ["linear_depth", "background", "rebuilt_normals", "ao"]);
    // Crysis' method reads no normals, and `none` reads nothing.
    assert_eq!(names(&rig::raw(Method::Ssao, 1.0), &without(textures.inputs)), ["background", "ao"]);
    assert!(!names(&rig::raw(Method::None, 1.0), &without(textures.inputs)).contains(&"rebuilt_normals"));
}
