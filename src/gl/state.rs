//! Saves the application's OpenGL state before passes run in its context, and restores it afterwards.

use super::{Target, check, is_invalid_operation};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;

/// How many texture units the passes use: units 0 to 3.
const UNITS: u32 = 4;

/// The capabilities that must be disabled for the passes. Blending is not listed, because it is enabled per draw
/// buffer.
const SWITCHES: [u32; 21] = [
    glow::DEPTH_TEST,
    glow::STENCIL_TEST,
    glow::SCISSOR_TEST,
    glow::CULL_FACE,
    glow::COLOR_LOGIC_OP,
    glow::RASTERIZER_DISCARD,
    glow::FRAMEBUFFER_SRGB,
    glow::SAMPLE_COVERAGE,
    glow::SAMPLE_ALPHA_TO_COVERAGE,
    glow::SAMPLE_MASK,
    glow::POLYGON_OFFSET_FILL,
    glow::PRIMITIVE_RESTART,
    glow::DITHER,
    glow::CLIP_DISTANCE0,
    glow::CLIP_DISTANCE1,
    glow::CLIP_DISTANCE2,
    glow::CLIP_DISTANCE3,
    glow::CLIP_DISTANCE4,
    glow::CLIP_DISTANCE5,
    glow::CLIP_DISTANCE6,
    glow::CLIP_DISTANCE7,
];

/// The stencil parameters of one face.
#[derive(Clone, Copy)]
struct Stencil {
    func: u32,
    reference: i32,
    value_mask: u32,
    write_mask: u32,
    fail: u32,
    depth_fail: u32,
    pass: u32,
}

impl Stencil {
    /// Returns the parameters of the front and of the back face. A framebuffer that has a stencil buffer must be bound,
    /// because OpenGL clamps the reference that it reports to the range of the bound framebuffer's stencil: without a
    /// stencil it reports 0 in place of the reference that was set.
    fn both(gl: &glow::Context) -> [Stencil; 2] {
        // SAFETY: the context is current, and these are core parameters of one value.
        let int = |parameter| unsafe { gl.get_parameter_i32(parameter) };
        let mask = |parameter| int(parameter) as u32;
        let front = Stencil {
            func: mask(glow::STENCIL_FUNC),
            reference: int(glow::STENCIL_REF),
            value_mask: mask(glow::STENCIL_VALUE_MASK),
            write_mask: mask(glow::STENCIL_WRITEMASK),
            fail: mask(glow::STENCIL_FAIL),
            depth_fail: mask(glow::STENCIL_PASS_DEPTH_FAIL),
            pass: mask(glow::STENCIL_PASS_DEPTH_PASS),
        };
        let back = Stencil {
            func: mask(glow::STENCIL_BACK_FUNC),
            reference: int(glow::STENCIL_BACK_REF),
            value_mask: mask(glow::STENCIL_BACK_VALUE_MASK),
            write_mask: mask(glow::STENCIL_BACK_WRITEMASK),
            fail: mask(glow::STENCIL_BACK_FAIL),
            depth_fail: mask(glow::STENCIL_BACK_PASS_DEPTH_FAIL),
            pass: mask(glow::STENCIL_BACK_PASS_DEPTH_PASS),
        };
        [front, back]
    }
}

/// The bindings of one texture unit.
#[derive(Clone, Copy)]
struct Unit {
    flat: Option<glow::Texture>,
    rectangle: Option<glow::Texture>,
    multisample: Option<glow::Texture>,
    array: Option<glow::Texture>,
    sampler: Option<glow::Sampler>,
}

/// The place that is given for errors that occur before a pass runs.
const SAVING: &str = "saving the application's state";

