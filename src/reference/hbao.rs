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
    shifted(inputs, settings, Shift::default())
}

/// The pixels at which A moves by more than 1e-3 when its roundings and its comparisons are shifted by 1e-5 relative,
/// each either way: where float32 may decide otherwise than float64.
///
/// # Errors
/// As [`hbao`].
pub fn ambiguous(inputs: &Inputs, settings: &Settings) -> Result<Image<bool>, Error> {
    let exact = hbao(inputs, settings)?;
    let mut moved = exact.map(|_| false);
    for [rounding, comparison] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
        let other = shifted(inputs, settings, Shift { rounding: 1e-5 * rounding, comparison: 1e-5 * comparison })?;
        for ((moved, a), b) in moved.texels.iter_mut().zip(&exact.texels).zip(&other.texels) {
            *moved |= (a - b).abs() > 1e-3;
        }
    }
    Ok(moved)
}

/// By how much decisions are shifted, relative.
#[derive(Clone, Copy, Default)]
struct Shift {
    /// Of what is rounded to whole texels.
    rounding: f64,
    /// Of what a step, a distance and a sine are compared with.
    comparison: f64,
}

fn shifted(inputs: &Inputs, settings: &Settings, shift: Shift) -> Result<Image<f64>, Error> {
    let (width, height) = (inputs.depth.width, inputs.depth.height);
    if (inputs.normals.width, inputs.normals.height) != (width, height)
        || (inputs.tile.width, inputs.tile.height) != (4, 4)
    {
        return Err(Error::Usage("depth and normals must be of one size, and the rotation tile 4x4".into()));
    }
    let twin = Twin { inputs, settings, radius: settings.radius_units()?, shift };
    let texels = (0..width * height).into_par_iter().map(|i| twin.visibility(i % width, i / width)).collect();
    Ok(Image { width, height, texels })
}

struct Twin<'a> {
    inputs: &'a Inputs<'a>,
    settings: &'a Settings,
    radius: f64,
    shift: Shift,
}

impl Twin<'_> {
    fn visibility(&self, x: usize, y: usize) -> f64 {
        let (s, R) = (self.settings, self.radius);
        let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let z = f64::from(self.inputs.depth.at(x, y));
        if z.is_infinite() {
            return 1.0;
        }

        // R in texels, divided into steps (6.2, Variable step size).
        let step_px = self.radius_in_texels(z) / f64::from(s.steps + 1);
        if step_px.min_element() < 1.0 + self.shift.comparison {
            return 1.0;
        }

        let P = self.position(p, z);
        let r = self.ray(p);
        let n = DVec3::from(self.inputs.normals.at(x, y).map(f64::from));
        // The tangent plane is the same for n and -n.
        let n = if n.dot(r) > 0.0 { -n } else { n };

        let [cos_a, sin_a, b] = self.inputs.tile.at(x % 4, y % 4).map(f64::from);

        let mut occlusion = 0.0;
        for k in 0..s.directions {
            // Eq. 6.2.10: the direction turned by a.
            let theta = TAU * f64::from(k) / f64::from(s.directions);
            let d = DVec2::new(cos_a, sin_a).rotate(DVec2::from_angle(theta));
            let exact_stride = step_px * d;
            let first = self.round(b * exact_stride);
            let stride = if s.snap == Snap::Step { self.round(exact_stride) } else { exact_stride };
            // The horizon starts at the tangent, t(theta).
            let mut tangent = self.sine_of_tangent(stride * self.pixel(), r, n);
            let mut horizon = tangent;
            let mut previous = 0.0;
            for i in 1..=s.steps {
                let exact = (b + f64::from(i)) * exact_stride;
                let offset = match s.snap {
                    Snap::Step => first + f64::from(i) * stride,
                    Snap::Sample | Snap::None => self.round(exact),
                };
                let size = self.size();
                let q = (p + offset).clamp(DVec2::splat(0.5), size - 0.5);
                let taken = q - p;
                let clamped = taken != offset;
                let at = match (s.clamp, s.snap) {
                    (Clamp::Position, _) if clamped => taken,
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
                if D.length() > R * (1.0 + self.shift.comparison) || sine <= horizon + self.shift.comparison {
                    continue;
                }
                // Eq. 6.2.9, or with the direction's tangent Eq. 6.2.8.
                if s.grounding == Grounding::Sample {
                    tangent = self.sine_of_tangent(taken * self.pixel(), r, n);
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
        }
        (1.0 - s.strength / f64::from(s.directions) * occlusion).clamp(0.0, 1.0)
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
        let slope = (p - 0.5 * self.size()) * self.pixel();
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
    fn pixel(&self) -> DVec2 {
        2.0 * match self.inputs.projection {
            Projection::Perspective { tan_half_fov_x, tan_half_fov_y } => DVec2::new(tan_half_fov_x, tan_half_fov_y),
            Projection::Orthographic { half_width, half_height } => DVec2::new(half_width, half_height),
        } / self.size()
    }

    /// R projected at depth z, in texels (Figure 6.2.11).
    fn radius_in_texels(&self, z: f64) -> DVec2 {
        match self.inputs.projection {
            Projection::Perspective { .. } => self.radius / (z * self.pixel()),
            Projection::Orthographic { .. } => self.radius / self.pixel(),
        }
    }

    fn size(&self) -> DVec2 {
        DVec2::new(self.inputs.depth.width as f64, self.inputs.depth.height as f64)
    }

    /// To whole texels.
    fn round(&self, offset: DVec2) -> DVec2 {
        (offset * (1.0 + self.shift.rounding) + 0.5).floor()
    }
}
