//! The claims of both chapters on parts of the methods: jitter, attenuation, the depth range check, the blur that
//! preserves edges, and the depths at the border.

use super::test::Test;
use crate::report::claim::{Claim, Found, Verdict, at_least, at_most, percent, steps};
use crate::report::figures::{Banding, before_ledge, border, halo, jittered, largest_step, mixing, steep_steps};
use crate::report::lab::Lab;
use crate::report::measures::Measures;
use crate::report::scenes::{self, BOARDS};
use hbao::Error;
use hbao::settings::Attenuation;
use std::f64::consts::FRAC_PI_4;

pub(super) const ALL: &[Test] =
    &[range_check, edge_preserving_blur, depths_at_the_border, attenuation_softens, jitter_for_banding];

/// A change of A by more than this counts as visible.
const VISIBLE: f64 = 0.05;

fn range_check(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.1, 0.5);
    let mut found = Vec::new();
    for (nearness, words) in BOARDS {
        let halo = halo(lab, nearness)?;
        if halo.pixels == 0 {
            continue;
        }
        let [without, with] = halo.change;
        let text = format!(
            "the wall's visibility changes by {without:.4} on average at {} pixels around the board without the check, by \
             {with:.4} with it",
            halo.pixels
        );
        found.push(bound.found(format!("board {words}"), with / without, text));
    }
    Ok(Claim {
        id: "range-check",
        says: "Near objects falsely occlude what is far behind them; a depth range check fades this out.",
        source: "6.1, Depth range check",
        found,
        rule: bound.rule("what is left of the change of a wall behind a board", percent),
        note: "By the float64 twin, with and without the check, after the 4x4 blur. The listing fades a sample wholly once its \
               surface is at half of P's depth or nearer, and in part before: nearer to P occlusion may be true."
            .into(),
        unmeasured: Some("the board changes no pixel at this size: give a larger --size".into()),
    })
}

fn edge_preserving_blur(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.75, 0.95);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let mixing = mixing(lab, subject)?;
        if mixing.pixels < 100 {
            continue;
        }
        let ([raw, simple, own], [noisy, quiet]) = (mixing.beside, mixing.inside);
        let text = format!(
            "RMS off the mean of all turns at {} pixels beside silhouettes: {raw:.4} unblurred, {simple:.4} with a blur that \
             ignores depth, {own:.4} with the method's; on single surfaces {noisy:.4} unblurred, {quiet:.4} with it",
            mixing.pixels
        );
        found.push(bound.found(&subject.name, own / simple, text));
    }
    Ok(Claim {
        id: "edge-preserving-blur",
        says: "A simple blur leaks between dark and bright areas at silhouettes; one that mixes only pixels of similar depth \
               does not.",
        source: "6.1, Edge-preserving blur",
        found,
        rule: bound.rule("the error beside silhouettes over that of the blur that ignores depth", percent),
        note: "A pixel's mean over all 16 turns of the kernel has no noise and no leak. What the blur leaves on single surfaces \
               is mostly not noise: over 4x4 pixels visibility itself changes. By the float64 twin at half the report's \
               width and height."
            .into(),
        unmeasured: Some("no view has 100 pixels beside silhouettes at this size: give a larger --size".into()),
    })
}

fn depths_at_the_border(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_least(0.5, 0.4);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let Some(border) = border(lab, subject)? else { continue };
        let off = |image: &hbao::image::Image<f64>, i: usize| (image.texels[i] - border.known.texels[i]).abs();
        let problems: Vec<usize> = (0..border.known.texels.len())
            .filter(|&i| border.covered.texels[i] && off(&border.missing, i) > VISIBLE)
            .collect();
        if problems.len() < 20 {
            continue;
        }
        let solved = problems.iter().filter(|&&i| off(&border.clamped, i) <= VISIBLE).count();
        let rms = |image| (problems.iter().map(|&i| off(image, i).powi(2)).sum::<f64>() / problems.len() as f64).sqrt();
        let share = solved as f64 / problems.len() as f64;
        let text = format!(
            "of {} pixels that would be off by more than {VISIBLE} with nothing beyond the border, {} are within it; RMS there \
             {:.3}, with nothing {:.3}",
            problems.len(),
            percent(share),
            rms(&border.clamped),
            rms(&border.missing)
        );
        found.push(bound.found(&subject.name, share, text));
    }
    Ok(Claim {
        id: "ssao-border",
        says: "Since depths beyond the border are like those at it, at least half of the cases in which Crysis' own method \
               lacks occluders outside the picture are solved.",
        source: "6.1, Overview of the approach",
        found,
        rule: bound.rule(
            &format!("the share of the pixels that missing occluders move by more than {VISIBLE} that is within it all the same"),
            percent,
        ),
        note: "ssao with its blur, against what it finds where a wider picture gives the depths beyond the border; by the \
               float64 twin. The claim on depths behind the screen's edges is about the depths themselves, and about hbao."
            .into(),
        unmeasured: Some("no scene has 20 such pixels, or the driver has no wider image: give a larger --size".into()),
    })
}

