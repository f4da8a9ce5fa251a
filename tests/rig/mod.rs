//! What the tests of the renderer share: scenes, rendering them, hand-made inputs, and the image comparator.
// Each test file is a crate of its own that uses its part of this.
#![allow(dead_code, unused_imports, unreachable_pub)]

pub mod by_hand;
pub mod compare;
pub mod process;
pub mod scenes;
pub mod twin;

pub use compare::{Limits, compare, everywhere, hold};
pub use scenes::Shot;

use hbao::context::Backend;
use hbao::image::Image;
use hbao::reference;
use hbao::scene::Projection;
use hbao::settings::Radius;
use hbao::{Apply, Pipeline, Request, Settings, rotation_tile};
use std::sync::Arc;

pub const BOTH: [Backend; 2] = [Backend::Egl, Backend::Osmesa];

/// Odd, and neither side a multiple of the tile's.
pub const SIZE: (u32, u32) = (97, 61);

/// Everything that the pipeline makes of a shot, read back.
#[derive(PartialEq, Debug)]
pub struct Frame {
    pub depth: Image<f32>,
    pub normals: Image<[f32; 3]>,
    pub colour: Image<[u8; 3]>,
    pub raw: Image<f32>,
    pub ao: Image<f32>,
    pub composite: Image<[u8; 3]>,
    pub tile: Image<[f32; 3]>,
    pub projection: Projection,
    pub near: f64,
    pub notices: Vec<String>,
}

impl Frame {
    pub fn covered(&self) -> Image<bool> {
        self.depth.map(f32::is_finite)
    }

    pub fn inputs(&self) -> reference::Inputs<'_> {
        let Frame { depth, normals, tile, projection, near, .. } = self;
        reference::Inputs { depth, normals, tile, projection: *projection, near: *near }
    }
}

/// The shot through the whole pipeline, in the context at hand.
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
    let request = Request { composite: Some(apply), raw: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, size, settings, request).unwrap();
    frame(&mut pipeline, shot, size, settings)
}

/// What a pipeline that makes all images renders of a shot, read back.
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
        tile: rotation_tile(settings),
        projection: camera.projection,
        near: camera.near,
        notices: pipeline.notices().to_vec(),
    }
}

/// Panics where two frames differ in any bit.
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
        ("notices", got.notices == expected.notices),
    ];
    let different: Vec<_> = same.iter().filter(|(_, same)| !same).map(|(name, _)| name).collect();
    assert!(different.is_empty(), "{different:?} differ\n{context}");
}

/// Settings that use every value of every switch, four at most at once.
pub fn every_switch() -> Vec<Settings> {
    use hbao::settings::{
        AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Grounding, Jitter, Method, NormalFormat, Normals, Snap,
        SsaoDepth, SsaoRotation, Toggle,
    };
    let method = |method, radius| Settings { radius: Radius::Units(radius), ..Settings::for_method(method) };
    // Its own blur is another's.
    let ssao = || Settings { blur: 0, ..method(Method::Ssao, 100.0) };
    let base = |radius: f64| Settings { radius: Radius::Units(radius), ..Settings::default() };
    vec![
        base(150.0),
        Settings { snap: Snap::Sample, attenuation: Attenuation::Linear, ao_format: AoFormat::R16f, ..base(200.0) },
        Settings { snap: Snap::None, attenuation: Attenuation::None, ao_format: AoFormat::R32f, ..base(100.0) },
        Settings { clamp: Clamp::Depth, bias: 0.3, normal_format: NormalFormat::Rgba16f, blur: 0, ..base(150.0) },
        Settings { normals: Normals::Vertex, jitter: Jitter::None, blur_kernel: BlurKernel::Full, ..base(150.0) },
        Settings { bias: 0.3, strength: 2.0, ..method(Method::HbaoTalk, 150.0) },
        method(Method::RayMarch, 100.0),
        method(Method::Microsphere, 100.0),
        method(Method::Crease, 100.0),
        method(Method::None, 100.0),
        ssao(),
        Settings { ssao_samples: 8, ssao_rotation: SsaoRotation::Mirror, ssao_depth: SsaoDepth::Half, ..ssao() },
        Settings { ssao_samples: 24, ssao_normals: Toggle::On, ssao_curve: Toggle::Off, ..ssao() },
        Settings { ssao_normals: Toggle::On, ssao_depth: SsaoDepth::Half, jitter: Jitter::None, ..ssao() },
        Settings { grounding: Grounding::Direction, depth_format: DepthFormat::R16f, blur: 21, ..base(150.0) },
    ]
}

/// Default settings but for what a comparison in float needs, and a radius.
pub fn float_settings(radius: f64) -> Settings {
    Settings {
        radius: Radius::Units(radius),
        ao_format: hbao::settings::AoFormat::R32f,
        normal_format: hbao::settings::NormalFormat::Rgba16f,
        ..Settings::default()
    }
}
