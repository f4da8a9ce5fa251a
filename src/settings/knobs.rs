//! The table of all settings: their names, units, ranges and help texts, and how their values are read from text and
//! written as text.

use super::{
    AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Edges, Exit, Grounding, Jitter, Method, NormalFormat,
    Normals, Quadrature, Radius, Settings, Snap, SsaoDepth, SsaoRotation, Toggle, Zenith,
};
use crate::Error;
use std::fmt;

/// The values that a setting accepts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Kind {
    /// A whole number from the first number to the second.
    Count(u32, u32),
    /// 0, or an odd number from the first number to the second.
    OddOrZero(u32, u32),
    /// An angle in degrees, from the first number to the second.
    Degrees(f64, f64),
    /// A number, whole or not, from the first number to the second.
    Number(f64, f64),
    /// A finite number above 0.
    Positive,
    /// A finite length above 0 in scene units, or a finite percentage above 0 of the scene's size, such as `5%`, or of
    /// the view's height, such as `5%view`.
    Length,
    /// One of these whole numbers.
    OneOf(&'static [u32]),
    /// `true` or `false`. On the command line the flag alone means `true`.
    Switch,
    /// One of these words.
    Word(&'static [&'static str]),
}

impl fmt::Display for Kind {
    /// Writes the accepted values in a few words: `1 to 64`, `above 0`, `quadratic, linear, none`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Count(min, max) => write!(f, "{min} to {max}"),
            Kind::OddOrZero(min, max) => write!(f, "0, or odd from {min} to {max}"),
            Kind::Degrees(min, max) => write!(f, "{min} to {max} degrees"),
            Kind::Number(min, max) => write!(f, "{min} to {max}"),
            Kind::Positive | Kind::Length => write!(f, "above 0"),
            Kind::OneOf(values) => write!(f, "{}", values.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")),
            Kind::Switch => write!(f, "true, false"),
            Kind::Word(words) => write!(f, "{}", words.join(", ")),
        }
    }
}

/// The value of a setting.
pub(super) enum Value {
    Count(u32),
    /// A number that need not be whole: a length, a factor, or an angle in degrees.
    Number(f64),
    Switch(bool),
    Text(String),
}

/// One setting of [`Settings`], with its name, its explanation, and how it is read and written.
pub struct Knob {
    /// The name in settings files and, after `--`, on the command line.
    pub name: &'static str,
    /// The placeholder for the value in `--help`, such as `N`; empty for a switch.
    pub value: &'static str,
    /// One line that says what the setting means, and in which unit it is.
    pub help: &'static str,
    /// The values that the setting accepts.
    pub kind: Kind,
    pub(super) get: fn(&Settings) -> Value,
    put: fn(&mut Settings, &str) -> Result<(), String>,
}

