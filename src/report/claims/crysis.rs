//! The claims of ShaderX7 6.1.

use super::jitter_noise::noise;
use super::test::Test;
use crate::report::claim::{Claim, at_least, at_most, decimal, percent, steps};
use crate::report::figures::{hidden_points, open_share};
use crate::report::lab::{Lab, compare};
use crate::report::measures::Measures;
use crate::report::scenes;
use hbao::image::Image;
use hbao::settings::Method;
use hbao::{Error, Pipeline, Request, Settings, size_limit};

pub(super) const ALL: &[Test] = &[edges_brighten, pattern_vanishes, hidden_points_are_open, beyond_the_border];

fn edges_brighten(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.02, 0.05);
    let mut found = Vec::new();
    for (subject, solid) in &scenes::folds(lab.size)? {
        let (open, paper) = (open_share(lab, subject)?, 1.0 - solid);
        let text = format!("open share {open:.3}, the paper has {paper:.2}");
        found.push(bound.found(&subject.name, (open - paper).abs(), text));
    }
    Ok(Claim {
        id: "crysis-edges",
        says: "The open share of the space about a point is 0.5 on a wall, 0.25 in a corner, and 0.75 on an edge, which is \
               brighter than its faces.",
        source: "6.1, Amount of geometry",
        found,
        rule: bound.rule("the open share's distance from the paper's", decimal),
        note: "Before the curve A^2 + A, mean of 4x4 pixels, seen under 90 degrees across. The listing's offsets are in \
               widths of the picture across and in 2 P.z in depth, which is a ball under 90 degrees alone. The range check \
               takes samples far in front of P for half open, which lightens a corner."
            .into(),
        ..Claim::default()
    })
}

fn pattern_vanishes(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.5 / 255.0, 2.0 / 255.0);
    let mut found = Vec::new();
    for wall in [scenes::fold("wall", "wall", 0.0, lab.size)?, scenes::floor()?] {
        let depth = lab.see(&wall, lab.size, &wall.exact(Method::Ssao))?.depth;
        let left =
            |blur| Ok::<_, Error>(noise(&lab.ao(&wall, &Settings { blur, ..wall.exact(Method::Ssao) })?, &depth));
        let (Some(before), Some(after)) = (left(0)?, left(9)?) else { continue };
        let text = format!("noise of {} before the blur, {} after", steps(before), steps(after));
        found.push(bound.found(&wall.name, after, text));
    }
    Ok(Claim {
        id: "crysis-pattern",
        says: "On a flat wall the kernel's rotations tile every 4x4 pixels, and the 4x4 blur removes their noise \
               completely.",
        source: "6.1, Randomly rotated kernel",
        found,
        rule: bound.rule("the root of the mean variance of the 4x4 residues after the blur", steps),
        note: "On a wall that faces the eye there is none before it either: offsets are corners of a cube, of which one of \
               two opposite ones is in front of a plane however the cube is turned. The floor is seen at a slant."
            .into(),
        unmeasured: Some("there are not 10 windows of 32x32 pixels: give a larger --size".into()),
    })
}

fn hidden_points_are_open(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    const PIXELS: usize = 4000;
    let bound = at_least(0.01, 0.001);
    let pit = scenes::pit(lab.size, false)?;
    let mut found = Vec::new();
    for subject in lab.data_sets().into_iter().chain([&pit]) {
        let settings = subject.exact(Method::Ssao);
        let seen = lab.see(subject, lab.size, &settings)?;
        let pixels = if subject.key == pit.key {
            seen.pixels_where(&subject.camera(lab.size)?, scenes::on_floor_of_pit)
        } else {
            seen.some_covered(PIXELS)
        };
        let (hidden, open) = hidden_points(&seen, subject, lab.size, &settings, &pixels)?;
        let share = hidden as f64 / open.max(1) as f64;
        let text = format!("{} of {open} points in front of the height field are hidden from P", percent(share));
        found.push(bound.found(&subject.name, share, text));
    }
    Ok(Claim {
        id: "ssao-hidden-open",
        says: "Crysis' method counts points above the height field as visible from P, which is not always true.",
        source: "6.2, Screen-space ambient occlusion; Figure 6.2.4",
        found,
        rule: bound
            .rule("the share of open samples that a ray from P does not reach", |share| format!("{} %", share * 100.0)),
        note: format!(
            "The method's own sample points at {PIXELS} random pixels, and in the pit at all pixels of the floor inside the \
             rim, by rays on the triangles."
        ),
        ..Claim::default()
    })
}

