//! Contexts that are not OpenGL 3.3, and debuggers that show the passes by their names.

use crate::rig;
use crate::rig::by_hand::{Textures, perspective, rubble};
use hbao::context::{Backend, Context};
use hbao::settings::Method;
use hbao::{AmbientOcclusion, NormalEncoding, Settings, TextureTarget};
use std::cell::RefCell;
use std::ffi::{CStr, c_char, c_void};
use std::sync::Arc;

thread_local! {
    /// What the driver says that its version is.
    static VERSION: RefCell<&'static CStr> = const { RefCell::new(c"") };
    /// The debug groups, in the order in which they began and ended.
    static GROUPS: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

extern "system" fn get_string(name: u32) -> *const c_char {
    if name == glow::VERSION { VERSION.with_borrow(|version| version.as_ptr()) } else { c"".as_ptr() }
}

/// Returns the context as it is, but for the version that it tells.
fn telling(context: &Context, version: &'static CStr) -> Arc<glow::Context> {
    VERSION.set(version);
    // SAFETY: the context is current on this thread, the functions are its own, and the one that is not has the
    // signature of glGetString.
    let gl = unsafe {
        glow::Context::from_loader_function_cstr(|name| match name.to_bytes() {
            b"glGetString" => get_string as *const c_void,
            _ => context.get_proc_address(name),
        })
    };
    Arc::new(gl)
}

#[test]
fn contexts_of_opengl_es_and_of_earlier_versions_are_told_what_is_needed() {
    let context = Context::open(Backend::Egl).unwrap();
    for (version, words) in [
        (c"OpenGL ES 3.2 Mesa 25.0", ["OpenGL ES 3.2", "3.3", "version 3.3 core"]),
        (c"OpenGL ES 3.0 (ANGLE 2.1)", ["OpenGL ES 3.0", "3.3", "OpenGL itself"]),
        (c"3.2 (Core Profile) Mesa 25.0", ["OpenGL 3.2", "needs 3.3", "version 3.3 core"]),
        (c"2.1 Mesa 7.0", ["OpenGL 2.1", "needs 3.3", "ask the window library"]),
    ] {
        let gl = telling(&context, version);
        let error = AmbientOcclusion::new(gl, (8, 8), &Settings::default()).err().expect("it is refused");
        let message = error.to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        assert!(matches!(error, hbao::Error::Context(_)) && !message.contains('\n'));
    }
    for version in [c"3.3 (Core Profile) Mesa 25.0", c"4.6.0 NVIDIA 570.1"] {
        AmbientOcclusion::new(telling(&context, version), (8, 8), &Settings::default()).unwrap();
    }
}

extern "system" fn push(source: u32, _id: u32, length: i32, name: *const c_char) {
    assert_eq!(source, glow::DEBUG_SOURCE_APPLICATION);
    // SAFETY: the name has this length.
    let name = unsafe { std::slice::from_raw_parts(name.cast::<u8>(), length as usize) };
    GROUPS.with_borrow_mut(|groups| groups.push(String::from_utf8(name.to_vec()).unwrap()));
}

extern "system" fn pop() {
    GROUPS.with_borrow_mut(|groups| groups.push("end".into()));
}

#[test]
fn each_pass_is_a_debug_group_of_its_own_name() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble((9, 9), perspective(60.0, (9, 9)), 3, 1.0..2.0);
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let settings = Settings { blur: 3, ..rig::raw(Method::Hbao, 1.0) };
    let mut ao = AmbientOcclusion::new(context.gl().clone(), (9, 9), &settings).unwrap();
    let load = |name: &CStr| match name.to_bytes() {
        b"glPushDebugGroup" => push as *const c_void,
        b"glPopDebugGroup" => pop as *const c_void,
        _ => panic!("{name:?}"),
    };
    // SAFETY: the functions have the signatures of those of OpenGL.
    assert!(unsafe { ao.name_passes(load) });
    textures.visibility(&mut ao, &view);
    let groups = GROUPS.take();
    assert_eq!(groups, ["background", "end", "ao", "end", "blur_x", "end", "blur_y", "end"]);
    // A pass that fails ends its group, too.
    let window = hbao::Destination::Framebuffer(None);
    let wrong = hbao::Output::new(window, hbao::Write::Multiplied(2.0));
    ao.render_into(&textures.inputs, &wrong).unwrap_err();
    assert_eq!(GROUPS.take()[8..], ["apply", "end"]);
    // SAFETY: null is no function.
    assert!(unsafe { !ao.name_passes(|_| std::ptr::null()) });
    textures.visibility(&mut ao, &view);
    assert!(GROUPS.take().is_empty());
}
