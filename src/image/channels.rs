//! The channels of a picture that another program wrote, of whatever kind it is.

use crate::Error;
use ::exr::prelude::FlatSamples;
use std::path::Path;

/// The largest number of pixels of a picture whose channels are read, somewhat more than 7680x4320. A file of a few
/// kilobytes can be a picture of many more.
const MOST_PIXELS: usize = 1 << 25;

/// Checks that a picture is not too large for its channels to be read.
pub(super) fn check_pixels(path: &Path, width: usize, height: usize) -> Result<(), Error> {
    if width.saturating_mul(height) <= MOST_PIXELS {
        return Ok(());
    }
    Err(Error::input(path, format!("it has {width}x{height} pixels, and at most {MOST_PIXELS} are read: cut it up")))
}

/// A picture as its file holds it: any number of named channels of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// The number of samples in a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The channels, in the order of the file.
    pub channels: Vec<Channel>,
    /// How many layers (parts) the file has. Only the first is read.
    pub layers: usize,
}

/// One channel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The name in an EXR file. The channels of a PNG file are called `Y`, or `R`, `G` and `B`, and `A`.
    pub name: String,
    /// `width * height` samples. In contrast to an [`Image`](super::Image), the top row is first.
    pub samples: Samples,
}

/// The samples of a channel, in the type that the file has them in.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Samples of a PNG file with at most 8 bits. 255 stands for 1.
    Bytes(Vec<u8>),
    /// Samples of a PNG file with 16 bits. 65535 stands for 1.
    Words(Vec<u16>),
    /// Samples of an EXR file: half, float or whole numbers.
    Exr(FlatSamples),
}

impl Samples {
    /// Returns the value of a sample. It is exact, and in an EXR file it may be infinite or NaN.
    ///
    /// # Panics
    /// If there is no sample of this index.
    #[must_use]
    pub fn at(&self, index: usize) -> f64 {
        match self {
            Samples::Bytes(bytes) => f64::from(bytes[index]) / 255.0,
            Samples::Words(words) => f64::from(words[index]) / 65535.0,
            Samples::Exr(FlatSamples::F16(halves)) => halves[index].to_f64(),
            Samples::Exr(FlatSamples::F32(floats)) => f64::from(floats[index]),
            Samples::Exr(FlatSamples::U32(numbers)) => f64::from(numbers[index]),
        }
    }
}
