//! For every finite input each pass writes finite values in range, and what its float64 twin writes: over scenes,
//! cameras, settings and sizes drawn at random, the extremes among them.
//!
//! Compiling shaders takes most of the time, so that each set of settings renders many scenes. The draw is the same in
//! every run. `HBAO_STABILITY_CASES=N` makes it about N frames of a new draw, with as many settings as that takes;
//! `PROPTEST_RNG_SEED` fixes that one too. What fails is drawn smaller until it is minimal, and its seed is written to
//! `tests/stability/METHOD.seeds`, which every run tries first.

#[path = "stability/draw.rs"]
mod draw;
mod rig;

use draw::{Batch, Drawn, batch};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::settings::Method;
use hbao::{Pipeline, Request, Settings, rotation_tile};
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed, TestCaseError, TestRunner};
use rig::{Limits, compare, everywhere};
use std::cell::RefCell;

type Held = Result<(), TestCaseError>;

fn fail<T>(what: impl Into<String>) -> Result<T, TestCaseError> {
    Err(TestCaseError::fail(what.into()))
}

/// What was seen, over all frames of a test.
#[derive(Default, Debug)]
struct Counts {
    settings: usize,
    frames: usize,
    with_surfaces: usize,
    occluded: usize,
    covered: usize,
    ambiguous: usize,
    worst: f64,
    over: usize,
    blur_ambiguous: usize,
}

/// The last batch's pipeline: what fails is drawn smaller, by the same settings mostly.
struct Compiled {
    key: (Backend, Settings, (u32, u32)),
    // Before the context, which it is made in.
    pipeline: Pipeline,
    _context: Context,
}

fn compiled(batch: &Batch) -> Compiled {
    let context = Context::open(batch.backend).unwrap();
    let request = Request { raw: true, edges: true, ..Request::default() };
    let pipeline = Pipeline::new(context.gl(), batch.size, &batch.settings, request).unwrap();
    Compiled { key: (batch.backend, batch.settings.clone(), batch.size), pipeline, _context: context }
}

/// Finite, and in [0, 1].
fn scan(what: &str, image: &Image<f32>) -> Held {
    match image.texels.iter().position(|a| !(0.0..=1.0).contains(a)) {
        Some(i) => fail(format!("{what} is {} at ({}, {})", image.texels[i], i % image.width, i / image.width)),
        None => Ok(()),
    }
}

/// Depth between the planes, and normals of length 1; none of either on background.
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

