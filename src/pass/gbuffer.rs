//! Renders the G-buffer (ShaderX7 6.2, Input buffers): the linear depth, the normals and, if an image needs it, the
//! colour of the triangles, in one pass.

use super::skin::{Needs, Skins, Textures};
use super::{Grid, RAY};
use crate::Error;
use crate::gl::{Defines, Program, check, not_made, source};
use crate::scene::{Camera, Mesh};
use crate::settings::Normals;
use glam::DVec3;
use glow::HasContext;
use std::ops::Range;
use std::sync::Arc;

/// The unit vector towards the light in eye space. The light comes from over the viewer's left shoulder.
pub(crate) const LIGHT: [f32; 3] = [-0.398_014_9, 0.597_022_3, -0.696_526_1];
/// The factor of the ambient light, and the factor of the directional light.
pub(crate) const SHADING: [f64; 2] = [0.4, 0.6];

/// The name of the place that is given in errors while triangles are uploaded.
const TRIANGLES: &str = "gbuffer: triangles";

/// The variant of the shader that is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GBufferVariant {
    pub(crate) normals: Normals,
    pub(crate) orthographic: bool,
    /// True if normals are stored as n/2 + 1/2.
    pub(crate) biased: bool,
    /// True if colour is drawn too.
    pub(crate) colour: bool,
    pub(crate) needs: Needs,
}

pub(crate) struct GBuffer {
    gl: Arc<glow::Context>,
    program: Program,
    pub(crate) variant: GBufferVariant,
}

/// The triangles of a mesh, in the eye space of a camera and uploaded to OpenGL.
pub(crate) struct Triangles {
    gl: Arc<glow::Context>,
    vertices: glow::VertexArray,
    buffers: Vec<glow::Buffer>,
    slices: Vec<Slice>,
    skins: Skins,
    camera: Camera,
    /// The bytes of all buffers.
    pub(crate) bytes: u64,
}

/// A slice of depth, and the triangles that reach into it.
struct Slice {
    /// The depths at which the slice begins and ends.
    planes: [f64; 2],
    /// The triangles as indices, each three of the type u32.
    indices: glow::Buffer,
    /// The number and the colour of each of the mesh's groups in the slice, and its range of triangles in `indices`. No
    /// range is empty.
    groups: Vec<(usize, [f32; 3], Range<usize>)>,
}

impl GBuffer {
    pub(crate) fn new(gl: &Arc<glow::Context>, variant: GBufferVariant) -> Result<GBuffer, Error> {
        let defines = Defines::default()
            .word("NORMALS", variant.normals.name())
            .flag("ORTHOGRAPHIC", variant.orthographic)
            .flag("NORMALS_BIASED", variant.biased)
            .flag("COLOUR", variant.colour)
            .flag("TEXTURED", variant.needs.textured)
            .flag("CUT", variant.needs.cut)
            .flag("VERTEX_COLOURS", variant.needs.vertex_colours);
        let program = Program::new(gl, &defines, source!("gbuffer.vert"), &[RAY, source!("gbuffer.frag")])?;
        Ok(GBuffer { gl: gl.clone(), program, variant })
    }

    /// Transforms the triangles to eye space and uploads them, and those textures that are not among `textures` yet.
    /// The transformation is in float64, so that a scene far from the origin loses no precision.
    pub(crate) fn upload(&self, mesh: &Mesh, camera: &Camera, textures: &mut Textures) -> Result<Triangles, Error> {
        // OpenGL takes counts of indices and offsets in bytes as 32-bit signed integers. A triangle has 12 bytes.
        if i32::try_from(12 * mesh.triangles.len() as u64).is_err() {
            let count = mesh.triangles.len();
            return Err(Error::gl(
                "gbuffer",
                format!("{count} triangles are more than one draw can hold: split the model"),
            ));
        }
        let gl = &self.gl;
        let needs = self.variant.needs;
        let skins = Skins::new(mesh, needs, textures)?;
        // SAFETY: the context is current.
        let vertices = unsafe { gl.create_vertex_array() }.map_err(|_| not_made(gl, TRIANGLES))?;
        let mut triangles = Triangles {
            gl: gl.clone(),
            vertices,
            buffers: Vec::new(),
            slices: Vec::new(),
            skins,
            camera: *camera,
            bytes: 0,
        };
        // SAFETY: the context is current.
        unsafe { gl.bind_vertex_array(Some(vertices)) };
        let origin = origin(camera);
        let mut depths = Vec::with_capacity(mesh.positions.len());
        let positions = bytes(mesh.positions.iter().map(|&p| {
            let p = camera.to_eye(p);
            depths.push(p.z);
            (p - origin).as_vec3().to_array()
        }));
        triangles.attribute(self.program.attribute("vertex_position"), 3, &positions)?;
        if self.variant.normals == Normals::Vertex {
            let vertex_normals = mesh.vertex_normals();
            let normals = bytes(vertex_normals.iter().map(|&n| camera.direction_to_eye(n).as_vec3().to_array()));
            triangles.attribute(self.program.attribute("vertex_normal"), 3, &normals)?;
        }
        if needs.textured || needs.cut {
            let coordinates = bytes(mesh.coordinates().iter().map(|uv| uv.as_vec2().to_array()));
            triangles.attribute(self.program.attribute("vertex_coordinates"), 2, &coordinates)?;
        }
        if needs.vertex_colours {
            let colours = bytes(mesh.vertex_colours().iter().copied());
            triangles.attribute(self.program.attribute("vertex_colour"), 3, &colours)?;
        }
        for planes in slices(camera) {
            triangles.slice(mesh, &depths, planes)?;
        }
        check(gl, TRIANGLES)?;
        Ok(triangles)
    }

