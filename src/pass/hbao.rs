//! Horizon-based ambient occlusion (ShaderX7 6.2) and the rotation tile that jitters it.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, RAY, TextureRef, TextureTarget, depth_defines, pixel_extent};
use crate::Error;
use crate::gl::{Defines, Format, Program, Texture, source};
use crate::scene::Projection;
use crate::settings::{Jitter, Settings};
use crate::tile::{self, rotation_tile};
use std::fmt::Write;
use std::sync::Arc;

/// How the stored normals encode a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NormalEncoding {
    /// Components in [-1, 1] (SNORM or float).
    Signed,
    /// Components c stored as c/2 + 1/2 (UNORM).
    Biased,
}

/// What the shader is compiled for, beside the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Variant {
    pub(crate) orthographic: bool,
    pub(crate) depth: TextureTarget,
    pub(crate) normals: TextureTarget,
    pub(crate) encoding: NormalEncoding,
    /// The fetch floor: every fetch, and a sum in place of what is computed from it.
    pub(crate) floor: bool,
}

/// A larger R is taken for this one: it is past every scene (positions end at 1e15), and float32 holds its square.
const FARTHEST_RADIUS: f64 = 1e16;

/// The pass.
pub(crate) struct Hbao {
    program: Program,
    tile: Option<Texture>,
}

impl Hbao {
    /// Changes the rectangle texture binding of the active unit.
    pub(crate) fn new(gl: &Arc<glow::Context>, settings: &Settings, variant: Variant) -> Result<Hbao, Error> {
        let program = Program::new(gl, &defines(settings, variant), FULLSCREEN, &[FETCH, RAY, source!("hbao.frag")])?;
        let tile = match settings.jitter {
            Jitter::None => None,
            Jitter::Tile => {
                let texels: Vec<f32> =
                    rotation_tile(settings).texels.iter().flat_map(|&[c, s, b]| [c, s, b, 0.0]).collect();
                Some(Texture::of_floats(gl, "rotation tile", Format::Rgba32f, (4, 4), &texels)?)
            }
        };
        Ok(Hbao { program, tile })
    }

    /// Draws A into the bound target. `radius` is R in scene units.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        depth: &DepthInput,
        normals: TextureRef,
        projection: Projection,
        (radius, settings): (f64, &Settings),
    ) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        full_screen.bind_texture(1, normals);
        if let Some(tile) = &self.tile {
            full_screen.bind_texture(2, tile.into());
        }
        program
            .unit("normal_image", 1)
            .unit("tile", 2)
            .vec2("pixel", pixel_extent(projection, depth.size))
            .float("radius", radius.min(FARTHEST_RADIUS))
            .float("strength", settings.strength)
            .vec2("bias", [settings.bias.cos(), settings.bias.sin()]);
        full_screen.draw();
    }
}

/// Everything that `glsl/hbao.frag` is compiled for, in one place.
fn defines(settings: &Settings, variant: Variant) -> Defines {
    let mut directions = String::new();
    for [x, y] in tile::directions(settings.directions) {
        let separator = if directions.is_empty() { "" } else { ", " };
        let _ = write!(directions, "{separator}vec2({:?}, {:?})", x as f32, y as f32);
    }
    let mut defines = depth_defines(variant.depth)
        .value("N_D", settings.directions)
        .value("N_S", settings.steps)
        .value("DIRECTIONS", directions)
        .word("ATTENUATION", settings.attenuation.name())
        .word("SNAP", settings.snap.name())
        .word("CLAMP", settings.clamp.name())
        .word("GROUNDING", settings.grounding.name())
        .word("JITTER", settings.jitter.name());
    for (name, on) in [
        ("NORMALS_RECTANGLE", variant.normals == TextureTarget::Rectangle),
        ("NORMALS_BIASED", variant.encoding == NormalEncoding::Biased),
        ("ORTHOGRAPHIC", variant.orthographic),
        ("BIAS", settings.bias > 0.0),
        ("FLOOR", variant.floor),
    ] {
        if on {
            defines = defines.value(name, 1);
        }
    }
    defines
}
