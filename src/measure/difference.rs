//! Measures how far one picture is from another, whatever channels they have.

use super::errors::{Errors, flip_of_colours};
use crate::Error;
use crate::image::{Channel, Channels, Image};

/// The difference of two pictures.
///
/// Values are compared as the files hold them, where 8 and 16 bits stand for 0 to 1; no gamma is applied. Equal
/// infinities are equal, and so are two NaNs. Other samples of which one is not finite cannot be subtracted: they are
/// left out of the errors, and their pixel differs by infinity.
#[derive(Clone, Debug)]
pub struct Difference {
    /// The errors of the first picture relative to the second, over the samples of all channels. They are NaN if no
    /// sample of one picture can be subtracted from that of the other. `flip` is `None` also if the pictures are not
    /// grey or RGB with values from 0 to 1.
    pub errors: Errors,
    /// The names of the channels that were compared.
    pub compared: Vec<String>,
    /// The names of channels that only one of the pictures has, and that were not compared.
    pub unmatched: Vec<String>,
    /// The number of pixels at which a sample could not be subtracted.
    pub unequal_non_finite: usize,
    /// The largest absolute difference of each pixel's samples, with the bottom row first.
    pub largest: Image<f64>,
}

/// A channel of both pictures. `None` stands for alpha that a picture does not have, which is 1 everywhere.
struct Pair<'a> {
    name: String,
    sides: [Option<&'a Channel>; 2],
}

impl Pair<'_> {
    fn at(&self, index: usize) -> [f64; 2] {
        self.sides.map(|side| side.map_or(1.0, |channel| channel.samples.at(index)))
    }
}

impl Difference {
    /// Compares the picture `got` with `truth`. The differences are `got` minus `truth`.
    ///
    /// A picture with one channel besides alpha is grey, whatever the channel is called. Grey is the same as RGB with
    /// three equal values. A picture without alpha is opaque. Alpha is compared unless both pictures are opaque.
    ///
    /// # Errors
    /// [`Error::Usage`] if the pictures have different sizes, or no channel in common.
    pub fn of(got: &Channels, truth: &Channels) -> Result<Difference, Error> {
        let size = |picture: &Channels| format!("{}x{}", picture.width, picture.height);
        if (got.width, got.height) != (truth.width, truth.height) {
            let sizes = [size(got), size(truth)].join(" and ");
            return Err(Error::Usage(format!("pictures of different sizes cannot be compared: {sizes}")));
        }
        let (width, height) = (got.width, got.height);
        let (pairs, unmatched) = pairs(got, truth)?;

        let (mut sum, mut absolute, mut squares, mut max, mut count) = (0.0, 0.0, 0.0, 0.0f64, 0usize);
        let mut largest = Image::filled(width, height, 0.0f64);
        for pair in &pairs {
            for (i, largest) in largest.texels.iter_mut().enumerate() {
                // Channels begin with the top row, images with the bottom row.
                let difference = difference(pair.at((height - 1 - i / width) * width + i % width));
                *largest = largest.max(difference.abs());
                if difference.is_finite() {
                    sum += difference;
                    absolute += difference.abs();
                    squares += difference * difference;
                    max = max.max(difference.abs());
                    count += 1;
                }
            }
        }
        let mean = |sum: f64| sum / count as f64;
        let errors = Errors {
            rmse: mean(squares).sqrt(),
            mae: mean(absolute),
            bias: mean(sum),
            max: if count > 0 { max } else { f64::NAN },
            flip: flip(&pairs, (width, height)),
            pixels: width * height,
        };
        Ok(Difference {
            errors,
            compared: pairs.into_iter().map(|pair| pair.name).collect(),
            unmatched,
            unequal_non_finite: largest.texels.iter().filter(|largest| largest.is_infinite()).count(),
            largest,
        })
    }

    /// Returns the peak signal-to-noise ratio in decibels, for a peak of 1. It is infinite for equal pictures.
    #[must_use]
    pub fn psnr(&self) -> f64 {
        -20.0 * self.errors.rmse.log10()
    }

    /// Returns how many pixels differ by more than `tolerance` in some channel. Double precision cannot hold most
    /// steps of 8 bits exactly, so a difference that is larger by a part in 1e9 is still within the tolerance.
    #[must_use]
    pub fn pixels_over(&self, tolerance: f64) -> usize {
        self.largest.texels.iter().filter(|&&largest| largest > tolerance * (1.0 + 1e-9)).count()
    }
}

/// Returns the difference of two samples. It is infinite if they cannot be subtracted and are not equal.
fn difference([got, truth]: [f64; 2]) -> f64 {
    match got - truth {
        _ if got == truth || got.is_nan() && truth.is_nan() => 0.0,
        difference if difference.is_finite() => difference,
        _ => f64::INFINITY,
    }
}

