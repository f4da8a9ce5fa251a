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

    /// Draws into the bound target.
    pub(crate) fn draw(&self, full_screen: &FullScreen, colour: &Texture, ao: &Texture) {
        self.program.bind().unit("colour_image", 0).unit("ao_image", 1);
        full_screen.bind_texture(0, colour.into());
        full_screen.bind_texture(1, ao.into());
        full_screen.draw();
    }
}
