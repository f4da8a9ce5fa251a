//! The claims of ShaderX7 6.2 on which samples are taken and how they are weighted. They are tested by comparison with
//! the ray-traced truth.

use super::test::Test;
use crate::report::claim::{Bound, Claim, Found, Verdict, at_least, at_most, decimal, percent, steps, times};
use crate::report::lab::{Lab, compare};
use crate::report::measures::Measures;
use crate::report::scenes;
use hbao::image::Image;
use hbao::settings::{Attenuation, Method, Radius, Snap};
use hbao::{Error, Settings};

pub(super) const ALL: &[Test] =
    &[attenuation_per_sample, quadratic_attenuation, three_rays, micro_spheres, more_samples];

fn attenuation_per_sample(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_least(0.01, 0.002);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let each = subject.exact(Method::Hbao);
        // This method has one W for each direction, and everything else is the same.
        let horizon = Settings { method: Method::HbaoTalk, ..each.clone() };
        let covered = lab.see(subject, lab.size, &each)?.covered();
        let [by_each, by_horizon] = [lab.ao(subject, &each)?, lab.ao(subject, &horizon)?];
        let lighter = compare(&by_horizon, &by_each, &covered)?.bias;
        let [a, b] = [lab.errors_of(subject, &by_each, &each)?, lab.errors_of(subject, &by_horizon, &each)?];
        let text = format!(
            "W at the horizon alone is lighter by {lighter:.4} on average; RMSE against the truth {:.3}, with W for each \
             sample {:.3}",
            b.rmse, a.rmse
        );
        found.push(bound.found(&subject.name, lighter, text));
    }
    Ok(Claim {
        id: "attenuation-per-sample",
        says: "One W at the horizon point is the lowest of its direction and over-attenuates; W for each sample makes a \
               significant difference.",
        source: "6.2, Attenuation function",
        found,
        rule: bound.rule("by how much A is lighter on average with W at the horizon", decimal),
        note: "Both with W = 1 - (r/R)^2 and the chapter's samples.".into(),
        ..Claim::default()
    })
}

fn quadratic_attenuation(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_least(0.999, 0.9);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let quadratic = Settings { blur: 0, ..subject.exact(Method::Hbao) };
        let linear = Settings { attenuation: Attenuation::Linear, ..quadratic.clone() };
        let covered = lab.see(subject, lab.size, &quadratic)?.covered();
        let [q, l] = [lab.ao(subject, &quadratic)?, lab.ao(subject, &linear)?];
        let pairs = || q.texels.iter().zip(&l.texels).zip(&covered.texels).filter(|(_, covered)| **covered);
        let darker = pairs().filter(|((q, l), _)| f64::from(**q) <= f64::from(**l) + 1e-6).count();
        let share = darker as f64 / pairs().count().max(1) as f64;
        let [eq, el] = [lab.errors_of(subject, &q, &quadratic)?, lab.errors_of(subject, &l, &linear)?];
        let text = format!(
            "quadratic is not lighter at {} of the pixels, darker by {:.3} on average; RMSE, each against its own \
             truth, {:.3}, linear {:.3}",
            percent_fine(share),
            -compare(&q, &l, &covered)?.bias,
            eq.rmse,
            el.rmse
        );
        found.push(bound.found(&subject.name, share, text));
    }
    Ok(Claim {
        id: "quadratic-attenuation",
        says: "The quadratic W = 1 - r^2 attenuates less than the linear 1 - r.",
        source: "6.2, Attenuation function",
        found,
        rule: bound.rule("the share of pixels that are no lighter with the quadratic W", percent_fine),
        note: "Eq. 6.2.9's brackets may be negative, so that a larger W can lighten.".into(),
        ..Claim::default()
    })
}

fn percent_fine(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

fn three_rays(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    const MANY: u32 = 32;
    let good = at_most(4.0 / 255.0, 4.0 / 255.0);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let of = |rays: u32| lab.ao(subject, &Settings { rays, ..subject.exact(Method::RayMarch) });
        let many = of(MANY)?;
        let covered = lab.see(subject, lab.size, &subject.exact(Method::RayMarch))?.covered();
        let few =
            (1..=6).map(|rays| Ok(compare(&of(rays)?, &many, &covered)?.rmse)).collect::<Result<Vec<_>, Error>>()?;
        let enough = few.iter().position(|&rmse| good.verdict(rmse) == Verdict::Holds).map(|i| i + 1);
        let list: Vec<_> = few.iter().map(|&rmse| steps(rmse)).collect();
        let needed = enough.map_or("more are needed".into(), |n| format!("{n} are enough"));
        let text = format!("1 to {} rays are off {MANY} by {} RMS: {needed}", few.len(), list.join(", "));
        let verdict = match enough {
            Some(3) => Verdict::Holds,
            Some(2 | 4) => Verdict::InPart,
            _ => Verdict::DoesNotHold,
        };
        found.push(Found { scene: subject.name.clone(), text, value: enough.map_or(f64::NAN, |n| n as f64), verdict });
    }
    Ok(Claim {
        id: "three-rays",
        says: "Ray marching needs at least three rays per direction for good results.",
        source: "6.2, Monte Carlo integration",
        found,
        rule: format!(
            "enough is where the root mean square difference from {MANY} rays is at most {}; holds where 3 are the fewest that \
             are enough, in part where 2 or 4 are",
            steps(good.holds)
        ),
        note: "8 directions of 8 steps, blur 9x9. At 'at least' more than 4 is no contradiction; it is marked as one all the \
               same, since 3 are then not enough."
            .into(),
        ..Claim::default()
    })
}

