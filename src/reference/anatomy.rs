//! The intermediate results of the twins at single pixels, for the figures and claims about them.

use super::inputs::TwinInputs;
use super::sampling::{EXACT, MethodScene, Pixel};
use super::ssao;
use super::terms::Terms;
use crate::Error;
use crate::projection::Projection;
use crate::settings::Settings;
use crate::threads::on_all_cores;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// The twin of one method on one view. Pixels are given as (x, y), with y up. On background all results are `None`.
pub struct Anatomy<'a> {
    scene: MethodScene<'a>,
}

impl<'a> Anatomy<'a> {
    /// Prepares the twin of the method that `settings` name.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent, or if the images have different sizes.
    pub fn new(inputs: &'a TwinInputs<'a>, settings: &'a Settings) -> Result<Anatomy<'a>, Error> {
        Ok(Anatomy { scene: MethodScene::new(inputs, settings)? })
    }

    /// Returns the surface point P that the pixel shows, in eye space.
    #[must_use]
    pub fn position(&self, pixel: (usize, usize)) -> Option<DVec3> {
        Some(self.pixel(pixel)?.P)
    }

    /// Returns the texels that the samples in direction k read, as offsets from the pixel's own texel. Samples that are
    /// ignored, on background or on the pixel's own texel, are left out. A sample beyond the border reads a texel at
    /// the border.
    #[must_use]
    pub fn offsets(&self, pixel: (usize, usize), k: u32) -> Option<Vec<DVec2>> {
        let pixel = self.pixel(pixel)?;
        let direction = self.scene.direction(&pixel, k, EXACT);
        let samples = (1..=pixel.steps).filter_map(|i| self.scene.sample(&pixel, &direction, i, EXACT));
        Some(samples.map(|sample| sample.taken).collect())
    }

    /// Returns the tangent T of Eq. 6.2.11 in eye space, for an offset in texels. Its length has no meaning.
    #[must_use]
    pub fn tangent(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        Some(self.scene.tangent(&self.pixel(pixel)?, offset))
    }

    /// Returns the same tangent as Figure 6.2.12 constructs it: from P to the point where the ray through the offset's
    /// texel meets the tangent plane. It is `None` also if the ray does not meet the plane in front of the eye.
    #[allow(non_snake_case)]
    #[must_use]
    pub fn tangent_by_ray(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        let pixel = self.pixel(pixel)?;
        let (origin, ray) = match self.scene.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, self.scene.ray(pixel.p + offset)),
            Projection::Orthographic { .. } => (self.scene.position(pixel.p + offset, 0.0), DVec3::Z),
        };
        let z = pixel.n.dot(pixel.P - origin) / pixel.n.dot(ray);
        (z > 0.0 && z.is_finite()).then(|| origin + z * ray - pixel.P)
    }

    /// Returns the points that `ssao` samples around the surface point of the pixel. Each is given in eye space, with
    /// `true` if it lies in free space, in front of the surface seen at its texel. Points are left out if their texel
    /// is background, or if the range check fades their surface by more than a hundredth. The offsets are those of
    /// `ssao-normals` off, and the depths those of `ssao-depth` full.
    #[must_use]
    pub fn points(&self, pixel: (usize, usize)) -> Option<Vec<(DVec3, bool)>> {
        let (scene, pixel) = (&self.scene, self.pixel(pixel)?);
        let of = |index| {
            let (_, offset) = ssao::kernel(scene, &pixel, index);
            let texels = offset.truncate() * scene.extent;
            let z = pixel.P.z * (1.0 + 2.0 * offset.z);
            let q = scene.clamped(pixel.p + EXACT.round(texels));
            let surface = scene.depth(q.x as usize, q.y as usize);
            let judged = surface.is_finite() && (pixel.P.z - surface) / surface <= 0.01;
            judged.then(|| (scene.position(pixel.p + texels, z), surface > z))
        };
        Some((0..scene.settings.ssao_samples).filter_map(of).collect())
    }

    /// Computes A before any blur, like [`super::visibility`]. Background is `None`; so is every pixel for the method
    /// `none`.
    #[must_use]
    pub fn visibility(&self, pixels: &[(usize, usize)]) -> Vec<Option<f64>> {
        let method = Terms::of(self.scene.settings);
        let of = |&at: &(usize, usize)| {
            let (method, pixel) = (method.as_ref()?, self.pixel(at)?);
            if pixel.exits_early(EXACT) {
                return Some(1.0);
            }
            let term = |k| (method.occlusion)(&self.scene, &pixel, k, EXACT);
            Some(method.visibility((0..method.count).map(term).sum()))
        };
        on_all_cores(|| pixels.par_iter().map(of).collect())
    }

    /// Changes the twin so that it also counts samples beyond R, which 6.2 ignores. The attenuation must be W = 1,
    /// because the others are not meant for distances beyond R.
    #[must_use]
    pub fn with_outliers(mut self) -> Anatomy<'a> {
        self.scene.reach = f64::INFINITY;
        self
    }

    /// Changes the twin of `ssao` so that it has no depth range check (6.1): a surface occludes however far it is in
    /// front of P. Other methods do not change.
    #[must_use]
    pub fn without_range_check(mut self) -> Anatomy<'a> {
        self.scene.range_check = false;
        self
    }

    /// Changes the twin of `ssao` so that its offsets have the same length in texels as in a picture of another size, in
    /// texels of the result: `ssao` measures them in widths and heights of the picture. Other methods do not change.
    #[must_use]
    pub fn with_offsets_of(mut self, (width, height): (usize, usize)) -> Anatomy<'a> {
        self.scene.extent = DVec2::new(width as f64, height as f64);
        self
    }

    fn pixel(&self, (x, y): (usize, usize)) -> Option<Pixel> {
        self.scene.pixel(x, y)
    }
}
