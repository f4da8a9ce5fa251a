//! What attenuation does to the boundary at which an occluder begins to count (ShaderX7 6.2, Figure 6.2.3), measured.

use crate::report::drawing::{self, Axes};
use crate::report::figure::Drawing;
use crate::report::lab::Lab;
use crate::report::scenes::{self, LEDGE_RADIUS};
use crate::report::subject::Subject;
use hbao::settings::{Attenuation, Jitter, Method, Snap};
use hbao::{Error, Request, Settings};

/// The size of the picture of the ledge. R covers 60 of its texels.
const SIZE: (u32, u32) = (320, 240);

/// Sixteen directions of 16 steps without jitter and blur. Each sample is rounded by itself, because steps that are
/// rounded once make boundaries of their own.
fn settings(subject: &Subject, attenuation: Attenuation) -> Settings {
    let exact = subject.exact(Method::Hbao);
    Settings { attenuation, directions: 16, steps: 16, snap: Snap::Sample, jitter: Jitter::None, blur: 0, ..exact }
}

/// Returns visibility on the floor before a ledge, by the distance from the ledge in units of R, nearest first.
pub(in crate::report) fn before_ledge(lab: &Lab, attenuation: Attenuation) -> Result<Vec<(f64, f64)>, Error> {
    let ledge = scenes::ledge()?;
    let (pipeline, _) = lab.render(&ledge, SIZE, &settings(&ledge, attenuation), Request::default())?;
    let image = pipeline.ao()?;
    let camera = ledge.camera(SIZE)?;
    let (middle, row) = (image.width / 2, image.height / 2);
    let [half_width, _] = camera.projection.half_extents();
    let unit = 2.0 * half_width / image.width as f64 / LEDGE_RADIUS;
    // The ledge is at the boundary of two columns. The floor is to the left of it.
    let points = (0..middle).map(|i| ((i as f64 + 0.5) * unit, f64::from(image.at(middle - 1 - i, row))));
    Ok(points.take_while(|(distance, _)| *distance <= 1.2).collect())
}

/// Returns the largest step of visibility from a pixel to the next past a fifth of R: nearer to the ledge, the slope is
/// that of the occlusion itself.
pub(in crate::report) fn largest_step(profile: &[(f64, f64)]) -> f64 {
    let far = profile.windows(2).filter(|two| two[0].0 > 0.2);
    far.map(|two| (two[1].1 - two[0].1).abs()).fold(0.0, f64::max)
}

/// Returns the step of visibility between neighbours that all but one of 1000 pairs stay below. The pairs are those on
/// one smooth surface, with depths within 1 % and normals within 8 degrees, where no step is shorter than a texel.
/// `None` if there are fewer than 1000.
pub(in crate::report) fn steep_steps(
    lab: &Lab,
    subject: &Subject,
    attenuation: Attenuation,
) -> Result<Option<f64>, Error> {
    let settings = settings(subject, attenuation);
    let seen = lab.see(subject, lab.size, &settings)?;
    let image = lab.ao(subject, &settings)?;
    let farthest = seen.texels_at_depth_1() * subject.radius / f64::from(settings.steps + 1);
    let unit = |x: usize, y: usize| glam::Vec3::from(seen.normals.at(x, y)).normalize_or_zero();
    let mut steps = Vec::new();
    for y in 0..image.height {
        for x in 1..image.width {
            let (a, b) = (seen.depth.at(x - 1, y), seen.depth.at(x, y));
            let samples_both = f64::from(a.max(b)) <= farthest;
            let smooth = samples_both && (a - b).abs() <= 0.01 * a.min(b);
            if smooth && unit(x - 1, y).dot(unit(x, y)) > 0.99 {
                steps.push(f64::from((image.at(x, y) - image.at(x - 1, y)).abs()));
            }
        }
    }
    if steps.len() < 1000 {
        return Ok(None);
    }
    steps.sort_by(f64::total_cmp);
    Ok(Some(steps[(0.999 * steps.len() as f64) as usize]))
}

/// Draws visibility before a ledge with each attenuation.
pub(super) fn profile(lab: &Lab) -> Result<Drawing, Error> {
    let mut series = Vec::new();
    for (attenuation, name) in [
        (Attenuation::None, "W = 1"),
        (Attenuation::Linear, "W = 1 - r/R"),
        (Attenuation::Quadratic, "W = 1 - (r/R)\u{b2}"),
    ] {
        let points = before_ledge(lab, attenuation)?.into_iter().step_by(2).map(|(distance, a)| (distance, 1.0 - a));
        series.push((name.to_string(), points.collect()));
    }
    let axes = Axes { x: "distance from the ledge over R", y: "occlusion 1 - A of the floor", logarithmic: false };
    Ok(Drawing {
        file: "6.2.3-ledge.svg".into(),
        caption:
            "A floor before a ledge that is R/2 high, seen from above: 16 directions of 16 steps, no jitter, no blur. \
                  With W = 1 occlusion begins in steps, as the ledge comes within R along one direction after another"
                .into(),
        svg: drawing::lines(&series, &axes)?,
    })
}
