//! Two promises about drivers: the library needs no more than OpenGL 3.3 core, and the same input gives the same image.

mod rig;
#[path = "drivers/table.rs"]
mod table;

use gl_generator::{Api, Fallbacks, Profile, Registry};
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::scene::Projection;
use hbao::settings::{KNOBS, Kind, Radius};
use hbao::{Apply, Pipeline, Request, Settings};
use rig::process::in_own_process;
use rig::{Frame, SIZE, Shot, assert_identical, every_switch, scenes, twin};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::sync::{Arc, OnceLock};

/// The Cornell box, in perspective for even numbers and orthographic for odd ones.
fn shot(i: usize) -> Shot {
    let shot = scenes::cornell_box();
    if i.is_multiple_of(2) { shot } else { shot.orthographic() }
}

/// Renders every image of the box, with every switch.
fn frames(gl: &Arc<glow::Context>, timings: bool) -> Vec<Frame> {
    let of = |(i, settings): (usize, &Settings)| {
        let composite = Some(if i.is_multiple_of(3) { Apply::Ambient } else { Apply::All });
        let request = Request { composite, raw: true, edges: true, timings, ..Request::default() };
        let mut pipeline = Pipeline::new(gl, SIZE, settings, request).unwrap();
        rig::frame(&mut pipeline, &shot(i), SIZE, settings)
    };
    every_switch().iter().enumerate().map(of).collect()
}

/// The frames that all others are compared with. They are rendered once, by one thread, in an EGL context that nothing
/// else has used.
fn expected() -> &'static [Frame] {
    static EXPECTED: OnceLock<Vec<Frame>> = OnceLock::new();
    EXPECTED.get_or_init(|| {
        // A new thread is used because the caller's thread may already have a context.
        std::thread::scope(|scope| {
            scope.spawn(|| frames(Context::open(Backend::Egl).unwrap().gl(), false)).join().unwrap()
        })
    })
}

fn assert_as_expected(got: &[Frame], context: &str) {
    assert_eq!(got.len(), expected().len());
    for (i, (got, expected)) in got.iter().zip(expected()).enumerate() {
        assert_identical(got, expected, &format!("{context}, settings {i}"));
        // Empty images would be identical too.
        let least = got.ao.texels.iter().copied().fold(1.0, f32::min);
        let open = !rig::computes(every_switch()[i].method);
        assert!(least < 0.9 || open, "settings {i}: no pixel is darker than {least}");
    }
}

#[test]
fn the_settings_used_here_cover_every_switch() {
    for knob in KNOBS {
        let values: Vec<String> = match knob.kind {
            Kind::Word(names) => names.iter().map(|&name| name.into()).collect(),
            Kind::OneOf(numbers) => numbers.iter().map(u32::to_string).collect(),
            Kind::Switch => vec!["false".into(), "true".into()],
            _ => continue,
        };
        // A setting without a value of its own has an empty text.
        let used = every_switch().into_iter().map(|settings| knob.text(&settings)).filter(|text| !text.is_empty());
        let used: BTreeSet<String> = used.collect();
        assert_eq!(used, values.into_iter().collect(), "{}", knob.name);
    }
    let shots = (0..every_switch().len()).map(shot);
    let perspective = |shot: &Shot| matches!(shot.camera(SIZE).projection, Projection::Perspective { .. });
    assert_eq!(shots.filter(perspective).count(), every_switch().len().div_ceil(2));
}

/// Drivers give OpenGL 4.5 when they are asked for 3.3, so only this test notices the use of a later entry point. glow
/// panics if an entry point is called that was not loaded.
#[test]
fn the_entry_points_of_opengl_3_3_core_suffice() {
    let core = Registry::new(Api::Gl, (3, 3), Profile::Core, Fallbacks::None, []);
    let names: BTreeSet<String> = core.cmds.iter().map(|command| format!("gl{}", command.proto.ident)).collect();
    assert!(names.contains("glSamplerParameteri") && !names.contains("glDispatchCompute"));
    assert!(!names.contains("glTexStorage2D") && !names.contains("glBegin"));
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        // SAFETY: the context is current on this thread, and the entry points are its own.
        let only_core = unsafe {
            glow::Context::from_loader_function_cstr(|name| match name.to_str() {
                Ok(text) if names.contains(text) => context.get_proc_address(name),
                _ => std::ptr::null(),
            })
        };
        let only_core = Arc::new(only_core);
        assert_as_expected(&frames(&only_core, true), backend.name());
        named_where_possible(&context, &only_core, &names);
    }
}

/// The driver has debug groups, and its extension string says so. A loader of OpenGL 3.3 alone does not have them, and
/// then the passes have no names.
fn named_where_possible(context: &Context, only_core: &Arc<glow::Context>, names: &BTreeSet<String>) {
    let view = rig::by_hand::rubble((9, 9), rig::by_hand::perspective(60.0, (9, 9)), 3, 1.0..2.0);
    let (target, encoding) = (hbao::TextureTarget::Rectangle, hbao::NormalEncoding::Signed);
    let textures = rig::by_hand::Textures::new(context.gl(), &view, target, encoding);
    let mut ao = hbao::AmbientOcclusion::new(only_core.clone(), (9, 9), &rig::float_settings(1.0)).unwrap();
    assert!(only_core.supports_debug(), "this driver cannot show the difference");
    let of_core = |name: &std::ffi::CStr| match name.to_str() {
        Ok(text) if names.contains(text) => context.get_proc_address(name),
        _ => std::ptr::null(),
    };
    // SAFETY: the addresses are the context's own.
    assert!(unsafe { !ao.name_passes(of_core) });
    textures.visibility(&mut ao, &view);
    // SAFETY: as above.
    assert!(unsafe { ao.name_passes(|name| context.get_proc_address(name)) });
    textures.visibility(&mut ao, &view);
}

