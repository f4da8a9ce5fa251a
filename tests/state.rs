//! Ambient occlusion in somebody else's context: all state is as it was, whatever it was, and does not show in the
//! result.

mod rig;

use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::Image;
use hbao::settings::{AoFormat, Method, Radius, SsaoDepth};
use hbao::{AmbientOcclusion, Format, NormalEncoding, Pipeline, Request, Settings, TextureTarget, format_renders};
use rig::by_hand::{ByHand, Textures, perspective, read_red, slope};
use std::collections::BTreeMap;

const SIZE: (u32, u32) = (37, 23);
/// The passes use four; a fifth must not be touched.
const UNITS: u32 = 5;

/// A floor with a step in it and background above.
fn view() -> ByHand {
    let projection = perspective(60.0, SIZE);
    let depth = Image::from_fn(SIZE.0 as usize, SIZE.1 as usize, |x, y| {
        let [_, v] = slope(projection, SIZE, x, y);
        match -1.0 / v {
            z if v > -0.1 || z > 9.0 => f32::INFINITY,
            z if x > 20 => z as f32 - 0.5,
            z => z as f32,
        }
    });
    ByHand { normals: depth.map(|_| [0.0, 1.0, 0.0]), depth, projection }
}

const SWITCHES: &[(&str, u32)] = &[
    ("CULL_FACE", glow::CULL_FACE),
    ("DEPTH_TEST", glow::DEPTH_TEST),
    ("STENCIL_TEST", glow::STENCIL_TEST),
    ("SCISSOR_TEST", glow::SCISSOR_TEST),
    ("DITHER", glow::DITHER),
    ("COLOR_LOGIC_OP", glow::COLOR_LOGIC_OP),
    ("RASTERIZER_DISCARD", glow::RASTERIZER_DISCARD),
    ("FRAMEBUFFER_SRGB", glow::FRAMEBUFFER_SRGB),
    ("SAMPLE_COVERAGE", glow::SAMPLE_COVERAGE),
    ("SAMPLE_ALPHA_TO_COVERAGE", glow::SAMPLE_ALPHA_TO_COVERAGE),
    ("SAMPLE_ALPHA_TO_ONE", glow::SAMPLE_ALPHA_TO_ONE),
    ("SAMPLE_MASK", glow::SAMPLE_MASK),
    ("MULTISAMPLE", glow::MULTISAMPLE),
    ("POLYGON_OFFSET_FILL", glow::POLYGON_OFFSET_FILL),
    ("POLYGON_OFFSET_LINE", glow::POLYGON_OFFSET_LINE),
    ("POLYGON_SMOOTH", glow::POLYGON_SMOOTH),
    ("LINE_SMOOTH", glow::LINE_SMOOTH),
    ("PRIMITIVE_RESTART", glow::PRIMITIVE_RESTART),
    ("DEPTH_CLAMP", glow::DEPTH_CLAMP),
    ("PROGRAM_POINT_SIZE", glow::PROGRAM_POINT_SIZE),
    ("TEXTURE_CUBE_MAP_SEAMLESS", glow::TEXTURE_CUBE_MAP_SEAMLESS),
];

