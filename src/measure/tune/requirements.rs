//! Finds the properties of a view that decide which settings make sense on it, before the search.

use crate::image::Image;
use crate::measure::gbuffers::GBuffers;
use crate::measure::{Reach, Shot};
use crate::projection::Projection;
use crate::settings::{Exit, Method, MethodBlur, Settings};
use crate::{Error, Pipeline, Request};
use std::sync::Arc;

/// The share of its depth by which rounding to 16 bits may move a surface.
const DEPTH_ROUNDING: f64 = 1e-3;

/// The properties of a view that decide which settings make sense on it.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// The pixels that hold a surface. Errors are computed over these.
    pub covered: Image<bool>,
    /// The number of depth samples per pixel that the driver gave.
    pub samples: u32,
    /// The number of edge pixels with the depth sigma of most methods, with that of `hbao-view`, and with that of
    /// `ssao`.
    pub edge_pixels: [usize; 3],
    /// R in texels, first at the farthest covered pixel, then at the nearest.
    pub radius_px: (f64, f64),
    depth: Image<f32>,
    projection: Projection,
    farthest: f64,
}

impl Requirements {
    /// Renders the G-buffer and the edges of the view, and finds the requirements from them.
    pub(super) fn of<'a>(
        gl: &Arc<glow::Context>,
        gbuffers: &mut GBuffers<'a>,
        shot: Shot<'a>,
        base: &Settings,
    ) -> Result<Requirements, Error> {
        let pipeline = gbuffers.of(shot, base)?;
        let depth = pipeline.depth()?;
        let covered = depth.map(|z| z.is_finite());
        let depths = depth.texels.iter().filter(|z| z.is_finite());
        let (nearest, farthest) = depths.fold((f32::INFINITY, 0.0f32), |(a, b), &z| (a.min(z), b.max(z)));
        let projection = shot.camera.projection;
        let in_texels = Settings { half_res: false, ..base.clone() }.radius_px(projection, shot.size)?;
        let radius_px = (in_texels.least(farthest.into()), in_texels.least(nearest.into()));
        let samples = pipeline.samples();
        let mut edge_pixels = [0; 3];
        if samples > 1 {
            let method = if edge_kind(base.method) == 0 { base.method } else { Method::Hbao };
            // Of all sample counts of `ssao`, 8 samples have the least depth sigma, and so the most edges.
            for (pixels, method) in edge_pixels.iter_mut().zip([method, Method::HbaoView, Method::Ssao]) {
                let Settings { snap, spacing, .. } = Settings::for_method(method);
                let settings = Settings { method, snap, spacing, ssao_samples: 8, ..base.clone() };
                let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
                let mut pipeline = Pipeline::new(gl, shot.size, &settings, request)?;
                pipeline.render(shot.mesh, shot.camera)?;
                *pixels = pipeline.edges().map_or(0, |edges| edges.texels.iter().filter(|&&edge| edge).count());
            }
        }
        let farthest = f64::from(farthest);
        Ok(Requirements { covered, samples, edge_pixels, radius_px, depth, projection, farthest })
    }

    /// Returns the number of edge pixels for the blur of the method.
    pub fn edges_of(&self, method: Method) -> usize {
        self.edge_pixels[edge_kind(method)]
    }

    /// Returns how R fits the steps of these settings and the picture.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent.
    pub fn reach(&self, settings: &Settings) -> Result<Reach, Error> {
        Reach::of(&self.depth, self.projection, settings)
    }

    /// Returns whether the method may exit early at some pixel, such that fewer steps would prevent it.
    pub(super) fn steps_may_exit(&self, settings: &Settings) -> bool {
        let size = (self.depth.width as u32, self.depth.height as u32);
        let exit = settings.exit_depth(self.projection, size).unwrap_or(f64::INFINITY);
        settings.exit == Exit::Paper && self.farthest * (1.0 + DEPTH_ROUNDING) > exit
    }
}

/// Returns the index of a method's number in [`Requirements::edge_pixels`]. The depth sigma of the method's blur
/// decides which pixels are edges.
pub(super) fn edge_kind(method: Method) -> usize {
    let facts = method.facts();
    match facts.blur {
        MethodBlur::Crysis => 2,
        _ => usize::from(facts.depth_sigma != Method::Hbao.facts().depth_sigma),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Radius;

    #[test]
    fn methods_have_the_same_edges_if_their_blurs_have_the_same_depth_sigma() {
        let settings = |method| Settings { radius: Radius::Units(1.0), ..Settings::for_method(method) };
        let view = Projection::perspective(1.0, 1.0);
        let kinds = [Method::Hbao, Method::HbaoView, Method::Ssao];
        for (i, of_kind) in kinds.into_iter().enumerate() {
            assert_eq!(edge_kind(of_kind), i);
            for &method in Method::ALL {
                let same = settings(method).depth_sigma(view).unwrap() == settings(of_kind).depth_sigma(view).unwrap();
                assert_eq!(edge_kind(method) == i, same, "{} {}", method.name(), of_kind.name());
            }
        }
    }
}
