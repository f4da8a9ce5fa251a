//! The claims of ShaderX7 6.2 on normals, tangents, directions and the angle bias.

use super::test::Test;
use crate::report::claim::{Claim, Verdict, at_least, at_most, percent, steps, times};
use crate::report::lab::{Lab, compare};
use crate::report::measures::Measures;
use crate::report::scenes::{self, BIAS_DEGREES, FACETS};
use crate::report::subject::Subject;
use glam::DVec2;
use hbao::image::Image;
use hbao::reference::anatomy::Anatomy;
use hbao::settings::{Attenuation, Clamp, Grounding, Jitter, Method, Normals, Radius, Snap};
use hbao::{Error, Settings};
use std::f64::consts::TAU;

pub(super) const ALL: &[Test] = &[
    tangents,
    azimuths,
    grounding,
    vertex_normals,
    bias_and_creases,
    bias_and_clamping,
    snapped_directions_band,
    outliers,
];

/// The least occlusion that counts as something to be removed: one step of an 8-bit target.
const LEAST: f64 = 1.0 / 255.0;

/// The number of pixels at which single tangents are compared.
const PIXELS: usize = 20_000;

fn tangents(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.0 / 255.0, 4.0 / 255.0);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let settings = subject.exact(Method::Hbao);
        let seen = lab.see(subject, lab.size, &settings)?;
        let inputs = seen.inputs();
        let twin = Anatomy::new(&inputs, &settings)?;
        let (mut worst, mut compared, mut beyond) = (0.0f64, 0usize, 0usize);
        for (i, pixel) in seen.some_covered(PIXELS).into_iter().enumerate() {
            // Each pixel is tested with one offset. Together the offsets have all directions, and lengths up to a tenth
            // of the picture's height.
            let length = 1.0 + f64::from(lab.size.1) / 10.0 * ((i % 97) as f64 / 97.0);
            let offset = length * DVec2::from_angle(TAU * (i % 89) as f64 / 89.0);
            let Some(linear) = twin.tangent(pixel, offset) else { continue };
            match twin.tangent_by_ray(pixel, offset) {
                Some(cast) => {
                    let sine = |t: glam::DVec3| -t.z / t.length();
                    worst = worst.max((sine(linear) - sine(cast)).abs());
                    compared += 1;
                }
                None => beyond += 1,
            }
        }
        let text = format!(
            "sines of elevation differ by {worst:.1e} at most over {compared} tangents; {beyond} more rays do not meet \
             the plane"
        );
        found.push(bound.found(&subject.name, worst, text));
    }
    Ok(Claim {
        id: "eq-6.2.11",
        says: "Tangents by Eq. 6.2.11, called not perspective-correct, make no visible error against casting a ray onto \
               the tangent plane.",
        source: "6.2, Eye-space tangent vectors",
        found,
        rule: bound.rule("the largest difference of the sine of elevation", steps),
        note:
            "They are one direction: the equation's vector lies in the tangent plane and above its own texel offset. \
               Only its length is linearised, and no length is used."
                .into(),
        ..Claim::default()
    })
}

