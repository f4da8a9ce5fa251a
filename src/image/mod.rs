//! Images in memory, and PNG and EXR in and out, written whole or not at all.
//!
//! [`png`] and [`exr`] turn an [`Image`] into the bytes of a file and read it back; [`Outputs`] puts bytes under their
//! names, all files of a run together. The kind of texel says the kind of file: `u8` is grey and `[u8; 3]` is RGB in a
//! PNG, `f32` is the channel `Y` and `[f32; 3]` are `R`, `G`, `B` in an EXR.

#[cfg(feature = "render")]
pub mod exr;
#[cfg(feature = "render")]
mod file;
#[cfg(feature = "render")]
mod output;
#[cfg(feature = "render")]
pub mod png;

#[cfg(feature = "render")]
pub use file::{Component, Texel, metadata};
#[cfg(feature = "render")]
pub use output::Outputs;

/// A rectangle of texels, row by row **from the bottom up**, as in an OpenGL window: `texels[y * width + x]`.
/// Image files have the top row first; reading and writing them turns the rows around.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` texels, the bottom row first.
    pub texels: Vec<T>,
}

impl<T: Copy> Image<T> {
    /// An image that holds `texel` everywhere.
    pub fn filled(width: usize, height: usize, texel: T) -> Image<T> {
        Image { width, height, texels: vec![texel; width * height] }
    }

    /// An image made texel by texel, of (x, y) with y up.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Image<T> {
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            texels.extend((0..width).map(|x| f(x, y)));
        }
        Image { width, height, texels }
    }

    /// The texel in column `x` of row `y`, y up.
    pub fn at(&self, x: usize, y: usize) -> T {
        self.texels[y * self.width + x]
    }

    /// The image with `f` applied to each texel.
    pub fn map<U: Copy>(&self, f: impl Fn(T) -> U) -> Image<U> {
        Image { width: self.width, height: self.height, texels: self.texels.iter().map(|&t| f(t)).collect() }
    }
}
