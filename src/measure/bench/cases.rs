//! The cases that are measured: those of the papers of 2008, and the series that show how costs scale.

use crate::measure::counts::{blur_width, directions_rays_steps};
use crate::measure::published::{COLUMNS, CRYSIS_SIZE, EIGHT, FIGURE_1, TABLE_BLUR};
use crate::settings::{Method, Settings, SsaoDepth, SsaoRotation};

/// The names of the settings that the cases set themselves, whatever the user asks for. All other settings are taken
/// from the user.
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

/// The most triangles that a mesh may have after its triangles were cut into smaller ones.
const MOST_TRIANGLES: usize = 1_500_000;

/// The mode of [`scaling`]'s cases.
const SCALING: &str = "scaling";

/// One case to be measured: what is rendered, and with which settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The measurement that the case belongs to: `half`, `msaa1` and `msaa4` are the rows of Table 6.2.1; the others
    /// are `figure1`, `crysis` and `scaling`.
    pub mode: &'static str,
    /// The name that distinguishes the case from the others of its mode: a column of Table 6.2.1, a method, or a series
    /// of the scaling.
    pub column: &'static str,
    /// The settings, with a radius in scene units.
    pub settings: Settings,
    /// True if the method's own pass is left out, so that the blur runs on visibility 1 everywhere.
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

    /// Returns the method whose pass is drawn, or `none` if the method's own pass is left out.
    pub fn method(&self) -> Method {
        if self.without_ao { Method::None } else { self.settings.method }
    }

    /// Returns the number of directions around a pixel, of rays in each direction, and of steps on each ray, as
    /// [`directions_rays_steps`] counts them.
    pub fn samples(&self) -> [u32; 3] {
        directions_rays_steps(self.method(), &self.settings)
    }

    /// Returns how many times the AO pass fetches depth for a pixel; 0 without an AO pass. A method that exits early
    /// fetches nothing at pixels where a step is shorter than a texel; these do not count.
    pub fn fetches(&self) -> u32 {
        self.method().samples(&self.settings)
    }

    /// Returns the width of the blur in texels, or 0 if there is no blur.
    pub fn blur(&self) -> u32 {
        blur_width(&self.settings)
    }

    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.size.0) * f64::from(self.size.1)
    }

    /// Returns the number of texels of ambient occlusion before the blur.
    pub(super) fn texels(&self) -> f64 {
        let side = |side: u32| f64::from(side.div_ceil(self.settings.ao_scale()));
        side(self.size.0) * side(self.size.1)
    }
}

/// Returns the default settings of the method, with one depth sample per pixel. Every setting that is not in [`FIXED`]
/// is taken from `base`.
fn of(base: &Settings, method: Method) -> Settings {
    let Settings { directions, steps, rays, attenuation, snap, ssao_samples, ssao_rotation, ssao_depth, .. } =
        Settings::for_method(method);
    let exit = base.exit_for(method);
    let own =
        Settings { method, exit, directions, steps, rays, attenuation, snap, msaa: 1, half_res: false, ..base.clone() };
    Settings { ssao_samples, ssao_rotation, ssao_depth, blur: TABLE_BLUR, ..own }
}

/// Returns the cases of Table 6.2.1: whole frames of `hbao`, with and without its AO pass, at half resolution, and at
/// full resolution with 1 and 4 depth samples per pixel.
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

/// Returns the cases of Figure 1 of the talk, which are ambient occlusion without a blur: the talk's method and ray
/// marching, and all other methods for comparison.
pub fn figure1(base: &Settings, size: (u32, u32)) -> Vec<Case> {
    let of_the_talk = FIGURE_1.map(|(method, _)| method);
    let others = Method::ALL.iter().filter(|method| method.computes() && !of_the_talk.contains(method));
    let alone = |method| Settings { blur: 0, ..of(base, method) };
    let all = of_the_talk.iter().chain(others);
    all.map(|&method| Case::new("figure1", method.name(), alone(method), size)).collect()
}

/// Returns the cases of ShaderX7 6.1: the 16 samples of Crysis with their blur, and the two ways in which the paper
/// makes them faster.
pub fn crysis(base: &Settings) -> Vec<Case> {
    let ssao = of(base, Method::Ssao);
    let case = |column, settings| Case::new("crysis", column, settings, CRYSIS_SIZE);
    vec![
        case("full depth", ssao.clone()),
        case("half-size depth", Settings { ssao_depth: SsaoDepth::Half, ..ssao.clone() }),
        case("mirror", Settings { ssao_rotation: SsaoRotation::Mirror, ..ssao }),
    ]
}

/// Returns three series of cases of `hbao`, named by their column. In `pixels` the image has a sixteenth to four times
/// the pixels of `size`. In `samples` the method takes 16 to 1024 samples per pixel. In `triangles` the same surface
/// consists of more and more triangles, beginning with `triangles`, the number in the mesh. The series `samples` and
/// `triangles` have half the width and height.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{KNOBS, Kind, Radius};

    const SIZE: (u32, u32) = (1600, 1200);

    fn all(base: &Settings) -> Vec<Case> {
        [table(base, SIZE), figure1(base, SIZE), crysis(base), scaling(base, SIZE, 20_000)].concat()
    }

    #[test]
    fn a_knob_matters_unless_the_cases_set_it() {
        let base = Settings { radius: Radius::Units(1.0), ..Settings::default() };
        for knob in KNOBS {
            let other = match knob.kind {
                Kind::Count(min, _) => min.to_string(),
                Kind::OddOrZero(_, max) => max.to_string(),
                Kind::Degrees(..) | Kind::Number(..) | Kind::Positive | Kind::Length => "2.5".into(),
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
        // A mesh that already has more triangles is measured as it is.
        let many = scaling(&Settings::default(), SIZE, 10_000_000);
        assert_eq!(many.iter().filter(|case| case.column == "triangles").count(), 1);
    }
}
