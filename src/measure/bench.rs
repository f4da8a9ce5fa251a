//! What each part of a frame costs: the cases of the papers of 2008 and of the scaling series, measured in turns.
#![doc = include_str!("tables_of_2008.md")]

use super::published::{COLUMNS, CRYSIS_SIZE, EIGHT, TABLE_BLUR};
use super::{median, sum};
use crate::scene::{Camera, Mesh, View};
use crate::settings::{DepthFormat, Method, NormalFormat, Settings, SsaoDepth, SsaoRotation};
use crate::{AmbientOcclusion, Apply, Error, Pipeline, Request, Timers};
use std::sync::Arc;
use std::time::Instant;

/// The knobs that the cases set themselves, whatever the settings given say. All others are the user's.
pub const FIXED: [&str; 12] = [
    "method",
    "directions",
    "steps",
    "rays",
    "attenuation",
    "snap",
    "blur",
    "msaa",
    "half-res",
    "ssao-samples",
    "ssao-rotation",
    "ssao-depth",
];

/// A mesh that is cut finer has at most so many triangles.
const MOST_TRIANGLES: usize = 1_500_000;

/// The mode of [`scaling`]'s cases.
const SCALING: &str = "scaling";

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// `half`, `msaa1` or `msaa4`: the rows of Table 6.2.1. `figure1`, `crysis`, `scaling`.
    pub mode: &'static str,
    /// What tells it from others of its mode: of the table, its column; of the scaling, its series.
    pub column: &'static str,
    /// With a radius in scene units.
    pub settings: Settings,
    /// The method's own pass is left out: the blur goes over A = 1.
    pub without_ao: bool,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
    /// How many times each triangle is cut in four.
    pub subdivisions: u32,
}

impl Case {
    fn new(mode: &'static str, column: &'static str, settings: Settings, size: (u32, u32)) -> Case {
        Case { mode, column, settings, without_ao: false, size, subdivisions: 0 }
    }

    /// The method that draws: `none` where A = 1.
    pub fn method(&self) -> Method {
        if self.without_ao { Method::None } else { self.settings.method }
    }

    /// Directions, rays in each and steps on each ray about a pixel; of `ssao` the samples, as the steps of one ray.
    pub fn samples(&self) -> [u32; 3] {
        let Settings { directions, rays, steps, ssao_samples, .. } = self.settings;
        match self.method() {
            Method::None => [0, 0, 0],
            Method::Ssao => [1, 1, ssao_samples],
            Method::RayMarch => [directions, rays, steps],
            _ => [directions, 1, steps],
        }
    }

    /// How many times a pixel of ambient occlusion fetches depth, if it does not leave early.
    pub fn fetches(&self) -> u32 {
        self.samples().iter().product()
    }

    /// The blur's width in texels; 0 where there is none.
    pub fn blur(&self) -> u32 {
        match self.settings.method {
            Method::None => 0,
            // Its own.
            Method::Ssao => self.settings.blur.min(4),
            _ => self.settings.blur,
        }
    }

    fn pixels(&self) -> f64 {
        f64::from(self.size.0) * f64::from(self.size.1)
    }

    /// The texels of ambient occlusion before the blur.
    fn texels(&self) -> f64 {
        let side = |side: u32| f64::from(side.div_ceil(self.settings.ao_scale()));
        side(self.size.0) * side(self.size.1)
    }
}

/// The method's own settings at one sample a pixel, and all that is not [`FIXED`] as `base` has it.
fn of(base: &Settings, method: Method) -> Settings {
    let Settings { directions, steps, rays, attenuation, snap, ssao_samples, ssao_rotation, ssao_depth, .. } =
        Settings::for_method(method);
    let own = Settings { method, directions, steps, rays, attenuation, snap, msaa: 1, half_res: false, ..base.clone() };
    Settings { ssao_samples, ssao_rotation, ssao_depth, blur: TABLE_BLUR, ..own }
}

/// Table 6.2.1: whole frames, `hbao` with samples and without, at half resolution and with 1 and 4 depth samples a
/// pixel.
pub fn table(base: &Settings, size: (u32, u32)) -> Vec<Case> {
    let hbao = of(base, Method::Hbao);
    let mut cases = Vec::new();
    for (mode, half_res, msaa) in [("half", true, 1), ("msaa1", false, 1), ("msaa4", false, 4)] {
        let row = Settings { half_res, msaa, ..hbao.clone() };
        let case = |column: usize, settings| Case::new(mode, COLUMNS[column], settings, size);
        cases.push(case(0, Settings { method: Method::None, blur: 0, ..row.clone() }));
        cases.push(Case { without_ao: true, ..case(1, row.clone()) });
        for (column, samples) in [(2, 4), (EIGHT, 8), (4, 16)] {
            cases.push(case(column, Settings { directions: samples, steps: samples, ..row.clone() }));
        }
    }
    cases
}