fn azimuths(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    const DIRECTIONS: usize = 8;
    let bound = at_most(0.1, 0.3);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let settings = subject.exact(Method::Hbao);
        let seen = lab.see(subject, lab.size, &settings)?;
        let inputs = seen.inputs();
        let twin = Anatomy::new(&inputs, &settings)?;
        let (mut deviations, mut beyond) = (Vec::new(), 0usize);
        for pixel in seen.some_covered(PIXELS) {
            // At these pixels the hemisphere does not contain the Z axis, and Eq. 6.2.4 does not apply.
            if seen.normals.at(pixel.0, pixel.1)[2] >= 0.0 {
                beyond += 1;
                continue;
            }
            let turn = |k: usize| TAU * k as f64 / DIRECTIONS as f64;
            let tangents = (0..DIRECTIONS).filter_map(|k| twin.tangent(pixel, DVec2::from_angle(turn(k))));
            let mut angles: Vec<f64> = tangents.map(|t| t.truncate().to_angle()).collect();
            angles.sort_by(f64::total_cmp);
            let gap = |i: usize| {
                let next = if i + 1 < angles.len() { angles[i + 1] } else { angles[0] + TAU };
                (next - angles[i]) / turn(1) - 1.0
            };
            let squares: f64 = (0..angles.len()).map(|i| gap(i).powi(2)).sum();
            deviations.push((squares / angles.len().max(1) as f64).sqrt());
        }
        let mean = deviations.iter().sum::<f64>() / deviations.len().max(1) as f64;
        let far = deviations.iter().filter(|&&d| d > bound.holds).count() as f64 / deviations.len().max(1) as f64;
        let text = format!(
            "the gaps between {DIRECTIONS} azimuths deviate by {} from equal ones on average; at {} of the pixels by more \
             than {}; another {} of the pixels, of n.z >= 0, are left out",
            percent(mean),
            percent(far),
            percent(bound.holds),
            percent(beyond as f64 / (beyond + deviations.len()).max(1) as f64)
        );
        found.push(bound.found(&subject.name, mean, text));
    }
    Ok(Claim {
        id: "azimuths",
        says: "Directions that are uniform in the image are approximately uniform in azimuth about the eye's Z axis.",
        source: "6.2, Eye-space basis",
        found,
        rule: bound.rule("the root mean square deviation of the gaps, as a mean over pixels,", percent),
        note: "Azimuths of the tangents, from whose elevation the integral starts. On a wall that is seen edge-on from the side \
               they collapse into two; where n.z >= 0 Eq. 6.2.4 is not valid at all, and those pixels are left out."
            .into(),
        ..Claim::default()
    })
}

fn grounding(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.0 / 255.0, 4.0 / 255.0);
    let floor = scenes::floor()?;
    let worst = |grounding| -> Result<f64, Error> {
        let settings = Settings { grounding, snap: Snap::Sample, blur: 0, ..floor.exact(Method::Hbao) };
        let image = lab.ao(&floor, &settings)?;
        Ok(image.texels.iter().map(|&a| 1.0 - f64::from(a)).fold(0.0, f64::max))
    };
    let (by_sample, by_direction) = (worst(Grounding::Sample)?, worst(Grounding::Direction)?);
    let text = format!(
        "a floor is occluded by {} at worst with a tangent for each sample, by {} with one for each direction",
        steps(by_sample),
        steps(by_direction)
    );
    let mut claim = bound.found("floor", by_sample, text);
    if by_direction <= bound.holds {
        claim.verdict = Verdict::DoesNotHold;
    }
    Ok(Claim {
        id: "grounding",
        says: "With samples snapped, one tangent for a direction (Eq. 6.2.8) makes false occlusion, and one for each \
               sample (Eq. 6.2.9) makes none.",
        source: "6.2, Integrating the ambient occlusion",
        found: vec![claim],
        rule: bound.rule("the largest occlusion of a plane by Eq. 6.2.9", steps)
            + "; does not hold where Eq. 6.2.8 makes no more than that either",
        ..Claim::default()
    })
}

fn vertex_normals(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_least(LEAST, LEAST);
    let mut found = Vec::new();
    let mut last = f64::INFINITY;
    for facets in [8, 16, 32] {
        let ball = scenes::ball(facets)?;
        let open = |normals| -> Result<f64, Error> {
            let settings = Settings { normals, ..ball.exact(Method::Hbao) };
            let seen = lab.see(&ball, lab.size, &settings)?;
            let image = lab.ao(&ball, &settings)?;
            // A ball is convex, so the true visibility is 1 everywhere.
            Ok(compare(&image, &image.map(|_| 1.0), &seen.covered())?.rmse)
        };
        let (derivative, vertex) = (open(Normals::Derivative)?, open(Normals::Vertex)?);
        let text =
            format!("false occlusion of {derivative:.4} RMS with derivative normals, {vertex:.4} with vertex normals");
        let mut one = bound.found(&ball.name, vertex - derivative, text);
        // The claim says that the effect is strongest on large triangles.
        if vertex > last {
            one.verdict = Verdict::DoesNotHold;
        }
        last = vertex;
        found.push(one);
    }
    Ok(Claim {
        id: "vertex-normals",
        says: "Interpolated vertex normals, which are not orthogonal to their triangles, make artefacts, above all on \
               large triangles; normals by derivatives do not.",
        source: "6.2, Per-pixel normals",
        found,
        rule: bound.rule(
            "the false occlusion of a convex ball, RMS, that vertex normals have more of than derivative normals,",
            steps,
        ) + "; does not hold where finer facets have more of it",
        ..Claim::default()
    })
}

