//! The inputs that an application provides: textures of depth and normals, and the projection of the view in them.

use crate::Error;
use crate::encoding::{ClipRange, DepthEncoding, NormalEncoding, NormalSpace};
use crate::pass::{BACKGROUND_R32F, DepthSamples, TextureRef, TextureTarget};
use crate::projection::{Hand, Projection, ProjectionMatrix};

/// The inputs of ambient occlusion: the depth and normals of one view, and its projection. The textures must have the
/// size that [`AmbientOcclusion`](super::AmbientOcclusion) was made for, unless `viewport` says which part of them is
/// meant, with the bottom row first. They may be of any kind that a shader reads in OpenGL 3.3, and keep their own
/// filters, wrap modes and comparison.
///
/// [`Inputs::new`] takes linear depth and normals in left-handed eye space. Whatever an application has otherwise is
/// said field by field:
///
/// ```
/// # use hbao::{DepthEncoding, Hand, Inputs, NormalSpace, Projection, TextureTarget, glow};
/// # fn inputs(depth: glow::Texture, normals: glow::Texture, projection: Projection) -> Inputs {
/// Inputs {
///     depth_encoding: DepthEncoding::reversed(0.1, f64::INFINITY),
///     normal_space: NormalSpace::Eye(Hand::Right),
///     ..Inputs::new(depth, normals, TextureTarget::Texture2d, projection)
/// }
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// The texture of depth: a texture with a depth format, or with depth in its red channel. A renderbuffer cannot be
    /// read: attach a texture to the framebuffer in its place.
    pub depth: TextureRef,
    /// What the texture of depth stores. [`Inputs::new`] says linear depth.
    pub depth_encoding: DepthEncoding,
    /// In linear depth, the depth of background. This depth and all greater ones are background, where ambient
    /// occlusion is 1. It must be finite: [`BACKGROUND_R32F`], or [`crate::BACKGROUND_R16F`] in a 16-bit image. In
    /// hardware depth the cleared value of the far end is background, and this field is not read.
    pub background: f32,
    /// The texture of normals, which face the eye and may have any length. `None` if there are none: they are then
    /// rebuilt from depth, which takes a pass and gives flat facets and errors at silhouettes.
    pub normals: Option<TextureRef>,
    /// How the normals are stored.
    pub normal_encoding: NormalEncoding,
    /// The space that the normals are in. [`Inputs::new`] says left-handed eye space (x right, y up, z forward).
    pub normal_space: NormalSpace,
    /// With multisample antialiasing, the depth of every sample, encoded as `depth` is; `depth` and `normals` then hold
    /// those of one sample of each pixel. The blur reads the samples at pixels that hold several surfaces, if the
    /// setting `edges` is [`Edges::Supersample`](crate::settings::Edges::Supersample). [`Inputs::new`] leaves it
    /// `None`, and so it must be if `depth` itself is a multisample texture.
    pub samples: Option<DepthSamples>,
    /// The part of the textures that the view fills. `None` means that the view fills them.
    pub viewport: Option<Viewport>,
    /// The projection of the view. [`Projection::from_matrix`] reads it from a matrix; it need not be centred.
    pub projection: Projection,
    /// The near plane's z in scene units, above 0. The rays of `ray-march` end there; no other method reads it.
    /// [`Inputs::new`] leaves it 0, which means the near plane of `depth_encoding`.
    pub near: f64,
}

/// The part of larger textures that a view fills, in texels from the lower left corner, as `glViewport` counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Viewport {
    /// The first column.
    pub x: u32,
    /// The first row, from below.
    pub y: u32,
    /// The width, which must be the one that [`AmbientOcclusion`](super::AmbientOcclusion) was made for.
    pub width: u32,
    /// The height, likewise.
    pub height: u32,
}

impl Inputs {
    /// Inputs with linear depth in R32F and signed normals. Both are textures of the kind `target`. The depth
    /// [`BACKGROUND_R32F`] and all greater ones are background.
    #[must_use]
    pub fn new(depth: glow::Texture, normals: glow::Texture, target: TextureTarget, projection: Projection) -> Inputs {
        Inputs {
            depth: TextureRef { texture: depth, target },
            depth_encoding: DepthEncoding::Linear,
            background: BACKGROUND_R32F,
            normals: Some(TextureRef { texture: normals, target }),
            normal_encoding: NormalEncoding::Signed,
            normal_space: NormalSpace::Eye(Hand::Left),
            samples: None,
            viewport: None,
            projection,
            near: 0.0,
        }
    }

    /// Inputs as engines have them: a depth buffer, signed normals in eye space, and the projection matrix that both
    /// were drawn with, column by column. Both are textures of the kind `target`.
    ///
    /// OpenGL 3.3 has depth from -1 to 1 in clip space. An application that has called `glClipControl` sets
    /// [`Inputs::depth_encoding`] besides. A perspective matrix tells the hand of eye space; with an orthographic one
    /// it is taken to be right-handed, as in OpenGL's tradition. The matrix of a tile does not tell the height of the
    /// whole picture, which [`Radius::OfView`](crate::settings::Radius::OfView) needs: set [`Inputs::projection`] to
    /// the [`Projection::part`] of the whole one.
    ///
    /// # Errors
    /// [`Error::Usage`] for a matrix that is no projection: see [`ProjectionMatrix::read`].
    pub fn from_matrix(
        depth: glow::Texture,
        normals: glow::Texture,
        target: TextureTarget,
        projection: &[f32; 16],
    ) -> Result<Inputs, Error> {
        let read = ProjectionMatrix::read(projection)?;
        Ok(Inputs {
            depth_encoding: DepthEncoding::Matrix { projection: *projection, range: ClipRange::MinusOneToOne },
            normal_space: NormalSpace::Eye(read.hand.unwrap_or(Hand::Right)),
            ..Inputs::new(depth, normals, target, read.projection)
        })
    }

    /// Returns whether the texture is one of these.
    pub(super) fn reads(&self, image: TextureRef) -> bool {
        let samples = self.samples.is_some_and(|samples| samples.texture == image.texture);
        image == self.depth || self.normals == Some(image) || samples
    }

    /// Returns the depth samples of the pixels, if they have several.
    pub(super) fn depth_samples(&self) -> Option<DepthSamples> {
        match self.depth.target {
            TextureTarget::Multisample(samples) => Some(DepthSamples { texture: self.depth.texture, samples }),
            _ => self.samples,
        }
    }

    /// Returns the z at which rays end.
    pub(super) fn near_plane(&self) -> f64 {
        let of_encoding = || self.depth_encoding.near(self.projection.is_perspective());
        if self.near == 0.0 { of_encoding().unwrap_or(0.0) } else { self.near }
    }
}
