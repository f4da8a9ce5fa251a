//! Writes visibility, or the factor by which it darkens a colour, to an image of the caller.

use super::{FULLSCREEN, FullScreen, TextureRef};
use crate::Error;
use crate::gl::{Defines, Program, ProgramCache, Texture, source};
use std::sync::Arc;

/// The share of a colour that is ambient light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Share {
    /// The same everywhere, from 0 to 1.
    Constant(f32),
    /// In the alpha channel of a texture, whose lower left texel of the view is given.
    Image(TextureRef, (u32, u32)),
}

impl Share {
    /// Returns the word that the shader is compiled for; `None` for one number.
    fn word(self) -> Option<&'static str> {
        match self {
            Share::Constant(_) => None,
            Share::Image(image, _) => Some(image.target.word().unwrap_or("IMAGE")),
        }
    }
}

pub(crate) struct ApplyPass {
    program: Arc<Program>,
    word: Option<&'static str>,
}

impl ApplyPass {
    /// Compiles the pass for a share of this kind.
    pub(crate) fn new(programs: &mut ProgramCache, share: Share) -> Result<ApplyPass, Error> {
        let word = share.word();
        let defines = word.into_iter().fold(Defines::default(), |defines, word| defines.word("SHARE", word));
        Ok(ApplyPass { program: programs.get(&defines, FULLSCREEN, &[source!("apply.frag")])?, word })
    }

    /// Returns whether the pass is compiled for a share of this kind.
    pub(crate) fn takes(&self, share: Share) -> bool {
        self.word == share.word()
    }

    /// Draws into the bound framebuffer, whose viewport begins at `corner`. `ao` has the size of the view, or half of
    /// it if `halved`.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        (ao, halved): (&Texture, bool),
        share: Share,
        corner: (u32, u32),
    ) {
        let program = self.program.bind();
        full_screen.bind_texture(0, ao.into());
        program
            .unit("ao_image", 0)
            .vec2("corner", [f64::from(corner.0), f64::from(corner.1)])
            .float("ao_texels", if halved { 0.5 } else { 1.0 });
        match share {
            Share::Constant(share) => _ = program.float("ambient_share", f64::from(share)),
            Share::Image(image, (x, y)) => {
                full_screen.bind_texture(1, image);
                program.unit("share_image", 1).vec2("share_corner", [f64::from(x), f64::from(y)]);
                program.int("share_layer", image.target.layer() as i32);
            }
        }
        full_screen.draw();
    }
}
