//! Rectangle textures: unnormalised coordinates, no mipmaps, and the fastest fetch on software drivers. And multisample
//! ones.

use super::{check, not_made};
use crate::Error;
use glow::HasContext;
use std::sync::Arc;

/// The texture formats in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// 8-bit, [0, 1].
    R8,
    /// 16-bit float.
    R16f,
    /// 32-bit float.
    R32f,
    /// 8-bit, [0, 1].
    Rgba8,
    /// 8-bit, [-1, 1].
    Rgba8Snorm,
    /// 16-bit float.
    Rgba16f,
    /// 32-bit float.
    Rgba32f,
}

impl Format {
    /// Every format, and its name in messages.
    pub const ALL: [(Format, &'static str); 7] = [
        (Format::R8, "r8"),
        (Format::R16f, "r16f"),
        (Format::R32f, "r32f"),
        (Format::Rgba8, "rgba8"),
        (Format::Rgba8Snorm, "rgba8-snorm"),
        (Format::Rgba16f, "rgba16f"),
        (Format::Rgba32f, "rgba32f"),
    ];

    /// Internal format, format and type, as `glTexImage2D` takes them.
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

    /// Components a texel.
    pub(crate) fn channels(self) -> usize {
        match self {
            Format::R8 | Format::R16f | Format::R32f => 1,
            _ => 4,
        }
    }
}

/// A rectangle texture that samples the nearest texel and clamps to the edge.
pub(crate) struct Texture {
    gl: Arc<glow::Context>,
    place: String,
    pub(crate) id: glow::Texture,
    pub(crate) format: Format,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Texture {
    /// Allocates without contents. `place` names it in errors. Changes the rectangle texture binding of the active
    /// unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        width: u32,
        height: u32,
    ) -> Result<Texture, Error> {
        Texture::allocate(gl, place, format, width, height, None)
    }

    /// A texture that holds `texels`, `width * height` of four floats, the bottom row first.
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
        // Floats are converted by the driver; without data the type only has to be one that fits.
        let kind = if floats.is_some() { glow::FLOAT } else { kind };
        // SAFETY: the context is current; `floats` holds as many texels as the size says.
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

    /// Every texel as floats, as shaders see them, the bottom row first.
    pub(crate) fn read(&self) -> Result<Vec<f32>, Error> {
        let mut bytes = vec![0; self.width as usize * self.height as usize * self.format.channels() * 4];
        let place = format!("{}: reading it back", self.place);
        // SAFETY: the context is current, the texture ours, and bound and packed as said, or it is not read. `bytes`
        // holds one float for each component that is written, packed tightly: rows of floats are whole multiples of the
        // alignment of 4. glGetTexImage does not clamp signed values, as glReadPixels does.
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

const PACK: [u32; 6] = [
    glow::PACK_ALIGNMENT,
    glow::PACK_ROW_LENGTH,
    glow::PACK_SKIP_PIXELS,
    glow::PACK_SKIP_ROWS,
    glow::PACK_SWAP_BYTES,
    glow::PACK_LSB_FIRST,
];

/// Pixels packed as OpenGL starts out but for the alignment of rows, and the caller's way to pack them put back when
/// dropped: with another, an image read back would reach past the memory made for it.
pub(super) struct DefaultPacking<'a> {
    gl: &'a glow::Context,
    buffer: Option<glow::Buffer>,
    values: [i32; PACK.len()],
}

impl DefaultPacking<'_> {
    /// Reads pixels back, of what `bind` binds. Where OpenGL refuses that, or how they are to be packed, they are not
    /// read: another image, or another way to pack it, would reach past the memory made for this one.
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
        // Both are asked, so that no error is left for what comes next.
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
        // SAFETY: the context is current by the room's contract; every value was read from it.
        unsafe {
            PACK.into_iter().zip(self.values).for_each(|(parameter, value)| self.gl.pixel_store_i32(parameter, value));
            self.gl.bind_buffer(glow::PIXEL_PACK_BUFFER, self.buffer);
        }
    }
}

/// A multisample texture, which only `texelFetch` reads.
pub(crate) struct MultisampleTexture {
    gl: Arc<glow::Context>,
    pub(crate) id: glow::Texture,
}

impl MultisampleTexture {
    /// Allocates one of `samples` texels a pixel, or of as many as the driver takes for them, at the same places in
    /// every texture of as many. Changes the multisample texture binding of the active unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        place: &str,
        format: Format,
        (width, height): (u32, u32),
        samples: u32,
    ) -> Result<MultisampleTexture, Error> {
        let (internal, width, height) = (format.gl().0 as i32, width as i32, height as i32);
        // SAFETY: the context is current.
        unsafe {
            let id = gl.create_texture().map_err(|_| not_made(gl, place))?;
            let texture = MultisampleTexture { gl: gl.clone(), id };
            gl.bind_texture(glow::TEXTURE_2D_MULTISAMPLE, Some(id));
            gl.tex_image_2d_multisample(glow::TEXTURE_2D_MULTISAMPLE, samples as i32, internal, width, height, true);
            check(gl, place)?;
            Ok(texture)
        }
    }

    /// How many texels a pixel has: as many as asked for, or more. `place` names it in errors.
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
        // SAFETY: the texture is ours, and the context current by the room's contract.
        unsafe { self.gl.delete_texture(self.id) };
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        // SAFETY: the texture is ours, and the context current by the room's contract.
        unsafe { self.gl.delete_texture(self.id) };
    }
}
