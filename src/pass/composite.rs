//! Makes the final image: colour times ambient occlusion.

use super::{FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{Defines, Program, Texture, source};
use std::sync::Arc;

/// The part of the colour that is multiplied by ambient occlusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Apply {
    /// The whole colour, including direct light, as in the results of ShaderX7 6.2.
    #[default]
    All,
    /// The ambient share of the colour only.
    Ambient,
}

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

    /// Draws into the bound target. `ao` has either the size of `colour` or half of it, rounded up.
    pub(crate) fn draw(&self, full_screen: &FullScreen, colour: &Texture, ao: &Texture) {
        let halved = (ao.width, ao.height) != (colour.width, colour.height);
        let ao_texels = if halved { 0.5 } else { 1.0 };
        self.program.bind().unit("colour_image", 0).unit("ao_image", 1).float("ao_texels", ao_texels);
        full_screen.bind_texture(0, colour.into());
        full_screen.bind_texture(1, ao.into());
        full_screen.draw();
    }
}
