//! The ambient occlusion methods, each with one row of facts. All other code reads these rows: the passes look up which
//! shader to compile, the twins which function to call, the command which settings have an effect, and `bench` how many
//! samples a method takes.
//!
//! A new method needs its shader in `glsl/`, its float64 twin in `src/reference/`, and a row here.

use super::choice::choice;
use super::{Attenuation, Exit, Settings, Snap};

/// What distinguishes a method from the others, apart from its equation.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct MethodFacts {
    /// The names of the settings that the method reads. Only settings that some methods read and others do not are
    /// listed. A setting that no method lists belongs to the G-buffer or to the output, and has an effect with every
    /// method.
    pub reads: &'static [&'static str],
    /// The names of the settings whose product is the number of depth samples that the method takes per pixel, in the
    /// order in which tables write them. Empty for `none`, which has no pass.
    pub samples: &'static [&'static str],
    /// Takes settings that hold the defaults of all methods, and returns them with the method's own defaults.
    pub defaults: fn(Settings) -> Settings,
    /// Whether the method reads the near plane ([`crate::Inputs::near`]).
    pub reads_near: bool,
    /// The blur that follows the method.
    pub blur: MethodBlur,
    /// The depth sigma of the blur, if the settings give none, as a share of the distance within which the method looks
    /// for occluders ([`Settings::depth_sigma`]).
    pub depth_sigma: f64,
    /// What the texels of the method's rotation tile hold.
    pub tile: TileKind,
    /// The names of the files in `glsl/` that make up the method's fragment shader, in order, the method's own file
    /// last. They come after the pieces that all methods share. Empty for `none`.
    pub shader: &'static [&'static str],
    /// The mark of the method in plots.
    pub marker: Marker,
}

/// The blur that follows a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MethodBlur {
    /// The cross-bilateral Gaussian of ShaderX7 6.2, as wide as the settings say.
    Gaussian,
    /// The blur of Crysis: 4x4 texels with equal weights (ShaderX7 6.1). Its depth sigma is a share of the depth.
    Crysis,
    /// No blur, because visibility is 1 everywhere.
    None,
}

/// What the texels of a method's rotation tile hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TileKind {
    /// (cos a, sin a, b), at random: the directions are rotated by the angle a, and b is a fraction of a step.
    Rotations,
    /// The same, but with the 16 pairs of a and b spread evenly over their ranges.
    EvenRotations,
    /// A unit vector, by which the offsets of samples are rotated or reflected.
    Vectors,
}

/// The mark of a method in plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    /// The corners of the outline, in pixels from the point that it marks, x right and y down. A closed outline ends
    /// with its first corner.
    pub outline: &'static [(i32, i32)],
    /// Whether the outline is filled.
    pub filled: bool,
}

const SQUARE: &[(i32, i32)] = &[(-4, -4), (4, -4), (4, 4), (-4, 4), (-4, -4)];
const TRIANGLE: &[(i32, i32)] = &[(0, -6), (5, 4), (-5, 4), (0, -6)];
const DIAMOND: &[(i32, i32)] = &[(0, -6), (6, 0), (0, 6), (-6, 0), (0, -6)];
const HEXAGON: &[(i32, i32)] = &[(-3, -5), (3, -5), (6, 0), (3, 5), (-3, 5), (-6, 0), (-3, -5)];
const CROSS: &[(i32, i32)] = &[(-5, -5), (5, 5), (0, 0), (-5, 5), (5, -5)];

const fn filled(outline: &'static [(i32, i32)]) -> Marker {
    Marker { outline, filled: true }
}

const fn hollow(outline: &'static [(i32, i32)]) -> Marker {
    Marker { outline, filled: false }
}