/// Figure 1 of the talk, ambient occlusion without a blur: its method and ray marching, and all others beside them.
pub fn figure1(base: &Settings, size: (u32, u32)) -> Vec<Case> {
    use Method::{Crease, Hbao, HbaoTalk, Microsphere, RayMarch, Ssao};
    let all = [HbaoTalk, RayMarch, Hbao, Microsphere, Crease, Ssao];
    let alone = |method| Settings { blur: 0, ..of(base, method) };
    all.map(|method| Case::new("figure1", method.name(), alone(method), size)).into()
}

/// ShaderX7 6.1: Crysis' 16 samples with their blur, and the two ways in which it says that they become faster.
pub fn crysis(base: &Settings) -> Vec<Case> {
    let ssao = of(base, Method::Ssao);
    let case = |column, settings| Case::new("crysis", column, settings, CRYSIS_SIZE);
    vec![
        case("full depth", ssao.clone()),
        case("half-size depth", Settings { ssao_depth: SsaoDepth::Half, ..ssao.clone() }),
        case("mirror", Settings { ssao_rotation: SsaoRotation::Mirror, ..ssao }),
    ]
}

/// Three series of `hbao`, by their column: `pixels`, an image of a sixteenth to four times as many as `size` has;
/// `samples`, 16 to 1024 a pixel; `triangles`, the same surface of ever more, from the mesh's own number of `triangles`
/// on. The latter two at half the width and height.
pub fn scaling(base: &Settings, size: (u32, u32), triangles: usize) -> Vec<Case> {
    let hbao = of(base, Method::Hbao);
    let by = |factor: f64| {
        let side = |side: u32| (f64::from(side) * factor).round().max(1.0) as u32;
        (side(size.0), side(size.1))
    };
    let pixels = (-4..=2).map(|i| Case::new(SCALING, "pixels", hbao.clone(), by(2f64.powf(f64::from(i) / 2.0))));
    let samples = [(4, 4), (8, 4), (8, 8), (16, 8), (16, 16), (32, 16), (64, 16)].map(|(directions, steps)| {
        Case::new(SCALING, "samples", Settings { directions, steps, ..hbao.clone() }, by(0.5))
    });
    let mut cases: Vec<Case> = pixels.chain(samples).collect();
    let (mut subdivisions, mut count) = (0, triangles);
    while subdivisions == 0 || count <= MOST_TRIANGLES {
        cases.push(Case { subdivisions, ..Case::new(SCALING, "triangles", hbao.clone(), by(0.5)) });
        (subdivisions, count) = (subdivisions + 1, count.saturating_mul(4));
    }
    cases
}

/// What was measured of a case: milliseconds run by run, by the driver's timer where it has one, else on the wall from
/// a finished queue to a finished queue. What there is no pass for takes 0.
#[derive(Clone, Debug)]
pub struct Row {
    /// Of what.
    pub case: Case,
    /// Depth samples a pixel, as the driver gave them.
    pub samples: u32,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Every pass of a frame.
    pub frame_ms: Vec<f64>,
    /// The G-buffer and its resolve.
    pub gbuffer_ms: Vec<f64>,
    /// The AO pass; where it reads depth at half size, with what makes that.
    pub ao_ms: Vec<f64>,
    /// The same with a sum in place of the arithmetic after each fetch ([`AmbientOcclusion::fetch_floor`]), measured
    /// right after it. None without an AO pass.
    pub floor_ms: Vec<f64>,
    /// The blur's passes together.
    pub blur_ms: Vec<f64>,
    /// What the first frame took longer on the wall than the others: compiling its shaders, and allocating.
    pub compile_ms: f64,
    /// What the driver could not do as asked, and what was done in its place: one line each.
    pub notices: Vec<String>,
}

impl Row {
    /// Frames per second: the median's.
    pub fn fps(&self) -> f64 {
        1e3 / median(&self.frame_ms)
    }

    /// The image's megapixels over the AO pass's time; NaN without one.
    pub fn mpixels_per_s(&self) -> f64 {
        if self.case.fetches() == 0 { f64::NAN } else { self.case.pixels() / median(&self.ao_ms) / 1e3 }
    }

    /// AO's time over its floor's, the median over the pairs; NaN without an AO pass.
    pub fn ao_to_floor(&self) -> f64 {
        median(&self.ao_ms.iter().zip(&self.floor_ms).map(|(ao, floor)| ao / floor).collect::<Vec<_>>())
    }

    /// Of these times, the median in nanoseconds for each sample, as if no texel left early: where the radius is small
    /// on the screen, many do, and fetch nothing. NaN without samples.
    pub fn ns_per_sample(&self, times: &[f64]) -> f64 {
        match self.case.fetches() {
            0 => f64::NAN,
            fetches => median(times) * 1e6 / (self.case.texels() * f64::from(fetches)),
        }
    }

