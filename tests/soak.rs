//! Tests of long use: thousands of renders, hundreds of contexts and many threads. No memory and no OpenGL object may
//! be left behind, and no image may change.

mod rig;

use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::scene::Camera;
use hbao::settings::{AoFormat, BlurKernel, DepthFormat, Method, Radius, SsaoDepth};
use hbao::{AmbientOcclusion, Apply, Inputs, NormalEncoding, Pipeline, Request, Settings, TextureRef, TextureTarget};
use rig::by_hand::{ByHand, Textures, orthographic, pit};
use rig::process::{in_own_process, resident};
use rig::{Frame, Shot, assert_identical, scenes};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::sync::Barrier;

const SIZE: (u32, u32) = (48, 37);

/// Only object names below this number are checked. OpenGL would have to use all of them before it gave an object a
/// larger one.
const NAMES: u32 = 4096;

/// Counts the objects of each kind that are alive in the context. This shows a single leaked object, which memory
/// hardly shows.
fn objects(context: &Context) -> BTreeMap<&'static str, usize> {
    // A deleted program stays alive while it is in use, and a pipeline leaves its last program in use.
    // SAFETY: the context is current.
    unsafe { context.gl().use_program(None) };
    const KINDS: [(&str, &std::ffi::CStr); 9] = [
        ("textures", c"glIsTexture"),
        ("buffers", c"glIsBuffer"),
        ("framebuffers", c"glIsFramebuffer"),
        ("renderbuffers", c"glIsRenderbuffer"),
        ("programs", c"glIsProgram"),
        ("shaders", c"glIsShader"),
        ("queries", c"glIsQuery"),
        ("vertex arrays", c"glIsVertexArray"),
        ("samplers", c"glIsSampler"),
    ];
    let count = |(kind, function): (&'static str, &std::ffi::CStr)| {
        let address = context.get_proc_address(function);
        assert!(!address.is_null(), "{function:?}");
        type Is = unsafe extern "system" fn(u32) -> u8;
        // SAFETY: this is the function's address, and this is its signature in OpenGL 3.3.
        let is = unsafe { std::mem::transmute::<*const std::ffi::c_void, Is>(address) };
        // SAFETY: the context is current, and every name may be given to this function.
        let alive: Vec<u32> = (1..NAMES).filter(|&name| unsafe { is(name) } != 0).collect();
        assert!(alive.last().is_none_or(|&last| last < NAMES / 2), "{kind} up to {alive:?}");
        (kind, alive.len())
    };
    KINDS.into_iter().map(count).collect()
}

/// Settings whose pipelines differ in their passes and textures.
fn different() -> Vec<Settings> {
    let of = |method, radius| Settings { radius: Radius::Units(radius), ..Settings::for_method(method) };
    vec![
        of(Method::Hbao, 0.8),
        Settings { half_res: true, blur_kernel: BlurKernel::Full, blur: 5, ..of(Method::Hbao, 1.5) },
        Settings { msaa: 1, ao_format: AoFormat::R32f, directions: 3, ..of(Method::HbaoTalk, 0.8) },
        Settings { ssao_depth: SsaoDepth::Half, msaa: 1, ..of(Method::Ssao, 0.5) },
        Settings { blur: 0, msaa: 1, directions: 2, steps: 2, ..of(Method::RayMarch, 0.5) },
    ]
}

/// A request for all images.
fn everything() -> Request {
    Request { composite: Some(Apply::All), raw: true, edges: true, ..Request::default() }
}

fn shots() -> Vec<Shot> {
    vec![scenes::ball(), scenes::pole(), scenes::box_on_a_floor()]
}

/// With one thread that draws, memory does not depend on the scheduler. Shaders are loaded from a cache on the disk.
#[cfg(target_os = "linux")]
fn environment() -> [(&'static str, &'static OsStr); 3] {
    [
        ("LP_NUM_THREADS", OsStr::new("1")),
        ("MESA_SHADER_CACHE_DISABLE", OsStr::new("false")),
        ("MESA_SHADER_CACHE_DIR", OsStr::new(env!("CARGO_TARGET_TMPDIR"))),
    ]
}

/// Pipelines and `AmbientOcclusion` render in turns, with each backend. The measured growth is from -164 to 124 KiB.
/// With a planted leak, the two buffers and the vertex array of each mesh that is drawn, it is 6508 KiB.
#[cfg(target_os = "linux")]
#[test]
fn a_thousand_renders_leave_no_memory_and_no_object_behind() {
    in_own_process("a_thousand_renders_leave_no_memory_and_no_object_behind", &environment(), || {
        for backend in rig::BOTH {
            render_a_thousand_times(&Context::open(backend).unwrap());
        }
    });
}

