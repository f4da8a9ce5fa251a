//! Finds edge pixels, whose depth samples lie on different surfaces (ShaderX7 6.2, Multisample antialiasing).

use super::{DepthSamples, FULLSCREEN, FullScreen, depth_sigma};
use crate::Error;
use crate::gl::{Defines, Program, source};
use crate::settings::DepthSigma;
use std::sync::Arc;

pub(crate) struct Edges {
    program: Program,
}

impl Edges {
    /// Compiles the pass for this number of samples per pixel.
    pub(crate) fn new(gl: &Arc<glow::Context>, samples: u32) -> Result<Edges, Error> {
        let defines = Defines::default().value("SAMPLES", samples);
        Ok(Edges { program: Program::new(gl, &defines, FULLSCREEN, &[source!("edges.frag")])? })
    }

    /// Draws at every pixel of the bound target that is an edge. The depth `background` and all greater ones are
    /// background. A pixel is an edge if its samples differ by more than `sigma`, or if some lie on a surface and some
    /// on background.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: DepthSamples, background: f32, sigma: DepthSigma) {
        let program = self.program.bind();
        full_screen.bind_samples(0, depth.texture);
        program.unit("depth_samples", 0).float("background", f64::from(background));
        depth_sigma(program, sigma);
        full_screen.draw();
    }
}