/// Integer state with how many values it has.
const INTEGERS: &[(&str, u32, usize)] = &[
    ("ACTIVE_TEXTURE", glow::ACTIVE_TEXTURE, 1),
    ("ARRAY_BUFFER", glow::ARRAY_BUFFER_BINDING, 1),
    ("ELEMENT_ARRAY_BUFFER", glow::ELEMENT_ARRAY_BUFFER_BINDING, 1),
    ("UNIFORM_BUFFER", glow::UNIFORM_BUFFER_BINDING, 1),
    ("PIXEL_PACK_BUFFER", glow::PIXEL_PACK_BUFFER_BINDING, 1),
    ("PIXEL_UNPACK_BUFFER", glow::PIXEL_UNPACK_BUFFER_BINDING, 1),
    ("TRANSFORM_FEEDBACK_BUFFER", glow::TRANSFORM_FEEDBACK_BUFFER_BINDING, 1),
    ("DRAW_FRAMEBUFFER", glow::DRAW_FRAMEBUFFER_BINDING, 1),
    ("READ_FRAMEBUFFER", glow::READ_FRAMEBUFFER_BINDING, 1),
    ("RENDERBUFFER", glow::RENDERBUFFER_BINDING, 1),
    ("CURRENT_PROGRAM", glow::CURRENT_PROGRAM, 1),
    ("VERTEX_ARRAY", glow::VERTEX_ARRAY_BINDING, 1),
    ("DRAW_BUFFER0", glow::DRAW_BUFFER0, 1),
    ("DRAW_BUFFER1", glow::DRAW_BUFFER1, 1),
    ("READ_BUFFER", glow::READ_BUFFER, 1),
    ("BLEND_SRC_RGB", glow::BLEND_SRC_RGB, 1),
    ("BLEND_DST_RGB", glow::BLEND_DST_RGB, 1),
    ("BLEND_SRC_ALPHA", glow::BLEND_SRC_ALPHA, 1),
    ("BLEND_DST_ALPHA", glow::BLEND_DST_ALPHA, 1),
    ("BLEND_EQUATION_RGB", glow::BLEND_EQUATION_RGB, 1),
    ("BLEND_EQUATION_ALPHA", glow::BLEND_EQUATION_ALPHA, 1),
    ("COLOR_WRITEMASK", glow::COLOR_WRITEMASK, 4),
    ("DEPTH_WRITEMASK", glow::DEPTH_WRITEMASK, 1),
    ("DEPTH_FUNC", glow::DEPTH_FUNC, 1),
    ("CULL_FACE_MODE", glow::CULL_FACE_MODE, 1),
    ("FRONT_FACE", glow::FRONT_FACE, 1),
    ("LOGIC_OP_MODE", glow::LOGIC_OP_MODE, 1),
    ("POLYGON_MODE", glow::POLYGON_MODE, 1),
    ("PROVOKING_VERTEX", glow::PROVOKING_VERTEX, 1),
    ("VIEWPORT", glow::VIEWPORT, 4),
    ("SCISSOR_BOX", glow::SCISSOR_BOX, 4),
    ("STENCIL_CLEAR_VALUE", glow::STENCIL_CLEAR_VALUE, 1),
    ("STENCIL_FUNC", glow::STENCIL_FUNC, 1),
    ("STENCIL_REF", glow::STENCIL_REF, 1),
    ("STENCIL_VALUE_MASK", glow::STENCIL_VALUE_MASK, 1),
    ("STENCIL_WRITEMASK", glow::STENCIL_WRITEMASK, 1),
    ("STENCIL_FAIL", glow::STENCIL_FAIL, 1),
    ("STENCIL_PASS_DEPTH_FAIL", glow::STENCIL_PASS_DEPTH_FAIL, 1),
    ("STENCIL_PASS_DEPTH_PASS", glow::STENCIL_PASS_DEPTH_PASS, 1),
    ("STENCIL_BACK_FUNC", glow::STENCIL_BACK_FUNC, 1),
    ("STENCIL_BACK_REF", glow::STENCIL_BACK_REF, 1),
    ("STENCIL_BACK_VALUE_MASK", glow::STENCIL_BACK_VALUE_MASK, 1),
    ("STENCIL_BACK_WRITEMASK", glow::STENCIL_BACK_WRITEMASK, 1),
    ("STENCIL_BACK_FAIL", glow::STENCIL_BACK_FAIL, 1),
    ("STENCIL_BACK_PASS_DEPTH_FAIL", glow::STENCIL_BACK_PASS_DEPTH_FAIL, 1),
    ("STENCIL_BACK_PASS_DEPTH_PASS", glow::STENCIL_BACK_PASS_DEPTH_PASS, 1),
    ("UNPACK_ALIGNMENT", glow::UNPACK_ALIGNMENT, 1),
    ("UNPACK_ROW_LENGTH", glow::UNPACK_ROW_LENGTH, 1),
    ("UNPACK_IMAGE_HEIGHT", glow::UNPACK_IMAGE_HEIGHT, 1),
    ("UNPACK_SKIP_PIXELS", glow::UNPACK_SKIP_PIXELS, 1),
    ("UNPACK_SKIP_ROWS", glow::UNPACK_SKIP_ROWS, 1),
    ("UNPACK_SKIP_IMAGES", glow::UNPACK_SKIP_IMAGES, 1),
    ("UNPACK_SWAP_BYTES", glow::UNPACK_SWAP_BYTES, 1),
    ("UNPACK_LSB_FIRST", glow::UNPACK_LSB_FIRST, 1),
    ("PACK_ALIGNMENT", glow::PACK_ALIGNMENT, 1),
    ("PACK_ROW_LENGTH", glow::PACK_ROW_LENGTH, 1),
    ("PACK_SKIP_PIXELS", glow::PACK_SKIP_PIXELS, 1),
    ("PACK_SKIP_ROWS", glow::PACK_SKIP_ROWS, 1),
];