/// The facts that most methods share: they take steps along directions, return visibility 1 at pixels where a step is
/// shorter than a texel, have the usual defaults, and are followed by the Gaussian blur. A row lists only the facts
/// that differ from these.
const ALONG_DIRECTIONS: MethodFacts = MethodFacts {
    reads: &[],
    samples: &["directions", "steps"],
    defaults: |settings| settings,
    reads_near: false,
    blur: MethodBlur::Gaussian,
    depth_sigma: 1.0 / 4.0,
    tile: TileKind::Rotations,
    shader: &[],
    marker: hollow(CROSS),
};

/// Passes the rows of all methods to the macro `$expand`. Each part of the crate makes what it needs from the rows:
/// this file makes the enum and its facts, `pass` the list of shader files, `reference` the list of twins.
///
/// A row holds:
///
/// - the variant and its name;
/// - `twin`, the file in `src/reference/` that holds the method's twin; empty if visibility is 1 everywhere;
/// - `shader`, see [`MethodFacts::shader`];
/// - `define`, a word that is defined when the shader is compiled, which distinguishes two methods that share a shader;
/// - `facts`, the other fields of [`MethodFacts`].
macro_rules! methods {
    ($expand:ident) => {
        $expand! {
            /// ShaderX7 6.2, Eq. 6.2.9: horizons are measured from the tangent, and each sample has its own
            /// attenuation.
            #[default]
            Hbao = "hbao" {
                twin: [hbao],
                shader: ["shared/attenuation.glsl", "shared/sampling.glsl", "shared/tangent.glsl", "hbao.frag"],
                define: [],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "bias", "strength", "attenuation", "snap", "clamp", "exit",
                        "grounding", "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    marker: filled(SQUARE),
                    ..ALONG_DIRECTIONS
                }
            }
            /// The SIGGRAPH 2008 talk: each direction has one horizon and one attenuation (Eq. 3).
            HbaoTalk = "hbao-talk" {
                twin: [hbao_talk],
                shader: ["shared/attenuation.glsl", "shared/sampling.glsl", "shared/tangent.glsl", "hbao_talk.frag"],
                define: [],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "bias", "strength", "attenuation", "snap", "clamp", "exit",
                        "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    defaults: |settings| Settings {
                        attenuation: Attenuation::Linear,
                        snap: Snap::Sample,
                        ..settings
                    },
                    marker: hollow(SQUARE),
                    ..ALONG_DIRECTIONS
                }
            }
            /// Beyond the papers: Eq. 6.2.9 about the view ray in place of the Z axis, with samples that are denser
            /// near P.
            HbaoView = "hbao-view" {
                twin: [hbao_view],
                shader: ["shared/attenuation.glsl", "shared/sampling.glsl", "shared/tangent.glsl", "hbao_view.frag"],
                define: [],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "bias", "strength", "attenuation", "snap", "clamp", "exit",
                        "zenith", "spacing", "quadrature",
                        "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    defaults: |settings| Settings { exit: Exit::Shorten, snap: Snap::Sample, ..settings },
                    depth_sigma: 1.0 / 16.0,
                    tile: TileKind::EvenRotations,
                    marker: filled(HEXAGON),
                    ..ALONG_DIRECTIONS
                }
            }
            /// The brute-force method of ShaderX7 6.2: rays over the hemisphere are marched over the depth image.
            RayMarch = "ray-march" {
                twin: [ray_march],
                shader: ["shared/attenuation.glsl", "ray_march.frag"],
                define: [],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "rays", "strength", "attenuation",
                        "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    samples: &["directions", "rays", "steps"],
                    reads_near: true,
                    marker: filled(TRIANGLE),
                    ..ALONG_DIRECTIONS
                }
            }
            /// Shanmugam and Arikan 2007, as ShaderX7 6.2 describes it: every sample is a sphere that occludes.
            Microsphere = "microsphere" {
                twin: [microsphere],
                shader: ["shared/sampling.glsl", "microsphere.frag"],
                define: [],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "strength", "snap", "clamp", "exit",
                        "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    marker: hollow(DIAMOND),
                    ..ALONG_DIRECTIONS
                }
            }
            /// Fox and Compton 2008, as ShaderX7 6.2 describes it: micro-spheres that all have the same solid angle.
            Crease = "crease" {
                twin: [microsphere],
                shader: ["shared/sampling.glsl", "microsphere.frag"],
                define: ["CREASE"],
                facts: {
                    reads: &[
                        "radius", "directions", "steps", "strength", "snap", "clamp", "exit",
                        "jitter", "blur", "blur-kernel", "blur-depth-sigma", "edges", "half-res",
                    ],
                    marker: hollow(TRIANGLE),
                    ..ALONG_DIRECTIONS
                }
            }
            /// ShaderX7 6.1, the method of Crysis: visibility follows from the share of points around P that lie in
            /// free space.
            Ssao = "ssao" {
                twin: [ssao],
                shader: ["ssao.frag"],
                define: [],
                facts: {
                    reads: &[
                        "jitter", "blur", "blur-depth-sigma", "edges", "half-res",
                        "ssao-samples", "ssao-rotation", "ssao-depth", "ssao-normals", "ssao-curve",
                    ],
                    samples: &["ssao-samples"],
                    blur: MethodBlur::Crysis,
                    tile: TileKind::Vectors,
                    marker: filled(DIAMOND),
                    ..ALONG_DIRECTIONS
                }
            }
            /// No method: visibility is 1 everywhere, as in the 'No AO' rows of Table 6.2.1.
            None = "none" {
                twin: [],
                shader: [],
                define: [],
                facts: {
                    samples: &[],
                    blur: MethodBlur::None,
                    ..ALONG_DIRECTIONS
                }
            }
        }
    };
}
pub(crate) use methods;

