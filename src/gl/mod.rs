//! OpenGL objects that delete themselves when they are dropped.
//!
//! The contract of this module, on which its `SAFETY` comments rely: whenever one of these objects is made, used or
//! dropped, the context in which it was made is current on the thread.

pub(crate) mod cache;
pub(crate) mod debug_groups;
pub(crate) mod program;
pub(crate) mod state;
pub(crate) mod target;
pub(crate) mod texture;
pub(crate) mod timer;

use crate::Error;
use crate::error::GlCause;
use glow::HasContext;

pub(crate) use cache::ProgramCache;
pub(crate) use debug_groups::DebugGroups;
pub(crate) use program::{Defines, Program, Source, source};
pub(crate) use target::{Canvas, Renderbuffer, Target, incompleteness};
pub use texture::Format;
pub(crate) use texture::{MultisampleTexture, Texture};
pub use timer::{PassTime, Timers};

/// Turns an error that OpenGL has recorded into an [`Error`], and clears all others. `place` names the pass or object
/// that the calls before this one belong to.
pub(crate) fn check(gl: &glow::Context, place: &str) -> Result<(), Error> {
    error(gl).map_or(Ok(()), |code| Err(described(place, code)))
}

/// Returns the first error that OpenGL has recorded, and clears all others.
pub(crate) fn error(gl: &glow::Context) -> Option<u32> {
    let mut first = None;
    // The number is bounded because a lost context may report errors without end.
    for _ in 0..16 {
        // SAFETY: the context is current.
        match unsafe { gl.get_error() } {
            glow::NO_ERROR => break,
            code => first = first.or(Some(code)),
        }
    }
    first
}

/// Turns an OpenGL error's code into an [`Error`].
pub(crate) fn described(place: &str, code: u32) -> Error {
    let what = match code {
        glow::INVALID_ENUM => "invalid enum".into(),
        glow::INVALID_VALUE => "invalid value".into(),
        glow::INVALID_OPERATION => "invalid operation".into(),
        glow::INVALID_FRAMEBUFFER_OPERATION => "invalid framebuffer operation".into(),
        glow::OUT_OF_MEMORY => "out of memory: render at a smaller size".into(),
        glow::CONTEXT_LOST => {
            "the driver has lost its context: start again, and smaller or simpler if that repeats".into()
        }
        other => format!("error 0x{other:04x}"),
    };
    Error::gl_because(place, what, GlCause::Code(code))
}

/// Returns the error for a driver that made no object: the error that OpenGL recorded, or [`GlCause::NoObject`] if it
/// recorded none.
pub(crate) fn not_made(gl: &glow::Context, place: &str) -> Error {
    let silent = || Error::gl_because(place, "the driver made no object and does not say why", GlCause::NoObject);
    check(gl, place).err().unwrap_or_else(silent)
}

/// Returns true if the driver refused what was asked for, so that another format or fewer samples may succeed. A lost
/// context or a driver that makes no objects is not such a refusal. Neither is a lack of memory: see
/// [`is_out_of_memory`].
pub(crate) fn is_refusal(error: &Error) -> bool {
    const OTHERS: [GlCause; 3] =
        [GlCause::Code(glow::OUT_OF_MEMORY), GlCause::Code(glow::CONTEXT_LOST), GlCause::NoObject];
    matches!(error, Error::Gl { cause, .. } if !OTHERS.contains(cause))
}

/// Returns true if memory ran out, so that something smaller may succeed.
pub(crate) fn is_out_of_memory(error: &Error) -> bool {
    matches!(error, Error::Gl { cause: GlCause::Code(glow::OUT_OF_MEMORY), .. })
}

/// Returns true if OpenGL refused a call because it is not allowed in the current state (`GL_INVALID_OPERATION`).
pub(crate) fn is_invalid_operation(error: &Error) -> bool {
    matches!(error, Error::Gl { cause: GlCause::Code(glow::INVALID_OPERATION), .. })
}

/// Refuses a context that is not OpenGL 3.3 or later.
///
/// # Errors
/// [`Error::Context`] for OpenGL ES, and for an earlier version.
pub(crate) fn check_version(gl: &glow::Context) -> Result<(), Error> {
    let glow::Version { major, minor, is_embedded, .. } = *gl.version();
    if is_embedded {
        return Err(Error::Context(format!(
            "this context has OpenGL ES {major}.{minor}, and ambient occlusion needs OpenGL 3.3, which is not a part of \
             OpenGL ES: ask the window library for a context of OpenGL itself, version 3.3 core"
        )));
    }
    if (major, minor) < (3, 3) {
        return Err(Error::Context(format!(
            "this context has OpenGL {major}.{minor}, and ambient occlusion needs 3.3: ask the window library for version \
             3.3 core; many drivers give an earlier one unless a version is asked for"
        )));
    }
    Ok(())
}

/// Returns the largest number of samples per pixel of the textures that this driver can render to and fetch from, at
/// least 1.
pub(crate) fn sample_limit(gl: &glow::Context) -> u32 {
    // SAFETY: the context is current, and these are core parameters.
    let limits = [glow::MAX_SAMPLES, glow::MAX_COLOR_TEXTURE_SAMPLES].map(|p| unsafe { gl.get_parameter_i32(p) });
    limits.into_iter().min().unwrap_or(1).max(1) as u32
}

/// Returns the largest width and height in pixels that this driver can both render to and sample from. The context must
/// be current.
#[must_use]
pub fn size_limit(gl: &glow::Context) -> u32 {
    // SAFETY: the context is current, and these are core parameters; MAX_VIEWPORT_DIMS has two values.
    unsafe {
        let mut viewport = [0; 2];
        gl.get_parameter_i32_slice(glow::MAX_VIEWPORT_DIMS, &mut viewport);
        let limits = [
            gl.get_parameter_i32(glow::MAX_TEXTURE_SIZE),
            gl.get_parameter_i32(glow::MAX_RECTANGLE_TEXTURE_SIZE),
            gl.get_parameter_i32(glow::MAX_RENDERBUFFER_SIZE),
            viewport[0],
            viewport[1],
        ];
        limits.into_iter().min().unwrap_or(0).max(0) as u32
    }
}

/// Checks that the driver can render images of `width` by `height` pixels. The context must be current.
///
/// # Errors
/// [`Error::Usage`] for a size of 0 or above [`size_limit`], and [`Error::Gl`] if the driver does not report its
/// limits.
pub fn check_size(gl: &glow::Context, width: u32, height: u32) -> Result<(), Error> {
    let limit = size_limit(gl);
    check(gl, "the driver's limits")?;
    if width == 0 || height == 0 || width > limit || height > limit {
        return Err(Error::Usage(format!("size {width}x{height}: this driver takes 1x1 to {limit}x{limit}")));
    }
    Ok(())
}
