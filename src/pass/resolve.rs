//! Resolves multisample textures to one value per pixel: one sample of depth and normals, and the mean of the colours
//! if an image needs it (ShaderX7 6.2, Multisample antialiasing).

use super::{FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{Defines, MultisampleTexture, Program, source};
use std::sync::Arc;

pub(crate) struct Resolve {
    program: Program,
}

impl Resolve {
    /// Compiles the pass for this number of samples per pixel, with or without colours.
    pub(crate) fn new(gl: &Arc<glow::Context>, samples: u32, colour: bool) -> Result<Resolve, Error> {
        let defines = Defines::default().value("SAMPLES", samples).flag("COLOUR", colour);
        Ok(Resolve { program: Program::new(gl, &defines, FULLSCREEN, &[source!("resolve.frag")])? })
    }

    /// Draws into the bound target. `images` are depth, normals and, if the pass was compiled for it, colour, in this
    /// order. Of depth and normals, sample number `which` is kept.
    pub(crate) fn draw(&self, full_screen: &FullScreen, images: &[MultisampleTexture], which: u32) {
        let program = self.program.bind();
        for (unit, (name, image)) in
            (0..).zip(["depth_samples", "normal_samples", "colour_samples"].into_iter().zip(images))
        {
            full_screen.bind_samples(unit, image.id);
            program.unit(name, unit);
        }
        program.int("which", which as i32);
        full_screen.draw();
    }
}
