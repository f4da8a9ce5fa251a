//! Renders a view, and compares it pass by pass with the float64 twins.

use super::as_drawn::as_drawn;
use super::spread::Spread;
use crate::image::Image;
use crate::reference::{self, gbuffer::Surface};
use crate::scene::{Camera, Mesh};
use crate::settings::Settings;
use crate::{Error, Pipeline, Request, rotation_tile};
use glam::{DVec3, Vec3};

/// How far one view's images are from float64, pass by pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Precision {
    /// The number of pixels that hold a surface.
    pub covered: usize,
    /// The number of covered pixels at which the rasteriser drew another surface than the one that the ray through the
    /// pixel's centre meets. This happens because it rounds vertices to a grid of 1/256 pixel. These pixels are
    /// compared with the surface that was drawn. If this is a sliver that faces away, which no ray meets, they are
    /// compared with the drawn depth and normal.
    pub beside: usize,
    /// The error of depth, relative to the depth that the ray finds.
    pub depth: Spread,
    /// The error of normals, in degrees.
    pub normals: Spread,
    /// The difference between ambient occlusion before the blur and its twin on the same depth and normals, which is
    /// the error of float32 arithmetic alone. Ambiguous pixels ([`reference::ambiguous`]), at which float32 may round
    /// or compare otherwise than float64, are left out.
    pub arithmetic: Spread,
    /// How many ambiguous pixels are left out of [`Precision::arithmetic`].
    pub ambiguous: usize,
    /// The difference between ambient occlusion before the blur and its twin on float64 depth and normals, which is the
    /// error of formats, G-buffer and arithmetic together. Pixels that are ambiguous for these inputs are left out.
    pub whole: Spread,
    /// How many ambiguous pixels are left out of [`Precision::whole`].
    pub whole_ambiguous: usize,
    /// The difference between the shown image, after the blur, and the same image computed in float64 throughout.
    /// Ambiguous pixels are included.
    pub shown: Spread,
}

/// The images of a view that are compared.
#[derive(Clone, Debug)]
pub struct Images {
    /// The rendered depth, which is infinite on background.
    pub depth: Image<f32>,
    /// The rendered normals.
    pub normals: Image<[f32; 3]>,
    /// The rendered ambient occlusion before the blur.
    pub raw: Image<f32>,
    /// The rendered ambient occlusion after the blur.
    pub shown: Image<f32>,
    /// The depth and normals that ray casting in float64 finds.
    pub seen: Image<Surface>,
    /// Ambient occlusion before the blur, computed in float64 from [`Images::seen`].
    pub exact: Image<f64>,
}

/// Returns the angle between two directions, in degrees.
fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Renders views with one combination of settings, and compares them pass by pass with the twins. The settings must
/// have one depth sample per pixel, full resolution and a radius in scene units.
pub struct Comparer {
    pipeline: Pipeline,
    settings: Settings,
}

impl Comparer {
    /// Compiles and allocates for images of `size`.
    ///
    /// # Errors
    /// The same as for [`Pipeline::new`], and [`Error::Usage`] for several depth samples per pixel or half resolution.
    pub fn new(gl: &std::sync::Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<Comparer, Error> {
        if settings.msaa != 1 || settings.ao_scale() != 1 {
            return Err(Error::Usage(
                "precision is measured with one depth sample per pixel, at full resolution".into(),
            ));
        }
        let request = Request { raw: true, ..Request::default() };
        Ok(Comparer { pipeline: Pipeline::new(gl, size, settings, request)?, settings: settings.clone() })
    }

    /// Renders a view, and compares each pass with its twin.
    ///
    /// # Errors
    /// The same as for [`Pipeline::render`].
    pub fn measure(&mut self, mesh: &Mesh, camera: &Camera) -> Result<(Precision, Images), Error> {
        let settings = &self.settings;
        self.pipeline.render(mesh, camera)?;
        let (depth, normals) = (self.pipeline.depth()?, self.pipeline.normals()?);
        let shown = self.pipeline.ao()?;
        let raw = self.pipeline.ao_raw().cloned().unwrap_or_else(|| shown.clone());
        let (seen, beside) = as_drawn(mesh, camera, settings.normals, &depth, &normals);

        let (tile, projection, near) = (rotation_tile(settings), camera.projection, camera.near);
        let own = reference::TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
        let on_own = (reference::visibility(&own, settings)?, reference::ambiguous(&own, settings)?);
        let (z, n) = (seen.map(|s| s.depth), seen.map(|s| s.normal.to_array()));
        let unrounded = reference::TwinInputs { depth: &z, normals: &n, tile: &tile, projection, near };
        let on_exact = (reference::visibility(&unrounded, settings)?, reference::ambiguous(&unrounded, settings)?);
        let exact_shown = reference::blur::blur(&on_exact.0, &z, &[], projection, settings)?;

        let covered: Vec<usize> = (0..depth.texels.len()).filter(|&i| depth.texels[i].is_finite()).collect();
        let both: Vec<usize> = covered.iter().copied().filter(|&i| z.texels[i].is_finite()).collect();
        let between = |got: &Image<f32>, expected: &Image<f64>, but: Option<&Image<bool>>| {
            let kept = covered.iter().filter(|&&i| but.is_none_or(|but| !but.texels[i]));
            Spread::of(kept.map(|&i| f64::from(got.texels[i]) - expected.texels[i]))
        };
        let count = |ambiguous: &Image<bool>| covered.iter().filter(|&&i| ambiguous.texels[i]).count();
        let precision = Precision {
            covered: covered.len(),
            beside,
            depth: Spread::of(both.iter().map(|&i| f64::from(depth.texels[i]) / z.texels[i] - 1.0)),
            normals: Spread::of(
                both.iter().map(|&i| degrees(Vec3::from(normals.texels[i]).as_dvec3(), seen.texels[i].normal)),
            ),
            arithmetic: between(&raw, &on_own.0, Some(&on_own.1)),
            ambiguous: count(&on_own.1),
            whole: between(&raw, &on_exact.0, Some(&on_exact.1)),
            whole_ambiguous: count(&on_exact.1),
            shown: between(&shown, &exact_shown, None),
        };
        Ok((precision, Images { depth, normals, raw, shown, seen, exact: on_exact.0 }))
    }
}

/// Computes ambient occlusion before the blur by the twin, from the drawn depth and from normals that are rounded as
/// biased RGBA8 would round them. No setting asks for this format; it is used on drivers that render neither of the
/// signed formats.
///
/// # Errors
/// [`Error::Usage`] if the radius is in percent.
pub fn biased(images: &Images, camera: &Camera, settings: &Settings) -> Result<Image<f32>, Error> {
    let stored = |c: f32| 2.0 * ((0.5 * c + 0.5) * 255.0).round() / 255.0 - 1.0;
    let normals = images.normals.map(|n| n.map(stored));
    let (tile, projection, near) = (rotation_tile(settings), camera.projection, camera.near);
    let inputs = reference::TwinInputs { depth: &images.depth, normals: &normals, tile: &tile, projection, near };
    Ok(reference::visibility(&inputs, settings)?.map(|a| a as f32))
}
