//! Every knob once: its meaning, unit, range and default.
//!
//! The command line's flags and `--help`, the settings files (TOML) and the metadata of the images written all come
//! from [`KNOBS`]; the passes read the typed fields of [`Settings`].

mod knobs;

pub use knobs::{KNOBS, Kind, Knob};

use crate::Error;

/// Declares an enum whose variants have names on the command line and in files.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$variant_doc])* $variant),+ }

        impl $name {
            /// The names, as flags and files spell them.
            pub const NAMES: &'static [&'static str] = &[$($text),+];

            /// Its name, as flags and files spell it.
            pub fn name(self) -> &'static str {
                match self { $($name::$variant => $text),+ }
            }

            fn parse(text: &str) -> Result<$name, String> {
                match text {
                    $($text => Ok($name::$variant),)+
                    _ => Err(format!("'{}' is none of {}", Error::shown(text), Self::NAMES.join(", "))),
                }
            }
        }
    };
}

choice! {
    /// Which ambient occlusion method.
    Method {
        /// ShaderX7 6.2: grounded horizons, one attenuation per sample (Eq. 6.2.9).
        #[default]
        Hbao = "hbao",
        /// The SIGGRAPH 2008 talk: one horizon, one attenuation in each direction (Eq. 3).
        HbaoTalk = "hbao-talk",
        /// 6.2's brute force: rays over the hemisphere, marched over the depth image.
        RayMarch = "ray-march",
        /// Shanmugam and Arikan 2007, as 6.2 describes it: every sample is a sphere that occludes.
        Microsphere = "microsphere",
        /// Fox and Compton 2008, as 6.2 describes it: the same with one solid angle for all.
        Crease = "crease",
        /// ShaderX7 6.1, Crysis: the share of solid among points about P.
        Ssao = "ssao",
        /// A = 1 everywhere: the 'No AO' rows of Table 6.2.1.
        None = "none",
    }
}

impl Method {
    /// Whether the method reads the knob of this name. Knobs of the G-buffer and of the output matter to all.
    pub fn reads(self, knob: &str) -> bool {
        let sampled = matches!(self, Method::Hbao | Method::HbaoTalk | Method::Microsphere | Method::Crease);
        match knob {
            "rays" => self == Method::RayMarch,
            "grounding" => self == Method::Hbao,
            "bias" => matches!(self, Method::Hbao | Method::HbaoTalk),
            "attenuation" => matches!(self, Method::Hbao | Method::HbaoTalk | Method::RayMarch),
            "snap" | "clamp" => sampled,
            "radius" | "directions" | "steps" | "strength" | "blur-kernel" => {
                !matches!(self, Method::Ssao | Method::None)
            }
            "jitter" | "blur" | "blur-depth-sigma" | "edges" | "half-res" => self != Method::None,
            _ if knob.starts_with("ssao-") => self == Method::Ssao,
            _ => true,
        }
    }
}

choice! {
    /// W(r), the weight of an occluder at distance r of a radius R.
    Attenuation {
        /// W = 1 - (r/R)^2, the chapter's choice.
        #[default]
        Quadratic = "quadratic",
        /// W = 1 - r/R.
        Linear = "linear",
        /// W = 1.
        None = "none",
    }
}

choice! {
    /// How sample positions are brought to texel centres.
    Snap {
        /// The first offset and the step are rounded once each; samples then walk by whole texels. The chapter's
        /// choice.
        #[default]
        Step = "step",
        /// Each sample's offset is rounded by itself.
        Sample = "sample",
        /// The position keeps its fraction, the depth comes from the nearest texel.
        None = "none",
    }
}

choice! {
    /// Where a sample beyond the image's border is taken to lie.
    Clamp {
        /// At the border texel whose depth it reads.
        #[default]
        Position = "position",
        /// Where it would have been, at the border texel's depth.
        Depth = "depth",
    }
}

choice! {
    /// Which tangent a sample's elevation is measured from.
    Grounding {
        /// Its own (Eq. 6.2.9).
        #[default]
        Sample = "sample",
        /// Its direction's (Eq. 6.2.8).
        Direction = "direction",
    }
}

choice! {
    /// Where the G-buffer's normals come from.
    Normals {
        /// The triangle itself, by screen derivatives of the eye-space position.
        #[default]
        Derivative = "derivative",
        /// The vertices: the file's normals, or area-weighted ones where it has none.
        Vertex = "vertex",
    }
}

choice! {
    /// Whether directions and steps differ from pixel to pixel.
    Jitter {
        /// By a 4x4 tile of random rotations and offsets.
        #[default]
        Tile = "tile",
        /// They do not.
        None = "none",
    }
}

choice! {
    /// The form of the cross-bilateral blur.
    BlurKernel {
        /// A pass in X, then one in Y.
        #[default]
        Separable = "separable",
        /// One pass over the whole square: the reference for the separated form.
        Full = "full",
    }
}

choice! {
    /// What the blur does at pixels that hold more than one surface.
    Edges {
        /// The blur around each depth sample of the pixel, averaged.
        #[default]
        Supersample = "supersample",
        /// The blur around the resolved depth, as at all other pixels.
        Off = "off",
    }
}

