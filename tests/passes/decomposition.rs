//! The error of a method is decomposed into parts. The parts must add up, and each cause must show in its own part.

use crate::rig;
use crate::rig::{Shot, scenes};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::measure;
use hbao::measure::decomposition::{Decomposition, TruthAt, decompose, decompose_all, subset};
use hbao::measure::errors::Errors;
use hbao::reference::converges;
use hbao::reference::truth::Truth;
use hbao::scene::Camera;
use hbao::settings::{Attenuation, DepthFormat, Edges, Method, NormalFormat, Radius};
use hbao::{Pipeline, Request, Settings};

const SIZE: (u32, u32) = (81, 60);

/// A shot and its ray-traced truth.
struct Judged {
    shot: Shot,
    context: Context,
    truth: Vec<f64>,
    covered: Image<bool>,
    pixels: Vec<usize>,
}

/// Converts a shot of the rig to what `measure` takes.
fn seen<'a>(shot: &'a Shot, camera: &'a Camera, size: (u32, u32)) -> measure::Shot<'a> {
    measure::Shot { mesh: &shot.mesh, camera, size }
}

impl Judged {
    fn new(shot: Shot) -> Judged {
        let camera = shot.camera(SIZE);
        let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
        let settings = Settings { radius: Radius::Units(shot.radius), ..Settings::default() };
        let truth = Truth::new(&shot.mesh, &camera, (width, height), &settings, 64).unwrap();
        let traced = truth.trace(&(0..width * height).collect::<Vec<_>>(), |_| {});
        let covered = Image { width, height, texels: traced.covered };
        let pixels = subset(&covered, usize::MAX);
        let truth = pixels.iter().map(|&i| traced.visibility[i]).collect();
        Judged { shot, context: Context::open(Backend::Egl).unwrap(), truth, covered, pixels }
    }

    fn base(&self) -> Settings {
        Settings { radius: Radius::Units(self.shot.radius), msaa: 1, ..Settings::default() }
    }

    fn apart(&self, settings: &[Settings]) -> Vec<Decomposition> {
        let camera = self.shot.camera(SIZE);
        decompose_all(self.context.gl(), seen(&self.shot, &camera, SIZE), settings, self.truth(), || {}).unwrap()
    }

    fn truth(&self) -> TruthAt<'_> {
        TruthAt { pixels: &self.pixels, visibility: &self.truth }
    }

    /// Returns the ambient occlusion that is shown with these settings.
    fn shown(&self, settings: &Settings) -> Image<f32> {
        let mut pipeline = Pipeline::new(self.context.gl(), SIZE, settings, Request::default()).unwrap();
        pipeline.render(&self.shot.mesh, &self.shot.camera(SIZE)).unwrap();
        pipeline.ao().unwrap()
    }
}

/// The bounds allow for the rounding of float64 in sums over some thousand pixels. Nothing else can differ, because the
/// images are read back once and every part is computed from the same numbers.
#[track_caller]
fn hold_sums(parts: &Decomposition, text: &str) {
    let each = [parts.model, parts.sampling, parts.filtering, parts.quantisation];
    let bias: f64 = each.iter().map(|part| part.bias).sum();
    assert!((bias - parts.total.bias).abs() < 1e-6, "{bias}: {parts:?}\n{text}");
    let squares = each.iter().map(|part| part.rmse.powi(2)).sum::<f64>() + parts.cross;
    assert!((squares - parts.total.rmse.powi(2)).abs() < 1e-9, "{squares}: {parts:?}\n{text}");
    let most: f64 = each.iter().map(|part| part.rmse).sum();
    assert!(parts.total.rmse <= most + 1e-12, "{parts:?}\n{text}");
    for part in each.iter().chain([&parts.total]) {
        assert!(part.bias.abs() <= part.rmse + 1e-12 && part.rmse <= part.max + 1e-12 && part.max <= 1.0, "{parts:?}");
    }
}

