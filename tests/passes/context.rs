//! Tests what `hbao::context` promises: contexts of either library, one per thread, and errors if there is none.
//!
//! Both libraries must be installed (Debian: libegl1 libgl1-mesa-dri libosmesa6). Tests that depend on the environment
//! or that measure the process run in a child process, which is this program again, told to run one test.

use crate::rig::process::{in_own_process, resident};
use glow::HasContext as _;
use hbao::Error;
use hbao::context::{Backend, Context};
use std::ffi::OsStr;

const BOTH: [Backend; 2] = [Backend::Egl, Backend::Osmesa];

/// Clears a framebuffer object of 8 x 8 texels to `colour` and asserts that every texel reads back exactly.
fn assert_clears_to(context: &Context, colour: [u8; 4]) {
    const SIZE: i32 = 8;
    let gl = context.gl();
    let mut texels = vec![0; (4 * SIZE * SIZE) as usize];
    // SAFETY: the context is current on this thread, and the vector holds SIZE x SIZE texels of four bytes.
    unsafe {
        let buffer = gl.create_renderbuffer().unwrap();
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(buffer));
        gl.renderbuffer_storage(glow::RENDERBUFFER, glow::RGBA8, SIZE, SIZE);
        let framebuffer = gl.create_framebuffer().unwrap();
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
        gl.framebuffer_renderbuffer(glow::FRAMEBUFFER, glow::COLOR_ATTACHMENT0, glow::RENDERBUFFER, Some(buffer));
        assert_eq!(gl.check_framebuffer_status(glow::FRAMEBUFFER), glow::FRAMEBUFFER_COMPLETE);
        let [r, g, b, a] = colour.map(|byte| f32::from(byte) / 255.0);
        gl.clear_color(r, g, b, a);
        gl.clear(glow::COLOR_BUFFER_BIT);
        let into = glow::PixelPackData::Slice(Some(&mut texels));
        gl.read_pixels(0, 0, SIZE, SIZE, glow::RGBA, glow::UNSIGNED_BYTE, into);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        gl.delete_framebuffer(framebuffer);
        gl.delete_renderbuffer(buffer);
    }
    assert!(texels.chunks(4).all(|texel| texel == colour), "{}: not {colour:?} everywhere", context.describe());
}

