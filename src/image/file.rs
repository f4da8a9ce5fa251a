//! What PNG and EXR files have in common.

use super::Image;
use crate::Error;
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

impl<T: Copy> Image<T> {
    /// The rows as image files have them, the top row first. The image must hold texels.
    pub(super) fn rows_from_top(&self) -> impl Iterator<Item = &[T]> {
        self.texels.chunks_exact(self.width).rev()
    }

    /// True where there is nothing that a file could hold: neither format knows an image without pixels.
    pub(super) fn is_empty(&self) -> bool {
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
pub fn metadata(settings: &str) -> [(&'static str, &str); 2] {
    [("Software", concat!("hbao ", env!("CARGO_PKG_VERSION"))), ("hbao", settings)]
}

/// Bytes of text that are read from a file, and of the header that holds it in an EXR.
pub(super) const MOST_TEXT: usize = 1 << 24;

/// Opens an image file to be read, and tells its length in bytes.
pub(super) fn open(path: &Path) -> Result<(BufReader<File>, u64), Error> {
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
pub(super) fn check_claim(path: &Path, length: u64, claimed: u128) -> Result<(), Error> {
    const BEST_COMPRESSION: u128 = 2048;
    if claimed > u128::from(length) * BEST_COMPRESSION || usize::try_from(claimed).is_err() {
        let what = format!("damaged: its header claims {claimed} bytes of pixels, the file has {length} bytes");
        return Err(Error::input(path, what));
    }
    Ok(())
}