    /// Draws the triangles into the bound target of `size` texels. The depth test keeps the nearest surface.
    pub(crate) fn draw(&self, triangles: &Triangles, size: (u32, u32)) {
        let (gl, camera) = (&self.gl, &triangles.camera);
        let program = self.program.bind();
        Grid { full: size, scale: [1, 1] }.bind(program, camera.projection);
        program.vec2("near_far", [camera.near, camera.far]);
        if self.variant.colour {
            program.vec3("light", LIGHT).vec2("shading", SHADING);
        }
        // SAFETY: the context is current. The groups' ranges lie within the index buffers, because `Triangles::slice`
        // ensures that.
        unsafe {
            gl.enable(glow::DEPTH_TEST);
            gl.depth_func(glow::LESS);
            gl.depth_mask(true);
            gl.bind_vertex_array(Some(triangles.vertices));
            for Slice { planes: [near, far], indices, groups } in &triangles.slices {
                program.mat4("projection", &matrix(camera, *near, *far));
                gl.clear_buffer_f32_slice(glow::DEPTH, 0, &[1.0]);
                gl.bind_buffer(glow::ELEMENT_ARRAY_BUFFER, Some(*indices));
                for (group, colour, range) in groups {
                    triangles.skins.bind(program, *group);
                    if self.variant.colour {
                        program.vec3("diffuse", *colour);
                    }
                    let count = 3 * range.len() as i32;
                    gl.draw_elements(glow::TRIANGLES, count, glow::UNSIGNED_INT, 12 * range.start as i32);
                }
            }
            gl.disable(glow::DEPTH_TEST);
        }
    }
}

impl Triangles {
    /// Uploads the triangles of the mesh that reach into a slice of depth, whose ends are `planes`. `depths` are the
    /// depths of the mesh's positions. A slice that no triangle reaches is left out.
    fn slice(&mut self, mesh: &Mesh, depths: &[f64], planes: [f64; 2]) -> Result<(), Error> {
        let mut indices: Vec<u8> = Vec::with_capacity(12 * mesh.triangles.len());
        let mut groups = Vec::new();
        let mut count = 0;
        for (number, group) in mesh.groups.iter().enumerate() {
            let start = count;
            for triangle in &mesh.triangles[group.triangles.clone()] {
                if reaches(triangle.map(|i| depths[i as usize]), planes) {
                    triangle.iter().for_each(|i| indices.extend_from_slice(&i.to_ne_bytes()));
                    count += 1;
                }
            }
            if count > start {
                groups.push((number, group.colour, start..count));
            }
        }
        if !groups.is_empty() {
            let indices = self.buffer(glow::ELEMENT_ARRAY_BUFFER, &indices)?;
            self.slices.push(Slice { planes, indices, groups });
        }
        Ok(())
    }

    fn buffer(&mut self, target: u32, data: &[u8]) -> Result<glow::Buffer, Error> {
        // SAFETY: the context is current.
        unsafe {
            let buffer = self.gl.create_buffer().map_err(|_| not_made(&self.gl, TRIANGLES))?;
            self.buffers.push(buffer);
            self.bytes += data.len() as u64;
            self.gl.bind_buffer(target, Some(buffer));
            self.gl.buffer_data_u8_slice(target, data, glow::STATIC_DRAW);
            Ok(buffer)
        }
    }

    /// Uploads a vertex attribute of `count` floats. It is enabled if the shader reads it, so that it has a
    /// `location`.
    fn attribute(&mut self, location: Option<u32>, count: i32, data: &[u8]) -> Result<(), Error> {
        self.buffer(glow::ARRAY_BUFFER, data)?;
        if let Some(location) = location {
            // SAFETY: the context is current, the vertex array and the buffer are bound.
            unsafe {
                self.gl.enable_vertex_attrib_array(location);
                self.gl.vertex_attrib_pointer_f32(location, count, glow::FLOAT, false, 0, 0);
            }
        }
        Ok(())
    }
}

