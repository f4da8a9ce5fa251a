//! Images in memory, and PNG and EXR files, which are read, and written either completely or not at all.
//!
//! [`png`] and [`exr`] turn an [`Image`] into the bytes of a file, and read files back. [`Outputs`] writes the bytes to
//! files, all files of a run together. The type of the texels determines the kind of file: in a PNG `u8` is grey and
//! `[u8; 3]` is RGB; in an EXR `f32` is the channel `Y` and `[f32; 3]` are the channels `R`, `G` and `B`.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use crate::Error;

pub mod exr;
mod output;
pub mod png;

pub use output::Outputs;

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

    /// The texel at column `x` of row `y`. Row 0 is at the bottom.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.texels[y * self.width + x]
    }

    /// Makes an image of the same size by applying `f` to each texel.
    #[must_use]
    pub fn map<U: Copy>(&self, f: impl Fn(T) -> U) -> Image<U> {
        Image { width: self.width, height: self.height, texels: self.texels.iter().map(|&t| f(t)).collect() }
    }

    /// The rows in the order of image files, the top row first. The image must not be empty.
    fn rows_from_top(&self) -> impl Iterator<Item = &[T]> {
        self.texels.chunks_exact(self.width).rev()
    }

    /// True if the image has no texels. Neither file format can store such an image.
    fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0
    }
}

/// A number that image files store: `u8` in PNG, `f32` in EXR.
pub trait Component: Copy {}
impl Component for u8 {}
impl Component for f32 {}

/// A texel that image files store: one component (`u8`, `f32`) or three (`[u8; 3]`, `[f32; 3]`).
pub trait Texel: Copy {
    /// The type of its components.
    type Component: Component;
    /// The number of its components: 1 or 3.
    const COMPONENTS: usize;
    /// Its components, in order.
    fn components(&self) -> &[Self::Component];
    /// Makes a texel whose component number i is `component(i)`.
    fn from_components(component: impl Fn(usize) -> Self::Component) -> Self;
}

impl<C: Component> Texel for C {
    type Component = C;
    const COMPONENTS: usize = 1;
    fn components(&self) -> &[C] {
        std::slice::from_ref(self)
    }
    fn from_components(component: impl Fn(usize) -> C) -> C {
        component(0)
    }
}

impl<C: Component> Texel for [C; 3] {
    type Component = C;
    const COMPONENTS: usize = 3;
    fn components(&self) -> &[C] {
        self
    }
    fn from_components(component: impl Fn(usize) -> C) -> [C; 3] {
        std::array::from_fn(component)
    }
}

/// The text, as pairs (keyword, text), that is stored in every file: the name of this software, and `settings`, the
/// settings that made the file.
#[must_use]
pub fn metadata(settings: &str) -> [(&'static str, &str); 2] {
    [("Software", concat!("hbao ", env!("CARGO_PKG_VERSION"))), ("hbao", settings)]
}

/// The most bytes of text that are read from a PNG, and the most bytes of an EXR's header, which contains the text.
const MOST_TEXT: usize = 1 << 24;

/// Opens an image file for reading. Returns the file and its length in bytes.
fn open(path: &Path) -> Result<(BufReader<File>, u64), Error> {
    let open = || {
        let mut file = File::open(path)?;
        let length = file.seek(SeekFrom::End(0))?;
        file.rewind()?;
        Ok((BufReader::new(file), length))
    };
    open().map_err(|e: std::io::Error| Error::input(path, e.to_string()))
}

/// Refuses a file whose header claims more bytes of pixels than a file of its length can contain. This is checked
/// before memory is allocated for the pixels. Deflate, which both formats use, compresses at best 1032 bytes to 1, and
/// EXR's other codecs do not do much better.
fn check_claim(path: &Path, length: u64, claimed: u128) -> Result<(), Error> {
    const BEST_COMPRESSION: u128 = 2048;
    if claimed > u128::from(length) * BEST_COMPRESSION || usize::try_from(claimed).is_err() {
        let what = format!("damaged: its header claims {claimed} bytes of pixels, the file has {length} bytes");
        return Err(Error::input(path, what));
    }
    Ok(())
}
