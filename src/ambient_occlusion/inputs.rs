//! The inputs that an application provides: textures of depth and normals, and the projection of the view in them.

use super::programs::{InputKind, Purpose};
use crate::Error;
use crate::gl;
use crate::pass::method::{MethodVariant, NormalEncoding};
use crate::pass::{BACKGROUND_R32F, DepthSamples, TextureRef, TextureTarget};
use crate::projection::Projection;
use crate::settings::Method;
use glow::HasContext;

/// The inputs of ambient occlusion: the depth and normals of one view, and its projection. The textures must have the
/// size that [`AmbientOcclusion`](super::AmbientOcclusion) was made for, with the bottom row first.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Linear eye-space z in scene units, above 0 and increasing away from the eye, in the red channel of a float
    /// format.
    pub depth: TextureRef,
    /// The depth of background. This depth and all greater ones are background, where ambient occlusion is 1. It must
    /// be finite: [`BACKGROUND_R32F`], or [`crate::BACKGROUND_R16F`] in a 16-bit image.
    pub background: f32,
    /// Normals in left-handed eye space (x right, y up, z forward). They face the eye, and may have any length.
    pub normals: TextureRef,
    /// How the normals are stored.
    pub normal_encoding: NormalEncoding,
    /// With multisample antialiasing, the linear depth of every sample; `depth` and `normals` then hold those of one
    /// sample of each pixel. The blur reads the samples at pixels that hold several surfaces, if the setting `edges` is
    /// [`Edges::Supersample`](crate::settings::Edges::Supersample). [`Inputs::new`] leaves it `None`.
    pub samples: Option<DepthSamples>,
    /// The projection of the view. [`Projection::from_matrix`] reads it from a matrix; it need not be centred.
    pub projection: Projection,
    /// The near plane's z in scene units, above 0. The rays of `ray-march` end there; no other method reads it.
    /// [`Inputs::new`] leaves it 0.
    pub near: f64,
}

impl Inputs {
    /// Inputs with linear depth in R32F and signed normals. Both are textures of the kind `target`. The depth
    /// [`BACKGROUND_R32F`] and all greater ones are background.
    #[must_use]
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

    /// Refuses inputs with which a result could be computed, but a meaningless one.
    ///
    /// # Errors
    /// [`Error::Usage`] for what [`Projection::check`] refuses, for a near plane that `ray-march` cannot use, and for a
    /// texture of another size or number of samples. [`Error::Gl`] for a texture of another kind.
    pub(super) fn check(&self, gl: &glow::Context, size: (u32, u32), method: Method) -> Result<(), Error> {
        self.projection.check()?;
        if method.facts().reads_near && (self.near.is_nan() || self.near <= 0.0) {
            return Err(Error::Usage(format!(
                "{} ends its rays at the near plane: near must be above 0, not {}",
                method.name(),
                self.near
            )));
        }
        let multisample = glow::TEXTURE_2D_MULTISAMPLE;
        let samples = self.samples.map(|samples| ("samples", samples.texture, multisample, samples.samples));
        let plain = [("depth", self.depth), ("normals", self.normals)];
        let plain = plain.map(|(name, image)| (name, image.texture, image.target.gl(), 0));
        for (name, texture, kind, samples) in plain.into_iter().chain(samples) {
            // SAFETY: the context is current; to bind a texture of another kind is a GL error without further effect.
            let found = unsafe {
                gl.bind_texture(kind, Some(texture));
                gl::check(gl, &format!("the {name} texture is not of the declared kind"))?;
                let parameter = |parameter| gl.get_tex_level_parameter_i32(kind, 0, parameter);
                let size = [glow::TEXTURE_WIDTH, glow::TEXTURE_HEIGHT].map(parameter);
                // The number of samples is compiled into the shaders, so it must be that of the texture.
                let samples = if kind == multisample { parameter(glow::TEXTURE_SAMPLES) } else { 0 };
                (size.map(i64::from), i64::from(samples))
            };
            gl::check(gl, &format!("the {name} texture's size"))?;
            if found.0 != [i64::from(size.0), i64::from(size.1)] {
                let ([width, height], (w, h)) = (found.0, size);
                return Err(Error::Usage(format!(
                    "the {name} texture has {width}x{height} texels, but ambient occlusion is set up for {w}x{h}"
                )));
            }
            if found.1 != i64::from(samples) {
                return Err(Error::Usage(format!(
                    "the {name} texture has {} samples per pixel, but {samples} were declared",
                    found.1
                )));
            }
        }
        Ok(())
    }

    /// Returns the properties of these inputs that programs are compiled for. `edges` says whether edges are detected.
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