#[cfg(target_os = "linux")]
fn render_a_thousand_times(context: &Context) {
    let (gl, none) = (context.gl(), objects(context));
    let settings = different();
    let mut pipelines: Vec<Pipeline> =
        settings.iter().map(|settings| Pipeline::new(gl, SIZE, settings, everything()).unwrap()).collect();
    let mut faces: Vec<AmbientOcclusion> =
        settings.iter().map(|settings| AmbientOcclusion::new(gl.clone(), SIZE, settings).unwrap()).collect();
    let shots = shots();
    let mut renders = 0;
    let mut darkest = 1.0f32;
    let mut round = |turn: usize| {
        let shot = &shots[turn % shots.len()];
        for (pipeline, face) in pipelines.iter_mut().zip(&mut faces) {
            let mut camera = shot.camera(SIZE);
            camera.far *= 1.0 + turn as f64 / 100.0;
            pipeline.render(&shot.mesh, &camera).unwrap();
            darkest = pipeline.ao().unwrap().texels.iter().copied().fold(darkest, f32::min);
            let visibility = face.render(&pipeline.inputs(&camera)).unwrap();
            // SAFETY: the context is current.
            assert!(unsafe { gl.is_texture(visibility.texture) });
            renders += 2;
        }
    };
    (0..20).for_each(&mut round);
    let (before, held) = (resident(), objects(context));
    (20..120).for_each(&mut round);
    let growth = resident() - before;
    println!("{}: {growth} KiB more after 1,000 renders", context.backend().name());
    assert!(growth < 1024, "{growth} KiB more after 1,000 renders");
    assert_eq!(objects(context), held);
    assert!(renders == 1200 && darkest < 0.8, "{renders} renders, none darker than {darkest}");
    drop((pipelines, faces));
    assert_eq!(objects(context), none);
}

/// The measured growth is 0 to 132 KiB. With a planted leak of each context's `glow::Context`, it is 640 KiB with EGL
/// and 2020 KiB with OSMesa.
#[cfg(target_os = "linux")]
#[test]
fn two_hundred_contexts_with_a_pipeline_each_leave_no_memory_behind() {
    in_own_process("two_hundred_contexts_with_a_pipeline_each_leave_no_memory_behind", &environment(), || {
        let shot = scenes::ball();
        let settings = Settings {
            radius: Radius::Units(shot.radius),
            msaa: 1,
            directions: 2,
            steps: 2,
            blur: 3,
            ..Settings::default()
        };
        for backend in rig::BOTH {
            let mut expected = None;
            let mut cycle = || {
                let context = Context::open(backend).unwrap();
                let mut pipeline = Pipeline::new(context.gl(), (16, 12), &settings, Request::default()).unwrap();
                pipeline.render(&shot.mesh, &shot.camera((16, 12))).unwrap();
                let ao = pipeline.ao().unwrap();
                assert_eq!(expected.get_or_insert_with(|| ao.clone()), &ao);
            };
            (0..20).for_each(|_| cycle());
            let before = resident();
            (0..200).for_each(|_| cycle());
            let growth = resident() - before;
            println!("{}: {growth} KiB more after 200 contexts", backend.name());
            assert!(growth < 400, "{}: {growth} KiB more after 200 contexts", backend.name());
        }
    });
}

#[test]
fn every_object_goes_with_its_pipeline() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let (gl, shot) = (context.gl(), scenes::ball());
        let before = objects(&context);
        for settings in different() {
            for request in [everything(), Request { gbuffer_only: true, timings: true, ..Request::default() }] {
                let mut pipeline = Pipeline::new(gl, SIZE, &settings, request).unwrap();
                let made = objects(&context);
                assert!(
                    made["textures"] >= before["textures"] + 2 && made["samplers"] > before["samplers"],
                    "{made:?}"
                );
                // Perspective and orthographic cameras need different programs.
                for shot in [shot.clone(), shot.clone().orthographic()] {
                    pipeline.render(&shot.mesh, &shot.camera(SIZE)).unwrap();
                }
                pipeline.depth_samples().unwrap();
                drop(pipeline);
                assert_eq!(objects(&context), before, "{}", settings.to_toml());
            }
        }
    }
}

