//! Decides which targets and blur passes the settings need.

use crate::pass::blur::Kernel;
use crate::settings::{BlurKernel, Edges, MethodBlur, Settings};

/// One pass of the blur: its name, its kernel, and the indices of the targets that it reads and draws into.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub(super) name: &'static str,
    pub(super) kernel: Kernel,
    pub(super) from: usize,
    pub(super) to: usize,
}

/// Returns whether there is a blur at all.
fn blurs(settings: &Settings) -> bool {
    settings.blur > 0 && settings.method.facts().blur != MethodBlur::None
}

/// Returns whether the blur treats edge pixels separately and runs once for each of their depth samples.
pub(super) fn supersamples(settings: &Settings) -> bool {
    blurs(settings) && settings.edges == Edges::Supersample
}

/// The targets and the blur passes that lead from the method's image to the result.
pub(super) struct Plan {
    /// How many pixels in x and y one texel of each target stands for.
    pub(super) scales: Vec<[u32; 2]>,
    /// The passes that blur the whole image.
    pub(super) steps: Vec<Step>,
    /// The pass that blurs edge pixels.
    pub(super) edges: Option<Step>,
}

impl Plan {
    /// Makes the plan for these settings. `multisample` says that there are depth samples, and that edges are detected
    /// from them.
    pub(super) fn new(settings: &Settings, multisample: bool) -> Plan {
        let ao = settings.ao_scale();
        let mut plan = Plan { scales: vec![[ao; 2]], steps: Vec::new(), edges: None };
        if !blurs(settings) {
            if multisample && ao != 1 {
                plan.scales.push([1, 1]);
            }
            return plan;
        }
        let supersample = multisample && supersamples(settings);
        let width = settings.blur;
        let (whole, separable) = match (settings.method.facts().blur, settings.blur_kernel) {
            (MethodBlur::Crysis, _) => (Kernel::Crysis, false),
            (_, BlurKernel::Full) => (Kernel::Full(width), false),
            (_, BlurKernel::Separable) => (Kernel::Full(width), true),
        };
        if separable {
            // Ambient occlusion at half resolution is brought to full size one axis at a time: the pass in X fills in
            // columns, the pass in Y fills in rows.
            plan.scales.push([1, ao]);
            // The pass in Y draws into the first target again, unless that target is smaller or is still needed for the
            // edge pixels.
            let last = if ao == 1 && !supersample { 0 } else { 2 };
            plan.steps.push(Step { name: "blur_x", kernel: Kernel::X(width), from: 0, to: 1 });
            plan.steps.push(Step { name: "blur_y", kernel: Kernel::Y(width), from: 1, to: last });
            if last == 2 {
                plan.scales.push([1, 1]);
            }
        } else {
            plan.scales.push([1, 1]);
            plan.steps.push(Step { name: "blur_full", kernel: whole, from: 0, to: 1 });
        }
        // The supersampling blur takes the whole square of taps at once, because the samples of a pixel share its
        // fetches.
        plan.edges = supersample.then(|| Step { name: "blur_edges", kernel: whole, from: 0, to: plan.last() });
        plan
    }

    /// Returns the index of the first target of full size. The edges are in its stencil.
    pub(super) fn full(&self) -> Option<usize> {
        self.scales.iter().position(|&scale| scale == [1, 1])
    }

    /// Returns the index of the target that holds the result.
    pub(super) fn last(&self) -> usize {
        self.steps.last().map_or(0, |step| step.to)
    }
}
