//! Ray-traced ambient occlusion, Eq. 6.2.3 of ShaderX7, on the triangles themselves. The errors of the methods are
//! measured relative to it.
//!
//! A = 1 - 1/(2 pi) times the integral of V W over the hemisphere around the normal. It is estimated by rays in
//! uniformly distributed directions. A ray that meets a triangle within R, from either side, occludes by W of the
//! distance; all others occlude by 0.
//!
//! [`Weight::Cosine`] gives the other form of ambient occlusion that the chapter starts from, Eq. 6.2.1, with the same
//! W: A_1 = 1 - 1/pi times the integral of V W (w.n), where w is the direction of the ray.

use super::attenuation::weight;
use super::trace::{Hit, Tracer};
use crate::Error;
use crate::scene::{Camera, Mesh};
use crate::settings::{Attenuation, Length, Settings};
use crate::threads::on_all_cores;
use glam::DVec3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The seed of the random numbers. Together with its index it gives each pixel a sequence of its own.
const SEED: u128 = 0x7472_7574_6820_2008;

/// The distance from its start at which a ray begins to look for occluders, as a share of the sum of the scene's
/// diagonal and the largest coordinate of the scene or the eye. A ray that leaves a plane meets it again only because
/// of rounding, within some 1e-16 of that sum. An occluder nearer than this distance is missed.
const CLEARANCE: f64 = 1e-11;

/// How much each direction of the hemisphere counts. The rays have this distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Weight {
    /// All directions count the same: Eq. 6.2.3, and with W = 1 Eq. 6.2.2. The chapter's method computes this form.
    #[default]
    Uniform,
    /// A direction counts by the cosine of its angle to the normal: with W = 1, Eq. 6.2.1.
    Cosine,
}

impl Weight {
    /// Returns the cosine of a ray's angle to the normal, from a number that is uniform in [0, 1].
    fn cosine(self, uniform: f64) -> f64 {
        match self {
            // The area of a zone of the sphere is proportional to its height.
            Weight::Uniform => uniform,
            // Seen along the normal, rays are uniform over the disc. So the square of the sine is uniform.
            Weight::Cosine => uniform.sqrt(),
        }
    }
}

/// A scene seen by a camera, prepared for tracing with the radius and attenuation of the settings.
pub struct Truth<'a> {
    tracer: Arc<Tracer<'a>>,
    camera: &'a Camera,
    size: (usize, usize),
    radius: Length,
    attenuation: Attenuation,
    weight: Weight,
    rays: u32,
    clearance: f64,
}

/// The visibility of some pixels, and its noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// A in [0, 1], in the order in which the pixels were given. Background is 1.
    pub visibility: Vec<f64>,
    /// For each pixel in the same order, whether it shows a surface.
    pub covered: Vec<bool>,
    /// The noise of A: the square root of the mean variance over the covered pixels. It is estimated from two
    /// independent halves of the rays of each pixel.
    pub noise_rmse: f64,
}

