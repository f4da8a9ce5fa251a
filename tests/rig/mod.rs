//! What the tests of the renderer share: scenes, rendering them, hand-made inputs, and the image comparator.
// Each test file is a crate of its own that uses its part of this.
#![allow(dead_code, unused_imports, unreachable_pub)]

pub mod by_hand;
pub mod compare;
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
    pub notices: Vec<String>,
}

impl Frame {
    pub fn covered(&self) -> Image<bool> {
        self.depth.map(f32::is_finite)
    }

    pub fn inputs(&self) -> reference::hbao::Inputs<'_> {
        let Frame { depth, normals, tile, projection, .. } = self;
        reference::hbao::Inputs { depth, normals, tile, projection: *projection }
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
    let camera = shot.camera(size);
    let request = Request { composite: Some(apply), raw: true, timings: false };
    let mut pipeline = Pipeline::new(gl, size, settings, request).unwrap();
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
        notices: pipeline.notices().to_vec(),
    }
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
