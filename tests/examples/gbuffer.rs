//! The G-buffer of an engine on OpenGL 3.3: colour, normals in eye space, and the depth buffer itself.

use super::{Model, SHADING};
use hbao::glam::Mat4;
use hbao::glow::{self, HasContext};
use std::sync::Arc;

const VERTEX: &str = "
    uniform mat4 view;
    uniform mat4 projection;

    layout(location = 0) in vec3 position;
    layout(location = 1) in vec3 normal;
    layout(location = 2) in vec3 colour;

    out vec3 eye_position;
    out vec3 eye_normal;
    out vec3 surface;

    void main()
    {
        vec4 eye = view * vec4(position, 1.0);
        eye_position = eye.xyz;
        eye_normal = mat3(view) * normal;
        surface = colour;
        gl_Position = projection * eye;
    }
";

const FRAGMENT: &str = "
    in vec3 eye_position;
    in vec3 eye_normal;
    in vec3 surface;

    layout(location = 0) out vec4 out_colour;
    layout(location = 1) out vec4 out_normal;

    void main()
    {
        // Both sides of a triangle are visible. The normal is that of the side that the eye sees.
        vec3 n = normalize(faceforward(eye_normal, eye_position, eye_normal));
        out_colour = vec4(shaded(surface, n), 1.0);
        out_normal = vec4(n, 0.0);
    }
";

/// A G-buffer, and the model that is drawn into it. The context must be current at every call, and when this value is
/// dropped.
pub struct GBuffer {
    gl: Arc<glow::Context>,
    pub size: (u32, u32),
    /// Shaded colour, in RGBA8.
    colour: glow::Texture,
    /// Normals in right-handed eye space, in RGBA16F. OpenGL 3.3 does not promise that signed normalised formats can
    /// be drawn into.
    pub normals: glow::Texture,
    /// The depth buffer, in DEPTH_COMPONENT24. It is a texture and not a renderbuffer, so that passes can read it.
    pub depth: glow::Texture,
    /// The matrix that depth was drawn with.
    pub projection: Mat4,
    view: Mat4,
    /// The framebuffer that holds all three.
    everything: glow::Framebuffer,
    /// Colour alone.
    pub picture: glow::Framebuffer,
    program: glow::Program,
    vertices: glow::VertexArray,
    buffer: glow::Buffer,
    count: i32,
}

impl GBuffer {
    pub fn new(gl: &Arc<glow::Context>, size: (u32, u32), model: &Model) -> Result<GBuffer, String> {
        let corners: Vec<f32> = model
            .parts
            .iter()
            .flat_map(|part| part.positions.iter().zip(&part.normals).map(|(p, n)| [*p, *n, part.colour]))
            .flatten()
            .flatten()
            .collect();
        let bytes: Vec<u8> = corners.iter().flat_map(|float| float.to_ne_bytes()).collect();
        // SAFETY: the context is current, and the buffer holds nine floats for each corner.
        unsafe {
            let colour = texture(gl, size, [glow::RGBA8, glow::RGBA, glow::UNSIGNED_BYTE])?;
            let normals = texture(gl, size, [glow::RGBA16F, glow::RGBA, glow::FLOAT])?;
            let depth = texture(gl, size, [glow::DEPTH_COMPONENT24, glow::DEPTH_COMPONENT, glow::UNSIGNED_INT])?;
            let everything = framebuffer(gl, &[colour, normals], Some(depth))?;
            let picture = framebuffer(gl, &[colour], None)?;
            let vertices = gl.create_vertex_array()?;
            gl.bind_vertex_array(Some(vertices));
            let buffer = gl.create_buffer()?;
            gl.bind_buffer(glow::ARRAY_BUFFER, Some(buffer));
            gl.buffer_data_u8_slice(glow::ARRAY_BUFFER, &bytes, glow::STATIC_DRAW);
            for attribute in 0..3 {
                gl.enable_vertex_attrib_array(attribute);
                gl.vertex_attrib_pointer_f32(attribute, 3, glow::FLOAT, false, 36, 12 * attribute as i32);
            }
            Ok(GBuffer {
                size,
                colour,
                normals,
                depth,
                projection: model.projection(size),
                view: model.view(),
                everything,
                picture,
                program: program(gl, VERTEX, &[SHADING, FRAGMENT].concat())?,
                vertices,
                buffer,
                count: (corners.len() / 9) as i32,
                gl: gl.clone(),
            })
        }
    }

