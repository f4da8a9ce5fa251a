//! The passes of one frame, in their order.

use super::AmbientOcclusion;
use super::inputs::Inputs;
use super::programs::{InputKind, Programs, Purpose};
use super::targets::{COVERED, EDGE, mark, only_where, read};
use crate::Error;
use crate::gl::Timers;
use crate::image::Image;
use crate::pass::method::{MethodView, NormalsInput};
use crate::projection::Projection;
use crate::settings::{Length, MethodBlur};
use glow::HasContext;

/// The most kinds of inputs whose programs are kept. An application rarely has more than two.
const KINDS: usize = 8;

/// The results that a run keeps besides ambient occlusion itself.
#[derive(Clone, Copy, Default)]
pub(crate) struct Extras {
    /// Keep ambient occlusion as it was before the blur.
    pub(crate) raw: bool,
    /// Keep which pixels are edges.
    pub(crate) edges: bool,
    /// Draw only this part of the picture, whose surroundings are read and not needed: left, bottom, width and height
    /// in pixels. Elsewhere ambient occlusion is 1.
    pub(crate) within: Option<[u32; 4]>,
}

/// The results that an [`Extras`] asked for.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) raw: Option<Image<f32>>,
    pub(crate) edges: Option<Image<bool>>,
}

/// Draws into a part of the picture only, if there is one, on a grid of this many pixels per texel.
fn within(gl: &glow::Context, part: Option<[u32; 4]>, scale: [u32; 2], draw: impl FnOnce()) {
    let Some([left, bottom, width, height]) = part else { return draw() };
    let along = |first: u32, count: u32, scale: u32| {
        let start = first / scale;
        [start as i32, ((first + count).div_ceil(scale) - start) as i32]
    };
    let [x, y] = [along(left, width, scale[0]), along(bottom, height, scale[1])];
    // SAFETY: the context is current.
    unsafe {
        gl.enable(glow::SCISSOR_TEST);
        gl.scissor(x[0], y[0], x[1], y[1]);
        draw();
        gl.disable(glow::SCISSOR_TEST);
    }
}

