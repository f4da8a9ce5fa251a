//! The float64 twin of `glsl/hbao_view.frag`.
#![doc = include_str!("hbao_view.md")]
#![allow(non_snake_case)]

use super::horizons::{grounded, horizons};
use super::observer::{HorizonSample, Observer};
use super::sampling::{MethodScene, Pixel, Sample, Shift};
use super::twin::{Converged, Twin, directions, no_curve, strength_by_direction};
use crate::settings::{Quadrature, Zenith};
use glam::{DVec2, DVec3};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: strength_by_direction,
    curve: no_curve,
    converged: Some(Converged { occlusion: converged, ignores_repeats: true }),
};

/// The plane that is spanned by v and a, the unit azimuth of a direction of the image.
struct Slice {
    /// The sine and cosine of t(theta), the elevation over a of the surface's tangent in this plane.
    sine: f64,
    cosine: f64,
    /// D.up and D.ahead are how far a sample lies above P towards the eye, and how far beside it in the slice.
    up: DVec3,
    ahead: DVec3,
    /// The least share of an offset that D.ahead must be.
    least: f64,
}

/// A sample nearly at a right angle to its slice, as the picture's border can make it, has no elevation in the slice:
/// what is left of D there is little more than a rounding error. This is the least share, relative to that of a sample
/// in the slice.
const BESIDE: f64 = 1.0 / 16.0;

/// Returns the slice in the direction e of the image, a unit vector in eye space.
///
/// X = D.n' is how high S lies above the surface, C = D.T how far along it, and turned by t these are D.up and D.ahead.
/// For a D in the slice they are D.v and D.a. For a sample that snapping has moved beside the slice, they are those of
/// the point that it gets to when it is moved back into the slice parallel to the tangent plane. So the elevation of a
/// sample on the tangent plane is t, whatever its azimuth.
fn slice(pixel: &Pixel, e: DVec2) -> Slice {
    let r = pixel.r.normalize();
    let n = pixel.n.normalize_or_zero();
    // b is the slice's unit normal.
    let b = r.cross(e.extend(0.0)).normalize();
    let (v, a) = (-r, b.cross(r));
    // n.v can be 0 if the surface is seen edge-on. Such a normal is turned a little towards the eye.
    let (nv, na) = (n.dot(v).max(1e-6), n.dot(a));
    let n = nv * v + na * a + n.dot(b) * b;
    let m = nv.hypot(na);
    let (sine, cosine) = (-na / m, nv / m);
    let (n, T) = (n / m, (nv * a - na * v) / m);
    let (up, ahead) = (cosine * n + sine * T, cosine * T - sine * n);
    Slice { sine, cosine, up, ahead, least: BESIDE * ahead.truncate().abs().max_element() }
}

/// Returns the sum of Eq. 6.2.9 in direction k.
fn occlusion(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, observer: &mut dyn Observer) -> f64 {
    let direction = scene.direction(pixel, k, shift);
    // A step on either axis has the same length in eye space, so that the unit vector is its direction there.
    let slice = slice(pixel, scene.turned(pixel, k));
    let zenith = scene.settings.zenith;
    let start = match zenith {
        Zenith::View => scene.raised(slice.sine, slice.cosine),
        Zenith::Axis => scene.sine_of_tangent(pixel, direction.stride),
    };
    observer.starts(start);
    let ground = |sample: &Sample| match zenith {
        Zenith::View => start,
        Zenith::Axis => scene.sine_of_tangent(pixel, sample.taken),
    };
    let mut horizon = start;
    let mut previous = 0.0;
    let mut last_weight = 1.0;
    let mut occlusion = 0.0;
    for i in 1..=pixel.steps {
        let Some(sample) = scene.sample(pixel, &direction, i, shift) else { continue };
        let (up, r, seen) = match zenith {
            Zenith::View => {
                let (up, ahead) = (sample.D.dot(slice.up), sample.D.dot(slice.ahead));
                // D is (z - P.z) r plus the offset, in perspective at the depth z.
                let offset = (sample.D - sample.D.z * pixel.r).truncate();
                // What snapping has moved behind P in the slice belongs to the opposite direction.
                let least = slice.least * offset.abs().max_element();
                (up, up.hypot(ahead), ahead > least * (1.0 + shift.comparison))
            }
            Zenith::Axis => (-sample.D.z, sample.D.length(), true),
        };
        let sine = up / r;
        let within = r <= scene.reach.at(pixel.P.z) * (1.0 + shift.comparison);
        let raises = seen && within && sine > horizon + shift.comparison;
        let told = HorizonSample { sample: &sample, sine, horizon, ground: &|| ground(&sample), within, raises };
        observer.sample(i, &told);
        if !raises {
            continue;
        }
        let rise = sine - ground(&sample);
        let end = scene.attenuation(pixel, r);
        let q = scene.nearer(pixel, i);
        let weight = match scene.settings.quadrature {
            Quadrature::End => end,
            Quadrature::Mean => (end + last_weight) / 2.0,
            Quadrature::Interval => scene.mean_attenuation(pixel, q, r),
            Quadrature::Expected => scene.mean_attenuation(pixel, q, r) * (1.0 + 0.25 * (1.0 - q * q) * (0.75 - rise)),
        };
        let added = weight * (rise - previous);
        observer.adds(i, added);
        occlusion += added;
        previous = rise;
        last_weight = end;
        horizon = sine;
    }
    occlusion
}

/// Returns the sum of Eq. 6.2.9 in direction k with a sample at every texel, where all quadratures are the same. Each
/// sample is measured in the slice of its own azimuth, which it lies in.
fn converged(scene: &MethodScene, pixel: &Pixel, k: u32, shift: Shift, _: &mut dyn Observer) -> f64 {
    let rise = |sample: &Sample, r: f64| match scene.settings.zenith {
        Zenith::View => {
            let offset = (sample.D - sample.D.z * pixel.r).truncate();
            let slice = slice(pixel, offset.normalize());
            sample.D.dot(slice.up) / r - scene.raised(slice.sine, slice.cosine)
        }
        Zenith::Axis => grounded(scene, pixel, sample, r),
    };
    let mut previous = 0.0;
    let increments = horizons(scene, pixel, k, shift, rise).map(|(rise, r)| {
        let increment = scene.attenuation(pixel, r) * (rise - previous);
        previous = rise;
        increment
    });
    increments.sum()
}
