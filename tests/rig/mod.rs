//! The code that the tests of the renderer share: scenes, rendering, hand-made inputs and the image comparator.
// Each test file is a crate of its own and uses only a part of this module.
#![allow(dead_code, unused_imports, unreachable_pub)]

pub mod by_hand;
#[cfg(feature = "cli")]
pub mod command;
pub mod compare;
pub mod cuts;
pub mod debug;
pub mod faults;
pub mod formats;
pub mod process;
pub mod random;
pub mod scenes;
pub mod stored;
pub mod surfaces;
pub mod twin;

pub use compare::{Limits, compare, everywhere, hold};
pub use scenes::Shot;

use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference;
use hbao::scene::Projection;
use hbao::settings::{AoFormat, Edges, Method, Radius};
use hbao::{Apply, Pipeline, Request, Settings, rotation_tile};
use std::sync::Arc;

pub const BOTH: [Backend; 2] = [Backend::Egl, Backend::Osmesa];

/// Both sides are odd, and neither is a multiple of the tile's side.
pub const SIZE: (u32, u32) = (97, 61);

pub const FOUR_SAMPLES: [[f64; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]];

/// All images that the pipeline makes of a shot, read back.
#[derive(PartialEq, Debug)]
pub struct Frame {
    pub depth: Image<f32>,
    pub normals: Image<[f32; 3]>,
    pub colour: Image<[u8; 3]>,
    pub raw: Image<f32>,
    pub ao: Image<f32>,
    pub composite: Image<[u8; 3]>,
    /// The depth of each sample if pixels have several, otherwise empty.
    pub samples: Vec<Image<f32>>,
    pub edges: Image<bool>,
    pub tile: Image<[f32; 3]>,
    pub projection: Projection,
    pub near: f64,
    pub notices: Vec<String>,
}

impl Frame {
    pub fn covered(&self) -> Image<bool> {
        self.depth.map(f32::is_finite)
    }

    /// Returns the positions of the samples relative to the pixel's centre, in pixels, with y up. With four samples
    /// this is the standard pattern, which llvmpipe uses. tests/passes/edges.rs compares it with the driver's answer.
    pub fn sample_positions(&self) -> &'static [[f64; 2]] {
        if self.samples.is_empty() { &[[0.0; 2]] } else { &FOUR_SAMPLES }
    }

    pub fn inputs(&self) -> reference::TwinInputs<'_> {
        let Frame { depth, normals, tile, projection, near, .. } = self;
        reference::TwinInputs { depth, normals, tile, projection: *projection, near: *near }
    }
}

/// Renders the shot with the whole pipeline in the given context.
pub fn render(gl: &Arc<glow::Context>, shot: &Shot, size: (u32, u32), settings: &Settings) -> Frame {
    render_applied(gl, shot, size, settings, Apply::All)
}

pub fn render_applied(
    gl: &Arc<glow::Context>,
    shot: &Shot,
    size: (u32, u32),
    settings: &Settings,
    apply: Apply,
) -> Frame {
    let request = Request { composite: Some(apply), raw: true, edges: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, size, settings, request).unwrap();
    frame(&mut pipeline, shot, size, settings)
}

/// Renders a shot with a pipeline that makes all images, and reads them back.
pub fn frame(pipeline: &mut Pipeline, shot: &Shot, size: (u32, u32), settings: &Settings) -> Frame {
    let camera = shot.camera(size);
    pipeline.render(&shot.mesh, &camera).unwrap();
    Frame {
        depth: pipeline.depth().unwrap(),
        normals: pipeline.normals().unwrap(),
        colour: pipeline.colour().unwrap(),
        raw: pipeline.ao_raw().unwrap().clone(),
        ao: pipeline.ao().unwrap(),
        composite: pipeline.composite().unwrap().unwrap(),
        samples: if pipeline.samples() > 1 { pipeline.depth_samples().unwrap() } else { Vec::new() },
        edges: pipeline.edges().unwrap().clone(),
        tile: rotation_tile(settings),
        projection: camera.projection,
        near: camera.near,
        notices: pipeline.notices().to_vec(),
    }
}