impl Drop for Triangles {
    fn drop(&mut self) {
        // SAFETY: the objects are ours, and the context is current by the contract of `gl`.
        unsafe {
            self.gl.delete_vertex_array(self.vertices);
            self.buffers.iter().for_each(|&buffer| self.gl.delete_buffer(buffer));
        }
    }
}

fn bytes<const N: usize>(vectors: impl Iterator<Item = [f32; N]>) -> Vec<u8> {
    vectors.flatten().flat_map(|f| f.to_ne_bytes()).collect()
}

/// The depth at which a slice ends is at most this multiple of the depth at which it begins, not counting [`OVERLAP`].
const SLICE: f64 = 100.0;

/// A slice reaches into the slice behind it, to this multiple of its own end depth, and is drawn over that slice.
/// Clipping at the end of a slice makes new corners, and the rasteriser moves these to a grid of 1/256 pixel. If a
/// surface that is seen edge-on passes through the whole overlap within one cell of the grid, a pixel centre on it may
/// be covered by neither slice. With an overlap of 1.01 the walls of an orthographic room had such holes.
const OVERLAP: f64 = 1.5;

/// Divides the view into slices of depth, as [near, far] of each, the farthest first. Each slice is drawn over those
/// behind it, with a cleared depth buffer.
///
/// The depth test resolves 2^-24 of 1/near - 1/far, or of far - near in an orthographic view. With a single slice and a
/// near/far ratio of 1e-6, the resolution would be 6 % of the depth at the far end, or at the near end in an
/// orthographic view. Within a slice it is 9e-6 of the depth. A depth that is written by the fragment shader could
/// resolve as much, but it would be the same for all samples of a pixel, and be evaluated at a point that may lie
/// outside the triangle.
fn slices(camera: &Camera) -> Vec<[f64; 2]> {
    let (near, far) = (camera.near, camera.far);
    let count = (far / near).log(SLICE).ceil().max(1.0);
    let end = |i: f64| if i == count { far } else { near * (far / near).powf(i / count) };
    (0..count as u32).rev().map(|i| [end(i.into()), (OVERLAP * end(f64::from(i) + 1.0)).min(far)]).collect()
}

/// Returns false if a triangle whose corners have these depths lies wholly before or wholly behind a slice of depth, so
/// that OpenGL would clip all of it away. OpenGL clips in float32, whose rounding moves the planes by less than 1e-4 of
/// the near one; `APART` leaves room for far more.
fn reaches(corners: [f64; 3], [near, far]: [f64; 2]) -> bool {
    const APART: f64 = 1e-2;
    !(corners.iter().all(|&z| z < near * (1.0 - APART)) || corners.iter().all(|&z| z > far * (1.0 + APART)))
}

/// Returns the point of the near plane on the view's axis in eye space, or the middle of the near plane if the view is
/// orthographic. The shader's positions are relative to it, because normals are computed as derivatives of positions.
/// These derivatives would lose precision if all positions contained the same large distance.
fn origin(camera: &Camera) -> DVec3 {
    // The near depth is rounded to float32, because the shader adds it in float32.
    let near = f64::from(camera.near as f32);
    let [x, y] = if camera.projection.is_perspective() { [0.0; 2] } else { camera.projection.middle_at(near) };
    DVec3::new(x, y, near)
}

/// Returns the matrix from left-handed eye space, relative to [`origin`], to clip space, column by column. Depths from
/// near to far become z from -w to w.
fn matrix(camera: &Camera, near: f64, far: f64) -> [f32; 16] {
    // The planes are moved apart slightly, because rounding in float32 might clip surfaces that lie exactly in them.
    // The shader clamps depths to the view's own planes.
    let (near, far) = (near * (1.0 - 1e-6), far * (1.0 + 1e-6));
    let mut m = [0.0; 16];
    let [half_x, half_y] = camera.projection.half_extents();
    m[0] = 1.0 / half_x;
    m[5] = 1.0 / half_y;
    if camera.projection.is_perspective() {
        // x = z middle is in the middle of the picture. In an orthographic view that is where the origin lies.
        let [x, y] = camera.projection.middle_at(1.0);
        m[8] = -x / half_x;
        m[9] = -y / half_y;
        m[10] = (far + near) / (far - near);
        m[11] = 1.0;
        m[14] = -2.0 * far * near / (far - near);
    } else {
        m[10] = 2.0 / (far - near);
        m[14] = -(far + near) / (far - near);
        m[15] = 1.0;
    }
    let start = origin(camera).z;
    m[12] += m[8] * start;
    m[13] += m[9] * start;
    m[14] += m[10] * start;
    m[15] += m[11] * start;
    m.map(|x| x as f32)
}
