//! Whatever the library renders, the driver's debug output contains no message of high or medium severity.

use crate::rig;
use crate::rig::by_hand::{Textures, perspective, plane};
use crate::rig::debug::{Message, watch};
use crate::rig::process::in_own_process;
use crate::rig::{every_switch, scenes};
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::settings::{AoFormat, DepthFormat, NormalFormat};
use hbao::{
    AmbientOcclusion, Apply, Format, NormalEncoding, Pipeline, Request, Settings, TextureTarget, format_renders,
};
use std::collections::BTreeMap;
use std::ffi::OsStr;

const SIZE: (u32, u32) = (33, 21);

/// Returns settings with every switch, and with every combination of formats.
fn settings() -> Vec<Settings> {
    let mut all = every_switch();
    for ao_format in [AoFormat::R8, AoFormat::R16f, AoFormat::R32f] {
        for normal_format in [NormalFormat::Rgba8Snorm, NormalFormat::Rgba16f] {
            for depth_format in [DepthFormat::R32f, DepthFormat::R16f] {
                let msaa = if all.len().is_multiple_of(2) { 1 } else { 4 };
                let base = Settings { directions: 2, steps: 2, blur: 3, ..all[0].clone() };
                all.push(Settings { ao_format, normal_format, depth_format, msaa, ..base });
            }
        }
    }
    all
}

/// Calls everything that the library can do in a context.
fn use_all_of(context: &Context) {
    let gl = context.gl();
    for (_, name) in Format::ALL.into_iter().map(|(format, name)| (format_renders(gl, format).unwrap(), name)) {
        assert!(!name.is_empty());
    }
    for (i, settings) in settings().iter().enumerate() {
        let shot = if i % 2 == 0 { scenes::cornell_box() } else { scenes::cornell_box().orthographic() };
        let composite = Some(if i % 3 == 0 { Apply::Ambient } else { Apply::All });
        let timings = i % 2 == 1;
        let request = Request { composite, raw: true, edges: true, timings, ..Request::default() };
        let mut pipeline = Pipeline::new(gl, SIZE, settings, request).unwrap();
        let frame = rig::frame(&mut pipeline, &shot, SIZE, settings);
        assert!(frame.ao.texels.iter().all(|a| (0.0..=1.0).contains(a)));
    }
    // This is how an application uses the library: state is saved and restored, and textures are of either kind.
    let view = plane(perspective(60.0, SIZE), SIZE, glam::dvec3(0.3, 0.2, -1.0).normalize(), -4.0);
    for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
        for encoding in [NormalEncoding::Signed, NormalEncoding::Biased] {
            let settings = rig::float_settings(1.0);
            let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings).unwrap();
            let textures = Textures::new(gl, &view, target, encoding);
            // The second call starts from the state that the first has left.
            textures.visibility(&mut ao, &view);
            textures.visibility(&mut ao, &view);
        }
    }
}

/// Counts each message of low severity, which are hints about what is slow. softpipe's notices are left out, because
/// they only count the instructions of every shader.
fn hints(messages: &[Message]) -> BTreeMap<&str, usize> {
    let mut hints = BTreeMap::new();
    for message in messages.iter().filter(|message| message.severity == glow::DEBUG_SEVERITY_LOW) {
        *hints.entry(message.text.as_str()).or_default() += 1;
    }
    hints
}

fn hold(backend: Backend) {
    let context = Context::open(backend).unwrap();
    let watch = watch(&context);
    assert!(watch.listens(), "{} has no debug output", context.describe());
    use_all_of(&context);
    let messages = watch.messages();
    for (text, count) in hints(&messages) {
        println!("{}: {count} x {text}", context.describe());
    }
    let severe: Vec<&Message> = messages.iter().filter(|message| message.is_severe()).collect();
    assert!(severe.is_empty(), "{}: {severe:#?}", context.describe());
}

#[test]
fn llvmpipe_by_egl_has_nothing_against_it() {
    hold(Backend::Egl);
}

#[test]
fn llvmpipe_by_osmesa_has_nothing_against_it() {
    hold(Backend::Osmesa);
}

#[test]
fn zink_has_nothing_against_it_where_it_is_installed() {
    let environment =
        [("MESA_LOADER_DRIVER_OVERRIDE", OsStr::new("zink")), ("LIBGL_ALWAYS_SOFTWARE", OsStr::new("true"))];
    in_own_process("zink_has_nothing_against_it_where_it_is_installed", &environment, || {
        match Context::open(Backend::Egl) {
            Ok(context) if context.describe().contains("zink") => drop(context),
            _ => return rig::process::skip("zink on lavapipe", "mesa-vulkan-drivers"),
        }
        hold(Backend::Egl);
    });
}

#[test]
fn softpipe_has_nothing_against_it() {
    let environment = [("GALLIUM_DRIVER", OsStr::new("softpipe")), ("LIBGL_ALWAYS_SOFTWARE", OsStr::new("true"))];
    in_own_process("softpipe_has_nothing_against_it", &environment, || hold(Backend::Egl));
}

#[test]
fn a_mistake_is_heard_and_fails_a_test() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let mistake = || {
            // SAFETY: the context is current. The error is intended.
            unsafe {
                context.gl().bind_texture(glow::TEXTURE_2D + 1, None);
                assert_eq!(context.gl().get_error(), glow::INVALID_ENUM);
            }
        };
        let watch = watch(&context);
        mistake();
        let messages = watch.messages();
        assert!(messages.iter().any(|m| m.is_severe() && m.kind == glow::DEBUG_TYPE_ERROR), "{messages:?}");
        // The messages of the first mistake have been taken, so dropping the watch does not panic. Those of the next
        // mistake are not taken, so the drop panics.
        drop(watch);
        let fails = std::panic::AssertUnwindSafe(|| {
            let _watch = rig::debug::watch(&context);
            mistake();
        });
        assert!(std::panic::catch_unwind(fails).is_err(), "{}", backend.name());
        // After the watch is dropped, a mistake is not recorded any more.
        mistake();
        drop(rig::debug::watch(&context));
    }
}
