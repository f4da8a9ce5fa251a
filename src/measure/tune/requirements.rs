//! What a view needs of settings, found before the search.

use crate::image::Image;
use crate::measure::Shot;
use crate::measure::gbuffers::GBuffers;
use crate::settings::{Method, MethodBlur, Settings};
use crate::{Error, Pipeline, Request};
use std::sync::Arc;

/// The step in texels below which a pixel certainly exits early. It is 1, less what rounding to 16-bit depth may add.
const SURELY_BELOW: f64 = 0.999;

/// What a view needs of settings, known before the search.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// The pixels that hold a surface. Errors count there.
    pub covered: Image<bool>,
    /// Depth samples a pixel, as many as the driver gave.
    pub samples: u32,
    /// How many pixels the blur takes for edges: first with the depth sigma of the methods that share one, then with
    /// that of `ssao`.
    pub edge_pixels: [usize; 2],
    /// R in texels at the farthest covered pixel and at the nearest.
    pub radius_px: (f64, f64),
}

impl Requirements {
    /// Renders the view's G-buffer and its edges.
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
            // Of all sample counts of `ssao`, 8 has the least depth sigma, and so the most edges.
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

    /// How many pixels the method's blur takes for edges.
    pub fn edges_of(&self, method: Method) -> usize {
        self.edge_pixels[edge_kind(method)]
    }

    /// Whether every pixel certainly exits early because its step is below a texel.
    pub(super) fn all_exit(&self, settings: &Settings) -> bool {
        settings.method.facts().exits_early && step(self.radius_px.1, settings) < SURELY_BELOW
    }

    /// Whether some pixel may exit early because its step is below a texel.
    pub(super) fn some_may_exit(&self, settings: &Settings) -> bool {
        settings.method.facts().exits_early && step(self.radius_px.0, settings) < 1.0 / SURELY_BELOW
    }
}

/// The index into [`Requirements::edge_pixels`] of a method: its blur decides which pixels are edges.
pub(super) fn edge_kind(method: Method) -> usize {
    usize::from(method.facts().blur == MethodBlur::Crysis)
}

/// The length of a step in texels of ambient occlusion, where R covers `radius_px` texels of the image.
fn step(radius_px: f64, settings: &Settings) -> f64 {
    radius_px / f64::from(settings.steps + 1) / f64::from(settings.ao_scale())
}
