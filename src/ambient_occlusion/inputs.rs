//! What an application hands over: textures of depth and normals, and the view that they show.

use super::programs::{InputKind, Purpose};
use crate::Error;
use crate::gl;
use crate::pass::method::{MethodVariant, NormalEncoding};
use crate::pass::{BACKGROUND_R32F, DepthSamples, TextureRef, TextureTarget};
use crate::projection::Projection;
use crate::settings::Method;
use glow::HasContext;

/// What ambient occlusion is computed from: a view's depth and normals, of the size that [`AmbientOcclusion`] was made
/// for, the bottom row first.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Linear eye-space z in scene units, above 0 and growing away from the eye; one float channel.
    pub depth: TextureRef,
    /// Depths from here on are background, whose ambient occlusion is 1. Finite: [`BACKGROUND_R32F`], or
    /// [`crate::BACKGROUND_R16F`] in a 16-bit image.
    pub background: f32,
    /// Normals in left-handed eye space (x right, y up, z forward) that face the eye, of any length.
    pub normals: TextureRef,
    /// How the normals are stored.
    pub normal_encoding: NormalEncoding,
    /// With multisample antialiasing, the linear depth of every sample; `depth` and `normals` are then those of one
    /// sample of each pixel. The blur at pixels that hold several surfaces reads it, where the settings' `edges` say
    /// so. [`Inputs::new`] has none.
    pub samples: Option<DepthSamples>,
    /// The view's projection, centred.
    pub projection: Projection,
    /// The near plane's z, above 0, at which the rays of `ray-march` end. No other method reads it, and
    /// [`Inputs::new`] leaves it 0.
    pub near: f64,
}

impl Inputs {
    /// Linear depth in R32F and signed normals, both of one kind of texture.
    pub fn new(depth: glow::Texture, normals: glow::Texture, target: TextureTarget, projection: Projection) -> Inputs {
        Inputs {
            depth: TextureRef { texture: depth, target },
            background: BACKGROUND_R32F,
            normals: TextureRef { texture: normals, target },
            normal_encoding: NormalEncoding::Signed,
            samples: None,
            projection,
            near: 0.0,
        }
    }

    /// Refuses what would be computed with and mean nothing.
    pub(super) fn check(&self, gl: &glow::Context, size: (u32, u32), method: Method) -> Result<(), Error> {
        let [x, y] = self.projection.half_extents();
        if !(x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0) {
            return Err(Error::Usage(format!("{:?}: both extents must be finite and above 0", self.projection)));
        }
        if method.facts().reads_near && (self.near.is_nan() || self.near <= 0.0) {
            return Err(Error::Usage(format!(
                "ray-march ends its rays at the near plane: near must be above 0, not {}",
                self.near
            )));
        }
        let multisample = glow::TEXTURE_2D_MULTISAMPLE;
        let samples = self.samples.map(|samples| ("samples", samples.texture, multisample, samples.samples));
        let plain = [("depth", self.depth), ("normals", self.normals)];
        let plain = plain.map(|(name, image)| (name, image.texture, image.target.gl(), 0));
        for (name, texture, kind, samples) in plain.into_iter().chain(samples) {
            // SAFETY: the context is current; a texture of another kind is a GL error, and nothing more.
            let found = unsafe {
                gl.bind_texture(kind, Some(texture));
                gl::check(gl, &format!("the {name} texture is not of the kind said"))?;
                let parameter = |parameter| gl.get_tex_level_parameter_i32(kind, 0, parameter);
                let size = [glow::TEXTURE_WIDTH, glow::TEXTURE_HEIGHT].map(parameter);
                // What is compiled in must be what there is.
                let samples = if kind == multisample { parameter(glow::TEXTURE_SAMPLES) } else { 0 };
                (size.map(i64::from), i64::from(samples))
            };
            gl::check(gl, &format!("the {name} texture's size"))?;
            if found.0 != [i64::from(size.0), i64::from(size.1)] {
                let ([width, height], (w, h)) = (found.0, size);
                return Err(Error::Usage(format!(
                    "the {name} texture has {width}x{height} texels, and ambient occlusion is set up for {w}x{h}"
                )));
            }
            if found.1 != i64::from(samples) {
                return Err(Error::Usage(format!(
                    "the {name} texture has {} samples a pixel, not the {samples} said",
                    found.1
                )));
            }
        }
        Ok(())
    }

    /// What the programs for these inputs are compiled for.
    pub(super) fn kind(&self, purpose: Purpose, edges: bool) -> InputKind {
        InputKind {
            method: MethodVariant {
                orthographic: !self.projection.is_perspective(),
                depth: self.depth.target,
                normals: self.normals.target,
                encoding: self.normal_encoding,
                floor: purpose == Purpose::Floor,
            },
            samples: self.samples.map(|samples| samples.samples).filter(|_| edges),
        }
    }
}
