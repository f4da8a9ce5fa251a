//! The view, and the pixels of it, from which the diagrams take their numbers.

use crate::report::lab::{Lab, Seen};
use crate::report::subject::Subject;
use hbao::reference::anatomy::{Anatomy, Fate, SampleAnatomy, Slice};
use hbao::scene::CORNELL_BOX;
use hbao::settings::{Method, Radius};
use hbao::{Error, Settings};

/// The size of the view, which does not depend on the report's.
pub(super) const SIZE: (u32, u32) = (960, 960);
/// R in the units of the Cornell box. It is less than the box's default, so that R about a pixel of the front faces of
/// its blocks lies inside of the picture. Steps are about 13 texels long.
pub(super) const RADIUS: f64 = 100.0;

/// Returns the scene of the diagrams: the Cornell box, which is built in.
pub(super) fn scene<'a>(lab: &'a Lab) -> &'a Subject {
    lab.first_of(&[CORNELL_BOX])
}

/// A view as one method reads it.
pub(super) struct View {
    seen: Seen,
    pub(super) settings: Settings,
}

impl View {
    /// Renders the scene of the diagrams for the method's defaults, without 8-bit targets.
    pub(super) fn new(lab: &Lab, method: Method, change: impl FnOnce(&mut Settings)) -> Result<View, Error> {
        let mut settings = Settings { radius: Radius::Units(RADIUS), ..scene(lab).exact(method) };
        change(&mut settings);
        Ok(View { seen: lab.see(scene(lab), SIZE, &settings)?, settings })
    }

    pub(super) fn anatomy(&self) -> Result<Anatomy<'_>, Error> {
        Anatomy::new(&self.seen.inputs(), &self.settings)
    }
}

/// A pixel, and one of its directions.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) pixel: (usize, usize),
    pub(super) k: u32,
}

/// The largest n.z of a surface that is shown: steeper ones are seen too much from the side.
const STEEP: f64 = -0.6;

/// Finds the place with the highest score among the pixels about which R lies inside of the picture, and all
/// directions. A score of `None` excludes a place.
fn best(anatomy: &Anatomy, directions: u32, score: impl Fn(&Slice, &Slice) -> Option<f64>) -> Option<Place> {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    let mut best: Option<(f64, Place)> = None;
    for y in (0..height).step_by(4) {
        for x in (0..width).step_by(4) {
            let pixel = (x, y);
            let Some(start) = anatomy.start(pixel) else { continue };
            let reach = start.radius_px.max_element();
            let room = [x, y, width - x, height - y].into_iter().min().unwrap_or(0) as f64;
            if start.exits_early || start.normal.z > STEEP || reach > room {
                continue;
            }
            let slices: Option<Vec<Slice>> = (0..directions).map(|k| anatomy.slice(pixel, k)).collect();
            let Some(slices) = slices else { continue };
            for k in 0..directions {
                let opposite = (k + directions / 2) % directions;
                let found = score(&slices[k as usize], &slices[opposite as usize]);
                if let Some(found) = found.filter(|&found| best.as_ref().is_none_or(|(score, _)| found > *score)) {
                    best = Some((found, Place { pixel, k }));
                }
            }
        }
    }
    best.map(|(_, place)| place)
}

/// Finds the place at which the most samples raise the horizon, and among equal ones the one with the largest
/// occlusion. The first and the third sample raise it by at least 5 degrees each, to more than 45 degrees in the end,
/// the tangent is tilted by 5 to 50 degrees, and the surface goes on straight in the opposite direction.
pub(super) fn rising(anatomy: &Anatomy, directions: u32) -> Option<Place> {
    best(anatomy, directions, |slice, opposite| {
        let raise = |i: usize| {
            let found = slice.samples.get(i).filter(|sample| sample.fate == Fate::Raises).and_then(|s| s.found);
            found.map_or(0.0, |found| (found.sin_phi.asin() - found.sin_before.asin()).to_degrees())
        };
        let tilted = (5.0..50.0).contains(&slice.sin_t.asin().to_degrees().abs());
        let seen = slice.samples.iter().chain(&opposite.samples).all(|sample| sample.found.is_some());
        let rise =
            |sample: &SampleAnatomy| sample.found.is_some_and(|found| (found.sin_phi - found.sin_t).abs() > 0.02);
        let straight = !opposite.samples.iter().any(rise);
        let raising = slice.samples.iter().filter(|sample| sample.fate == Fate::Raises).count();
        // The occlusion of a direction is at most 2.
        let score = 2.0 * raising as f64 + slice.occlusion;
        (raise(0) > 5.0 && raise(2) > 5.0 && slice.sin_h() > 0.7 && tilted && seen && straight).then_some(score)
    })
}

/// Finds the place at which a sample beyond R stands highest above the horizon that the samples within R make. The
/// sample lies at most 2 R from P.
pub(super) fn with_outlier(anatomy: &Anatomy, directions: u32) -> Option<Place> {
    best(anatomy, directions, |slice, _| {
        let beyond = slice.samples.iter().filter(|sample| sample.fate == Fate::BeyondRadius);
        let found = beyond.filter_map(|sample| sample.found).filter(|found| found.D.length() < 2.0 * RADIUS);
        let above = found.map(|found| found.sin_phi - slice.sin_h()).filter(|&above| above > 0.1);
        above.reduce(f64::max)
    })
}
