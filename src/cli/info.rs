//! `hbao info`: prints the driver, the limits and the formats that each backend gives on this machine.

use super::session::limit_threads;
use crate::terminal::print;
use clap::Command;
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::{Error, Format, Timers, format_renders, size_limit};
use std::fmt::Write as _;
use std::panic::catch_unwind;

/// The backends that are tried.
const BACKENDS: [Backend; 3] = [Backend::Egl, Backend::Osmesa, Backend::Glx];

/// Makes the verb, which has no flags.
pub(crate) fn command() -> Command {
    Command::new("info")
        .about("Print the driver, the limits and the formats that each OpenGL backend gives on this machine")
        .after_help("Example:\n  hbao info\n\nThe command fails if no backend works.")
}

/// Prints the driver, the limits and the formats of each backend, or why the backend gives no context.
pub(crate) fn run() -> Result<(), Error> {
    limit_threads();
    let mut text = String::new();
    let mut failures = Vec::new();
    for backend in BACKENDS {
        let findings = catch_unwind(|| findings(backend))
            .unwrap_or_else(|_| Err(Error::Context(format!("{}: it crashed", backend.name()))));
        match findings {
            Ok(findings) => text += &findings,
            Err(error) => {
                let _ = writeln!(text, "{error}");
                failures.push(backend.name());
            }
        }
    }
    print(&text)?;
    match failures.as_slice() {
        failed if failed.len() == BACKENDS.len() => {
            Err(Error::Context(format!("no backend works: install what {} asks for", failures.join(" or "))))
        }
        _ => Ok(()),
    }
}

fn findings(backend: Backend) -> Result<String, Error> {
    let context = Context::open(backend)?;
    let gl = context.gl();
    // SAFETY: the context is current on this thread; the parameters are core, and MAX_VIEWPORT_DIMS has two values.
    let (names, limits, viewport) = unsafe {
        let names = [glow::VENDOR, glow::SHADING_LANGUAGE_VERSION];
        let limits = [
            glow::MAX_TEXTURE_SIZE,
            glow::MAX_RECTANGLE_TEXTURE_SIZE,
            glow::MAX_RENDERBUFFER_SIZE,
            glow::MAX_SAMPLES,
            glow::MAX_COLOR_TEXTURE_SAMPLES,
            glow::MAX_DEPTH_TEXTURE_SAMPLES,
        ];
        let mut viewport = [0; 2];
        gl.get_parameter_i32_slice(glow::MAX_VIEWPORT_DIMS, &mut viewport);
        (names.map(|name| gl.get_parameter_string(name)), limits.map(|limit| gl.get_parameter_i32(limit)), viewport)
    };
    let [vendor, glsl] = names;
    let [texture, rectangle, renderbuffer, samples, colour_samples, depth_samples] = limits;
    let size = size_limit(gl);
    let timer =
        if Timers::driver_has_one(gl)? { "works" } else { "does not work: --timings has the clock's times alone" };

    let (mut renders, mut refused) = (Vec::new(), Vec::new());
    for (format, name) in Format::ALL {
        let list = if format_renders(gl, format)? { &mut renders } else { &mut refused };
        list.push(name);
    }
    let (renders, refused) = (renders.join(", "), refused.join(", "));

    let mut text = format!("{}\n", context.describe());
    for (name, value) in [
        ("vendor", vendor),
        ("renderer", context.renderer()),
        ("OpenGL", context.version()),
        ("GLSL", glsl),
        ("images", format!("up to {size}x{size}")),
        ("textures", format!("up to {texture}, rectangles {rectangle}, renderbuffers {renderbuffer}")),
        ("viewport", format!("up to {}x{}", viewport[0], viewport[1])),
        ("samples", format!("up to {samples}, in colour textures {colour_samples}, in depth textures {depth_samples}")),
        ("timer query", timer.into()),
        ("renders", renders),
        ("does not", refused),
    ] {
        if !value.is_empty() {
            let _ = writeln!(text, "  {name:<12} {value}");
        }
    }
    Ok(text)
}