#[test]
fn parts_add_up_to_the_error_that_is_measured_otherwise() {
    for shot in [scenes::nave(), scenes::cornell_box()] {
        let judged = Judged::new(shot);
        let base = judged.base();
        let of = |method| Settings { radius: base.radius, msaa: 1, ..Settings::for_method(method) };
        let mut all = vec![
            base.clone(),
            Settings { half_res: true, ..base.clone() },
            Settings { half_res: true, blur: 0, ..base.clone() },
            Settings { msaa: 4, ..base.clone() },
            Settings { msaa: 4, half_res: true, blur: 21, ..base.clone() },
            Settings { depth_format: DepthFormat::R16f, attenuation: Attenuation::Linear, ..base.clone() },
        ];
        let others = Method::ALL.iter().filter(|&&other| converges(other) && other != base.method);
        all.extend(others.map(|&other| of(other)));
        let size = (SIZE.0 as usize, SIZE.1 as usize);
        let truth =
            judged.pixels.iter().zip(&judged.truth).fold(Image::filled(size.0, size.1, 1.0f32), |mut all, (&i, &a)| {
                all.texels[i] = a as f32;
                all
            });
        for (settings, parts) in all.iter().zip(judged.apart(&all)) {
            let text = format!("{}\n{}", judged.shot.name, settings.to_toml());
            hold_sums(&parts, &text);
            assert_eq!(parts.pixels, judged.pixels.len());
            let shown = judged.shown(settings);
            let half = shown.width != size.0;
            let shown = if half { Image::from_fn(size.0, size.1, |x, y| shown.at(x / 2, y / 2)) } else { shown };
            let errors = Errors::of(&shown, &truth, &judged.covered).unwrap();
            // For this comparison the truth was rounded to float32.
            assert!((errors.rmse - parts.total.rmse).abs() < 1e-6, "{errors:?} {parts:?}\n{text}");
            assert!((errors.bias - parts.total.bias).abs() < 1e-6 && (errors.max - parts.total.max).abs() < 1e-6);
            if settings.blur == 0 || !rig::computes(settings.method) {
                assert_eq!(parts.filtering, Default::default(), "{text}");
            }
            if !rig::computes(settings.method) {
                assert_eq!((parts.sampling, parts.model), (Default::default(), parts.total), "A = 1 converges at once");
            }
        }
    }
}

#[test]
fn a_planted_error_shows_in_its_own_part() {
    let judged = Judged::new(scenes::nave());
    // With float formats and many samples, every part of the error is small except the model's.
    let good = Settings { directions: 16, steps: 5, blur: 0, ..rig::float_settings(judged.shot.radius) };
    let planted = [
        good.clone(),
        Settings { strength: 0.2, ..good.clone() },
        Settings { directions: 1, steps: 1, ..good.clone() },
        Settings { blur: 41, blur_depth_sigma: Some(1e6), ..good.clone() },
        Settings { normal_format: NormalFormat::Rgba8Snorm, depth_format: DepthFormat::R16f, ..good.clone() },
        // A step is far below a texel here, so every pixel returns early.
        Settings { steps: 256, ..good.clone() },
        Settings { half_res: true, ..good.clone() },
    ];
    let [good, model, few, blurred, coarse, exits, half] = judged.apart(&planted).try_into().unwrap();
    let same = |a: f64, b: f64| (a - b).abs() < 1e-12;

    // Weaker occlusion counts as another method, so the model's error grows. A fifth of the occlusion has a fifth of
    // the sampling error.
    assert!(
        model.model.bias > good.model.bias + 0.05 && model.model.rmse > 1.5 * good.model.rmse,
        "{model:?} {good:?}"
    );
    assert!((model.sampling.rmse - 0.2 * good.sampling.rmse).abs() < 1e-6, "{model:?} {good:?}");
    for (name, parts) in [("few", few), ("blurred", blurred), ("coarse", coarse), ("exits", exits), ("half", half)] {
        assert_eq!(parts.model, good.model, "{name}");
    }
    assert!(few.sampling.rmse > 1.5 * good.sampling.rmse && few.filtering.rmse == 0.0, "{few:?}");
    assert!(few.quantisation.rmse == 0.0 && same(few.total.bias, few.model.bias + few.sampling.bias));
    assert_eq!(blurred.sampling, good.sampling);
    assert!(blurred.filtering.rmse > 0.05 && blurred.quantisation.rmse == 0.0, "{blurred:?}");
    assert_eq!((coarse.sampling, coarse.filtering), (good.sampling, good.filtering));
    assert!(coarse.quantisation.rmse > 5e-4 && good.quantisation.rmse == 0.0, "{coarse:?}");
    // The early return gives A = 1, so the sampling part undoes all occlusion that the converged method has found.
    let mean = judged.truth.iter().sum::<f64>() / judged.truth.len() as f64;
    assert!(same(exits.model.bias + exits.sampling.bias, 1.0 - mean) && exits.sampling.bias > 0.1, "{exits:?}");
    // At half resolution without a blur, every other pixel shows the value of its neighbour.
    assert!(half.sampling.rmse > 1.2 * good.sampling.rmse && half.filtering.rmse == 0.0, "{half:?}");
}