impl<'a> Truth<'a> {
    /// Prepares to trace `rays` rays from the surface point of each pixel, for images of `size` (width, height). The
    /// number must be even and at least 2, because the noise is estimated from two halves. Of the settings only the
    /// radius and the attenuation are read.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent, or if the number of rays is odd or 0.
    pub fn new(
        mesh: &'a Mesh,
        camera: &'a Camera,
        size: (usize, usize),
        settings: &Settings,
        rays: u32,
    ) -> Result<Truth<'a>, Error> {
        Truth::by(&Arc::new(Tracer::new(mesh)), camera, size, settings, rays)
    }

    /// Does the same as [`Truth::new`] with a mesh that is prepared already, so that several views can share it.
    ///
    /// # Errors
    /// The same as for [`Truth::new`].
    pub fn by(
        tracer: &Arc<Tracer<'a>>,
        camera: &'a Camera,
        size: (usize, usize),
        settings: &Settings,
        rays: u32,
    ) -> Result<Truth<'a>, Error> {
        if rays == 0 || !rays.is_multiple_of(2) {
            return Err(Error::Usage(format!(
                "{rays} rays: give an even number of at least 2, because the noise is estimated from two halves"
            )));
        }
        let mesh = tracer.mesh();
        let (low, high) = mesh.bounds();
        let farthest = low.abs().max(high.abs()).max(camera.eye.abs()).max_element();
        Ok(Truth {
            tracer: tracer.clone(),
            camera,
            size,
            radius: settings.radius_in(camera.projection)?,
            attenuation: settings.attenuation,
            weight: Weight::default(),
            rays,
            clearance: CLEARANCE * (mesh.diagonal() + farthest),
        })
    }

    /// Changes how much each direction counts. It is [`Weight::Uniform`] at first.
    #[must_use]
    pub fn weighted(self, weight: Weight) -> Truth<'a> {
        Truth { weight, ..self }
    }

    /// Traces the pixels of these indices (y * width + x, y up) on all cores. `progress` is called from any thread,
    /// with the number of pixels finished since its last call. The result does not depend on the order of the pixels or
    /// on the threads.
    #[must_use]
    pub fn trace(&self, pixels: &[usize], progress: impl Fn(usize) + Sync) -> Traced {
        let halves = self.halves(pixels, 0, progress);
        // The variance of one half is twice that of the mean of both halves, and the variance of the difference of the
        // halves is four times that of the mean. The sum is folded from 0 because an empty `sum()` is -0.
        let squares = halves.iter().flatten().map(|[a, b]| (a - b).powi(2) / 4.0).fold(0.0, |sum, square| sum + square);
        let covered: Vec<bool> = halves.iter().map(Option::is_some).collect();
        let count = covered.iter().filter(|&&covered| covered).count();
        Traced {
            visibility: halves.iter().map(|half| half.map_or(1.0, |[a, b]| (a + b) / 2.0)).collect(),
            covered,
            noise_rmse: (squares / count.max(1) as f64).sqrt(),
        }
    }

    /// Traces the same pixels as [`Truth::trace`], and returns for each the two independent estimates of A whose mean
    /// that function returns; `None` on background. Every `pass` has rays of its own, so that the mean of several
    /// passes is more exact than one. [`Truth::trace`] is pass 0. The work is done on all cores, or by the pool on one
    /// of whose threads this is called.
    pub fn halves(&self, pixels: &[usize], pass: u32, progress: impl Fn(usize) + Sync) -> Vec<Option<[f64; 2]>> {
        const CHUNK: usize = 256;
        let of_chunk = |chunk: &[usize]| {
            let traced: Vec<Option<[f64; 2]>> = chunk.iter().map(|&pixel| self.pixel(pixel, pass)).collect();
            progress(chunk.len());
            traced
        };
        on_all_cores(|| pixels.par_chunks(CHUNK).flat_map_iter(of_chunk).collect())
    }

    /// Returns two independent estimates of A; `None` on background.
    fn pixel(&self, pixel: usize, pass: u32) -> Option<[f64; 2]> {
        let (x, y) = (pixel % self.size.0, pixel / self.size.0);
        let (u, v) = ((x as f64 + 0.5) / self.size.0 as f64, (y as f64 + 0.5) / self.size.1 as f64);
        let camera = self.camera;
        let (start, r) = camera.ray(u, v);
        let (origin, direction) = (camera.eye + camera.direction_to_world(start), camera.direction_to_world(r));
        let seen = self.tracer.nearest(origin, direction, camera.near..=camera.far)?;
        let point = origin + seen.t * direction;
        let normal = self.tracer.normal(seen.triangle);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let radius = self.radius_at(point);
        let (b1, b2) = normal.any_orthonormal_pair();

        let mut random = Pcg64Mcg::new(SEED ^ (pixel as u128) << 1 ^ u128::from(pass) << 48);
        // Neighbouring seeds give similar first numbers, so these are skipped.
        (0..4).for_each(|_| _ = random.next_u64());
        let mut uniform = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        Some([(); 2].map(|()| {
            let mut occlusion = 0.0;
            for [height, turn] in stratified(self.rays / 2, &mut uniform) {
                let up = self.weight.cosine(height);
                let (across, angle) = ((1.0 - up * up).sqrt(), TAU * turn);
                let ray = up * normal + across * (angle.cos() * b1 + angle.sin() * b2);
                if let Some(hit) = self.occluder(point, ray, seen.triangle) {
                    occlusion += weight(self.attenuation, hit.t, radius);
                }
            }
            1.0 - occlusion / f64::from(self.rays / 2)
        }))
    }

    /// Returns R at a point of the scene.
    fn radius_at(&self, point: DVec3) -> f64 {
        self.radius.at((point - self.camera.eye).dot(self.camera.forward))
    }

    /// Finds the nearest triangle within R on a ray from a point on the triangle `own`, which is ignored. `ray` must
    /// have unit length.
    #[must_use]
    pub fn occluder(&self, point: DVec3, ray: DVec3, own: usize) -> Option<Hit> {
        self.tracer.nearest_but(point, ray, self.clearance..=self.radius_at(point), own)
    }
}

