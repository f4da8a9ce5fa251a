//! For every finite input, each pass must write finite values in range that match its float64 twin. This is tested with
//! random scenes, cameras, settings and sizes, including extreme ones.
//!
//! Compiling shaders takes most of the time, so each set of settings renders many scenes. The random choices are the
//! same in every run. `HBAO_STABILITY_CASES=N` makes about N frames of new choices, with as many settings as that
//! takes; `PROPTEST_RNG_SEED` makes these reproducible too. A failing case is made smaller until it is minimal, and its
//! seed is written to `tests/stability/METHOD.seeds`, which every run tries first.

#[path = "stability/draw.rs"]
mod draw;
mod rig;

use draw::{Batch, Drawn, batch};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::{Camera, Projection};
use hbao::settings::{Method, NormalFormat};
use hbao::{Pipeline, Request, Settings, rotation_tile};
use proptest::prelude::Strategy as _;
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed, TestCaseError, TestRunner};
use rig::process::{in_own_process, skip};
use rig::surfaces::Surfaces;
use rig::{FOUR_SAMPLES, Limits, compare, everywhere};
use std::cell::RefCell;
use std::ffi::OsStr;

type Held = Result<(), TestCaseError>;

fn fail<T>(what: impl Into<String>) -> Result<T, TestCaseError> {
    Err(TestCaseError::fail(what.into()))
}

/// Statistics over all frames of a test. Pixels are those of ambient occlusion.
#[derive(Default, Debug)]
struct Counts {
    settings: usize,
    frames: usize,
    with_surfaces: usize,
    occluded: usize,
    covered: usize,
    /// The pixels of the images that show a surface, and those whose depth and normal were compared with those of rays.
    seen: usize,
    surfaces: usize,
    /// Pixels that were left out of the comparison, before the blur and after it.
    ambiguous: usize,
    blur_ambiguous: usize,
    /// Pixels of micro-spheres that were not compared with the twin because of [`amplifies`].
    amplified: usize,
    /// The number of frames in which more than 0.5 % of the covered pixels, and more than two, are ambiguous, and the
    /// largest such share.
    over: usize,
    worst: f64,
}

/// The pipeline of the last batch. While a failing case is made smaller, the settings mostly stay the same, so it is
/// kept.
struct Compiled {
    key: (Backend, Settings, (u32, u32)),
    // This is declared before the context, in which it was made, so that it is dropped first.
    pipeline: Pipeline,
    context: Context,
}

fn compiled(batch: &Batch) -> Compiled {
    let context = Context::open(batch.backend).unwrap();
    let request = Request { raw: true, edges: true, ..Request::default() };
    let pipeline = Pipeline::new(context.gl(), batch.size, &batch.settings, request).unwrap();
    Compiled { key: (batch.backend, batch.settings.clone(), batch.size), pipeline, context }
}

/// Checks that all values are finite and in [0, 1].
fn scan(what: &str, image: &Image<f32>) -> Held {
    match image.texels.iter().position(|a| !(0.0..=1.0).contains(a)) {
        Some(i) => fail(format!("{what} is {} at ({}, {})", image.texels[i], i % image.width, i / image.width)),
        None => Ok(()),
    }
}

/// Checks that depth lies between the planes and normals have length 1, and that background has neither.
fn scan_gbuffer(depth: &Image<f32>, normals: &Image<[f32; 3]>, [near, far]: [f64; 2]) -> Held {
    for (i, (&z, &n)) in depth.texels.iter().zip(&normals.texels).enumerate() {
        let at = (i % depth.width, i / depth.width);
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        if z == f32::INFINITY {
            if length != 0.0 {
                return fail(format!("background has the normal {n:?} at {at:?}"));
            }
            continue;
        }
        let (near, far) = (near * (1.0 - 1e-6), far * (1.0 + 1e-6));
        if !(near..=far).contains(&f64::from(z)) {
            return fail(format!("depth is {z} at {at:?}, outside {near} to {far}"));
        }
        if (length - 1.0).abs() > 1e-5 || length.is_nan() {
            return fail(format!("the normal is {n:?} at {at:?}"));
        }
    }
    Ok(())
}

fn held<A: Copy + Into<f64>, B: Copy + Into<f64>>(
    what: &str,
    got: &Image<A>,
    expected: &Image<B>,
    mask: &Image<bool>,
    limits: Limits,
) -> Held {
    if !mask.texels.contains(&true) {
        return Ok(());
    }
    compare(got, expected, mask, limits).or_else(|mismatch| fail(format!("{what}: {mismatch}")))
}

