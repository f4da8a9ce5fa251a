//! Every knob once: its meaning, unit, range and default.
//!
//! The command line's flags and `--help`, the settings files (TOML) and the metadata of the images written all come
//! from [`KNOBS`]; the passes read the typed fields of [`Settings`].

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
                    _ => Err(format!("'{text}' is none of {}", Self::NAMES.join(", "))),
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
            "radius" | "directions" | "steps" | "strength" | "jitter" => self != Method::None,
            "blur" | "blur-kernel" | "blur-depth-sigma" => self != Method::None,
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
        /// The first offset and the step are rounded once each; samples then walk by whole texels. The chapter's choice.
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
        /// 16-bit float: 11 significant bits, at most 60000.
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
    /// The blur's depth sigma in scene units; `None` is R/4.
    pub blur_depth_sigma: Option<f64>,
    /// Format of ambient occlusion.
    pub ao_format: AoFormat,
    /// Format of the G-buffer's normals.
    pub normal_format: NormalFormat,
    /// Format of the G-buffer's depth.
    pub depth_format: DepthFormat,
}

impl Default for Settings {
    /// The chapter's method with 8 directions of 8 steps, a 9x9 blur and 8-bit targets.
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

    /// The blur's depth sigma in scene units: its own, or a quarter of the radius.
    ///
    /// # Errors
    /// As [`Settings::radius_units`].
    pub fn depth_sigma(&self) -> Result<f64, Error> {
        match self.blur_depth_sigma {
            Some(sigma) => Ok(sigma),
            None => Ok(self.radius_units()? / 4.0),
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
    /// Names the key that is unknown or out of range, or the line that is no TOML.
    pub fn read_toml(&mut self, text: &str) -> Result<(), String> {
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].lines().count().max(1));
            format!("line {line}: {}", e.message().replace('\n', ", "))
        })?;
        for (key, value) in &table {
            if key == "render" && value.is_table() {
                continue;
            }
            let Some(knob) = KNOBS.iter().find(|knob| knob.name == key) else {
                let names: Vec<_> = KNOBS.iter().map(|knob| knob.name).collect();
                return Err(format!("unknown setting '{key}': the settings are {}", names.join(", ")));
            };
            let text = match value {
                toml::Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            knob.set(self, &text).map_err(|e| e.to_string())?;
        }
        Ok(())
    }

    /// Every knob and its value, as a settings file holds them. A knob that follows from another is left out.
    pub fn to_toml(&self) -> toml::Table {
        let set = KNOBS.iter().filter(|knob| !knob.is_unset(self));
        set.map(|knob| (knob.name.to_string(), (knob.get)(self))).collect()
    }
}

/// What a knob takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A whole number from the first to the second.
    Count(u32, u32),
    /// 0, or an odd number from the first to the second.
    OddOrZero(u32, u32),
    /// Degrees from the first to the second.
    Degrees(f64, f64),
    /// A finite number above 0.
    Positive,
    /// A finite length above 0, or such a number and `%`.
    Length,
    /// One of these words.
    Word(&'static [&'static str]),
}

/// One knob of [`Settings`].
pub struct Knob {
    /// Its name in files and, behind `--`, on the command line.
    pub name: &'static str,
    /// How `--help` names its value.
    pub value: &'static str,
    /// What it means and in which unit.
    pub help: &'static str,
    /// What it takes.
    pub kind: Kind,
    get: fn(&Settings) -> toml::Value,
    put: fn(&mut Settings, &str) -> Result<(), String>,
}

impl Knob {
    /// Sets it from text.
    ///
    /// # Errors
    /// Where the text does not say a value in range.
    pub fn set(&self, settings: &mut Settings, text: &str) -> Result<(), Error> {
        (self.put)(settings, text).map_err(|what| Error::Usage(format!("{}: {what}", self.name)))
    }

    /// Its value as text, as [`Knob::set`] reads it.
    pub fn text(&self, settings: &Settings) -> String {
        match (self.get)(settings) {
            toml::Value::String(text) => text,
            other => other.to_string(),
        }
    }

    fn is_unset(&self, settings: &Settings) -> bool {
        self.text(settings).is_empty()
    }
}

fn count(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let value = text.trim().parse::<u32>().ok().filter(|n| (min..=max).contains(n));
    value.ok_or_else(|| format!("'{text}' is no whole number from {min} to {max}"))
}

fn odd_or_zero(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let value = text.trim().parse::<u32>().ok().filter(|&n| n == 0 || (n % 2 == 1 && (min..=max).contains(&n)));
    value.ok_or_else(|| format!("'{text}' is neither 0 nor an odd number from {min} to {max}"))
}

fn degrees(text: &str, min: f64, max: f64) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|d| (min..=max).contains(d));
    value.map(f64::to_radians).ok_or_else(|| format!("'{text}' is no angle from {min} to {max} degrees"))
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    value.ok_or_else(|| format!("'{text}' is no finite number above 0"))
}

