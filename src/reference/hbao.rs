//! The float64 twin of `glsl/hbao.frag`: horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9.
//!
//! Names follow the chapter: R, P, D, T and W are its capitals.
#![allow(non_snake_case)]

use crate::Error;
use crate::image::Image;
use crate::scene::Projection;
use crate::settings::{Attenuation, Clamp, Grounding, Settings, Snap};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// The images that ambient occlusion is computed from, all of one size.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// Linear eye-space z; infinite on background.
    pub depth: &'a Image<f32>,
    /// Eye-space normals, of any length.
    pub normals: &'a Image<[f32; 3]>,
    /// The 4x4 rotation tile: cos a, sin a, b.
    pub tile: &'a Image<[f32; 3]>,
    /// The view's projection.
    pub projection: Projection,
}

/// Visibility A in [0, 1]; 1 on background.
///
/// # Errors
/// A radius in percent, or images of different sizes.
pub fn hbao(inputs: &Inputs, settings: &Settings) -> Result<Image<f64>, Error> {
    let twin = Twin::new(inputs, settings)?;
    Ok(twin.image(|x, y| {
        let Some(pixel) = twin.pixel(x, y) else { return 1.0 };
        if pixel.exits_early(EXACT) {
            return 1.0;
        }
        let occlusion: f64 = (0..settings.directions).map(|k| twin.occlusion(&pixel, k, EXACT)).sum();
        (1.0 - settings.strength / f64::from(settings.directions) * occlusion).clamp(0.0, 1.0)
    }))
}

/// The pixels at which A can move by more than 1e-3 when roundings and comparisons are shifted by 1e-5 relative,
/// either way and in each direction apart: where float32 may decide otherwise than float64.
///
/// # Errors
/// As [`hbao`].
pub fn ambiguous(inputs: &Inputs, settings: &Settings) -> Result<Image<bool>, Error> {
    let twin = Twin::new(inputs, settings)?;
    let shifts = [[1e-5, 1e-5], [1e-5, -1e-5], [-1e-5, 1e-5], [-1e-5, -1e-5]]
        .map(|[rounding, comparison]| Shift { rounding, comparison });
    Ok(twin.image(|x, y| {
        let Some(pixel) = twin.pixel(x, y) else { return false };
        let exits = shifts.map(|shift| pixel.exits_early(shift));
        if exits.iter().all(|&exits| exits) {
            return false;
        }
        let moves: f64 = (0..settings.directions)
            .map(|k| {
                // Where the exit itself is in doubt, the whole occlusion is.
                let exact = if exits.contains(&true) { 0.0 } else { twin.occlusion(&pixel, k, EXACT) };
                shifts.iter().map(|&shift| (twin.occlusion(&pixel, k, shift) - exact).abs()).fold(0.0, f64::max)
            })
            .sum();
        settings.strength / f64::from(settings.directions) * moves > 1e-3
    }))
}

/// By how much decisions are shifted, relative.
#[derive(Clone, Copy)]
struct Shift {
    /// Of what is rounded to whole texels.
    rounding: f64,
    /// Of what a step, a distance and a sine are compared with.
    comparison: f64,
}

const EXACT: Shift = Shift { rounding: 0.0, comparison: 0.0 };

impl Shift {
    /// To whole texels.
    fn round(self, offset: DVec2) -> DVec2 {
        (offset * (1.0 + self.rounding) + 0.5).floor()
    }
}

/// What is known of a pixel before any direction is looked into.
struct Pixel {
    p: DVec2,
    P: DVec3,
    r: DVec3,
    n: DVec3,
    step_px: DVec2,
    jitter: [f64; 3],
}

impl Pixel {
    /// Steps below a texel: A is 1 (6.2, Variable step size).
    fn exits_early(&self, shift: Shift) -> bool {
        self.step_px.min_element() < 1.0 + shift.comparison
    }
}

struct Twin<'a> {
    inputs: &'a Inputs<'a>,
    settings: &'a Settings,
    radius: f64,
}

