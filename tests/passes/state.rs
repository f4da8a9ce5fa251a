//! Ambient occlusion in an application's context: all state is restored, whatever it was, and it does not affect the
//! result.

mod report;
mod unusual;

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, perspective, read_red, slope};
use crate::rig::stored::{Depths, Stored};
use glow::HasContext as _;
use hbao::context::Context;
use hbao::image::Image;
use hbao::scene::{Extents, Projection};
use hbao::settings::{AoFormat, Jitter, Method, Radius, SsaoDepth};
use hbao::{
    AmbientOcclusion, BACKGROUND_R32F, DepthEncoding, Destination, Error, Format, InputTextures, Inputs,
    NormalEncoding, Output, Pipeline, Request, Settings, TextureRef, TextureTarget, Write, check_size, format_renders,
    size_limit,
};
use report::{Reporter, State};
use std::collections::BTreeSet;
use unusual::disturb;

const SIZE: (u32, u32) = (37, 23);

/// A floor with a step in it, and background above.
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

/// True for state that may have OpenGL's initial value even after [`disturb`]: constants, state that cannot be combined
/// with other unusual state, and state that belongs to an object and not to the context.
fn may_be_as_it_was(name: &str) -> bool {
    const CONSTANTS: [&str; 12] = [
        "COLOR_BUFFER_BIT", // Mesa takes this number for a parameter
        "COMPRESSED_TEXTURE_FORMATS",
        "CONTEXT_FLAGS",
        "CONTEXT_PROFILE_MASK",
        "DOUBLEBUFFER",
        "MAJOR_VERSION",
        "MINOR_VERSION",
        "SAMPLES", // belongs to the framebuffer, like the next one
        "SAMPLE_BUFFERS",
        "STEREO",
        "SUBPIXEL_BITS",
        "UNIFORM_BUFFER_OFFSET_ALIGNMENT",
    ];
    const EXCLUDED: [&str; 4] = ["CURRENT_QUERY of ANY_SAMPLES_PASSED", "BLEND[1]", "BLEND[4]", "BLEND[7]"];
    // The attribute arrays here are normalised, so they cannot be arrays of integers.
    let prefixes = ["MAX_", "MIN_", "NUM_", "QUERY_COUNTER_BITS", "VERTEX_ATTRIB_ARRAY_INTEGER"];
    let limit = prefixes.iter().any(|prefix| name.starts_with(prefix))
        || name.ends_with("_GRANULARITY")
        || name.ends_with("_RANGE") && name != "DEPTH_RANGE";
    let object = name.contains(" of the ") || name.contains(" attachment ");
    limit || object || CONSTANTS.contains(&name) || EXCLUDED.contains(&name)
}

/// Makes a context in which all state is unusual, except for state that is known to have only one possible value.
fn unusual_state(context: &Context) -> (Reporter, State) {
    let reporter = Reporter::new(context);
    let clean = reporter.state();
    disturb(context.gl(), &reporter);
    let before = reporter.state();
    let same: BTreeSet<&str> = (clean.iter())
        .filter(|(name, value)| before.get(*name) == Some(value) && !may_be_as_it_was(name))
        .map(|(name, _)| name.as_str())
        .collect();
    assert!(same.is_empty(), "this state has its initial value: {same:?}");
    (reporter, before)
}

/// Reads the red channel of a result without changing the state.
fn read_red_undisturbed(gl: &glow::Context, image: TextureRef, texels: usize) -> Vec<f32> {
    const PACK: [(u32, i32); 6] = [
        (glow::PACK_ALIGNMENT, 4),
        (glow::PACK_ROW_LENGTH, 0),
        (glow::PACK_SKIP_PIXELS, 0),
        (glow::PACK_SKIP_ROWS, 0),
        (glow::PACK_SWAP_BYTES, 0),
        (glow::PACK_LSB_FIRST, 0),
    ];
    // SAFETY: the context is current.
    unsafe {
        let buffer = gl.get_parameter_buffer(glow::PIXEL_PACK_BUFFER_BINDING);
        let bound = gl.get_parameter_texture(glow::TEXTURE_BINDING_RECTANGLE);
        let values = PACK.map(|(parameter, _)| (parameter, gl.get_parameter_i32(parameter)));
        gl.bind_buffer(glow::PIXEL_PACK_BUFFER, None);
        PACK.iter().for_each(|&(parameter, value)| gl.pixel_store_i32(parameter, value));
        let read = read_red(gl, image, texels);
        values.iter().for_each(|&(parameter, value)| gl.pixel_store_i32(parameter, value));
        gl.bind_texture(glow::TEXTURE_RECTANGLE, bound);
        gl.bind_buffer(glow::PIXEL_PACK_BUFFER, buffer);
        read
    }
}

