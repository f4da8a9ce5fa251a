//! What the papers say of speed, on the rows of the tables.

use super::{Bound, Claim, Found, Test, Verdict, at_least, at_most, percent, times};
use crate::cli::paper::lab::Lab;
use crate::cli::paper::tables::Tables;
use hbao::Error;
use hbao::measure::median;
use hbao::measure::published::{COLUMNS, CRYSIS_SMALL_DEPTH, EIGHT, FIGURE_1};
use hbao::settings::Method;

pub(super) const ALL: &[Test] =
    &[ray_marching_is_slower, multisampling_is_free, half_resolution_balances, half_size_depth, mirroring];

/// What one row takes over another, by the ambient occlusion pass.
fn ao_ratio(tables: &Tables, mode: &str, over: &str, under: &str, bound: Bound, scene: &str) -> Option<Found> {
    let (over, under) = (tables.row(mode, over)?, tables.row(mode, under)?);
    let [slow, fast] = [over, under].map(|row| median(&row.ao_ms));
    Some(bound.found(scene, slow / fast, format!("{slow:.1} ms against {fast:.1} ms, {}", times(slow / fast))))
}

fn ray_marching_is_slower(_: &Lab, tables: &Tables) -> Result<Claim, Error> {
    let [(talk, horizons), (rays, marching)] = FIGURE_1;
    let paper = horizons / marching;
    let bound = at_least(0.8 * paper, 0.5 * paper);
    let found = ao_ratio(tables, "figure1", rays.name(), talk.name(), bound, tables.scene());
    Ok(Claim {
        id: "talk-figure-1",
        says: "Horizons run at 67 MPixels/s where ray marching with 4 rays per direction runs at 15: 4.47 times as fast.",
        source: "SIGGRAPH 2008 talk, Figure 1",
        found: found.into_iter().collect(),
        rule: bound.rule("the time of ray marching over that of the talk's method", times),
        ..Claim::default()
    })
}

fn multisampling_is_free(_: &Lab, tables: &Tables) -> Result<Claim, Error> {
    let bound = at_most(1.1, 1.25);
    let mut found = Vec::new();
    if let (Some(one), Some(four)) = (tables.row("msaa1", COLUMNS[EIGHT]), tables.row("msaa4", COLUMNS[EIGHT])) {
        let [frame_1, frame_4] = [one, four].map(|row| median(&row.frame_ms));
        let [ao_1, ao_4] = [one, four].map(|row| median(&row.ao_ms));
        let text = format!(
            "frames of {frame_1:.0} and {frame_4:.0} ms, {}; of these the AO pass takes {ao_1:.0} and {ao_4:.0} ms",
            times(frame_4 / frame_1)
        );
        found.push(bound.found(tables.scene(), frame_4 / frame_1, text));
    }
    Ok(Claim {
        id: "msaa-frame-rate",
        says: "With 8/8, 4x MSAA leaves the frame rate as it is (17 and 16 frames per second).",
        source: "6.2, Table 6.2.1",
        found,
        rule: bound.rule("a frame's time at 4x over that at 1x", times),
        note:
            "The AO pass itself is at one sample a pixel in both. Where the G-buffer is drawn by a processor, its four \
               samples are not free."
                .into(),
        ..Claim::default()
    })
}

fn half_resolution_balances(_: &Lab, tables: &Tables) -> Result<Claim, Error> {
    let found = tables.trades.iter().filter_map(|swept| {
        let is = |half: bool| {
            swept.rows.iter().find(|row| {
                let s = &row.settings;
                (s.method, s.directions, s.steps, s.blur, s.half_res) == (Method::Hbao, 8, 8, 9, half)
            })
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

fn half_size_depth(_: &Lab, tables: &Tables) -> Result<Claim, Error> {
    let bound = at_least(0.9 * CRYSIS_SMALL_DEPTH, 0.65 * CRYSIS_SMALL_DEPTH);
    let found = ao_ratio(tables, "crysis", "full depth", "half-size depth", bound, tables.scene());
    Ok(Claim {
        id: "half-size-depth",
        says: "A downscaled depth texture roughly doubles the speed of Crysis' shader.",
        source: "6.1, Future improvements",
        found: found.into_iter().collect(),
        rule: bound.rule("the time with full depth over that with half-size depth, its making included,", times),
        note: "It spared a graphics card's texture cache; a processor's cache holds the full texture.".into(),
        ..Claim::default()
    })
}

fn mirroring(_: &Lab, tables: &Tables) -> Result<Claim, Error> {
    let bound = at_least(1.1, 1.02);
    let found = ao_ratio(tables, "crysis", "full depth", "mirror", bound, tables.scene());
    Ok(Claim {
        id: "mirroring",
        says: "Mirroring offsets at a plane is faster than rotating them by a matrix.",
        source: "6.1, Future improvements",
        found: found.into_iter().collect(),
        rule: bound.rule("the time with the matrix over that with the mirror", times),
        ..Claim::default()
    })
}