    /// How far along its series a case of [`scaling`] is: its pixels, its samples a pixel, or its triangles.
    pub fn along(&self) -> f64 {
        match self.case.column {
            "samples" => f64::from(self.case.fetches()),
            "triangles" => self.triangles as f64,
            _ => self.case.pixels(),
        }
    }
}

/// Measures cases in `runs` rounds through all of them, so that what slows the machine down for a while falls on all
/// alike, after a first round that compiles the shaders and is not counted. `progress` is called after each frame.
/// Everything that the cases need is held at once, with one G-buffer for all that agree on it.
///
/// # Errors
/// What the driver refuses, or the camera.
pub fn measure(
    gl: &Arc<glow::Context>,
    (mesh, view): (&Mesh, &View),
    cases: &[Case],
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Row>, Error> {
    let mut finer: Vec<Mesh> = Vec::new();
    for _ in 0..cases.iter().map(|case| case.subdivisions).max().unwrap_or(0) {
        finer.push(finer.last().unwrap_or(mesh).subdivided());
    }
    let mut timers = Timers::new(gl, true)?;
    let mut gbuffers: Vec<(Key, Pipeline)> = Vec::new();
    let mut all = Vec::new();
    for case in cases {
        let (camera, _) = view.camera(mesh, case.size.0, case.size.1)?;
        let mesh = case.subdivisions.checked_sub(1).map_or(mesh, |level| &finer[level as usize]);
        let known = gbuffers.iter().position(|(key, _)| *key == Key::of(case));
        let gbuffer = match known {
            Some(known) => &gbuffers[known].1,
            None => {
                let request = Request { gbuffer_only: true, ..Request::default() };
                let mut pipeline = Pipeline::new(gl, case.size, &case.settings, request)?;
                // Once, so that the driver has made its memory ready before anything is timed.
                pipeline.render(mesh, &camera)?;
                gbuffers.push((Key::of(case), pipeline));
                &gbuffers[gbuffers.len() - 1].1
            }
        };
        let request =
            Request { composite: Some(Apply::All), without_ao: case.without_ao, timings: true, ..Request::default() };
        let start = Instant::now();
        let pipeline = gbuffer.beside(&case.settings, request)?;
        let made_ms = milliseconds(start);
        let floor = match case.method() {
            Method::None => None,
            _ => Some(AmbientOcclusion::fetch_floor(gl.clone(), case.size, &case.settings)?),
        };
        let row = Row {
            case: case.clone(),
            samples: pipeline.samples(),
            triangles: mesh.triangles.len(),
            frame_ms: Vec::new(),
            gbuffer_ms: Vec::new(),
            ao_ms: Vec::new(),
            floor_ms: Vec::new(),
            blur_ms: Vec::new(),
            compile_ms: 0.0,
            notices: pipeline.notices().to_vec(),
        };
        all.push(Running { mesh, camera, pipeline, floor, wall_ms: vec![made_ms], row });
    }
    for run in 0..=runs {
        for running in &mut all {
            running.run(&mut timers, run > 0)?;
            progress();
        }
    }
    Ok(all.into_iter().map(Running::finish).collect())
}

/// What the cases that share a G-buffer agree on.
#[derive(PartialEq)]
struct Key((u32, u32), u32, NormalFormat, DepthFormat);

impl Key {
    fn of(case: &Case) -> Key {
        let Settings { msaa, normal_format, depth_format, .. } = case.settings;
        Key(case.size, msaa, normal_format, depth_format)
    }
}

/// A case under way.
struct Running<'a> {
    mesh: &'a Mesh,
    camera: Camera,
    pipeline: Pipeline,
    floor: Option<AmbientOcclusion>,
    /// How long the pipeline took to make, then each frame.
    wall_ms: Vec<f64>,
    row: Row,
}

