//! The accuracy of `hbao-view` against the chapter's method, on the 20 views of `tests/accuracy/cases.csv`: five scenes
//! of the folder `../shared/models`, two views and two radii each, 480x360. If the folder is not there, the tests
//! report that and pass. The truth is traced with 512 rays a pixel, at 1,500 random pixels of each view.
//!
//! `HBAO_ACCURACY_PIXELS=5000 cargo test --test accuracy -- --nocapture --test-threads 1` takes more pixels, and `all`
//! every pixel; both print the tables of `src/reference/hbao_view.md`.

use glam::DVec3;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::measure::decomposition::subset;
use hbao::measure::errors::{Comparison, Errors};
use hbao::reference::truth::Truth;
use hbao::scene::{Lens, Scene, View};
use hbao::settings::{Exit, Method, Quadrature, Radius, Zenith};
use hbao::{Pipeline, Request, Settings};
use std::io::Write as _;
use std::path::{Path, PathBuf};

const SIZE: (u32, u32) = (480, 360);
const RAYS: u32 = 512;

/// One line of the table of cases.
struct Case {
    scene: String,
    eye: DVec3,
    target: DVec3,
    fov_y: f64,
    radius: f64,
}

fn cases() -> Vec<Case> {
    let vector = |text: &str| {
        let numbers: Vec<f64> = text.split(' ').map(|number| number.parse().unwrap()).collect();
        DVec3::from_slice(&numbers)
    };
    let case = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [scene, eye, target, fov_y, radius] = fields[..] else { panic!("{line}") };
        Case {
            scene: scene.into(),
            eye: vector(eye),
            target: vector(target),
            fov_y: fov_y.parse::<f64>().unwrap().to_radians(),
            radius: radius.parse().unwrap(),
        }
    };
    include_str!("accuracy/cases.csv").lines().skip(1).map(case).collect()
}