choice! {
    /// How `ssao` jitters its offsets.
    SsaoRotation {
        /// By the rotation that carries the Z axis to the tile's vector.
        #[default]
        Matrix = "matrix",
        /// By the reflection at the plane that the tile's vector is normal to.
        Mirror = "mirror",
    }
}

choice! {
    /// The depth image that the samples of `ssao` read.
    SsaoDepth {
        /// Full size.
        #[default]
        Full = "full",
        /// Half the width and height.
        Half = "half",
    }
}

choice! {
    /// A variant that is on or off.
    Toggle {
        /// Off.
        #[default]
        Off = "off",
        /// On.
        On = "on",
    }
}

choice! {
    /// The texture format of ambient occlusion.
    AoFormat {
        /// 8 bits, the chapter's.
        #[default]
        R8 = "r8",
        /// 16-bit float.
        R16f = "r16f",
        /// 32-bit float.
        R32f = "r32f",
    }
}

choice! {
    /// The texture format of the G-buffer's normals.
    NormalFormat {
        /// 8 bits a component, signed, the chapter's.
        #[default]
        Rgba8Snorm = "rgba8-snorm",
        /// 16-bit float.
        Rgba16f = "rgba16f",
    }
}

choice! {
    /// The texture format of the G-buffer's linear depth.
    DepthFormat {
        /// 32-bit float.
        #[default]
        R32f = "r32f",
        /// 16-bit float: 11 significant bits, from 6.1e-5 to 60000.
        R16f = "r16f",
    }
}

/// R, the distance beyond which nothing occludes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Radius {
    /// In scene units.
    Units(f64),
    /// In percent of the diagonal of the scene's bounding box.
    Percent(f64),
}

/// The depth difference that the blur takes for an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthSigma {
    /// In scene units.
    Units(f64),
    /// As a share of the depth at hand.
    OfDepth(f64),
}

impl DepthSigma {
    /// In scene units, at depth z.
    pub fn at(self, z: f64) -> f64 {
        match self {
            DepthSigma::Units(sigma) => sigma,
            DepthSigma::OfDepth(share) => share * z,
        }
    }
}

/// Every knob of ambient occlusion and of the pipeline around it. Angles are radians.
///
/// [`Settings::validate`] holds the fields to the ranges of [`KNOBS`].
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// R, the radius of influence. A percentage must be made units of ([`Settings::resolved`]) before it can be used.
    pub radius: Radius,
    /// N_d, the directions about each pixel.
    pub directions: u32,
    /// N_s, the steps along each direction.
    pub steps: u32,
    /// N_r, the rays of `ray-march` at each azimuth.
    pub rays: u32,
    /// The angle bias, in radians.
    pub bias: f64,
    /// The factor on the occlusion.
    pub strength: f64,
    /// W(r).
    pub attenuation: Attenuation,
    /// How samples are brought to texel centres.
    pub snap: Snap,
    /// Where samples beyond the border lie.
    pub clamp: Clamp,
    /// Which tangent elevations are measured from.
    pub grounding: Grounding,
    /// Where the G-buffer's normals come from.
    pub normals: Normals,
    /// Whether directions and steps are jittered.
    pub jitter: Jitter,
    /// The blur's width in texels, odd; 0 is no blur.
    pub blur: u32,
    /// The blur's form.
    pub blur_kernel: BlurKernel,
    /// The blur's depth sigma in scene units; `None` is what [`Settings::depth_sigma`] says: R/4, or a share of the
    /// depth.
    pub blur_depth_sigma: Option<f64>,
    /// Depth samples a pixel: 1, 2, 4 or 8. The driver may have fewer.
    pub msaa: u32,
    /// What the blur does at edge pixels.
    pub edges: Edges,
    /// Ambient occlusion at half the width and height, rounded up.
    pub half_res: bool,
    /// The samples of `ssao`: 8, 16 or 24.
    pub ssao_samples: u32,
    /// How `ssao` jitters.
    pub ssao_rotation: SsaoRotation,
    /// The depth image that the samples of `ssao` read.
    pub ssao_depth: SsaoDepth,
    /// Whether `ssao` flips its offsets to the side that the normal points to.
    pub ssao_normals: Toggle,
    /// Whether `ssao` ends with A^2 + A.
    pub ssao_curve: Toggle,
    /// Format of ambient occlusion.
    pub ao_format: AoFormat,
    /// Format of the G-buffer's normals.
    pub normal_format: NormalFormat,
    /// Format of the G-buffer's depth.
    pub depth_format: DepthFormat,
}