fn bias_and_creases(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.1, 0.5);
    let variation = |vault: &Subject, bias: f64| -> Result<f64, Error> {
        let base = vault.exact(Method::Hbao);
        let settings = Settings { bias: bias.to_radians(), directions: 16, steps: 16, ..base };
        let image = lab.ao(vault, &settings)?;
        // The middle of the upper half shows the vault alone, away from the border.
        let (width, height) = (image.width, image.height);
        let inside = (height / 2..height * 3 / 4).flat_map(|y| (width / 4..width * 3 / 4).map(move |x| (x, y)));
        let mut values: Vec<f64> = inside.map(|(x, y)| f64::from(image.at(x, y))).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((share * values.len() as f64) as usize).copied().unwrap_or(1.0);
        Ok(at(0.95) - at(0.05))
    };
    let mut found = Vec::new();
    for vault in [scenes::vault(FACETS, false)?, scenes::vault(FACETS, true)?] {
        let (without, with) = (variation(&vault, 0.0)?, variation(&vault, BIAS_DEGREES)?);
        if without < LEAST {
            continue;
        }
        let text = format!("A varies by {without:.3} over the facets without a bias, by {with:.3} with it");
        found.push(bound.found(&vault.name, with / without, text));
    }
    let mut cost = Vec::new();
    for subject in lab.data_sets() {
        let settings = subject.exact(Method::Hbao);
        let biased = Settings { bias: BIAS_DEGREES.to_radians(), ..settings.clone() };
        let [a, b] = [lab.errors(subject, &settings)?, lab.errors(subject, &biased)?];
        cost.push(format!("{} {:+.3}, {:+.3}", subject.name, a.bias, b.bias));
    }
    Ok(Claim {
        id: "bias-creases",
        says: "Creases that low tessellation makes vanish with an angle bias.",
        source: "6.2, Angle bias; Figure 6.2.13",
        found,
        rule: bound.rule("what is left of the variation, from the 5th to the 95th of 100 pixels,", percent),
        note: format!(
            "Facets meet at {} degrees, the bias is {BIAS_DEGREES}. Elevations are about the eye's Z axis: of a crease seen \
             at a slant they differ by more than its angle. The bias also takes true occlusion; mean error against the \
             truth, without and with it: {}.",
            180 / FACETS,
            cost.join("; ")
        ),
        unmeasured: Some("no creases are seen at this size: give a larger --size".into()),
    })
}

fn bias_and_clamping(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.1, 0.5);
    let floor = scenes::floor()?;
    let border = |clamp, bias: f64| -> Result<f64, Error> {
        let settings = Settings { clamp, bias: bias.to_radians(), ..floor.exact(Method::Hbao) };
        let image = lab.ao(&floor, &settings)?;
        let strip = (image.height / 20).max(1);
        let near = |v: usize, size: usize| v.min(size - 1 - v) < strip;
        let mask = Image::from_fn(image.width, image.height, |x, y| near(x, image.width) || near(y, image.height));
        Ok(compare(&image.map(|_| 1.0), &image, &mask)?.bias.max(0.0))
    };
    let mut found = Vec::new();
    let without = border(Clamp::Depth, 0.0)?;
    for bias in [10.0, BIAS_DEGREES].into_iter().filter(|_| without >= LEAST) {
        let with = border(Clamp::Depth, bias)?;
        let text = format!("mean occlusion of a floor along the border: {without:.4} without, {with:.4} with the bias");
        found.push(bound.found(format!("bias of {bias} degrees"), with / without, text));
    }
    let position = border(Clamp::Position, 0.0)?;
    Ok(Claim {
        id: "bias-clamping",
        says: "An angle bias removes the artefacts of clamping to the edge when depth is sampled.",
        source: "6.2, Angle bias",
        found,
        rule: bound.rule("what is left of the border's false occlusion", percent),
        note: format!(
            "With clamp = depth, a sample beyond the border at the border's depth; a twentieth of the picture along it. \
             Where a clamped sample is taken to lie at the border itself (clamp = position, the default) the floor is \
             occluded by {position:.4} without any bias."
        ),
        unmeasured: Some("nothing is seen along the border at this size: give a larger --size".into()),
    })
}