#[test]
fn a_later_entry_point_would_be_noticed() {
    let context = Context::open(Backend::Osmesa).unwrap();
    // SAFETY: the context is current on this thread, and the entry points are its own.
    let without = unsafe {
        glow::Context::from_loader_function_cstr(|name| match name.to_bytes() {
            b"glTexStorage2D" => std::ptr::null(),
            _ => context.get_proc_address(name),
        })
    };
    let call = std::panic::AssertUnwindSafe(|| {
        // SAFETY: nothing is called, because the entry point was not loaded.
        unsafe { without.tex_storage_2d(glow::TEXTURE_2D, 1, glow::RGBA8, 1, 1) }
    });
    assert!(std::panic::catch_unwind(call).is_err());
}

#[test]
fn egl_and_osmesa_give_the_same_bits() {
    assert_as_expected(&frames(Context::open(Backend::Osmesa).unwrap().gl(), false), "osmesa");
}

#[test]
fn every_run_gives_the_same_bits() {
    let context = Context::open(Backend::Egl).unwrap();
    assert_as_expected(&frames(context.gl(), false), "in a new context");
    assert_as_expected(&frames(context.gl(), true), "again, timed");
    drop(context);

    // One pipeline also gives the same bits again after it has rendered something else in between.
    let context = Context::open(Backend::Egl).unwrap();
    let settings = &every_switch()[0];
    let request = Request { composite: Some(Apply::All), raw: true, edges: true, ..Request::default() };
    let mut pipeline = Pipeline::new(context.gl(), SIZE, settings, request).unwrap();
    let once = rig::frame(&mut pipeline, &scenes::cornell_box(), SIZE, settings);
    rig::frame(&mut pipeline, &scenes::cornell_box().orthographic(), SIZE, settings);
    let again = rig::frame(&mut pipeline, &scenes::cornell_box(), SIZE, settings);
    assert_identical(&again, &once, "the same pipeline");
}

#[test]
fn four_threads_with_a_context_each_give_the_same_bits() {
    std::thread::scope(|scope| {
        for backend in [Backend::Egl, Backend::Osmesa, Backend::Egl, Backend::Osmesa] {
            scope.spawn(move || {
                let context = Context::open(backend).unwrap();
                assert_as_expected(&frames(context.gl(), false), backend.name());
            });
        }
    });
}

#[test]
fn softpipe_falls_back_from_signed_normals_and_matches_the_twins() {
    let environment = [("GALLIUM_DRIVER", OsStr::new("softpipe"))];
    in_own_process("softpipe_falls_back_from_signed_normals_and_matches_the_twins", &environment, || {
        const SIZE: (u32, u32) = (48, 36);
        let context = Context::open(Backend::Osmesa).unwrap();
        assert!(context.describe().contains("softpipe"), "{}", context.describe());
        for shot in [scenes::cornell_box(), scenes::box_on_a_floor(), Shot::orthographic(scenes::ball())] {
            let settings = Settings { radius: Radius::Units(shot.radius), ..Settings::default() };
            let frame = rig::render(context.gl(), &shot, SIZE, &settings);
            let notice = "this driver does not render normals in rgba8-snorm: rgba16f is used";
            assert_eq!(frame.notices, [notice]);
            let text = format!("softpipe, {}", shot.name);
            twin::hold_gbuffer(&frame, &shot, SIZE, &settings, &text);
            twin::hold_raw(&frame, &settings, &text);
            twin::hold_blur(&frame, &settings, &text);
        }
    });
}

/// softpipe unrolls loops over directions whatever they contain. It overflowed its stack at 31 directions of 32 steps.
#[test]
fn softpipe_takes_as_many_directions_and_steps_as_it_unrolls() {
    let environment = [("GALLIUM_DRIVER", OsStr::new("softpipe"))];
    in_own_process("softpipe_takes_as_many_directions_and_steps_as_it_unrolls", &environment, || {
        let context = Context::open(Backend::Osmesa).unwrap();
        let shot = scenes::box_on_a_floor();
        for (directions, steps) in [(32, 32), (31, 32), (28, 32), (32, 28), (33, 32)] {
            let settings = Settings { directions, steps, blur: 0, ..rig::float_settings(20.0 * shot.radius) };
            let frame = rig::render(context.gl(), &shot, (16, 12), &settings);
            twin::hold_raw(&frame, &settings, &format!("softpipe, {directions} x {steps}"));
            assert!(frame.raw.texels.iter().any(|&a| a < 0.9), "every pixel returns early");
        }
    });
}

/// `cargo test --test drivers -- --nocapture drivers_differ` prints the table of `src/measure/drivers.md`.
#[test]
fn drivers_differ_by_what_is_known_and_each_matches_its_twins() {
    let Some(all) = table::compared("drivers_differ_by_what_is_known_and_each_matches_its_twins") else { return };
    println!("\n{}", table::table(&all));
    let mut complaints = Vec::new();
    for (driver, found) in &all {
        match found {
            Some(found) => complaints.extend(driver.complaints(found)),
            None => rig::process::skip(driver.name, "mesa-vulkan-drivers"),
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn one_texel_that_differs_is_found_and_held_against_a_driver() {
    table::find_a_planted_difference();
}