impl AmbientOcclusion {
    /// Runs the passes, and reads back what `extras` asks for. The state must be the one that passes expect.
    pub(super) fn passes(&mut self, inputs: &Inputs, timers: &mut Timers, extras: Extras) -> Result<Kept, Error> {
        let gl = self.gl.clone();
        self.result = None;
        let checked = inputs.check(&gl, self.size, self.settings.method)?;
        let settings = &self.settings;
        let radius = settings.radius_read(inputs.projection)?;
        let sigma = self.depth_sigma(inputs.projection)?;
        self.current = self.programs_for(checked.kind(inputs, extras.edges))?;
        let (programs, full_screen, images) = (&self.programs[self.current], &self.full_screen, &self.images);
        let targets = &images.ao;
        let last = &targets[programs.plan.last()];
        let mut kept = Kept::default();

        let mut depth = checked.depth;
        if let (Some(linear_depth), Some(image)) = (&programs.linear_depth, &images.linear_depth) {
            timers.pass("linear_depth", || {
                // This target has no stencil: background is not known before this pass.
                depth = linear_depth.draw(full_screen, image, &checked.depth, checked.curve);
                Ok(())
            })?;
        }
        timers.pass("background", || {
            // Every target is cleared to 1, the value of background. The stencil keeps every pass away from background.
            for target in &targets[..programs.plan.scales.len()] {
                target.canvas.framebuffer.bind();
                // SAFETY: the context is current.
                unsafe { gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]) };
            }
            for (target, background) in &programs.stencils {
                targets[*target].canvas.framebuffer.bind();
                // SAFETY: the context is current.
                unsafe {
                    gl.stencil_mask(0xff);
                    gl.clear_buffer_i32_slice(glow::STENCIL, 0, &[0]);
                }
                // All later passes draw only where this one has marked.
                let draw = || mark(&gl, COVERED, || background.draw(full_screen, &depth));
                within(&gl, extras.within, targets[*target].grid.scale, draw);
            }
            Ok(())
        })?;
        if let (Some(half_depth), Some(image)) = (&programs.half_depth, &images.half_depth) {
            timers.pass("half_depth", || {
                // This target has no stencil, so background is drawn too.
                half_depth.draw(full_screen, image, &depth);
                Ok(())
            })?;
        }
        let mut normals = checked.normals;
        if let (Some(rebuilt), Some(image)) = (&programs.rebuilt_normals, &images.rebuilt_normals) {
            timers.pass("rebuilt_normals", || {
                only_where(&gl, COVERED, COVERED);
                rebuilt.draw(full_screen, (image, targets[0].grid), &depth, inputs.projection);
                normals = Some(NormalsInput { image: (&image.texture).into(), part: None, to_eye: None });
                Ok(())
            })?;
        }
        if let Some(ao) = &programs.ao {
            timers.pass("ao", || {
                targets[0].canvas.framebuffer.bind();
                only_where(&gl, COVERED, COVERED);
                let view =
                    MethodView { grid: targets[0].grid, projection: inputs.projection, near: inputs.near_plane() };
                ao.draw(full_screen, &depth, normals.as_ref(), view, radius, &self.settings);
                Ok(())
            })?;
        }
        if extras.raw {
            kept.raw = Some(read(&targets[0])?);
        }
        if let (Some(edges), Some(samples), Some(full)) = (&programs.edges, &checked.samples, programs.plan.full()) {
            timers.pass("edges", || {
                targets[full].canvas.framebuffer.bind();
                let draw = || mark(&gl, EDGE, || edges.draw(full_screen, samples, depth.background, sigma));
                within(&gl, extras.within, [1, 1], draw);
                Ok(())
            })?;
        }
        for (step, blur) in &programs.blurs {
            let (from, to) = (&targets[step.from], &targets[step.to]);
            timers.pass(step.name, || {
                to.canvas.framebuffer.bind();
                // The last pass leaves edge pixels out if a pass of their own draws them afterwards.
                let left_out = if programs.blur_edges.is_some() && step.to == programs.plan.last() { EDGE } else { 0 };
                only_where(&gl, COVERED, COVERED | left_out);
                blur.draw(full_screen, &from.canvas.texture, &depth, None, sigma);
                Ok(())
            })?;
        }
        if let Some((step, blur)) = &programs.blur_edges {
            timers.pass(step.name, || {
                last.canvas.framebuffer.bind();
                only_where(&gl, EDGE, EDGE);
                blur.draw(full_screen, &targets[step.from].canvas.texture, &depth, checked.samples.as_ref(), sigma);
                Ok(())
            })?;
        }
        if extras.edges {
            let (width, height) = (self.size.0 as usize, self.size.1 as usize);
            let texels = match (&programs.edges, programs.plan.full()) {
                (Some(_), Some(full)) => targets[full]
                    .canvas
                    .framebuffer
                    .read_stencil("edges: reading them back")?
                    .iter()
                    .map(|bits| u32::from(*bits) & EDGE != 0)
                    .collect(),
                _ => vec![false; width * height],
            };
            kept.edges = Some(Image { width, height, texels });
        }
        self.result = Some(programs.plan.last());
        Ok(kept)
    }

    /// Returns the depth sigma of the blur.
    fn depth_sigma(&self, projection: Projection) -> Result<Length, Error> {
        let sigma = self.settings.depth_sigma(projection);
        // A method without a blur, whose A is 1 everywhere, needs no depth sigma. Therefore it needs no radius either,
        // from which the sigma would follow.
        match (self.settings.method.facts().blur, self.purpose) {
            (MethodBlur::None, Purpose::Visibility) => sigma.or(Ok(Length::Units(0.0))),
            _ => sigma,
        }
    }

    /// Returns the index of the programs for a kind of inputs. The programs are compiled, and the images that they draw
    /// into are made, if they do not exist yet.
    fn programs_for(&mut self, kind: InputKind) -> Result<usize, Error> {
        if let Some(found) = self.programs.iter().position(|programs| programs.kind == kind) {
            self.images.complete(&self.gl, self.size, &self.settings, &self.programs[found])?;
            return Ok(found);
        }
        let programs = Programs::new(&mut self.cache, &self.settings, self.purpose, kind)?;
        self.images.complete(&self.gl, self.size, &self.settings, &programs)?;
        if self.programs.len() == KINDS {
            self.programs.remove(0);
        }
        self.programs.push(programs);
        Ok(self.programs.len() - 1)
    }
}