/// Whether R covers so many texels that float32 cannot compute the sum of micro-spheres. The samples stand for all
/// texels of R's disc, pi R_px^2 in number, even if the border clamps them to texels next to P. At the distance of one
/// texel, each has a solid angle of pi/4. The rounding error of n.D/|D| is 1e-7, and larger by |r| where D's terms are
/// that much longer than D. At R_px = 100 the sum is off by some 1e-3 of A. Nothing bounds this error, so such pixels
/// are scanned and counted but not compared.
fn amplifies(
    settings: &Settings,
    camera: &Camera,
    (width, height): (usize, usize),
    (x, y): (usize, usize),
    z: f64,
) -> bool {
    let across = match camera.projection {
        Projection::Perspective(extents) => 2.0 * z * extents.half()[1],
        Projection::Orthographic(extents) => 2.0 * extents.half()[1],
    };
    let (_, r) = camera.ray((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
    let radius =
        settings.radius_in(camera.projection).unwrap().at(z) / across * height as f64 / f64::from(settings.ao_scale());
    settings.method == Method::Microsphere && radius * r.length().sqrt() > 64.0
}

/// Checks one frame, pass by pass.
fn hold_frame(pipeline: &mut Pipeline, batch: &Batch, drawn: &Drawn, counts: &mut Counts) -> Held {
    let settings = &batch.settings;
    let Some((mesh, view)) = drawn.view(batch.orthographic, settings.radius.units().unwrap()) else { return Ok(()) };
    let camera = match view.camera(&mesh, batch.size.0, batch.size.1) {
        Ok((camera, _)) => camera,
        // The random eye and target may be the same point.
        Err(error) if error.to_string().contains("--eye is the same point as --target") => return Ok(()),
        Err(error) => return fail(error.to_string()),
    };
    let rendered = pipeline.render(&mesh, &camera);
    if let Err(error) = rendered {
        return fail(format!("refused: {error}"));
    }
    let (depth, normals) = (pipeline.depth().unwrap(), pipeline.normals().unwrap());
    let (raw, ao) = (pipeline.ao_raw().unwrap().clone(), pipeline.ao().unwrap());
    let samples = if pipeline.samples() > 1 { pipeline.depth_samples().unwrap() } else { Vec::new() };
    let edges = pipeline.edges().unwrap().clone();
    scan_gbuffer(&depth, &normals, [camera.near, camera.far])?;
    let sample = if samples.is_empty() { [0.0; 2] } else { FOUR_SAMPLES[0] };
    let by = settings.normals;
    // Half floats have 11 bits. If the driver does not render signed bytes, half floats replace them.
    let rounded = if settings.normal_format == NormalFormat::Rgba16f { 0.05 } else { 0.5 };
    let surfaces = Surfaces { depth: &depth, normals: &normals, rounded, mesh: &mesh, camera: &camera, by, sample };
    counts.seen += depth.texels.iter().filter(|z| z.is_finite()).count();
    counts.surfaces += surfaces.compare().or_else(fail)?;
    scan("raw ambient occlusion", &raw)?;
    scan("blurred ambient occlusion", &ao)?;

    let tile = rotation_tile(settings);
    let inputs = reference::TwinInputs {
        depth: &depth,
        normals: &normals,
        tile: &tile,
        projection: camera.projection,
        near: camera.near,
    };
    let scale = settings.ao_scale() as usize;
    let covered = Image::from_fn(raw.width, raw.height, |x, y| depth.at(scale * x, scale * y).is_finite());
    let pixels = covered.texels.iter().filter(|&&c| c).count();
    let expected = reference::visibility(&inputs, settings).unwrap();
    let ambiguous = reference::ambiguous(&inputs, settings).unwrap();
    let count = ambiguous.texels.iter().filter(|&&a| a).count();
    counts.frames += 1;
    counts.with_surfaces += usize::from(pixels > 0);
    counts.occluded += usize::from(raw.texels.iter().any(|&a| a < 0.98));
    counts.covered += pixels;
    counts.ambiguous += count;
    if count > (pixels / 200).max(2) {
        counts.over += 1;
        counts.worst = counts.worst.max(count as f64 / pixels as f64);
    }
    let amplified = Image::from_fn(raw.width, raw.height, |x, y| {
        let z = depth.at(scale * x, scale * y).into();
        covered.at(x, y) && amplifies(settings, &camera, (depth.width, depth.height), (scale * x, scale * y), z)
    });
    counts.amplified += amplified.texels.iter().filter(|&&a| a).count();
    let clear =
        Image::from_fn(raw.width, raw.height, |x, y| covered.at(x, y) && !ambiguous.at(x, y) && !amplified.at(x, y));
    held("raw ambient occlusion where it is not ambiguous", &raw, &expected, &clear, everywhere(1e-3))?;
    let background = covered.map(|c| !c);
    held("background", &raw, &raw.map(|_| 1.0), &background, everywhere(0.0))?;

    let one = |edge: bool| f64::from(u8::from(edge));
    let all = depth.map(|_| true);
    let expected = match samples.as_slice() {
        [] => depth.map(|_| false),
        samples => reference::edges::edges(samples, camera.projection, settings).unwrap(),
    };
    held("edges", &edges.map(one), &expected.map(one), &all, everywhere(0.0))?;
    let blurred = raw.map(f64::from);
    let expected = reference::blur::blur(&blurred, &depth, &samples, camera.projection, settings).unwrap();
    let ambiguous = reference::blur::ambiguous(&blurred, &depth, &samples, camera.projection, settings).unwrap();
    counts.blur_ambiguous += ambiguous.texels.iter().filter(|&&a| a).count();
    held("blurred ambient occlusion", &ao, &expected, &ambiguous.map(|a| !a), everywhere(1e-3))
}

/// What a test draws at random.
struct Draws {
    methods: Vec<Method>,
    /// The number of sets of settings. In a longer run this number is as large as `share` of its frames takes.
    sets: u32,
    share: f64,
    /// With a backend, only this one is used, and the pictures are small enough for a slow driver.
    only: Option<Backend>,
    most: Most,
}

/// The largest shares that may be left out of the comparison with the twins: of the covered pixels of all frames,
/// before and after the blur, and of frames in which more than 0.5 % of the pixels, and more than two, are ambiguous.
#[derive(Clone, Copy)]
struct Most {
    ambiguous: f64,
    blur_ambiguous: f64,
    over: f64,
}

/// In an orthographic view of a plane, a sixteenth of all pixels have the same offsets, so a tie at one pixel is a tie
/// at all of these. This happens in one frame of a few hundred.
const FEW: Most = Most { ambiguous: 0.005, blur_ambiguous: 0.05, over: 0.01 };

fn hold_drawn(seeds: &'static str, Draws { methods, sets, share, only, most }: Draws) {
    let asked = std::env::var("HBAO_STABILITY_CASES").ok().map(|n| n.parse::<f64>().unwrap());
    let defaults = Config::default();
    let config = Config {
        cases: asked.map_or(sets, |n| (n * share / (draw::SHOTS as f64 / 2.0)).ceil() as u32),
        rng_seed: if asked.is_some() { defaults.rng_seed } else { RngSeed::Fixed(20_080_602) },
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(seeds))),
        source_file: Some(file!()),
        max_shrink_iters: 400,
        ..defaults
    };
    let drawn = batch(methods.clone()).prop_map(move |batch| match only {
        Some(backend) => Batch { backend, size: (batch.size.0.min(23), batch.size.1.min(23)), ..batch },
        None => batch,
    });
    let counts = RefCell::new(Counts::default());
    let last: RefCell<Option<Compiled>> = RefCell::new(None);
    let result = TestRunner::new(config).run(&drawn, |batch| {
        let mut last = last.borrow_mut();
        let mut counts = counts.borrow_mut();
        if last.as_ref().is_none_or(|last| last.key != (batch.backend, batch.settings.clone(), batch.size)) {
            // The old context is dropped before the new one is made current.
            *last = None;
            *last = Some(compiled(&batch));
            counts.settings += 1;
        }
        let Compiled { pipeline, context, .. } = last.as_mut().unwrap();
        let _watch = rig::debug::watch(context);
        batch.shots.iter().enumerate().try_for_each(|(i, drawn)| {
            let what = |error| match error {
                TestCaseError::Fail(why) => TestCaseError::fail(format!("shot {i}: {why}")),
                other => other,
            };
            hold_frame(pipeline, &batch, drawn, &mut counts).map_err(what)
        })
    });
    let counts = counts.into_inner();
    eprintln!("{seeds}: {counts:?}");
    if let Err(error) = result {
        panic!("{error}");
    }
    let share = |part: usize, whole: usize| part as f64 / whole as f64;
    let few = share(counts.ambiguous, counts.covered) <= most.ambiguous
        && share(counts.blur_ambiguous, counts.covered) <= most.blur_ambiguous
        && share(counts.over, counts.frames) <= most.over;
    assert!(few, "too much is ambiguous: {counts:?}");
    assert!(share(counts.surfaces, counts.seen) > 0.8, "too few surfaces were compared with rays: {counts:?}");
    // All tests together have 2,000 frames or more.
    assert!(counts.frames >= 30 * sets as usize, "too few frames: {counts:?}");
    // Comparing images that are all background, or entirely open, would show little.
    let open = methods.iter().all(|&method| !rig::computes(method));
    assert!(2 * counts.with_surfaces > counts.frames && (open || 10 * counts.occluded > counts.frames), "{counts:?}");
}

