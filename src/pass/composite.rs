//! The image: colour times ambient occlusion.

use super::{FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{Defines, Program, Texture, source};
use std::sync::Arc;

/// What ambient occlusion multiplies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Apply {
    /// The whole colour, direct light too: what the chapter's results do.
    #[default]
    All,
    /// The ambient share of the colour alone.
    Ambient,
}

/// The pass.
pub(crate) struct Composite {
    program: Program,
}

impl Composite {
    pub(crate) fn new(gl: &Arc<glow::Context>, apply: Apply) -> Result<Composite, Error> {
        let defines = match apply {
            Apply::All => Defines::default(),
            Apply::Ambient => Defines::default().value("APPLY_AMBIENT", 1),
        };
        let program = Program::new(gl, &defines, FULLSCREEN, &[source!("composite.frag")])?;
        Ok(Composite { program })
    }

    /// Draws into the bound target. Ambient occlusion may be at half the colour's size, rounded up.
    pub(crate) fn draw(&self, full_screen: &FullScreen, colour: &Texture, ao: &Texture) {
        let halved = (ao.width, ao.height) != (colour.width, colour.height);
        let ao_texels = if halved { 0.5 } else { 1.0 };
        self.program.bind().unit("colour_image", 0).unit("ao_image", 1).float("ao_texels", ao_texels);
        full_screen.bind_texture(0, colour.into());
        full_screen.bind_texture(1, ao.into());
        full_screen.draw();
    }
}
