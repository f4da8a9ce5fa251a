//! The image comparator. Images that cannot be compared count as a mismatch, and so does an empty mask.

use hbao::image::{Image, exr, png};
use std::fmt;
use std::path::Path;

/// The differences that a comparison allows.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// The largest absolute difference at which a pixel passes.
    pub tolerance: f64,
    /// The share of the compared pixels that may exceed the tolerance.
    pub share: f64,
}

/// Every pixel must be within `tolerance`.
pub fn everywhere(tolerance: f64) -> Limits {
    Limits { tolerance, share: 0.0 }
}

/// Why two images do not match.
#[derive(Clone, Debug, PartialEq)]
pub enum Mismatch {
    /// The images and the mask have different sizes. These are the widths and heights of the three.
    Sizes([(usize, usize); 3]),
    /// The mask leaves nothing to compare.
    Nothing,
    /// One of the images is NaN or infinite at this many pixels, of which the first is (x, y).
    NotFinite { pixels: usize, at: (usize, usize) },
    /// More than the allowed share of pixels differ by more than the tolerance.
    Differs { worst: f64, at: (usize, usize), over: usize, compared: usize },
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Mismatch::Sizes(sizes) => write!(f, "sizes of got, expected and mask: {sizes:?}"),
            Mismatch::Nothing => write!(f, "nothing to compare: the mask is empty"),
            Mismatch::NotFinite { pixels, at } => write!(f, "{pixels} pixels are NaN or infinite, the first at {at:?}"),
            Mismatch::Differs { worst, at, over, compared } => {
                let share = 100.0 * *over as f64 / *compared as f64;
                write!(f, "{over} of {compared} pixels ({share:.3} %) differ too much, by {worst:.3e} at {at:?}")
            }
        }
    }
}

/// Compares two images at the pixels where `mask` is true.
pub fn compare<A: Copy + Into<f64>, B: Copy + Into<f64>>(
    got: &Image<A>,
    expected: &Image<B>,
    mask: &Image<bool>,
    limits: Limits,
) -> Result<(), Mismatch> {
    let sizes = [(got.width, got.height), (expected.width, expected.height), (mask.width, mask.height)];
    if sizes[0] != sizes[1] || sizes[0] != sizes[2] {
        return Err(Mismatch::Sizes(sizes));
    }
    let place = |i: usize| (i % got.width, i / got.width);
    let (mut compared, mut over, mut worst, mut at) = (0, 0, 0.0, (0, 0));
    let (mut not_finite, mut first) = (0, None);
    for i in (0..mask.texels.len()).filter(|&i| mask.texels[i]) {
        compared += 1;
        let difference = (got.texels[i].into() - expected.texels[i].into()).abs();
        if !difference.is_finite() {
            not_finite += 1;
            first = first.or(Some(place(i)));
        } else if difference > limits.tolerance {
            over += 1;
            if difference > worst {
                (worst, at) = (difference, place(i));
            }
        }
    }
    match first {
        _ if compared == 0 => Err(Mismatch::Nothing),
        Some(at) => Err(Mismatch::NotFinite { pixels: not_finite, at }),
        None if over as f64 > limits.share * compared as f64 => Err(Mismatch::Differs { worst, at, over, compared }),
        None => Ok(()),
    }
}

/// Panics with `context` if the images do not match. It then saves both images and their difference in Cargo's
/// directory for temporary files, so that people can look at them.
#[track_caller]
pub fn hold<A: Copy + Into<f64>, B: Copy + Into<f64>>(
    what: &str,
    got: &Image<A>,
    expected: &Image<B>,
    mask: &Image<bool>,
    limits: Limits,
    context: &str,
) {
    if let Err(mismatch) = compare(got, expected, mask, limits) {
        let saved = save(what, got, expected, mask);
        panic!("{what}: {mismatch}\nallowed: {limits:?}\nimages: {saved}\n{context}");
    }
}

/// Saves the images, and 16 times their difference as a grey PNG. Returns the common start of their paths.
fn save<A: Copy + Into<f64>, B: Copy + Into<f64>>(
    what: &str,
    got: &Image<A>,
    expected: &Image<B>,
    mask: &Image<bool>,
) -> String {
    let test = std::thread::current().name().unwrap_or("test").replace("::", "-");
    let name = format!("{test}-{}", what.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
    let stem = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).display().to_string();
    let write = |suffix: &str, bytes: Result<Vec<u8>, hbao::Error>| {
        if let Ok(bytes) = bytes {
            std::fs::write(format!("{stem}-{suffix}"), bytes).ok();
        }
    };
    write("got.exr", exr::encode(&got.map(|t| t.into() as f32), &[]));
    write("expected.exr", exr::encode(&expected.map(|t| t.into() as f32), &[]));
    if got.texels.len() == expected.texels.len() && got.texels.len() == mask.texels.len() {
        let difference = Image::from_fn(got.width, got.height, |x, y| {
            let i = y * got.width + x;
            let difference = (got.texels[i].into() - expected.texels[i].into()).abs();
            if mask.texels[i] { (difference * 16.0 * 255.0).min(255.0) as u8 } else { 0 }
        });
        write("difference.png", png::encode(&difference, &[]));
    }
    format!("{stem}-*")
}