/// Divides the unit square into `count` cells of equal area, and returns one random point in each. The cells form rows.
/// There are about as many rows as cells in a row, and the height of a row is its share of the cells.
fn stratified(count: u32, uniform: &mut impl FnMut() -> f64) -> Vec<[f64; 2]> {
    let rows = f64::from(count).sqrt().round().max(1.0) as u32;
    let mut points = Vec::with_capacity(count as usize);
    for row in 0..rows {
        let [first, end] = [row, row + 1].map(|row| u64::from(count) * u64::from(row) / u64::from(rows));
        let cells = end - first;
        for cell in 0..cells {
            let high = (first as f64 + uniform() * cells as f64) / f64::from(count);
            points.push([high, (cell as f64 + uniform()) / cells as f64]);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_independent_so_that_their_mean_gets_more_exact() {
        let scene = crate::scene::Scene::open("cornell-box").unwrap();
        let (camera, _) = scene.view.camera(&scene.mesh, 24, 18).unwrap();
        let settings = Settings::default();
        let tracer = Arc::new(Tracer::new(&scene.mesh));
        let of = |rays| Truth::by(&tracer, &camera, (24, 18), &settings, rays).unwrap();
        let pixels: Vec<usize> = (0..24 * 18).collect();
        let truth = of(16);
        let passes: Vec<Vec<Option<[f64; 2]>>> = (0..16).map(|pass| truth.halves(&pixels, pass, |_| ())).collect();
        let mean = |of: &[Vec<Option<[f64; 2]>>]| -> Vec<f64> {
            let at = |i: usize| of.iter().map(|pass| pass[i].map_or(1.0, |[a, b]| (a + b) / 2.0)).sum::<f64>();
            pixels.iter().map(|&i| at(i) / of.len() as f64).collect()
        };
        assert_eq!(mean(&passes[..1]), truth.trace(&pixels, |_| ()).visibility);
        let exact = of(8192).trace(&pixels, |_| ()).visibility;
        let error =
            |of: &[f64]| (of.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / exact.len() as f64).sqrt();
        let [one, all] = [error(&mean(&passes[..1])), error(&mean(&passes))];
        assert!(one / all > 3.0 && one / all < 5.5, "{one} {all}");
    }

    #[test]
    fn every_cell_holds_one_point_whatever_the_count() {
        let mut random = Pcg64Mcg::new(3);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        for count in [1, 2, 3, 7, 16, 17, 100, 1023] {
            let points = stratified(count, &mut uniform);
            assert_eq!(points.len(), count as usize);
            assert!(points.iter().flatten().all(|c| (0.0..1.0).contains(c)));
            // In rows of equal cells the mean height is close to 1/2, much closer than for points at random.
            let mean = points.iter().map(|point| point[0]).sum::<f64>() / f64::from(count);
            assert!((mean - 0.5).abs() < 1.0 / f64::from(count).sqrt(), "{count}: {mean}");
        }
        let mut heights: Vec<f64> = stratified(100, &mut uniform).iter().map(|point| point[0]).collect();
        heights.sort_by(f64::total_cmp);
        assert!(heights.iter().enumerate().all(|(i, h)| (h * 10.0).floor() as usize == i / 10));
    }
}