/// The state that the passes of [`crate::AmbientOcclusion`] change, as it was before them. It is restored when this
/// value is dropped.
pub(crate) struct SavedState {
    gl: Arc<glow::Context>,
    switches: [bool; SWITCHES.len()],
    blend: bool,
    colour_mask: [bool; 4],
    depth_mask: bool,
    /// The parameters of the front and of the back face; `None` if the passes use no stencil.
    stencil: Option<[Stencil; 2]>,
    viewport: [i32; 4],
    polygon_mode: u32,
    program: Option<glow::Program>,
    vertices: Option<glow::VertexArray>,
    draw: Option<glow::Framebuffer>,
    read: Option<glow::Framebuffer>,
    renderbuffer: Option<glow::Renderbuffer>,
    unpack_buffer: Option<glow::Buffer>,
    unpack: [i32; 6],
    active_unit: u32,
    units: [Unit; UNITS as usize],
}

const UNPACK: [u32; 6] = [
    glow::UNPACK_ALIGNMENT,
    glow::UNPACK_ROW_LENGTH,
    glow::UNPACK_SKIP_PIXELS,
    glow::UNPACK_SKIP_ROWS,
    glow::UNPACK_SWAP_BYTES,
    glow::UNPACK_LSB_FIRST,
];

impl SavedState {
    /// Saves the application's state and sets the state that every full-screen pass expects, in which nothing is
    /// tested, masked or blended. If the passes use a stencil, `stencil` is a target that has one; only then are the
    /// stencil's parameters saved.
    ///
    /// No OpenGL error may be pending.
    ///
    /// # Errors
    /// [`Error::Gl`] if transform feedback is active, or if OpenGL refuses a call.
    pub(crate) fn save(gl: &Arc<glow::Context>, stencil: Option<&Target>) -> Result<SavedState, Error> {
        // OpenGL 3.3 can neither pause transform feedback nor report that it is active. But while it is active,
        // glUseProgram is an error, even for the program that is already in use.
        // SAFETY: the context is current.
        unsafe { gl.use_program(gl.get_parameter_program(glow::CURRENT_PROGRAM)) };
        check(gl, SAVING).map_err(|error| match is_invalid_operation(&error) {
            true => Error::gl("ambient occlusion", "transform feedback is active: call glEndTransformFeedback first"),
            false => error,
        })?;
        // SAFETY: the context is current, and each parameter is core and has as many values as are read.
        unsafe {
            let int = |parameter| gl.get_parameter_i32(parameter);
            let mask = |parameter| gl.get_parameter_i32(parameter) as u32;
            let mut viewport = [0; 4];
            gl.get_parameter_i32_slice(glow::VIEWPORT, &mut viewport);
            // In some contexts Mesa writes two values, for front and back.
            let mut polygon_mode = [0; 2];
            gl.get_parameter_i32_slice(glow::POLYGON_MODE, &mut polygon_mode);
            let active_unit = mask(glow::ACTIVE_TEXTURE);
            let units = std::array::from_fn(|unit| {
                gl.active_texture(glow::TEXTURE0 + unit as u32);
                Unit {
                    flat: gl.get_parameter_texture(glow::TEXTURE_BINDING_2D),
                    rectangle: gl.get_parameter_texture(glow::TEXTURE_BINDING_RECTANGLE),
                    multisample: gl.get_parameter_texture(glow::TEXTURE_BINDING_2D_MULTISAMPLE),
                    array: gl.get_parameter_texture(glow::TEXTURE_BINDING_2D_ARRAY),
                    sampler: gl.get_parameter_sampler(glow::SAMPLER_BINDING),
                }
            });
            let mut saved = SavedState {
                gl: gl.clone(),
                switches: SWITCHES.map(|switch| gl.is_enabled(switch)),
                // glIsEnabled would not do: with Mesa's threaded dispatch it does not see what glEnablei has set.
                blend: gl.get_parameter_indexed_i32(glow::BLEND, 0) != 0,
                colour_mask: gl.get_parameter_bool_array(glow::COLOR_WRITEMASK),
                depth_mask: gl.get_parameter_bool(glow::DEPTH_WRITEMASK),
                stencil: None,
                viewport,
                polygon_mode: polygon_mode[0] as u32,
                program: gl.get_parameter_program(glow::CURRENT_PROGRAM),
                vertices: gl.get_parameter_vertex_array(glow::VERTEX_ARRAY_BINDING),
                draw: gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING),
                read: gl.get_parameter_framebuffer(glow::READ_FRAMEBUFFER_BINDING),
                renderbuffer: gl.get_parameter_renderbuffer(glow::RENDERBUFFER_BINDING),
                unpack_buffer: gl.get_parameter_buffer(glow::PIXEL_UNPACK_BUFFER_BINDING),
                unpack: UNPACK.map(int),
                active_unit,
                units,
            };
            if let Some(target) = stencil {
                target.bind();
                saved.stencil = Some(Stencil::both(gl));
            }
            SWITCHES.iter().for_each(|&switch| gl.disable(switch));
            gl.disable_draw_buffer(glow::BLEND, 0);
            gl.color_mask_draw_buffer(0, true, true, true, true);
            gl.depth_mask(false);
            gl.polygon_mode(glow::FRONT_AND_BACK, glow::FILL);
            gl.bind_buffer(glow::PIXEL_UNPACK_BUFFER, None);
            for (parameter, value) in UNPACK.into_iter().zip([4, 0, 0, 0, 0, 0]) {
                gl.pixel_store_i32(parameter, value);
            }
            Ok(saved)
        }
    }
}