/// One frame, pass by pass.
fn hold_frame(pipeline: &mut Pipeline, batch: &Batch, drawn: &Drawn, counts: &mut Counts) -> Held {
    let settings = &batch.settings;
    let Some((mesh, view)) = drawn.view(batch.orthographic, settings.radius_units().unwrap()) else { return Ok(()) };
    let camera = match view.camera(&mesh, batch.size.0, batch.size.1) {
        Ok((camera, _)) => camera,
        // Eye and target may be drawn alike.
        Err(error) => return if error.to_string().contains('\n') { fail(error.to_string()) } else { Ok(()) },
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
    scan("raw ambient occlusion", &raw)?;
    scan("blurred ambient occlusion", &ao)?;

    let tile = rotation_tile(settings);
    let inputs = reference::Inputs {
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
        if std::env::var("X").is_ok() { eprintln!("OVER {count} of {pixels} {:?} ortho {} N_d {} N_s {} {:?} {:?} bias {} jit {:?} fov {} h {} ratio {} tri {} R {:?} str {} half {} att {:?} near {:?}\n eye {:?} t {:?} {:?}", batch.size, batch.orthographic, settings.directions, settings.steps, settings.snap, settings.clamp, settings.bias.to_degrees(), settings.jitter, drawn.fov, drawn.height, drawn.ratio, drawn.scene.len(), settings.radius, settings.strength, settings.half_res, settings.attenuation, drawn.near, drawn.eye, drawn.target, drawn.scene.first()); }
        counts.worst = counts.worst.max(count as f64 / pixels as f64);
    }
    let clear = Image::from_fn(raw.width, raw.height, |x, y| covered.at(x, y) && !ambiguous.at(x, y));
    held("raw ambient occlusion where it is not ambiguous", &raw, &expected, &clear, everywhere(1e-3))?;
    let background = covered.map(|c| !c);
    held("background", &raw, &raw.map(|_| 1.0), &background, everywhere(0.0))?;

    let one = |edge: bool| f64::from(u8::from(edge));
    let all = depth.map(|_| true);
    let expected = match samples.as_slice() {
        [] => depth.map(|_| false),
        samples => reference::edges::edges(samples, settings).unwrap(),
    };
    held("edges", &edges.map(one), &expected.map(one), &all, everywhere(0.0))?;
    let blurred = raw.map(f64::from);
    let expected = reference::blur::blur(&blurred, &depth, &samples, settings).unwrap();
    let ambiguous = reference::blur::ambiguous(&blurred, &depth, &samples, settings).unwrap();
    counts.blur_ambiguous += ambiguous.texels.iter().filter(|&&a| a).count();
    held("blurred ambient occlusion", &ao, &expected, &ambiguous.map(|a| !a), everywhere(1e-3))
}

/// Draws `sets` of settings of these methods, or where a longer run is asked for as many as `share` of its frames take.
fn hold_drawn(seeds: &'static str, methods: &'static [Method], sets: u32, share: f64) {
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
    let counts = RefCell::new(Counts::default());
    let last: RefCell<Option<Compiled>> = RefCell::new(None);
    let result = TestRunner::new(config).run(&batch(methods), |batch| {
        let mut last = last.borrow_mut();
        let mut counts = counts.borrow_mut();
        if last.as_ref().is_none_or(|last| last.key != (batch.backend, batch.settings.clone(), batch.size)) {
            // The old context goes before the new one is made current.
            *last = None;
            *last = Some(compiled(&batch));
            counts.settings += 1;
        }
        let pipeline = &mut last.as_mut().unwrap().pipeline;
        batch.shots.iter().enumerate().try_for_each(|(i, drawn)| {
            let what = |error| match error {
                TestCaseError::Fail(why) => TestCaseError::fail(format!("shot {i}: {why}")),
                other => other,
            };
            hold_frame(pipeline, &batch, drawn, &mut counts).map_err(what)
        })
    });
    let counts = counts.into_inner();
    eprintln!("{}: {counts:?}", methods[0].name());
    if let Err(error) = result {
        panic!("{error}");
    }
}

#[test]
fn hbao_is_finite_in_range_and_its_twins_at_the_extremes() {
    hold_drawn("tests/stability/hbao.seeds", &[Method::Hbao], 24, 0.4);
}

#[test]
fn hbao_of_the_talk_is_finite_in_range_and_its_twins_at_the_extremes() {
    hold_drawn("tests/stability/hbao-talk.seeds", &[Method::HbaoTalk], 8, 0.13);
}

#[test]
fn marched_rays_are_finite_in_range_and_their_twins_at_the_extremes() {
    hold_drawn("tests/stability/ray-march.seeds", &[Method::RayMarch], 8, 0.13);
}

#[test]
fn micro_spheres_and_creases_are_finite_in_range_and_their_twins_at_the_extremes() {
    hold_drawn("tests/stability/microsphere.seeds", &[Method::Microsphere, Method::Crease], 9, 0.15);
}

#[test]
fn ssao_is_finite_in_range_and_its_twins_at_the_extremes() {
    hold_drawn("tests/stability/ssao.seeds", &[Method::Ssao], 10, 0.17);
}

#[test]
fn no_ambient_occlusion_is_open_at_the_extremes() {
    hold_drawn("tests/stability/none.seeds", &[Method::None], 1, 0.02);
}