impl Default for Settings {
    /// The chapter's method with 8 directions of 8 steps, a 9x9 blur, 4 samples a pixel and 8-bit targets.
    fn default() -> Settings {
        Settings {
            method: Method::default(),
            radius: Radius::Percent(5.0),
            directions: 8,
            steps: 8,
            rays: 4,
            bias: 0.0,
            strength: 1.0,
            attenuation: Attenuation::default(),
            snap: Snap::default(),
            clamp: Clamp::default(),
            grounding: Grounding::default(),
            normals: Normals::default(),
            jitter: Jitter::default(),
            blur: 9,
            blur_kernel: BlurKernel::default(),
            blur_depth_sigma: None,
            msaa: 4,
            edges: Edges::default(),
            half_res: false,
            ssao_samples: 16,
            ssao_rotation: SsaoRotation::default(),
            ssao_depth: SsaoDepth::default(),
            ssao_normals: Toggle::Off,
            ssao_curve: Toggle::On,
            ao_format: AoFormat::default(),
            normal_format: NormalFormat::default(),
            depth_format: DepthFormat::default(),
        }
    }
}

impl Settings {
    /// The method's own defaults: the talk attenuates linearly and snaps each sample.
    pub fn for_method(method: Method) -> Settings {
        let defaults = Settings { method, ..Settings::default() };
        match method {
            Method::HbaoTalk => Settings { attenuation: Attenuation::Linear, snap: Snap::Sample, ..defaults },
            _ => defaults,
        }
    }

    /// The settings with a radius in percent made one in scene units; `diagonal` is that of the scene's bounding box.
    pub fn resolved(&self, diagonal: f64) -> Settings {
        let radius = match self.radius {
            Radius::Percent(percent) => Radius::Units(percent / 100.0 * diagonal),
            units => units,
        };
        Settings { radius, ..self.clone() }
    }

    /// R in scene units.
    ///
    /// # Errors
    /// Where it is still a percentage of a scene's size.
    pub fn radius_units(&self) -> Result<f64, Error> {
        match self.radius {
            Radius::Units(radius) => Ok(radius),
            Radius::Percent(percent) => Err(Error::Usage(format!(
                "radius {percent}% needs a scene's size: give it in scene units (Radius::Units)"
            ))),
        }
    }

    /// R in scene units for the method's passes; 0 where the method reads none, whatever it is set to.
    pub(crate) fn radius_read(&self) -> Result<f64, Error> {
        if self.method.reads("radius") { self.radius_units() } else { Ok(0.0) }
    }

    /// How many pixels, in x and in y, a texel of ambient occlusion stands for before the blur.
    pub fn ao_scale(&self) -> u32 {
        if self.half_res && self.method.reads("half-res") { 2 } else { 1 }
    }

    /// s_z of the blur: its own, or a quarter of the distance within which the method looks: of R, or for `ssao` of the
    /// depth 2 P.z l_n of its farthest sample.
    ///
    /// # Errors
    /// As [`Settings::radius_units`].
    pub fn depth_sigma(&self) -> Result<DepthSigma, Error> {
        match (self.blur_depth_sigma, self.method) {
            (Some(sigma), _) => Ok(DepthSigma::Units(sigma)),
            (None, Method::Ssao) => {
                let n = f64::from(self.ssao_samples);
                Ok(DepthSigma::OfDepth(2.0 * 0.01 * (1.0 + 2.4 / n).powf(n) / 4.0))
            }
            (None, _) => Ok(DepthSigma::Units(self.radius_units()? / 4.0)),
        }
    }

    /// Holds every field to its range.
    ///
    /// # Errors
    /// Names the first knob outside its range, and the range.
    pub fn validate(&self) -> Result<(), Error> {
        let mut copy = self.clone();
        KNOBS.iter().filter(|knob| !knob.is_unset(self)).try_for_each(|knob| knob.set(&mut copy, &knob.text(self)))
    }

    /// Reads a settings file's text: `key = value` lines of TOML, the keys being the knobs' names. Knobs that it does
    /// not name keep their values. The table `[render]` is passed over: there an image says what else it was made with.
    ///
    /// # Errors
    /// Names the key that is unknown or out of range, or the line that is no TOML. Then nothing is changed.
    pub fn read_toml(&mut self, text: &str) -> Result<(), String> {
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let before = e.span().map_or(&[][..], |span| &text.as_bytes()[..span.start.min(text.len())]);
            let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
            format!("line {line}: {}", Error::shown(&e.message().replace('\n', ", ")))
        })?;
        let mut read = self.clone();
        for (key, value) in &table {
            if key == "render" && value.is_table() {
                continue;
            }
            let Some(knob) = KNOBS.iter().find(|knob| knob.name == key) else {
                let names: Vec<_> = KNOBS.iter().map(|knob| knob.name).collect();
                return Err(format!("unknown setting '{}': the settings are {}", Error::shown(key), names.join(", ")));
            };
            let text = match value {
                toml::Value::String(text) => text.clone(),
                toml::Value::Table(_) | toml::Value::Array(_) => {
                    return Err(format!("{key}: {} is no value for it: write one number or word", value.type_str()));
                }
                other => other.to_string(),
            };
            knob.set(&mut read, &text).map_err(|e| e.to_string())?;
        }
        *self = read;
        Ok(())
    }

    /// Every knob and its value, as a settings file holds them. A knob that follows from another is left out.
    pub fn to_toml(&self) -> toml::Table {
        let set = KNOBS.iter().filter(|knob| !knob.is_unset(self));
        set.map(|knob| (knob.name.to_string(), (knob.get)(self))).collect()
    }
}
