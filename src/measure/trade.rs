//! Error against time over a sweep of settings: what accuracy costs, and which settings nobody should use.
#![doc = include_str!("accuracy.md")]

use super::errors::{Comparison, Errors};
use super::gbuffers::GBuffers;
use super::interleaved::interleaved;
use super::times::median;
use super::{Shot, TruthImage};
use crate::image::Image;
use crate::settings::{AoFormat, BlurKernel, DepthFormat, Knob, Method, NormalFormat, Settings};
use crate::{AmbientOcclusion, Error, Pipeline, Request, Timers};
use std::sync::Arc;

/// One point of the trade.
#[derive(Clone, Debug)]
pub struct TradeRow {
    /// The settings that were measured. All rows of a sweep have the same radius.
    pub settings: Settings,
    /// Milliseconds of ambient occlusion and its blur together, the median over the runs: by the driver's timer where
    /// it has one, else on the wall.
    pub ms: f64,
    /// The errors against the truth.
    pub errors: Errors,
    /// The errors over the edge pixels alone, as [`edges`] finds them; none where there is no edge pixel.
    pub edge_errors: Option<Errors>,
    /// True where no row is better in both time and RMSE.
    pub pareto: bool,
}

/// A method's own settings, with those of `base` that a sweep keeps.
fn of_method(base: &Settings, method: Method) -> Settings {
    Settings {
        radius: base.radius,
        attenuation: base.attenuation,
        strength: base.strength,
        msaa: 1,
        ..Settings::for_method(method)
    }
}

/// The settings of a sweep whose error is decomposed: the chapter's 4 x 4, 8 x 8 and 16 x 16 samples, at full and at
/// half resolution.
pub fn chapter(base: &Settings) -> Vec<Settings> {
    let of = |n: u32, half_res| Settings { directions: n, steps: n, half_res, ..of_method(base, Method::Hbao) };
    [false, true].into_iter().flat_map(|half_res| [4, 8, 16].map(|n| of(n, half_res))).collect()
}

/// The settings of a sweep: every method, the sample counts of Table 6.2.1 among others, half resolution, blurs and
/// formats. All have the radius, the strength and the attenuation of `base`, and one depth sample a pixel, because the
/// truth is that of the pixels' centres.
pub fn sweep(base: &Settings) -> Vec<Settings> {
    let of = |method: Method| of_method(base, method);
    let with = |settings: Settings, directions: u32, steps: u32| Settings { directions, steps, ..settings };
    // The methods whose samples are the product of so many counts.
    let others = |counts: usize| -> Vec<Method> {
        let all = Method::ALL.iter().filter(|&&method| method != Method::Hbao);
        all.filter(|method| method.facts().samples.len() == counts).copied().collect()
    };
    let mut all = Vec::new();
    for (directions, steps) in [(2, 4), (4, 4), (4, 8), (6, 6), (8, 8), (16, 8), (16, 16), (32, 16)] {
        for (blur, half_res) in [(9, false), (9, true), (21, false)] {
            all.push(Settings { blur, half_res, ..with(of(Method::Hbao), directions, steps) });
        }
    }
    for count in [4, 8, 16] {
        all.push(Settings { blur: 0, ..with(of(Method::Hbao), count, count) });
        for method in others(2) {
            all.push(with(of(method), count, count));
        }
    }
    for counts in [[4, 2, 4], [8, 4, 8], [16, 4, 16]] {
        all.extend(others(3).into_iter().map(|method| method.with_counts(of(method), &counts)));
    }
    for method in others(1) {
        let choices = method.facts().samples.iter().filter_map(|name| Knob::named(name)).flat_map(Knob::choices);
        all.extend(choices.map(|&count| method.with_counts(of(method), &[count])));
    }
    let chapter = || with(of(Method::Hbao), 8, 8);
    all.push(Settings { blur_kernel: BlurKernel::Full, ..chapter() });
    all.push(Settings { ao_format: AoFormat::R32f, ..chapter() });
    all.push(Settings { normal_format: NormalFormat::Rgba16f, ..chapter() });
    all.push(Settings { depth_format: DepthFormat::R16f, ..chapter() });
    all.extend(others(0).into_iter().map(of));
    all
}