const FLOATS: &[(&str, u32, usize)] = &[
    ("BLEND_COLOR", glow::BLEND_COLOR, 4),
    ("COLOR_CLEAR_VALUE", glow::COLOR_CLEAR_VALUE, 4),
    ("DEPTH_CLEAR_VALUE", glow::DEPTH_CLEAR_VALUE, 1),
    ("DEPTH_RANGE", glow::DEPTH_RANGE, 2),
    ("POLYGON_OFFSET_FACTOR", glow::POLYGON_OFFSET_FACTOR, 1),
    ("POLYGON_OFFSET_UNITS", glow::POLYGON_OFFSET_UNITS, 1),
    ("SAMPLE_COVERAGE_VALUE", glow::SAMPLE_COVERAGE_VALUE, 1),
];

const UNIT_BINDINGS: &[(&str, u32)] = &[
    ("2D", glow::TEXTURE_BINDING_2D),
    ("RECTANGLE", glow::TEXTURE_BINDING_RECTANGLE),
    ("3D", glow::TEXTURE_BINDING_3D),
    ("2D_ARRAY", glow::TEXTURE_BINDING_2D_ARRAY),
    ("CUBE_MAP", glow::TEXTURE_BINDING_CUBE_MAP),
    ("2D_MULTISAMPLE", glow::TEXTURE_BINDING_2D_MULTISAMPLE),
    ("SAMPLER", glow::SAMPLER_BINDING),
];

type State = BTreeMap<String, String>;

