//! Tests of multisample antialiasing: what the samples hold, which pixels are edges, and what the supersampling blur
//! achieves.

use crate::rig;
use crate::rig::{FOUR_SAMPLES, Frame, Limits, SIZE, everywhere, hold, scenes};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::measure::{Shot, TruthImage, trade};
use hbao::reference;
use hbao::settings::{BlurKernel, DepthFormat, Edges, Method, Normals};
use hbao::{AmbientOcclusion, DepthSamples, Inputs, Pipeline, Request, Settings};

fn multisample(radius: f64) -> Settings {
    Settings { msaa: 4, ..rig::float_settings(radius) }
}

#[test]
fn the_drivers_samples_lie_where_the_tests_take_them_to_be() {
    use glow::HasContext as _;
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let gl = context.gl();
        let shot = scenes::floor();
        let pipeline = Pipeline::new(gl, (8, 8), &multisample(1.0), Request::default()).unwrap();
        assert_eq!(pipeline.samples(), 4, "llvmpipe gives four samples");
        let samples = pipeline.inputs(&shot.camera((8, 8))).samples.unwrap();
        // SAFETY: the context is current, the texture is alive, and glGetMultisamplefv has this signature. It returns
        // the positions of the framebuffer that is bound.
        let positions = unsafe {
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(gl.create_framebuffer().unwrap()));
            let (point, kind) = (glow::COLOR_ATTACHMENT0, glow::TEXTURE_2D_MULTISAMPLE);
            gl.framebuffer_texture_2d(glow::FRAMEBUFFER, point, kind, Some(samples.texture), 0);
            assert_eq!(gl.check_framebuffer_status(glow::FRAMEBUFFER), glow::FRAMEBUFFER_COMPLETE);
            let address = context.get_proc_address(c"glGetMultisamplefv");
            assert!(!address.is_null());
            let get: extern "system" fn(u32, u32, *mut f32) = std::mem::transmute(address);
            [0, 1, 2, 3].map(|index| {
                let mut position = [f32::NAN; 2];
                // 0x8E50 is GL_SAMPLE_POSITION.
                get(0x8E50, index, position.as_mut_ptr());
                position.map(|p| f64::from(p) - 0.5)
            })
        };
        assert_eq!(positions, FOUR_SAMPLES);
    }
}

#[test]
fn every_sample_holds_its_own_surface_on_the_ray_of_the_pixels_centre() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        for shot in scenes::all().into_iter().flat_map(|shot| [shot.clone(), shot.orthographic()]) {
            let settings = multisample(shot.radius);
            let frame = rig::render(context.gl(), &shot, SIZE, &settings);
            let size = (SIZE.0 as usize, SIZE.1 as usize);
            let camera = shot.camera(SIZE);
            for (image, position) in frame.samples.iter().zip(FOUR_SAMPLES) {
                let seen = reference::gbuffer::gbuffer(&shot.mesh, &camera, size, Normals::Derivative, position);
                let context = format!("{} {}, sample at {position:?}", backend.name(), shot.name);
                let covered = image.map(|z| f64::from(u8::from(z.is_finite())));
                let expected = seen.map(|s| f64::from(u8::from(s.depth.is_finite())));
                let limits = Limits { tolerance: 1e-5, share: 0.005 };
                hold("coverage", &covered, &expected, &image.map(|_| true), limits, &context);
                let both = Image::from_fn(size.0, size.1, |x, y| {
                    image.at(x, y).is_finite() && seen.at(x, y).depth.is_finite()
                });
                let relative = Image::from_fn(size.0, size.1, |x, y| f64::from(image.at(x, y)) / seen.at(x, y).depth);
                hold("depth over the plane's", &relative, &both.map(|_| 1.0), &both, limits, &context);
            }
        }
    }
}

/// The depth of a sample is that of the surface's plane on the ray of the pixel's centre. If it were the interpolated z
/// instead, the samples of one surface would differ, and the resolved one would lie a quarter of a pixel off its ray.
#[test]
fn all_samples_of_one_plane_in_a_pixel_have_one_depth() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::tilted_plane();
    let frame = rig::render(context.gl(), &shot, SIZE, &multisample(shot.radius));
    let mut pixels = 0;
    for i in 0..frame.depth.texels.len() {
        let z: Vec<f32> = frame.samples.iter().map(|image| image.texels[i]).filter(|z| z.is_finite()).collect();
        let Some(&first) = z.first() else { continue };
        pixels += 1;
        assert!(z.iter().all(|z| (z / first - 1.0).abs() < 1e-6), "{z:?}");
    }
    assert!(pixels > 500);
    // The plane is open up to its borders, because no sample lies off the plane.
    assert!(frame.raw.texels.iter().all(|&a| (a - 1.0).abs() < 2e-3));
}

