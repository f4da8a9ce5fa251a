//! What the twins do at a single pixel, laid open: for the figures that draw it, and the claims that are about it.

use super::inputs::Inputs;
use super::sampling::{EXACT, Pixel, Scene};
use super::ssao;
use super::terms::Terms;
use crate::Error;
use crate::projection::Projection;
use crate::settings::Settings;
use glam::{DVec2, DVec3};

/// The twin of one method on one view. Pixels are (x, y), y up; what is asked of background is none.
pub struct Anatomy<'a> {
    scene: Scene<'a>,
}

impl<'a> Anatomy<'a> {
    /// # Errors
    /// A radius in percent, or images of different sizes.
    pub fn new(inputs: &'a Inputs<'a>, settings: &'a Settings) -> Result<Anatomy<'a>, Error> {
        Ok(Anatomy { scene: Scene::new(inputs, settings)? })
    }

    /// The point that the pixel shows, in eye space.
    pub fn position(&self, pixel: (usize, usize)) -> Option<DVec3> {
        Some(self.pixel(pixel)?.P)
    }

    /// The texels that the samples in direction k read, less the pixel's own; those in the window alone.
    pub fn offsets(&self, pixel: (usize, usize), k: u32) -> Option<Vec<DVec2>> {
        let pixel = self.pixel(pixel)?;
        let direction = self.scene.direction(&pixel, k, EXACT);
        let samples = (1..=self.scene.settings.steps).filter_map(|i| self.scene.sample(&pixel, &direction, i, EXACT));
        Some(samples.map(|sample| sample.taken).collect())
    }

    /// The tangent of Eq. 6.2.11 for an offset in texels, in eye space; its length means nothing.
    pub fn tangent(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        Some(self.scene.tangent(&self.pixel(pixel)?, offset))
    }

    /// The same tangent as Figure 6.2.12 has it: from P to where the ray through the offset's texel meets the tangent
    /// plane. None also where it does not meet it in front of the eye.
    #[allow(non_snake_case)]
    pub fn tangent_by_ray(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        let pixel = self.pixel(pixel)?;
        let (origin, ray) = match self.scene.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, self.scene.ray(pixel.p + offset)),
            Projection::Orthographic { .. } => (self.scene.position(pixel.p + offset, 0.0), DVec3::Z),
        };
        let z = pixel.n.dot(pixel.P - origin) / pixel.n.dot(ray);
        (z > 0.0 && z.is_finite()).then(|| origin + z * ray - pixel.P)
    }

    /// The points that `ssao` samples about the pixel's: each in eye space, and whether it is counted as open, which is
    /// in front of the surface that its texel shows. Those whose texel is background, or whose surface the range check
    /// fades by more than a hundredth, are left out.
    pub fn points(&self, pixel: (usize, usize)) -> Option<Vec<(DVec3, bool)>> {
        let (scene, pixel) = (&self.scene, self.pixel(pixel)?);
        let of = |index| {
            let (_, offset) = ssao::kernel(scene, &pixel, index);
            let texels = offset.truncate() * scene.extent();
            let z = pixel.P.z * (1.0 + 2.0 * offset.z);
            let q = scene.clamped(pixel.p + EXACT.round(texels));
            let surface = scene.depth(q.x as usize, q.y as usize);
            let judged = surface.is_finite() && (pixel.P.z - surface) / surface <= 0.01;
            judged.then(|| (scene.position(pixel.p + texels, z), surface > z))
        };
        Some((0..scene.settings.ssao_samples).filter_map(of).collect())
    }

    /// A before any blur, as [`super::visibility`] has it, but with samples beyond R counted too: what 6.2 avoids by
    /// ignoring them. W must be 1, since no other is meant for distances beyond R.
    pub fn with_outliers(mut self, pixels: &[(usize, usize)]) -> Vec<Option<f64>> {
        self.scene.reach = f64::INFINITY;
        let method = Terms::of(self.scene.settings);
        let of = |&at: &(usize, usize)| {
            let (method, pixel) = (method.as_ref()?, self.pixel(at)?);
            if method.exits_early(&pixel, EXACT) {
                return Some(1.0);
            }
            let term = |k| (method.occlusion)(&self.scene, &pixel, k, EXACT);
            Some(method.visibility((0..method.count).map(term).sum()))
        };
        pixels.iter().map(of).collect()
    }

    fn pixel(&self, (x, y): (usize, usize)) -> Option<Pixel> {
        self.scene.pixel(x, y)
    }
}
