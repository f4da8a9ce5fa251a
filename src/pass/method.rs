//! An ambient occlusion method as a pass. The methods read the same images and the same rotation tile, and differ in
//! their shaders: a file of its own each, here and in `glsl/`.

use super::{
    DepthInput, FETCH, FULLSCREEN, FullScreen, Grid, RAY, TextureRef, TextureTarget, depth_defines, half_depth, hbao,
    hbao_talk, microsphere, ray_march, ssao,
};
use crate::Error;
use crate::gl::{Defines, Format, Program, Source, Texture, source};
use crate::scene::Projection;
use crate::settings::{Jitter, Method, Settings};
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

/// What a method's shader is made of, beside what all have.
pub(super) struct Shader {
    pub(super) pieces: Vec<Source>,
    pub(super) defines: Defines,
}

pub(super) const SAMPLING: Source = source!("shared/sampling.glsl");
pub(super) const TANGENT: Source = source!("shared/tangent.glsl");

/// The pass.
pub(crate) struct MethodPass {
    program: Program,
    tile: Option<Texture>,
}

impl MethodPass {
    /// None for the method that has no pass, A = 1. Changes the rectangle texture binding of the active unit.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        settings: &Settings,
        variant: Variant,
    ) -> Result<Option<MethodPass>, Error> {
        let defines = defines(settings, variant);
        let shader = match settings.method {
            Method::Hbao => hbao::shader(settings, defines),
            Method::HbaoTalk => hbao_talk::shader(settings, defines),
            Method::RayMarch => ray_march::shader(settings, defines),
            Method::Microsphere | Method::Crease => microsphere::shader(settings, defines),
            Method::Ssao => ssao::shader(settings, defines),
            Method::None => return Ok(None),
        };
        let mut pieces = vec![FETCH, RAY, source!("shared/surface.glsl"), source!("shared/attenuation.glsl")];
        pieces.extend(shader.pieces);
        let program = Program::new(gl, &shader.defines, FULLSCREEN, &pieces)?;
        let tile = match settings.jitter {
            Jitter::None => None,
            Jitter::Tile => {
                let texels: Vec<f32> =
                    rotation_tile(settings).texels.iter().flat_map(|&[c, s, b]| [c, s, b, 0.0]).collect();
                Some(Texture::of_floats(gl, "ao: rotation tile", Format::Rgba32f, (4, 4), &texels)?)
            }
        };
        Ok(Some(MethodPass { program, tile }))
    }

    /// Draws A into the bound target, whose texels `grid` is. `near` is where rays are clipped and `radius` is R, both
    /// in scene units.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        depth: &DepthInput,
        normals: TextureRef,
        (grid, projection, near): (Grid, Projection, f64),
        (radius, settings): (f64, &Settings),
    ) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        grid.bind(program, projection);
        full_screen.bind_texture(1, normals);
        if let Some(tile) = &self.tile {
            full_screen.bind_texture(2, tile.into());
        }
        program
            .unit("normal_image", 1)
            .unit("tile", 2)
            .unit("half_depth_image", half_depth::UNIT)
            .float("near", near)
            .float("radius", radius.min(FARTHEST_RADIUS))
            .float("strength", settings.strength)
            .vec2("bias", [settings.bias.cos(), settings.bias.sin()]);
        full_screen.draw();
    }
}

/// What every method is compiled for.
fn defines(settings: &Settings, variant: Variant) -> Defines {
    let mut directions = String::new();
    for [x, y] in tile::directions(settings.directions) {
        let separator = if directions.is_empty() { "" } else { ", " };
        let _ = write!(directions, "{separator}vec2({:?}, {:?})", x as f32, y as f32);
    }
    let mut defines = depth_defines(variant.depth, [settings.ao_scale(); 2])
        .value("N_D", settings.directions)
        .value("N_S", settings.steps)
        .value("EACH_STEP(step)", each_step(settings.directions, settings.steps))
        .value("DIRECTIONS", directions)
        .word("ATTENUATION", settings.attenuation.name())
        .word("JITTER", settings.jitter.name());
    for (name, on) in [
        ("NORMALS_RECTANGLE", variant.normals == TextureTarget::Rectangle),
        ("NORMALS_BIASED", variant.encoding == NormalEncoding::Biased),
        ("ORTHOGRAPHIC", variant.orthographic),
        ("FLOOR", variant.floor),
    ] {
        if on {
            defines = defines.value(name, 1);
        }
    }
    defines
}

/// `step(1) step(2)` and so on, as a macro's body. Mesa unrolls a loop over 8 steps of ours and leaves one over 12 as
/// it is, which takes llvmpipe 1.6 times as long a step; what is written out needs no unrolling.
fn each_step(directions: u32, steps: u32) -> String {
    // More are a loop over so many or fewer, lest shaders grow without end. Mesa's softpipe unrolls up to 32 directions
    // too, and overflows its stack at 31 of 32 steps.
    let most = if directions <= 32 && directions * steps > 896 { 16 } else { 32 };
    let call = |i: &str| format!("step({i}) ");
    let loops = steps.div_ceil(most);
    if loops == 1 {
        return (1..=steps).map(|i| call(&i.to_string())).collect();
    }
    let count = steps.div_ceil(loops);
    let calls = (1..=count).map(|i| {
        // The last time round some may be past the end.
        let guard = if (loops - 1) * count + i > steps { format!("if (i_0 + {i} <= {steps}) ") } else { String::new() };
        guard + &call(&format!("i_0 + {i}"))
    });
    format!("for (int i_0 = 0; i_0 < {steps}; i_0 += {count}) {{ {}}}", calls.collect::<String>())
}

/// How samples are brought to texel centres and to the image, for the methods that share HBAO's.
pub(super) fn sampling(settings: &Settings, defines: Defines) -> Defines {
    defines.word("SNAP", settings.snap.name()).word("CLAMP", settings.clamp.name())
}

/// Whether the tangent is raised.
pub(super) fn bias(settings: &Settings, defines: Defines) -> Defines {
    if settings.bias > 0.0 { defines.value("BIAS", 1) } else { defines }
}