#[test]
fn hbao_is_finite_in_range_and_its_twins_at_the_extremes() {
    let draws = Draws { methods: vec![Method::Hbao], sets: 17, share: 0.36, only: None, most: FEW };
    hold_drawn("tests/stability/hbao.seeds", draws);
}

#[test]
fn hbao_of_the_talk_is_finite_in_range_and_its_twins_at_the_extremes() {
    // If two samples are equally high, the one that is taken for the horizon decides W for the whole direction.
    let most = Most { ambiguous: 0.03, over: 0.06, ..FEW };
    let draws = Draws { methods: vec![Method::HbaoTalk], sets: 7, share: 0.12, only: None, most };
    hold_drawn("tests/stability/hbao-talk.seeds", draws);
}

#[test]
fn hbao_about_the_view_ray_is_finite_in_range_and_its_twins_at_the_extremes() {
    let draws = Draws { methods: vec![Method::HbaoView], sets: 9, share: 0.16, only: None, most: FEW };
    hold_drawn("tests/stability/hbao-view.seeds", draws);
}

#[test]
fn marched_rays_are_finite_in_range_and_their_twins_at_the_extremes() {
    // Any of hundreds of samples may be about to round to another texel, and one hit changes A by 1/32.
    let most = Most { ambiguous: 0.02, over: 0.05, ..FEW };
    let draws = Draws { methods: vec![Method::RayMarch], sets: 7, share: 0.12, only: None, most };
    hold_drawn("tests/stability/ray-march.seeds", draws);
}

