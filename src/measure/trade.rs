//! Error against time over a sweep of settings: what accuracy costs, and which settings nobody should use.
#![doc = include_str!("accuracy.md")]

use super::errors::{Comparison, Errors};
use super::sum;
use crate::ambient_occlusion::Inputs;
use crate::image::Image;
use crate::scene::{Camera, Mesh};
use crate::settings::{AoFormat, BlurKernel, DepthFormat, Method, NormalFormat, Settings};
use crate::{AmbientOcclusion, Error, Pipeline, Request, Timers};
use std::sync::Arc;

/// One point of the trade.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was measured, with the radius of all.
    pub settings: Settings,
    /// Ambient occlusion and its blur together, the median over the runs: by the driver's timer, else on the wall.
    pub ms: f64,
    /// Against the truth.
    pub errors: Errors,
    /// The same over the edge pixels alone, as [`edges`] tells them; none where there is no edge pixel.
    pub edge_errors: Option<Errors>,
    /// True where no row is better in both time and RMSE.
    pub pareto: bool,
}

/// A method's own settings with what a sweep takes from `base`.
fn of_method(base: &Settings, method: Method) -> Settings {
    Settings {
        radius: base.radius,
        attenuation: base.attenuation,
        strength: base.strength,
        msaa: 1,
        ..Settings::for_method(method)
    }
}

/// Those of a sweep whose error is taken apart: the chapter's 4 x 4, 8 x 8 and 16 x 16, at full and half resolution.
pub fn chapter(base: &Settings) -> Vec<Settings> {
    let of = |n: u32, half_res| Settings { directions: n, steps: n, half_res, ..of_method(base, Method::Hbao) };
    [false, true].into_iter().flat_map(|half_res| [4, 8, 16].map(|n| of(n, half_res))).collect()
}

/// The settings of a sweep: every method, the samples of Table 6.2.1 among others, half resolution, blurs and formats,
/// with the radius of `base`, its strength, and its attenuation for all that read one. One depth sample a pixel: the
/// truth is that of the pixels' centres.
pub fn sweep(base: &Settings) -> Vec<Settings> {
    let of = |method: Method| of_method(base, method);
    let with = |settings: Settings, directions: u32, steps: u32| Settings { directions, steps, ..settings };
    let mut all = Vec::new();
    for (directions, steps) in [(2, 4), (4, 4), (4, 8), (6, 6), (8, 8), (16, 8), (16, 16), (32, 16)] {
        for (blur, half_res) in [(9, false), (9, true), (21, false)] {
            all.push(Settings { blur, half_res, ..with(of(Method::Hbao), directions, steps) });
        }
    }
    for (directions, steps) in [(4, 4), (8, 8), (16, 16)] {
        all.push(Settings { blur: 0, ..with(of(Method::Hbao), directions, steps) });
        all.push(with(of(Method::HbaoTalk), directions, steps));
        all.push(with(of(Method::Microsphere), directions, steps));
        all.push(with(of(Method::Crease), directions, steps));
    }
    for (directions, rays, steps) in [(4, 2, 4), (8, 4, 8), (16, 4, 16)] {
        all.push(Settings { rays, ..with(of(Method::RayMarch), directions, steps) });
    }
    for ssao_samples in [8, 16, 24] {
        all.push(Settings { ssao_samples, ..of(Method::Ssao) });
    }
    let chapter = || with(of(Method::Hbao), 8, 8);
    all.push(Settings { blur_kernel: BlurKernel::Full, ..chapter() });
    all.push(Settings { ao_format: AoFormat::R32f, ..chapter() });
    all.push(Settings { normal_format: NormalFormat::Rgba16f, ..chapter() });
    all.push(Settings { depth_format: DepthFormat::R16f, ..chapter() });
    all.push(of(Method::None));
    all
}

/// The depth samples a pixel by which edges are told: those of a usual multisample G-buffer, and all that llvmpipe has.
const EDGE_SAMPLES: u32 = 4;

/// The pixels that hold more than one surface: those whose 4 depth samples span more than the settings' depth sigma, or
/// mix surface and background. Whatever [`Settings::msaa`] says, so that images of one sample a pixel can be judged
/// there too; none where the driver has no multisample textures.
///
/// # Errors
/// What the driver refuses.
pub fn edges(
    gl: &Arc<glow::Context>,
    (mesh, camera): (&Mesh, &Camera),
    size: (u32, u32),
    settings: &Settings,
) -> Result<Image<bool>, Error> {
    let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, size, &Settings { msaa: EDGE_SAMPLES, ..settings.clone() }, request)?;
    pipeline.render(mesh, camera)?;
    let none = || Image::filled(size.0 as usize, size.1 as usize, false);
    Ok(pipeline.edges().cloned().unwrap_or_else(none))
}