    /// Draws the model. The state that this leaves is OpenGL's initial state, apart from the bindings and the viewport.
    pub fn draw(&self) {
        let (gl, (width, height)) = (&self.gl, self.size);
        // SAFETY: the context is current.
        unsafe {
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.everything));
            gl.viewport(0, 0, width as i32, height as i32);
            gl.disable(glow::SCISSOR_TEST);
            gl.disable(glow::BLEND);
            gl.disable(glow::CULL_FACE);
            gl.enable(glow::DEPTH_TEST);
            gl.clear_buffer_f32_slice(glow::COLOR, 0, &[1.0; 4]);
            gl.clear_buffer_f32_slice(glow::COLOR, 1, &[0.0; 4]);
            gl.clear_buffer_f32_slice(glow::DEPTH, 0, &[1.0]);
            gl.use_program(Some(self.program));
            for (name, matrix) in [("view", self.view), ("projection", self.projection)] {
                let location = gl.get_uniform_location(self.program, name);
                gl.uniform_matrix_4_f32_slice(location.as_ref(), false, matrix.as_ref());
            }
            gl.bind_vertex_array(Some(self.vertices));
            gl.draw_arrays(glow::TRIANGLES, 0, self.count);
            gl.disable(glow::DEPTH_TEST);
        }
    }

    /// Copies the colour to the window, with its lower left corner at (x, y).
    pub fn show(&self, (x, y): (i32, i32)) {
        let (gl, width, height) = (&self.gl, self.size.0 as i32, self.size.1 as i32);
        let (from, to) = ([0, 0, width, height], [x, y, x + width, y + height]);
        // SAFETY: the context is current.
        unsafe {
            gl.bind_framebuffer(glow::READ_FRAMEBUFFER, Some(self.picture));
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, None);
            gl.blit_framebuffer(
                from[0],
                from[1],
                from[2],
                from[3],
                to[0],
                to[1],
                to[2],
                to[3],
                glow::COLOR_BUFFER_BIT,
                glow::NEAREST,
            );
        }
    }
}

impl Drop for GBuffer {
    fn drop(&mut self) {
        // SAFETY: the objects are ours, and the context is current by the contract of the struct.
        unsafe {
            [self.colour, self.normals, self.depth].into_iter().for_each(|texture| self.gl.delete_texture(texture));
            [self.everything, self.picture].into_iter().for_each(|target| self.gl.delete_framebuffer(target));
            self.gl.delete_program(self.program);
            self.gl.delete_vertex_array(self.vertices);
            self.gl.delete_buffer(self.buffer);
        }
    }
}

/// Makes a texture without mipmaps. The format is given as OpenGL's internal format, format and type.
///
/// # Safety
/// The context must be current.
unsafe fn texture(
    gl: &glow::Context,
    (width, height): (u32, u32),
    [internal, format, kind]: [u32; 3],
) -> Result<glow::Texture, String> {
    // SAFETY: the caller vouches for the context, and no texels are given.
    unsafe {
        let texture = gl.create_texture()?;
        gl.bind_texture(glow::TEXTURE_2D, Some(texture));
        let (internal, nothing) = (internal as i32, glow::PixelUnpackData::Slice(None));
        gl.tex_image_2d(glow::TEXTURE_2D, 0, internal, width as i32, height as i32, 0, format, kind, nothing);
        Ok(texture)
    }
}

/// Makes a framebuffer that draws into all of these colours.
///
/// # Safety
/// The context must be current.
unsafe fn framebuffer(
    gl: &glow::Context,
    colours: &[glow::Texture],
    depth: Option<glow::Texture>,
) -> Result<glow::Framebuffer, String> {
    // SAFETY: the caller vouches for the context.
    unsafe {
        let framebuffer = gl.create_framebuffer()?;
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
        let places: Vec<u32> = (glow::COLOR_ATTACHMENT0..).take(colours.len()).collect();
        for (&place, &colour) in places.iter().zip(colours) {
            gl.framebuffer_texture_2d(glow::FRAMEBUFFER, place, glow::TEXTURE_2D, Some(colour), 0);
        }
        gl.framebuffer_texture_2d(glow::FRAMEBUFFER, glow::DEPTH_ATTACHMENT, glow::TEXTURE_2D, depth, 0);
        gl.draw_buffers(&places);
        match gl.check_framebuffer_status(glow::FRAMEBUFFER) {
            glow::FRAMEBUFFER_COMPLETE => Ok(framebuffer),
            status => Err(format!("the framebuffer is incomplete: {status:#x}")),
        }
    }
}

/// Compiles and links a program of OpenGL 3.3.
///
/// # Safety
/// The context must be current.
unsafe fn program(gl: &glow::Context, vertex: &str, fragment: &str) -> Result<glow::Program, String> {
    // SAFETY: the caller vouches for the context.
    unsafe {
        let program = gl.create_program()?;
        for (kind, source) in [(glow::VERTEX_SHADER, vertex), (glow::FRAGMENT_SHADER, fragment)] {
            let shader = gl.create_shader(kind)?;
            gl.shader_source(shader, &format!("#version 330 core\n{source}"));
            gl.compile_shader(shader);
            if !gl.get_shader_compile_status(shader) {
                return Err(gl.get_shader_info_log(shader));
            }
            gl.attach_shader(program, shader);
            gl.delete_shader(shader);
        }
        gl.link_program(program);
        if gl.get_program_link_status(program) { Ok(program) } else { Err(gl.get_program_info_log(program)) }
    }
}