fn snapped_directions_band(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_least(2.0, 1.2);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        // Measures by how much snapping changes A: the same samples are compared with and without snapped directions,
        // at the pixels where no step is shorter than a texel.
        let moved = |radius: f64, count: u32, longest: u32, smallest: f64| -> Result<Option<f64>, Error> {
            let settings = |snap| Settings {
                radius: Radius::Units(radius),
                snap,
                steps: count,
                directions: 16,
                jitter: Jitter::None,
                blur: 0,
                ..subject.exact(Method::Hbao)
            };
            let seen = lab.see(subject, lab.size, &settings(Snap::Step))?;
            let texels = seen.texels_at_depth_1() * smallest;
            let mask = seen.depth.map(|z| z.is_finite() && texels / f64::from(z) >= f64::from(longest + 1));
            if mask.texels.iter().filter(|&&here| here).count() < 1000 {
                return Ok(None);
            }
            let [by_step, by_sample] = [Snap::Step, Snap::Sample].map(|snap| lab.ao(subject, &settings(snap)));
            Ok(Some(compare(&by_step?, &by_sample?, &mask)?.rmse))
        };
        let (name, r) = (&subject.name, subject.radius);
        if let (Some(few), Some(many)) = (moved(r, 4, 32, r)?, moved(r, 32, 32, r)?) {
            let text = format!("A moves by {few:.4} RMS with 4 steps, {many:.4} with 32");
            found.push(bound.found(format!("{name}, steps"), many / few, text));
        }
        if let (Some(whole), Some(part)) = (moved(r, 8, 8, r / 4.0)?, moved(r / 4.0, 8, 8, r / 4.0)?) {
            let text = format!("A moves by {whole:.4} RMS with R, {part:.4} with R/4, 8 steps");
            found.push(bound.found(format!("{name}, radius"), part / whole, text));
        }
    }
    Ok(Claim {
        id: "snapped-bands",
        says: "Snapped directions band for high numbers of steps or small radii of influence, since few directions are \
               left.",
        source: "6.2, Directions and jittering; Figure 6.2.10",
        found,
        rule: bound.rule(
            "what rounding the step moves A by, with the more steps or the smaller radius, over that with the fewer or \
             larger",
            times,
        ),
        note: "Against samples that are rounded one by one, 16 directions, without jitter and blur, over the pixels where \
               no step is below a texel."
            .into(),
        unmeasured: Some("in no view steps are longer than a texel at 1000 pixels: give a larger --size".into()),
    })
}

fn outliers(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.75, 0.95);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let settings = Settings { attenuation: Attenuation::None, blur: 0, ..subject.exact(Method::Hbao) };
        let seen = lab.see(subject, lab.size, &settings)?;
        let truth = lab.truth(subject, &settings)?;
        let width = seen.depth.width;
        let known: Vec<usize> = (0..truth.mask.texels.len()).filter(|&i| truth.mask.texels[i]).collect();
        let pixels: Vec<(usize, usize)> = known.iter().map(|i| (i % width, i / width)).collect();
        let inputs = seen.inputs();
        let ignored = lab.ao(subject, &settings)?;
        let kept = Anatomy::new(&inputs, &settings)?.with_outliers().visibilities(&pixels);
        let mut image = truth.visibility.clone();
        for (i, a) in known.iter().zip(kept) {
            image.texels[*i] = a.unwrap_or(1.0) as f32;
        }
        let [ignored, kept] =
            [compare(&ignored, &truth.visibility, &truth.mask)?, compare(&image, &truth.visibility, &truth.mask)?];
        let text = format!(
            "RMSE {:.3} with samples beyond R ignored, {:.3} with them counted (bias {:+.3}, {:+.3})",
            ignored.rmse, kept.rmse, ignored.bias, kept.bias
        );
        found.push(bound.found(&subject.name, ignored.rmse / kept.rmse, text));
    }
    Ok(Claim {
        id: "outliers",
        says: "Ignoring samples farther than R from P removes the artefacts of height-field outliers.",
        source: "6.2, Avoiding outliers; Figure 6.2.6",
        found,
        rule: bound.rule("RMSE against the truth with them ignored over that with them counted", percent),
        note: "W = 1, no blur; with them counted by the float64 twin.".into(),
        ..Claim::default()
    })
}
