//! Whether the driver renders what it is asked to. OpenGL 3.3 does not promise that RGBA8_SNORM can be rendered, and
//! softpipe accepts it beside RGBA8 and then clamps negatives to 0: so the G-buffer's targets are drawn and read back.

use super::{BACKGROUND_R16F, BACKGROUND_R32F, FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{self, Defines, Format, Program, Target, Texture, source};
use std::sync::Arc;

/// What colours are drawn as.
const COLOUR: [f32; 4] = [1.0, 0.0, 1.0, 0.0];

/// True where the three formats, drawn to together, hold what the G-buffer writes: colours in [0, 1], depths up to the
/// background's, and `normal`.
pub(crate) fn renders(
    gl: &Arc<glow::Context>,
    depth: Format,
    (normals, [x, y, z]): (Format, [f32; 3]),
) -> Result<bool, Error> {
    hold_together(gl, [(Format::Rgba8, COLOUR), (depth, extreme(depth)), (normals, [x, y, z, 0.0])])
}

/// True where the driver renders to the format beside the G-buffer's RGBA8 and R32F, and what it then holds reads back:
/// negative numbers where the format has them, the depth of background where it is one for depths. The context must be
/// current and, but for how pixels are packed, in OpenGL's initial state; bindings are left behind.
///
/// # Errors
/// Where the driver refuses something else than the format.
pub fn format_renders(gl: &Arc<glow::Context>, format: Format) -> Result<bool, Error> {
    hold_together(gl, [Format::Rgba8, Format::R32f, format].map(|format| (format, extreme(format))))
}

/// What a format has to hold, as far as the passes use it.
fn extreme(format: Format) -> [f32; 4] {
    match format {
        Format::R8 => [0.2; 4],
        Format::R16f => [BACKGROUND_R16F; 4],
        Format::R32f => [BACKGROUND_R32F; 4],
        Format::Rgba8 => COLOUR,
        Format::Rgba8Snorm | Format::Rgba16f | Format::Rgba32f => [-1.0, 0.5, -0.25, 0.0],
    }
}

/// Draws one texel of each format, all at once, and reads them back.
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
        // Formats of one channel are read as one.
        if !expected.iter().zip(read).all(|(e, r)| (e - r).abs() <= tolerance * e.abs().max(1.0)) {
            return Ok(false);
        }
    }
    Ok(true)
}
