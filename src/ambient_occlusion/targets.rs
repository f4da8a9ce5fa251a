//! The images that the passes draw into, and the stencil that says which of their pixels are drawn.

use super::plan::Plan;
use super::programs::Programs;
use crate::Error;
use crate::gl::{Canvas, Format, Renderbuffer};
use crate::image::Image;
use crate::pass::Grid;
use crate::pass::half_depth::HalfDepth;
use crate::pass::linear_depth::LinearDepth;
use crate::pass::method::reads_half_depth;
use crate::pass::rebuilt_normals::RebuiltNormals;
use crate::settings::{AoFormat, Settings};
use glow::HasContext;
use std::sync::Arc;

/// The stencil bit of pixels that hold a surface.
pub(super) const COVERED: u32 = 1;
/// The stencil bit of pixels that hold several surfaces.
pub(super) const EDGE: u32 = 2;

/// An image of ambient occlusion.
pub(super) struct AoTarget {
    pub(super) grid: Grid,
    pub(super) canvas: Canvas,
    pub(super) stencil: Arc<Renderbuffer>,
}

/// The images of one size.
pub(super) struct Images {
    /// The images of ambient occlusion. Each has a stencil with the bit [`COVERED`] at pixels that hold a surface, and
    /// the bit [`EDGE`] at edge pixels. Targets of the same size share one stencil.
    pub(super) ao: Vec<AoTarget>,
    pub(super) linear_depth: Option<Canvas>,
    pub(super) half_depth: Option<Canvas>,
    pub(super) rebuilt_normals: Option<Canvas>,
}

impl Images {
    /// Makes the images for views of this size that every kind of inputs needs. Changes bindings.
    pub(super) fn new(gl: &Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<Images, Error> {
        let mut images = Images { ao: Vec::new(), linear_depth: None, half_depth: None, rebuilt_normals: None };
        images.add(gl, size, settings, &Plan::new(settings, false))?;
        Ok(images)
    }

    /// Makes those images of ambient occlusion that the plan needs and that do not exist yet. All plans for the same
    /// settings begin with the same images. Changes bindings.
    fn add(
        &mut self,
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        plan: &Plan,
    ) -> Result<(), Error> {
        let format = match settings.ao_format {
            AoFormat::R8 => Format::R8,
            AoFormat::R16f => Format::R16f,
            AoFormat::R32f => Format::R32f,
        };
        for (i, &scale) in plan.scales.iter().enumerate().skip(self.ao.len()) {
            let grid = Grid { full: size, scale };
            let name = ["ao", "blur", "blurred"][i];
            let stencil = match self.ao.iter().find(|target| target.grid == grid) {
                Some(target) => target.stencil.clone(),
                None => {
                    let place = format!("{name}: stencil");
                    Arc::new(Renderbuffer::new(gl, &place, glow::DEPTH24_STENCIL8, grid.size(), 0)?)
                }
            };
            let canvas = Canvas::new(gl, name, format, grid.size(), Some(&stencil))?;
            self.ao.push(AoTarget { grid, canvas, stencil });
        }
        Ok(())
    }

    /// Returns the bytes of all images and stencils, as their formats and sizes say.
    pub(super) fn bytes(&self) -> u64 {
        let others = [&self.linear_depth, &self.half_depth, &self.rebuilt_normals].into_iter().flatten();
        let images: u64 =
            self.ao.iter().map(|target| &target.canvas).chain(others).map(|canvas| canvas.texture.bytes()).sum();
        // Images of the same size share a stencil.
        let first =
            |at: usize| self.ao[..at].iter().all(|earlier| !Arc::ptr_eq(&earlier.stencil, &self.ao[at].stencil));
        let own = (0..self.ao.len()).filter(|&at| first(at));
        images + own.map(|at| self.ao[at].stencil.bytes_per_sample).sum::<u64>()
    }

    /// Returns whether the texture is one of these images.
    pub(super) fn hold(&self, texture: glow::Texture) -> bool {
        let others = [&self.linear_depth, &self.half_depth, &self.rebuilt_normals].into_iter().flatten();
        self.ao.iter().map(|target| &target.canvas).chain(others).any(|canvas| canvas.texture.id == texture)
    }

    /// Makes all images that these programs draw into and that do not exist yet. Changes bindings.
    pub(super) fn complete(
        &mut self,
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        programs: &Programs,
    ) -> Result<(), Error> {
        self.add(gl, size, settings, &programs.plan)?;
        if programs.linear_depth.is_some() && self.linear_depth.is_none() {
            self.linear_depth = Some(LinearDepth::canvas(gl, size)?);
        }
        if programs.half_depth.is_some() && self.half_depth.is_none() {
            self.half_depth = Some(HalfDepth::canvas(gl, size)?);
        }
        if programs.rebuilt_normals.is_some() && self.rebuilt_normals.is_none() {
            let drawn = &self.ao[0];
            self.rebuilt_normals = Some(RebuiltNormals::canvas(gl, drawn.grid, Some(&drawn.stencil))?);
        }
        Ok(())
    }
}

/// Returns whether images that were made for some settings are those that other settings need.
pub(super) fn same_images(a: &Settings, b: &Settings) -> bool {
    let layout = |settings: &Settings| {
        let scales = [false, true].map(|multisample| Plan::new(settings, multisample).scales);
        (scales, settings.ao_format, reads_half_depth(settings), settings.reads_normals())
    };
    layout(a) == layout(b)
}

/// Runs `draw` so that it writes to the stencil only: it sets `bit` at every pixel drawn.
pub(super) fn mark(gl: &glow::Context, bit: u32, draw: impl FnOnce()) {
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_mask(bit);
        gl.stencil_func(glow::ALWAYS, bit as i32, 0xff);
        gl.stencil_op(glow::KEEP, glow::KEEP, glow::REPLACE);
        gl.color_mask_draw_buffer(0, false, false, false, false);
    }
    draw();
    // SAFETY: the context is current.
    unsafe {
        gl.color_mask_draw_buffer(0, true, true, true, true);
        gl.stencil_mask(0);
    }
}

/// Lets later passes draw only at pixels whose stencil bits under `mask` equal `bits`.
pub(super) fn only_where(gl: &glow::Context, bits: u32, mask: u32) {
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::STENCIL_TEST);
        gl.stencil_func(glow::EQUAL, bits as i32, mask);
    }
}

/// Reads the image of a target back.
pub(super) fn read(target: &AoTarget) -> Result<Image<f32>, Error> {
    let (width, height) = target.grid.size();
    Ok(Image { width: width as usize, height: height as usize, texels: target.canvas.texture.read()? })
}
