//! Images in memory, and PNG and EXR in and out, written whole or not at all.
//!
//! [`png`] and [`exr`] turn an [`Image`] into the bytes of a file and read it back; [`Outputs`] puts bytes under their
//! names, all files of a run together. The kind of texel says the kind of file: `u8` is grey and `[u8; 3]` is RGB in a
//! PNG, `f32` is the channel `Y` and `[f32; 3]` are `R`, `G`, `B` in an EXR.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use crate::Error;

pub mod exr;
mod output;
pub mod png;

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
    #[must_use]
    pub fn filled(width: usize, height: usize, texel: T) -> Image<T> {
        Image { width, height, texels: vec![texel; width * height] }
    }

    /// An image made texel by texel, of (x, y) with y up.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Image<T> {
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            texels.extend((0..width).map(|x| f(x, y)));
        }
        Image { width, height, texels }
    }

    /// The texel in column `x` of row `y`, y up.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.texels[y * self.width + x]
    }

    /// The image with `f` applied to each texel.
    #[must_use]
    pub fn map<U: Copy>(&self, f: impl Fn(T) -> U) -> Image<U> {
        Image { width: self.width, height: self.height, texels: self.texels.iter().map(|&t| f(t)).collect() }
    }

    /// The rows as image files have them, the top row first. The image must hold texels.
    fn rows_from_top(&self) -> impl Iterator<Item = &[T]> {
        self.texels.chunks_exact(self.width).rev()
    }

    /// True where there is nothing that a file could hold: neither format knows an image without pixels.
    fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0
    }
}

/// A number that image files hold: `u8` in PNG, `f32` in EXR.
pub trait Component: Copy {}
impl Component for u8 {}
impl Component for f32 {}

/// A texel that image files hold: one component (`u8`, `f32`) or three (`[u8; 3]`, `[f32; 3]`).
pub trait Texel: Copy {
    /// What it is made of.
    type Component: Component;
    /// How many components it has.
    const COMPONENTS: usize;
    /// Its components in order.
    fn components(&self) -> &[Self::Component];
    /// A texel of component i = `component(i)`.
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

/// What every file that we write says about itself, as (keyword, text): the software, and the settings that made it.
#[must_use]
pub fn metadata(settings: &str) -> [(&'static str, &str); 2] {
    [("Software", concat!("hbao ", env!("CARGO_PKG_VERSION"))), ("hbao", settings)]
}

/// Bytes of text that are read from a file, and of the header that holds it in an EXR.
const MOST_TEXT: usize = 1 << 24;

/// Opens an image file to be read, and tells its length in bytes.
fn open(path: &Path) -> Result<(BufReader<File>, u64), Error> {
    let open = || {
        let mut file = File::open(path)?;
        let length = file.seek(SeekFrom::End(0))?;
        file.rewind()?;
        Ok((BufReader::new(file), length))
    };
    open().map_err(|e: std::io::Error| Error::input(path, e.to_string()))
}

/// Refuses a file whose header claims more bytes of pixels than a file of its length can hold, before memory is set
/// aside for them. Deflate, inside both formats, makes at best 1 byte of 1032, EXR's other codecs not much less.
fn check_claim(path: &Path, length: u64, claimed: u128) -> Result<(), Error> {
    const BEST_COMPRESSION: u128 = 2048;
    if claimed > u128::from(length) * BEST_COMPRESSION || usize::try_from(claimed).is_err() {
        let what = format!("damaged: its header claims {claimed} bytes of pixels, the file has {length} bytes");
        return Err(Error::input(path, what));
    }
    Ok(())
}