fn micro_spheres(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    const TOO_DARK: f64 = 0.1;
    let (bound, one_factor) = (at_least(0.05, 0.01), at_least(1.25, 1.1));
    let valley = scenes::valley()?;
    let (mut found, mut all_factors) = (Vec::new(), Vec::new());
    for subject in lab.data_sets().into_iter().chain([&valley]) {
        let (mut too_dark, mut factors) = (Vec::new(), Vec::new());
        for scale in [1.0, 4.0] {
            let radius = Radius::Units(subject.radius * scale);
            // Both methods read the same texels the same number of times. W is 1, because micro-spheres have no
            // attenuation.
            let of = |method| Settings {
                radius,
                directions: 16,
                steps: 16,
                snap: Snap::Step,
                attenuation: Attenuation::None,
                ..subject.exact(method)
            };
            let truth = lab.truth(subject, &of(Method::Hbao))?;
            let share = |image: &Image<f32>| {
                let known = image.texels.iter().zip(&truth.visibility.texels).zip(&truth.mask.texels);
                let differences: Vec<f64> =
                    known.filter(|(_, known)| **known).map(|((a, t), _)| f64::from(a - t)).collect();
                differences.iter().filter(|&&d| d < -TOO_DARK).count() as f64 / differences.len().max(1) as f64
            };
            let [spheres, horizons] = [lab.ao(subject, &of(Method::Microsphere))?, lab.ao(subject, &of(Method::Hbao))?];
            let occlusion =
                |image: &Image<f32>| Ok::<_, Error>(-compare(image, &image.map(|_| 1.0), &truth.mask)?.bias);
            // The factor that would turn the mean occlusion of the spheres into that of the truth. If the occlusion of
            // the spheres is 0, no factor does so.
            let (wanted, got) = (occlusion(&truth.visibility)?, occlusion(&spheres)?);
            factors.push((got > 1e-4).then(|| wanted / got));
            too_dark.push([share(&spheres), share(&horizons)]);
        }
        let text = format!(
            "darker than the truth by more than {TOO_DARK} at {} of the pixels with R and at {} with 4 R, horizons at {} and {}",
            percent(too_dark[0][0]),
            percent(too_dark[1][0]),
            percent(too_dark[0][1]),
            percent(too_dark[1][1])
        );
        found.push(bound.found(&subject.name, too_dark[1][0] - too_dark[1][1], text));
        all_factors.extend(factors.into_iter().flatten());
    }
    if !all_factors.is_empty() {
        let (least, most) = all_factors.iter().fold((f64::INFINITY, 0.0f64), |(l, m), &x| (l.min(x), m.max(x)));
        let text =
            format!("the factor that would give the truth's mean occlusion lies between {least:.2} and {most:.2}");
        let verdict = one_factor.verdict(most / least);
        found.push(Found { scene: "one factor for all".into(), text, value: most / least, verdict });
    }
    Ok(Claim {
        id: "micro-spheres",
        says: "Micro-spheres that ignore each other over-occlude for large radii, and no uniform factor mends it.",
        source: "6.2, Screen-space ambient occlusion",
        found,
        rule: bound.rule(
            &format!("the share of pixels that are darker than the truth by more than {TOO_DARK}, less that by horizons, at 4 R,"),
            percent,
        ) + "; of the factor "
            + &one_factor.rule("the largest over the smallest", times),
        note: "W = 1, 16 directions of 16 steps, for both. Micro-spheres weigh by the cosine, so that what stands low over \
               the surface counts less than in Eq. 6.2.3: where little overlaps they are too light instead."
            .into(),
        ..Claim::default()
    })
}

fn more_samples(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound: Bound = at_most(0.9, 1.0);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let rmse = |count: u32| -> Result<f64, Error> {
            let settings = Settings { directions: count, steps: count, ..subject.exact(Method::Hbao) };
            Ok(lab.errors(subject, &settings)?.rmse)
        };
        let [four, eight, sixteen] = [rmse(4)?, rmse(8)?, rmse(16)?];
        let text = format!("RMSE against the truth {four:.3}, {eight:.3}, {sixteen:.3} with 4/4, 8/8, 16/16");
        let mut one = bound.found(&subject.name, sixteen / four, text);
        if !(sixteen <= eight && eight <= four) {
            one.verdict = Verdict::DoesNotHold;
        }
        found.push(one);
    }
    Ok(Claim {
        id: "more-samples",
        says: "More samples bring out more of the subtle detail: 16/16 more than 8/8, that more than 4/4.",
        source: "6.2, Results; Figure 6.2.16",
        found,
        rule: bound.rule("RMSE with 16/16 over that with 4/4", percent)
            + "; does not hold where it does not fall each time",
        note: "Blur 9x9 for all.".into(),
        ..Claim::default()
    })
}
