//! The passes, one file each under the name of its shader in `glsl/`. A pass is created for the variant that its shader
//! must be compiled for. To run it, its target is bound and its textures are passed in.

pub(crate) mod apply;
pub(crate) mod background;
pub(crate) mod blur;
#[cfg(feature = "render")]
pub(crate) mod composite;
pub(crate) mod edges;
#[cfg(feature = "render")]
pub(crate) mod gbuffer;
pub(crate) mod half_depth;
pub(crate) mod inspect;
pub(crate) mod linear_depth;
pub(crate) mod method;
#[cfg(feature = "render")]
pub(crate) mod probe;
pub(crate) mod rebuilt_normals;
#[cfg(feature = "render")]
pub(crate) mod resolve;
#[cfg(feature = "render")]
pub(crate) mod skin;

use crate::Error;
use crate::gl::{Defines, Program, Source, Texture, check, not_made, source};
use crate::projection::Projection;
use crate::settings::Length;
use glow::HasContext;
use std::sync::Arc;

/// The depth that background texels hold in a 32-bit image of linear depth. It is so far away that background never
/// occludes, and float32 can hold its square.
pub const BACKGROUND_R32F: f32 = 1e17;
/// The depth that background texels hold in a 16-bit image of linear depth.
pub const BACKGROUND_R16F: f32 = 6e4;

const FULLSCREEN: Source = source!("fullscreen.vert");
const FETCH: Source = source!("shared/fetch.glsl");
const RAY: Source = source!("shared/ray.glsl");
const SURFACE: Source = source!("shared/surface.glsl");

/// The kind of a texture, as the target that it is bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureTarget {
    /// `GL_TEXTURE_2D`.
    Texture2d,
    /// `GL_TEXTURE_RECTANGLE`, which is faster than `GL_TEXTURE_2D` on software drivers.
    Rectangle,
    /// One layer of a `GL_TEXTURE_2D_ARRAY`.
    Layer(u32),
    /// `GL_TEXTURE_2D_MULTISAMPLE` with this number of samples per pixel, the number that the driver gave
    /// (`GL_TEXTURE_SAMPLES`). Of normals the first sample is read. Of depth it is too, and on edge pixels the blur
    /// reads all samples, as [`Inputs::samples`](crate::Inputs::samples) describes.
    Multisample(u32),
}

impl TextureTarget {
    pub(crate) fn gl(self) -> u32 {
        match self {
            TextureTarget::Texture2d => glow::TEXTURE_2D,
            TextureTarget::Rectangle => glow::TEXTURE_RECTANGLE,
            TextureTarget::Layer(_) => glow::TEXTURE_2D_ARRAY,
            TextureTarget::Multisample(_) => glow::TEXTURE_2D_MULTISAMPLE,
        }
    }

    /// Returns the word by which shaders are compiled for this kind, after `DEPTH_` or `NORMALS_`.
    fn word(self) -> Option<&'static str> {
        match self {
            TextureTarget::Texture2d => None,
            TextureTarget::Rectangle => Some("RECTANGLE"),
            TextureTarget::Layer(_) => Some("LAYER"),
            TextureTarget::Multisample(_) => Some("MULTISAMPLE"),
        }
    }

    fn layer(self) -> u32 {
        if let TextureTarget::Layer(layer) = self { layer } else { 0 }
    }
}

/// A texture that is passed in by its owner, or lent out by this library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureRef {
    /// The texture. If it is an input, its base level is read, which is level 0 unless the caller sets another. Its
    /// filter and wrap modes have no effect.
    pub texture: glow::Texture,
    /// The kind of the texture.
    pub target: TextureTarget,
}

impl From<&Texture> for TextureRef {
    fn from(texture: &Texture) -> TextureRef {
        TextureRef { texture: texture.id, target: TextureTarget::Rectangle }
    }
}