#[test]
fn rounding_to_8_bits_is_all_that_8_bit_targets_add() {
    let judged = Judged::new(scenes::cornell_box());
    for blur in [0, 9] {
        let settings = Settings { normal_format: NormalFormat::Rgba16f, blur, ..judged.base() };
        let parts = &judged.apart(std::slice::from_ref(&settings))[0];
        // Each pass that writes rounds by up to half a step. The errors are spread evenly, so their RMSE is 1 / (255
        // sqrt 12) for one pass.
        let passes = if blur > 0 { 3.0 } else { 1.0 };
        assert!(parts.quantisation.max <= 0.5 * passes / 255.0 + 1e-4, "{parts:?}");
        assert!(parts.quantisation.rmse <= passes / 255.0 / 12f64.sqrt(), "{parts:?}");
        assert!(parts.quantisation.rmse > 1e-4 && parts.quantisation.bias.abs() < 0.5 / 255.0, "{parts:?}");
    }
}

#[test]
fn settings_that_share_their_limit_are_told_from_those_that_do_not() {
    let judged = Judged::new(scenes::nave());
    let base = judged.base();
    let all = [
        base.clone(),
        Settings { directions: 4, steps: 4, half_res: true, ..base.clone() },
        Settings { strength: 0.7, ..base.clone() },
        Settings { edges: Edges::Off, msaa: 4, ..base.clone() },
        Settings { method: Method::HbaoTalk, ..base.clone() },
    ];
    let together = judged.apart(&all);
    let camera = judged.shot.camera(SIZE);
    let (gl, view) = (judged.context.gl(), seen(&judged.shot, &camera, SIZE));
    for (settings, parts) in all.iter().zip(&together) {
        let alone = decompose(gl, view, settings, judged.truth()).unwrap();
        assert_eq!(*parts, alone, "{}", settings.to_toml());
    }
    assert_eq!(together[0].model, together[1].model);
    for other in &together[2..] {
        assert_ne!(other.model, together[0].model);
    }
    // A subset of 1500 pixels gives nearly the same result, with a standard error of 0.1 / sqrt(1500).
    let some = subset(&judged.covered, 1500);
    let truth: Vec<f64> = some.iter().map(|i| judged.truth[judged.pixels.binary_search(i).unwrap()]).collect();
    let part = decompose(gl, view, &base, TruthAt { pixels: &some, visibility: &truth }).unwrap();
    assert_eq!(part.pixels, 1500);
    let (few, all) = (part, together[0]);
    assert!((few.total.bias - all.total.bias).abs() < 0.008 && (few.model.rmse - all.model.rmse).abs() < 0.008);
}

#[test]
fn what_cannot_be_taken_apart_is_refused_in_one_line() {
    let shot = scenes::box_on_a_floor();
    let context = Context::open(Backend::Egl).unwrap();
    let camera = shot.camera((16, 12));
    let of = |settings: &Settings, pixels: &[usize], visibility: &[f64]| {
        let view = seen(&shot, &camera, (16, 12));
        let error = decompose(context.gl(), view, settings, TruthAt { pixels, visibility }).unwrap_err().to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        error
    };
    let base = Settings { radius: Radius::Units(1.0), msaa: 1, ..Settings::default() };
    assert!(of(&base, &[], &[]).contains("0 pixels of 16x12"));
    assert!(of(&base, &[3], &[1.0, 1.0]).contains("one truth for each: 1 pixels of 16x12 and 2 truths"));
    assert!(of(&base, &[16 * 12], &[1.0]).contains("pixels of the image"));
    for &method in Method::ALL.iter().filter(|&&method| !converges(method)) {
        assert!(of(&Settings { method, ..base.clone() }, &[3], &[1.0]).contains("has no converged form"));
    }
    assert!(of(&Settings { radius: Radius::Percent(5.0), ..base }, &[3], &[1.0]).contains("scene units"));
}
