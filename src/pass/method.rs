//! The pass of an ambient occlusion method. All methods read the same images and a rotation tile. They differ in their
//! shaders, which are assembled from the files that the method's row of facts lists.

use super::{
    DepthInput, FETCH, FULLSCREEN, FullScreen, Grid, ImageVariant, Part, RAY, SURFACE, TextureRef, bind_viewport,
    depth_defines, half_depth,
};
use crate::Error;
use crate::encoding::NormalEncoding;
use crate::gl::{Defines, Format, Program, ProgramCache, Source, Texture, source};
use crate::projection::Projection;
use crate::settings::method::methods;
use crate::settings::{Exit, Jitter, Length, Method, Settings, SsaoDepth, Toggle, ssao_length};
use crate::tile::{self, rotation_tile};
use std::fmt::Write;
use std::sync::Arc;

macro_rules! shaders {
    ($($(#[$doc:meta])* $variant:ident = $name:literal {
        twin: $twin:tt,
        shader: [$($file:literal),*],
        define: [$($define:literal)?],
        $($other:tt)*
    })+) => {
        /// Returns the files of a method's fragment shader, and the words that are defined when it is compiled for this
        /// method.
        fn shader(method: Method) -> (&'static [Source], &'static [&'static str]) {
            match method {
                $(Method::$variant => (&[$(source!($file)),*], &[$($define)?])),+
            }
        }
    };
}
methods!(shaders);

/// The properties of the inputs that the shader is compiled for, besides the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MethodVariant {
    pub(crate) orthographic: bool,
    /// Whether R is in proportion to depth.
    pub(crate) radius_of_depth: bool,
    pub(crate) depth: ImageVariant,
    pub(crate) normals: NormalsVariant,
    /// Whether the shader is the fetch floor: the method's shader with all its fetches, in which a sum of the fetched
    /// values replaces the arithmetic.
    pub(crate) floor: bool,
}

/// How the shader reads normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum NormalsVariant {
    /// From a texture that a caller owns. `turned` says that a matrix leads from their space to eye space.
    Given { image: ImageVariant, encoding: NormalEncoding, turned: bool },
    /// From the image of [`super::rebuilt_normals`].
    Rebuilt,
}

impl NormalsVariant {
    /// Adds the defines of `glsl/shared/surface.glsl` that belong to normals.
    pub(super) fn define(self, defines: Defines) -> Defines {
        match self {
            NormalsVariant::Given { image, encoding, turned } => image
                .define(defines, "NORMALS")
                .flag("NORMALS_BIASED", encoding.is_biased())
                .flag("NORMALS_OCTAHEDRAL", encoding.is_octahedral())
                .flag("NORMALS_MATRIX", turned),
            NormalsVariant::Rebuilt => ImageVariant::RECTANGLE.define(defines, "NORMALS").value("NORMALS_REBUILT", 1),
        }
    }
}

/// A texture of normals, as passes read it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalsInput {
    pub(crate) image: TextureRef,
    /// `None` if the view is the whole texture.
    pub(crate) part: Option<Part>,
    /// The matrix to left-handed eye space, column by column; `None` if they are in it.
    pub(crate) to_eye: Option<[f32; 9]>,
}

impl NormalsInput {
    /// Binds the texture to unit 1, and sets the uniforms of normals in the program in use, for a view of this size.
    pub(super) fn bind(&self, full_screen: &FullScreen, program: &Program, size: (u32, u32)) {
        full_screen.bind_texture(1, self.image);
        let (width, height) = self.part.map_or(size, |part| part.texture);
        program
            .unit("normal_image", 1)
            .float("normal_layer", f64::from(self.image.target.layer()))
            .vec2("normal_texel", [1.0 / f64::from(width), 1.0 / f64::from(height)]);
        if let Some(part) = self.part {
            bind_viewport(program, part.corner, size);
        }
        if let Some(matrix) = &self.to_eye {
            program.mat3("normal_matrix", matrix);
        }
    }
}

/// The largest R that is passed to a shader. A larger R is replaced by this one. It reaches past every scene, because
/// coordinates are at most 1e15, and float32 can hold its square.
const FARTHEST_RADIUS: f64 = 1e16;

