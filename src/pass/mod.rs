//! One file per pass, by the name of its shader in `glsl/`. A pass is made with what its shader must be compiled for,
//! and run with textures in and a target bound.

pub(crate) mod background;
pub(crate) mod blur;
#[cfg(feature = "render")]
pub(crate) mod composite;
pub(crate) mod edges;
#[cfg(feature = "render")]
pub(crate) mod gbuffer;
pub(crate) mod half_depth;
pub(crate) mod method;
#[cfg(feature = "render")]
pub(crate) mod probe;
#[cfg(feature = "render")]
pub(crate) mod resolve;

use crate::Error;
use crate::gl::{Defines, Program, Source, Texture, check, not_made, source};
use crate::projection::Projection;
use crate::settings::DepthSigma;
use glow::HasContext;
use std::sync::Arc;

/// What lies at background texels of a 32-bit linear depth image: so far that nothing there occludes, and with a square
/// that float32 can hold.
pub const BACKGROUND_R32F: f32 = 1e17;
/// The same for a 16-bit one.
pub const BACKGROUND_R16F: f32 = 6e4;

const FULLSCREEN: Source = source!("fullscreen.vert");
const FETCH: Source = source!("shared/fetch.glsl");
const RAY: Source = source!("shared/ray.glsl");

/// The kind of texture an input is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureTarget {
    /// `GL_TEXTURE_2D`.
    Texture2d,
    /// `GL_TEXTURE_RECTANGLE`: the faster one on software drivers.
    Rectangle,
}

impl TextureTarget {
    pub(crate) fn gl(self) -> u32 {
        match self {
            TextureTarget::Texture2d => glow::TEXTURE_2D,
            TextureTarget::Rectangle => glow::TEXTURE_RECTANGLE,
        }
    }
}

/// A texture of somebody else's, or one lent out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureRef {
    /// The texture. As an input its base level is read, level 0 unless the caller set another, whatever its filter and
    /// wrap modes.
    pub texture: glow::Texture,
    /// What kind it is.
    pub target: TextureTarget,
}

impl From<&Texture> for TextureRef {
    fn from(texture: &Texture) -> TextureRef {
        TextureRef { texture: texture.id, target: TextureTarget::Rectangle }
    }
}

/// A multisample texture (`GL_TEXTURE_2D_MULTISAMPLE`) of somebody else's that holds linear depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthSamples {
    /// The texture.
    pub texture: glow::Texture,
    /// How many samples a pixel has, as the driver gave them (`GL_TEXTURE_SAMPLES`).
    pub samples: u32,
}

/// The texels of a target, each of which stands for `scale` pixels of the full image in x and y: at half resolution
/// texel (i, j) for the pixel (2i, 2j), which is inside, since the size is rounded up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Grid {
    /// The full image's width and height.
    pub(crate) full: (u32, u32),
    pub(crate) scale: [u32; 2],
}

impl Grid {
    /// Width and height in texels.
    pub(crate) fn size(self) -> (u32, u32) {
        (self.full.0.div_ceil(self.scale[0]), self.full.1.div_ceil(self.scale[1]))
    }

    /// Of the full image, in texels.
    fn extent(self) -> [f64; 2] {
        [f64::from(self.full.0) / f64::from(self.scale[0]), f64::from(self.full.1) / f64::from(self.scale[1])]
    }

    /// Where the view's axis lies, in texels: at full.x / 2 pixels, of which texel x + 0.5 is number scale x + 0.5.
    fn axis(self) -> [f64; 2] {
        let along = |full: u32, scale: u32| (f64::from(full) / 2.0 + f64::from(scale - 1) / 2.0) / f64::from(scale);
        [along(self.full.0, self.scale[0]), along(self.full.1, self.scale[1])]
    }

    /// What a texel adds to x' and y' (`pixel` of `glsl/shared/ray.glsl`).
    fn texel_extent(self, projection: Projection) -> [f64; 2] {
        let [half_x, half_y] = projection.half_extents();
        let [x, y] = self.scale.map(f64::from);
        [x * 2.0 * half_x / f64::from(self.full.0), y * 2.0 * half_y / f64::from(self.full.1)]
    }

    /// Tells the program in use what `glsl/shared/ray.glsl` asks for.
    fn bind(self, program: &Program, projection: Projection) {
        let (width, height) = self.size();
        program
            .vec2("size", [f64::from(width), f64::from(height)])
            .vec2("extent", self.extent())
            .vec2("axis", self.axis())
            .vec2("pixel", self.texel_extent(projection));
    }
}

