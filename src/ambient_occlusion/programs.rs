//! The shader programs for one kind of inputs.

use super::plan::{Plan, Step, supersamples};
use crate::Error;
use crate::gl::ProgramCache;
use crate::pass::ImageVariant;
use crate::pass::background::Background;
use crate::pass::blur::{Blur, BlurVariant};
use crate::pass::edges::Edges;
use crate::pass::half_depth::HalfDepth;
use crate::pass::linear_depth::{CurveVariant, LinearDepth, SamplesVariant};
use crate::pass::method::{MethodPass, MethodVariant, NormalsVariant, reads_half_depth};
use crate::pass::rebuilt_normals::RebuiltNormals;
use crate::settings::Settings;

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
    pub(super) perspective: bool,
    /// The kind and encoding of the caller's depth, if it must be made linear before the other passes read it.
    pub(super) encoded: Option<(ImageVariant, CurveVariant)>,
    /// The linear depth that the passes read: the caller's, or that which was made from it.
    pub(super) depth: ImageVariant,
    pub(super) normals: NormalsVariant,
    /// The depth samples of the pixels, if there are several.
    pub(super) samples: Option<SamplesVariant>,
    /// Whether the caller asks which pixels are edges.
    pub(super) edges: bool,
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
    /// Compiles the programs, those that `cache` does not have. Changes bindings.
    pub(super) fn new(
        cache: &mut ProgramCache,
        settings: &Settings,
        purpose: Purpose,
        kind: InputKind,
    ) -> Result<Programs, Error> {
        let InputKind { perspective, depth, normals, .. } = kind;
        // Edges are detected if the blur treats them separately, or if the caller asks for them.
        let samples = kind.samples.filter(|_| kind.edges || supersamples(settings));
        let plan = Plan::new(settings, samples.is_some());
        let method = MethodVariant {
            orthographic: !perspective,
            radius_of_depth: settings.radius_of_depth(perspective),
            depth,
            normals,
            floor: purpose == Purpose::Floor,
        };
        let ao = match purpose {
            Purpose::Edges | Purpose::Blur => None,
            Purpose::Visibility | Purpose::Floor => MethodPass::new(cache, settings, method)?,
        };
        let mut stencils = Vec::new();
        for (i, scale) in plan.scales.iter().enumerate() {
            let masked = ao.is_some() || !plan.steps.is_empty() || samples.is_some();
            if masked && !plan.scales[..i].contains(scale) {
                stencils.push((i, Background::new(cache, depth, *scale)?));
            }
        }
        let sigma_of_depth = settings.sigma_of_depth(perspective);
        let mut blur = |step: Step, samples| {
            let (from, to) = (plan.scales[step.from], plan.scales[step.to]);
            let variant = BlurVariant { kernel: step.kernel, depth, from, to, sigma_of_depth, samples };
            Ok((step, Blur::new(cache, variant)?))
        };
        let blurs = plan.steps.iter().map(|&step| blur(step, None)).collect::<Result<_, Error>>()?;
        let blur_edges = plan.edges.map(|step| blur(step, samples)).transpose()?;
        let edges = samples.map(|samples| Edges::new(cache, samples)).transpose()?;
        let half_depth =
            if reads_half_depth(settings) && ao.is_some() { Some(HalfDepth::new(cache, depth)?) } else { None };
        let linear_depth = kind.encoded.map(|(depth, curve)| LinearDepth::new(cache, depth, curve)).transpose()?;
        let rebuilt_normals = if normals == NormalsVariant::Rebuilt && ao.is_some() && settings.reads_normals() {
            Some(RebuiltNormals::new(cache, depth, !perspective, plan.scales[0])?)
        } else {
            None
        };
        Ok(Programs { kind, plan, linear_depth, rebuilt_normals, stencils, ao, half_depth, edges, blurs, blur_edges })
    }
}
