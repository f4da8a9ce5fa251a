//! Copies a caller's depth and normals to images that can be read back, whatever kinds of textures they are in.

use super::method::{NormalsInput, NormalsVariant};
use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, ImageVariant, RAY, SURFACE, depth_defines};
use crate::Error;
use crate::gl::{Format, Program, Target, Texture, source};
use std::sync::Arc;

/// The pass and the images that it draws.
pub(crate) struct Inspect {
    program: Program,
    pub(crate) depth: Texture,
    /// Normals as they are stored.
    pub(crate) normals: Texture,
    target: Target,
}

impl Inspect {
    /// Compiles the pass for textures of these kinds, and makes its images, which are of this size.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        depth: ImageVariant,
        normals: NormalsVariant,
        size: (u32, u32),
    ) -> Result<Inspect, Error> {
        let texture = |place, format| Texture::new(gl, place, format, size.0, size.1);
        let images = (texture("inspect: depth", Format::R32f)?, texture("inspect: normals", Format::Rgba32f)?);
        let defines = normals.define(depth_defines(depth, [1, 1]));
        Ok(Inspect {
            program: Program::new(gl, &defines, FULLSCREEN, &[FETCH, RAY, SURFACE, source!("inspect.frag")])?,
            target: Target::new(gl, "inspect: framebuffer", &[&images.0, &images.1], None, size)?,
            depth: images.0,
            normals: images.1,
        })
    }

    /// Draws into the pass's own target, and leaves it bound.
    pub(crate) fn draw(&self, full_screen: &FullScreen, depth: &DepthInput, normals: Option<&NormalsInput>) {
        self.target.bind();
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        if let Some(normals) = normals {
            normals.bind(full_screen, program, depth.size);
        }
        full_screen.draw();
    }
}
