//! Textures of materials: where a texture is laid, which texel is seen, and how its file is decoded.
//!
//! The texel that is seen at a texture coordinate is the nearest one of the whole texture, after the coordinate is
//! wrapped into [0, 1], with v up. The shader of the G-buffer computes the same in float32.

use crate::Error;
use glam::DVec2;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Seek};
use std::path::Path;
use std::sync::Arc;

/// The most texels of a side of a texture. Larger textures are not read.
const LONGEST: u32 = 16384;

/// The most bytes that decoding a texture may need.
const MOST_BYTES: u64 = 1 << 29;

/// The most texels of all textures of a model. Textures after these are not read.
const MOST_TEXELS: u64 = 1 << 28;

/// The most texels that are decoded or converted for a model, which may lay a picture in many ways.
const MOST_WORK: u64 = 1 << 32;

/// A smaller texture counts as one of this many texels, so that there are not too many.
const LEAST_TEXELS: u64 = 1 << 12;

/// The largest magnitude of a texture coordinate. float32 knows a point of a texture there to a sixteenth of it.
pub(super) const FARTHEST_COORDINATE: f64 = 1e6;

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

/// How a texture is laid: a coordinate is multiplied by `scale`, then `offset` is added, and then it is wrapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) scale: DVec2,
    pub(crate) offset: DVec2,
    /// How u and v are wrapped into [0, 1].
    pub(crate) wrap: [Wrap; 2],
}

/// How a texture goes on outside [0, 1]. The numbers are those in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Wrap {
    /// It is repeated.
    #[default]
    Repeat = 0,
    /// Its border goes on.
    Clamp = 1,
    /// It is repeated, every other time as a mirror image.
    Mirror = 2,
}

impl Wrap {
    /// Returns the place in [0, 1] that is seen at `x`.
    fn within(self, x: f64) -> f64 {
        match self {
            Wrap::Repeat => x - x.floor(),
            Wrap::Clamp => x.clamp(0.0, 1.0),
            Wrap::Mirror => 1.0 - (x - 2.0 * (0.5 * x).floor() - 1.0).abs(),
        }
    }
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
        let Map { texture, placed: Placed { scale, offset, wrap } } = self;
        // The name is only for messages.
        let Texture { width, height, channels, texels, name: _ } = &**texture;
        hash.update(width.to_le_bytes());
        hash.update(height.to_le_bytes());
        hash.update(channels.to_le_bytes());
        hash.update(texels);
        [scale, offset].into_iter().flat_map(DVec2::to_array).for_each(|x| hash.update(x.to_le_bytes()));
        hash.update(wrap.map(|wrap| wrap as u8));
    }

    /// Returns the bytes of the texel at a texture coordinate.
    fn texel(&self, at: DVec2) -> &[u8] {
        let Placed { scale, offset, wrap: [in_u, in_v] } = self.placed;
        let at = at * scale + offset;
        // The conversion makes 0 of NaN.
        let [x, y] = [(in_u.within(at.x), self.texture.width), (in_v.within(at.y), self.texture.height)]
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
    let is_tga = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tga"));
    decode_from(BufReader::new(file), is_tga)
}

/// Reads a PNG, JPEG or BMP picture, or if it `is_tga` a TGA picture, which has no mark of its own.
///
/// # Errors
/// The same as for [`decode`].
pub(super) fn decode_from(bytes: impl BufRead + Seek, is_tga: bool) -> Result<DynamicImage, String> {
    let mut reader = ImageReader::new(bytes).with_guessed_format().map_err(|e| format!("cannot be read ({e})"))?;
    if reader.format().is_none() && is_tga {
        reader.set_format(ImageFormat::Tga);
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

/// Makes a texture that cuts where `is_cut` says so of a picture's alpha, from 0 to 255. Returns `None` if nothing is
/// cut by it.
pub(super) fn cut_where(image: &DynamicImage, is_cut: impl Fn(u8) -> bool, name: String) -> Option<Texture> {
    let alpha = texture(image, name, |[.., alpha]| [if is_cut(alpha) { 0 } else { u8::MAX }]);
    alpha.texels.contains(&0).then_some(alpha)
}

impl Reading {
    /// A picture as it is.
    pub(super) const PLAIN: Reading = Reading { base_gain: [0.0, 1.0], channel: None };

    fn changed(self, value: u8) -> u8 {
        let [base, gain] = self.base_gain;
        (255.0 * base + gain * f64::from(value)).round().clamp(0.0, 255.0) as u8
    }
}

/// The textures of a model that have been made from pictures. Each is made once.
#[derive(Default)]
pub(super) struct Pictures {
    /// What each picture became, by its name and what was made of it.
    made: HashMap<(String, String), Made>,
    texels: u64,
    /// The texels that have been decoded or converted.
    worked: u64,
    /// The picture that was decoded last, since the alpha of a texture of colours is read after its colours.
    last: Option<(String, DynamicImage)>,
}

/// A texture, or none if it cuts nothing, or why it cannot be read.
type Made = Result<Option<Arc<Texture>>, String>;

impl Pictures {
    /// Returns the texture that `make` makes of a picture, which `decode` decodes. `name` stands for the picture, and
    /// `how` for what is made of it.
    ///
    /// # Errors
    /// Why there is no texture, in words that follow the picture's name.
    pub(super) fn texture(
        &mut self,
        name: &str,
        how: String,
        decode: impl FnOnce() -> Result<DynamicImage, String>,
        make: impl FnOnce(&DynamicImage) -> Option<Texture>,
    ) -> Made {
        let key = (name.to_string(), how);
        if let Some(made) = self.made.get(&key) {
            return made.clone();
        }
        let made = self.image(name, decode).and_then(|image| {
            let texels = u64::from(image.width()) * u64::from(image.height());
            if self.texels + texels > MOST_TEXELS {
                return Err(format!("comes after {} texels of other textures, and no more are read", self.texels));
            }
            self.charge(texels)?;
            let texture = make(&image);
            self.last = Some((name.to_string(), image));
            self.texels += texture.as_ref().map_or(0, |_| texels.max(LEAST_TEXELS));
            Ok(texture.map(Arc::new))
        });
        self.made.insert(key, made.clone());
        made
    }

    fn image(
        &mut self,
        name: &str,
        decode: impl FnOnce() -> Result<DynamicImage, String>,
    ) -> Result<DynamicImage, String> {
        match self.last.take() {
            Some((last, image)) if last == name => Ok(image),
            _ => {
                self.charge(0)?;
                let image = decode()?;
                self.charge(u64::from(image.width()) * u64::from(image.height()))?;
                Ok(image)
            }
        }
    }

    /// Counts the work on this many texels.
    fn charge(&mut self, texels: u64) -> Result<(), String> {
        self.worked += texels.max(LEAST_TEXELS);
        if self.worked > MOST_WORK { Err("comes after too much work on other textures".into()) } else { Ok(()) }
    }
}

/// Makes a texture, whose texels `of` computes from red, green, blue and alpha.
fn texture<const N: usize>(image: &DynamicImage, name: String, of: impl Fn([u8; 4]) -> [u8; N]) -> Texture {
    let rgba = image.to_rgba8();
    let texels = rgba.rows().rev().flat_map(|row| row.flat_map(|texel| of(texel.0))).collect();
    Texture { width: rgba.width(), height: rgba.height(), channels: N, texels, name }
}