/// Returns the channels that are compared, colours first, and the names of those that only one picture has.
fn pairs<'a>(got: &'a Channels, truth: &'a Channels) -> Result<(Vec<Pair<'a>>, Vec<String>), Error> {
    let pictures = [got, truth];
    let named = |picture: &'a Channels, name: &str| picture.channels.iter().find(|channel| channel.name == name);
    let colours = pictures.map(|picture| picture.channels.iter().filter(|channel| channel.name != "A").collect());
    let [of_got, of_truth]: &[Vec<&Channel>; 2] = &colours;
    let is_rgb = |picture| ["R", "G", "B"].iter().all(|name| named(picture, name).is_some());

    let mut pairs: Vec<Pair> = match (&of_got[..], &of_truth[..]) {
        (&[a], &[b]) => vec![Pair { name: a.name.clone(), sides: [Some(a), Some(b)] }],
        (&[grey], _) if is_rgb(truth) => rgb(|name| [Some(grey), named(truth, name)]),
        (_, &[grey]) if is_rgb(got) => rgb(|name| [named(got, name), Some(grey)]),
        _ => {
            let both = of_got
                .iter()
                .filter_map(|a| Some(Pair { name: a.name.clone(), sides: [Some(*a), Some(named(truth, &a.name)?)] }));
            both.collect()
        }
    };
    // EXR files hold channels in the order of the alphabet.
    pairs.sort_by_key(|pair| ["R", "G", "B"].iter().position(|name| *name == pair.name).unwrap_or(3));

    let alpha = Pair { name: "A".into(), sides: pictures.map(|picture| named(picture, "A")) };
    let opaque =
        alpha.sides.iter().flatten().all(|channel| (0..got.width * got.height).all(|i| channel.samples.at(i) == 1.0));
    if !opaque {
        pairs.push(alpha);
    }
    if pairs.is_empty() {
        let names = colours.map(|colours| colours.iter().map(|channel| &*channel.name).collect::<Vec<_>>().join(", "));
        let [a, b] = names.map(|names| Error::shown(&names));
        return Err(Error::Usage(format!("the pictures have no channel in common: one has {a}, the other {b}")));
    }
    let is_compared = |channel: &Channel| {
        channel.name == "A"
            || pairs.iter().any(|pair| pair.sides.into_iter().flatten().any(|one| std::ptr::eq(one, channel)))
    };
    let unmatched = colours.iter().flatten().filter(|channel| !is_compared(channel));
    let unmatched = unmatched.map(|channel| Error::shown(&channel.name)).collect();
    Ok((pairs, unmatched))
}

/// Makes the three channels of a colour.
fn rgb<'a>(sides: impl Fn(&str) -> [Option<&'a Channel>; 2]) -> Vec<Pair<'a>> {
    ["R", "G", "B"].map(|name| Pair { name: name.into(), sides: sides(name) }).into()
}

/// Returns FLIP, averaged over the picture. `None` if the crate was built without FLIP, or if the pictures are not grey
/// or RGB with values from 0 to 1.
fn flip(pairs: &[Pair], size: (usize, usize)) -> Option<f64> {
    let colours: Vec<&Pair> = pairs.iter().filter(|pair| pair.name != "A").collect();
    let [r, g, b] = match colours[..] {
        [grey] => [grey; 3],
        [r, g, b] if [r, g, b].map(|pair| &*pair.name) == ["R", "G", "B"] => [r, g, b],
        _ => return None,
    };
    let pixels = size.0 * size.1;
    let mut bytes = [Vec::with_capacity(3 * pixels), Vec::with_capacity(3 * pixels)];
    for i in 0..pixels {
        for pair in [r, g, b] {
            for (bytes, value) in bytes.iter_mut().zip(pair.at(i)) {
                if !(0.0..=1.0).contains(&value) {
                    return None;
                }
                bytes.push((255.0 * value).round() as u8);
            }
        }
    }
    let map = flip_of_colours(size, &bytes[0], &bytes[1])?;
    Some(map.iter().map(|&flip| f64::from(flip)).sum::<f64>() / pixels as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Samples;

    fn picture(width: usize, channels: &[(&str, &[u8])]) -> Channels {
        let channel =
            |(name, bytes): &(&str, &[u8])| Channel { name: (*name).into(), samples: Samples::Bytes(bytes.to_vec()) };
        let height = channels[0].1.len() / width;
        Channels { width, height, channels: channels.iter().map(channel).collect(), layers: 1 }
    }

    #[test]
    fn a_difference_of_one_step_of_8_bits_is_within_a_tolerance_of_one_step() {
        for step in 0..255u8 {
            let [a, b] = [step + 1, step].map(|value| picture(1, &[("Y", &[value])]));
            let difference = Difference::of(&a, &b).unwrap();
            assert_eq!((difference.pixels_over(1.0 / 255.0), difference.pixels_over(0.99 / 255.0)), (0, 1), "{step}");
            assert!(difference.errors.bias > 0.0);
        }
    }

    #[test]
    fn the_largest_differences_have_the_bottom_row_first() {
        let (a, b) = (picture(1, &[("Y", &[0, 255])]), picture(1, &[("Y", &[0, 0])]));
        assert_eq!(Difference::of(&a, &b).unwrap().largest.texels, [1.0, 0.0]);
    }

    #[test]
    fn grey_is_equal_rgb_and_no_alpha_is_opaque() {
        let grey = picture(2, &[("Y", &[7, 200])]);
        let rgb = picture(2, &[("B", &[7, 200]), ("G", &[7, 200]), ("R", &[7, 203])]);
        let opaque = picture(2, &[("Y", &[7, 200]), ("A", &[255, 255])]);
        let clear = picture(2, &[("Y", &[7, 200]), ("A", &[255, 0])]);
        let of = |a, b| Difference::of(a, b).unwrap();
        assert_eq!(of(&grey, &rgb).compared, ["R", "G", "B"]);
        assert!((of(&rgb, &grey).errors.max - 3.0 / 255.0).abs() < 1e-12);
        assert_eq!((of(&grey, &opaque).compared, of(&grey, &opaque).psnr()), (vec!["Y".into()], f64::INFINITY));
        assert_eq!((of(&grey, &clear).compared, of(&grey, &clear).errors.max), (vec!["Y".into(), "A".into()], 1.0));
    }
}
