//! Resolves multisample textures to one value per pixel: one sample of depth and normals, and the mean of the colours
//! (ShaderX7 6.2, Multisample antialiasing).

use super::{FULLSCREEN, FullScreen};
use crate::Error;
use crate::gl::{Defines, MultisampleTexture, Program, source};
use std::sync::Arc;

pub(crate) struct Resolve {
    program: Program,
}

impl Resolve {
    /// Compiles the pass for this number of samples per pixel.
    pub(crate) fn new(gl: &Arc<glow::Context>, samples: u32) -> Result<Resolve, Error> {
        let defines = Defines::default().value("SAMPLES", samples);
        Ok(Resolve { program: Program::new(gl, &defines, FULLSCREEN, &[source!("resolve.frag")])? })
    }

    /// Draws into the bound target. `images` are colour, depth and normals, in this order. Of depth and normals, sample
    /// number `which` is kept.
    pub(crate) fn draw(&self, full_screen: &FullScreen, images: [&MultisampleTexture; 3], which: u32) {
        let program = self.program.bind();
        for (unit, (name, image)) in
            (0..).zip(["colour_samples", "depth_samples", "normal_samples"].into_iter().zip(images))
        {
            full_screen.bind_samples(unit, image.id);
            program.unit(name, unit);
        }
        program.int("which", which as i32);
        full_screen.draw();
    }
}