impl SavedState {
    /// Runs the passes and then restores the state, whether the passes failed or not. An OpenGL error from saving or
    /// from restoring the state is reported as such: it is neither attributed to a pass nor left for the next run,
    /// which would take it for an error of the application.
    pub(crate) fn put_back_after<T>(
        self,
        gl: &glow::Context,
        run: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let result = check(gl, SAVING).and_then(|()| run());
        drop(self);
        let put_back = check(gl, "putting the application's state back");
        let value = result?;
        put_back?;
        Ok(value)
    }
}

/// Blending that multiplies colours by what is drawn and keeps their alpha. When this value is dropped, blending is
/// disabled, and the application's parameters are restored.
pub(crate) struct Multiplying {
    gl: Arc<glow::Context>,
    /// The factors and the equations of blending, for each draw buffer.
    blending: [[u32; 6]; MOST_DRAW_BUFFERS],
    /// The number of draw buffers whose parameters were saved: 1 if all have the same.
    buffers: usize,
}

/// More draw buffers than any driver has.
const MOST_DRAW_BUFFERS: usize = 16;

const BLENDING: [u32; 6] = [
    glow::BLEND_SRC_RGB,
    glow::BLEND_DST_RGB,
    glow::BLEND_SRC_ALPHA,
    glow::BLEND_DST_ALPHA,
    glow::BLEND_EQUATION_RGB,
    glow::BLEND_EQUATION_ALPHA,
];

impl Multiplying {
    /// Saves the parameters of blending, and sets them.
    ///
    /// # Errors
    /// [`Error::Gl`] if OpenGL does not tell the parameters.
    pub(crate) fn begin(gl: &Arc<glow::Context>) -> Result<Multiplying, Error> {
        // SAFETY: the context is current. OpenGL keeps the parameters for each draw buffer since version 4.0.
        unsafe {
            let all = BLENDING.map(|parameter| gl.get_parameter_i32(parameter) as u32);
            let mut blending = [all; MOST_DRAW_BUFFERS];
            let mut buffers = 1;
            if gl.version().major >= 4 {
                buffers = (gl.get_parameter_i32(glow::MAX_DRAW_BUFFERS).max(1) as usize).min(MOST_DRAW_BUFFERS);
                for (buffer, blending) in blending[..buffers].iter_mut().enumerate() {
                    *blending = BLENDING.map(|parameter| gl.get_parameter_indexed_i32(parameter, buffer as u32) as u32);
                }
                if blending[..buffers].iter().all(|own| *own == all) {
                    buffers = 1;
                }
            }
            check(gl, SAVING)?;
            gl.enable_draw_buffer(glow::BLEND, 0);
            gl.blend_equation(glow::FUNC_ADD);
            gl.blend_func_separate(glow::ZERO, glow::SRC_COLOR, glow::ZERO, glow::ONE);
            Ok(Multiplying { gl: gl.clone(), blending, buffers })
        }
    }
}

