//! The float64 twin of `glsl/ray_march.frag`: ambient occlusion by marching rays over the depth image, which ShaderX7
//! 6.2 gives as the brute-force method.

use super::observer::{Observer, Step};
use super::sampling::{MethodScene, Pixel, Sample, Shift};
use super::twin::{Twin, directions, no_curve};
use glam::{DVec2, DVec3};

pub(super) const TWIN: Twin = Twin {
    occlusion,
    count: directions,
    scale: |settings| settings.strength / (f64::from(settings.directions) * f64::from(settings.rays)),
    curve: no_curve,
    // It has no converged form: the number of rays would have to grow together with the directions and steps.
    converged: None,
};

/// Returns the sum of W over those rays at azimuth j that a texel stops.
#[allow(non_snake_case)]
fn occlusion(scene: &MethodScene, pixel: &Pixel, j: u32, shift: Shift, observer: &mut dyn Observer) -> f64 {
    let n = pixel.n.normalize_or_zero();
    // A frame about the normal: b1 and b2 span the tangent plane. b1 is perpendicular to the x axis, or to the y axis
    // if n is close to the x axis.
    let b1 = n.cross(if n.x.abs() < 0.8 { DVec3::X } else { DVec3::Y }).normalize_or_zero();
    let b2 = n.cross(b1);
    let a = scene.turned(pixel, j);
    let azimuth = a.x * b1 + a.y * b2;
    let [_, _, b] = pixel.jitter;
    let perspective = scene.projection.is_perspective();

    let rays = scene.settings.rays;
    let mut occlusion = 0.0;
    for k in 0..rays {
        // Rays are uniform over the hemisphere if the cosine of their angle to the normal is uniform.
        let cosine = (f64::from(k) + 0.5) / f64::from(rays);
        let ray = cosine * n + (1.0 - cosine * cosine).sqrt() * azimuth;
        // The ray ends at the point E, at the distance R from P or at the near plane, whichever comes first.
        let to_near = if ray.z < 0.0 { (pixel.P.z - scene.near).max(0.0) / -ray.z } else { f64::INFINITY };
        let E = pixel.P + pixel.R.min(to_near) * ray;
        observer.ray(k, ray, E);
        let slope = |point: DVec3| point.truncate() / if perspective { point.z } else { 1.0 };
        let across: DVec2 = (slope(E) - slope(pixel.P)) / scene.pixel_extent();
        for i in 1..=pixel.steps {
            let along = (b + f64::from(i)) / f64::from(pixel.steps + 1);
            let at = along * across;
            let taken = scene.clamped(pixel.p + shift.round(at)) - pixel.p;
            let sample = scene.at(pixel, taken, taken);
            // The depth of the ray at this step. Along the way from P to E in the image 1/z changes linearly, or z when
            // orthographic.
            let ray_z = if perspective {
                1.0 / ((1.0 - along) / pixel.P.z + along / E.z)
            } else {
                (1.0 - along) * pixel.P.z + along * E.z
            };
            // The first texel in front of the ray stops it. Texels beyond R are ignored, and so is P's own texel.
            let stops =
                |sample: &Sample| sample.z < ray_z * (1.0 + shift.comparison) && scene.within(pixel, sample, shift);
            let stopped = sample.as_ref().filter(|sample| stops(sample));
            let step = Step { at, taken, ray_z, sample: sample.as_ref(), stops: stopped.is_some() };
            observer.step(i, &step);
            if let Some(sample) = stopped {
                let weight = scene.attenuation(pixel, sample.D.length());
                observer.adds(k, weight);
                occlusion += weight;
                break;
            }
        }
    }
    occlusion
}
