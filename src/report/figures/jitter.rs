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
const MOST_WINDOWS: usize = 16;

/// The error of an image against the converged method, divided within windows of 32x32 pixels. All parts are root mean
/// squares of visibility.
pub(in crate::report) struct Banding {
    /// How much the means of 4x4 pixels differ from the mean of their window. A blur of a few pixels leaves this part.
    pub(in crate::report) bands: f64,
    /// How much pixels differ from the mean of their 4x4 pixels.
    pub(in crate::report) noise: f64,
    /// Both parts together.
    pub(in crate::report) both: f64,
}

impl Banding {
    /// Divides an error. `blocks` holds, for each window, the lower left corners of its blocks. The error is known at
    /// their pixels.
    fn of(error: &Image<f64>, windows: &[Vec<(usize, usize)>]) -> Banding {
        let (mut bands, mut noise, mut pixels) = (0.0, 0.0, 0usize);
        for blocks in windows {
            let texels = |&(x, y): &(usize, usize)| (0..BLOCK * BLOCK).map(move |i| (x + i % BLOCK, y + i / BLOCK));
            let values = |block| texels(block).map(|(x, y)| error.at(x, y));
            let means: Vec<f64> = blocks.iter().map(|b| values(b).sum::<f64>() / (BLOCK * BLOCK) as f64).collect();
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            for (block, own) in blocks.iter().zip(&means) {
                bands += (BLOCK * BLOCK) as f64 * (own - mean).powi(2);
                noise += values(block).map(|e| (e - own).powi(2)).sum::<f64>();
                pixels += BLOCK * BLOCK;
            }
        }
        let rms = |squares: f64| (squares / pixels.max(1) as f64).sqrt();
        Banding { bands: rms(bands), noise: rms(noise), both: rms(bands + noise) }
    }
}

/// What jitter does to a scene: each is without jitter, then with it.
pub(in crate::report) struct Jittered {
    pub(in crate::report) raw: [Banding; 2],
    /// After the blur.
    pub(in crate::report) blurred: [Banding; 2],
    /// How many windows were measured.
    pub(in crate::report) windows: usize,
}

/// Measures what jitter does to the error of the chapter's method with its default counts. Only blocks of smooth
/// surfaces count, on which no step is shorter than a texel. Returns `None` if no window has enough of them.
pub(in crate::report) fn jittered(lab: &Lab, subject: &Subject) -> Result<Option<Jittered>, Error> {
    let settings = |jitter, blur| Settings { jitter, blur, ..subject.exact(Method::Hbao) };
    let base = settings(Jitter::Tile, 9);
    let seen = lab.see(subject, lab.size, &base)?;
    let farthest = seen.texels_at_depth_1() * subject.radius / f64::from(base.steps + 1);
    let usable = |x: usize, y: usize| {
        let depths = (0..BLOCK * BLOCK).map(|i| f64::from(seen.depth.at(x + i % BLOCK, y + i / BLOCK)));
        let (near, far) = depths.fold((f64::INFINITY, 0.0f64), |(near, far), z| (near.min(z), far.max(z)));
        far <= farthest && far - near <= 0.02 * near
    };
    let side = BLOCK * WINDOW;
    let starts = |size: usize| (0..(size + 1).saturating_sub(side)).step_by(side);
    let mut windows = Vec::new();
    for bottom in starts(seen.depth.height) {
        for left in starts(seen.depth.width) {
            let blocks = (0..WINDOW * WINDOW).map(|i| (left + BLOCK * (i % WINDOW), bottom + BLOCK * (i / WINDOW)));
            let blocks: Vec<_> = blocks.filter(|&(x, y)| usable(x, y)).collect();
            if blocks.len() >= WINDOW * WINDOW / 2 {
                windows.push(blocks);
            }
        }
    }
    // The windows are chosen at equal distances in their list, which spreads them over the picture.
    let every = windows.len().div_ceil(MOST_WINDOWS).max(1);
    let windows: Vec<_> = windows.into_iter().step_by(every).collect();
    if windows.is_empty() {
        return Ok(None);
    }
    let width = seen.depth.width;
    let texels = |&(x, y): &(usize, usize)| (0..BLOCK * BLOCK).map(move |i| (y + i / BLOCK) * width + x + i % BLOCK);
    let pixels: Vec<usize> = windows.iter().flatten().flat_map(texels).collect();
    let converged = reference::converged(&seen.inputs(), &base, &pixels)?;
    let measure = |jitter, blur| -> Result<Banding, Error> {
        let image = lab.ao(subject, &settings(jitter, blur))?;
        let mut error = image.map(|_| 0.0);
        pixels.iter().zip(&converged).for_each(|(&i, a)| error.texels[i] = f64::from(image.texels[i]) - a);
        Ok(Banding::of(&error, &windows))
    };
    let both = |blur| Ok::<_, Error>([measure(Jitter::None, blur)?, measure(Jitter::Tile, blur)?]);
    Ok(Some(Jittered { raw: both(0)?, blurred: both(base.blur)?, windows: windows.len() }))
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
        let windows = [(0..64).map(|i| (4 * (i % 8), 4 * (i / 8))).collect::<Vec<_>>()];
        let of = |error: &dyn Fn(usize, usize) -> f64| Banding::of(&Image::from_fn(32, 32, error), &windows);
        // An error that is the same everywhere is neither.
        let same = of(&|_, _| 0.3);
        assert!(same.bands < 1e-12 && same.noise < 1e-12);
        // Stripes as wide as blocks are bands, stripes of one pixel are noise.
        let bands = of(&|x, _| if x / 4 % 2 == 0 { 0.1 } else { -0.1 });
        assert!((bands.bands - 0.1).abs() < 1e-12 && bands.noise < 1e-12, "{} {}", bands.bands, bands.noise);
        let noise = of(&|x, _| if x % 2 == 0 { 0.1 } else { -0.1 });
        assert!((noise.noise - 0.1).abs() < 1e-12 && noise.bands < 1e-12, "{} {}", noise.bands, noise.noise);
        assert!((noise.both - 0.1).abs() < 1e-12);
    }
}