fn attenuation_softens(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.5, 0.8);
    let mut found = Vec::new();
    let step = |attenuation| Ok::<_, Error>(largest_step(&before_ledge(lab, attenuation)?));
    let [none, quadratic, linear] = [Attenuation::None, Attenuation::Quadratic, Attenuation::Linear].map(step);
    let (none, quadratic, linear) = (none?, quadratic?, linear?);
    let text = format!(
        "the largest step of A from pixel to pixel where a ledge comes within R is {none:.4} with W = 1, {quadratic:.4} with \
         the quadratic W, {linear:.4} with the linear"
    );
    found.push(bound.found("floor before a ledge", quadratic / none, text));
    for subject in lab.data_sets() {
        let steep = |attenuation| steep_steps(lab, subject, attenuation);
        let (Some(none), Some(quadratic)) = (steep(Attenuation::None)?, steep(Attenuation::Quadratic)?) else {
            continue;
        };
        if none < 1.0 / 255.0 {
            continue;
        }
        let text = format!(
            "on smooth surfaces one step in 1000 from pixel to pixel is over {} with W = 1, over {} with the quadratic W",
            steps(none),
            steps(quadratic)
        );
        found.push(bound.found(&subject.name, quadratic / none, text));
    }
    Ok(Claim {
        id: "attenuation-softens",
        says: "Attenuation softens the sharp boundaries that occluders at the distance R make once they begin to be sampled.",
        source: "6.2, Ambient occlusion; Figure 6.2.3",
        found,
        rule: bound.rule("the step of A with the quadratic W over that with W = 1", percent),
        note: "16 directions of 16 steps without jitter and blur. Smooth: depths within 1 %, normals within 8 degrees."
            .into(),
        ..Claim::default()
    })
}

fn jitter_for_banding(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.6, 0.8);
    let mut found: Vec<Found> = Vec::new();
    let corner = scenes::fold("corner", "corner of a room", -FRAC_PI_4, lab.size)?;
    for subject in lab.data_sets().into_iter().chain([&corner]) {
        let Some(jittered) = jittered(lab, subject)? else { continue };
        let [off, on] = &jittered.raw;
        if off.bands < 0.1 / 255.0 {
            continue;
        }
        let [off_blurred, on_blurred] = &jittered.blurred;
        let words = |one: &Banding| format!("{} of bands and {} of noise", steps(one.bands), steps(one.noise));
        let text = format!(
            "{} without jitter, {} with it; after the blur both together are {} without, {} with it ({} windows)",
            words(off),
            words(on),
            steps(off_blurred.both()),
            steps(on_blurred.both()),
            jittered.windows
        );
        let mut one = bound.found(&subject.name, on.bands / off.bands, text);
        let noisier = on.noise > off.noise && on_blurred.both() <= off_blurred.both();
        if one.verdict == Verdict::Holds && !noisier {
            one.verdict = Verdict::InPart;
        }
        found.push(one);
    }
    Ok(Claim {
        id: "jitter",
        says: "Turning the directions by a random angle at each pixel, and jittering the samples along them, avoids banding; \
               it makes noise instead, which the blur reduces.",
        source: "6.2, Directions and jittering; Cross-bilateral filter",
        found,
        rule: bound.rule("what is left of the bands", percent)
            + "; in part also where noise does not grow, or the error after the blur does",
        note: "The error against the converged method in windows of 32x32 pixels on smooth surfaces that something occludes, where \
               steps are over 4 texels. Bands are what the means of 4x4 pixels are off a polynomial of the second degree by, \
               which takes most of what the bias of few steps adds; noise is what pixels are off these means by. Jitter also \
               moves each sample outwards by half a step on average, which changes the error of few steps too. 8 directions of 8 steps."
            .into(),
        unmeasured: Some("no view has smooth windows of 32x32 pixels with steps over 4 texels: give a larger --size".into()),
    })
}