fn state(gl: &glow::Context) -> State {
    let mut state = State::new();
    // SAFETY: the context is current, and each parameter is core and has as many values as there is room for, or
    // fewer: Mesa writes two for POLYGON_MODE.
    unsafe {
        for &(name, switch) in SWITCHES {
            state.insert(name.into(), gl.is_enabled(switch).to_string());
        }
        for &(name, parameter, count) in INTEGERS {
            let mut values = [0; 4];
            gl.get_parameter_i32_slice(parameter, &mut values);
            state.insert(name.into(), format!("{:?}", &values[..count]));
        }
        for &(name, parameter, count) in FLOATS {
            let mut values = [0.0; 4];
            gl.get_parameter_f32_slice(parameter, &mut values);
            state.insert(name.into(), format!("{:?}", &values[..count]));
        }
        for buffer in 0..2 {
            let on = gl.get_parameter_indexed_i32(glow::BLEND, buffer);
            state.insert(format!("BLEND of draw buffer {buffer}"), on.to_string());
        }
        let active = gl.get_parameter_i32(glow::ACTIVE_TEXTURE) as u32;
        for unit in 0..UNITS {
            gl.active_texture(glow::TEXTURE0 + unit);
            for &(name, binding) in UNIT_BINDINGS {
                state.insert(format!("{name} of unit {unit}"), gl.get_parameter_i32(binding).to_string());
            }
        }
        gl.active_texture(active);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
    state
}

/// Sets what no full-screen pass would expect. What is made here goes with the context.
fn disturb(gl: &glow::Context) {
    // SAFETY: the context is current; nothing is drawn.
    unsafe {
        for &(_, switch) in SWITCHES {
            gl.enable(switch);
        }
        gl.enable_draw_buffer(glow::BLEND, 0);
        gl.disable_draw_buffer(glow::BLEND, 1);
        gl.blend_color(0.1, 0.2, 0.3, 0.4);
        gl.blend_func_separate(glow::DST_COLOR, glow::ONE, glow::ZERO, glow::CONSTANT_ALPHA);
        gl.blend_equation_separate(glow::FUNC_REVERSE_SUBTRACT, glow::MAX);
        gl.color_mask(false, true, false, true);
        gl.depth_mask(true);
        gl.depth_func(glow::NEVER);
        gl.depth_range_f64(0.75, 0.25);
        gl.cull_face(glow::FRONT_AND_BACK);
        gl.front_face(glow::CW);
        gl.polygon_mode(glow::FRONT_AND_BACK, glow::LINE);
        gl.polygon_offset(3.0, 5.0);
        gl.sample_coverage(0.0, true);
        gl.viewport(3, 5, 7, 2);
        gl.scissor(1, 2, 3, 4);
        gl.clear_color(0.2, 0.4, 0.6, 0.8);
        gl.clear_depth_f64(0.3);
        gl.clear_stencil(77);
        gl.stencil_func_separate(glow::FRONT, glow::NEVER, 3, 0x0f);
        gl.stencil_func_separate(glow::BACK, glow::GEQUAL, 5, 0xf0);
        gl.stencil_op_separate(glow::FRONT, glow::INVERT, glow::INCR, glow::DECR_WRAP);
        gl.stencil_op_separate(glow::BACK, glow::ZERO, glow::DECR, glow::INCR_WRAP);
        gl.stencil_mask_separate(glow::FRONT, 0x05);
        gl.stencil_mask_separate(glow::BACK, 0x0a);

        for (i, target) in [
            glow::ARRAY_BUFFER,
            glow::UNIFORM_BUFFER,
            glow::PIXEL_PACK_BUFFER,
            glow::PIXEL_UNPACK_BUFFER,
            glow::TRANSFORM_FEEDBACK_BUFFER,
        ]
        .into_iter()
        .enumerate()
        {
            let buffer = gl.create_buffer().unwrap();
            gl.bind_buffer(target, Some(buffer));
            gl.buffer_data_size(target, 16 + i as i32, glow::STATIC_DRAW);
        }
        let vertices = gl.create_vertex_array().unwrap();
        gl.bind_vertex_array(Some(vertices));
        gl.bind_buffer(glow::ELEMENT_ARRAY_BUFFER, Some(gl.create_buffer().unwrap()));

        let program = gl.create_program().unwrap();
        let stages = [
            (glow::VERTEX_SHADER, "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }"),
            (glow::FRAGMENT_SHADER, "#version 330 core\nout vec4 o; void main() { o = vec4(0.5); }"),
        ];
        for (stage, text) in stages {
            let shader = gl.create_shader(stage).unwrap();
            gl.shader_source(shader, text);
            gl.compile_shader(shader);
            gl.attach_shader(program, shader);
        }
        gl.link_program(program);
        assert!(gl.get_program_link_status(program));
        gl.use_program(Some(program));

        for unit in 0..UNITS {
            gl.active_texture(glow::TEXTURE0 + unit);
            for kind in [
                glow::TEXTURE_2D,
                glow::TEXTURE_RECTANGLE,
                glow::TEXTURE_3D,
                glow::TEXTURE_2D_ARRAY,
                glow::TEXTURE_CUBE_MAP,
                glow::TEXTURE_2D_MULTISAMPLE,
            ] {
                gl.bind_texture(kind, Some(gl.create_texture().unwrap()));
            }
            let sampler = gl.create_sampler().unwrap();
            gl.sampler_parameter_i32(sampler, glow::TEXTURE_MIN_FILTER, glow::LINEAR_MIPMAP_LINEAR as i32);
            gl.sampler_parameter_i32(sampler, glow::TEXTURE_WRAP_S, glow::MIRRORED_REPEAT as i32);
            gl.bind_sampler(unit, Some(sampler));
        }
        gl.active_texture(glow::TEXTURE0 + UNITS - 1);

        // Two framebuffers: one drawn to, into its second attachment, and one read from.
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(gl.create_renderbuffer().unwrap()));
        gl.renderbuffer_storage(glow::RENDERBUFFER, glow::RGBA8, 8, 8);
        let (draw, read) = (gl.create_framebuffer().unwrap(), gl.create_framebuffer().unwrap());
        gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(draw));
        gl.draw_buffers(&[glow::NONE, glow::COLOR_ATTACHMENT1]);
        gl.bind_framebuffer(glow::READ_FRAMEBUFFER, Some(read));
        gl.read_buffer(glow::COLOR_ATTACHMENT2);

        for (parameter, value) in [
            (glow::UNPACK_ALIGNMENT, 8),
            (glow::UNPACK_ROW_LENGTH, 5),
            (glow::UNPACK_IMAGE_HEIGHT, 3),
            (glow::UNPACK_SKIP_PIXELS, 2),
            (glow::UNPACK_SKIP_ROWS, 1),
            (glow::UNPACK_SKIP_IMAGES, 1),
            (glow::UNPACK_SWAP_BYTES, 1),
            (glow::UNPACK_LSB_FIRST, 1),
            (glow::PACK_ALIGNMENT, 1),
            (glow::PACK_ROW_LENGTH, 3),
            (glow::PACK_SKIP_PIXELS, 1),
            (glow::PACK_SKIP_ROWS, 2),
        ] {
            gl.pixel_store_i32(parameter, value);
        }
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
}

