//! Multiplies a picture by visibility.

use super::gbuffer::program;
use hbao::TextureRef;
use hbao::glow::{self, HasContext};
use std::sync::Arc;

const VERTEX: &str = "
    // One triangle that covers the picture.
    void main()
    {
        gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
    }
";

const FRAGMENT: &str = "
    uniform sampler2DRect visibility;
    out vec4 factor;

    void main()
    {
        factor = vec4(vec3(texture(visibility, gl_FragCoord.xy).r), 1.0);
    }
";

/// The pass that multiplies. The context must be current at every call, and when this value is dropped.
pub struct Multiply {
    gl: Arc<glow::Context>,
    program: glow::Program,
    vertices: glow::VertexArray,
}

impl Multiply {
    pub fn new(gl: &Arc<glow::Context>) -> Result<Multiply, String> {
        // SAFETY: the context is current.
        unsafe {
            let (program, vertices) = (program(gl, VERTEX, FRAGMENT)?, gl.create_vertex_array()?);
            Ok(Multiply { gl: gl.clone(), program, vertices })
        }
    }

    /// Multiplies what the bound framebuffer holds. The viewport must have the size of the visibility.
    pub fn draw(&self, visibility: TextureRef) {
        let gl = &self.gl;
        // SAFETY: the context is current.
        unsafe {
            gl.use_program(Some(self.program));
            gl.bind_vertex_array(Some(self.vertices));
            gl.active_texture(glow::TEXTURE0);
            gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(visibility.texture));
            gl.enable(glow::BLEND);
            gl.blend_equation(glow::FUNC_ADD);
            gl.blend_func(glow::ZERO, glow::SRC_COLOR);
            gl.draw_arrays(glow::TRIANGLES, 0, 3);
            gl.disable(glow::BLEND);
        }
    }
}

impl Drop for Multiply {
    fn drop(&mut self) {
        // SAFETY: the objects are ours, and the context is current by the contract of the struct.
        unsafe {
            self.gl.delete_program(self.program);
            self.gl.delete_vertex_array(self.vertices);
        }
    }
}