/// The largest number of samples for which the loop over directions may be unrolled. 16 directions of 16 steps take
/// 9,600 instructions, and hardware of 2006 may have had a limit near 16,000.
const MOST_UNROLLED: u32 = 256;

/// The pass of a method.
pub(crate) struct MethodPass {
    program: Arc<Program>,
    tile: Option<Texture>,
}

/// The view that A is computed in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MethodView {
    /// The grid of the target's texels.
    pub(crate) grid: Grid,
    pub(crate) projection: Projection,
    /// The depth at which rays are clipped, in scene units.
    pub(crate) near: f64,
}

impl MethodPass {
    /// Returns the bytes of the rotation tile, if there is one.
    pub(crate) fn tile_bytes(&self) -> u64 {
        self.tile.as_ref().map_or(0, Texture::bytes)
    }

    /// Compiles the method's shader, and uploads the rotation tile. Returns `None` for `none`, which has no shader.
    /// Changes the rectangle texture binding of the active unit.
    pub(crate) fn new(
        programs: &mut ProgramCache,
        settings: &Settings,
        variant: MethodVariant,
    ) -> Result<Option<MethodPass>, Error> {
        let (files, words) = shader(settings.method);
        if files.is_empty() {
            return Ok(None);
        }
        let defines = words.iter().fold(defines(settings, variant), |defines, word| defines.value(word, 1));
        let pieces = [&[FETCH, RAY, SURFACE], files].concat();
        let program = programs.get(&defines, FULLSCREEN, &pieces)?;
        let tile = match settings.jitter {
            Jitter::None => None,
            Jitter::Tile => {
                let texels: Vec<f32> =
                    rotation_tile(settings).texels.iter().flat_map(|&[c, s, b]| [c, s, b, 0.0]).collect();
                Some(Texture::of_floats(programs.gl(), "ao: rotation tile", Format::Rgba32f, (4, 4), &texels)?)
            }
        };
        Ok(Some(MethodPass { program, tile }))
    }

    /// Draws A into the bound target. `radius` is R, of the kind that the pass is compiled for. `normals` may be `None`
    /// if the method reads none.
    pub(crate) fn draw(
        &self,
        full_screen: &FullScreen,
        depth: &DepthInput,
        normals: Option<&NormalsInput>,
        view: MethodView,
        radius: Length,
        settings: &Settings,
    ) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        view.grid.bind(program, view.projection);
        if let Some(normals) = normals {
            normals.bind(full_screen, program, depth.size);
        }
        if let Some(tile) = &self.tile {
            full_screen.bind_texture(2, tile.into());
        }
        program
            .unit("tile", 2)
            .unit("half_depth_image", half_depth::UNIT)
            .float("near", view.near)
            .float("radius", radius.at(1.0).min(FARTHEST_RADIUS))
            .float("strength", settings.strength)
            .int("direction_count", settings.directions as i32)
            .vec2("bias", [settings.bias.cos(), settings.bias.sin()]);
        full_screen.draw();
    }
}

