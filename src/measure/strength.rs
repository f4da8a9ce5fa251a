//! Finds the strength with which an image of ambient occlusion would be nearest to the truth. A method with one number
//! fitted is compared fairly only with other methods that have it fitted too.

use crate::Error;
use crate::image::Image;

/// The least and the largest factor of the occlusion that is tried.
const FACTORS: [f64; 2] = [1.0 / 16.0, 16.0];
/// The number of factors between them that are tried first, evenly spaced in their logarithm. Around the best of them,
/// where the error has one minimum, the factor is then found by golden section.
const COARSE: usize = 33;
/// The number of golden sections, which leave 1/1500 of an interval between two of the first factors.
const SECTIONS: usize = 16;

/// A strength, and the error that is left with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BestStrength {
    /// The strength, in the unit of [`Settings::strength`](crate::Settings::strength).
    pub strength: f64,
    /// The RMSE from the truth that the image has with this strength.
    pub rmse: f64,
}

impl BestStrength {
    /// Finds the strength for an image that was made with `strength`. With s times as much, A becomes A' = clamp(1 - s
    /// (1 - A), 0, 1). s is chosen such that A' has the least RMSE from the truth at the pixels where `mask` is true.
    /// It is applied to the image after its blur, if it has one: both are linear, but for where A is clamped.
    ///
    /// # Errors
    /// [`Error::Usage`] if the images have different sizes, or if the mask is true at no pixel.
    pub fn of(
        image: &Image<f32>,
        truth: &Image<f32>,
        mask: &Image<bool>,
        strength: f64,
    ) -> Result<BestStrength, Error> {
        super::errors::same_size((image.width, image.height), (truth.width, truth.height))?;
        super::errors::same_size((image.width, image.height), (mask.width, mask.height))?;
        let pixels = image.texels.iter().zip(&truth.texels).zip(&mask.texels).filter(|(_, covered)| **covered);
        let pixels: Vec<(f32, f32)> = pixels.map(|((&a, &t), _)| (1.0 - a, t)).collect();
        if pixels.is_empty() {
            return Err(super::errors::Errors::of_nothing());
        }
        let rmse = |log: f64| {
            let s = log.exp() as f32;
            let square = |&(occlusion, t): &(f32, f32)| f64::from((1.0 - s * occlusion).clamp(0.0, 1.0) - t).powi(2);
            (pixels.iter().map(square).sum::<f64>() / pixels.len() as f64).sqrt()
        };
        let [least, most] = FACTORS.map(f64::ln);
        let step = (most - least) / (COARSE - 1) as f64;
        let coarse = (0..COARSE).map(|i| least + step * i as f64);
        let best = coarse.map(|log| (log, rmse(log))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(log, _)| log);
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let (mut low, mut high) = ((best - step).max(least), (best + step).min(most));
        let inner = |low: f64, high: f64| [high - golden * (high - low), low + golden * (high - low)];
        let [mut a, mut b] = inner(low, high);
        let [mut at_a, mut at_b] = [rmse(a), rmse(b)];
        for _ in 0..SECTIONS {
            if at_a <= at_b {
                (high, b, at_b) = (b, a, at_a);
                [a, _] = inner(low, high);
                at_a = rmse(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                [_, b] = inner(low, high);
                at_b = rmse(b);
            }
        }
        let log = (low + high) / 2.0;
        Ok(BestStrength { strength: strength * log.exp(), rmse: rmse(log) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Image<f32> {
        Image::from_fn(32, 16, |x, y| 0.4 + 0.6 * ((x * 7 + y * 3) % 32) as f32 / 31.0)
    }

    #[test]
    fn an_image_of_the_wrong_strength_becomes_the_truth_with_the_right_one() {
        let truth = truth();
        let all = truth.map(|_| true);
        for factor in [0.3, 0.8, 1.0, 1.24, 1.6f32] {
            let image = truth.map(|t| 1.0 - (1.0 - t) / factor);
            let best = BestStrength::of(&image, &truth, &all, 2.0).unwrap();
            assert!((best.strength / f64::from(2.0 * factor) - 1.0).abs() < 1e-3, "{factor}: {best:?}");
            assert!(best.rmse < 1e-3, "{factor}: {best:?}");
        }
    }

    #[test]
    fn no_strength_nearby_has_a_smaller_error_and_pixels_outside_the_mask_do_not_matter() {
        let truth = truth();
        let image = Image::from_fn(32, 16, |x, y| if x < 4 { 0.0 } else { (0.9 * truth.at(x, y) + 0.1).powi(2) });
        let mask = Image::from_fn(32, 16, |x, _| x >= 4);
        let best = BestStrength::of(&image, &truth, &mask, 1.0).unwrap();
        for s in [0.5, 0.9, 0.99, 1.01, 1.1, 2.0].map(|factor| factor * best.strength) {
            let stronger = image.map(|a| (1.0 - s as f32 * (1.0 - a)).clamp(0.0, 1.0));
            let errors = super::super::errors::Errors::of(&stronger, &truth, &mask).unwrap();
            assert!(errors.rmse >= best.rmse - 1e-6, "{s}: {} below {best:?}", errors.rmse);
        }
        assert!(BestStrength::of(&image, &truth, &mask.map(|_| false), 1.0).is_err());
        assert!(BestStrength::of(&image, &Image::filled(1, 1, 1.0), &mask, 1.0).is_err());
    }
}