impl Running<'_> {
    /// A frame and its floor.
    fn run(&mut self, timers: &mut Timers, counted: bool) -> Result<(), Error> {
        let start = Instant::now();
        let frame = self.pipeline.render(self.mesh, &self.camera)?;
        self.wall_ms.push(milliseconds(start));
        let ao = |name: &str| matches!(name, "half_depth" | "ao");
        if let Some(floor) = &mut self.floor {
            floor.render_timed(&self.pipeline.inputs(&self.camera), timers)?;
            let floor = timers.take();
            if counted {
                self.row.floor_ms.push(sum(&floor, ao));
            }
        }
        if counted {
            self.row.frame_ms.push(sum(&frame, |_| true));
            self.row.gbuffer_ms.push(sum(&frame, |name| matches!(name, "gbuffer" | "resolve")));
            self.row.ao_ms.push(sum(&frame, ao));
            self.row.blur_ms.push(sum(&frame, |name| name.starts_with("blur")));
        }
        Ok(())
    }

    fn finish(self) -> Row {
        let compile_ms = match self.wall_ms.as_slice() {
            [made, first, others @ ..] => (made + first - median(others)).max(0.0),
            _ => f64::NAN,
        };
        Row { compile_ms, ..self.row }
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The power of x with which y grows, fitted by least squares to their logarithms. None where x does not vary, or
/// something is not above 0.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    if points.iter().all(|point| point.0 == points[0].0) {
        return None;
    }
    let logs: Vec<_> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = logs.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let both: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = logs.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum();
    Some(both / square).filter(|slope| slope.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{KNOBS, Kind, Radius};

    const SIZE: (u32, u32) = (1600, 1200);

    fn all(base: &Settings) -> Vec<Case> {
        [table(base, SIZE), figure1(base, SIZE), crysis(base), scaling(base, SIZE, 20_000)].concat()
    }

    #[test]
    fn the_exponent_is_the_slope_in_logarithms() {
        let power = |p: f64| [0.5, 1.0, 7.0, 30.0].map(|x: f64| (x, 3.0 * x.powf(p)));
        for p in [-1.0, 0.0, 0.5, 1.0, 2.0] {
            assert!((exponent(&power(p)).unwrap() - p).abs() < 1e-12);
        }
        // Between two lines through the points it is the mean.
        let scattered = [(1.0, 2.0), (1.0, 0.5), (4.0, 8.0), (4.0, 2.0)];
        assert!((exponent(&scattered).unwrap() - 1.0).abs() < 1e-12);
        for none in
            [&[][..], &[(2.0, 3.0)], &[(0.1, 1.0); 7], &[(1.0, 0.0), (2.0, 1.0)], &[(1.0, f64::NAN), (2.0, 1.0)]]
        {
            assert_eq!(exponent(none), None, "{none:?}");
        }
    }

    #[test]
    fn a_knob_matters_unless_the_cases_set_it() {
        let base = Settings { radius: Radius::Units(1.0), ..Settings::default() };
        for knob in KNOBS {
            let other = match knob.kind {
                Kind::Count(min, _) => min.to_string(),
                Kind::OddOrZero(_, max) => max.to_string(),
                Kind::Degrees(..) | Kind::Positive | Kind::Length => "2.5".into(),
                Kind::OneOf(values) => values[values.len() - 1].to_string(),
                Kind::Switch => "true".into(),
                Kind::Word(words) => words.iter().find(|word| **word != knob.text(&base)).unwrap().to_string(),
            };
            let mut changed = base.clone();
            knob.set(&mut changed, &other).unwrap();
            assert_eq!(all(&changed) == all(&base), FIXED.contains(&knob.name), "{}", knob.name);
        }
    }

    #[test]
    fn no_case_is_measured_twice_and_all_are_valid() {
        let cases = all(&Settings { radius: Radius::Units(1.0), ..Settings::default() });
        for (i, case) in cases.iter().enumerate() {
            case.settings.validate().unwrap();
            assert!(!cases[..i].contains(case), "{case:?}");
        }
        let series = |name: &str| cases.iter().filter(|case| case.column == name).cloned().collect::<Vec<_>>();
        let pixels: Vec<f64> = series("pixels").iter().map(Case::pixels).collect();
        assert!(pixels[0] <= 0.12e6 && pixels[pixels.len() - 1] >= 7.6e6, "{pixels:?}");
        assert_eq!(series("samples").iter().map(Case::fetches).collect::<Vec<_>>(), [16, 32, 64, 128, 256, 512, 1024]);
        assert_eq!(series("triangles").iter().map(|case| case.subdivisions).collect::<Vec<_>>(), [0, 1, 2, 3]);
        // A mesh that has more already is measured as it is.
        let many = scaling(&Settings::default(), SIZE, 10_000_000);
        assert_eq!(many.iter().filter(|case| case.column == "triangles").count(), 1);
    }

    #[test]
    fn the_ratio_to_the_floor_is_taken_pair_by_pair() {
        let case = figure1(&Settings::default(), SIZE).remove(0);
        let (ao_ms, floor_ms) = (vec![2.0, 30.0, 8.0], vec![1.0, 10.0, 2.0]);
        let none = Vec::new;
        let row = Row {
            case,
            samples: 1,
            triangles: 1,
            frame_ms: none(),
            gbuffer_ms: none(),
            ao_ms,
            floor_ms,
            blur_ms: none(),
            compile_ms: 0.0,
            notices: Vec::new(),
        };
        assert_eq!(row.ao_to_floor(), 3.0);
        assert_eq!(row.mpixels_per_s(), 1.92 / 8.0 * 1e3);
        assert_eq!(row.ns_per_sample(&row.floor_ms), 2e6 / (1.92e6 * 64.0));
    }
}
