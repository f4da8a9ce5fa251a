//! Finds out whether the driver renders to a format, by drawing a texel and reading it back.
//!
//! OpenGL 3.3 does not require that RGBA8_SNORM can be rendered to. softpipe accepts it in a framebuffer together with
//! RGBA8, but then clamps negative values to 0.

use super::{BACKGROUND_R16F, BACKGROUND_R32F, FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{self, Defines, Format, Program, Target, Texture, source};
use std::sync::Arc;

/// The colour that is drawn to RGBA8.
const COLOUR: [f32; 4] = [1.0, 0.0, 1.0, 0.0];

/// Returns true if the driver renders to the three formats of the G-buffer together: `depth`, the given format for
/// normals, and RGBA8 for colours. They are probed together even if no image needs colours, so that the format that is
/// chosen, and with it ambient occlusion, does not depend on which images are made. Colours in [0, 1], the depth of
/// background, and the given normal must read back as they were drawn.
pub(crate) fn renders(
    gl: &Arc<glow::Context>,
    depth: Format,
    normals: Format,
    [x, y, z]: [f32; 3],
) -> Result<bool, Error> {
    hold_together(gl, [(depth, extreme(depth)), (normals, [x, y, z, 0.0]), (Format::Rgba8, COLOUR)])
}

/// Returns true if the driver renders to the format, in a framebuffer together with the G-buffer's RGBA8 and R32F. A
/// value must read back as it was drawn: for a format of depths the depth of background, and for a format with negative
/// numbers a negative one.
///
/// The context must be current and in OpenGL's initial state, except that pixels may be packed in any way. Bindings are
/// changed and not restored.
///
/// # Errors
/// [`Error::Gl`] if the driver refuses anything other than the format.
pub fn format_renders(gl: &Arc<glow::Context>, format: Format) -> Result<bool, Error> {
    hold_together(gl, [Format::R32f, format, Format::Rgba8].map(|format| (format, extreme(format))))
}

/// Returns the value that a format must be able to hold: the most demanding one that the passes write to it.
fn extreme(format: Format) -> [f32; 4] {
    match format {
        Format::R8 => [0.2; 4],
        Format::R16f => [BACKGROUND_R16F; 4],
        Format::R32f => [BACKGROUND_R32F; 4],
        Format::Rgba8 => COLOUR,
        Format::Rgba8Snorm | Format::Rgba16f | Format::Rgba32f => [-1.0, 0.5, -0.25, 0.0],
    }
}

/// Draws one texel of each format, all in one framebuffer, and reads them back. True if they have the expected values.
fn hold_together(gl: &Arc<glow::Context>, expected: [(Format, [f32; 4]); 3]) -> Result<bool, Error> {
    let mut defines = Defines::default();
    for (name, (_, [x, y, z, w])) in ["VALUE_0", "VALUE_1", "VALUE_2"].into_iter().zip(expected) {
        defines = defines.value(name, format!("vec4({x:?}, {y:?}, {z:?}, {w:?})"));
    }
    let program = Program::new(gl, &defines, FULLSCREEN, &[source!("probe.frag")])?;
    let full_screen = FullScreen::new(gl)?;
    let made = || -> Result<([Texture; 3], Target), Error> {
        let [first, second, third] = expected.map(|(format, _)| Texture::new(gl, "probe: image", format, 1, 1));
        let textures = [first?, second?, third?];
        let [first, second, third] = textures.each_ref();
        let target = Target::new(gl, "probe: framebuffer", &[first, second, third], None, (1, 1))?;
        Ok((textures, target))
    };
    let (textures, target) = match made() {
        Ok(made) => made,
        Err(refusal) if gl::is_refusal(&refusal) => return Ok(false),
        Err(error) => return Err(error),
    };
    target.bind();
    program.bind();
    full_screen.draw();
    gl::check(gl, "probe")?;
    for (texture, (format, expected)) in textures.iter().zip(expected) {
        let tolerance = if matches!(format, Format::R16f | Format::R32f) { 1e-6 } else { 0.01 };
        let read = texture.read()?;
        // `read` returns one number for a format of one channel, so `zip` compares only that one.
        if !expected.iter().zip(read).all(|(e, r)| (e - r).abs() <= tolerance * e.abs().max(1.0)) {
            return Ok(false);
        }
    }
    Ok(true)
}