/// So that a test can read a texture back.
fn undisturbed_packing(gl: &glow::Context) {
    // SAFETY: the context is current.
    unsafe {
        gl.bind_buffer(glow::PIXEL_PACK_BUFFER, None);
        for (parameter, value) in [
            (glow::PACK_ALIGNMENT, 4),
            (glow::PACK_ROW_LENGTH, 0),
            (glow::PACK_SKIP_PIXELS, 0),
            (glow::PACK_SKIP_ROWS, 0),
        ] {
            gl.pixel_store_i32(parameter, value);
        }
    }
}

#[track_caller]
fn assert_same(before: &State, after: &State, when: &str) {
    let changed: Vec<String> = before
        .iter()
        .filter(|(name, value)| after[*name] != **value)
        .map(|(name, value)| format!("{name} was {value} and is {}", after[name]))
        .collect();
    assert!(changed.is_empty(), "{when}: {}", changed.join("; "));
}

fn settings() -> Settings {
    Settings { ao_format: AoFormat::R8, ..rig::float_settings(2.0) }
}

#[test]
fn all_state_is_put_back_and_none_shows_in_the_result() {
    // The second has a pass more, and a texture unit; the third surfaces of three sizes.
    let ssao = Settings { method: Method::Ssao, ssao_depth: SsaoDepth::Half, ..settings() };
    let half = Settings { half_res: true, radius: Radius::Units(4.0), steps: 3, strength: 3.0, ..settings() };
    for settings in [settings(), ssao, half] {
        hold_state(&settings);
    }
}

