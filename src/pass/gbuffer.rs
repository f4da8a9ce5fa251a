//! The G-buffer (ShaderX7 6.2, Input buffers): colour, linear depth and normals of the triangles, in one pass.

use super::{Grid, RAY};
use crate::Error;
use crate::gl::{Defines, Program, check, not_made, source};
use crate::scene::{Camera, Mesh};
use crate::settings::Normals;
use glam::DVec3;
use glow::HasContext;
use std::ops::Range;
use std::sync::Arc;

/// Unit vector towards the light in eye space: over the viewer's left shoulder.
pub(crate) const LIGHT: [f32; 3] = [-0.398_014_9, 0.597_022_3, -0.696_526_1];
/// The share of the colour that is ambient, and the share that follows the light.
pub(crate) const SHADING: [f64; 2] = [0.4, 0.6];

/// Names the upload in errors.
const TRIANGLES: &str = "gbuffer: triangles";

/// What the shader is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GBufferVariant {
    pub(crate) normals: Normals,
    pub(crate) orthographic: bool,
    /// Normals are stored as n/2 + 1/2.
    pub(crate) biased: bool,
}

/// The pass.
pub(crate) struct GBuffer {
    gl: Arc<glow::Context>,
    program: Program,
    pub(crate) variant: GBufferVariant,
}

/// A mesh's triangles in a camera's eye space, uploaded.
pub(crate) struct Triangles {
    gl: Arc<glow::Context>,
    vertices: glow::VertexArray,
    buffers: Vec<glow::Buffer>,
    groups: Vec<([f32; 3], Range<usize>)>,
    camera: Camera,
}

impl GBuffer {
    pub(crate) fn new(gl: &Arc<glow::Context>, variant: GBufferVariant) -> Result<GBuffer, Error> {
        let mut defines = Defines::default().word("NORMALS", variant.normals.name());
        for (name, on) in [("ORTHOGRAPHIC", variant.orthographic), ("NORMALS_BIASED", variant.biased)] {
            if on {
                defines = defines.value(name, 1);
            }
        }
        let program = Program::new(gl, &defines, source!("gbuffer.vert"), &[RAY, source!("gbuffer.frag")])?;
        Ok(GBuffer { gl: gl.clone(), program, variant })
    }

    /// Transforms the triangles in float64, so that a scene far from the origin loses nothing, and uploads them.
    pub(crate) fn upload(&self, mesh: &Mesh, camera: &Camera) -> Result<Triangles, Error> {
        // OpenGL counts indices and bytes into them in 31 bits; a triangle has 12 bytes.
        if i32::try_from(12 * mesh.triangles.len() as u64).is_err() {
            let count = mesh.triangles.len();
            return Err(Error::gl(
                "gbuffer",
                format!("{count} triangles are more than one draw can hold: split the model"),
            ));
        }
        let gl = &self.gl;
        // SAFETY: the context is current.
        let vertices = unsafe { gl.create_vertex_array() }.map_err(|_| not_made(gl, TRIANGLES))?;
        let mut triangles = Triangles {
            gl: gl.clone(),
            vertices,
            buffers: Vec::new(),
            groups: mesh.groups.iter().map(|group| (group.colour, group.triangles.clone())).collect(),
            camera: *camera,
        };
        // SAFETY: the context is current.
        unsafe { gl.bind_vertex_array(Some(vertices)) };
        let origin = origin(camera);
        let positions = bytes(mesh.positions.iter().map(|&p| (camera.to_eye(p) - origin).as_vec3().to_array()));
        triangles.attribute(self.program.attribute("vertex_position"), &positions)?;
        if self.variant.normals == Normals::Vertex {
            let vertex_normals = mesh.vertex_normals();
            let normals = bytes(vertex_normals.iter().map(|&n| camera.direction_to_eye(n).as_vec3().to_array()));
            triangles.attribute(self.program.attribute("vertex_normal"), &normals)?;
        }
        let indices: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_ne_bytes()).collect();
        triangles.buffer(glow::ELEMENT_ARRAY_BUFFER, &indices)?;
        check(gl, TRIANGLES)?;
        Ok(triangles)
    }

    /// Draws the triangles into the bound target of `size` texels, nearest first by the depth test.
    pub(crate) fn draw(&self, triangles: &Triangles, size: (u32, u32)) {
        let (gl, camera) = (&self.gl, &triangles.camera);
        let program = self.program.bind();
        Grid { full: size, scale: [1, 1] }.bind(program, camera.projection);
        program.vec3("light", LIGHT).vec2("shading", SHADING).vec2("near_far", [camera.near, camera.far]);
        // SAFETY: the context is current; the groups' ranges lie within the index buffer, by `Mesh`'s contract.
        unsafe {
            gl.enable(glow::DEPTH_TEST);
            gl.depth_func(glow::LESS);
            gl.depth_mask(true);
            gl.bind_vertex_array(Some(triangles.vertices));
            for [near, far] in slices(camera) {
                program.mat4("projection", &matrix(camera, near, far));
                gl.clear_buffer_f32_slice(glow::DEPTH, 0, &[1.0]);
                for (colour, range) in &triangles.groups {
                    program.vec3("diffuse", *colour);
                    let count = 3 * range.len() as i32;
                    gl.draw_elements(glow::TRIANGLES, count, glow::UNSIGNED_INT, 12 * range.start as i32);
                }
            }
            gl.disable(glow::DEPTH_TEST);
        }
    }
}

