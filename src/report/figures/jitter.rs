//! The figure on jitter, and what it measures: how the error of too few samples is divided into bands and noise.

use super::picture::picture;
use crate::picture::{AO, AO_RAW};
use crate::report::figure::Figure;
use crate::report::lab::Lab;
use crate::report::subject::Subject;
use hbao::image::Image;
use hbao::reference;
use hbao::settings::{Jitter, Method};
use hbao::{Error, Settings};

/// The width and height of a block in pixels: those of the rotation tile.
const BLOCK: usize = 4;
/// The width and height of a window in blocks.
const WINDOW: usize = 8;
/// The largest number of windows. The converged method takes 64 samples per texel of R at each of their pixels.
const MOST_WINDOWS: usize = 12;
/// A window counts if its visibility is below this somewhere. Where nothing occludes there is no error to divide.
const OCCLUDED: f32 = 0.98;
/// The shortest step in texels. Bands are about as wide as a step, so with a shorter step they would be within a block.
const SHORTEST_STEP: f64 = 4.0;

/// The error of an image against the converged method, divided within windows. All parts are root mean squares of
/// visibility.
pub(in crate::report) struct Banding {
    /// How much the means of 4x4 pixels differ from a smooth surface, a polynomial of the second degree over the
    /// window. A blur of a few pixels leaves this part.
    pub(in crate::report) bands: f64,
    /// How much pixels differ from the mean of their 4x4 pixels.
    pub(in crate::report) noise: f64,
}

impl Banding {
    /// Divides an error over windows of `side` by `side` blocks, whose lower left corners are given.
    fn of(error: &Image<f64>, corners: &[(usize, usize)], side: usize) -> Banding {
        let (mut bands, mut noise) = (0.0, 0.0);
        for (left, bottom) in corners {
            let block = |i: usize| (left + BLOCK * (i % side), bottom + BLOCK * (i / side));
            let values = |i: usize| texels(block(i)).map(|(x, y)| error.at(x, y));
            let means: Vec<f64> = (0..side * side).map(|i| values(i).sum::<f64>() / BLOCK_TEXELS).collect();
            bands += BLOCK_TEXELS * squares_off_smooth(&means, side);
            noise += (0..side * side)
                .flat_map(|i| values(i).map(|e| (e - means[i]).powi(2)).collect::<Vec<_>>())
                .sum::<f64>();
        }
        let pixels = BLOCK_TEXELS * (side * side * corners.len()).max(1) as f64;
        Banding { bands: (bands / pixels).sqrt(), noise: (noise / pixels).sqrt() }
    }

    /// Returns both parts together.
    pub(in crate::report) fn both(&self) -> f64 {
        self.bands.hypot(self.noise)
    }
}

/// The number of texels of a block.
const BLOCK_TEXELS: f64 = (BLOCK * BLOCK) as f64;

/// Returns the texels of the block with this lower left corner.
fn texels((x, y): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    (0..BLOCK * BLOCK).map(move |i| (x + i % BLOCK, y + i / BLOCK))
}

/// Fits a polynomial of the second degree in x and y to `side` by `side` values by least squares, and returns the sum
/// of the squares of what is left.
fn squares_off_smooth(values: &[f64], side: usize) -> f64 {
    // The middle of the window is 0. The squares have their mean taken off, so that all terms are orthogonal.
    let at = |i: usize| i as f64 - (side as f64 - 1.0) / 2.0;
    let mean_square = (0..side).map(|i| at(i).powi(2)).sum::<f64>() / side as f64;
    let square = |v: f64| v * v - mean_square;
    let terms = |i: usize| {
        let (x, y) = (at(i % side), at(i / side));
        [1.0, x, y, x * y, square(x), square(y)]
    };
    let taken = (0..6).map(|term| {
        let along: f64 = values.iter().enumerate().map(|(i, value)| value * terms(i)[term]).sum();
        along.powi(2) / (0..side * side).map(|i| terms(i)[term].powi(2)).sum::<f64>()
    });
    (values.iter().map(|value| value * value).sum::<f64>() - taken.sum::<f64>()).max(0.0)
}

/// What jitter does to a scene. Each pair is without jitter, then with it.
pub(in crate::report) struct Jittered {
    pub(in crate::report) raw: [Banding; 2],
    /// After the blur.
    pub(in crate::report) blurred: [Banding; 2],
    /// How many windows were measured.
    pub(in crate::report) windows: usize,
}

