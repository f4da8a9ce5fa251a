//! Images in memory; with the feature `render` also PNG and EXR files, which are written either completely or not at
//! all.
//!
//! `png` and `exr` turn an [`Image`] into the bytes of a file, and read files back. `Outputs` writes the bytes to
//! files, all files of a run together. The type of the texels determines the kind of file: in a PNG `u8` is grey and
//! `[u8; 3]` is RGB; in an EXR `f32` is the channel `Y` and `[f32; 3]` are the channels `R`, `G` and `B`.

#[cfg(feature = "render")]
mod channels;
#[cfg(feature = "render")]
pub mod exr;
#[cfg(feature = "render")]
mod file;
#[cfg(feature = "render")]
mod layers;
#[cfg(feature = "render")]
mod output;
#[cfg(feature = "render")]
pub mod png;

#[cfg(feature = "render")]
pub use channels::{Channel, Channels, Samples};
#[cfg(feature = "render")]
pub use file::{Component, Texel, metadata};
#[cfg(feature = "render")]
pub use layers::Layers;
#[cfg(feature = "render")]
pub use output::Outputs;

/// Reads a PNG or EXR file of any kind that other programs write. What the file is follows from its first bytes.
///
/// A PNG may be grey or RGB, with or without alpha or a palette, interlaced or not, and have 1 to 16 bits. Of an EXR
/// file all channels of the first layer are read, within its data window.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if the file cannot be read, is damaged, or is neither a PNG nor an EXR file.
#[cfg(feature = "render")]
pub fn read_channels(path: &std::path::Path) -> Result<Channels, crate::Error> {
    match &file::first_bytes(path)? {
        b"\x89PNG" => png::read_channels(path),
        b"\x76\x2f\x31\x01" => exr::read_channels(path),
        _ => Err(crate::Error::input(path, "it is neither a PNG nor an EXR file: convert it to one of these")),
    }
}

/// A rectangle of texels, stored row by row **from the bottom up**, as in an OpenGL window: `texels[y * width + x]`.
/// Image files store the top row first. Reading and writing them reverses the order of the rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// The number of texels in a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// `width * height` texels, the bottom row first.
    pub texels: Vec<T>,
}

impl<T: Copy> Image<T> {
    /// Makes an image in which every texel is `texel`.
    #[must_use]
    pub fn filled(width: usize, height: usize, texel: T) -> Image<T> {
        Image { width, height, texels: vec![texel; width * height] }
    }

    /// Makes an image in which the texel at column x of row y is `f(x, y)`. Row 0 is at the bottom.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Image<T> {
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            texels.extend((0..width).map(|x| f(x, y)));
        }
        Image { width, height, texels }
    }

    /// Returns the texel at column `x` of row `y`. Row 0 is at the bottom.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.texels[y * self.width + x]
    }

    /// Returns the part of the image that is `width` by `height` texels large and whose lower left texel is (`x`, `y`).
    /// It must lie within the image.
    #[must_use]
    pub fn part(&self, (x, y): (usize, usize), (width, height): (usize, usize)) -> Image<T> {
        Image::from_fn(width, height, |i, j| self.at(x + i, y + j))
    }

    /// Makes an image of the same size by applying `f` to each texel.
    #[must_use]
    pub fn map<U: Copy>(&self, f: impl Fn(T) -> U) -> Image<U> {
        Image { width: self.width, height: self.height, texels: self.texels.iter().map(|&t| f(t)).collect() }
    }
}
