//! Measures how far ambient occlusion is from the truth. Only covered pixels are compared, since background is 1 in
//! both images.

use crate::Error;
use crate::image::Image;

/// The errors of one image relative to another, in units of visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The mean absolute difference.
    pub mae: f64,
    /// The mean difference. It is above 0 if the image is too light.
    pub bias: f64,
    /// The largest absolute difference.
    pub max: f64,
    /// The error measure FLIP (Andersson et al. 2020), averaged over the same pixels. It compares the images as 8-bit
    /// grey pictures, seen at 67 pixels per degree. 0 means that nobody sees a difference, and 1 is the largest value.
    /// `None` if the crate was built without FLIP.
    pub flip: Option<f64>,
    /// How many pixels were compared.
    pub pixels: usize,
}

/// Whether a truth is too noisy for an error that was measured against it: its noise may be at most a fifth of the
/// error. Both are RMS.
#[must_use]
pub fn too_noisy(noise: f64, error: f64) -> bool {
    noise > error / 5.0
}

impl Errors {
    /// Compares `got` with `truth` at the pixels where `mask` is true.
    ///
    /// # Errors
    /// [`Error::Usage`] if the images have different sizes, or if the mask is true at no pixel.
    pub fn of(got: &Image<f32>, truth: &Image<f32>, mask: &Image<bool>) -> Result<Errors, Error> {
        let errors = Comparison::new(got, truth)?.over(mask)?;
        errors.ok_or_else(Errors::of_nothing)
    }

    /// Returns the error for a mask that is true at no pixel.
    pub fn of_nothing() -> Error {
        Error::Usage("no pixel holds a surface: there is nothing to compare".into())
    }
}

/// Two images that can be compared over several sets of pixels. FLIP at a pixel depends on the pixels around it, so its
/// map is computed once, from the whole images.
pub struct Comparison {
    size: (usize, usize),
    differences: Vec<f64>,
    flip: Option<Vec<f32>>,
}

impl Comparison {
    /// Compares `got` with `truth`. The differences are `got` minus `truth`.
    ///
    /// # Errors
    /// [`Error::Usage`] if the images have different sizes.
    pub fn new(got: &Image<f32>, truth: &Image<f32>) -> Result<Comparison, Error> {
        // The sizes are checked first, because FLIP panics on images of different sizes.
        let without = Comparison::without_flip(got, truth)?;
        Ok(Comparison { flip: flip(got, truth), ..without })
    }

    /// Does the same as [`Comparison::new`], but without FLIP. FLIP takes the longest, and it means nothing if the
    /// truth around a pixel is unknown.
    ///
    /// # Errors
    /// [`Error::Usage`] if the images have different sizes.
    pub fn without_flip(got: &Image<f32>, truth: &Image<f32>) -> Result<Comparison, Error> {
        let size = (got.width, got.height);
        same_size(size, (truth.width, truth.height))?;
        let differences = got.texels.iter().zip(&truth.texels).map(|(&a, &b)| f64::from(a) - f64::from(b)).collect();
        Ok(Comparison { size, differences, flip: None })
    }

    /// Returns the errors over the pixels where `mask` is true, or `None` if it is true at no pixel.
    ///
    /// # Errors
    /// [`Error::Usage`] if the mask has another size than the images.
    pub fn over(&self, mask: &Image<bool>) -> Result<Option<Errors>, Error> {
        same_size(self.size, (mask.width, mask.height))?;
        let compared: Vec<usize> = (0..mask.texels.len()).filter(|&i| mask.texels[i]).collect();
        let mean = |f: &dyn Fn(usize) -> f64| compared.iter().map(|&i| f(i)).sum::<f64>() / compared.len() as f64;
        let difference = |i: usize| self.differences[i];
        Ok((!compared.is_empty()).then(|| Errors {
            rmse: mean(&|i| difference(i).powi(2)).sqrt(),
            mae: mean(&|i| difference(i).abs()),
            bias: mean(&difference),
            max: compared.iter().map(|&i| difference(i).abs()).fold(0.0, f64::max),
            flip: self.flip.as_ref().map(|map| mean(&|i| f64::from(map[i]))),
            pixels: compared.len(),
        }))
    }
}

/// Checks that two images, given by their sizes, can be compared.
pub(super) fn same_size(a: (usize, usize), b: (usize, usize)) -> Result<(), Error> {
    if a == b {
        Ok(())
    } else {
        Err(Error::Usage(format!("images of different sizes cannot be compared: {a:?}, {b:?}")))
    }
}

/// Computes FLIP at each pixel.
#[cfg(feature = "flip")]
fn flip(got: &Image<f32>, truth: &Image<f32>) -> Option<Vec<f32>> {
    let grey = |image: &Image<f32>| -> Vec<u8> {
        image.texels.iter().flat_map(|a| [(a.clamp(0.0, 1.0) * 255.0).round() as u8; 3]).collect()
    };
    flip_of_colours((got.width, got.height), &grey(got), &grey(truth))
}

/// Computes FLIP at each pixel of two pictures of this size, which are given as the red, green and blue of each pixel.
#[cfg(feature = "flip")]
pub(super) fn flip_of_colours(size: (usize, usize), got: &[u8], truth: &[u8]) -> Option<Vec<f32>> {
    let image = |bytes: &[u8]| nv_flip::FlipImageRgb8::with_data(size.0 as u32, size.1 as u32, bytes);
    Some(nv_flip::flip(image(truth), image(got), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec())
}

#[cfg(not(feature = "flip"))]
fn flip(_: &Image<f32>, _: &Image<f32>) -> Option<Vec<f32>> {
    None
}

#[cfg(not(feature = "flip"))]
pub(super) fn flip_of_colours(_: (usize, usize), _: &[u8], _: &[u8]) -> Option<Vec<f32>> {
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
        assert_eq!(errors.pixels, 3);
        assert!(Errors::of(&got, &truth, &mask.map(|_| false)).is_err());
        assert!(Errors::of(&got, &Image::filled(1, 2, 0.5), &mask).is_err());
    }

    #[test]
    fn one_comparison_tells_sets_of_pixels_apart() {
        let truth = Image::filled(8, 4, 0.5f32);
        let got = Image::from_fn(8, 4, |x, _| if x < 2 { 0.9 } else { 0.5 });
        let comparison = Comparison::new(&got, &truth).unwrap();
        let left = Image::from_fn(8, 4, |x, _| x < 2);
        let errors = [&left, &left.map(|in_left| !in_left)].map(|mask| comparison.over(mask).unwrap().unwrap());
        assert!((errors[0].rmse - 0.4).abs() < 1e-6 && errors[1].rmse == 0.0);
        assert_eq!(errors.map(|errors| errors.pixels), [8, 24]);
        assert_eq!(errors[0], Errors::of(&got, &truth, &left).unwrap());
        assert!(comparison.over(&truth.map(|_| false)).unwrap().is_none());
        assert!(comparison.over(&Image::filled(2, 16, true)).is_err());
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
