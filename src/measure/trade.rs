//! Measures the error and the time of many combinations of settings. This shows what accuracy costs, and which
//! combinations nobody should use.
#![doc = include_str!("accuracy.md")]

use super::errors::{Comparison, Errors};
use super::gbuffers::GBuffers;
use super::interleaved::{Timed, interleaved};
use super::times::median;
use super::{BestStrength, MOST_EXITS, Reach, Shot, TruthImage};
use crate::image::Image;
use crate::settings::{AoFormat, BlurKernel, DepthFormat, Knob, Method, NormalFormat, Settings};
use crate::{AmbientOcclusion, Error, Pipeline, Request, Timers};
use std::sync::Arc;

/// The time and the errors of one combination of settings.
#[derive(Clone, Debug)]
pub struct TradeRow {
    /// The combination of settings that was measured. All rows of a sweep have the same radius.
    pub settings: Settings,
    /// The time of ambient occlusion and its blur together in milliseconds, the median over the runs. It is measured by
    /// the driver's timer, or by the system's clock if the driver has none.
    pub ms: f64,
    /// The time of ambient occlusion alone, without the blur, measured in the same runs.
    pub ao_ms: f64,
    /// The errors relative to the truth.
    pub errors: Errors,
    /// The strength with which the RMSE would be the least; `None` for a method that reads no strength.
    pub best_strength: Option<BestStrength>,
    /// The errors over the edge pixels alone, which [`edges`] finds; `None` if there is no edge pixel.
    pub edge_errors: Option<Errors>,
    /// How R fits the steps and the picture.
    pub reach: Reach,
    /// True if no other row is better in both time and RMSE. Rows that exit early at more than half of the texels
    /// ([`MOST_EXITS`]) are left out: what they show is not the method.
    pub pareto: bool,
}

/// Returns the default settings of a method, with the radius, the attenuation and the strength of `base`, and one depth
/// sample per pixel. The early exit is that of `base` too, if it is not the default of its method.
fn of_method(base: &Settings, method: Method) -> Settings {
    Settings {
        radius: base.radius,
        attenuation: base.attenuation,
        strength: base.strength,
        exit: base.exit_for(method),
        msaa: 1,
        ..Settings::for_method(method)
    }
}

/// Returns the combinations of a sweep whose error is decomposed: `hbao` with the 4 x 4, 8 x 8 and 16 x 16 samples of
/// the chapter, at full and at half resolution.
pub fn chapter(base: &Settings) -> Vec<Settings> {
    let of = |n: u32, half_res| Settings { directions: n, steps: n, half_res, ..of_method(base, Method::Hbao) };
    [false, true].into_iter().flat_map(|half_res| [4, 8, 16].map(|n| of(n, half_res))).collect()
}

