//! Rectangle textures, which have unnormalised coordinates, no mipmaps, and the fastest fetches on software drivers;
//! and multisample textures.

use super::{check, not_made};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;

/// The texture formats that the passes render to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// One channel of 8 bits, [0, 1].
    R8,
    /// One channel of 16-bit float.
    R16f,
    /// One channel of 32-bit float.
    R32f,
    /// Four channels of 8 bits, [0, 1].
    Rgba8,
    /// Four channels of 8 bits, [-1, 1].
    Rgba8Snorm,
    /// Four channels of 16-bit float.
    Rgba16f,
    /// Four channels of 32-bit float.
    Rgba32f,
}

impl Format {
    /// Every format and its name in messages.
    pub const ALL: [(Format, &'static str); 7] = [
        (Format::R8, "r8"),
        (Format::R16f, "r16f"),
        (Format::R32f, "r32f"),
        (Format::Rgba8, "rgba8"),
        (Format::Rgba8Snorm, "rgba8-snorm"),
        (Format::Rgba16f, "rgba16f"),
        (Format::Rgba32f, "rgba32f"),
    ];

    /// Returns the internal format, the format and the type, as `glTexImage2D` expects them.
    pub(crate) fn gl(self) -> (u32, u32, u32) {
        match self {
            Format::R8 => (glow::R8, glow::RED, glow::UNSIGNED_BYTE),
            Format::R16f => (glow::R16F, glow::RED, glow::HALF_FLOAT),
            Format::R32f => (glow::R32F, glow::RED, glow::FLOAT),
            Format::Rgba8 => (glow::RGBA8, glow::RGBA, glow::UNSIGNED_BYTE),
            Format::Rgba8Snorm => (glow::RGBA8_SNORM, glow::RGBA, glow::BYTE),
            Format::Rgba16f => (glow::RGBA16F, glow::RGBA, glow::HALF_FLOAT),
            Format::Rgba32f => (glow::RGBA32F, glow::RGBA, glow::FLOAT),
        }
    }

    /// Returns the bytes of a texel.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Format::R8 => 1,
            Format::R16f => 2,
            Format::R32f | Format::Rgba8 | Format::Rgba8Snorm => 4,
            Format::Rgba16f => 8,
            Format::Rgba32f => 16,
        }
    }

    /// Components per texel: 1 or 4.
    pub(crate) fn channels(self) -> usize {
        match self {
            Format::R8 | Format::R16f | Format::R32f => 1,
            _ => 4,
        }
    }
}

/// A rectangle texture. It is sampled at the nearest texel, and coordinates are clamped to its edge.
pub(crate) struct Texture {
    gl: Arc<glow::Context>,
    place: String,
    pub(crate) id: glow::Texture,
    pub(crate) format: Format,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Texture {
    /// Allocates a texture with undefined contents. `place` names it in errors. Leaves it bound to
    /// `GL_TEXTURE_RECTANGLE` of the active unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        width: u32,
        height: u32,
    ) -> Result<Texture, Error> {
        Texture::allocate(gl, place, format, width, height, None)
    }

    /// Makes a texture that holds `texels`: `width * height` times as many floats as the format has channels, the
    /// bottom row first. Otherwise as [`Texture::new`].
    pub(crate) fn of_floats(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        (width, height): (u32, u32),
        texels: &[f32],
    ) -> Result<Texture, Error> {
        assert_eq!(texels.len(), width as usize * height as usize * format.channels());
        let bytes: Vec<u8> = texels.iter().flat_map(|f| f.to_ne_bytes()).collect();
        Texture::allocate(gl, place, format, width, height, Some(&bytes))
    }

    fn allocate(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        width: u32,
        height: u32,
        floats: Option<&[u8]>,
    ) -> Result<Texture, Error> {
        let (internal, external, kind) = format.gl();
        // The driver converts floats to the format. Without data the type only has to be one that the format allows.
        let kind = if floats.is_some() { glow::FLOAT } else { kind };
        // SAFETY: the context is current, and `floats` holds `width * height` texels.
        unsafe {
            let id = gl.create_texture().map_err(|_| not_made(gl, place))?;
            let texture = Texture { gl: gl.clone(), place: place.into(), id, format, width, height };
            gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(id));
            gl.tex_image_2d(
                glow::TEXTURE_RECTANGLE,
                0,
                internal as i32,
                width as i32,
                height as i32,
                0,
                external,
                kind,
                glow::PixelUnpackData::Slice(floats),
            );
            for (parameter, value) in [
                (glow::TEXTURE_MIN_FILTER, glow::NEAREST),
                (glow::TEXTURE_MAG_FILTER, glow::NEAREST),
                (glow::TEXTURE_WRAP_S, glow::CLAMP_TO_EDGE),
                (glow::TEXTURE_WRAP_T, glow::CLAMP_TO_EDGE),
            ] {
                gl.tex_parameter_i32(glow::TEXTURE_RECTANGLE, parameter, value as i32);
            }
            check(gl, place)?;
            Ok(texture)
        }
    }

    /// Returns the bytes of its texels.
    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * self.format.bytes()
    }

    /// Reads all texels back as the floats that a shader would see, the bottom row first.
    pub(crate) fn read(&self) -> Result<Vec<f32>, Error> {
        let mut bytes = vec![0; self.width as usize * self.height as usize * self.format.channels() * 4];
        let place = format!("{}: reading it back", self.place);
        // SAFETY: the context is current and the texture is ours. `DefaultPacking::around` reads only if the texture
        // could be bound and the packing could be set. `bytes` then holds exactly the floats that are written: the
        // length of a row of floats is always a multiple of the alignment of 4, so rows have no padding.
        //
        // glGetTexImage is used because glReadPixels would clamp negative values.
        let bind = || unsafe { self.gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(self.id)) };
        let format = self.format.gl().1;
        // SAFETY: as above.
        let read = || unsafe {
            let into = glow::PixelPackData::Slice(Some(&mut bytes));
            self.gl.get_tex_image(glow::TEXTURE_RECTANGLE, 0, format, glow::FLOAT, into);
        };
        DefaultPacking::around(&self.gl, &place, 4, bind, read)?;
        Ok(bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect())
    }
}