/// The depth samples a pixel by which edges are found. A usual multisample G-buffer has 4, and llvmpipe has no more.
const EDGE_SAMPLES: u32 = 4;

/// The pixels that hold more than one surface: those whose 4 depth samples span more than the settings' depth sigma, or
/// mix surface and background. [`Settings::msaa`] does not matter, so that images of one sample a pixel can be judged
/// at these pixels too. Where the driver has no multisample textures, no pixel is an edge.
///
/// # Errors
/// What the driver refuses.
pub fn edges(gl: &Arc<glow::Context>, shot: Shot, settings: &Settings) -> Result<Image<bool>, Error> {
    let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, shot.size, &Settings { msaa: EDGE_SAMPLES, ..settings.clone() }, request)?;
    pipeline.render(shot.mesh, shot.camera)?;
    let none = || Image::filled(shot.size.0 as usize, shot.size.1 as usize, false);
    Ok(pipeline.edges().cloned().unwrap_or_else(none))
}

/// Measures each of `settings` on a view, in `runs` interleaved rounds after one that compiles the shaders and is not
/// counted. The images are compared with the truth over its covered pixels, and over the edge pixels among these. The
/// edge pixels are the same for all rows, by the depth sigma of the first of `settings`. `progress` is called after
/// each rendering.
///
/// # Errors
/// What the driver refuses, or a truth of another size than the shot's.
pub fn measure(
    gl: &Arc<glow::Context>,
    shot: Shot,
    truth: &TruthImage,
    settings: &[Settings],
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<TradeRow>, Error> {
    let mut gbuffers = GBuffers::new(gl);
    let mut timers = Timers::new(gl, true)?;
    let mut passes = Vec::new();
    for each in settings {
        passes.push((AmbientOcclusion::new(gl.clone(), shot.size, each)?, gbuffers.inputs(shot, each)?));
    }
    let times = interleaved(&mut passes, &mut timers, runs, progress)?;
    let covered = &truth.covered;
    let mut on_edges = covered.map(|_| false);
    if let Some(first) = settings.first() {
        let edges = edges(gl, shot, first)?;
        on_edges = Image::from_fn(covered.width, covered.height, |x, y| edges.at(x, y) && covered.at(x, y));
    }
    let mut rows = Vec::new();
    for ((each, (ao, _)), times) in settings.iter().zip(&passes).zip(&times) {
        let comparison = Comparison::new(&ao.image()?, &truth.visibility)?;
        let errors = comparison.over(covered)?.ok_or_else(Errors::of_nothing)?;
        let edge_errors = comparison.over(&on_edges)?;
        rows.push(TradeRow { settings: each.clone(), ms: median(times), errors, edge_errors, pareto: false });
    }
    let points: Vec<_> = rows.iter().map(|row| (row.ms, row.errors.rmse)).collect();
    rows.iter_mut().zip(pareto(&points)).for_each(|(row, pareto)| row.pareto = pareto);
    Ok(rows)
}

/// For each point (time, error), whether no other point is better in both.
pub fn pareto(points: &[(f64, f64)]) -> Vec<bool> {
    let beaten = |&(ms, error): &(f64, f64)| points.iter().any(|&(m, e)| m < ms && e < error);
    points.iter().map(|point| !beaten(point)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nobody_beats_in_both() {
        let points = [(1.0, 5.0), (2.0, 3.0), (3.0, 4.0), (4.0, 1.0), (5.0, 1.0), (0.5, 9.0)];
        // Of two points with the same error, the slower one is not beaten in both.
        assert_eq!(pareto(&points), [true, true, false, true, true, true]);
    }

    #[test]
    fn the_sweep_holds_the_table_and_no_setting_twice() {
        let all = sweep(&Settings::default());
        for (n, half_res) in [(4, false), (8, false), (16, false), (4, true), (8, true), (16, true)] {
            let is =
                |s: &&Settings| (s.method, s.directions, s.steps) == (Method::Hbao, n, n) && s.half_res == half_res;
            let chapter = chapter(&Settings::default());
            let settings = chapter.iter().find(is).unwrap();
            assert!(all.contains(settings) && (settings.blur, settings.msaa) == (9, 1));
        }
        for (i, settings) in all.iter().enumerate() {
            settings.validate().unwrap();
            assert!(!all[..i].contains(settings), "{}", settings.to_toml());
        }
    }
}