#[test]
fn micro_spheres_and_creases_are_finite_in_range_and_their_twins_at_the_extremes() {
    // This test also draws every method that no other test here draws.
    let drawn = [Method::Hbao, Method::HbaoTalk, Method::HbaoView, Method::RayMarch, Method::Ssao];
    let methods = rig::methods().filter(|method| !drawn.contains(method)).collect();
    let draws = Draws { methods, sets: 7, share: 0.13, only: None, most: FEW };
    hold_drawn("tests/stability/microsphere.seeds", draws);
}

#[test]
fn ssao_is_finite_in_range_and_its_twins_at_the_extremes() {
    // The blur of SSAO has equal weights, which do not fall off with distance. At half resolution, the taps on both
    // sides of a pixel are often equally near in depth, so that there are many ties.
    let most = Most { blur_ambiguous: 0.15, ..FEW };
    let draws = Draws { methods: vec![Method::Ssao], sets: 9, share: 0.15, only: None, most };
    hold_drawn("tests/stability/ssao.seeds", draws);
}

#[test]
fn no_ambient_occlusion_is_open_at_the_extremes() {
    let draws = Draws { methods: vec![Method::None], sets: 1, share: 0.02, only: None, most: FEW };
    hold_drawn("tests/stability/none.seeds", draws);
}

/// All methods, for a driver that is tested in a process of its own.
fn on_another_driver(backend: Backend) -> Draws {
    let most = Most { ambiguous: 0.02, blur_ambiguous: 0.15, over: 0.04 };
    Draws { methods: rig::methods().collect(), sets: 4, share: 0.05, only: Some(backend), most }
}

#[test]
fn softpipe_is_finite_in_range_and_its_twins_at_the_extremes() {
    let test = "softpipe_is_finite_in_range_and_its_twins_at_the_extremes";
    in_own_process(test, &[("GALLIUM_DRIVER", OsStr::new("softpipe"))], || {
        hold_drawn("tests/stability/softpipe.seeds", on_another_driver(Backend::Osmesa));
    });
}

#[test]
fn zink_is_finite_in_range_and_its_twins_at_the_extremes() {
    let test = "zink_is_finite_in_range_and_its_twins_at_the_extremes";
    let environment = [("MESA_LOADER_DRIVER_OVERRIDE", "zink"), ("LIBGL_ALWAYS_SOFTWARE", "true")];
    in_own_process(test, &environment.map(|(name, value)| (name, OsStr::new(value))), || {
        let described = Context::open(Backend::Egl).map(|context| context.describe());
        match described {
            Ok(described) if described.contains("zink") => {
                hold_drawn("tests/stability/zink.seeds", on_another_driver(Backend::Egl));
            }
            _ => skip("zink on a Vulkan driver", "mesa-vulkan-drivers"),
        }
    });
}