impl<'a> Twin<'a> {
    fn new(inputs: &'a Inputs, settings: &'a Settings) -> Result<Twin<'a>, Error> {
        let sizes = [(inputs.depth.width, inputs.depth.height), (inputs.normals.width, inputs.normals.height)];
        if sizes[0] != sizes[1] || (inputs.tile.width, inputs.tile.height) != (4, 4) {
            return Err(Error::Usage("depth and normals must be of one size, and the rotation tile 4x4".into()));
        }
        Ok(Twin { inputs, settings, radius: settings.radius_units()? })
    }

    fn image<T: Copy + Send>(&self, texel: impl Fn(usize, usize) -> T + Sync) -> Image<T> {
        let (width, height) = (self.inputs.depth.width, self.inputs.depth.height);
        let texels = (0..width * height).into_par_iter().map(|i| texel(i % width, i / width)).collect();
        Image { width, height, texels }
    }

    /// None on background.
    fn pixel(&self, x: usize, y: usize) -> Option<Pixel> {
        let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let z = f64::from(self.inputs.depth.at(x, y));
        if z.is_infinite() {
            return None;
        }
        let r = self.ray(p);
        let n = DVec3::from(self.inputs.normals.at(x, y).map(f64::from));
        Some(Pixel {
            p,
            P: self.position(p, z),
            r,
            // The tangent plane is the same for n and -n.
            n: if n.dot(r) > 0.0 { -n } else { n },
            // R in texels, divided into steps.
            step_px: self.radius_in_texels(z) / f64::from(self.settings.steps + 1),
            jitter: self.inputs.tile.at(x % 4, y % 4).map(f64::from),
        })
    }

    /// The sum of Eq. 6.2.9 in direction k.
    fn occlusion(&self, pixel: &Pixel, k: u32, shift: Shift) -> f64 {
        let (s, R) = (self.settings, self.radius);
        let Pixel { p, P, r, n, step_px, jitter: [cos_a, sin_a, b] } = *pixel;
        // Eq. 6.2.10: the direction turned by a.
        let theta = TAU * f64::from(k) / f64::from(s.directions);
        let d = DVec2::new(cos_a, sin_a).rotate(DVec2::from_angle(theta));
        let exact_stride = step_px * d;
        let first = shift.round(b * exact_stride);
        let stride = if s.snap == Snap::Step { shift.round(exact_stride) } else { exact_stride };
        // The horizon starts at the tangent, t(theta).
        let mut tangent = self.sine_of_tangent(stride * self.pixel_extent(), r, n);
        let mut horizon = tangent;
        let mut previous = 0.0;
        let mut occlusion = 0.0;
        for i in 1..=s.steps {
            let exact = (b + f64::from(i)) * exact_stride;
            let offset = match s.snap {
                Snap::Step => first + f64::from(i) * stride,
                Snap::Sample | Snap::None => shift.round(exact),
            };
            let q = (p + offset).clamp(DVec2::splat(0.5), self.size() - 0.5);
            let taken = q - p;
            // Where the sample is taken to lie, in texels from p.
            let at = match (s.clamp, s.snap) {
                (Clamp::Position, _) if taken != offset => taken,
                (_, Snap::None) => exact,
                _ => offset,
            };
            let sample_z = f64::from(self.inputs.depth.at(q.x as usize, q.y as usize));
            if taken == DVec2::ZERO || sample_z.is_infinite() {
                continue;
            }
            let D = self.position(p + at, sample_z) - P;
            // Eq. 6.2.6, as a sine: it orders samples as the tangent does.
            let sine = -D.z / D.length();
            if D.length() > R * (1.0 + shift.comparison) || sine <= horizon + shift.comparison {
                continue;
            }
            // Eq. 6.2.9, or with the direction's tangent Eq. 6.2.8.
            if s.grounding == Grounding::Sample {
                tangent = self.sine_of_tangent(taken * self.pixel_extent(), r, n);
            }
            let rise = sine - tangent;
            let W = match s.attenuation {
                Attenuation::Quadratic => 1.0 - (D.length() / R).powi(2),
                Attenuation::Linear => 1.0 - D.length() / R,
                Attenuation::None => 1.0,
            };
            occlusion += W * (rise - previous);
            previous = rise;
            horizon = sine;
        }
        occlusion
    }

    /// The sine of the elevation of the tangent T = du dP/dx' + dv dP/dy' (Eq. 6.2.11), lateral = (du, dv), raised by
    /// the angle bias to at most 90 degrees.
    fn sine_of_tangent(&self, lateral: DVec2, r: DVec3, n: DVec3) -> f64 {
        // dP/dx' = z (e_x - r n.x / (n.r)), here times -(n.r) / z, which is positive and finite edge-on.
        let derivative = |e: DVec3| -n.dot(r) * e + n.dot(e) * r;
        let T = lateral.x * derivative(DVec3::X) + lateral.y * derivative(DVec3::Y);
        let t = (-T.z).atan2(T.truncate().length());
        (t + self.settings.bias).min(FRAC_PI_2).sin()
    }

    /// The point at depth z on the ray through the window position p.
    fn position(&self, p: DVec2, z: f64) -> DVec3 {
        let slope = (p - 0.5 * self.size()) * self.pixel_extent();
        match self.inputs.projection {
            Projection::Perspective { .. } => z * slope.extend(1.0),
            Projection::Orthographic { .. } => slope.extend(z),
        }
    }

    /// r, the direction of the ray through p.
    fn ray(&self, p: DVec2) -> DVec3 {
        match self.inputs.projection {
            Projection::Perspective { .. } => self.position(p, 1.0),
            Projection::Orthographic { .. } => DVec3::Z,
        }
    }

    /// What a texel adds to x' and y'.
    fn pixel_extent(&self) -> DVec2 {
        2.0 * match self.inputs.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => DVec2::new(tan_half_fov_x, tan_half_fov_y),
            Projection::Orthographic { half_width, half_height } => DVec2::new(half_width, half_height),
        } / self.size()
    }

    /// R projected at depth z, in texels (Figure 6.2.11).
    fn radius_in_texels(&self, z: f64) -> DVec2 {
        match self.inputs.projection {
            Projection::Perspective { .. } => self.radius / (z * self.pixel_extent()),
            Projection::Orthographic { .. } => self.radius / self.pixel_extent(),
        }
    }

    fn size(&self) -> DVec2 {
        DVec2::new(self.inputs.depth.width as f64, self.inputs.depth.height as f64)
    }
}