fn length(text: &str) -> Result<Radius, String> {
    let parsed = match text.trim().strip_suffix('%') {
        Some(percent) => positive(percent).map(Radius::Percent),
        None => positive(text).map(Radius::Units),
    };
    parsed.map_err(|_| format!("'{text}' is neither a finite length above 0 nor such a number and %"))
}

/// Degrees that read as they were typed: 30, where 30 degrees in radians and back is 29.999999999999996.
fn typed_degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e10).round() / 1e10
}

macro_rules! knobs {
    ($($name:literal $value:literal $field:ident $kind:ident $(($($argument:expr),*))? $(: $choice:ident)? = $help:literal;)+) => {
        /// Every knob, in the order in which `--help` lists them.
        pub static KNOBS: &[Knob] = &[$(Knob {
            name: $name,
            value: $value,
            help: $help,
            kind: knobs!(@kind $kind $($($argument),*)? $($choice)?),
            get: |settings| knobs!(@get $kind settings.$field),
            put: |settings, text| {
                settings.$field = knobs!(@put $kind text; $($($argument),*)? $($choice)?)?;
                Ok(())
            },
        }),+];
    };
    (@kind Word $choice:ident) => { Kind::Word($choice::NAMES) };
    (@kind PositiveOrUnset) => { Kind::Positive };
    (@kind $kind:ident) => { Kind::$kind };
    (@kind $kind:ident $($argument:expr),+) => { Kind::$kind($($argument),+) };
    (@get Word $field:expr) => { toml::Value::from($field.name()) };
    (@get Degrees $field:expr) => { toml::Value::from(typed_degrees($field)) };
    (@get Length $field:expr) => {
        match $field {
            Radius::Units(units) => toml::Value::from(units),
            Radius::Percent(percent) => toml::Value::from(format!("{percent}%")),
        }
    };
    (@get PositiveOrUnset $field:expr) => { $field.map_or(toml::Value::from(""), toml::Value::from) };
    (@get Positive $field:expr) => { toml::Value::from($field) };
    (@get $kind:ident $field:expr) => { toml::Value::from(i64::from($field)) };
    (@put Word $text:ident; $choice:ident) => { $choice::parse($text) };
    (@put Count $text:ident; $($argument:expr),+) => { count($text, $($argument),+) };
    (@put OddOrZero $text:ident; $($argument:expr),+) => { odd_or_zero($text, $($argument),+) };
    (@put Degrees $text:ident; $($argument:expr),+) => { degrees($text, $($argument),+) };
    (@put Positive $text:ident;) => { positive($text) };
    (@put PositiveOrUnset $text:ident;) => { positive($text).map(Some) };
    (@put Length $text:ident;) => { length($text) };
}

knobs! {
    "method" "METHOD" method Word: Method = "The ambient occlusion method";
    "radius" "R" radius Length = "R, beyond which nothing occludes: scene units, or N% of the bounding box's diagonal";
    "directions" "N" directions Count(1, 64) = "N_d, the directions about each pixel";
    "steps" "N" steps Count(1, 256) = "N_s, the steps along each direction";
    "rays" "N" rays Count(1, 64) = "N_r, the rays of ray-march at each azimuth";
    "bias" "DEG" bias Degrees(0.0, 89.0) = "The angle by which tangents are raised, which hides creases of coarse meshes";
    "strength" "S" strength Positive = "The factor on the occlusion";
    "attenuation" "W" attenuation Word: Attenuation = "W(r), an occluder's weight: 1 - (r/R)^2, 1 - r/R, or 1";
    "snap" "SNAP" snap Word: Snap = "Texel centres: round the step once, round each sample, or keep fractions";
    "clamp" "CLAMP" clamp Word: Clamp = "A sample beyond the border: at the border texel, or only its depth from there";
    "grounding" "TANGENT" grounding Word: Grounding = "Elevations count from each sample's tangent (Eq. 6.2.9) or its direction's (6.2.8)";
    "normals" "NORMALS" normals Word: Normals = "Normals from screen derivatives, or interpolated from the vertices";
    "jitter" "JITTER" jitter Word: Jitter = "Rotate directions and offset steps by a 4x4 tile, or not";
    "blur" "N" blur OddOrZero(3, 41) = "The blur's width in texels; 0 is off";
    "blur-kernel" "KERNEL" blur_kernel Word: BlurKernel = "The blur in X then Y, or over the whole square";
    "blur-depth-sigma" "Z" blur_depth_sigma PositiveOrUnset = "The depth difference, in scene units, that the blur takes for an edge";
    "ao-format" "FORMAT" ao_format Word: AoFormat = "Texture format of ambient occlusion";
    "normal-format" "FORMAT" normal_format Word: NormalFormat = "Texture format of normals";
    "depth-format" "FORMAT" depth_format Word: DepthFormat = "Texture format of linear depth";
}
