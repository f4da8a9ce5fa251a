//! Tests with a driver that refuses each call in turn. Each run must end in one error that names the pass and the
//! object, or in the correct image. It must leave nothing behind, and the next run must work.

mod rig;

use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::scene::Projection;
use hbao::settings::{AoFormat, BlurKernel, Method, NormalFormat, Radius, SsaoDepth, Toggle};
use hbao::{
    AmbientOcclusion, Apply, DepthEncoding, Destination, Error, Inputs, NormalEncoding, Output, Pipeline, Request,
    Settings, TextureRef, TextureTarget, Viewport, Write,
};
use rig::by_hand::{ByHand, Textures, perspective, read_red, slope};
use rig::faults::{self, Fault, Told};
use rig::process::in_own_process;
use rig::stored::{Depths, Stored};
use rig::{Shot, scenes};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::sync::Arc;

/// Both sides are odd, so that half resolution is rounded up.
const SIZE: (u32, u32) = (9, 7);

/// The result of a run: every image as numbers, and the notices about what was not done as requested.
#[derive(Clone, Debug, PartialEq)]
struct Images {
    texels: Vec<(&'static str, Vec<f32>)>,
    notices: Vec<String>,
    samples: u32,
}

type Run = Box<dyn Fn(&Arc<glow::Context>) -> Result<Images, Error>>;

/// A way to use the library, from an empty context to images that are read back.
struct Scenario {
    name: &'static str,
    run: Run,
    /// The images that are also correct if the driver does less than was requested.
    lesser: Vec<Images>,
}

fn pipeline(gl: &Arc<glow::Context>, settings: &Settings, request: Request) -> Result<Images, Error> {
    let shot: Shot = scenes::box_on_a_floor();
    let mut pipeline = Pipeline::new(gl, SIZE, settings, request)?;
    pipeline.render(&shot.mesh, &shot.camera(SIZE))?;
    let rgb = |image: Image<[u8; 3]>| image.texels.into_iter().flatten().map(f32::from).collect();
    let mut texels = vec![
        ("depth", pipeline.depth()?.texels),
        ("normals", pipeline.normals()?.texels.into_iter().flatten().collect()),
        ("colour", rgb(pipeline.colour()?)),
        ("ao", pipeline.ao()?.texels),
    ];
    for samples in pipeline.depth_samples()?.into_iter().skip(1) {
        texels.push(("depth of a sample", samples.texels));
    }
    if let Some(raw) = pipeline.ao_raw() {
        texels.push(("raw ao", raw.texels.clone()));
    }
    if let Some(edges) = pipeline.edges() {
        texels.push(("edges", edges.texels.iter().map(|&edge| f32::from(u8::from(edge))).collect()));
    }
    if let Some(image) = pipeline.composite()? {
        texels.push(("composite", rgb(image)));
    }
    Ok(Images { texels, notices: pipeline.notices().to_vec(), samples: pipeline.samples() })
}

fn small(method: Method) -> Settings {
    Settings { radius: Radius::Units(0.8), directions: 2, steps: 1, blur: 3, ..Settings::for_method(method) }
}

/// A step in a plane, and background.
fn view() -> ByHand {
    let projection: Projection = perspective(60.0, SIZE);
    let depth = Image::from_fn(SIZE.0 as usize, SIZE.1 as usize, |x, y| match slope(projection, SIZE, x, y) {
        [_, v] if v > 0.4 => f32::INFINITY,
        _ if x > 4 => 3.0,
        _ => 3.3,
    });
    ByHand { normals: depth.map(|_| [0.0, 0.0, -1.0]), depth, projection }
}

/// Renders as in an application's context, with textures that are not the library's.
fn embedded(gl: &Arc<glow::Context>, (whole, textures): (&glow::Context, &Textures)) -> Result<Images, Error> {
    let settings = Settings { half_res: true, ..small(Method::Hbao) };
    let mut ao = AmbientOcclusion::new(gl.clone(), (4, 5), &Settings { blur: 0, ..settings.clone() })?;
    ao.resize(SIZE)?;
    let image = ao.render(&textures.inputs)?;
    let smaller = [SIZE.0.div_ceil(2), SIZE.1.div_ceil(2)].iter().product::<u32>();
    let mut texels = vec![("unblurred", read_red(whole, image, smaller as usize))];
    ao.set(&settings)?;
    let image = ao.render(&textures.inputs)?;
    texels.push(("ao", read_red(whole, image, (SIZE.0 * SIZE.1) as usize)));
    let to = texture(whole);
    ao.render_into(&textures.inputs, &Output::new(Destination::Texture(to), Write::Multiplied(0.5)))?;
    texels.push(("multiplied", read_red(whole, to, (SIZE.0 * SIZE.1) as usize)));
    Ok(Images { texels, notices: Vec::new(), samples: 1 })
}

/// Makes a texture of one grey in an application's context.
fn texture(gl: &glow::Context) -> TextureRef {
    let (kind, grey) = (glow::TEXTURE_RECTANGLE, vec![128; 4 * (SIZE.0 * SIZE.1) as usize]);
    // SAFETY: the context is current, and the bytes are those of every texel.
    unsafe {
        let texture = gl.create_texture().unwrap();
        gl.bind_texture(kind, Some(texture));
        let (data, w, h) = (glow::PixelUnpackData::Slice(Some(&grey)), SIZE.0 as i32, SIZE.1 as i32);
        gl.tex_image_2d(kind, 0, glow::RGBA8 as i32, w, h, 0, glow::RGBA, glow::UNSIGNED_BYTE, data);
        TextureRef { texture, target: TextureTarget::Rectangle }
    }
}

/// Renders from a depth buffer without normals, and looks for what is wrong with them.
fn from_an_engine(gl: &Arc<glow::Context>, (whole, inputs): (&glow::Context, &Inputs)) -> Result<Images, Error> {
    let settings = small(Method::Hbao);
    let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings)?;
    let image = ao.render(inputs)?;
    let mut texels = vec![("ao", read_red(whole, image, (SIZE.0 * SIZE.1) as usize))];
    texels.push(("findings", vec![ao.diagnose(inputs)?.len() as f32]));
    Ok(Images { texels, notices: Vec::new(), samples: 1 })
}

