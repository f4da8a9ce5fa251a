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
use glam::{DVec3, dvec3};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::{Lens, Mesh, Projection, View};
use hbao::settings::{Clamp, Jitter, Method, Normals, Radius, Toggle};
use hbao::{Pipeline, Request, Settings, rotation_tile};
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed, TestCaseError, TestRunner};
use rig::by_hand::{self, ByHand};
use rig::{Frame, Limits, SIZE, Shot, compare, everywhere, hold, scenes};
use std::cell::RefCell;

type Held = Result<(), TestCaseError>;

fn fail<T>(what: impl Into<String>) -> Result<T, TestCaseError> {
    Err(TestCaseError::fail(what.into()))
}

/// What was seen, over all frames of a test. Pixels are those of ambient occlusion.
#[derive(Default, Debug)]
struct Counts {
    settings: usize,
    frames: usize,
    with_surfaces: usize,
    occluded: usize,
    covered: usize,
    /// Pixels left out of the comparison, before the blur and after it.
    ambiguous: usize,
    blur_ambiguous: usize,
    /// Pixels of micro-spheres that are not compared with the twin, by [`amplifies`].
    amplified: usize,
    /// Frames with more of them than 0.5 % of the covered pixels and than two, and the largest share of one.
    over: usize,
    worst: f64,
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

/// Whether R is so many texels that float32 cannot tell the sum of micro-spheres. Samples stand for the pi R_px^2 texels
/// of R's disc, wherever the border clamps them to: at a texel's distance that is pi/4 of solid angle each, and the 1e-7
/// that is rounded off n.D/|D| becomes 1e-3 of A at R_px = 113. A limit of that sum, which nothing bounds: such pixels
/// are scanned and counted, not compared.
fn amplifies(settings: &Settings, projection: Projection, height: usize, z: f64) -> bool {
    let across = match projection {
        Projection::Perspective { tan_half_fov_y, .. } => 2.0 * z * tan_half_fov_y,
        Projection::Orthographic { half_height, .. } => 2.0 * half_height,
    };
    let texels = height as f64 / f64::from(settings.ao_scale());
    settings.method == Method::Microsphere && settings.radius_units().unwrap() / across * texels > 100.0
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
        counts.worst = counts.worst.max(count as f64 / pixels as f64);
    }
    let amplified = Image::from_fn(raw.width, raw.height, |x, y| {
        let z = depth.at(scale * x, scale * y).into();
        covered.at(x, y) && amplifies(settings, camera.projection, depth.height, z)
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
/// Of all covered pixels `left_out` may be ambiguous: over all frames, since in an orthographic view of a plane the
/// pixels share their offsets, and a tie of one is that of a sixteenth of them.
fn hold_drawn(seeds: &'static str, methods: &'static [Method], (sets, share): (u32, f64), left_out: f64) {
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
    // A new draw may hold more frames of a kind whose every pixel is ambiguous: it is reported, and the fixed one held.
    let share = counts.ambiguous as f64 / counts.covered as f64;
    assert!(asked.is_some() || share <= left_out, "too much is ambiguous: {counts:?}");
    // Comparisons of images that are all background, or all open, would say little.
    let open = methods == [Method::None];
    assert!(2 * counts.with_surfaces > counts.frames && (open || 10 * counts.occluded > counts.frames), "{counts:?}");
}

#[test]
fn hbao_is_finite_in_range_and_its_twins_at_the_extremes() {
    hold_drawn("tests/stability/hbao.seeds", &[Method::Hbao], (24, 0.4), 0.005);
}

#[test]
fn hbao_of_the_talk_is_finite_in_range_and_its_twins_at_the_extremes() {
    // Of samples that are as high, the one that is taken for the horizon decides all of the direction's W.
    hold_drawn("tests/stability/hbao-talk.seeds", &[Method::HbaoTalk], (8, 0.13), 0.01);
}

#[test]
fn marched_rays_are_finite_in_range_and_their_twins_at_the_extremes() {
    // As `rig::twin::hold_visibility` has it: any of hundreds of samples may be about to round to another texel.
    hold_drawn("tests/stability/ray-march.seeds", &[Method::RayMarch], (8, 0.13), 0.05);
}

#[test]
fn micro_spheres_and_creases_are_finite_in_range_and_their_twins_at_the_extremes() {
    hold_drawn("tests/stability/microsphere.seeds", &[Method::Microsphere, Method::Crease], (9, 0.15), 0.005);
}

#[test]
fn ssao_is_finite_in_range_and_its_twins_at_the_extremes() {
    hold_drawn("tests/stability/ssao.seeds", &[Method::Ssao], (10, 0.17), 0.005);
}

#[test]
fn no_ambient_occlusion_is_open_at_the_extremes() {
    hold_drawn("tests/stability/none.seeds", &[Method::None], (1, 0.02), 0.005);
}

/// Coordinates that float32 and float64 hold with bits to spare, so that moving them rounds nothing.
fn coarse(shot: &Shot) -> Shot {
    let round = |p: DVec3| (p * 1024.0).round() / 1024.0;
    let mut shot = shot.clone();
    shot.mesh.positions.iter_mut().for_each(|p| *p = round(*p));
    shot.view.eye = shot.view.eye.map(round);
    shot.view.target = shot.view.target.map(round);
    shot
}

fn hold_identical(got: &Frame, expected: &Frame, what: &str) {
    let bits = |image: &Image<f32>| image.map(f32::to_bits);
    assert_eq!(got.normals.map(|n| n.map(f32::to_bits)), expected.normals.map(|n| n.map(f32::to_bits)), "{what}");
    assert_eq!(bits(&got.raw), bits(&expected.raw), "{what}");
    assert_eq!(bits(&got.ao), bits(&expected.ao), "{what}");
    assert_eq!(got.edges, expected.edges, "{what}");
    assert!(expected.raw.texels.iter().any(|&a| a < 0.95), "{what}");
}

const METHODS: [Method; 6] =
    [Method::Hbao, Method::HbaoTalk, Method::RayMarch, Method::Microsphere, Method::Crease, Method::Ssao];

/// Every method over shots in perspective and orthographic.
fn each_method(mut body: impl FnMut(&Context, &Shot, &Settings, &str)) {
    let context = Context::open(Backend::Osmesa).unwrap();
    for method in METHODS {
        for shot in [scenes::box_on_a_floor(), scenes::floor_and_wall().orthographic()] {
            let own = Settings::for_method(method);
            let settings =
                Settings { method, attenuation: own.attenuation, snap: own.snap, ..rig::float_settings(shot.radius) };
            let what = format!("{} of {}", method.name(), shot.name);
            body(&context, &shot, &settings, &what);
        }
    }
}

#[test]
fn a_world_scaled_by_a_power_of_two_looks_the_same_to_the_bit() {
    each_method(|context, shot, settings, what| {
        let frame = rig::render(context.gl(), shot, SIZE, settings);
        for factor in [2f64.powi(-30), 2f64.powi(-20), 2f64.powi(20), 2f64.powi(30)] {
            let scaled = shot.scaled(factor);
            let settings =
                Settings { radius: Radius::Units(settings.radius_units().unwrap() * factor), ..settings.clone() };
            let other = rig::render(context.gl(), &scaled, SIZE, &settings);
            hold_identical(&other, &frame, &format!("{what} by {factor:e}"));
        }
    });
}

#[test]
fn a_world_a_million_away_looks_the_same_to_the_bit() {
    each_method(|context, shot, settings, what| {
        let shot = coarse(shot);
        let frame = rig::render(context.gl(), &shot, SIZE, settings);
        for offset in [dvec3(1e6, 0.0, 0.0), dvec3(-1e6, 1e6, 1e6), dvec3(3.0, 1e9, -1e7)] {
            let mut moved = shot.clone();
            moved.mesh.positions.iter_mut().for_each(|p| *p += offset);
            moved.view.eye = moved.view.eye.map(|p| p + offset);
            moved.view.target = moved.view.target.map(|p| p + offset);
            let other = rig::render(context.gl(), &moved, SIZE, settings);
            hold_identical(&other, &frame, &format!("{what} at {offset}"));
        }
    });
}

#[test]
fn a_mirrored_world_gives_the_mirrored_image_by_every_method() {
    each_method(|context, shot, settings, what| {
        if settings.method == Method::Ssao {
            // A cube's corners in a row of lengths are not their own mirror image.
            return;
        }
        let settings = Settings { jitter: Jitter::None, ..settings.clone() };
        let frame = rig::render(context.gl(), shot, SIZE, &settings);
        let mirrored = rig::render(context.gl(), &shot.mirrored(), SIZE, &settings);
        let turned =
            |image: &Image<f32>| Image::from_fn(image.width, image.height, |x, y| image.at(image.width - 1 - x, y));
        let ambiguous = reference::ambiguous(&frame.inputs(), &settings).unwrap();
        let (depth, raw) = (turned(&mirrored.depth), turned(&mirrored.raw));
        let mask = Image::from_fn(raw.width, raw.height, |x, y| {
            frame.depth.at(x, y).is_finite() && depth.at(x, y).is_finite() && !ambiguous.at(x, y)
        });
        // A pixel centre on an edge belongs to the left or right triangle, whichever is mirrored.
        hold("mirrored", &raw, &frame.raw, &mask, Limits { tolerance: 1e-3, share: 0.005 }, what);
    });
}

/// The pixels of the two images are the same rays, whole periods of the tile apart: further than R from the border they
/// must hold the same.
#[test]
fn a_smaller_field_of_view_crops_the_image() {
    const FULL: (u32, u32) = (120, 88);
    const PART: (u32, u32) = (72, 56);
    let (left, low) = (((FULL.0 - PART.0) / 2) as usize, ((FULL.1 - PART.1) / 2) as usize);
    each_method(|context, shot, settings, what| {
        if settings.method == Method::Ssao {
            // Its offsets are shares of the image, of which there is less.
            return;
        }
        let mut full = shot.clone();
        let mut part = shot.clone();
        let share = f64::from(PART.1) / f64::from(FULL.1);
        part.view.lens = match full.view.lens {
            Some(Lens::FovY(fov)) => Some(Lens::FovY(2.0 * ((fov / 2.0).tan() * share).atan())),
            Some(Lens::Height(height)) => Some(Lens::Height(height * share)),
            None => None,
        };
        full.view.near = Some(1.0);
        full.view.far = Some(20.0);
        (part.view.near, part.view.far) = (full.view.near, full.view.far);
        // At most 8 pixels or so.
        let settings = Settings { radius: Radius::Units(shot.radius * 0.2), steps: 3, blur: 3, ..settings.clone() };
        let frame = rig::render(context.gl(), &full, FULL, &settings);
        let cropped = rig::render(context.gl(), &part, PART, &settings);
        let ambiguous = reference::ambiguous(&cropped.inputs(), &settings).unwrap();
        let part = |image: &Image<f32>| Image::from_fn(72, 56, |x, y| image.at(x + left, y + low));
        let (of_full, blurred) = (part(&frame.raw), part(&frame.ao));
        let margin = 16;
        let mask = Image::from_fn(of_full.width, of_full.height, |x, y| {
            let inside =
                (margin..of_full.width - margin).contains(&x) && (margin..of_full.height - margin).contains(&y);
            inside && cropped.depth.at(x, y).is_finite() && !ambiguous.at(x, y)
        });
        let limits = Limits { tolerance: 1e-3, share: 0.005 };
        hold("cropped", &cropped.raw, &of_full, &mask, limits, what);
        // What the few others are spreads to their neighbours.
        let same = |x: usize, y: usize| (cropped.raw.at(x, y) - of_full.at(x, y)).abs() <= 1e-3;
        let all_same = Image::from_fn(mask.width, mask.height, |x, y| {
            mask.at(x, y) && (0..9).all(|i| same(x + i % 3 - 1, y + i / 3 - 1))
        });
        hold("cropped and blurred", &cropped.ao, &blurred, &all_same, limits, what);
        let occluded = (0..mask.texels.len()).any(|i| mask.texels[i] && of_full.texels[i] < 0.95);
        assert!(occluded, "{what}");
    });
}

/// Eyes in a flat room see walls whose planes pass through the ray of a pixel's centre far away, or nowhere: what
/// extrapolates to there is infinite or no number. The draw found normals of no length so; these eyes look at such walls,
/// and are not known to meet that case itself.
#[test]
fn normals_stand_where_a_pixels_centre_meets_its_triangles_plane_at_infinity() {
    let context = Context::open(Backend::Egl).unwrap();
    let [x, y, z] = [4.0 * DVec3::X, 0.6 * DVec3::Y, 3.6 * DVec3::Z];
    let walls = [(x, y, z), (y, z, x), (z, x, y)].into_iter().flat_map(|(a, b, c)| [(a, b, c), (a, b, -c)]);
    let corners =
        |(a, b, c): (DVec3, DVec3, DVec3)| [[c - a - b, c + a - b, c + a + b], [c - a - b, c + a + b, c + b - a]];
    let positions: Vec<DVec3> = walls.flat_map(corners).flatten().collect();
    let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new(positions, triangles).unwrap();
    for normals in [Normals::Derivative, Normals::Vertex] {
        for (fov, msaa) in [(175.0, 4), (175.0, 1), (120.0, 4)] {
            for eye in [dvec3(0.0, 0.0, 2.0), dvec3(0.1, 0.0, 3.0), dvec3(0.0, 1e-6, 1.0)] {
                let lens = Some(Lens::FovY(f64::to_radians(fov)));
                let view = View { eye: Some(eye), target: Some(-DVec3::Z), lens, ..View::default() };
                let shot = Shot::new("flat room", mesh.clone(), view, 1.0);
                let settings = Settings { normals, msaa, ..rig::float_settings(1.0) };
                let frame = rig::render(context.gl(), &shot, (15, 33), &settings);
                let camera = shot.camera((15, 33));
                scan_gbuffer(&frame.depth, &frame.normals, [camera.near, camera.far]).unwrap();
            }
        }
    }
}

/// A texel at the bottom of a shaft, all samples at the same distance sqrt(2) s and height s above it, s pixels across:
/// m Omega n.D/|D| adds up to pi/(4 sqrt 2) of pi, whatever s is. Found at random: 1 - sqrt(1 - x) left nothing of it.
#[test]
fn micro_spheres_far_away_keep_their_solid_angle() {
    let context = Context::open(Backend::Egl).unwrap();
    for s in [1e3, 1e6, 1e9, 1e12] {
        let size = (5, 5);
        let depth = Image::from_fn(5, 5, |x, y| if (x, y) == (2, 2) { 3.0 * s } else { 2.0 * s } as f32);
        let view =
            ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection: by_hand::orthographic(1.0, size) };
        let settings = Settings {
            method: Method::Microsphere,
            steps: 1,
            // One that points along each axis.
            directions: 4,
            jitter: Jitter::None,
            clamp: Clamp::Depth,
            blur: 0,
            ..rig::float_settings(2.0 * s)
        };
        let expected = 1.0 - std::f64::consts::PI / (4.0 * 2f64.sqrt());
        for (who, got) in view.by_both(context.gl(), &settings) {
            assert!((got.at(2, 2) - expected).abs() < 1e-4, "{who} at {s:e}: {} is not {expected}", got.at(2, 2));
        }
    }
}

/// Between two texels of half resolution that are equally far in depth, either is the nearest.
#[test]
fn a_tie_between_the_nearest_taps_is_ambiguous() {
    let depth = Image::from_fn(5, 1, |x, _| [0.1f32, 0.2, 0.3, 0.4, 0.5][x]);
    let ao = Image { width: 3, height: 1, texels: vec![0.0, 0.5, 1.0] };
    let settings = Settings { half_res: true, blur: 3, blur_depth_sigma: Some(1e-3), ..rig::float_settings(1.0) };
    let ambiguous = reference::blur::ambiguous(&ao, &depth, &[], &settings).unwrap();
    assert_eq!(ambiguous.texels, [false, true, false, true, false]);
}

/// Hills and holes under normals of every kind that the passes must take: of no length, of any other, edge-on but for
/// rounding, and past the silhouette.
#[test]
fn normals_of_any_length_edge_on_and_facing_away_match_the_twin() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (33, 21);
    for projection in [by_hand::perspective(90.0, size), by_hand::orthographic(0.1, size)] {
        // A few irrational turns in place of a random sequence.
        let wave = |x: usize, y: usize, k: f64| (x as f64 * 12.9898 * k + y as f64 * 78.233 + k).sin();
        let depth = Image::from_fn(33, 21, |x, y| {
            if wave(x, y, 5.0) > 0.95 { f32::INFINITY } else { (8.0 + 2.0 * wave(x, y, 1.0)) as f32 }
        });
        for length in [1e-30f64, 1e-20, 1e-3, 1.0, 1e10, 1e18, 1e30] {
            let normals = Image::from_fn(33, 21, |x, y| {
                let [sx, sy] = by_hand::slope(projection, size, x, y);
                let r = match projection {
                    Projection::Perspective { .. } => dvec3(sx, sy, 1.0),
                    Projection::Orthographic { .. } => DVec3::Z,
                };
                let n = dvec3(wave(x, y, 2.0), wave(x, y, 3.0), wave(x, y, 4.0));
                let n = match (x + y) % 4 {
                    0 => DVec3::ZERO,
                    1 => n - n.dot(r) / r.dot(r) * r,
                    _ => n,
                };
                (length * n).as_vec3().to_array()
            });
            let view = ByHand { depth: depth.clone(), normals, projection };
            for method in METHODS {
                let own = Settings::for_method(method);
                let settings = Settings { method, snap: own.snap, blur: 0, bias: 0.2, ..rig::float_settings(2.0) };
                let settings = Settings { ssao_normals: Toggle::On, directions: 5, steps: 4, ..settings };
                let got = view.by_shader(context.gl(), &settings);
                let tile = rotation_tile(&settings);
                let inputs = view.twin_inputs(&tile);
                let expected = reference::visibility(&inputs, &settings).unwrap();
                let ambiguous = reference::ambiguous(&inputs, &settings).unwrap();
                let clear = Image::from_fn(33, 21, |x, y| view.covered().at(x, y) && !ambiguous.at(x, y));
                let text = format!("{} at length {length:e} {projection:?}", method.name());
                hold("raw", &got, &expected, &clear, everywhere(1e-3), &text);
                scan("raw", &got).unwrap();
            }
        }
    }
}