impl Knob {
    /// The setting of this name; `None` if there is none.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Knob> {
        KNOBS.iter().find(|knob| knob.name == name)
    }

    /// The numbers that a setting may have, where only a few are allowed; otherwise none.
    #[must_use]
    pub fn choices(&self) -> &'static [u32] {
        match self.kind {
            Kind::OneOf(numbers) => numbers,
            _ => &[],
        }
    }

    /// Sets the value from text, as a settings file or the command line gives it.
    ///
    /// # Errors
    /// [`Error::Usage`] if the text is not an accepted value. The message names the setting and says what it accepts.
    pub fn set(&self, settings: &mut Settings, text: &str) -> Result<(), Error> {
        (self.put)(settings, text).map_err(|what| Error::Usage(format!("{}: {what}", self.name)))
    }

    /// Returns the value as text that [`Knob::set`] can read. The text is empty for a setting without a value of its
    /// own, whose value follows from other settings.
    #[must_use]
    pub fn text(&self, settings: &Settings) -> String {
        match (self.get)(settings) {
            Value::Count(count) => count.to_string(),
            // TOML distinguishes floats from integers by the point, so whole numbers are written with `.0`.
            Value::Number(number) if number.fract() == 0.0 => format!("{number:.1}"),
            Value::Number(number) => number.to_string(),
            Value::Switch(on) => on.to_string(),
            Value::Text(text) => text,
        }
    }

    /// Returns the value, if it is a whole number.
    #[must_use]
    pub fn count(&self, settings: &Settings) -> Option<u32> {
        match (self.get)(settings) {
            Value::Count(count) => Some(count),
            _ => None,
        }
    }

    /// Checks that the setting has an accepted value.
    ///
    /// # Errors
    /// [`Error::Usage`] if it has not. In the message an angle is in radians, as in [`Settings`].
    pub(super) fn check(&self, settings: &Settings) -> Result<(), Error> {
        if self.is_unset(settings) {
            return Ok(());
        }
        if self.kind == Kind::Length {
            return settings.radius.check();
        }
        self.set(&mut settings.clone(), &self.text(settings)).map_err(|error| match (self.kind, (self.get)(settings)) {
            (Kind::Degrees(min, max), Value::Number(degrees)) => {
                let [value, min, max] = [degrees, min, max].map(f64::to_radians);
                Error::Usage(format!("{}: {value:.4} is not an angle from {min} to {max:.4} radians", self.name))
            }
            _ => error,
        })
    }

    /// Returns true for a setting without a value of its own, whose value follows from other settings.
    pub(super) fn is_unset(&self, settings: &Settings) -> bool {
        self.text(settings).is_empty()
    }
}

fn count(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let value = text.trim().parse::<u32>().ok().filter(|n| (min..=max).contains(n));
    value.ok_or_else(|| format!("'{}' is not a whole number from {min} to {max}", Error::shown(text)))
}

fn odd_or_zero(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let value = text.trim().parse::<u32>().ok().filter(|&n| n == 0 || (n % 2 == 1 && (min..=max).contains(&n)));
    value.ok_or_else(|| format!("'{}' is neither 0 nor an odd number from {min} to {max}", Error::shown(text)))
}

fn one_of(text: &str, values: &[u32]) -> Result<u32, String> {
    let value = text.trim().parse::<u32>().ok().filter(|n| values.contains(n));
    value.ok_or_else(|| {
        let values: Vec<String> = values.iter().map(u32::to_string).collect();
        format!("'{}' is not one of {}", Error::shown(text), values.join(", "))
    })
}

fn switch(text: &str) -> Result<bool, String> {
    text.trim().parse().map_err(|_| format!("'{}' is neither true nor false", Error::shown(text)))
}

fn degrees(text: &str, min: f64, max: f64) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|d| (min..=max).contains(d));
    value
        .map(f64::to_radians)
        .ok_or_else(|| format!("'{}' is not an angle from {min} to {max} degrees", Error::shown(text)))
}

fn number(text: &str, min: f64, max: f64) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|x| (min..=max).contains(x));
    value.ok_or_else(|| format!("'{}' is not a number from {min} to {max}", Error::shown(text)))
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    value.ok_or_else(|| format!("'{}' is not a finite number above 0", Error::shown(text)))
}

fn length(text: &str) -> Result<Radius, String> {
    let trimmed = text.trim();
    let parsed = if let Some(percent) = trimmed.strip_suffix("%view") {
        positive(percent).map(|percent| Radius::OfView(percent / 100.0))
    } else if let Some(share) = trimmed.strip_suffix("view") {
        positive(share).map(Radius::OfView)
    } else if let Some(percent) = trimmed.strip_suffix('%') {
        positive(percent).map(Radius::Percent)
    } else {
        positive(text).map(Radius::Units)
    };
    parsed.map_err(|_| {
        format!(
            "'{}' is not a length above 0: write it in scene units, such as 1.5, as a percentage of the scene's size, \
             such as 5%, or as a percentage of the view's height, such as 5%view",
            Error::shown(text)
        )
    })
}

/// Returns the number that the user typed, which was read by `read`; `number` is that number up to rounding. For 30
/// degrees the result is 30, although converting 30 degrees to radians and back gives 29.999999999999996. If possible,
/// reading the result gives `value` again.
fn typed(value: f64, number: f64, read: impl Fn(f64) -> f64) -> f64 {
    let short = (number * 1e10).round() / 1e10;
    let near = [short, number, number.next_up(), number.next_down()];
    near.into_iter().find(|&number| read(number) == value).unwrap_or(short)
}

