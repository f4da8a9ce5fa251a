//! Finds the properties of a view that decide which settings make sense on it, before the search.

use crate::image::Image;
use crate::measure::Shot;
use crate::measure::gbuffers::GBuffers;
use crate::settings::{Method, MethodBlur, Settings};
use crate::{Error, Pipeline, Request};
use std::sync::Arc;

/// The length of a step in texels below which a method certainly exits early. It is 1 minus the most that rounding to
/// 16-bit depth may add.
const SURELY_BELOW: f64 = 0.999;

/// The properties of a view that decide which settings make sense on it.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// The pixels that hold a surface. Errors are computed over these.
    pub covered: Image<bool>,
    /// The number of depth samples per pixel that the driver gave.
    pub samples: u32,
    /// The number of edge pixels: first with the depth sigma that all methods but `ssao` share, then with that of
    /// `ssao`.
    pub edge_pixels: [usize; 2],
    /// R in texels, first at the farthest covered pixel, then at the nearest.
    pub radius_px: (f64, f64),
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
        let in_texels = |z: f32| {
            let [_, half_height] = shot.camera.projection.half_extents_at(f64::from(z));
            base.radius_units().map(|radius| radius * f64::from(shot.size.1) / (2.0 * half_height))
        };
        let radius_px = (in_texels(farthest)?, in_texels(nearest)?);
        let samples = pipeline.samples();
        let mut edge_pixels = [0; 2];
        if samples > 1 {
            let method = if edge_kind(base.method) == 0 { base.method } else { Method::Hbao };
            // Of all sample counts of `ssao`, 8 samples have the least depth sigma, and so the most edges.
            for (pixels, method) in edge_pixels.iter_mut().zip([method, Method::Ssao]) {
                let settings = Settings { method, ssao_samples: 8, ..base.clone() };
                let request = Request { gbuffer_only: true, edges: true, ..Request::default() };
                let mut pipeline = Pipeline::new(gl, shot.size, &settings, request)?;
                pipeline.render(shot.mesh, shot.camera)?;
                *pixels = pipeline.edges().map_or(0, |edges| edges.texels.iter().filter(|&&edge| edge).count());
            }
        }
        Ok(Requirements { covered, samples, edge_pixels, radius_px })
    }

    /// Returns the number of edge pixels for the blur of the method.
    pub fn edges_of(&self, method: Method) -> usize {
        self.edge_pixels[edge_kind(method)]
    }

    /// Returns whether the method certainly exits early at every pixel, because a step is shorter than a texel
    /// everywhere.
    pub(super) fn all_exit(&self, settings: &Settings) -> bool {
        settings.method.facts().exits_early && step(self.radius_px.1, settings) < SURELY_BELOW
    }

    /// Returns whether the method may exit early at some pixel, because a step may be shorter than a texel there.
    pub(super) fn some_may_exit(&self, settings: &Settings) -> bool {
        settings.method.facts().exits_early && step(self.radius_px.0, settings) < 1.0 / SURELY_BELOW
    }
}

/// Returns the index of a method's number in [`Requirements::edge_pixels`]. The blur of the method decides which pixels
/// are edges.
pub(super) fn edge_kind(method: Method) -> usize {
    usize::from(method.facts().blur == MethodBlur::Crysis)
}

/// Returns the length of a step in texels of ambient occlusion, if R covers `radius_px` pixels of the image.
fn step(radius_px: f64, settings: &Settings) -> f64 {
    radius_px / f64::from(settings.steps + 1) / f64::from(settings.ao_scale())
}
