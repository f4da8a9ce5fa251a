//! Images in memory as the textures that [`Inputs`] names.

use super::inputs::Inputs;
use crate::Error;
use crate::gl::state::SavedState;
use crate::gl::{self, Format, Texture};
use crate::image::Image;
use crate::pass::TextureTarget;
use crate::projection::Projection;
use std::sync::Arc;

/// Textures of depth and normals that are images in memory, such as another renderer wrote to files. The OpenGL context
/// must be current at every call, and when this value is dropped.
pub struct InputTextures {
    depth: Texture,
    normals: Option<Texture>,
}

impl InputTextures {
    /// Uploads the images as they are, in 32-bit float. State is restored as by
    /// [`AmbientOcclusion::render`](super::AmbientOcclusion::render).
    ///
    /// # Errors
    /// [`Error::Usage`] if the driver cannot have textures of this size, or if the images have different sizes.
    /// [`Error::Gl`] if the driver refuses an allocation, or if an OpenGL error is pending.
    pub fn new(
        gl: &Arc<glow::Context>,
        depth: &Image<f32>,
        normals: Option<&Image<[f32; 3]>>,
    ) -> Result<InputTextures, Error> {
        gl::check(gl, super::PENDING)?;
        let sides = |width: usize, height: usize| u32::try_from(width).ok().zip(u32::try_from(height).ok());
        let Some(size) = sides(depth.width, depth.height) else {
            return Err(Error::Usage(format!("depth of {}x{} pixels is too large", depth.width, depth.height)));
        };
        gl::check_size(gl, size.0, size.1)?;
        if let Some(normals) = normals.filter(|normals| sides(normals.width, normals.height) != Some(size)) {
            return Err(Error::Usage(format!(
                "normals of {}x{} pixels do not fit depth of {}x{}",
                normals.width, normals.height, size.0, size.1
            )));
        }
        let whole = |texels: usize| texels == depth.width * depth.height;
        if !whole(depth.texels.len()) || normals.is_some_and(|normals| !whole(normals.texels.len())) {
            return Err(Error::Usage(format!("depth and normals of {}x{} pixels need as many texels", size.0, size.1)));
        }
        let state = SavedState::save(gl, None)?;
        state.put_back_after(gl, || {
            let texels = |image: &Image<[f32; 3]>| -> Vec<f32> {
                image.texels.iter().flat_map(|&[x, y, z]| [x, y, z, 0.0]).collect()
            };
            let normals = normals
                .map(|image| Texture::of_floats(gl, "normals", Format::Rgba32f, size, &texels(image)))
                .transpose()?;
            Ok(InputTextures { depth: Texture::of_floats(gl, "depth", Format::R32f, size, &depth.texels)?, normals })
        })
    }

    /// Returns the inputs with these textures. As in [`Inputs::new`], they say linear depth, and signed normals in
    /// left-handed eye space.
    #[must_use]
    pub fn inputs(&self, projection: Projection) -> Inputs {
        let depth = &self.depth;
        Inputs {
            normals: self.normals.as_ref().map(Into::into),
            ..Inputs::new(depth.id, depth.id, TextureTarget::Rectangle, projection)
        }
    }
}