macro_rules! declare {
    ($($(#[$doc:meta])* $variant:ident = $name:literal {
        twin: [$($twin:ident)?],
        shader: [$($shader:literal),*],
        define: [$($define:literal)?],
        facts: { $($fact:tt)* }
    })+) => {
        choice! {
            /// The ambient occlusion methods.
            Method { $($(#[$doc])* $variant = $name),+ }
        }

        impl Method {
            /// Returns the facts that distinguish the method from the others, apart from its equation.
            #[must_use]
            pub fn facts(self) -> &'static MethodFacts {
                match self {
                    $(Method::$variant => {
                        const FACTS: MethodFacts = MethodFacts { shader: &[$($shader),*], $($fact)* };
                        &FACTS
                    })+
                }
            }
        }
    };
}
methods!(declare);

impl Method {
    /// Returns whether the method reads the setting of this name. All methods read the settings of the G-buffer and of
    /// the output.
    #[must_use]
    pub fn reads(self, knob: &str) -> bool {
        let lists = |method: &Method| method.facts().reads.contains(&knob);
        lists(&self) || !Method::ALL.iter().any(lists)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::KNOBS;

    #[test]
    fn every_name_in_a_row_is_a_settings_name_and_samples_are_read_and_count() {
        for method in Method::ALL {
            let facts = method.facts();
            for name in facts.reads {
                assert!(KNOBS.iter().any(|knob| knob.name == *name), "{}: {name}", method.name());
            }
            for name in facts.samples {
                assert!(facts.reads.contains(name), "{} does not read {name}", method.name());
            }
            assert_eq!(method.counts(&Settings::default()).len(), facts.samples.len());
        }
    }

    #[test]
    fn a_setting_that_no_method_lists_matters_to_all() {
        for method in Method::ALL {
            for knob in ["method", "normals", "msaa", "ao-format", "normal-format", "depth-format"] {
                assert!(method.reads(knob), "{} {knob}", method.name());
            }
            assert_eq!(method.reads("rays"), *method == Method::RayMarch);
            assert_eq!(method.reads("ssao-curve"), *method == Method::Ssao);
        }
    }

    #[test]
    fn no_two_methods_share_a_marker() {
        for (i, method) in Method::ALL.iter().enumerate() {
            let marker = method.facts().marker;
            assert!(Method::ALL[..i].iter().all(|other| other.facts().marker != marker), "{}", method.name());
        }
    }
}