impl Drop for Multiplying {
    fn drop(&mut self) {
        let gl = &self.gl;
        // SAFETY: the context is current by the contract of `gl`; every value was read from it. Draw buffers differ
        // only if the application has called the functions that set one of them.
        unsafe {
            gl.disable_draw_buffer(glow::BLEND, 0);
            let [src_rgb, dst_rgb, src_alpha, dst_alpha, rgb, alpha] = self.blending[0];
            gl.blend_func_separate(src_rgb, dst_rgb, src_alpha, dst_alpha);
            gl.blend_equation_separate(rgb, alpha);
            for (buffer, own) in (0..).zip(&self.blending[..self.buffers]).skip(1) {
                let [src_rgb, dst_rgb, src_alpha, dst_alpha, rgb, alpha] = *own;
                gl.blend_func_separate_draw_buffer(buffer, src_rgb, dst_rgb, src_alpha, dst_alpha);
                gl.blend_equation_separate_draw_buffer(buffer, rgb, alpha);
            }
        }
    }
}

impl Drop for SavedState {
    fn drop(&mut self) {
        let gl = &self.gl;
        // SAFETY: the context is current by the contract of `gl`; every value was read from it.
        unsafe {
            for (unit, bound) in self.units.iter().enumerate() {
                gl.active_texture(glow::TEXTURE0 + unit as u32);
                gl.bind_texture(glow::TEXTURE_2D, bound.flat);
                gl.bind_texture(glow::TEXTURE_RECTANGLE, bound.rectangle);
                gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, bound.multisample);
                gl.bind_texture(glow::TEXTURE_2D_ARRAY, bound.array);
                gl.bind_sampler(unit as u32, bound.sampler);
            }
            gl.active_texture(self.active_unit);
            gl.bind_buffer(glow::PIXEL_UNPACK_BUFFER, self.unpack_buffer);
            for (parameter, value) in UNPACK.into_iter().zip(self.unpack) {
                gl.pixel_store_i32(parameter, value);
            }
            gl.bind_renderbuffer(glow::RENDERBUFFER, self.renderbuffer);
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, self.draw);
            gl.bind_framebuffer(glow::READ_FRAMEBUFFER, self.read);
            gl.bind_vertex_array(self.vertices);
            // A program that the application deleted while it was in use ceased to exist when a pass's program replaced
            // it.
            gl.use_program(self.program.filter(|&program| gl.is_program(program)));
            gl.polygon_mode(glow::FRONT_AND_BACK, self.polygon_mode);
            let [x, y, width, height] = self.viewport;
            gl.viewport(x, y, width, height);
            for (face, stencil) in [glow::FRONT, glow::BACK].into_iter().zip(self.stencil.into_iter().flatten()) {
                gl.stencil_func_separate(face, stencil.func, stencil.reference, stencil.value_mask);
                gl.stencil_mask_separate(face, stencil.write_mask);
                gl.stencil_op_separate(face, stencil.fail, stencil.depth_fail, stencil.pass);
            }
            gl.depth_mask(self.depth_mask);
            let [r, g, b, a] = self.colour_mask;
            gl.color_mask_draw_buffer(0, r, g, b, a);
            if self.blend {
                gl.enable_draw_buffer(glow::BLEND, 0);
            }
            for (switch, on) in SWITCHES.into_iter().zip(self.switches) {
                if on {
                    gl.enable(switch);
                } else {
                    gl.disable(switch);
                }
            }
        }
    }
}
