//! Declares every setting once, with its meaning, unit, range and default, and every method once, with all facts about
//! it.
//!
//! The command line's flags and `--help`, the settings files (TOML) and the metadata of written images are all made
//! from [`KNOBS`]; the passes read the typed fields of [`Settings`]. Which settings a method reads, how many samples it
//! takes and what else distinguishes it is stated only in its row of facts ([`Method::facts`]).

mod choice;
mod exit;
#[cfg(feature = "render")]
mod file;
mod guard;
mod idle;
mod knobs;
mod length;
pub(crate) mod method;
mod samples;

pub use choice::{
    AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Edges, Exit, Grounding, Jitter, NormalFormat, Normals,
    Quadrature, Snap, SsaoDepth, SsaoRotation, Toggle, Zenith,
};
pub use idle::Idle;
pub use knobs::{KNOBS, Kind, Knob};
pub use length::{Length, Radius};
pub use method::{Marker, Method, MethodBlur, MethodFacts, TileKind};

use crate::Error;
use crate::projection::Projection;

/// All settings of ambient occlusion and of the pipeline around it. Angles are in radians.
///
/// Nothing checks a field when it is set. [`Settings::validate`] checks that all fields are in the ranges of [`KNOBS`].
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The ambient occlusion method.
    pub method: Method,
    /// R, the radius of influence. A percentage of a scene's size must be converted to scene units
    /// ([`Settings::resolved`]) before anything is rendered.
    pub radius: Radius,
    /// N_d, the number of directions around each pixel: 1 to 64.
    pub directions: u32,
    /// N_s, the number of steps along each direction: 1 to 256.
    pub steps: u32,
    /// N_r, the number of rays that `ray-march` casts at each azimuth: 1 to 64.
    pub rays: u32,
    /// The angle bias in radians, by which tangents are raised: 0 to 89 degrees.
    pub bias: f64,
    /// The factor by which the occlusion is multiplied: finite and above 0.
    pub strength: f64,
    /// The attenuation W(r), the weight of an occluder at the distance r.
    pub attenuation: Attenuation,
    /// How sample positions are rounded to texel centres. [`Snap::Step`] needs samples that are evenly spaced, and goes
    /// with a [`Settings::spacing`] of 1 only.
    pub snap: Snap,
    /// Where a sample beyond the image's border is assumed to lie.
    pub clamp: Clamp,
    /// What the method does where a step would be shorter than a texel.
    pub exit: Exit,
    /// The tangent from which the elevations of samples are measured.
    pub grounding: Grounding,
    /// The axis from which `hbao-view` measures elevations.
    pub zenith: Zenith,
    /// The power by which `hbao-view` spaces its samples: 1 to 4. With 1 they are evenly spaced. The higher it is, the
    /// nearer to P they lie.
    pub spacing: f64,
    /// The attenuation of `hbao-view` over a rise of the horizon.
    pub quadrature: Quadrature,
    /// Where the G-buffer's normals come from.
    pub normals: Normals,
    /// Whether directions and steps differ from pixel to pixel.
    pub jitter: Jitter,
    /// The width of the blur in pixels of the full image: odd, from 3 to 41. 0 means no blur.
    pub blur: u32,
    /// Whether the blur runs in two passes or in one.
    pub blur_kernel: BlurKernel,
    /// The depth sigma s_z of the blur in scene units. If it is `None`, [`Settings::depth_sigma`] derives it: the
    /// method's share of R ([`MethodFacts::depth_sigma`]), or for `ssao` a share of the depth.
    pub blur_depth_sigma: Option<f64>,
    /// The number of depth samples per pixel: 1, 2, 4 or 8. The driver may provide fewer.
    pub msaa: u32,
    /// What the blur does at pixels that hold more than one surface.
    pub edges: Edges,
    /// Whether ambient occlusion is computed at half the width and height, rounded up. The blur then brings it to full
    /// size.
    pub half_res: bool,
    /// The number of samples that `ssao` takes for a pixel: 8, 16 or 24.
    pub ssao_samples: u32,
    /// How `ssao` turns its offsets from pixel to pixel.
    pub ssao_rotation: SsaoRotation,
    /// The depth image that the samples of `ssao` read.
    pub ssao_depth: SsaoDepth,
    /// Whether `ssao` reverses offsets that point behind the surface.
    pub ssao_normals: Toggle,
    /// Whether `ssao` returns A^2 + A, as Crysis does, in place of A. If it is `None`, [`Settings::curve`] derives it.
    pub ssao_curve: Option<Toggle>,
    /// The texture format of ambient occlusion.
    pub ao_format: AoFormat,
    /// The texture format of the G-buffer's normals.
    pub normal_format: NormalFormat,
    /// The texture format of the G-buffer's linear depth.
    pub depth_format: DepthFormat,
}