/// The folder of the models; `None`, with a line that says so, if it is not there.
fn models() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models");
    if !folder.exists() {
        // The harness would capture what `eprintln!` writes, and nobody would see it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

/// What is rendered of each case.
#[derive(Clone)]
struct Variant {
    name: String,
    settings: Settings,
    /// The depth sigma of the blur as a share of R, if it is not the method's.
    sigma: Option<f64>,
}

fn variant(method: Method, counts: [u32; 2], change: impl Fn(&mut Settings)) -> Variant {
    let [directions, steps] = counts;
    let mut settings = Settings { directions, steps, blur: 0, msaa: 1, ..Settings::for_method(method) };
    change(&mut settings);
    Variant { name: format!("{} {directions}x{steps}", method.name()), settings, sigma: None }
}

fn named(name: &str, mut variant: Variant) -> Variant {
    variant.name = format!("{}, {name}", variant.name);
    variant
}

/// The errors of every variant in every case, as `errors[case][variant]`. `None` if the models are not there.
fn measure(variants: &[Variant], lens: impl Fn(&Case) -> Lens) -> Option<Vec<Vec<Errors>>> {
    let folder = models()?;
    let context = Context::open(Backend::Egl).unwrap();
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    let mut open: Option<(String, Scene)> = None;
    let mut errors_of = |case: &Case| {
        if open.as_ref().is_none_or(|(name, _)| *name != case.scene) {
            open = Some((case.scene.clone(), Scene::open(folder.join(&case.scene).to_str().unwrap()).unwrap()));
        }
        let mesh = &open.as_ref().unwrap().1.mesh;
        let view = View { eye: Some(case.eye), target: Some(case.target), lens: Some(lens(case)), ..View::default() };
        let (camera, _) = view.camera(mesh, SIZE.0, SIZE.1).unwrap();
        let images: Vec<Image<f32>> = variants
            .iter()
            .map(|variant| {
                let mut settings = Settings { radius: Radius::Units(case.radius), ..variant.settings.clone() };
                settings.blur_depth_sigma = variant.sigma.map(|share| share * case.radius);
                let request = Request { raw: true, ..Request::default() };
                let mut pipeline = Pipeline::new(context.gl(), SIZE, &settings, request).unwrap();
                pipeline.render(mesh, &camera).unwrap();
                pipeline.ao().unwrap()
            })
            .collect();
        let settings = Settings { radius: Radius::Units(case.radius), msaa: 1, ..Settings::default() };
        let mut pipeline =
            Pipeline::new(context.gl(), SIZE, &settings, Request { gbuffer_only: true, ..Request::default() }).unwrap();
        pipeline.render(mesh, &camera).unwrap();
        let covered = pipeline.depth().unwrap().map(f32::is_finite);
        let count = match std::env::var("HBAO_ACCURACY_PIXELS").as_deref() {
            Ok("all") => width * height,
            Ok(count) => count.parse().unwrap(),
            Err(_) => 1500,
        };
        let pixels = subset(&covered, count);
        let traced = Truth::new(mesh, &camera, (width, height), &settings, RAYS).unwrap().trace(&pixels, |_| ());
        let mut truth = Image::filled(width, height, 1.0);
        let mut mask = Image::filled(width, height, false);
        for (&pixel, &visibility) in pixels.iter().zip(&traced.visibility) {
            truth.texels[pixel] = visibility as f32;
            mask.texels[pixel] = true;
        }
        let errors = |image| Comparison::without_flip(image, &truth).unwrap().over(&mask).unwrap().unwrap();
        images.iter().map(errors).collect()
    };
    Some(cases().iter().map(&mut errors_of).collect())
}

/// The error of one variant relative to that of the first, in every case.
fn ratios(errors: &[Vec<Errors>], variant: usize, of: impl Fn(&Errors) -> f64) -> Vec<f64> {
    errors.iter().map(|case| of(&case[variant]) / of(&case[0])).collect()
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

fn rmse(errors: &Errors) -> f64 {
    errors.rmse
}

fn mae(errors: &Errors) -> f64 {
    errors.mae
}

/// Prints the mean of each error over the cases, and the mean and the largest of its ratios to the first variant's.
fn print_table(title: &str, variants: &[Variant], errors: &[Vec<Errors>]) {
    println!("\n| {title} | RMSE | ratio | MAE | ratio | largest | bias |\n|---|---|---|---|---|---|---|");
    for (i, Variant { name, .. }) in variants.iter().enumerate() {
        let over_cases = |of: fn(&Errors) -> f64| mean(&errors.iter().map(|case| of(&case[i])).collect::<Vec<_>>());
        let [rmses, maes] = [rmse, mae].map(|of| ratios(errors, i, of));
        println!(
            "| {name} | {:.4} | {:.3} | {:.4} | {:.3} | {:.2} | {:+.4} |",
            over_cases(rmse),
            mean(&rmses),
            over_cases(mae),
            mean(&maes),
            maes.iter().copied().fold(0.0, f64::max),
            over_cases(|errors| errors.bias)
        );
    }
}

fn perspective(case: &Case) -> Lens {
    Lens::FovY(case.fov_y)
}

/// An orthographic view that is as high as the perspective one at the target.
fn orthographic(case: &Case) -> Lens {
    Lens::Height(2.0 * case.eye.distance(case.target) * (case.fov_y / 2.0).tan())
}

#[test]
fn with_the_same_samples_errors_are_two_thirds_of_the_chapters_and_each_change_has_its_share() {
    let view = |name: &str, zenith, spacing, quadrature| {
        named(
            name,
            variant(Method::HbaoView, [8, 8], |s| (s.zenith, s.spacing, s.quadrature) = (zenith, spacing, quadrature)),
        )
    };
    let variants = [
        variant(Method::Hbao, [8, 8], |_| ()),
        named("--exit shorten", variant(Method::Hbao, [8, 8], |s| s.exit = Exit::Shorten)),
        view("axis, 1, end", Zenith::Axis, 1.0, Quadrature::End),
        view("view, 1, end", Zenith::View, 1.0, Quadrature::End),
        view("view, 1.5, end", Zenith::View, 1.5, Quadrature::End),
        view("view, 2, end", Zenith::View, 2.0, Quadrature::End),
        view("view, 2, mean", Zenith::View, 2.0, Quadrature::Mean),
        view("view, 2, interval", Zenith::View, 2.0, Quadrature::Interval),
        view("view, 1.5, expected", Zenith::View, 1.5, Quadrature::Expected),
        variant(Method::HbaoView, [8, 8], |_| ()),
        variant(Method::HbaoView, [4, 4], |_| ()),
    ];
    let Some(errors) = measure(&variants, perspective) else { return };
    print_table("before the blur", &variants, &errors);
    let (default, few) = (variants.len() - 2, variants.len() - 1);
    assert!(mean(&ratios(&errors, default, rmse)) < 0.65);
    let maes = ratios(&errors, default, mae);
    assert!(mean(&maes) < 0.6 && maes.iter().all(|&ratio| ratio < 0.8), "{maes:?}");
    assert!(mean(&ratios(&errors, few, rmse)) < 1.05);
    // Each change lowers the mean error.
    for (before, after) in [(2, 3), (3, 4), (4, 5), (5, 7), (7, default)] {
        let [before, after] = [before, after].map(|i| mean(&ratios(&errors, i, rmse)));
        assert!(after < before, "{before} {after}");
    }
}

#[test]
fn more_samples_lower_the_error_from_8_to_256() {
    let counts = [[4, 2], [4, 4], [4, 8], [8, 8], [16, 8], [16, 16]];
    let mut variants = vec![variant(Method::Hbao, [8, 8], |_| ())];
    variants.extend(counts.map(|counts| variant(Method::HbaoView, counts, |_| ())));
    let Some(errors) = measure(&variants, perspective) else { return };
    print_table("before the blur", &variants, &errors);
    let means: Vec<f64> = (1..variants.len()).map(|i| mean(&ratios(&errors, i, rmse))).collect();
    assert!(means.windows(2).all(|pair| pair[1] < pair[0]), "{means:?}");
}

#[test]
fn after_the_same_blur_errors_are_seven_tenths_of_the_chapters() {
    let blurred = |method, counts| variant(method, counts, |s| s.blur = 9);
    let variants = [
        blurred(Method::Hbao, [8, 8]),
        named("--exit shorten", variant(Method::Hbao, [8, 8], |s| (s.blur, s.exit) = (9, Exit::Shorten))),
        Variant { sigma: Some(0.25), ..named("depth sigma R/4", blurred(Method::HbaoView, [8, 8])) },
        blurred(Method::HbaoView, [8, 8]),
        named("5x5", variant(Method::HbaoView, [8, 8], |s| s.blur = 5)),
        blurred(Method::HbaoView, [4, 8]),
        blurred(Method::HbaoView, [4, 4]),
    ];
    let Some(errors) = measure(&variants, perspective) else { return };
    print_table("after the 9x9 blur", &variants, &errors);
    for i in [2, 3] {
        assert!(mean(&ratios(&errors, i, rmse)) < 0.7, "{}", variants[i].name);
    }
}

#[test]
fn in_orthographic_views_no_error_is_above_the_chapters() {
    let variants = [
        variant(Method::Hbao, [8, 8], |_| ()),
        named("--exit shorten", variant(Method::Hbao, [8, 8], |s| s.exit = Exit::Shorten)),
        variant(Method::HbaoView, [8, 8], |_| ()),
    ];
    let Some(errors) = measure(&variants, orthographic) else { return };
    print_table("before the blur, orthographic", &variants, &errors);
    let rmses = ratios(&errors, 2, rmse);
    assert!(rmses.iter().all(|&ratio| ratio <= 1.0), "{rmses:?}");
    // In one view hardly anything occludes: mean errors are 0.003 there, less than the noise of the truth.
    let maes: Vec<[f64; 2]> = errors.iter().map(|case| [case[0].mae, case[2].mae]).collect();
    assert!(maes.iter().all(|[chapter, view]| *view <= chapter + 0.001), "{maes:?}");
}
