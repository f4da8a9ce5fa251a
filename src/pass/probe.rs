//! Whether the driver renders what it is asked to. OpenGL 3.3 does not promise that RGBA8_SNORM can be rendered, and
//! softpipe accepts it beside RGBA8 and then clamps negatives to 0: so the G-buffer's targets are drawn and read back.

use super::{BACKGROUND_R16F, BACKGROUND_R32F, FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{Defines, Format, Program, Target, Texture, check, source};
use std::sync::Arc;

/// True where the three formats, drawn to together, hold what the G-buffer writes: colours in [0, 1], depths up to the
/// background's, and `normal`.
pub(crate) fn renders(
    gl: &Arc<glow::Context>,
    depth: Format,
    (normals, normal): (Format, [f32; 3]),
) -> Result<bool, Error> {
    let background = if depth == Format::R16f { BACKGROUND_R16F } else { BACKGROUND_R32F };
    let [x, y, z] = normal;
    let defines = Defines::default()
        .value("BACKGROUND", format!("{background:?}"))
        .value("NORMAL", format!("vec3({x:?}, {y:?}, {z:?})"));
    let program = Program::new(gl, &defines, FULLSCREEN, &[source!("probe.frag")])?;
    let textures = [Format::Rgba8, depth, normals].map(|format| Texture::new(gl, "probe", format, 1, 1));
    let [Ok(colour), Ok(depth), Ok(normals)] = textures else {
        return Ok(false);
    };
    let Ok(target) = Target::new(gl, "probe", &[&colour, &depth, &normals], None, (1, 1)) else {
        // What the refusal left behind is its answer, and not the next pass's error.
        let _ = check(gl, "probe");
        return Ok(false);
    };
    let full_screen = FullScreen::new(gl)?;
    target.bind();
    program.bind();
    full_screen.draw();
    let holds = |texture: &Texture, expected: &[f32], tolerance: f32| -> Result<bool, Error> {
        let read = texture.read()?;
        Ok(expected.iter().zip(read).all(|(e, r)| (e - r).abs() <= tolerance * e.abs().max(1.0)))
    };
    Ok(holds(&colour, &[1.0, 0.0, 1.0, 0.0], 0.01)?
        && holds(&depth, &[background], 1e-6)?
        && holds(&normals, &normal, 0.01)?)
}