/// The parameters that say how pixels are packed in memory when they are read back.
const PACK: [u32; 6] = [
    glow::PACK_ALIGNMENT,
    glow::PACK_ROW_LENGTH,
    glow::PACK_SKIP_PIXELS,
    glow::PACK_SKIP_ROWS,
    glow::PACK_SWAP_BYTES,
    glow::PACK_LSB_FIRST,
];

/// Sets the parameters by which pixels are packed to OpenGL's initial values, except for the alignment of rows, and
/// restores the application's values when it is dropped. With the application's values, reading an image back could
/// write past the end of the memory that was allocated for it.
pub(super) struct DefaultPacking<'a> {
    gl: &'a glow::Context,
    buffer: Option<glow::Buffer>,
    values: [i32; PACK.len()],
}

impl DefaultPacking<'_> {
    /// Calls `bind` and then `read`, which reads pixels back from what `bind` has bound. If OpenGL refuses to bind or
    /// to set the packing, `read` is not called, because it would read another image, or pack it differently, and could
    /// write past the end of its memory.
    pub(super) fn around(
        gl: &glow::Context,
        place: &str,
        alignment: i32,
        bind: impl FnOnce(),
        read: impl FnOnce(),
    ) -> Result<(), Error> {
        let packing = DefaultPacking::set(gl, alignment);
        bind();
        let bound = check(gl, place);
        if bound.is_ok() {
            read();
        }
        drop(packing);
        // `check` is called a second time even after a failure, so that no error is left for the next call.
        bound.and(check(gl, place))
    }

    fn set(gl: &glow::Context, alignment: i32) -> DefaultPacking<'_> {
        // SAFETY: the context is current, and these are core parameters of one value.
        unsafe {
            let buffer = gl.get_parameter_buffer(glow::PIXEL_PACK_BUFFER_BINDING);
            let saved = DefaultPacking { gl, buffer, values: PACK.map(|parameter| gl.get_parameter_i32(parameter)) };
            gl.bind_buffer(glow::PIXEL_PACK_BUFFER, None);
            PACK.into_iter()
                .zip([alignment, 0, 0, 0, 0, 0])
                .for_each(|(parameter, value)| gl.pixel_store_i32(parameter, value));
            saved
        }
    }
}

impl Drop for DefaultPacking<'_> {
    fn drop(&mut self) {
        // SAFETY: the context is current by the contract of `gl`; every value was read from it.
        unsafe {
            PACK.into_iter().zip(self.values).for_each(|(parameter, value)| self.gl.pixel_store_i32(parameter, value));
            self.gl.bind_buffer(glow::PIXEL_PACK_BUFFER, self.buffer);
        }
    }
}

/// A multisample texture, which shaders can read with `texelFetch` only.
pub(crate) struct MultisampleTexture {
    gl: Arc<glow::Context>,
    pub(crate) id: glow::Texture,
    /// The bytes of one sample of every pixel.
    pub(crate) bytes_per_sample: u64,
}

impl MultisampleTexture {
    /// Allocates a texture with `samples` samples per pixel, or with more if the driver rounds the number up. All
    /// textures made with the same number have their samples at the same places in the pixel. `place` names the texture
    /// in errors. Leaves it bound to `GL_TEXTURE_2D_MULTISAMPLE` of the active unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        (width, height): (u32, u32),
        samples: u32,
    ) -> Result<MultisampleTexture, Error> {
        let bytes_per_sample = u64::from(width) * u64::from(height) * format.bytes();
        let (internal, width, height) = (format.gl().0 as i32, width as i32, height as i32);
        // SAFETY: the context is current.
        unsafe {
            let id = gl.create_texture().map_err(|_| not_made(gl, place))?;
            let texture = MultisampleTexture { gl: gl.clone(), id, bytes_per_sample };
            gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(id));
            gl.tex_image_2d_multisample(glow::TEXTURE_2D_MULTISAMPLE, samples as i32, internal, width, height, true);
            check(gl, place)?;
            Ok(texture)
        }
    }

    /// Returns the number of samples per pixel: as many as were asked for, or more. `place` names the texture in
    /// errors. Leaves the texture bound.
    pub(crate) fn samples(&self, place: &str) -> Result<u32, Error> {
        // SAFETY: the context is current and the texture ours.
        let samples = unsafe {
            self.gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(self.id));
            self.gl.get_tex_level_parameter_i32(glow::TEXTURE_2D_MULTISAMPLE, 0, glow::TEXTURE_SAMPLES)
        };
        check(&self.gl, place)?;
        Ok(samples as u32)
    }
}

impl Drop for MultisampleTexture {
    fn drop(&mut self) {
        // SAFETY: the texture is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_texture(self.id) };
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        // SAFETY: the texture is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_texture(self.id) };
    }
}