#[test]
fn edges_are_where_surfaces_meet_that_are_further_apart_than_sigma() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::two_layers();
    let frame = rig::render(context.gl(), &shot, SIZE, &multisample(shot.radius));
    // The two plates have four silhouettes each, against what is behind them. No other pixel is an edge.
    let near = |z: f32| if z.is_infinite() { 2 } else { u8::from(z > 6.5) };
    let count = |edge: bool| {
        let all = (0..frame.edges.texels.len()).filter(|&i| frame.edges.texels[i] == edge);
        all.map(|i| {
            let layers: Vec<u8> = frame.samples.iter().map(|image| near(image.texels[i])).collect();
            assert_eq!(layers.iter().any(|&layer| layer != layers[0]), edge, "{layers:?}");
        })
        .count()
    };
    assert!(count(true) > 100 && count(false) > 3000);
    // With so large a sigma, all surfaces count as one, but the background does not.
    let settings = Settings { blur_depth_sigma: Some(1e3), ..multisample(shot.radius) };
    let merged = rig::render(context.gl(), &shot, SIZE, &settings);
    let edges = |frame: &Frame| frame.edges.texels.iter().filter(|&&e| e).count();
    assert!(edges(&merged) > 0 && edges(&merged) < edges(&frame));
}

#[test]
fn only_edge_pixels_are_blurred_differently() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let shot = scenes::cornell_box();
        for (kernel, half_res) in
            [(BlurKernel::Separable, false), (BlurKernel::Full, false), (BlurKernel::Separable, true)]
        {
            let on = Settings { blur_kernel: kernel, half_res, ..multisample(300.0) };
            let off = Settings { edges: Edges::Off, ..on.clone() };
            let [on, off] = [on, off].map(|settings| rig::render(context.gl(), &shot, SIZE, &settings));
            assert_eq!((&on.edges, &on.raw), (&off.edges, &off.raw));
            let mut changed = 0;
            for i in 0..on.ao.texels.len() {
                let same = on.ao.texels[i].to_bits() == off.ao.texels[i].to_bits();
                assert!(same || on.edges.texels[i], "pixel {i} is no edge but has changed");
                changed += usize::from(!same);
            }
            assert!(changed > 20, "{changed}");
        }
    }
}

/// The strength closes every surface that has an occluder, so the remaining visibility is the share of background.
#[test]
fn a_background_sample_counts_as_open() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::floor_and_wall();
    let settings = Settings { strength: 1e6, bias: 0.0, ..multisample(1.5) };
    let frame = rig::render(context.gl(), &shot, SIZE, &settings);
    let mut mixed = 0;
    for y in 0..frame.depth.height {
        for x in 0..frame.depth.width {
            let samples: Vec<f32> = frame.samples.iter().map(|image| image.at(x, y)).collect();
            let open = samples.iter().filter(|z| z.is_infinite()).count();
            // The pixel counts if every surface around it is closed.
            let closed = (y.saturating_sub(4)..(y + 5).min(61)).all(|j| {
                (x.saturating_sub(4)..(x + 5).min(97))
                    .all(|i| frame.depth.at(i, j).is_infinite() || frame.raw.at(i, j) == 0.0)
            });
            if closed && open > 0 && open < 4 {
                mixed += 1;
                let (got, expected) = (frame.ao.at(x, y), open as f32 / 4.0);
                assert!((got - expected).abs() < 1e-5, "{got} not {expected}");
            }
        }
    }
    assert!(mixed > 10, "only {mixed} such pixels");
}

#[test]
fn the_colour_of_an_edge_is_the_mean_of_its_samples() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::two_layers();
    let frame = rig::render(context.gl(), &shot, SIZE, &multisample(shot.radius));
    let camera = shot.camera(SIZE);
    let size = (SIZE.0 as usize, SIZE.1 as usize);
    let seen = FOUR_SAMPLES.map(|at| reference::gbuffer::gbuffer(&shot.mesh, &camera, size, Normals::Derivative, at));
    // The background is white, 255. A pixel with k samples of background is at least that white.
    let mut edges = 0;
    for y in 0..size.1 {
        for x in 0..size.0 {
            let open = seen.iter().filter(|image| image.at(x, y).depth.is_infinite()).count();
            if frame.edges.at(x, y) && open > 0 {
                edges += 1;
                let least = frame.colour.at(x, y).into_iter().min().unwrap();
                assert!(f64::from(least) >= 255.0 * open as f64 / 4.0 - 1.0, "{least} with {open}");
                assert!(open == 4 || least < 255);
            }
        }
    }
    assert!(edges > 50);
}

