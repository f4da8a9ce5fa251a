//! How far ambient occlusion is from the truth: over the covered pixels alone, since background is 1 in both.

use crate::Error;
use crate::image::Image;

/// Errors of one image against another, in units of visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The mean absolute difference.
    pub mae: f64,
    /// The mean difference: above 0 where the image is too open.
    pub bias: f64,
    /// The largest absolute difference.
    pub max: f64,
    /// The mean over the same pixels of FLIP (Andersson et al. 2020) between both as 8-bit grey pictures, at 67 pixels a
    /// degree: 0 where nobody sees a difference, at most 1. None where the crate was built without it.
    pub flip: Option<f64>,
}

impl Errors {
    /// Compares `got` with `truth` where `mask` is true.
    ///
    /// # Errors
    /// Images of different sizes, or a mask that leaves no pixel.
    pub fn of(got: &Image<f32>, truth: &Image<f32>, mask: &Image<bool>) -> Result<Errors, Error> {
        let sizes = [(got.width, got.height), (truth.width, truth.height), (mask.width, mask.height)];
        if sizes[0] != sizes[1] || sizes[0] != sizes[2] {
            return Err(Error::Usage(format!("images of different sizes cannot be compared: {sizes:?}")));
        }
        let compared: Vec<usize> = (0..mask.texels.len()).filter(|&i| mask.texels[i]).collect();
        if compared.is_empty() {
            return Err(Error::Usage("no pixel holds a surface: there is nothing to compare".into()));
        }
        let difference = |&i: &usize| f64::from(got.texels[i]) - f64::from(truth.texels[i]);
        let mean =
            |f: &dyn Fn(f64) -> f64| compared.iter().map(|i| f(difference(i))).sum::<f64>() / compared.len() as f64;
        Ok(Errors {
            rmse: mean(&|d| d * d).sqrt(),
            mae: mean(&f64::abs),
            bias: mean(&|d| d),
            max: compared.iter().map(|i| difference(i).abs()).fold(0.0, f64::max),
            flip: flip(got, truth, &compared),
        })
    }
}

/// [`Errors::rmse`] alone: FLIP takes longer than a fast method's rendering.
///
/// # Errors
/// As [`Errors::of`].
pub fn rmse(got: &Image<f32>, truth: &Image<f32>, mask: &Image<bool>) -> Result<f64, Error> {
    let sizes = [(got.width, got.height), (truth.width, truth.height), (mask.width, mask.height)];
    if sizes[0] != sizes[1] || sizes[0] != sizes[2] {
        return Err(Error::Usage(format!("images of different sizes cannot be compared: {sizes:?}")));
    }
    let differences = got.texels.iter().zip(&truth.texels).map(|(&a, &b)| f64::from(a) - f64::from(b));
    let squares = differences.zip(&mask.texels).filter(|&(_, &compared)| compared).map(|(d, _)| d * d);
    let (sum, count) = squares.fold((0.0, 0u32), |(sum, count), square| (sum + square, count + 1));
    if count == 0 {
        return Err(Error::Usage("no pixel holds a surface: there is nothing to compare".into()));
    }
    Ok((sum / f64::from(count)).sqrt())
}

#[cfg(feature = "cli")]
fn flip(got: &Image<f32>, truth: &Image<f32>, compared: &[usize]) -> Option<f64> {
    let grey = |image: &Image<f32>| {
        let bytes: Vec<u8> = image.texels.iter().flat_map(|a| [(a.clamp(0.0, 1.0) * 255.0).round() as u8; 3]).collect();
        nv_flip::FlipImageRgb8::with_data(image.width as u32, image.height as u32, &bytes)
    };
    let map = nv_flip::flip(grey(truth), grey(got), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    Some(compared.iter().map(|&i| f64::from(map[i])).sum::<f64>() / compared.len() as f64)
}

#[cfg(not(feature = "cli"))]
fn flip(_: &Image<f32>, _: &Image<f32>, _: &[usize]) -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_measures_are_what_they_are_called() {
        let truth = Image { width: 2, height: 2, texels: vec![0.5f32, 0.5, 0.5, 1.0] };
        let got = Image { width: 2, height: 2, texels: vec![0.75f32, 0.25, 0.75, 0.0] };
        let mask = Image { width: 2, height: 2, texels: vec![true, true, true, false] };
        let errors = Errors::of(&got, &truth, &mask).unwrap();
        assert_eq!((errors.rmse, errors.mae, errors.max), (0.25, 0.25, 0.25));
        assert!((errors.bias - 0.25 / 3.0).abs() < 1e-12);
        assert!(Errors::of(&got, &truth, &mask.map(|_| false)).is_err());
        assert!(Errors::of(&got, &Image::filled(1, 2, 0.5), &mask).is_err());
        assert_eq!(rmse(&got, &truth, &mask).unwrap(), 0.25);
        assert!(rmse(&got, &truth, &mask.map(|_| false)).is_err());
        assert!(rmse(&got, &Image::filled(1, 2, 0.5), &mask).is_err());
    }

    #[test]
    fn an_image_is_no_error_from_itself_and_flip_grows_with_what_is_seen() {
        let truth = Image::from_fn(64, 48, |x, y| 0.5 + 0.3 * (0.2 * (x + y) as f32).sin());
        let mask = truth.map(|_| true);
        let off = |by: f32| Errors::of(&truth.map(|a| a + by), &truth, &mask).unwrap();
        let none = off(0.0);
        assert_eq!([none.rmse, none.mae, none.bias, none.max], [0.0; 4]);
        let flips = [none, off(0.05), off(0.2)].map(|errors| errors.flip);
        if let [Some(none), Some(little), Some(much)] = flips {
            assert!(none < 1e-6 && none < little && little < much && much < 1.0, "{flips:?}");
        }
    }
}