/// Linear depth as a pass reads it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthInput {
    pub(crate) image: TextureRef,
    /// Depths from here on are background.
    pub(crate) background: f32,
    /// Its width and height in texels: the full image's.
    pub(crate) size: (u32, u32),
}

impl DepthInput {
    /// Binds it to `unit` and tells the program in use.
    fn bind(&self, full_screen: &FullScreen, program: &Program, unit: u32) {
        full_screen.bind_texture(unit, self.image);
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        program
            .unit("depth_image", unit)
            .float("background", f64::from(self.background))
            .vec2("texel", [1.0 / width, 1.0 / height]);
    }
}

/// What `glsl/shared/fetch.glsl` is compiled for, where a texel of the target stands for so many pixels.
fn depth_defines(depth: TextureTarget, scale: [u32; 2]) -> Defines {
    let defines = match depth {
        TextureTarget::Rectangle => Defines::default().value("DEPTH_RECTANGLE", 1),
        TextureTarget::Texture2d => Defines::default(),
    };
    if scale == [1, 1] { defines } else { defines.value("SCALE", pixels(scale)) }
}

/// A scale in GLSL.
fn pixels([x, y]: [u32; 2]) -> String {
    format!("vec2({x}.0, {y}.0)")
}

/// s_z in a uniform of two numbers: in scene units, and as a share of the depth.
fn depth_sigma(program: &Program, sigma: DepthSigma) {
    program.vec2(
        "depth_sigma",
        match sigma {
            DepthSigma::Units(sigma) => [sigma.min(f32::MAX.into()), 0.0],
            DepthSigma::OfDepth(share) => [0.0, share],
        },
    );
}

/// Draws a triangle over the whole window, with a sampler that reads the nearest texel of level 0 and clamps.
pub(crate) struct FullScreen {
    gl: Arc<glow::Context>,
    vertices: glow::VertexArray,
    sampler: glow::Sampler,
}

impl FullScreen {
    pub(crate) fn new(gl: &Arc<glow::Context>) -> Result<FullScreen, Error> {
        const PLACE: &str = "full-screen triangle";
        // SAFETY: the context is current; core demands a vertex array even where no attribute is read.
        unsafe {
            let vertices = gl.create_vertex_array().map_err(|_| not_made(gl, PLACE))?;
            let sampler = gl.create_sampler().map_err(|_| {
                gl.delete_vertex_array(vertices);
                not_made(gl, PLACE)
            })?;
            let full_screen = FullScreen { gl: gl.clone(), vertices, sampler };
            for (parameter, value) in [
                (glow::TEXTURE_MIN_FILTER, glow::NEAREST),
                (glow::TEXTURE_MAG_FILTER, glow::NEAREST),
                (glow::TEXTURE_WRAP_S, glow::CLAMP_TO_EDGE),
                (glow::TEXTURE_WRAP_T, glow::CLAMP_TO_EDGE),
            ] {
                gl.sampler_parameter_i32(sampler, parameter, value as i32);
            }
            check(gl, PLACE)?;
            Ok(full_screen)
        }
    }

    /// Puts a texture on a unit, sampled as this pass samples.
    pub(crate) fn bind_texture(&self, unit: u32, image: TextureRef) {
        // SAFETY: the context is current; whether the texture is of that kind is the caller's promise, and otherwise
        // a GL error.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(image.target.gl(), Some(image.texture));
            self.gl.bind_sampler(unit, Some(self.sampler));
        }
    }

    /// Puts a multisample texture on a unit.
    pub(crate) fn bind_samples(&self, unit: u32, texture: glow::Texture) {
        // SAFETY: as `bind_texture`.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(texture));
        }
    }

    /// Draws with the program, target and state at hand.
    pub(crate) fn draw(&self) {
        // SAFETY: the context is current.
        unsafe {
            self.gl.bind_vertex_array(Some(self.vertices));
            self.gl.draw_arrays(glow::TRIANGLES, 0, 3);
        }
    }
}

impl Drop for FullScreen {
    fn drop(&mut self) {
        // SAFETY: both are ours, and the context current by the contract of `gl`.
        unsafe {
            self.gl.delete_vertex_array(self.vertices);
            self.gl.delete_sampler(self.sampler);
        }
    }
}
