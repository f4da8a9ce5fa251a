//! OpenGL objects that free themselves. The context they came from must be current, and outlive them.

pub(crate) mod program;
pub(crate) mod state;
pub(crate) mod target;
pub(crate) mod texture;
pub(crate) mod timer;

use crate::Error;
use crate::error::GlCause;
use glow::HasContext;

pub(crate) use program::{Defines, Program, Source, source};
pub(crate) use target::{Renderbuffer, Target};
pub use texture::Format;
pub(crate) use texture::{MultisampleTexture, Texture};
pub use timer::{PassTime, Timers};

/// Turns the errors that OpenGL has recorded into ours. `place` is the pass or object at hand.
pub(crate) fn check(gl: &glow::Context, place: &str) -> Result<(), Error> {
    let mut first = None;
    // A lost context may report errors without end.
    for _ in 0..16 {
        // SAFETY: the context is current.
        match unsafe { gl.get_error() } {
            glow::NO_ERROR => break,
            code => first = first.or(Some(code)),
        }
    }
    match first {
        None => Ok(()),
        Some(code) => Err(Error::gl_because(
            place,
            match code {
                glow::INVALID_ENUM => "invalid enum".into(),
                glow::INVALID_VALUE => "invalid value".into(),
                glow::INVALID_OPERATION => "invalid operation".into(),
                glow::INVALID_FRAMEBUFFER_OPERATION => "invalid framebuffer operation".into(),
                glow::OUT_OF_MEMORY => "out of memory: render at a smaller size".into(),
                glow::CONTEXT_LOST => {
                    "the driver has lost its context: start again, and smaller or simpler if that repeats".into()
                }
                other => format!("error 0x{other:04x}"),
            },
            GlCause::Code(code),
        )),
    }
}

/// Why no object was made, of the flag that OpenGL may have left or may not.
pub(crate) fn not_made(gl: &glow::Context, place: &str) -> Error {
    let silent = || Error::gl_because(place, "the driver made no object and does not say why", GlCause::NoObject);
    check(gl, place).err().unwrap_or_else(silent)
}

/// Whether an error is about what was asked for, so that another format or fewer samples may do. Neither brings back a
/// lost context or mends a driver that makes no objects; of memory, see [`is_out_of_memory`].
pub(crate) fn is_refusal(error: &Error) -> bool {
    const OTHERS: [GlCause; 3] =
        [GlCause::Code(glow::OUT_OF_MEMORY), GlCause::Code(glow::CONTEXT_LOST), GlCause::NoObject];
    matches!(error, Error::Gl { cause, .. } if !OTHERS.contains(cause))
}

/// Whether an error is that there is no memory, of which something smaller may still find enough.
pub(crate) fn is_out_of_memory(error: &Error) -> bool {
    matches!(error, Error::Gl { cause: GlCause::Code(glow::OUT_OF_MEMORY), .. })
}

/// Whether an error is that the call is not allowed as things are.
pub(crate) fn is_invalid_operation(error: &Error) -> bool {
    matches!(error, Error::Gl { cause: GlCause::Code(glow::INVALID_OPERATION), .. })
}

/// The most samples a pixel that this driver can draw into textures and read from them.
pub(crate) fn sample_limit(gl: &glow::Context) -> u32 {
    // SAFETY: the context is current, and these are core parameters.
    let limits = [glow::MAX_SAMPLES, glow::MAX_COLOR_TEXTURE_SAMPLES].map(|p| unsafe { gl.get_parameter_i32(p) });
    limits.into_iter().min().unwrap_or(1).max(1) as u32
}

/// The largest width and height that this driver renders to and samples from.
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

/// Refuses a size that the driver cannot render.
pub fn check_size(gl: &glow::Context, width: u32, height: u32) -> Result<(), Error> {
    let limit = size_limit(gl);
    check(gl, "the driver's limits")?;
    if width == 0 || height == 0 || width > limit || height > limit {
        return Err(Error::Usage(format!("size {width}x{height}: this driver takes 1x1 to {limit}x{limit}")));
    }
    Ok(())
}