/// A multisample texture (`GL_TEXTURE_2D_MULTISAMPLE`) of depth, which the caller owns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthSamples {
    /// The texture.
    pub texture: glow::Texture,
    /// The number of samples per pixel that the driver gave (`GL_TEXTURE_SAMPLES`).
    pub samples: u32,
}

/// The grid of texels of a target. Each texel stands for `scale` pixels of the full image in x and y. At half
/// resolution texel (i, j) takes its depth and normal from the pixel (2i, 2j). That pixel is inside the full image,
/// because the size of the grid is rounded up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Grid {
    /// The width and height of the full image in pixels.
    pub(crate) full: (u32, u32),
    pub(crate) scale: [u32; 2],
}

impl Grid {
    /// Returns the width and height of the grid in texels.
    pub(crate) fn size(self) -> (u32, u32) {
        (self.full.0.div_ceil(self.scale[0]), self.full.1.div_ceil(self.scale[1]))
    }

    /// Returns the size of the whole picture in texels of the grid. It need not be a whole number. The full image is
    /// that picture, or a part of it.
    fn extent(self, projection: Projection) -> [f64; 2] {
        let [x, y] = projection.whole();
        let along = |full: u32, whole: f64, scale: u32| f64::from(full) * whole / f64::from(scale);
        [along(self.full.0, x, self.scale[0]), along(self.full.1, y, self.scale[1])]
    }

    /// Returns the point of the image where x' = y' = 0, in texels (`axis` in `glsl/shared/ray.glsl`). The centre of
    /// texel i, at i + 0.5 texels, is the centre of a pixel, at scale i + 0.5 pixels.
    fn axis(self, projection: Projection) -> [f64; 2] {
        let [x, y] = projection.origin_in_picture();
        let along =
            |full: u32, at: f64, scale: u32| (f64::from(full) * at + f64::from(scale - 1) / 2.0) / f64::from(scale);
        [along(self.full.0, x, self.scale[0]), along(self.full.1, y, self.scale[1])]
    }

    /// Returns how much one texel adds to x' and y' (`pixel` in `glsl/shared/ray.glsl`).
    fn texel_extent(self, projection: Projection) -> [f64; 2] {
        let [half_x, half_y] = projection.half_extents();
        let [x, y] = self.scale.map(f64::from);
        [x * 2.0 * half_x / f64::from(self.full.0), y * 2.0 * half_y / f64::from(self.full.1)]
    }

    /// Sets the uniforms of `glsl/shared/ray.glsl` in the program in use.
    fn bind(self, program: &Program, projection: Projection) {
        let (width, height) = self.size();
        program
            .vec2("size", [f64::from(width), f64::from(height)])
            .vec2("extent", self.extent(projection))
            .vec2("axis", self.axis(projection))
            .vec2("pixel", self.texel_extent(projection));
    }
}

/// A view that is a part of a larger texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// The lower left texel of the view.
    pub(crate) corner: (u32, u32),
    /// The width and height of the texture.
    pub(crate) texture: (u32, u32),
}

/// What shaders that read a caller's texture are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct ImageVariant {
    /// The word of the kind of texture; `None` for a two-dimensional one.
    kind: Option<&'static str>,
    /// Whether the view is a part of the texture.
    viewport: bool,
}

impl ImageVariant {
    pub(crate) const RECTANGLE: ImageVariant = ImageVariant { kind: Some("RECTANGLE"), viewport: false };

    pub(crate) fn new(target: TextureTarget, viewport: bool) -> ImageVariant {
        ImageVariant { kind: target.word(), viewport }
    }

    /// Adds the defines with this prefix: `DEPTH` or `NORMALS`.
    fn define(self, defines: Defines, prefix: &str) -> Defines {
        let defines = self.kind.into_iter().fold(defines, |defines, kind| defines.word(prefix, kind));
        if self.viewport { defines.word(prefix, "VIEWPORT") } else { defines }
    }
}

/// A texture of depth, as passes read it: of linear depth, except in the pass that makes it so.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthInput {
    pub(crate) image: TextureRef,
    /// This depth and all greater ones are background.
    pub(crate) background: f32,
    /// The width and height of the view in texels, which are those of the full image.
    pub(crate) size: (u32, u32),
    /// `None` if the view is the whole texture.
    pub(crate) part: Option<Part>,
}

