//! Which targets and blur passes the settings ask for.

use crate::pass::blur::Kernel;
use crate::settings::{BlurKernel, Edges, MethodBlur, Settings};

/// One pass of the blur: its name, and the targets that it goes from and to.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub(super) name: &'static str,
    pub(super) kernel: Kernel,
    pub(super) from: usize,
    pub(super) to: usize,
}

fn blurs(settings: &Settings) -> bool {
    settings.blur > 0 && settings.method.facts().blur != MethodBlur::None
}

/// Whether the blur goes around every depth sample of an edge pixel, where it has several.
pub(super) fn supersamples(settings: &Settings) -> bool {
    blurs(settings) && settings.edges == Edges::Supersample
}

/// How ambient occlusion gets from the first target, where the method draws it, to the last.
pub(super) struct Plan {
    /// How many pixels a texel of each target stands for.
    pub(super) scales: Vec<[u32; 2]>,
    /// The blur everywhere.
    pub(super) steps: Vec<Step>,
    /// The blur on edge pixels.
    pub(super) edges: Option<Step>,
}

impl Plan {
    /// `multisample`: there are depth samples, and edges are looked for among them.
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
            // From half resolution a row at a time: X leaves half the rows, and Y fills in the others.
            plan.scales.push([1, ao]);
            // Back to where it came from, unless that is smaller, or still wanted for the edges.
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
        // The samples of a pixel share their taps, so the square is taken as a whole.
        plan.edges = supersample.then(|| Step { name: "blur_edges", kernel: whole, from: 0, to: plan.last() });
        plan
    }

    /// The first target of full size: its stencil holds the edges.
    pub(super) fn full(&self) -> Option<usize> {
        self.scales.iter().position(|&scale| scale == [1, 1])
    }

    /// The target that holds the result.
    pub(super) fn last(&self) -> usize {
        self.steps.last().map_or(0, |step| step.to)
    }
}