/// Makes the defines for a method's shader: the properties of the inputs, and those settings that the method reads.
fn defines(settings: &Settings, variant: MethodVariant) -> Defines {
    let reads = |knob: &str| settings.method.reads(knob);
    let mut defines = variant.normals.define(depth_defines(variant.depth, [settings.ao_scale(); 2]));
    if reads("directions") {
        let mut directions = String::new();
        for [x, y] in tile::directions(settings.directions) {
            let separator = if directions.is_empty() { "" } else { ", " };
            let _ = write!(directions, "{separator}vec2({:?}, {:?})", x as f32, y as f32);
        }
        defines = defines.value("N_D", settings.directions).value("DIRECTIONS", directions);
    }
    if reads("steps") {
        let each_step = each_step(settings);
        defines = defines.value("N_S", settings.steps).value("EACH_STEP(step)", each_step);
    }
    if let Some(spaced) = spaced(settings.spacing_read()) {
        defines = defines.value("SPACED(x)", spaced);
    }
    if reads("rays") {
        defines = defines.value("N_R", settings.rays);
    }
    if reads("ssao-samples") {
        let n = settings.ssao_samples;
        // The lengths l_i are compiled in as numbers, because a power for each sample would take time.
        let lengths: Vec<String> = (1..=n).map(|i| format!("{:?}", ssao_length(n, i) as f32)).collect();
        defines = defines.value("N_SAMPLES", n).value("LENGTHS", lengths.join(", "));
    }
    for (knob, prefix, word) in [
        ("attenuation", "ATTENUATION", settings.attenuation.name()),
        ("snap", "SNAP", settings.snap.name()),
        ("clamp", "CLAMP", settings.clamp.name()),
        ("exit", "EXIT", settings.exit.name()),
        ("grounding", "GROUNDING", settings.grounding.name()),
        ("zenith", "ZENITH", settings.zenith.name()),
        ("quadrature", "QUADRATURE", settings.quadrature.name()),
        ("jitter", "JITTER", settings.jitter.name()),
        ("ssao-rotation", "ROTATION", settings.ssao_rotation.name()),
    ] {
        if reads(knob) {
            defines = defines.word(prefix, word);
        }
    }
    for (name, on) in [
        ("BIAS", reads("bias") && settings.bias > 0.0),
        ("HALF_DEPTH", reads_half_depth(settings)),
        ("NORMALS", reads("ssao-normals") && settings.ssao_normals == Toggle::On),
        ("CURVE", reads("ssao-curve") && settings.curve() == Toggle::On),
        ("ORTHOGRAPHIC", variant.orthographic),
        ("RADIUS_OF_DEPTH", variant.radius_of_depth),
        ("FLOOR", variant.floor),
        ("DIRECTIONS_LOOPED", settings.directions * settings.steps > MOST_UNROLLED),
    ] {
        if on {
            defines = defines.value(name, 1);
        }
    }
    defines
}

/// Returns x to this power, from 1 on, as a GLSL expression; `None` for x itself. Products and roots take less time
/// than a power, and are more precise.
fn spaced(power: f64) -> Option<String> {
    if power == 1.0 {
        None
    } else if power == 1.5 {
        Some("((x) * sqrt(x))".into())
    } else if power == 2.0 {
        Some("((x) * (x))".into())
    } else {
        Some(format!("pow(x, {:?})", power as f32))
    }
}

/// Returns whether the method's samples read the half-size depth image instead of the depth image itself.
pub(crate) fn reads_half_depth(settings: &Settings) -> bool {
    settings.method.reads("ssao-depth") && settings.ssao_depth == SsaoDepth::Half
}

/// Returns the body of a macro that expands to `step(1) step(2) ...`. With [`Exit::Shorten`] the calls past the pixel's
/// own number of steps are skipped. Mesa unrolls a loop over 8 steps but not one over 12, and each step of a loop that
/// is not unrolled takes llvmpipe 1.6 times as long. Calls that are written out need no unrolling.
fn each_step(settings: &Settings) -> String {
    let &Settings { directions, steps, .. } = settings;
    let shortens = settings.exit_read() == Some(Exit::Shorten);
    // The largest number of calls that are written out. If there are more steps, the calls are put into a loop, because
    // shaders would otherwise grow without limit. Mesa's softpipe also unrolls the loop over directions, up to 32 of
    // them, and its stack overflows at 31 directions of 32 steps. Such shaders get fewer calls.
    let most = if directions <= 32 && directions * steps > 896 { 16 } else { 32 };
    let loops = steps.div_ceil(most);
    let count = steps.div_ceil(loops);
    let call = |i: u32| {
        let step = if loops == 1 { i.to_string() } else { format!("i_0 + {i}") };
        // Every pixel takes at least one step. In its last iteration the loop may go past the last step.
        let guard = if shortens && (loops > 1 || i > 1) {
            format!("if (float({step}) <= steps.count) ")
        } else if (loops - 1) * count + i > steps {
            format!("if ({step} <= {steps}) ")
        } else {
            String::new()
        };
        format!("{guard}step({step}) ")
    };
    let calls: String = (1..=count).map(call).collect();
    if loops == 1 { calls } else { format!("for (int i_0 = 0; i_0 < {steps}; i_0 += {count}) {{ {calls}}}") }
}