/// Sets the uniform `viewport` in the program in use, for a view of this size.
fn bind_viewport(program: &Program, corner: (u32, u32), size: (u32, u32)) {
    program.vec4("viewport", [corner.0 as f32, corner.1 as f32, size.0 as f32, size.1 as f32]);
}

impl DepthInput {
    /// Binds the texture to `unit`, and sets the uniforms of `glsl/shared/fetch.glsl` in the program in use.
    fn bind(&self, full_screen: &FullScreen, program: &Program, unit: u32) {
        full_screen.bind_texture(unit, self.image);
        let (width, height) = self.part.map_or(self.size, |part| part.texture);
        program
            .unit("depth_image", unit)
            .float("background", f64::from(self.background))
            .float("depth_layer", f64::from(self.image.target.layer()))
            .vec2("texel", [1.0 / f64::from(width), 1.0 / f64::from(height)]);
        if let Some(part) = self.part {
            bind_viewport(program, part.corner, self.size);
        }
    }
}

/// Returns the defines for `glsl/shared/fetch.glsl`, for a depth texture of this kind and a target whose texels stand
/// for `scale` pixels in x and y.
fn depth_defines(depth: ImageVariant, scale: [u32; 2]) -> Defines {
    let defines = depth.define(Defines::default(), "DEPTH");
    if scale == [1, 1] { defines } else { defines.value("SCALE", pixels(scale)) }
}

/// Returns a scale as a GLSL expression.
fn pixels([x, y]: [u32; 2]) -> String {
    format!("vec2({x}.0, {y}.0)")
}

/// Sets the uniform `depth_sigma`. Its first number is s_z in scene units, its second is s_z as a share of the depth,
/// and one of the two is 0.
fn depth_sigma(program: &Program, sigma: Length) {
    program.vec2(
        "depth_sigma",
        match sigma {
            Length::Units(sigma) => [sigma.min(f32::MAX.into()), 0.0],
            Length::OfDepth(share) => [0.0, share],
        },
    );
}

/// Draws full-screen triangles, and binds textures with a sampler that reads the nearest texel of the base level and
/// clamps coordinates to the edge. The textures keep their own parameters.
pub(crate) struct FullScreen {
    gl: Arc<glow::Context>,
    vertices: glow::VertexArray,
    sampler: glow::Sampler,
}

impl FullScreen {
    pub(crate) fn new(gl: &Arc<glow::Context>) -> Result<FullScreen, Error> {
        const PLACE: &str = "full-screen triangle";
        // SAFETY: the context is current. The core profile needs a vertex array even if no attribute is read.
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
                // A caller's depth texture may be one that its own shaders compare with a reference.
                (glow::TEXTURE_COMPARE_MODE, glow::NONE),
            ] {
                gl.sampler_parameter_i32(sampler, parameter, value as i32);
            }
            check(gl, PLACE)?;
            Ok(full_screen)
        }
    }

    /// Binds a texture to a unit, together with the sampler.
    pub(crate) fn bind_texture(&self, unit: u32, image: TextureRef) {
        // SAFETY: the context is current. The caller promises that the texture is of that kind; otherwise the call is a
        // GL error.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(image.target.gl(), Some(image.texture));
            self.gl.bind_sampler(unit, Some(self.sampler));
        }
    }

    /// Binds a multisample texture to a unit. Samplers do not apply to it.
    pub(crate) fn bind_samples(&self, unit: u32, texture: glow::Texture) {
        // SAFETY: as in `bind_texture`.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(texture));
        }
    }

    /// Draws the triangle with the program, target and state that are current.
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
        // SAFETY: both objects are ours, and the context is current by the contract of `gl`.
        unsafe {
            self.gl.delete_vertex_array(self.vertices);
            self.gl.delete_sampler(self.sampler);
        }
    }
}