#[track_caller]
fn assert_same(before: &State, after: &State, when: &str) {
    let said = |state: &State, name| state.get(name).cloned().unwrap_or("nothing".into());
    let names: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let changed: Vec<String> = names
        .into_iter()
        .filter(|name| before.get(*name) != after.get(*name))
        .map(|name| format!("{name} was {} and is {}", said(before, name), said(after, name)))
        .collect();
    assert!(changed.is_empty(), "{when}: {}", changed.join("; "));
}

fn settings() -> Settings {
    Settings { ao_format: AoFormat::R8, ..rig::float_settings(2.0) }
}

#[test]
fn what_the_sweep_finds_is_what_the_specification_lists() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let state = Reporter::new(&context).state();
    // The list has one name of each table in chapter 6.2 of the specification, and of each getter.
    for name in [
        "VIEWPORT",
        "PROVOKING_VERTEX",
        "PRIMITIVE_RESTART_INDEX",
        "CLAMP_READ_COLOR",
        "POINT_FADE_THRESHOLD_SIZE",
        "TEXTURE_CUBE_MAP_SEAMLESS is on",
        "CLIP_DISTANCE7 is on",
        "SAMPLE_MASK_VALUE[0]",
        "BLEND[7]",
        "COLOR_WRITEMASK[7]",
        "DRAW_BUFFER7",
        "UNIFORM_BUFFER_BINDING[5]",
        "UNIFORM_BUFFER_START[0]",
        "TRANSFORM_FEEDBACK_BUFFER_SIZE[3]",
        "TEXTURE_BINDING_2D_MULTISAMPLE_ARRAY of unit 47",
        "SAMPLER_BINDING of unit 4",
        "CURRENT_VERTEX_ATTRIB of attribute 15",
        "VERTEX_ATTRIB_ARRAY_DIVISOR of attribute 0",
        "pointer of attribute 2",
        "CURRENT_QUERY of TIME_ELAPSED",
        "UNPACK_SKIP_IMAGES",
        "PACK_LSB_FIRST",
        "COPY_WRITE_BUFFER",
    ] {
        assert!(state.contains_key(name), "{name}: {:?}", state.keys().collect::<Vec<_>>());
    }
}

#[test]
fn all_state_is_put_back_and_none_shows_in_the_result() {
    // The second settings have one more pass and texture unit. The third have targets of three sizes.
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
            let others = Textures::new(gl, &view, target, NormalEncoding::Signed);
            let (reporter, before) = unusual_state(&context);
            let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), settings).unwrap();
            assert_same(&before, &reporter.state(), "new");
            let visibility = ao.render(&textures.inputs).unwrap();
            assert_same(&before, &reporter.state(), "the first run, which compiles");
            let visibility_again = ao.render(&textures.inputs).unwrap();
            assert_same(&before, &reporter.state(), "the second run");
            assert_eq!(visibility, visibility_again);
            let got = read_red_undisturbed(gl, visibility, view.depth.texels.len());
            assert_eq!(got, expected.texels, "{}, {target:?}", backend.name());
            assert_same(&before, &reporter.state(), "reading");
            for write in
                [Write::Visibility, Write::Multiplied(0.5), Write::MultipliedByShare(textures.inputs.normals.unwrap())]
            {
                let to = Destination::Texture(others.inputs.normals.unwrap());
                ao.render_into(&textures.inputs, &Output::new(to, write)).unwrap();
                assert_same(&before, &reporter.state(), "writing to an image");
            }
            let other = Settings { half_res: !settings.half_res, jitter: Jitter::None, ..settings.clone() };
            assert!(ao.set(&other).unwrap());
            assert_same(&before, &reporter.state(), "other settings");
            ao.resize((SIZE.0 / 2, SIZE.1)).unwrap();
            assert_same(&before, &reporter.state(), "another size");
            drop(ao);
            assert_same(&before, &reporter.state(), "drop");
        }
    }
}

/// Here edges are marked in the stencil buffer, and the blur reads multisample textures.
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
        let (reporter, before) = unusual_state(&context);
        let mut ao = AmbientOcclusion::new(gl.clone(), rig::SIZE, &settings).unwrap();
        let visibility = ao.render(&pipeline.inputs(&camera)).unwrap();
        assert_same(&before, &reporter.state(), "a run with samples");
        let got = read_red_undisturbed(gl, visibility, expected.texels.len());
        assert_eq!(got, expected.texels, "{}", backend.name());
    }
}

