//! The papers' claims on speed. The measurements for the tables decide them.

use super::test::Test;
use crate::report::claim::{Bound, Claim, Found, Verdict, at_least, at_most, percent, times};
use crate::report::lab::Lab;
use crate::report::measures::Measures;
use hbao::Error;
use hbao::measure::median;
use hbao::measure::published::{COLUMNS, CRYSIS_SMALL_DEPTH, EIGHT, FIGURE_1};

pub(super) const ALL: &[Test] =
    &[ray_marching_is_slower, multisampling_is_free, half_resolution_balances, half_size_depth, mirroring];

/// The least number of runs whose spread is meaningful.
const FEWEST_RUNS: usize = 3;

/// Divides one list of times by another, run by run, and takes the median of the ratios. The two cases were measured in
/// turns, so the runs of a pair belong together. The verdict is 'in part' if the runs disagree, that is, if the least
/// and the largest ratio have different verdicts.
fn pairs(bound: Bound, scene: &str, [over, under]: [&[f64]; 2], what: &str) -> Option<Found> {
    let ratios: Vec<f64> = over.iter().zip(under).map(|(over, under)| over / under).collect();
    if ratios.len() < FEWEST_RUNS {
        return None;
    }
    let (least, most) = ratios.iter().fold((f64::INFINITY, 0.0f64), |(l, m), &x| (l.min(x), m.max(x)));
    let text = format!(
        "{what}{:.1} ms against {:.1} ms, which are medians; the median of the runs' ratios is {} ({} to {})",
        median(over),
        median(under),
        times(median(&ratios)),
        times(least),
        times(most)
    );
    let mut found = bound.found(scene, median(&ratios), text);
    if bound.verdict(least) != bound.verdict(most) {
        found.verdict = Verdict::InPart;
    }
    Some(found)
}

fn rule(bound: Bound, what: &str) -> String {
    bound.rule(what, times) + "; in part also where the runs disagree"
}

fn too_few_runs() -> Option<String> {
    Some(format!("fewer than {FEWEST_RUNS} runs tell nothing of their spread: give more --runs"))
}

/// Compares the time of one case's ambient occlusion pass with that of another.
fn ao_ratio(measures: &Measures, mode: &str, over: &str, under: &str, bound: Bound) -> Vec<Found> {
    let both = measures.of_case(mode, over).zip(measures.of_case(mode, under));
    both.and_then(|(over, under)| pairs(bound, &measures.scene, [&over.ao_ms, &under.ao_ms], "")).into_iter().collect()
}

fn ray_marching_is_slower(_: &Lab, measures: &Measures) -> Result<Claim, Error> {
    let [(talk, horizons), (rays, marching)] = FIGURE_1;
    let paper = horizons / marching;
    let bound = at_least(0.8 * paper, 0.5 * paper);
    let found = ao_ratio(measures, "figure1", rays.name(), talk.name(), bound);
    Ok(Claim {
        id: "talk-figure-1",
        says: "Horizons run at 67 MPixels/s where ray marching with 4 rays per direction runs at 15: 4.47 times as fast.",
        source: "SIGGRAPH 2008 talk, Figure 1",
        found,
        unmeasured: too_few_runs(),
        rule: rule(bound, "the time of ray marching over that of the talk's method"),
        ..Claim::default()
    })
}

fn multisampling_is_free(_: &Lab, measures: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.1, 1.25);
    let both = measures.of_case("msaa1", COLUMNS[EIGHT]).zip(measures.of_case("msaa4", COLUMNS[EIGHT]));
    // If the driver gave fewer samples than were asked for, there is nothing to compare.
    let both = both.filter(|(_, four)| four.samples == four.case.settings.msaa);
    let found = both.and_then(|(one, four)| {
        let what = format!(
            "the AO pass takes {:.1} ms at 1x, {:.1} ms at 4x; frames at 4x ",
            median(&one.ao_ms),
            median(&four.ao_ms)
        );
        pairs(bound, &measures.scene, [&four.frame_ms, &one.frame_ms], &what)
    });
    Ok(Claim {
        id: "msaa-frame-rate",
        says: "With 8/8, 4x MSAA leaves the frame rate as it is (17 and 16 frames per second).",
        source: "6.2, Table 6.2.1",
        found: found.into_iter().collect(),
        unmeasured: Some(format!("the driver has no 4 samples a pixel, or there are fewer than {FEWEST_RUNS} --runs")),
        rule: rule(bound, "a frame's time at 4x over that at 1x"),
        note:
            "The AO pass itself is at one sample a pixel in both. Where the G-buffer is drawn by a processor, its four \
               samples are not free."
                .into(),
    })
}

fn half_resolution_balances(_: &Lab, measures: &Measures) -> Result<Claim, Error> {
    let found = measures.sweeps.iter().filter_map(|swept| {
        let is = |half: bool| {
            let wanted = swept.chapter().find(|s| (s.directions, s.half_res) == (8, half))?;
            swept.rows.iter().find(|row| row.settings == *wanted)
        };
        let (half, full) = (is(true)?, is(false)?);
        let share = half.ms / full.ms;
        let text = format!(
            "8/8 at half resolution takes {} of the time with RMSE {:.4} against {:.4}; {} the Pareto front",
            percent(share),
            half.errors.rmse,
            full.errors.rmse,
            if half.pareto { "on" } else { "not on" }
        );
        let verdict = match (half.pareto, half.errors.rmse <= 1.05 * full.errors.rmse && share < 0.5) {
            (true, _) => Verdict::Holds,
            (false, true) => Verdict::InPart,
            (false, false) => Verdict::DoesNotHold,
        };
        Some(Found { scene: swept.scene.clone(), text, value: share, verdict })
    });
    Ok(Claim {
        id: "half-resolution-balance",
        says: "Half resolution is a good balance point between speed and quality.",
        source: "6.2, Working at lower resolution; Table 6.2.1",
        found: found.collect(),
        rule: "holds where nothing in the sweep is better both in time and in RMSE, in part where it takes less than half the \
               time of full resolution with at most 1.05 times its RMSE"
            .into(),
        note: "The sweep has a quarter of the report's pixels, where a step of half texels falls below one sooner.".into(),
        ..Claim::default()
    })
}

fn half_size_depth(_: &Lab, measures: &Measures) -> Result<Claim, Error> {
    let bound = at_least(0.9 * CRYSIS_SMALL_DEPTH, 0.65 * CRYSIS_SMALL_DEPTH);
    let found = ao_ratio(measures, "crysis", "full depth", "half-size depth", bound);
    Ok(Claim {
        id: "half-size-depth",
        says: "A downscaled depth texture roughly doubles the speed of Crysis' shader.",
        source: "6.1, Future improvements",
        found,
        unmeasured: too_few_runs(),
        rule: rule(bound, "the time with full depth over that with half-size depth, its making included,"),
        note: "It spared a graphics card's texture cache; a processor's cache holds the full texture.".into(),
    })
}

fn mirroring(_: &Lab, measures: &Measures) -> Result<Claim, Error> {
    let bound = at_least(1.1, 1.02);
    let found = ao_ratio(measures, "crysis", "full depth", "mirror", bound);
    Ok(Claim {
        id: "mirroring",
        says: "Mirroring offsets at a plane is faster than rotating them by a matrix.",
        source: "6.1, Future improvements",
        found,
        unmeasured: too_few_runs(),
        rule: rule(bound, "the time with the matrix over that with the mirror"),
        ..Claim::default()
    })
}
