//! The surface point of a pixel, and the samples around it that the horizon methods take, in float64. The twins of the
//! methods share these functions, which are themselves the twins of `surface.glsl`, `sampling.glsl`, `tangent.glsl`,
//! `ray.glsl` and `fetch.glsl` in `glsl/shared/`.
//!
//! Names follow the chapter, which uses the capitals R, P, D, T and W.
#![allow(non_snake_case)]

use super::attenuation::{mean_weight, weight};
use super::inputs::TwinInputs;
use crate::Error;
use crate::image::Image;
use crate::projection::Projection;
use crate::settings::{Clamp, Exit, Length, Settings, Snap};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Relative amounts by which values are shifted before they are rounded or compared. Shifted runs find the ambiguous
/// pixels, at which float32 may round or compare otherwise than float64.
#[derive(Clone, Copy)]
pub(super) struct Shift {
    /// The shift of offsets before they are rounded to whole texels.
    pub(super) rounding: f64,
    /// The shift of the values that steps, distances, depths and sines are compared with.
    pub(super) comparison: f64,
}

/// A step counts as a texel if it is shorter by less than a millionth, as in `sampling.glsl`.
const TEXEL: f64 = 1.0 - 1e-6;

/// No shift.
pub(super) const EXACT: Shift = Shift { rounding: 0.0, comparison: 0.0 };

impl Shift {
    /// Rounds an offset to whole texels: floor(x + 0.5).
    pub(super) fn round(self, offset: DVec2) -> DVec2 {
        (offset * (1.0 + self.rounding) + 0.5).floor()
    }
}

/// The surface point P of the pixel that is being evaluated, its normal and its jitter.
pub(super) struct Pixel {
    /// The window position: a texel's centre.
    pub(super) p: DVec2,
    /// The surface point, in eye space.
    pub(super) P: DVec3,
    /// The direction (x', y', 1) of the ray through p; (0, 0, 1) when orthographic.
    pub(super) r: DVec3,
    /// The normal, of any length, turned towards the eye.
    pub(super) n: DVec3,
    /// The radius of influence, in scene units.
    pub(super) R: f64,
    /// The number of samples in each direction: N_s, or fewer if `exit` is `shorten`.
    pub(super) steps: u32,
    /// The step between two samples, in texels.
    pub(super) step_px: DVec2,
    /// R in texels, divided by the least that the method needs. Below 1, the method exits early. It is infinite for a
    /// method that never does.
    pub(super) enough: f64,
    /// The tile's texel for this pixel: (cos a, sin a, b), or for `ssao` a unit vector.
    pub(super) jitter: [f64; 3],
}

impl Pixel {
    /// Returns whether the method exits early at the pixel: A = 1 because R covers too few texels (6.2, Variable step
    /// size).
    pub(super) fn exits_early(&self, shift: Shift) -> bool {
        self.enough < TEXEL + shift.comparison
    }
}

/// A sample S that lies on a surface, and not on P's own texel.
pub(super) struct Sample {
    /// S - P.
    pub(super) D: DVec3,
    /// The depth of the texel that was read.
    pub(super) z: f64,
    /// The way from P's texel to the texel that was read.
    pub(super) taken: DVec2,
}

/// Where a sample lies in the image, in texels from P's own texel.
pub(super) struct Place {
    /// The offset before any rounding.
    pub(super) meant: DVec2,
    /// The texel that is read: rounded, and clamped to the image.
    pub(super) taken: DVec2,
    /// Where S is assumed to lie.
    pub(super) at: DVec2,
}

/// One direction around a pixel.
pub(super) struct Direction {
    /// The way from one sample to the next in texels, before any rounding.
    exact_stride: DVec2,
    /// The way from one sample to the next in texels, rounded if `snap` is `step`.
    pub(super) stride: DVec2,
    /// The jitter's offset in texels, rounded; it is used if `snap` is `step`.
    first: DVec2,
}