#[test]
fn all_state_is_put_back_with_images_in_memory_too() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let view = view();
        let expected = view.by_shader(gl, &settings());
        let linear = view.depth.map(|z| z.min(BACKGROUND_R32F));
        let depth_encoding = DepthEncoding::reversed(0.1, f64::INFINITY);
        let stored = view.depth.map(|z| 0.1 / z);
        let (reporter, before) = unusual_state(&context);
        let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
        let textures = [&linear, &stored].map(|depth| InputTextures::new(gl, depth, Some(&view.normals)).unwrap());
        assert_same(&before, &reporter.state(), "new");
        ao.render(&textures[0].inputs(view.projection)).unwrap();
        assert_eq!(ao.image().unwrap(), expected, "{}", backend.name());
        assert!(ao.linear_depth_image().unwrap().is_none());
        ao.render(&Inputs { depth_encoding, ..textures[1].inputs(view.projection) }).unwrap();
        let made = ao.linear_depth_image().unwrap().unwrap();
        let off = made.texels.iter().zip(&linear.texels).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f32::max);
        assert!(off < 1e-6, "{off}");
        assert_same(&before, &reporter.state(), "images read back");
        let other = view.normals.part((0, 0), (3, 4));
        let refused = InputTextures::new(gl, &linear, Some(&other)).err().unwrap().to_string();
        assert!(refused.contains("normals of 3x4 pixels do not fit depth of 37x23"), "{refused}");
        drop(textures);
        assert_same(&before, &reporter.state(), "drop");
    }
}

/// Here depth is in a layer of an array, and three more passes run: two that prepare the inputs, and the one that
/// `diagnose` draws.
#[test]
fn all_state_is_put_back_with_hardware_depth_in_an_array_too() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let view = view();
        let depth_encoding = DepthEncoding::standard(0.1, 100.0);
        let stored = Stored::new(gl, &view, depth_encoding, Depths::Bits24AndStencil, TextureTarget::Layer(1));
        let textures = Textures::new(gl, &view, TextureTarget::Texture2d, NormalEncoding::Signed);
        let inputs = Inputs { depth: stored.image, depth_encoding, normals: None, ..textures.inputs };
        let expected = {
            let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
            let visibility = ao.render(&inputs).unwrap();
            read_red(gl, visibility, view.depth.texels.len())
        };
        let (reporter, before) = unusual_state(&context);
        let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
        for when in ["the first run", "the second run"] {
            let visibility = ao.render(&inputs).unwrap();
            assert_same(&before, &reporter.state(), when);
            assert_eq!(read_red_undisturbed(gl, visibility, expected.len()), expected, "{}", backend.name());
        }
        ao.diagnose(&inputs).unwrap();
        assert_same(&before, &reporter.state(), "diagnose");
        ao.diagnose(&textures.inputs).unwrap();
        assert_same(&before, &reporter.state(), "diagnose, with normals");
        ao.render(&Inputs { depth_encoding: DepthEncoding::standard(2.0, 1.0), ..inputs }).unwrap_err();
        assert_same(&before, &reporter.state(), "refused");
        drop(ao);
        assert_same(&before, &reporter.state(), "drop");
    }
}

/// If the caller's pack parameters were used, the values read back would be wrong, or written past the end of the
/// buffer.
#[test]
fn formats_are_tried_whatever_the_caller_packs() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let (gl, reporter) = (context.gl(), Reporter::new(&context));
    let expected = Format::ALL.map(|(format, _)| format_renders(gl, format).unwrap());
    assert!(expected.contains(&true));
    // SAFETY: the context is current, and the caller reads nothing.
    unsafe {
        gl.pixel_store_i32(glow::PACK_SKIP_PIXELS, 100_000);
        gl.pixel_store_i32(glow::PACK_ROW_LENGTH, 77);
        gl.bind_buffer(glow::PIXEL_PACK_BUFFER, Some(gl.create_buffer().unwrap()));
    }
    let packing = || -> State { reporter.state().into_iter().filter(|(name, _)| name.contains("PACK")).collect() };
    let before = packing();
    assert_eq!(Format::ALL.map(|(format, _)| format_renders(gl, format).unwrap()), expected);
    assert!(before.len() > 4);
    assert_same(&before, &packing(), "format_renders");
}