impl Triangles {
    fn buffer(&mut self, target: u32, data: &[u8]) -> Result<(), Error> {
        // SAFETY: the context is current.
        unsafe {
            let buffer = self.gl.create_buffer().map_err(|_| not_made(&self.gl, TRIANGLES))?;
            self.buffers.push(buffer);
            self.gl.bind_buffer(target, Some(buffer));
            self.gl.buffer_data_u8_slice(target, data, glow::STATIC_DRAW);
        }
        Ok(())
    }

    /// A vertex attribute of three floats.
    fn attribute(&mut self, location: Option<u32>, data: &[u8]) -> Result<(), Error> {
        self.buffer(glow::ARRAY_BUFFER, data)?;
        if let Some(location) = location {
            // SAFETY: the context is current, the vertex array and the buffer are bound.
            unsafe {
                self.gl.enable_vertex_attrib_array(location);
                self.gl.vertex_attrib_pointer_f32(location, 3, glow::FLOAT, false, 0, 0);
            }
        }
        Ok(())
    }
}

impl Drop for Triangles {
    fn drop(&mut self) {
        // SAFETY: all are ours, and the context current by the contract of `gl`.
        unsafe {
            self.gl.delete_vertex_array(self.vertices);
            self.buffers.iter().for_each(|&buffer| self.gl.delete_buffer(buffer));
        }
    }
}

fn bytes(vectors: impl Iterator<Item = [f32; 3]>) -> Vec<u8> {
    vectors.flatten().flat_map(|f| f.to_ne_bytes()).collect()
}

/// How far away the end of a slice may be, as a multiple of its beginning.
const SLICE: f64 = 100.0;

/// How far a slice reaches into the one behind it, which it is drawn over. The corners that clipping makes are put on
/// the rasteriser's grid of 256 to a pixel: where a surface seen edge-on goes through the overlap within one of these,
/// a pixel centre on it may fall between the slices. At 1.01 walls of an orthographic room had such holes.
const OVERLAP: f64 = 1.5;

/// The view in slices of depth, the farthest first, each drawn over those behind it with a depth buffer of its own. The
/// depth test resolves 2^-24 of 1/near - 1/far, or of far - near where the view is orthographic: over the whole of a
/// near/far ratio of 1e-6 that would leave 6 % of the distance at the far end, or at the near one; over a slice it is
/// 9e-6. A depth written by the fragment shader would resolve as much, but be one for all samples of a pixel, taken
/// where the triangle may not even be.
fn slices(camera: &Camera) -> Vec<[f64; 2]> {
    let (near, far) = (camera.near, camera.far);
    let count = (far / near).log(SLICE).ceil().max(1.0);
    let end = |i: f64| if i == count { far } else { near * (far / near).powf(i / count) };
    (0..count as u32).rev().map(|i| [end(i.into()), (OVERLAP * end(f64::from(i) + 1.0)).min(far)]).collect()
}

/// The middle of the near plane, which the shader's positions are relative to. What moves from pixel to pixel is then
/// not rounded off beside a distance that all of the scene has in common: normals are its derivatives.
fn origin(camera: &Camera) -> DVec3 {
    // As the shader adds it.
    f64::from(camera.near as f32) * DVec3::Z
}

/// Left-handed eye space, relative to the origin, to clip space, column by column: z from near to far becomes -w to w.
fn matrix(camera: &Camera, near: f64, far: f64) -> [f32; 16] {
    // A hair apart from the planes, on which float32 might clip what lies in them; the shader clamps z to the view's.
    let (near, far) = (near * (1.0 - 1e-6), far * (1.0 + 1e-6));
    let mut m = [0.0; 16];
    let [half_x, half_y] = camera.projection.half_extents();
    m[0] = 1.0 / half_x;
    m[5] = 1.0 / half_y;
    if camera.projection.is_perspective() {
        m[10] = (far + near) / (far - near);
        m[11] = 1.0;
        m[14] = -2.0 * far * near / (far - near);
    } else {
        m[10] = 2.0 / (far - near);
        m[14] = -(far + near) / (far - near);
        m[15] = 1.0;
    }
    let start = origin(camera).z;
    m[14] += m[10] * start;
    m[15] += m[11] * start;
    m.map(|x| x as f32)
}
