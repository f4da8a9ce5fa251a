//! Finds edge pixels, whose depth samples lie on different surfaces (ShaderX7 6.2, Multisample antialiasing).

use super::linear_depth::{self, SamplesInput, SamplesVariant};
use super::{FETCH, FULLSCREEN, FullScreen, depth_sigma};
use crate::Error;
use crate::gl::{Defines, Program, ProgramCache, source};
use crate::settings::Length;
use std::sync::Arc;

pub(crate) struct Edges {
    program: Arc<Program>,
}

impl Edges {
    /// Compiles the pass for depth samples of this number and encoding.
    pub(crate) fn new(programs: &mut ProgramCache, samples: SamplesVariant) -> Result<Edges, Error> {
        let pieces = [&[FETCH], &linear_depth::SAMPLES[..], &[source!("edges.frag")]].concat();
        Ok(Edges { program: programs.get(&samples.define(Defines::default()), FULLSCREEN, &pieces)? })
    }

    /// Draws at every pixel of the bound target that is an edge. The depth `background` and all greater ones are
    /// background. A pixel is an edge if its samples differ by more than `sigma`, or if some lie on a surface and some
    /// on background.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &SamplesInput, background: f32, sigma: Length) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        program.float("background", f64::from(background));
        depth_sigma(program, sigma);
        full_screen.draw();
    }
}