/// Measures what jitter does to the error of the chapter's method with its default counts, in windows of smooth
/// surfaces that something occludes. Returns `None` if there is no such window.
pub(in crate::report) fn jittered(lab: &Lab, subject: &Subject) -> Result<Option<Jittered>, Error> {
    let base = subject.exact(Method::Hbao);
    let seen = lab.see(subject, lab.size, &base)?;
    let farthest = seen.texels_at_depth_1() * subject.radius / f64::from(base.steps + 1) / SHORTEST_STEP;
    let usable = |corner: (usize, usize)| {
        let depths = texels(corner).map(|(x, y)| f64::from(seen.depth.at(x, y)));
        let (near, far) = depths.fold((f64::INFINITY, 0.0f64), |(near, far), z| (near.min(z), far.max(z)));
        far <= farthest && far - near <= 0.02 * near
    };
    let side = BLOCK * WINDOW;
    let starts = |size: usize| (0..(size + 1).saturating_sub(side)).step_by(side);
    let corners = starts(seen.depth.height).flat_map(|y| starts(seen.depth.width).map(move |x| (x, y)));
    let unblurred = |jitter| lab.ao(subject, &Settings { jitter, blur: 0, ..base.clone() });
    let (off, on) = (unblurred(Jitter::None)?, unblurred(Jitter::Tile)?);
    let whole = |&(x, y): &(usize, usize)| {
        let mut blocks = (0..WINDOW * WINDOW).map(|i| (x + BLOCK * (i % WINDOW), y + BLOCK * (i / WINDOW)));
        let occluded = (0..side * side).any(|i| off.at(x + i % side, y + i / side) < OCCLUDED);
        occluded && blocks.all(usable)
    };
    let corners: Vec<_> = corners.filter(whole).collect();
    // The windows are chosen at equal distances in their list, which spreads them over the picture.
    let every = corners.len().div_ceil(MOST_WINDOWS).max(1);
    let corners: Vec<_> = corners.into_iter().step_by(every).collect();
    if corners.is_empty() {
        return Ok(None);
    }
    let (width, height) = (seen.depth.width, seen.depth.height);
    let pixels = corners.iter().flat_map(|(x, y)| (0..side * side).map(move |i| (y + i / side) * width + x + i % side));
    let pixels: Vec<usize> = pixels.collect();
    let converged = reference::converged(&seen.inputs(), &base, &pixels)?;
    // The 9x9 blur is linear in what it blurs. So the blurred error is the error of the blurred image against the
    // blurred converged one, but only where all taps are within the window.
    let inner: Vec<_> = corners.iter().map(|(x, y)| (x + BLOCK, y + BLOCK)).collect();
    let measure = |image: &Image<f32>| -> Result<[Banding; 2], Error> {
        let mut error = Image::filled(width, height, 0.0);
        pixels.iter().zip(&converged).for_each(|(&i, a)| error.texels[i] = f64::from(image.texels[i]) - a);
        let blurred = reference::blur::blur(&error, &seen.depth, &[], seen.projection, &base)?;
        Ok([Banding::of(&error, &corners, WINDOW), Banding::of(&blurred, &inner, WINDOW - 2)])
    };
    let ([off, off_blurred], [on, on_blurred]) = (measure(&off)?, measure(&on)?);
    Ok(Some(Jittered { raw: [off, on], blurred: [off_blurred, on_blurred], windows: corners.len() }))
}

pub(super) fn off_and_on(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.church();
    let mut pictures = Vec::new();
    for (show, shown, words) in [(&AO_RAW, "raw", "before the blur"), (&AO, "blurred", "after the blur of 9x9")] {
        for (jitter, name) in [(Jitter::None, "without jitter"), (Jitter::Tile, "with jitter")] {
            let settings = Settings { jitter, ..subject.settings(Method::Hbao) };
            let (file, caption) = (format!("jitter-{}-{shown}", jitter.name()), format!("{name}, {words}"));
            pictures.push(picture(lab, subject, lab.size, &settings, show, &file, &caption)?);
        }
    }
    Ok(Figure {
        id: "jitter".into(),
        title: "Noise for banding".into(),
        text: format!(
            "{}, 8 directions of 8 steps. Without jitter all pixels look in the same directions and at the same distances, and \
             occluders make bands where a sample crosses their outlines. A random angle and a random part of a step at each \
             pixel of a 4x4 tile turn the bands into noise, most of which the blur removes. The claim on jitter measures \
             both.",
            subject.name
        ),
        pictures,
        ..Figure::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_divided_into_what_blocks_share_and_what_pixels_have() {
        let of = |error: &dyn Fn(usize, usize) -> f64| Banding::of(&Image::from_fn(32, 32, error), &[(0, 0)], WINDOW);
        // An error that changes smoothly over the window is no band. Within a block its slope counts as noise.
        let smooth = of(&|x, y| {
            let (x, y) = ((x / 4) as f64, (y / 4) as f64);
            0.3 + 0.01 * x - 0.02 * y + 0.001 * (x * x - x * y)
        });
        assert!(smooth.bands < 1e-6 && smooth.noise < 1e-12, "{} {}", smooth.bands, smooth.noise);
        // Checks as wide as blocks are bands, stripes of one pixel are noise.
        let bands = of(&|x, y| if (x / 4 + y / 4) % 2 == 0 { 0.1 } else { -0.1 });
        assert!((bands.bands - 0.1).abs() < 2e-3 && bands.noise < 1e-12, "{} {}", bands.bands, bands.noise);
        let noise = of(&|x, _| if x % 2 == 0 { 0.1 } else { -0.1 });
        assert!((noise.noise - 0.1).abs() < 1e-12 && noise.bands < 1e-6, "{} {}", noise.bands, noise.noise);
        assert!((noise.both() - 0.1).abs() < 1e-6);
    }
}