#[test]
fn limits_are_asked_for_without_a_trace() {
    let context = Context::open(rig::BOTH[1]).unwrap();
    let (reporter, before) = unusual_state(&context);
    assert!(size_limit(context.gl()) >= 1024);
    check_size(context.gl(), 64, 64).unwrap();
    check_size(context.gl(), 0, 64).unwrap_err();
    assert_same(&before, &reporter.state(), "check_size");
}

/// OpenGL reports the stencil reference clamped to the range of the framebuffer's stencil buffer. If there is no such
/// buffer, it does not report the value that was set.
#[test]
fn a_stencil_reference_outlives_a_framebuffer_without_stencil() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let view = view();
        let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let (reporter, before) = unusual_state(&context);
        assert_eq!([&before["STENCIL_REF"], &before["STENCIL_BACK_REF"]], ["[3.0]", "[5.0]"]);
        // SAFETY: the context is current.
        let framebuffer = unsafe {
            let framebuffer = gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING);
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(gl.create_framebuffer().unwrap()));
            framebuffer
        };
        assert_eq!(reporter.state()["STENCIL_REF"], "[0.0]");
        let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
        ao.render(&textures.inputs).unwrap();
        drop(ao);
        // SAFETY: as above.
        unsafe { gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, framebuffer) };
        assert_same(&before, &reporter.state(), backend.name());
    }
}

/// A render that is refused returns early, on other paths than one that succeeds.
#[test]
fn state_is_put_back_after_an_error_too() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let gl = context.gl();
    let view = view();
    let mut textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let (reporter, before) = unusual_state(&context);
    let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
    // A rectangle texture is declared as two-dimensional.
    textures.inputs.depth.target = TextureTarget::Texture2d;
    let error = ao.render(&textures.inputs).unwrap_err();
    assert!(error.to_string().contains("invalid operation"), "{error}");
    assert_same(&before, &reporter.state(), "a refused texture");
    textures.inputs.depth.target = TextureTarget::Rectangle;
    ao.render(&textures.inputs).unwrap();
    assert!(AmbientOcclusion::new(gl.clone(), (0, 1), &settings()).is_err());
    assert_same(&before, &reporter.state(), "a refused size");
    textures.inputs.projection = Projection::Orthographic(Extents::centred(0.0, 1.0));
    assert!(ao.render(&textures.inputs).is_err());
    assert_same(&before, &reporter.state(), "a refused projection");
}

/// OpenGL 3.3 cannot pause transform feedback, and while it is active it refuses another program. The passes would draw
/// with the caller's program.
#[test]
fn transform_feedback_under_way_is_refused_and_goes_on() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let view = view();
        let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
        let query = unusual::capture(gl);
        let reporter = Reporter::new(&context);
        // SAFETY: the context is current; the program and the buffer of `capture` are bound.
        unsafe { gl.begin_transform_feedback(glow::TRIANGLES) };
        let before = reporter.state();
        for error in
            [ao.render(&textures.inputs).unwrap_err(), made(AmbientOcclusion::new(gl.clone(), (8, 8), &settings()))]
        {
            assert!(error.to_string().contains("transform feedback is active"), "{error}");
        }
        assert_same(&before, &reporter.state(), "refused");
        // SAFETY: as above.
        let captured = unsafe {
            gl.end_transform_feedback();
            gl.end_query(glow::TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN);
            gl.get_query_parameter_u32(query, glow::QUERY_RESULT)
        };
        assert_eq!(captured, 0, "{}", backend.name());
        let visibility = ao.render(&textures.inputs).unwrap();
        let expected = view.by_shader(gl, &settings());
        assert_eq!(read_red(gl, visibility, expected.texels.len()), expected.texels);
    }
}

/// A deleted program ceases to exist when another one is put in use, so it cannot be restored. The result must still be
/// correct.
#[test]
fn a_program_that_was_deleted_while_in_use_is_no_error() {
    let context = Context::open(rig::BOTH[0]).unwrap();
    let (gl, view) = (context.gl(), view());
    let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let expected = view.by_shader(gl, &settings());
    unusual::capture(gl);
    // SAFETY: the context is current, here and below.
    unsafe { gl.delete_program(gl.get_parameter_program(glow::CURRENT_PROGRAM).unwrap()) };
    let mut ao = AmbientOcclusion::new(gl.clone(), view.size(), &settings()).unwrap();
    assert_eq!(textures.visibility(&mut ao, &view), expected);
    // SAFETY: as above.
    unsafe { assert_eq!((gl.get_parameter_program(glow::CURRENT_PROGRAM), gl.get_error()), (None, glow::NO_ERROR)) };
}

fn made(result: Result<AmbientOcclusion, Error>) -> Error {
    result.err().expect("an error")
}
