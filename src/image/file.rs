//! Functions and types that PNG and EXR files share.

use super::Image;
use crate::Error;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read as _, Seek, SeekFrom};
use std::path::Path;

impl<T: Copy> Image<T> {
    /// Returns the rows in the order of image files, with the top row first. The image must not be empty.
    pub(super) fn rows_from_top(&self) -> impl Iterator<Item = &[T]> {
        self.texels.chunks_exact(self.width).rev()
    }

    /// Returns true if the image has no texels. Neither file format can store such an image.
    pub(super) fn is_empty(&self) -> bool {
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

/// Returns the text that is stored in every file, as pairs (keyword, text): the name of this software, and `settings`,
/// the text of the settings that the file was made with.
#[must_use]
pub fn metadata(settings: &str) -> [(&'static str, &str); 2] {
    [("Software", concat!("hbao ", env!("CARGO_PKG_VERSION"))), ("hbao", settings)]
}

/// The largest number of bytes of text that are read from a PNG. It is also the largest number of bytes of an EXR's
/// header, which contains the text.
pub(super) const MOST_TEXT: usize = 1 << 24;

/// Opens an image file for reading. Returns the file and its length in bytes.
pub(super) fn open(path: &Path) -> Result<(BufReader<File>, u64), Error> {
    let open = || {
        let mut file = File::open(path)?;
        let length = file.seek(SeekFrom::End(0))?;
        file.rewind()?;
        Ok((BufReader::new(file), length))
    };
    open().map_err(|e: std::io::Error| cannot_open(path, &e))
}

fn cannot_open(path: &Path, error: &std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound => Error::input(path, "no such file"),
        ErrorKind::IsADirectory => Error::input(path, "this is a folder, and not a picture"),
        _ => Error::input(path, error.to_string()),
    }
}

/// Returns the error of a file whose pixels cannot be decoded.
pub(super) fn damaged(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::input(path, format!("the file is damaged or cut off ({error})"))
}

/// Returns the first four bytes of a file, by which its format is recognised. Those of a shorter file are followed by
/// zeros.
pub(super) fn first_bytes(path: &Path) -> Result<[u8; 4], Error> {
    let mut bytes = Vec::new();
    let read = |file: File| file.take(4).read_to_end(&mut bytes);
    File::open(path).and_then(read).map_err(|e| cannot_open(path, &e))?;
    bytes.resize(4, 0);
    Ok([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Refuses a file whose header claims more bytes of pixels than a file of its length can contain. This is checked
/// before memory is allocated for the pixels. Deflate, which both formats use, compresses at best 1032 bytes to 1, and
/// EXR's other codecs do not do much better.
pub(super) fn check_claim(path: &Path, length: u64, claimed: u128) -> Result<(), Error> {
    const BEST_COMPRESSION: u128 = 2048;
    if claimed > u128::from(length) * BEST_COMPRESSION || usize::try_from(claimed).is_err() {
        let what = format!("damaged: its header claims {claimed} bytes of pixels, the file has {length} bytes");
        return Err(Error::input(path, what));
    }
    Ok(())
}