/// Panics if two frames differ in any bit.
#[track_caller]
pub fn assert_identical(got: &Frame, expected: &Frame, context: &str) {
    let floats = |image: &Image<f32>| image.map(f32::to_bits);
    let same = [
        ("depth", floats(&got.depth) == floats(&expected.depth)),
        ("normals", got.normals.map(|n| n.map(f32::to_bits)) == expected.normals.map(|n| n.map(f32::to_bits))),
        ("colour", got.colour == expected.colour),
        ("raw ambient occlusion", floats(&got.raw) == floats(&expected.raw)),
        ("ambient occlusion", floats(&got.ao) == floats(&expected.ao)),
        ("composite", got.composite == expected.composite),
        ("samples", got.samples.iter().map(floats).eq(expected.samples.iter().map(floats))),
        ("edges", got.edges == expected.edges),
        ("notices", got.notices == expected.notices),
    ];
    let different: Vec<_> = same.iter().filter(|(_, same)| !same).map(|(name, _)| name).collect();
    assert!(different.is_empty(), "{different:?} differ\n{context}");
}

/// Returns every method that computes something, in the order of the list of methods.
pub fn methods() -> impl Iterator<Item = Method> {
    Method::ALL.iter().copied().filter(|method| computes(*method))
}

/// Whether a method has a pass of its own. `none` does not, and leaves every pixel open.
pub fn computes(method: Method) -> bool {
    !method.facts().samples.is_empty()
}

/// Returns settings with float formats and the method's own defaults, but without a blur.
pub fn raw(method: Method, radius: f64) -> Settings {
    (method.facts().defaults)(Settings { method, blur: 0, ..float_settings(radius) })
}

/// Returns the settings, but with samples that are evenly spaced if all steps are rounded at once, which needs that.
pub fn evenly_if_stepping(settings: Settings) -> Settings {
    let spacing = if settings.snap == hbao::settings::Snap::Step { 1.0 } else { settings.spacing };
    Settings { spacing, ..settings }
}

/// Returns settings that use every method and every value of every switch, at most four of them at once.
pub fn every_switch() -> Vec<Settings> {
    use hbao::settings::{
        Attenuation, BlurKernel, Clamp, DepthFormat, Exit, Grounding, Jitter, NormalFormat, Normals, Quadrature, Snap,
        SsaoDepth, SsaoRotation, Toggle, Zenith,
    };
    let method = |method, radius| Settings { radius: Radius::Units(radius), ..Settings::for_method(method) };
    let ssao = || method(Method::Ssao, 100.0);
    let base = |radius: f64| Settings { radius: Radius::Units(radius), ..Settings::default() };
    let chapter = [
        base(150.0),
        Settings { snap: Snap::Sample, attenuation: Attenuation::Linear, ao_format: AoFormat::R16f, ..base(200.0) },
        Settings { snap: Snap::None, attenuation: Attenuation::None, ao_format: AoFormat::R32f, ..base(100.0) },
        Settings {
            clamp: Clamp::Depth,
            bias: 0.3,
            msaa: 8,
            normal_format: NormalFormat::Rgba16f,
            blur: 0,
            ..base(150.0)
        },
        Settings { normals: Normals::Vertex, jitter: Jitter::None, blur_kernel: BlurKernel::Full, ..base(150.0) },
    ];
    // These are the methods that are not listed here for switches of their own.
    let listed = [Settings::default().method, Method::Ssao];
    let others = Method::ALL.iter().filter(|other| !listed.contains(other)).map(|&other| {
        let strong = Settings { bias: 0.3, strength: 2.0, ..method(other, 150.0) };
        if other.reads("bias") { strong } else { method(other, 100.0) }
    });
    let more = [
        Settings { edges: Edges::Off, msaa: 2, ..base(150.0) },
        // Where W differs, the mean of two ends hangs on whether samples of a plane, which do not rise above its
        // tangent, are accepted all the same: there is no telling on the planes of these scenes.
        Settings {
            zenith: Zenith::Axis,
            quadrature: Quadrature::Mean,
            spacing: 1.5,
            attenuation: Attenuation::None,
            ..method(Method::HbaoView, 157.0)
        },
        Settings { half_res: true, ..base(400.0) },
        Settings { half_res: true, blur_kernel: BlurKernel::Full, msaa: 1, ..base(400.0) },
        Settings { half_res: true, blur: 0, ..base(400.0) },
        ssao(),
        Settings { ssao_samples: 8, ssao_rotation: SsaoRotation::Mirror, ssao_depth: SsaoDepth::Half, ..ssao() },
        Settings {
            ssao_samples: 24,
            ssao_normals: Toggle::On,
            ssao_curve: Some(Toggle::Off),
            half_res: true,
            ..ssao()
        },
        Settings {
            ssao_normals: Toggle::On,
            ssao_curve: Some(Toggle::On),
            ssao_depth: SsaoDepth::Half,
            jitter: Jitter::None,
            blur: 0,
            ..ssao()
        },
        Settings { grounding: Grounding::Direction, depth_format: DepthFormat::R16f, blur: 21, ..base(150.0) },
        Settings {
            quadrature: Quadrature::End,
            spacing: 1.3,
            snap: Snap::None,
            attenuation: Attenuation::Linear,
            steps: 5,
            ..method(Method::HbaoView, 293.0)
        },
        Settings {
            snap: Snap::Step,
            spacing: 1.0,
            quadrature: Quadrature::Interval,
            attenuation: Attenuation::Linear,
            clamp: Clamp::Depth,
            jitter: Jitter::None,
            ..method(Method::HbaoView, 150.0)
        },
        Settings { exit: Exit::Shorten, steps: 24, ..base(100.0) },
        Settings { exit: Exit::Shorten, steps: 40, half_res: true, strength: 3.0, ..base(403.0) },
        Settings { radius: Radius::OfView(0.2), ..base(1.0) },
    ];
    chapter.into_iter().chain(others).chain(more).collect()
}