/// The inputs and settings of a method.
pub(super) struct MethodScene<'a> {
    depth: Image<f64>,
    normals: Image<[f64; 3]>,
    tile: &'a Image<[f32; 3]>,
    pub(super) projection: Projection,
    pub(super) near: f64,
    pub(super) settings: &'a Settings,
    pub(super) radius: Length,
    /// The distance beyond which samples are ignored. It is R, except in [`super::anatomy::Anatomy::with_outliers`].
    pub(super) reach: Length,
    /// Whether `ssao` has its depth range check. It has, except in
    /// [`super::anatomy::Anatomy::without_range_check`].
    pub(super) range_check: bool,
    /// The size of the whole picture in texels of the result, in which the offsets of `ssao` are measured. It need not
    /// be a whole number. It is that of the inputs unless these are a part of a picture, except in
    /// [`super::anatomy::Anatomy::with_offsets_of`].
    pub(super) extent: DVec2,
    /// How many pixels of the inputs one texel of the result stands for, in x and y. Texel (i, j) stands for pixel
    /// (scale i, scale j). All positions and offsets here are in texels of the result.
    scale: usize,
}

impl<'a> MethodScene<'a> {
    /// Prepares the inputs for the method of the settings.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent, if depth and normals have different sizes, if the tile is not 4x4,
    /// or if the settings exclude each other.
    pub(super) fn new<F: Copy + Into<f64>>(
        inputs: &TwinInputs<'a, F>,
        settings: &'a Settings,
    ) -> Result<MethodScene<'a>, Error> {
        let sizes = [(inputs.depth.width, inputs.depth.height), (inputs.normals.width, inputs.normals.height)];
        if sizes[0] != sizes[1] || (inputs.tile.width, inputs.tile.height) != (4, 4) {
            return Err(Error::Usage(
                "depth and normals must have the same size, and the rotation tile must have 4x4 texels".into(),
            ));
        }
        settings.check_steps()?;
        let radius = settings.radius_read(inputs.projection)?;
        let scale = settings.ao_scale() as usize;
        Ok(MethodScene {
            depth: inputs.depth.map(Into::into),
            normals: inputs.normals.map(|n| n.map(Into::into)),
            tile: inputs.tile,
            projection: inputs.projection,
            near: inputs.near,
            settings,
            radius,
            reach: radius,
            range_check: true,
            extent: DVec2::new(sizes[0].0 as f64, sizes[0].1 as f64) * DVec2::from(inputs.projection.whole())
                / scale as f64,
            scale,
        })
    }

    /// Returns the surface point at texel (x, y) of the result; `None` on background.
    pub(super) fn pixel(&self, x: usize, y: usize) -> Option<Pixel> {
        self.pixel_shifted(x, y, EXACT)
    }

    /// Returns [`MethodScene::pixel`] with shifted comparisons and roundings: the normal of a surface that is seen
    /// edge-on within the shift is turned the other way, and the number of steps may differ by one.
    pub(super) fn pixel_shifted(&self, x: usize, y: usize, shift: Shift) -> Option<Pixel> {
        let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let z = self.depth(x, y);
        if z.is_infinite() {
            return None;
        }
        let r = self.ray(p);
        let n = DVec3::from(self.normals.at(self.scale * x, self.scale * y));
        let radius_px = self.radius_in_texels(z);
        let least = radius_px.min_element();
        let (steps, enough) = match self.settings.exit_read() {
            None => (self.settings.steps, f64::INFINITY),
            // The chapter's early exit: the step, R in texels divided by N_s + 1, is shorter than a texel.
            Some(Exit::Paper) => (self.settings.steps, least / f64::from(self.settings.steps + 1)),
            // So many steps that none is shorter than a texel.
            Some(Exit::Shorten) => {
                let longest = (least * (1.0 + shift.rounding)).floor() - 1.0;
                (longest.clamp(1.0, f64::from(self.settings.steps)) as u32, least / 2.0)
            }
        };
        Some(Pixel {
            p,
            P: self.position(p, z),
            r,
            // The tangent plane is the same for n and -n.
            n: if n.dot(r) > shift.comparison * n.length() * r.length() { -n } else { n },
            R: self.radius.at(z),
            steps,
            step_px: radius_px / f64::from(steps + 1),
            enough,
            jitter: self.tile.at(x % 4, y % 4).map(f64::from),
        })
    }

    /// Returns direction k, turned by the tile's angle a (Eq. 6.2.10).
    pub(super) fn direction(&self, pixel: &Pixel, k: u32, shift: Shift) -> Direction {
        let [_, _, b] = pixel.jitter;
        let exact_stride = pixel.step_px * self.turned(pixel, k);
        let snapped = self.settings.snap == Snap::Step;
        let stride = if snapped { shift.round(exact_stride) } else { exact_stride };
        Direction { exact_stride, stride, first: shift.round(b * exact_stride) }
    }

    /// Returns the unit vector at the angle 2 pi k / N_d, turned by the tile's angle a.
    pub(super) fn turned(&self, pixel: &Pixel, k: u32) -> DVec2 {
        let [cos_a, sin_a, _] = pixel.jitter;
        let theta = TAU * f64::from(k) / f64::from(self.settings.directions);
        DVec2::new(cos_a, sin_a).rotate(DVec2::from_angle(theta))
    }

    /// Returns how far from P sample i = 1..N_s is meant to lie, in steps: at ((b + i)/(N + 1))^spacing of R, but at
    /// least a texel away on either axis. Samples that are evenly spaced are never nearer.
    fn walk(&self, pixel: &Pixel, i: u32) -> f64 {
        let even = pixel.jitter[2] + f64::from(i);
        let all = f64::from(pixel.steps + 1);
        match self.settings.spacing_read() {
            1.0 => even,
            spacing => (all * (even / all).powf(spacing)).max(1.0 / pixel.step_px.min_element()),
        }
    }

    /// Returns q = ((b + i - 1)/(b + i))^spacing: the distance that the sample before sample i is meant to have,
    /// divided by that of sample i. It is 0 for the first sample.
    pub(super) fn nearer(&self, pixel: &Pixel, i: u32) -> f64 {
        let even = pixel.jitter[2] + f64::from(i);
        if i > 1 { ((even - 1.0) / even).powf(self.settings.spacing_read()) } else { 0.0 }
    }

    /// Returns the mean of W(q r) and W(r).
    pub(super) fn mean_attenuation(&self, pixel: &Pixel, q: f64, r: f64) -> f64 {
        mean_weight(self.settings.attenuation, q, r, pixel.R)
    }

    /// Returns where sample i = 1..N_s of a direction lies in the image.
    pub(super) fn place(&self, pixel: &Pixel, direction: &Direction, i: u32, shift: Shift) -> Place {
        let s = self.settings;
        let meant = self.walk(pixel, i) * direction.exact_stride;
        let offset = match s.snap {
            Snap::Step => direction.first + f64::from(i) * direction.stride,
            Snap::Sample | Snap::None => shift.round(meant),
        };
        let taken = self.clamped(pixel.p + offset) - pixel.p;
        let at = match (s.clamp, s.snap) {
            (Clamp::Position, _) if taken != offset => taken,
            (_, Snap::None) => meant,
            _ => offset,
        };
        Place { meant, taken, at }
    }

    /// Returns sample i = 1..N_s of a direction. `None` on background and on P's own texel, where samples are ignored.
    pub(super) fn sample(&self, pixel: &Pixel, direction: &Direction, i: u32, shift: Shift) -> Option<Sample> {
        let Place { taken, at, .. } = self.place(pixel, direction, i, shift);
        self.at(pixel, taken, at)
    }

    /// Returns the sample that reads the texel at the offset `taken` from P's own, and is assumed to lie at the offset
    /// `at`. `None` on background, and on P's own texel.
    pub(super) fn at(&self, pixel: &Pixel, taken: DVec2, at: DVec2) -> Option<Sample> {
        let q = pixel.p + taken;
        let z = self.depth(q.x as usize, q.y as usize);
        let ignored = taken == DVec2::ZERO || z.is_infinite();
        (!ignored).then(|| Sample { D: self.position(pixel.p + at, z) - pixel.P, z, taken })
    }

    /// Returns whether the sample lies within R of P.
    pub(super) fn within(&self, pixel: &Pixel, sample: &Sample, shift: Shift) -> bool {
        sample.D.length() <= self.reach.at(pixel.P.z) * (1.0 + shift.comparison)
    }

    /// Returns the attenuation W(r).
    pub(super) fn attenuation(&self, pixel: &Pixel, r: f64) -> f64 {
        weight(self.settings.attenuation, r, pixel.R)
    }

    /// Returns the sine of the elevation of the tangent T = du dP/dx' + dv dP/dy' (Eq. 6.2.11), where (du, dv) belongs
    /// to an offset in texels. The elevation is raised by the angle bias, to at most 90 degrees.
    pub(super) fn sine_of_tangent(&self, pixel: &Pixel, offset: DVec2) -> f64 {
        let T = self.tangent(pixel, offset);
        self.raised(-T.z, T.truncate().length())
    }

    /// Returns the sine of an elevation that is raised by the angle bias, to at most 90 degrees. The elevation is that
    /// of a vector which goes up by `sine` where it goes ahead by `cosine`.
    pub(super) fn raised(&self, sine: f64, cosine: f64) -> f64 {
        (sine.atan2(cosine) + self.settings.bias).min(FRAC_PI_2).sin()
    }

    /// Returns the tangent T of Eq. 6.2.11 for an offset in texels. Its length has no meaning.
    pub(super) fn tangent(&self, pixel: &Pixel, offset: DVec2) -> DVec3 {
        let (n, r, lateral) = (pixel.n, pixel.r, offset * self.pixel_extent());
        // dP/dx' = z (e_x - r n.x / (n.r)). T is multiplied by -(n.r) / z: this factor is positive, so the direction
        // stays the same. No division by n.r remains; n.r is 0 if the surface is seen edge-on.
        let derivative = |e: DVec3| -n.dot(r) * e + n.dot(e) * r;
        lateral.x * derivative(DVec3::X) + lateral.y * derivative(DVec3::Y)
    }

    /// Returns the surface point at depth z on the ray through the window position p: z (x', y', 1), or (x', y', z)
    /// from the middle of the picture when orthographic.
    pub(super) fn position(&self, p: DVec2, z: f64) -> DVec3 {
        let from_middle = (p - self.middle()) * self.pixel_extent();
        match self.projection {
            Projection::Perspective(extents) => z * (DVec2::from(extents.middle()) + from_middle).extend(1.0),
            Projection::Orthographic(_) => from_middle.extend(z),
        }
    }

    /// Returns r, the direction of the ray through the window position p: (x', y', 1), or (0, 0, 1) when orthographic.
    pub(super) fn ray(&self, p: DVec2) -> DVec3 {
        match self.projection {
            Projection::Perspective { .. } => self.position(p, 1.0),
            Projection::Orthographic { .. } => DVec3::Z,
        }
    }

    /// Returns what one texel adds to x' and y'.
    pub(super) fn pixel_extent(&self) -> DVec2 {
        let full = DVec2::new(self.depth.width as f64, self.depth.height as f64);
        let half = DVec2::from(self.projection.half_extents());
        self.scale as f64 * 2.0 * half / full
    }

    /// Returns the point of the result that is the middle of the inputs. Position i + 0.5 in the result is position
    /// scale i + 0.5 in the inputs.
    fn middle(&self) -> DVec2 {
        let middle = DVec2::new(self.depth.width as f64, self.depth.height as f64) / 2.0;
        (middle - 0.5) / self.scale as f64 + 0.5
    }

    /// Returns the depth at texel (x, y) of the result.
    pub(super) fn depth(&self, x: usize, y: usize) -> f64 {
        self.depth_of_pixel(self.scale * x, self.scale * y)
    }

    /// Returns the depth at pixel (x, y) of the inputs.
    pub(super) fn depth_of_pixel(&self, x: usize, y: usize) -> f64 {
        self.depth.at(x, y)
    }

    /// Returns R projected to the image at the depth z, in texels (Figure 6.2.11).
    pub(super) fn radius_in_texels(&self, z: f64) -> DVec2 {
        match self.projection {
            Projection::Perspective { .. } => self.radius.at(z) / (z * self.pixel_extent()),
            Projection::Orthographic { .. } => self.radius.at(z) / self.pixel_extent(),
        }
    }

    /// Returns the width and height of the result.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.depth.width.div_ceil(self.scale), self.depth.height.div_ceil(self.scale))
    }

    /// Returns the window position p, clamped to the centres of the texels in the image.
    pub(super) fn clamped(&self, p: DVec2) -> DVec2 {
        let (width, height) = self.size();
        p.clamp(DVec2::splat(0.5), DVec2::new(width as f64, height as f64) - 0.5)
    }
}