impl Default for Settings {
    /// The chapter's method (ShaderX7 6.2) with 8 directions of 8 steps, a radius of 5 % of the view's height, a 9x9
    /// blur, 4 samples per pixel and 8-bit targets for normals and ambient occlusion.
    fn default() -> Settings {
        Settings {
            method: Method::default(),
            radius: Radius::OfView(0.05),
            directions: 8,
            steps: 8,
            rays: 4,
            bias: 0.0,
            strength: 1.0,
            attenuation: Attenuation::default(),
            snap: Snap::default(),
            clamp: Clamp::default(),
            exit: Exit::default(),
            grounding: Grounding::default(),
            zenith: Zenith::default(),
            spacing: 2.0,
            quadrature: Quadrature::default(),
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
            ssao_curve: None,
            ao_format: AoFormat::default(),
            normal_format: NormalFormat::default(),
            depth_format: DepthFormat::default(),
        }
    }
}

impl Settings {
    /// Returns the default settings of a method. Some methods have defaults of their own: `hbao-talk` attenuates
    /// linearly and snaps each sample.
    #[must_use]
    pub fn for_method(method: Method) -> Settings {
        (method.facts().defaults)(Settings { method, ..Settings::default() })
    }

    /// Returns the default settings of a method for a scene whose size is known, as the command has them: the radius is
    /// 5 % of the diagonal of the scene's bounding box.
    #[must_use]
    pub fn for_scene(method: Method) -> Settings {
        Settings { radius: Radius::Percent(5.0), ..Settings::for_method(method) }
    }

    /// Returns the same settings with a radius that needs no scene. `diagonal` is the diagonal of the scene's bounding
    /// box, of which [`Radius::Percent`] is a percentage; it becomes a length in scene units.
    #[must_use]
    pub fn resolved(&self, diagonal: f64) -> Settings {
        let radius = match self.radius {
            Radius::Percent(percent) => Radius::Units(percent / 100.0 * diagonal),
            other => other,
        };
        Settings { radius, ..self.clone() }
    }

    /// Returns R in a view with this projection.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is still a percentage of a scene's size.
    pub fn radius_in(&self, projection: Projection) -> Result<Length, Error> {
        match self.radius {
            Radius::Units(radius) => Ok(Length::Units(radius)),
            Radius::OfView(share) => {
                let height = projection.whole_height();
                Ok(match projection {
                    Projection::Perspective(_) => Length::OfDepth(share * height),
                    Projection::Orthographic(_) => Length::Units(share * height),
                })
            }
            Radius::Percent(_) => self.check_radius().and(Ok(Length::Units(0.0))),
        }
    }

    /// Checks that the radius needs no scene.
    ///
    /// # Errors
    /// [`Error::Usage`] for a percentage of a scene's size.
    pub(crate) fn check_radius(&self) -> Result<(), Error> {
        match self.radius {
            Radius::Units(_) | Radius::OfView(_) => Ok(()),
            Radius::Percent(percent) => Err(Error::Usage(format!(
                "radius {percent}% needs a scene's size: give it in scene units (Radius::Units), or as a share of the view \
                 (Radius::OfView)"
            ))),
        }
    }

    /// Returns R in a view for the passes of the method. It is 0 for a method that reads no radius, whatever the
    /// setting is.
    pub(crate) fn radius_read(&self, projection: Projection) -> Result<Length, Error> {
        if self.method.reads("radius") { self.radius_in(projection) } else { Ok(Length::Units(0.0)) }
    }

    /// Returns whether R is in proportion to depth in a view, for a method that reads it.
    pub(crate) fn radius_of_depth(&self, perspective: bool) -> bool {
        perspective && self.method.reads("radius") && matches!(self.radius, Radius::OfView(_))
    }

    /// Returns how many pixels one texel of unblurred ambient occlusion stands for, in x and in y: 2 at half
    /// resolution, otherwise 1.
    #[must_use]
    pub fn ao_scale(&self) -> u32 {
        if self.half_res && self.method.reads("half-res") { 2 } else { 1 }
    }