/// Returns the settings for a scene that is scaled by this factor.
pub fn scaled(settings: &Settings, factor: f64) -> Settings {
    let radius = settings.radius.units().map_or(settings.radius, |radius| Radius::Units(radius * factor));
    Settings { radius, ..settings.clone() }
}

/// Returns the default settings, except for the given radius and for what a comparison in float needs.
pub fn float_settings(radius: f64) -> Settings {
    Settings {
        radius: Radius::Units(radius),
        ao_format: AoFormat::R32f,
        normal_format: hbao::settings::NormalFormat::Rgba16f,
        msaa: 1,
        ..Settings::default()
    }
}

/// Returns the mean error of ambient occlusion on edge pixels, first with the plain blur and then with the
/// supersampling one. The truth is ambient occlusion at four times the size, with a blur of four times as many pixels,
/// averaged down.
pub fn errors_on_edges(shot: &Shot, size: (u32, u32)) -> [f64; 2] {
    let context = Context::open(Backend::Egl).unwrap();
    let base = Settings { radius: Radius::Units(shot.radius), ao_format: AoFormat::R32f, ..Settings::default() };
    let large = Settings { msaa: 1, blur: 35, ..base.clone() };
    let large = render(context.gl(), shot, (4 * size.0, 4 * size.1), &large).ao;
    let truth = Image::from_fn(size.0 as usize, size.1 as usize, |x, y| {
        let all = (0..16).map(|i| f64::from(large.at(4 * x + i % 4, 4 * y + i / 4)));
        all.sum::<f64>() / 16.0
    });
    [Edges::Off, Edges::Supersample].map(|edges| {
        let frame = render(context.gl(), shot, size, &Settings { edges, ..base.clone() });
        let on_edges: Vec<f64> = (0..truth.texels.len())
            .filter(|&i| frame.edges.texels[i])
            .map(|i| (f64::from(frame.ao.texels[i]) - truth.texels[i]).abs())
            .collect();
        assert!(on_edges.len() > 50);
        on_edges.iter().sum::<f64>() / on_edges.len() as f64
    })
}