fn hold_state(settings: &Settings) {
    for backend in rig::BOTH {
        for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
            let view = view();
            let expected = {
                let context = Context::open(backend).unwrap();
                view.by_shader_from(context.gl(), settings, target, NormalEncoding::Signed)
            };
            let least = expected.texels.iter().copied().fold(1.0, f32::min);
            assert!(least < 0.95 && view.depth.texels.contains(&f32::INFINITY), "{least}\n{}", settings.to_toml());

            let context = Context::open(backend).unwrap();
            let gl = context.gl();
            let textures = Textures::new(gl, &view, target, NormalEncoding::Signed);
            let clean = state(gl);
            disturb(gl);
            let before = state(gl);
            let same: Vec<_> = clean.keys().filter(|name| clean[*name] == before[*name]).collect();
            // Some switches are on from the start, and some state has one value only. Most must differ to say anything.
            assert!(same.len() * 6 < before.len(), "left as they were: {same:?}");

            let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), settings).unwrap();
            assert_same(&before, &state(gl), "new");
            let visibility = ao.render(&textures.inputs).unwrap();
            assert_same(&before, &state(gl), "the first run, which compiles");
            let visibility_again = ao.render(&textures.inputs).unwrap();
            assert_same(&before, &state(gl), "the second run");
            assert_eq!(visibility, visibility_again);
            undisturbed_packing(gl);
            let got = read_red(gl, visibility, view.depth.texels.len());
            assert_eq!(got, expected.texels, "{}, {target:?}", backend.name());
            // Reading left the result bound, which goes with the drop.
            disturb(gl);
            let before = state(gl);
            drop(ao);
            assert_same(&before, &state(gl), "drop");
        }
    }
}

/// Edges are marked in the stencil, and the blur reads multisample textures.
#[test]
fn all_state_is_put_back_with_depth_samples_too() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let shot = rig::scenes::cornell_box();
        let settings = Settings { msaa: 4, ..rig::float_settings(shot.radius) };
        let camera = shot.camera(rig::SIZE);
        let mut pipeline = Pipeline::new(gl, rig::SIZE, &settings, Request::default()).unwrap();
        pipeline.render(&shot.mesh, &camera).unwrap();
        let expected = pipeline.ao().unwrap();
        disturb(gl);
        let before = state(gl);
        let mut ao = AmbientOcclusion::new(gl.clone(), rig::SIZE, &settings).unwrap();
        let visibility = ao.render(&pipeline.inputs(&camera)).unwrap();
        assert_same(&before, &state(gl), "a run with samples");
        undisturbed_packing(gl);
        assert_eq!(read_red(gl, visibility, expected.texels.len()), expected.texels, "{}", backend.name());
    }
}

/// With the caller's way to pack pixels, what is read back would be wrong, or written past its end.
#[test]
fn formats_are_tried_whatever_the_caller_packs() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let gl = context.gl();
    let expected = Format::ALL.map(|(format, _)| format_renders(gl, format).unwrap());
    assert!(expected.contains(&true));
    // SAFETY: the context is current, and nothing is read by the caller.
    unsafe {
        gl.pixel_store_i32(glow::PACK_SKIP_PIXELS, 100_000);
        gl.pixel_store_i32(glow::PACK_ROW_LENGTH, 77);
        gl.bind_buffer(glow::PIXEL_PACK_BUFFER, Some(gl.create_buffer().unwrap()));
    }
    let packing = |gl: &glow::Context| -> BTreeMap<_, _> {
        state(gl).into_iter().filter(|(name, _)| name.contains("PACK")).collect()
    };
    let before = packing(gl);
    assert_eq!(Format::ALL.map(|(format, _)| format_renders(gl, format).unwrap()), expected);
    assert!(before.len() > 4 && before == packing(gl));
}

/// A refusal leaves by another way out.
#[test]
fn state_is_put_back_after_an_error_too() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let gl = context.gl();
    let view = view();
    let mut textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    disturb(gl);
    let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
    let before = state(gl);
    // A rectangle texture that is said to be two-dimensional.
    textures.inputs.depth.target = TextureTarget::Texture2d;
    let error = ao.render(&textures.inputs).unwrap_err();
    assert!(error.to_string().contains("invalid operation"), "{error}");
    assert_same(&before, &state(gl), "a refused texture");
    textures.inputs.depth.target = TextureTarget::Rectangle;
    ao.render(&textures.inputs).unwrap();
    assert!(AmbientOcclusion::new(gl.clone(), (0, 1), &settings()).is_err());
    assert_same(&before, &state(gl), "a refused size");
}
