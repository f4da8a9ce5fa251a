//! The shader programs for one kind of inputs.

use super::plan::{Plan, Step};
use crate::Error;
use crate::gl::Renderbuffer;
use crate::pass::background::Background;
use crate::pass::blur::{Blur, BlurVariant};
use crate::pass::edges::Edges;
use crate::pass::half_depth::HalfDepth;
use crate::pass::linear_depth::{CurveVariant, LinearDepth, SamplesVariant};
use crate::pass::method::{MethodPass, MethodVariant, NormalsVariant, reads_half_depth};
use crate::pass::rebuilt_normals::RebuiltNormals;
use crate::pass::{Grid, ImageVariant};
use crate::settings::Settings;
use std::sync::Arc;

/// The result that an [`AmbientOcclusion`](super::AmbientOcclusion) computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Ambient occlusion.
    Visibility,
    /// The fetch floor of the method's pass ([`AmbientOcclusion::fetch_floor`](super::AmbientOcclusion::fetch_floor)),
    /// without a blur.
    Floor,
    /// Only which pixels are edges. Visibility stays 1.
    Edges,
    /// The blur of visibility 1. The method's own pass does not run.
    Blur,
}

/// The properties of inputs that programs are compiled for.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct InputKind {
    /// The kind and encoding of the caller's depth, if it must be made linear before the other passes read it.
    pub(super) encoded: Option<(ImageVariant, CurveVariant)>,
    pub(super) method: MethodVariant,
    /// The depth samples of the pixels, if edges are detected from them.
    pub(super) samples: Option<SamplesVariant>,
}

/// The programs for one kind of inputs.
pub(super) struct Programs {
    pub(super) kind: InputKind,
    pub(super) plan: Plan,
    /// The pass that makes depth linear; `None` if the caller's is.
    pub(super) linear_depth: Option<LinearDepth>,
    /// The pass that rebuilds normals; `None` if the caller has them, or if nothing reads them.
    pub(super) rebuilt_normals: Option<RebuiltNormals>,
    /// For each stencil, the index of the first target that has it, and the pass that fills it. Empty if no pass is
    /// masked.
    pub(super) stencils: Vec<(usize, Background)>,
    /// The method's pass; `None` if A = 1 everywhere.
    pub(super) ao: Option<MethodPass>,
    /// The pass that makes the half-size depth; `None` if the method's samples read the depth image itself.
    pub(super) half_depth: Option<HalfDepth>,
    pub(super) edges: Option<Edges>,
    pub(super) blurs: Vec<(Step, Blur)>,
    pub(super) blur_edges: Option<(Step, Blur)>,
}

impl Programs {
    pub(super) fn new(
        gl: &Arc<glow::Context>,
        settings: &Settings,
        purpose: Purpose,
        size: (u32, u32),
        kind: InputKind,
    ) -> Result<Programs, Error> {
        let plan = Plan::new(settings, kind.samples.is_some());
        let depth = kind.method.depth;
        let ao = match purpose {
            Purpose::Edges | Purpose::Blur => None,
            Purpose::Visibility | Purpose::Floor => MethodPass::new(gl, settings, kind.method)?,
        };
        let mut stencils = Vec::new();
        for (i, scale) in plan.scales.iter().enumerate() {
            let masked = ao.is_some() || !plan.steps.is_empty() || kind.samples.is_some();
            if masked && !plan.scales[..i].contains(scale) {
                stencils.push((i, Background::new(gl, depth, *scale)?));
            }
        }
        let blur = |step: Step, samples| {
            let (from, to) = (plan.scales[step.from], plan.scales[step.to]);
            Ok((step, Blur::new(gl, BlurVariant { kernel: step.kernel, depth, from, to, samples })?))
        };
        let blurs = plan.steps.iter().map(|&step| blur(step, None)).collect::<Result<_, Error>>()?;
        let blur_edges = plan.edges.map(|step| blur(step, kind.samples)).transpose()?;
        let edges = kind.samples.map(|samples| Edges::new(gl, samples)).transpose()?;
        let half_depth =
            if reads_half_depth(settings) && ao.is_some() { Some(HalfDepth::new(gl, depth, size)?) } else { None };
        let linear_depth = kind.encoded.map(|(depth, curve)| LinearDepth::new(gl, depth, curve, size)).transpose()?;
        let rebuilt_normals = None;
        Ok(Programs { kind, plan, linear_depth, rebuilt_normals, stencils, ao, half_depth, edges, blurs, blur_edges })
    }

    /// Makes the pass that rebuilds normals, if the method reads any and the caller has none. The grid and the stencil
    /// are those of the method's target, which exists only after the plan was made.
    pub(super) fn add_rebuilt_normals(
        &mut self,
        gl: &Arc<glow::Context>,
        settings: &Settings,
        grid: Grid,
        stencil: &Renderbuffer,
    ) -> Result<(), Error> {
        let MethodVariant { depth, normals, orthographic, .. } = self.kind.method;
        if normals == NormalsVariant::Rebuilt && self.ao.is_some() && settings.reads_normals() {
            self.rebuilt_normals = Some(RebuiltNormals::new(gl, depth, orthographic, grid, Some(stencil))?);
        }
        Ok(())
    }
}