/// Returns the combinations of a sweep: every method, the sample counts of Table 6.2.1 and others, half resolution,
/// blurs and formats. All have the radius, the strength and the attenuation of `base`, and its early exit if that is
/// not the default of its method. All have one depth sample per pixel, because the truth is traced from the centres of
/// the pixels.
pub fn sweep(base: &Settings) -> Vec<Settings> {
    let of = |method: Method| of_method(base, method);
    let with = |settings: Settings, directions: u32, steps: u32| Settings { directions, steps, ..settings };
    // The methods whose samples are the product of so many counts.
    let others = |counts: usize| -> Vec<Method> {
        let all = Method::ALL.iter().filter(|method| !matches!(method, Method::Hbao | Method::HbaoView));
        all.filter(|method| method.facts().samples.len() == counts).copied().collect()
    };
    let mut all = Vec::new();
    for (directions, steps) in [(2, 4), (4, 4), (4, 8), (6, 6), (8, 8), (16, 8), (16, 16), (32, 16)] {
        for (blur, half_res) in [(9, false), (9, true), (21, false)] {
            all.push(Settings { blur, half_res, ..with(of(Method::Hbao), directions, steps) });
        }
    }
    for (directions, steps) in [(2, 4), (4, 4), (4, 8), (8, 8), (16, 16)] {
        all.push(with(of(Method::HbaoView), directions, steps));
    }
    // Without the blur, whose own error is larger than what some of these differ by.
    for (directions, steps) in [(4, 2), (4, 4), (4, 8), (8, 8), (16, 8), (16, 16)] {
        for method in [Method::Hbao, Method::HbaoView] {
            all.push(Settings { blur: 0, ..with(of(method), directions, steps) });
        }
    }
    for count in [4, 8, 16] {
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

/// The number of depth samples per pixel from which edges are found. Multisample G-buffers usually have 4, and llvmpipe
/// supports no more.
const EDGE_SAMPLES: u32 = 4;

/// Finds the edge pixels, which hold more than one surface: their 4 depth samples span more than the depth sigma of the
/// settings, or some lie on a surface and some on background. [`Settings::msaa`] is ignored, so that images with one
/// sample per pixel can be judged at these pixels too. If the driver has no multisample textures, no pixel is an edge.
///
/// # Errors
/// [`Error::Gl`] if the driver refuses a shader, an allocation or a call.
pub fn edges(gl: &Arc<glow::Context>, shot: Shot, settings: &Settings) -> Result<Image<bool>, Error> {
    let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, shot.size, &Settings { msaa: EDGE_SAMPLES, ..settings.clone() }, request)?;
    pipeline.render(shot.mesh, shot.camera)?;
    let none = || Image::filled(shot.size.0 as usize, shot.size.1 as usize, false);
    Ok(pipeline.edges().cloned().unwrap_or_else(none))
}

/// Measures each combination in `settings` on a view, in `runs` interleaved rounds. A first round, which compiles the
/// shaders, is not counted. The images are compared with the truth over all covered pixels, and again over those
/// covered pixels that are edges. The edge pixels are the same for all rows: the depth sigma of the first combination
/// decides. `progress` is called after each rendering.
///
/// # Errors
/// [`Error::Gl`] if the driver refuses a shader, an allocation or a call. [`Error::Usage`] if the truth and the shot
/// have different sizes.
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
        let image = ao.image()?;
        let comparison = Comparison::new(&image, &truth.visibility)?;
        let errors = comparison.over(covered)?.ok_or_else(Errors::of_nothing)?;
        let edge_errors = comparison.over(&on_edges)?;
        let reach = Reach::of(&gbuffers.of(shot, each)?.depth()?, shot.camera.projection, each)?;
        let median_of = |time: fn(&Timed) -> f64| median(&times.iter().map(time).collect::<Vec<_>>());
        let fitted =
            each.method.reads("strength").then(|| BestStrength::of(&image, &truth.visibility, covered, each.strength));
        rows.push(TradeRow {
            settings: each.clone(),
            ms: median_of(|timed| timed.ms),
            ao_ms: median_of(|timed| timed.ao_ms),
            errors,
            best_strength: fitted.transpose()?,
            edge_errors,
            reach,
            pareto: false,
        });
    }
    let mut judged: Vec<_> = rows.iter_mut().filter(|row| row.reach.exits <= MOST_EXITS).collect();
    let points: Vec<_> = judged.iter().map(|row| (row.ms, row.errors.rmse)).collect();
    judged.iter_mut().zip(pareto(&points)).for_each(|(row, pareto)| row.pareto = pareto);
    Ok(rows)
}

/// Returns, for each point (time, error), whether no other point is better in both.
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
        // A point is beaten only if another is better in both. Of two points with the same error, the slower one is
        // therefore on the front.
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
        let with = |method, counts: (u32, u32), blur| {
            all.iter().any(|s| s.method == method && (s.directions, s.steps) == counts && s.blur == blur && !s.half_res)
        };
        for counts in [(2, 4), (4, 4), (4, 8), (8, 8), (16, 16)] {
            assert!(with(Method::HbaoView, counts, 9), "{counts:?}");
        }
        for counts in [(4, 2), (4, 4), (4, 8), (8, 8), (16, 8), (16, 16)] {
            assert!(with(Method::Hbao, counts, 0) && with(Method::HbaoView, counts, 0), "{counts:?}");
        }
        for (i, settings) in all.iter().enumerate() {
            settings.validate().unwrap();
            assert!(!all[..i].contains(settings), "{}", settings.to_toml());
        }
        // The texts say that there are some 60.
        assert!((55..65).contains(&all.len()), "{}", all.len());
    }
}