fn beyond_the_border(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    // The paper proposes a margin of about 10 % of the screen's size.
    const SHARE: f64 = 0.1;
    const ALIKE: f64 = 0.1;
    const VISIBLE: f64 = 0.05;
    let bound = at_least(0.5, 0.4);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let (width, height) = (lab.size.0 as usize, lab.size.1 as usize);
        // The margin consists of whole rotation tiles, so that both pictures have the same jitter.
        let margin = ((height as f64 * SHARE) as usize / 4 * 4).max(4);
        let wide = (lab.size.0 + 2 * margin as u32, lab.size.1 + 2 * margin as u32);
        if wide.0.max(wide.1) > size_limit(lab.gl) {
            continue;
        }
        let settings = subject.exact(Method::Hbao);
        let mut camera = subject.camera(lab.size)?;
        camera.projection = camera.projection.part(lab.size, (-(margin as i64), -(margin as i64)), wide);
        let mut pipeline = Pipeline::new(lab.gl, wide, &settings, Request::default())?;
        pipeline.render(&subject.mesh, &camera)?;
        let (depth, whole) = (pipeline.depth()?, pipeline.ao()?);
        // Every texel of the frame around the picture is compared with the border texel that a clamped sample reads.
        let (mut all, mut alike) = (0usize, 0usize);
        for y in 0..depth.height {
            for x in 0..depth.width {
                let inside = |v: usize, size: usize| v.clamp(margin, margin + size - 1);
                let border = (inside(x, width), inside(y, height));
                if border == (x, y) {
                    continue;
                }
                let (z, at) = (f64::from(depth.at(x, y)), f64::from(depth.at(border.0, border.1)));
                if z.is_infinite() && at.is_infinite() {
                    continue; // If both are background, no occluder is missing.
                }
                all += 1;
                alike += usize::from((z - at).abs() <= ALIKE * at.min(z));
            }
        }
        if all == 0 {
            continue;
        }
        let share = alike as f64 / all as f64;
        // The second measure is the effect of clamping on the outermost pixels.
        let clamped = lab.ao(subject, &settings)?;
        let cut = Image::from_fn(width, height, |x, y| whole.at(x + margin, y + margin));
        let strip = Image::from_fn(width, height, |x, y| {
            let near = |v: usize, size: usize| v.min(size - 1 - v) < margin / 2;
            (near(x, width) || near(y, height)) && depth.at(x + margin, y + margin).is_finite()
        });
        let off = strip.texels.iter().zip(cut.texels.iter().zip(&clamped.texels));
        let (strip_pixels, wrong) = off
            .filter(|(in_strip, _)| **in_strip)
            .fold((0usize, 0usize), |(n, w), (_, (a, b))| (n + 1, w + usize::from(f64::from((a - b).abs()) > VISIBLE)));
        let mut text =
            format!("{} of the depths within {} of the border are like those at it", percent(share), percent(SHARE));
        if strip_pixels > 0 {
            let errors = compare(&clamped, &cut, &strip)?;
            text += &format!(
                "; clamping moves A by {:.3} RMS there, by more than {VISIBLE} at {}",
                errors.rmse,
                percent(wrong as f64 / strip_pixels as f64)
            );
        }
        found.push(bound.found(&subject.name, share, text));
    }
    Ok(Claim {
        id: "beyond-the-border",
        says: "In most cases depths behind the screen's edges are very like those at the border, which solves at least \
               half of the cases in which occluders outside the picture are missing.",
        source: "6.1, Overview of the approach",
        found,
        rule: bound.rule(
            &format!("the share of texels beyond the border whose depth is within {} of the border's", percent(ALIKE)),
            percent,
        ),
        note: "Against a picture rendered wider on all sides; the effect on A is that of hbao with its defaults. Scenes of \
               which only background reaches the border are left out."
            .into(),
        unmeasured: Some("no scene reaches the border, or the driver has no wider image".into()),
    })
}