/// A render may fail in two ways. Neither leaves anything behind, and the next render gives the same image as without
/// it.
#[test]
fn a_render_that_failed_leaves_nothing_behind() {
    let context = Context::open(Backend::Egl).unwrap();
    let (gl, shot) = (context.gl(), scenes::ball());
    let before = objects(&context);
    let settings = Settings {
        radius: Radius::Units(shot.radius),
        depth_format: DepthFormat::R16f,
        method: Method::RayMarch,
        ..Settings::default()
    };
    let near = shot.camera(SIZE);
    let far = Camera { far: 1e5, ..near };
    let expected = rig::render(gl, &shot, SIZE, &settings);
    let mut pipeline = Pipeline::new(gl, SIZE, &settings, everything()).unwrap();
    assert!(pipeline.render(&shot.mesh, &far).is_err());
    assert_identical(&rig::frame(&mut pipeline, &shot, SIZE, &settings), &expected, "after one that failed");

    // The render fails in two ways: the texture is not of the declared kind, or the view's near plane is invalid.
    let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings).unwrap();
    let inputs = pipeline.inputs(&near);
    let other_kind = inputs.normals.map(|normals| TextureRef { target: TextureTarget::Texture2d, ..normals });
    let wrong = [Inputs { near: 0.0, ..inputs }, Inputs { normals: other_kind, ..inputs }];
    for _ in 0..2 {
        assert!(wrong.iter().all(|inputs| ao.render(inputs).is_err()));
        ao.render(&inputs).unwrap();
    }
    assert!(wrong.iter().all(|inputs| ao.render(inputs).is_err()));
    drop((ao, pipeline));
    assert_eq!(objects(&context), before);
}

/// The result is still bound to a unit and to the application's framebuffer when it is dropped, and other objects go on
/// rendering.
#[test]
fn what_is_dropped_in_use_is_gone_and_the_rest_goes_on() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let none = objects(&context);
        let view: ByHand = pit(3.0);
        assert_eq!(view.projection, orthographic(1.0, view.size()));
        let settings = Settings { radius: Radius::Units(9.0), ..rig::float_settings(9.0) };
        let textures = Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let [mut first, mut second, mut third] =
            [(); 3].map(|()| AmbientOcclusion::new(gl.clone(), view.size(), &settings).unwrap());
        let expected = textures.visibility(&mut first, &view);
        let visibility = first.render(&textures.inputs).unwrap();
        assert_eq!(textures.visibility(&mut second, &view), expected);
        // SAFETY: the context is current.
        let framebuffer = unsafe {
            gl.active_texture(glow::TEXTURE0 + 9);
            gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(visibility.texture));
            let framebuffer = gl.create_framebuffer().unwrap();
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            let place = (glow::COLOR_ATTACHMENT0, glow::TEXTURE_RECTANGLE);
            gl.framebuffer_texture_2d(glow::FRAMEBUFFER, place.0, place.1, Some(visibility.texture), 0);
            framebuffer
        };
        drop(first);
        // SAFETY: as above.
        unsafe {
            assert_eq!(gl.get_parameter_texture(glow::TEXTURE_BINDING_RECTANGLE), None);
            assert_eq!(gl.get_parameter_framebuffer(glow::FRAMEBUFFER_BINDING), Some(framebuffer));
            assert!(!gl.is_texture(visibility.texture));
        }
        assert_eq!(textures.visibility(&mut third, &view), expected);
        drop(second);
        assert_eq!(textures.visibility(&mut third, &view), expected);
        // The inputs are dropped before the object that has used them.
        drop(textures);
        drop(third);
        // SAFETY: as above.
        unsafe {
            gl.delete_framebuffer(framebuffer);
            assert_eq!(gl.get_error(), glow::NO_ERROR);
        }
        assert_eq!(objects(&context), none);
    }
}

#[test]
fn eight_threads_at_once_render_what_each_renders_alone() {
    let settings = different();
    let render = |thread: usize| -> Frame {
        let shot = shots().swap_remove(thread % 3);
        let context = Context::open(rig::BOTH[thread % 2]).unwrap();
        rig::render(context.gl(), &shot, SIZE, &settings[thread % settings.len()])
    };
    let alone: Vec<Frame> = (0..8).map(render).collect();
    let barrier = Barrier::new(8);
    std::thread::scope(|scope| {
        for (thread, expected) in alone.iter().enumerate() {
            let (barrier, settings) = (&barrier, &settings);
            scope.spawn(move || {
                let shot = shots().swap_remove(thread % 3);
                let context = Context::open(rig::BOTH[thread % 2]);
                barrier.wait(); // all threads have tried to open a context by now
                let context = context.unwrap();
                let settings = &settings[thread % settings.len()];
                for turn in 0..2 {
                    // The shaders are compiled again while other threads draw.
                    let frame = rig::render(context.gl(), &shot, SIZE, settings);
                    assert_identical(&frame, expected, &format!("thread {thread}, turn {turn}"));
                }
            });
        }
    });
    // Different threads must have made different images.
    assert!(alone[0].ao != alone[1].ao && alone[1].ao != alone[2].ao);
}