/// Writes a share of the view's height: in percent, unless no percentage is read as the same number.
fn of_view(share: f64) -> String {
    let read = |percent: f64| percent / 100.0;
    let percent = typed(share, share * 100.0, read);
    if read(percent) == share { format!("{percent}%view") } else { format!("{share}view") }
}

macro_rules! knobs {
    ($($name:literal $value:literal $field:ident $kind:ident $(($($argument:expr),*))? $(: $choice:ident)? = $help:literal;)+) => {
        /// Every setting, in the order in which `--help` lists them.
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
    (@kind WordOrUnset $choice:ident) => { Kind::Word($choice::NAMES) };
    (@kind PositiveOrUnset) => { Kind::Positive };
    (@kind $kind:ident) => { Kind::$kind };
    (@kind $kind:ident $($argument:expr),+) => { Kind::$kind($($argument),+) };
    (@get Word $field:expr) => { Value::Text($field.name().into()) };
    (@get WordOrUnset $field:expr) => { Value::Text($field.map_or("", |choice| choice.name()).into()) };
    (@get Degrees $field:expr) => { Value::Number(typed($field, $field.to_degrees(), f64::to_radians)) };
    (@get Length $field:expr) => {
        match $field {
            Radius::Units(units) => Value::Number(units),
            Radius::Percent(percent) => Value::Text(format!("{percent}%")),
            Radius::OfView(share) => Value::Text(of_view(share)),
        }
    };
    (@get PositiveOrUnset $field:expr) => { $field.map_or(Value::Text(String::new()), Value::Number) };
    (@get Switch $field:expr) => { Value::Switch($field) };
    (@get Positive $field:expr) => { Value::Number($field) };
    (@get Number $field:expr) => { Value::Number($field) };
    (@get $kind:ident $field:expr) => { Value::Count($field) };
    (@put Word $text:ident; $choice:ident) => { $choice::parse($text) };
    (@put WordOrUnset $text:ident; $choice:ident) => { $choice::parse($text).map(Some) };
    (@put Count $text:ident; $($argument:expr),+) => { count($text, $($argument),+) };
    (@put OddOrZero $text:ident; $($argument:expr),+) => { odd_or_zero($text, $($argument),+) };
    (@put OneOf $text:ident; $($argument:expr),+) => { one_of($text, $($argument),+) };
    (@put Switch $text:ident;) => { switch($text) };
    (@put Degrees $text:ident; $($argument:expr),+) => { degrees($text, $($argument),+) };
    (@put Number $text:ident; $($argument:expr),+) => { number($text, $($argument),+) };
    (@put Positive $text:ident;) => { positive($text) };
    (@put PositiveOrUnset $text:ident;) => { positive($text).map(Some) };
    (@put Length $text:ident;) => { length($text) };
}

knobs! {
    "method" "METHOD" method Word: Method = "The ambient occlusion method";
    "radius" "R" radius Length =
        "R, the distance beyond which nothing occludes: in scene units, as N% of the bounding box's diagonal, or as \
         N%view of the view's height at the depth of the pixel";
    "directions" "N" directions Count(1, 64) = "N_d, the number of directions around each pixel";
    "steps" "N" steps Count(1, 256) = "N_s, the number of steps along each direction";
    "rays" "N" rays Count(1, 64) = "N_r, the number of rays that ray-march casts at each azimuth";
    "bias" "DEG" bias Degrees(0.0, 89.0) =
        "The angle by which tangents are raised, so that the creases of coarse meshes do not show";
    "strength" "S" strength Positive = "The factor by which the occlusion is multiplied";
    "attenuation" "W" attenuation Word: Attenuation =
        "W(r), the weight of an occluder at the distance r: quadratic is 1 - (r/R)^2, linear 1 - r/R, none 1";
    "snap" "SNAP" snap Word: Snap =
        "How samples are rounded to texel centres: step rounds the first offset and the step once, sample rounds \
         the offset of each sample, none does not round; where a step is 1 to 2 texels long, step looks blotchy, \
         and sample does not";
    "clamp" "CLAMP" clamp Word: Clamp =
        "Where a sample beyond the border lies: position puts it at the border texel, depth takes only its depth \
         from there";
    "exit" "EXIT" exit Word: Exit =
        "What happens where a step would be shorter than a texel: paper takes no samples, so that visibility is 1 \
         there, shorten takes fewer steps";
    "grounding" "TANGENT" grounding Word: Grounding =
        "The tangent from which a sample's elevation is measured: sample takes the one towards the sample itself \
         (Eq. 6.2.9), direction the one in the sample's direction (Eq. 6.2.8)";
    "zenith" "ZENITH" zenith Word: Zenith =
        "hbao-view: the axis from which elevations are measured: view takes the view ray, axis the camera's axis";
    "spacing" "P" spacing Number(1.0, 4.0) =
        "hbao-view: sample i of N lies at R times (b + i)/(N + 1) to the power P: with 1 samples are evenly spaced, with \
         more they lie nearer to the pixel";
    "quadrature" "RULE" quadrature Word: Quadrature =
        "hbao-view: the weight of a rise of the horizon: end takes W at the sample that the horizon rises to, mean the \
         mean of W there and at the last sample that it rose to, interval the mean of W there and at the distance meant \
         for the sample before, expected the same times a factor that is above 1 for low rises and below 1 for high ones";
    "normals" "NORMALS" normals Word: Normals =
        "The source of normals: derivative takes screen derivatives of the position, vertex interpolates the \
         vertices' normals";
    "jitter" "JITTER" jitter Word: Jitter =
        "How samples vary: tile rotates and offsets them by a 4x4 tile that repeats over the screen (random; for \
         hbao-view spread evenly), none treats all pixels alike";
    "blur" "N" blur OddOrZero(3, 41) = "The width of the blur in pixels; 0 turns the blur off";
    "blur-kernel" "KERNEL" blur_kernel Word: BlurKernel =
        "How the blur runs: separable blurs in X and then in Y, full blurs over the whole square in one pass";
    "blur-depth-sigma" "Z" blur_depth_sigma PositiveOrUnset =
        "The depth sigma of the blur in scene units: taps whose depth differs by much more hardly count";
    "msaa" "N" msaa OneOf(&[1, 2, 4, 8]) =
        "Depth samples per pixel; if the driver supports fewer, it gives as many as it can";
    "edges" "EDGES" edges Word: Edges =
        "How the blur treats pixels that hold several surfaces: supersample blurs around each depth sample and \
         averages the results, off blurs around one depth, as at other pixels";
    "half-res" "" half_res Switch =
        "Compute ambient occlusion at half the width and height; the blur then brings it to full size";
    "ssao-samples" "N" ssao_samples OneOf(&[8, 16, 24]) = "ssao: the number of samples around each pixel";
    "ssao-rotation" "ROTATION" ssao_rotation Word: SsaoRotation =
        "ssao: matrix rotates the offsets so that the z axis turns to the tile's vector, mirror reflects them in \
         the plane normal to that vector";
    "ssao-depth" "SIZE" ssao_depth Word: SsaoDepth =
        "ssao: full reads the depth image, half reads a copy of it at half the width and height";
    "ssao-normals" "NORMALS" ssao_normals Word: Toggle =
        "ssao: on reverses the offsets that point behind the surface, off keeps them as they are";
    "ssao-curve" "CURVE" ssao_curve WordOrUnset: Toggle =
        "ssao: on returns A^2 + A, off returns A, the mean accessibility of the samples";
    "ao-format" "FORMAT" ao_format Word: AoFormat = "The texture format of ambient occlusion";
    "normal-format" "FORMAT" normal_format Word: NormalFormat = "The texture format of normals";
    "depth-format" "FORMAT" depth_format Word: DepthFormat = "The texture format of linear depth";
}