/// Measures each of `settings` on a view, in `runs` interleaved rounds after one that compiles the shaders and is not
/// counted. `truth` is compared with where `covered` is true, and on edge pixels apart: for all rows the same, by the
/// depth sigma of the first of `settings`. `progress` is called after each rendering.
///
/// # Errors
/// What the driver refuses, or images of another size.
pub fn measure(
    gl: &Arc<glow::Context>,
    (mesh, camera): (&Mesh, &Camera),
    (truth, covered): (&Image<f32>, &Image<bool>),
    settings: &[Settings],
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Row>, Error> {
    let size = (truth.width as u32, truth.height as u32);
    let mut gbuffers = GBuffers::new(gl, (mesh, camera), size);
    let mut timers = Timers::new(gl, true)?;
    let mut passes = Vec::new();
    for each in settings {
        passes.push((AmbientOcclusion::new(gl.clone(), size, each)?, gbuffers.inputs(each)?));
    }
    let times = interleaved(&mut passes, &mut timers, runs, progress)?;
    let mut on_edges = covered.map(|_| false);
    if let Some(first) = settings.first() {
        let edges = edges(gl, (mesh, camera), size, first)?;
        on_edges = Image::from_fn(covered.width, covered.height, |x, y| edges.at(x, y) && covered.at(x, y));
    }
    let mut rows = Vec::new();
    for ((each, (ao, _)), times) in settings.iter().zip(&passes).zip(&times) {
        let comparison = Comparison::new(&ao.image()?, truth)?;
        let errors = comparison.over(covered)?.ok_or_else(Errors::of_nothing)?;
        let edge_errors = comparison.over(&on_edges)?;
        rows.push(Row { settings: each.clone(), ms: super::median(times), errors, edge_errors, pareto: false });
    }
    let points: Vec<_> = rows.iter().map(|row| (row.ms, row.errors.rmse)).collect();
    rows.iter_mut().zip(pareto(&points)).for_each(|(row, pareto)| row.pareto = pareto);
    Ok(rows)
}

/// Times passes in `runs` interleaved rounds after one that compiles the shaders and is not counted: milliseconds of
/// each, run by run. `progress` is called after each rendering.
pub(super) fn interleaved(
    passes: &mut [(AmbientOcclusion, Inputs)],
    timers: &mut Timers,
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Vec<f64>>, Error> {
    let mut times = vec![Vec::new(); passes.len()];
    for run in 0..=runs {
        for ((ao, inputs), times) in passes.iter_mut().zip(&mut times) {
            let ms = timed(ao, inputs, timers)?;
            if run > 0 {
                times.push(ms);
            }
            progress();
        }
    }
    Ok(times)
}

/// One rendering, and the milliseconds of ambient occlusion and its blur.
pub(super) fn timed(ao: &mut AmbientOcclusion, inputs: &Inputs, timers: &mut Timers) -> Result<f64, Error> {
    ao.render_timed(inputs, timers)?;
    Ok(sum(&timers.take(), |name| matches!(name, "half_depth" | "ao") || name.starts_with("blur")))
}

/// The G-buffers of one view: one for all settings of the same formats, rendered when it is first asked for.
pub(super) struct GBuffers<'a> {
    gl: Arc<glow::Context>,
    view: (&'a Mesh, &'a Camera),
    size: (u32, u32),
    made: Vec<((NormalFormat, DepthFormat), Pipeline)>,
}

impl<'a> GBuffers<'a> {
    pub(super) fn new(gl: &Arc<glow::Context>, view: (&'a Mesh, &'a Camera), size: (u32, u32)) -> GBuffers<'a> {
        GBuffers { gl: gl.clone(), view, size, made: Vec::new() }
    }

    /// The pipeline that holds the G-buffer of these settings, which differ from those asked with before in formats and
    /// in what comes after the G-buffer alone.
    pub(super) fn of(&mut self, settings: &Settings) -> Result<&Pipeline, Error> {
        let formats = (settings.normal_format, settings.depth_format);
        let found = self.made.iter().position(|(known, _)| *known == formats);
        let i = match found {
            Some(i) => i,
            None => {
                let request = Request { gbuffer_only: true, ..Request::default() };
                let mut pipeline = Pipeline::new(&self.gl, self.size, settings, request)?;
                pipeline.render(self.view.0, self.view.1)?;
                self.made.push((formats, pipeline));
                self.made.len() - 1
            }
        };
        Ok(&self.made[i].1)
    }

    /// What ambient occlusion with these settings is computed from.
    pub(super) fn inputs(&mut self, settings: &Settings) -> Result<Inputs, Error> {
        let camera = self.view.1;
        Ok(self.of(settings)?.inputs(camera))
    }
}

/// Which of (time, error) nobody beats in both.
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
        // Of two with one error the slower is not beaten in both.
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