/// A context, the same context behind a driver that refuses, and what to render in it.
struct Bench {
    plain: Arc<glow::Context>,
    refusing: Arc<glow::Context>,
    scenarios: Vec<Scenario>,
}

/// One scenario has every pass that can run together, with timers. Another has the other passes. The last two use a
/// caller's own textures.
fn scenarios(context: &Context) -> Vec<Scenario> {
    let everything =
        Request { composite: Some(Apply::All), raw: true, edges: true, timings: true, ..Request::default() };
    let multisample = Settings { msaa: 4, ..small(Method::Hbao) };
    let half = Settings {
        msaa: 1,
        blur_kernel: BlurKernel::Full,
        half_res: true,
        ao_format: AoFormat::R32f,
        ssao_depth: SsaoDepth::Half,
        ssao_normals: Toggle::On,
        ssao_samples: 8,
        ..small(Method::Ssao)
    };
    let textures = Textures::new(context.gl(), &view(), TextureTarget::Texture2d, NormalEncoding::Signed);
    let mut all = Vec::new();
    for (name, settings, request) in [
        ("multisample", multisample, everything),
        ("half", half, Request { raw: true, colour: true, ..Request::default() }),
    ] {
        let lesser = [(settings.normal_format, 1), (NormalFormat::Rgba16f, 4), (NormalFormat::Rgba16f, 1)].map(
            |(normal_format, msaa)| {
                let settings = Settings { normal_format, msaa: settings.msaa.min(msaa), ..settings.clone() };
                pipeline(context.gl(), &settings, request).unwrap()
            },
        );
        let run = Box::new(move |gl: &Arc<glow::Context>| pipeline(gl, &settings, request));
        all.push(Scenario { name, run, lesser: lesser.into() });
    }
    let whole = context.gl().clone();
    let run = Box::new(move |gl: &Arc<glow::Context>| embedded(gl, (&whole, &textures)));
    all.push(Scenario { name: "embedded", run, lesser: Vec::new() });
    let (whole, view) = (context.gl().clone(), view());
    let depth_encoding = DepthEncoding::standard(0.1, 100.0);
    let (format, target) = (Depths::Bits24AndStencil, TextureTarget::Layer(1));
    let depth = Stored::new(&whole, &view, depth_encoding, format, target).image;
    let viewport = Some(Viewport { x: 0, y: 0, width: SIZE.0, height: SIZE.1 });
    let textures = Textures::new(&whole, &view, TextureTarget::Texture2d, NormalEncoding::Signed);
    let inputs = Inputs { depth, depth_encoding, normals: None, viewport, ..textures.inputs };
    let run = Box::new(move |gl: &Arc<glow::Context>| from_an_engine(gl, (&whole, &inputs)));
    all.push(Scenario { name: "engine", run, lesser: Vec::new() });
    all
}

