//! Every setting once: its meaning, unit, range and default; and every method once, with all that is known of it.
//!
//! The command line's flags and `--help`, the settings files (TOML) and the metadata of the images written all come
//! from [`KNOBS`]; the passes read the typed fields of [`Settings`]. What a method reads, how many samples it takes and
//! what else tells it from the others stands in its row of facts ([`Method::facts`]), and nowhere else.

mod choice;
#[cfg(feature = "render")]
mod file;
mod idle;
mod knobs;
pub(crate) mod method;

pub use choice::{
    AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Edges, Grounding, Jitter, NormalFormat, Normals, Snap,
    SsaoDepth, SsaoRotation, Toggle,
};
pub use idle::Idle;
pub use knobs::{KNOBS, Kind, Knob};
pub use method::{Marker, Method, MethodBlur, MethodFacts, TileKind};

use crate::Error;

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
    /// The defaults of a method, which for some settings are its own: the talk attenuates linearly and snaps each
    /// sample.
    #[must_use]
    pub fn for_method(method: Method) -> Settings {
        (method.facts().defaults)(Settings { method, ..Settings::default() })
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
        match (self.blur_depth_sigma, self.method.facts().blur) {
            (Some(sigma), _) => Ok(DepthSigma::Units(sigma)),
            (None, MethodBlur::Crysis) => {
                let n = f64::from(self.ssao_samples);
                Ok(DepthSigma::OfDepth(2.0 * 0.01 * (1.0 + 2.4 / n).powf(n) / 4.0))
            }
            (None, MethodBlur::Gaussian | MethodBlur::None) => Ok(DepthSigma::Units(self.radius_units()? / 4.0)),
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
}