/// The truth here is 1/2 on edges and 1 elsewhere, so all of the error of A = 1 is on edges.
#[test]
fn errors_of_one_sample_a_pixel_are_told_apart_on_edges() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::box_on_a_floor();
    let camera = shot.camera(SIZE);
    let view = Shot { mesh: &shot.mesh, camera: &camera, size: SIZE };
    let frame = rig::render(context.gl(), &shot, SIZE, &multisample(shot.radius));
    let open = Settings { method: Method::None, msaa: 1, ..multisample(shot.radius) };
    let edges = trade::edges(context.gl(), view, &open).unwrap();
    assert_eq!(edges, frame.edges);
    // Only edge pixels whose own centre shows a surface are measured. The centre of the others shows background.
    let covered = rig::render(context.gl(), &shot, SIZE, &open).covered();
    let on_edges = (0..edges.texels.len()).filter(|&i| edges.texels[i] && covered.texels[i]).count();
    let all_edges = edges.texels.iter().filter(|&&edge| edge).count();
    assert!(on_edges > 50 && on_edges < all_edges, "{on_edges} of {all_edges}");
    let truth = TruthImage { visibility: edges.map(|edge| if edge { 0.5 } else { 1.0 }), covered };
    let rows = trade::measure(context.gl(), view, &truth, &[open], 1, || {}).unwrap();
    let (all, edge) = (rows[0].errors, rows[0].edge_errors.unwrap());
    assert_eq!([edge.rmse, edge.mae, edge.bias, edge.max], [0.5; 4]);
    assert_eq!(edge.pixels, on_edges);
    assert!((all.bias * all.pixels as f64 - edge.bias * edge.pixels as f64).abs() < 1e-9);
    // FLIP also depends on what is around a pixel, so only its order is checked.
    assert!(edge.flip.is_none_or(|flip| flip > all.flip.unwrap_or(1.0)));
}

#[test]
fn the_supersampling_blur_leaves_a_fraction_of_the_error_on_edges() {
    for shot in [scenes::cornell_box(), scenes::box_on_a_floor(), scenes::ball()] {
        let [plain, supersampled] = rig::errors_on_edges(&shot, (160, 120));
        // The measured ratios are 0.15, 0.26 and 0.36.
        assert!(supersampled < 0.5 * plain, "{}: {supersampled} of {plain}", shot.name);
    }
}

#[test]
fn an_application_may_bring_its_own_depth_samples() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::cornell_box();
    let settings = multisample(shot.radius);
    let camera = shot.camera(SIZE);
    let mut pipeline = Pipeline::new(context.gl(), SIZE, &settings, Request::default()).unwrap();
    pipeline.render(&shot.mesh, &camera).unwrap();
    let inputs = pipeline.inputs(&camera);
    let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
    let texels = (SIZE.0 * SIZE.1) as usize;
    let with = rig::by_hand::read_red(context.gl(), ao.render(&inputs).unwrap(), texels);
    assert_eq!(with, pipeline.ao().unwrap().texels);
    let without = Inputs { samples: None, ..inputs };
    let plain = rig::by_hand::read_red(context.gl(), ao.render(&without).unwrap(), texels);
    assert_ne!(plain, with);
    assert_eq!(rig::by_hand::read_red(context.gl(), ao.render(&inputs).unwrap(), texels), with, "as before");

    let samples = inputs.samples.unwrap();
    for (wrong, part) in [
        (DepthSamples { samples: 8, ..samples }, "has 4 samples per pixel, but 8 were declared"),
        (DepthSamples { texture: inputs.depth.texture, ..samples }, "samples texture is not of the declared kind"),
    ] {
        let error = ao.render(&Inputs { samples: Some(wrong), ..inputs }).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn sixteen_bit_depth_and_vertex_normals_resolve_too() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let shot = scenes::ball();
    let settings = Settings { depth_format: DepthFormat::R16f, normals: Normals::Vertex, ..multisample(shot.radius) };
    let frame = rig::render(context.gl(), &shot, SIZE, &settings);
    rig::twin::hold_gbuffer(&frame, &shot, SIZE, &settings, "r16f, vertex normals");
    rig::twin::hold_edges(&frame, &settings, "r16f");
    hold("samples", &frame.samples[0], &frame.depth, &frame.covered(), everywhere(0.0), "the first sample is resolved");
}
