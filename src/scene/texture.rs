//! Textures of materials: where a texture is laid, which texel is seen, and how its file is decoded.
//!
//! The texel that is seen at a texture coordinate is the nearest one of the whole texture, after the coordinate is
//! wrapped into [0, 1], with v up. The shader of the G-buffer computes the same in float32.

use crate::Error;
use glam::DVec2;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

/// The most texels of a side of a texture. Larger textures are not read.
const LONGEST: u32 = 16384;

/// The most bytes that decoding a texture may need.
const MOST_BYTES: u64 = 1 << 29;

/// The least alpha, of 255, that is not cut: 1/2.
const LEAST: u8 = 128;

/// The texels of a picture.
#[derive(Debug, PartialEq)]
pub(crate) struct Texture {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// The bytes of each texel: 3 for a colour, and 1 for alpha.
    pub(crate) channels: usize,
    /// The rows, the bottom one first.
    pub(crate) texels: Vec<u8>,
    /// What messages call it.
    pub(crate) name: String,
}

/// A texture and how it is laid over a surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Map {
    pub(crate) texture: Arc<Texture>,
    pub(crate) placed: Placed,
}

/// How a texture is laid: a coordinate is multiplied by `scale`, and then `offset` is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) scale: DVec2,
    pub(crate) offset: DVec2,
    /// True if the texture is continued by its border, and false if it is repeated.
    pub(crate) clamp: bool,
}

/// The textures of a group of triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Skin {
    /// The colour, by which the group's colour is multiplied.
    pub(crate) colour: Option<Map>,
    /// The alpha. Where it is below 1/2, there is no surface.
    pub(crate) cut: Option<Map>,
}

impl Skin {
    /// Returns a text that is the same for two skins only if they are the same.
    pub(super) fn key(&self) -> String {
        let of = |map: &Option<Map>| map.as_ref().map(|map| (Arc::as_ptr(&map.texture), map.placed));
        format!("{:?}", (of(&self.colour), of(&self.cut)))
    }
}

impl Map {
    /// Adds all that the map holds to a hash.
    pub(super) fn hash(&self, hash: &mut Sha256) {
        let Map { texture, placed: Placed { scale, offset, clamp } } = self;
        // The name is only for messages.
        let Texture { width, height, channels, texels, name: _ } = &**texture;
        hash.update(width.to_le_bytes());
        hash.update(height.to_le_bytes());
        hash.update(channels.to_le_bytes());
        hash.update(texels);
        [scale, offset].into_iter().flat_map(DVec2::to_array).for_each(|x| hash.update(x.to_le_bytes()));
        hash.update([u8::from(*clamp)]);
    }

    /// Returns the bytes of the texel at a texture coordinate.
    fn texel(&self, at: DVec2) -> &[u8] {
        let Placed { scale, offset, clamp } = self.placed;
        let at = at * scale + offset;
        let within = if clamp { at.clamp(DVec2::ZERO, DVec2::ONE) } else { at - at.floor() };
        // The conversion makes 0 of NaN.
        let [x, y] = [(within.x, self.texture.width), (within.y, self.texture.height)]
            .map(|(x, count)| ((x * f64::from(count)) as usize).min(count as usize - 1));
        let start = (y * self.texture.width as usize + x) * self.texture.channels;
        &self.texture.texels[start..start + self.texture.channels]
    }

    /// Returns the colour at a texture coordinate.
    pub(crate) fn colour(&self, at: DVec2) -> [f32; 3] {
        let texel = self.texel(at);
        [0, 1, 2].map(|channel| f32::from(texel[channel]) / 255.0)
    }

    /// Returns whether there is no surface at a texture coordinate.
    pub(crate) fn cuts(&self, at: DVec2) -> bool {
        self.texel(at)[0] < LEAST
    }
}

/// What is done with the values of a texture when it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    /// The value that stands for 0, and the factor of the texture's values (`-mm`).
    pub(super) base_gain: [f64; 2],
    /// The channel that is the alpha of a `map_d`: one of `r`, `g`, `b`, `m` and `l`. Without one it is the picture's
    /// alpha if that is not 1 everywhere, or else its luminance.
    pub(super) channel: Option<u8>,
}

/// Reads a PNG, JPEG, TGA or BMP file.
///
/// # Errors
/// Why it cannot be read, in words that follow its name.
pub(super) fn decode(path: &Path) -> Result<DynamicImage, String> {
    let file = File::open(path).map_err(|e| format!("cannot be read ({e})"))?;
    let mut reader =
        ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(|e| format!("cannot be read ({e})"))?;
    if reader.format().is_none() && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tga")) {
        reader.set_format(ImageFormat::Tga); // TGA has no mark of its own
    }
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tga | ImageFormat::Bmp)) {
        return Err("is no PNG, JPEG, TGA or BMP picture".into());
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(LONGEST), Some(LONGEST));
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| match e {
        image::ImageError::Limits(_) => format!("is larger than {LONGEST}x{LONGEST} texels or 512 MiB"),
        e => format!("cannot be read ({})", Error::shown(&e.to_string())),
    })?;
    if image.width() == 0 || image.height() == 0 { Err("has no texels".into()) } else { Ok(image) }
}

/// Makes a texture of colours.
pub(super) fn colours(image: &DynamicImage, reading: Reading, name: String) -> Texture {
    texture(image, name, |[r, g, b, _]| [r, g, b].map(|x| reading.changed(x)))
}

/// Makes a texture of alpha. Returns `None` if nothing is cut by it. `from_alpha` is true for the alpha of a texture of
/// colours, which is 1 if the picture has none.
pub(super) fn cut(image: &DynamicImage, reading: Reading, from_alpha: bool, name: String) -> Option<Texture> {
    let has_alpha = || image.color().has_alpha() && image.to_rgba8().pixels().any(|texel| texel.0[3] < 255);
    let channel = match reading.channel {
        _ if from_alpha => b'm',
        Some(channel) => channel,
        None if has_alpha() => b'm',
        None => b'l',
    };
    let alpha = texture(image, name, |[r, g, b, a]| {
        let luminance = || ((299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000) as u8;
        let value = match channel {
            b'r' => r,
            b'g' => g,
            b'b' => b,
            b'm' => a,
            _ => luminance(),
        };
        [if from_alpha { value } else { reading.changed(value) }]
    });
    alpha.texels.iter().any(|&alpha| alpha < LEAST).then_some(alpha)
}

impl Reading {
    fn changed(self, value: u8) -> u8 {
        let [base, gain] = self.base_gain;
        (255.0 * base + gain * f64::from(value)).round().clamp(0.0, 255.0) as u8
    }
}

/// Makes a texture, whose texels `of` computes from red, green, blue and alpha.
fn texture<const N: usize>(image: &DynamicImage, name: String, of: impl Fn([u8; 4]) -> [u8; N]) -> Texture {
    let rgba = image.to_rgba8();
    let texels = rgba.rows().rev().flat_map(|row| row.flat_map(|texel| of(texel.0))).collect();
    Texture { width: rgba.width(), height: rgba.height(), channels: N, texels, name }
}