    /// Returns whether the method reads normals, so that they are rebuilt from depth where there are none.
    #[must_use]
    pub fn reads_normals(&self) -> bool {
        self.method.computes() && (!self.method.reads("ssao-normals") || self.ssao_normals == Toggle::On)
    }

    /// Returns the depth sigma s_z of the blur. It is [`Settings::blur_depth_sigma`] if that is set. Otherwise it is
    /// the method's share ([`MethodFacts::depth_sigma`]) of the distance within which the method looks for occluders:
    /// of R, or for `ssao` of 2 P.z l_n, the offset in depth of its farthest sample.
    ///
    /// Taps whose depth differs from the pixel's by much more than s_z hardly count. A pixel whose depth samples span
    /// more than s_z is an edge.
    ///
    /// # Errors
    /// [`Error::Usage`] if the sigma follows from a radius in percent.
    pub fn depth_sigma(&self, projection: Projection) -> Result<Length, Error> {
        let facts = self.method.facts();
        match (self.blur_depth_sigma, facts.blur) {
            (Some(sigma), _) => Ok(Length::Units(sigma)),
            (None, MethodBlur::Crysis) => {
                let farthest = 2.0 * ssao_length(self.ssao_samples, self.ssao_samples);
                Ok(Length::OfDepth(farthest * facts.depth_sigma))
            }
            (None, MethodBlur::Gaussian | MethodBlur::None) => Ok(self.radius_in(projection)?.times(facts.depth_sigma)),
        }
    }

    /// Returns whether the depth sigma is in proportion to depth in a view.
    pub(crate) fn sigma_of_depth(&self, perspective: bool) -> bool {
        self.blur_depth_sigma.is_none()
            && (self.method.facts().blur == MethodBlur::Crysis
                || perspective && matches!(self.radius, Radius::OfView(_)))
    }

    /// Returns whether `ssao` returns A^2 + A. It is [`Settings::ssao_curve`] if that is set. Otherwise it is on, but
    /// off with [`Settings::ssao_normals`]: the curve is made for flat surfaces, whose A is 0.5 without normals and 1
    /// with them, and A^2 + A is 1 from A = 0.618 on.
    #[must_use]
    pub fn curve(&self) -> Toggle {
        self.ssao_curve.unwrap_or(match self.ssao_normals {
            Toggle::On => Toggle::Off,
            Toggle::Off => Toggle::On,
        })
    }

    /// Returns the power by which the method spaces its samples; 1 for a method that reads no spacing, whose samples
    /// are evenly spaced.
    pub(crate) fn spacing_read(&self) -> f64 {
        if self.method.reads("spacing") { self.spacing } else { 1.0 }
    }

    /// Checks that every field is in its range, and that the fields go together.
    ///
    /// # Errors
    /// [`Error::Usage`] for a field outside its range. The message names the first such setting and its range, angles
    /// in radians. The same error for two settings that exclude each other; see [`Settings::snap`].
    pub fn validate(&self) -> Result<(), Error> {
        KNOBS.iter().try_for_each(|knob| knob.check(self))?;
        self.check_steps()
    }

    /// Returns whether these settings and others are compiled to the same shaders. They differ then only in numbers
    /// that the shaders read at run time.
    pub(crate) fn same_shaders(&self, other: &Settings) -> bool {
        let &Settings { radius, bias, strength, blur_depth_sigma, .. } = other;
        std::mem::discriminant(&self.radius) == std::mem::discriminant(&radius)
            && (self.bias > 0.0) == (bias > 0.0)
            && self.blur_depth_sigma.is_some() == blur_depth_sigma.is_some()
            && Settings { radius, bias, strength, blur_depth_sigma, ..self.clone() } == *other
    }

    /// Checks that the method's samples are evenly spaced if all steps are rounded at once.
    ///
    /// # Errors
    /// [`Error::Usage`] if they are not.
    pub(crate) fn check_steps(&self) -> Result<(), Error> {
        if self.snap == Snap::Step && self.spacing_read() != 1.0 {
            return Err(Error::Usage(format!(
                "snap step rounds one step for all samples, but with spacing {} no two steps are alike: give --snap sample, \
                 or --spacing 1",
                self.spacing
            )));
        }
        Ok(())
    }
}

/// l_i of ShaderX7 6.1, the length of offset i = 1..n of `ssao` with n samples: in texture coordinates in x and y, and
/// relative to 2 P.z in depth.
pub(crate) fn ssao_length(n: u32, i: u32) -> f64 {
    0.01 * (1.0 + 2.4 / f64::from(n)).powi(i as i32)
}