/// Asserts that `result` is an [`Error::Context`] with a one-line message that contains each of `parts`.
fn assert_context_error(result: Result<Context, Error>, parts: &[&str]) {
    let error = result.unwrap_err();
    assert!(matches!(error, Error::Context(_)), "{error:?}");
    let message = error.to_string();
    assert!(!message.contains('\n'), "not one line: {message}");
    for part in parts {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
}

#[test]
fn each_backend_opens_core_3_3_and_says_what_it_is() {
    for backend in BOTH {
        let context = Context::open(backend).unwrap();
        assert_eq!(context.backend(), backend);
        let gl = context.gl();
        // SAFETY: the context is current on this thread.
        let (major, minor, profile, renderer) = unsafe {
            (
                gl.get_parameter_i32(glow::MAJOR_VERSION),
                gl.get_parameter_i32(glow::MINOR_VERSION),
                gl.get_parameter_i32(glow::CONTEXT_PROFILE_MASK),
                gl.get_parameter_string(glow::RENDERER),
            )
        };
        assert!((major, minor) >= (3, 3), "{major}.{minor}");
        assert_eq!(profile, glow::CONTEXT_CORE_PROFILE_BIT as i32);
        let described = context.describe();
        assert!(
            described.starts_with(&format!("{}: {renderer}, OpenGL {major}.{minor}", backend.name())),
            "{described}"
        );
    }
}

#[test]
fn each_backend_clears_a_framebuffer_to_a_colour_that_reads_back_exactly() {
    for backend in BOTH {
        let context = Context::open(backend).unwrap();
        for colour in [[0, 0, 0, 0], [255, 255, 255, 255], [1, 127, 128, 254]] {
            assert_clears_to(&context, colour);
        }
    }
}

#[test]
fn auto_is_the_first_that_works() {
    let context = Context::open(Backend::Auto).unwrap();
    assert_eq!(context.backend(), Backend::Egl);
    assert_clears_to(&context, [10, 20, 30, 40]);
}

#[test]
fn a_second_glow_context_loads_from_get_proc_address() {
    for backend in BOTH {
        let context = Context::open(backend).unwrap();
        // SAFETY: the context is current on this thread, and the entry points are its own.
        let version = unsafe {
            let gl = glow::Context::from_loader_function_cstr(|name| context.get_proc_address(name));
            gl.get_parameter_string(glow::VERSION)
        };
        assert!(context.describe().ends_with(&version));
    }
}

#[test]
fn a_thread_is_refused_a_second_context_until_it_drops_the_first() {
    for (first, second) in BOTH.into_iter().flat_map(|first| BOTH.map(|second| (first, second))) {
        let context = Context::open(first).unwrap();
        for refused in [second, Backend::Auto] {
            assert_context_error(Context::open(refused), &["this thread already has an OpenGL context"]);
        }
        assert_clears_to(&context, [1, 2, 3, 4]);
        drop(context);
        assert_clears_to(&Context::open(second).unwrap(), [5, 6, 7, 8]);
    }
}

#[test]
fn threads_make_use_and_drop_contexts_at_the_same_time() {
    for backend in BOTH {
        std::thread::scope(|scope| {
            for thread in 0..4 {
                scope.spawn(move || {
                    for cycle in 0..10 {
                        assert_clears_to(&Context::open(backend).unwrap(), [thread, cycle, 100, 200]);
                    }
                });
            }
        });
    }
}

#[test]
fn egl_and_osmesa_live_side_by_side_on_different_threads() {
    // Neither thread draws before both have their contexts, and neither drops its context before both have drawn.
    let barrier = std::sync::Barrier::new(2);
    std::thread::scope(|scope| {
        for (backend, colour) in BOTH.into_iter().zip([[9, 8, 7, 6], [5, 4, 3, 2]]) {
            let barrier = &barrier;
            scope.spawn(move || {
                for _ in 0..10 {
                    let context = Context::open(backend);
                    barrier.wait();
                    assert_clears_to(context.as_ref().unwrap(), colour);
                    barrier.wait();
                }
            });
        }
    });
}

/// LIBGL_ALWAYS_SOFTWARE keeps EGL from using a GPU, which would ignore GALLIUM_DRIVER.
#[test]
fn a_driver_that_does_not_exist_is_an_error_and_not_a_crash() {
    let environment = [("GALLIUM_DRIVER", OsStr::new("nonsense")), ("LIBGL_ALWAYS_SOFTWARE", OsStr::new("true"))];
    in_own_process("a_driver_that_does_not_exist_is_an_error_and_not_a_crash", &environment, || {
        let osmesa = ["osmesa: it has no driver \"nonsense\"", "unset GALLIUM_DRIVER", "llvmpipe or softpipe"];
        let egl = ["egl: no OpenGL 3.3 core context", "unset GALLIUM_DRIVER"];
        assert_context_error(Context::open(Backend::Osmesa), &osmesa);
        assert_context_error(Context::open(Backend::Egl), &egl);
        assert_context_error(Context::open(Backend::Auto), &[egl.as_slice(), &osmesa].concat());
    });
}

#[test]
fn each_backend_opens_softpipe_where_the_environment_asks_for_it() {
    let environment = [("GALLIUM_DRIVER", OsStr::new("softpipe")), ("LIBGL_ALWAYS_SOFTWARE", OsStr::new("true"))];
    in_own_process("each_backend_opens_softpipe_where_the_environment_asks_for_it", &environment, || {
        for backend in BOTH {
            let context = Context::open(backend).unwrap();
            assert!(context.describe().contains("softpipe"), "{}", context.describe());
            assert_clears_to(&context, [1, 127, 128, 254]);
        }
    });
}

#[test]
fn a_version_below_3_3_is_refused() {
    let environment = [("MESA_GL_VERSION_OVERRIDE", OsStr::new("3.2"))];
    in_own_process("a_version_below_3_3_is_refused", &environment, || {
        for backend in BOTH {
            let parts = [backend.name(), "no OpenGL 3.3 core context", "unset MESA_GL_VERSION_OVERRIDE"];
            assert_context_error(Context::open(backend), &parts);
        }
    });
}

#[test]
fn a_compatibility_profile_is_refused_and_the_thread_left_free() {
    let environment = [("MESA_GL_VERSION_OVERRIDE", OsStr::new("3.3COMPAT"))];
    in_own_process("a_compatibility_profile_is_refused_and_the_thread_left_free", &environment, || {
        for backend in BOTH.into_iter().chain(BOTH) {
            let parts = [backend.name(), "this is not OpenGL 3.3 core", "unset MESA_GL_VERSION_OVERRIDE"];
            assert_context_error(Context::open(backend), &parts);
        }
    });
}

#[test]
fn a_variable_with_which_mesa_crashes_is_refused_and_the_thread_left_free() {
    let environment = [("MESA_GLSL_VERSION_OVERRIDE", OsStr::new("130"))];
    in_own_process("a_variable_with_which_mesa_crashes_is_refused_and_the_thread_left_free", &environment, || {
        for backend in BOTH.into_iter().chain([Backend::Auto]).chain(BOTH) {
            assert_context_error(Context::open(backend), &["MESA_GLSL_VERSION_OVERRIDE=130", "unset it"]);
        }
    });
}

#[test]
fn a_failure_names_every_variable_in_force_that_may_have_caused_it() {
    let environment = [
        ("__EGL_VENDOR_LIBRARY_FILENAMES", OsStr::new("/nonexistent")),
        ("MESA_EXTENSION_OVERRIDE", OsStr::new("-GL_ARB_sync")),
    ];
    in_own_process("a_failure_names_every_variable_in_force_that_may_have_caused_it", &environment, || {
        let unset = "unset MESA_EXTENSION_OVERRIDE and __EGL_VENDOR_LIBRARY_FILENAMES, or ";
        assert_context_error(Context::open(Backend::Egl), &["egl", unset, "libegl1 libgl1-mesa-dri"]);
        assert_context_error(Context::open(Backend::Osmesa), &["osmesa", unset, "update Mesa"]);
    });
}

/// The dynamic linker looks into LD_LIBRARY_PATH first. A file there that is no library ends its search with an error.
#[test]
fn a_missing_library_is_an_error_that_names_its_debian_package() {
    let directory = tempfile::tempdir().unwrap();
    for library in ["libEGL.so.1", "libEGL.so", "libOSMesa.so.8"] {
        std::fs::write(directory.path().join(library), "no library").unwrap();
    }
    let environment = [("LD_LIBRARY_PATH", directory.path().as_os_str())];
    in_own_process("a_missing_library_is_an_error_that_names_its_debian_package", &environment, || {
        let (egl, osmesa) = (["libEGL.so.1", "libegl1 libgl1-mesa-dri"], ["libOSMesa.so.8", "libosmesa6"]);
        assert_context_error(Context::open(Backend::Egl), &egl);
        assert_context_error(Context::open(Backend::Osmesa), &osmesa);
        assert_context_error(Context::open(Backend::Auto), &[egl, osmesa].concat());
    });
}

/// If LIBGL_DRIVERS_PATH is set, Mesa's loader looks for drivers nowhere else.
#[test]
fn egl_without_a_driver_is_an_error_that_names_its_debian_package() {
    let directory = tempfile::tempdir().unwrap();
    let environment = [("LIBGL_DRIVERS_PATH", directory.path().as_os_str())];
    in_own_process("egl_without_a_driver_is_an_error_that_names_its_debian_package", &environment, || {
        assert_context_error(Context::open(Backend::Egl), &["egl", "libegl1 libgl1-mesa-dri"]);
        let context = Context::open(Backend::Auto).unwrap();
        assert_eq!(context.backend(), Backend::Osmesa);
        assert_clears_to(&context, [1, 2, 3, 4]);
    });
}

/// Mesa 22.3.6 itself grows by some 130 KiB in 200 cycles. A leak in this crate would be far above the bound of 1024
/// KiB. Two planted leaks were measured: 4400 KiB if each cycle leaves its `glow::Context` behind, and 500,000 KiB if
/// it leaves its OSMesa context behind.
#[cfg(target_os = "linux")]
#[test]
fn two_hundred_contexts_leave_no_memory_behind() {
    in_own_process("two_hundred_contexts_leave_no_memory_behind", &[], || {
        for backend in BOTH {
            let cycle = || assert_clears_to(&Context::open(backend).unwrap(), [1, 2, 3, 4]);
            // The first cycle loads the library and starts the driver's threads. The next ones fill the allocator's
            // pools.
            (0..20).for_each(|_| cycle());
            let before = resident();
            (0..200).for_each(|_| cycle());
            let growth = resident() - before;
            assert!(growth < 1024, "{}: {growth} KiB more after 200 contexts", backend.name());
        }
    });
}