/// The results of many runs: what was wrong, and which places the errors named.
#[derive(Default)]
struct Report {
    runs: usize,
    errors: BTreeMap<String, usize>,
    fallbacks: usize,
    unharmed: usize,
    wrong: Vec<String>,
}

/// Restores the state that a refused call has not restored, because the pipeline relies on OpenGL's initial state.
fn initial_state(gl: &glow::Context) {
    // SAFETY: the context is current, and nothing is drawn.
    unsafe {
        for switch in [glow::DEPTH_TEST, glow::STENCIL_TEST, glow::BLEND, glow::RASTERIZER_DISCARD] {
            gl.disable(switch);
        }
        gl.color_mask(true, true, true, true);
        gl.depth_mask(true);
        gl.stencil_mask(0xff);
        gl.polygon_mode(glow::FRONT_AND_BACK, glow::FILL);
        for (parameter, value) in [
            (glow::PACK_ALIGNMENT, 4),
            (glow::PACK_ROW_LENGTH, 0),
            (glow::PACK_SKIP_PIXELS, 0),
            (glow::PACK_SKIP_ROWS, 0),
            (glow::PACK_SWAP_BYTES, 0),
            (glow::PACK_LSB_FIRST, 0),
            (glow::UNPACK_ALIGNMENT, 4),
            (glow::UNPACK_ROW_LENGTH, 0),
            (glow::UNPACK_SKIP_PIXELS, 0),
            (glow::UNPACK_SKIP_ROWS, 0),
            (glow::UNPACK_SWAP_BYTES, 0),
            (glow::UNPACK_LSB_FIRST, 0),
        ] {
            gl.pixel_store_i32(parameter, value);
        }
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
}

/// Renders with a fault and judges the result.
fn one_fault(gl: &Arc<glow::Context>, scenario: &Scenario, whole: &Images, fault: Fault, report: &mut Report) -> Told {
    let caught = std::panic::AssertUnwindSafe(|| faults::run(gl, Some(fault), || (scenario.run)(gl)));
    let Ok((result, told)) = std::panic::catch_unwind(caught) else {
        panic!("{}: panics at {fault:?}", scenario.name);
    };
    if !told.struck && fault != Fault::NoResult {
        return told;
    }
    report.runs += 1;
    let mut wrong = |what: String| report.wrong.push(format!("{}, {fault:x?}: {what}", scenario.name));
    match result {
        Err(Error::Gl { place, what, .. }) => {
            if place.is_empty() || what.is_empty() || (place.clone() + &what).contains('\n') {
                wrong(format!("{place:?}: {what:?}"));
            }
            let error = match fault {
                Fault::Ignored { error, .. } | Fault::Refused { error, .. } | Fault::Error { error, .. } => Some(error),
                _ => None,
            };
            if what.contains("transform feedback") && error != Some(glow::INVALID_OPERATION) {
                wrong(format!("a wrong diagnosis: {what}"));
            }
            *report.errors.entry(format!("{place}: {what}")).or_default() += 1;
        }
        Err(other) => wrong(format!("another kind of error: {other:?}")),
        Ok(images) if images == *whole => report.unharmed += 1,
        Ok(images) if scenario.lesser.iter().any(|lesser| lesser.texels == images.texels) => {
            report.fallbacks += 1;
            if images.samples == whole.samples && images.notices.is_empty() {
                wrong("it does less, but gives no notice".into());
            }
        }
        Ok(images) => {
            let differ: Vec<_> =
                images.texels.iter().filter(|image| !whole.texels.contains(image)).map(|i| i.0).collect();
            wrong(format!("wrong images and no error: {differ:?}, {:?}, {} samples", images.notices, images.samples));
        }
    }
    for (what, list) in [("left behind", &told.left), ("deleted twice", &told.twice)] {
        if !list.is_empty() {
            wrong(format!("{what}: {list:?}"));
        }
    }
    if let Some(error) = told.pending {
        wrong(format!("an error is left in OpenGL: 0x{error:x}"));
    }
    told
}

impl Report {
    fn close(self, what: &str) {
        let mut text =
            format!("{what}: {} faults, {} fallbacks, {} harmless", self.runs, self.fallbacks, self.unharmed);
        for (error, count) in &self.errors {
            let _ = write!(text, "\n    {count:5} x {error}");
        }
        println!("{text}");
        assert!(self.runs > 0, "{what}: no fault happened");
        let first = self.wrong.iter().take(40).map(|wrong| format!("\n  {wrong}")).collect::<String>();
        assert!(self.wrong.is_empty(), "{what}: {} of {} runs{first}", self.wrong.len(), self.runs);
    }
}

/// Tries `fault(0)`, `fault(1)` and so on, until the fault does not happen in a run.
fn every(what: &str, bench: &Bench, fault: impl Fn(usize) -> Fault) {
    let mut report = Report::default();
    let gl = &bench.refusing;
    for scenario in &bench.scenarios {
        let (whole, _) = faults::run(gl, None, || (scenario.run)(gl).unwrap());
        for nth in 0.. {
            if !one_fault(gl, scenario, &whole, fault(nth), &mut report).struck {
                break;
            }
            initial_state(&bench.plain);
        }
        let (again, _) = faults::run(gl, None, || (scenario.run)(gl).unwrap());
        assert_eq!(again, whole, "{what}: the next run");
    }
    report.close(what);
}

/// Runs a test in a process of its own with a shader cache, because the same shaders are compiled a thousand times.
/// Other tests check that the shaders are compiled correctly.
fn with_refusing_driver(name: &str, test: impl FnOnce(&Bench)) {
    let environment = [
        ("MESA_SHADER_CACHE_DISABLE", "false"),
        ("MESA_SHADER_CACHE_DIR", env!("CARGO_TARGET_TMPDIR")),
        ("LP_NUM_THREADS", "0"),
    ];
    in_own_process(name, &environment.map(|(name, value)| (name, OsStr::new(value))), || {
        let context = Context::open(Backend::Egl).unwrap();
        let (plain, scenarios) = (context.gl().clone(), scenarios(&context));
        test(&Bench { plain, refusing: faults::refusing(&context), scenarios });
    });
}

#[test]
fn a_framebuffer_that_is_incomplete_is_told() {
    with_refusing_driver("a_framebuffer_that_is_incomplete_is_told", |bench| {
        every("incomplete", bench, |nth| Fault::Incomplete { nth, status: glow::FRAMEBUFFER_UNSUPPORTED });
    });
}

#[test]
fn a_shader_that_does_not_compile_or_link_is_told() {
    with_refusing_driver("a_shader_that_does_not_compile_or_link_is_told", |bench| {
        every("not compiled", bench, |nth| Fault::NotCompiled { nth });
        every("not linked", bench, |nth| Fault::NotLinked { nth });
    });
}

#[test]
fn an_object_that_is_not_made_is_told() {
    with_refusing_driver("an_object_that_is_not_made_is_told", |bench| {
        every("nameless", bench, |nth| Fault::Nameless { nth });
    });
}

#[test]
fn an_error_from_nowhere_is_told_once() {
    with_refusing_driver("an_error_from_nowhere_is_told_once", |bench| {
        for error in [glow::OUT_OF_MEMORY, glow::INVALID_OPERATION] {
            every("error", bench, |nth| Fault::Error { nth, error });
        }
    });
}

#[test]
fn a_call_that_is_refused_is_told() {
    with_refusing_driver("a_call_that_is_refused_is_told", |bench| {
        every("ignored", bench, |nth| Fault::Ignored { nth, error: glow::INVALID_OPERATION });
    });
}

#[test]
fn a_call_that_finds_no_memory_is_told() {
    with_refusing_driver("a_call_that_finds_no_memory_is_told", |bench| {
        // The calls are the same as in the test above, so every third is enough.
        every("ignored", bench, |nth| Fault::Ignored { nth: 3 * nth, error: glow::OUT_OF_MEMORY });
        // Each call of glUseProgram is tried, because with another error code it is reported as active transform
        // feedback.
        let no_program = |nth| Fault::Refused { entry: "glUseProgram", nth, error: glow::OUT_OF_MEMORY };
        every("no program", bench, no_program);
    });
}

#[test]
fn a_context_lost_at_any_call_is_told() {
    with_refusing_driver("a_context_lost_at_any_call_is_told", |bench| {
        every("lost", bench, |nth| Fault::Lost { nth: 3 * nth });
    });
}

#[test]
fn a_query_without_a_result_leaves_the_clock() {
    with_refusing_driver("a_query_without_a_result_leaves_the_clock", |bench| {
        let mut report = Report::default();
        let (gl, scenario) = (&bench.refusing, &bench.scenarios[0]);
        let (whole, _) = faults::run(gl, None, || (scenario.run)(gl).unwrap());
        one_fault(gl, scenario, &whole, Fault::NoResult, &mut report);
        assert_eq!(report.unharmed, 1);
        report.close("no result");
    });
}

/// Returns the places that the errors name when each call of an entry point is refused in turn. A place that is named
/// for several calls in a row is listed once.
fn places(bench: &Bench, scenario: &Scenario, entry: &'static str) -> Vec<String> {
    let gl = &bench.refusing;
    let mut places = Vec::new();
    for nth in 0.. {
        let fault = Fault::Refused { entry, nth, error: glow::INVALID_OPERATION };
        let (result, told) = faults::run(gl, Some(fault), || (scenario.run)(gl));
        if !told.struck {
            break;
        }
        initial_state(&bench.plain);
        places.push(match result {
            Err(Error::Gl { place, what, .. }) if what == "invalid operation" => place,
            Err(Error::Gl { place, what, .. }) => format!("{place}: {what}"),
            Err(other) => format!("{other:?}"),
            Ok(images) if images.notices.is_empty() => "fewer samples".into(),
            Ok(_) => "another format".into(),
        });
    }
    places.dedup();
    places
}

/// While transform feedback is active, glUseProgram fails. The library therefore reports this failure as active
/// feedback.
const SAVING: &str = "ambient occlusion: transform feedback is active: call glEndTransformFeedback first";
const PUT_BACK: &str = "putting the application's state back";

/// The expected places, for everything with four samples and for half resolution without multisampling: the passes in
/// their order, each by what it draws with, and every image and buffer.
const PLACES: [(&str, &[&str], &[&str]); 9] = [
    (
        "glDrawArrays",
        &["probe", "resolve", "background", "ao", "edges", "blur_x", "blur_y", "blur_edges", "composite", "resolve"],
        &["probe", "background", "half_depth", "ao", "blur_full"],
    ),
    ("glDrawElements", &["gbuffer"], &["gbuffer"]),
    ("glClearBufferfv", &["gbuffer", "background"], &["gbuffer", "background"]),
    (
        "glUseProgram",
        &[
            "probe",
            SAVING,
            PUT_BACK,
            "gbuffer",
            "resolve",
            SAVING,
            "background",
            "ao",
            "edges",
            "blur_x",
            "blur_y",
            "blur_edges",
            PUT_BACK,
            "composite",
            SAVING,
            PUT_BACK,
            "resolve",
        ],
        &[
            "probe",
            SAVING,
            PUT_BACK,
            "gbuffer",
            SAVING,
            "background",
            "half_depth",
            "ao",
            "blur_full",
            PUT_BACK,
            SAVING,
            PUT_BACK,
        ],
    ),
    (
        "glTexImage2D",
        &[
            "another format",
            "gbuffer: depth",
            "gbuffer: normals",
            "gbuffer: colour",
            "ao: image",
            "blur: image",
            "composite: image",
            "ao: rotation tile",
            "blurred: image",
        ],
        &[
            "another format",
            "gbuffer: depth",
            "gbuffer: normals",
            "gbuffer: colour",
            "ao: image",
            "blur: image",
            "ao: rotation tile",
            "half_depth: image",
        ],
    ),
    (
        "glRenderbufferStorageMultisample",
        &["fewer samples", "ao: stencil"],
        &["gbuffer: depth buffer", "ao: stencil", "blur: stencil"],
    ),
    ("glBufferData", &["gbuffer: triangles"], &["gbuffer: triangles"]),
    ("glReadPixels", &["edges: reading them back"], &[]),
    (
        "glGetTexImage",
        &[
            "probe: image: reading it back",
            "ao: image: reading it back",
            "gbuffer: depth: reading it back",
            "gbuffer: normals: reading it back",
            "gbuffer: colour: reading it back",
            "blurred: image: reading it back",
            "gbuffer: depth: reading it back",
            "composite: image: reading it back",
        ],
        &[
            "probe: image: reading it back",
            "ao: image: reading it back",
            "gbuffer: depth: reading it back",
            "gbuffer: normals: reading it back",
            "gbuffer: colour: reading it back",
            "blur: image: reading it back",
            "gbuffer: depth: reading it back",
        ],
    ),
];

#[test]
fn what_is_refused_is_told_in_the_name_of_its_pass_and_object() {
    with_refusing_driver("what_is_refused_is_told_in_the_name_of_its_pass_and_object", |bench| {
        for (entry, multisample, half) in PLACES {
            for (scenario, expected) in bench.scenarios.iter().zip([multisample, half]) {
                assert_eq!(places(bench, scenario, entry), expected, "{entry}, {}", scenario.name);
            }
        }
    });
}

/// `src/reference/departures.md` states these numbers.
#[test]
fn the_pipeline_allocates_87_bytes_a_pixel_with_4_samples_and_26_with_one() {
    with_refusing_driver("the_pipeline_allocates_87_bytes_a_pixel_with_4_samples_and_26_with_one", |bench| {
        let gl = &bench.refusing;
        let request = Request { composite: Some(Apply::All), ..Request::default() };
        let shot = scenes::box_on_a_floor();
        for (msaa, bytes) in [(1, 26), (4, 87)] {
            let settings = Settings { msaa, radius: Radius::Units(shot.radius), ..Settings::default() };
            let allocated = |size: (u32, u32)| {
                let (samples, _) = faults::run(gl, None, || {
                    let mut pipeline = Pipeline::new(gl, size, &settings, request).unwrap();
                    pipeline.render(&shot.mesh, &shot.camera(size)).unwrap();
                    pipeline.samples()
                });
                assert_eq!(samples, msaa, "this driver gives another number of samples");
                faults::allocated()
            };
            // What does not grow with the picture, such as the rotation tile, is in both.
            let [small, large] = [(32, 24), (64, 24)].map(allocated);
            assert_eq!(large - small, bytes * 32 * 24, "{msaa} samples");
        }
    });
}
