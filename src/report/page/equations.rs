//! The papers' equations as they are used, each beside what computes it. They are written in LaTeX and shown in MathML,
//! which browsers draw without scripts.

use super::prose::unbroken;
use maud::{Markup, PreEscaped, html};
use pulldown_latex::{Parser, RenderConfig, Storage, config::DisplayMode, push_mathml};

/// An equation of the papers.
struct Equation {
    name: &'static str,
    latex: &'static str,
    /// What it says, and where its use departs from what is printed.
    text: &'static str,
    /// The files that compute it, from the root of the repository: shaders, then their float64 twins.
    files: &'static [&'static str],
}

const EQUATIONS: [Equation; 13] = [
    Equation {
        name: "6.2.1",
        latex: r"A_1 = 1 - \frac{1}{\pi} \int_\Omega V(\vec\omega)\,(\vec\omega \cdot \vec n)\,d\omega",
        text: "Where the chapter starts from: the share of the hemisphere that is open, weighted by the cosine. V is 1 where a \
               ray meets something within R. The methods leave the cosine out; hbao truth --weight cosine does not.",
        files: &["src/reference/truth.rs"],
    },
    Equation {
        name: "6.2.2",
        latex: r"A_2 = 1 - \frac{1}{2\pi} \int_\Omega V(\vec\omega)\,d\omega",
        text: "The same without the cosine: 6.2.3 with W = 1, which is the setting attenuation = none.",
        files: &["src/reference/truth.rs"],
    },
    Equation {
        name: "6.2.3",
        latex: r"A = 1 - \frac{1}{2\pi} \int_\Omega V(\vec\omega)\,W(\vec\omega)\,d\omega, \quad W(r) = 1 - \frac{r^2}{R^2}",
        text: "What all horizon methods approximate, and what rays on the triangles estimate as the truth.",
        files: &["glsl/shared/attenuation.glsl", "src/reference/attenuation.rs", "src/reference/truth.rs"],
    },
    Equation {
        name: "6.2.4",
        latex: r"A = 1 - \frac{1}{2\pi} \int_{\theta=-\pi}^{\pi} \int_{\phi=t(\theta)}^{\pi/2} V(\vec\omega)\,W(\vec\omega) \cos\phi\,d\phi\,d\theta",
        text: "The same about the eye's Z axis, from the tangent's elevation t up. The printed upper limit is garbled. It is valid \
               where n.z < 0: the claim 'azimuths' counts where it is not.",
        files: &["glsl/shared/tangent.glsl", "src/reference/sampling.rs"],
    },
    Equation {
        name: "6.2.5",
        latex: r"A = 1 - \frac{1}{2\pi} \int_{\theta=-\pi}^{\pi} \int_{\phi=t(\theta)}^{h(\theta)} W(\vec\omega) \cos\phi\,d\phi\,d\theta",
        text: "In a continuous height field everything below the horizon h is occluded, so that V need not be tested.",
        files: &["glsl/hbao.frag", "src/reference/hbao.rs"],
    },
    Equation {
        name: "6.2.6",
        latex: r"\sin\phi(S_i) = \frac{(P - S_i)_z}{\lVert P - S_i \rVert}",
        text: "The elevation of a sample. The chapter prints the tangent; its sine orders samples in the same way, and never \
               overflows.",
        files: &["glsl/hbao.frag", "src/reference/hbao.rs"],
    },
    Equation {
        name: "6.2.7",
        latex: r"\int_{\phi=t(\theta)}^{h(\theta)} W(\vec\omega) \cos\phi\,d\phi = \sum_{i=1}^{N_s} W(S_i) \int_{\phi_{i-1}}^{\phi_i} \cos\phi\,d\phi",
        text: "The way up to the horizon in pieces, one a sample that rises above all before it, each with its own W.",
        files: &["glsl/hbao.frag", "src/reference/hbao.rs"],
    },
    Equation {
        name: "6.2.8",
        latex: r"A = 1 - \frac{1}{N_d} \sum_{\theta} \sum_{i=1}^{N_s} W(S_i)\,(\sin\phi_i - \sin\phi_{i-1}), \quad \phi_0 = t(\theta)",
        text: "With one tangent for a direction, the setting grounding = direction. The mean over N_d directions replaces the integral over \
               the azimuth.",
        files: &["glsl/hbao.frag", "src/reference/hbao.rs"],
    },
    Equation {
        name: "6.2.9",
        latex: r"A = 1 - \frac{1}{N_d} \sum_{\theta} \sum_{i=1}^{N_s} W(S_i)\,[(\sin\phi_i - \sin t_i) - (\sin\phi_{i-1} - \sin t_{i-1})]",
        text: "The chapter's method: each sample is measured from the tangent towards itself, so that planes do not occlude \
               themselves where samples are snapped.",
        files: &["glsl/hbao.frag", "src/reference/hbao.rs"],
    },
    Equation {
        name: "6.2.10",
        latex: r"uv(S_i) = uv(P) + (\beta + i)\,(\Delta u, \Delta v)\,\mathrm{R}(\alpha)",
        text: "Where the samples lie. Alpha and beta are random, and come from a tile of 4x4 texels.",
        files: &["glsl/shared/sampling.glsl", "src/reference/sampling.rs"],
    },
    Equation {
        name: "6.2.11",
        latex: r"T = \Delta u \frac{\partial P}{\partial u} + \Delta v \frac{\partial P}{\partial v}",
        text: "The tangent towards a sample, in the plane of the surface. Called not perspective-correct, its direction is exact.",
        files: &["glsl/shared/tangent.glsl", "src/reference/sampling.rs"],
    },
    Equation {
        name: "Eq. 3 of the talk",
        latex: r"A = 1 - \frac{1}{N_d} \sum_{\theta} (\sin h(\theta) - \sin t(\theta))\,W(\theta), \quad W(\theta) = \max\!\left(0, 1 - \frac{r(\theta)}{R}\right)",
        text: "The talk's method: one horizon and one weight a direction, that of the sample at the horizon.",
        files: &["glsl/hbao_talk.frag", "src/reference/hbao_talk.rs"],
    },
    Equation {
        name: "6.1, listing",
        latex: r"A = \frac{1}{n} \sum_{i=1}^{n} \left[(1 - k_i)\,s_i + \frac{k_i}{2}\right], \quad k_i = \min\!\left(1, \max\!\left(0, \frac{z_P - z_i}{z_i}\right)\right)",
        text: "Crysis' method: the share of points about P that lie in front of the surface seen at their texel, whose depth is z_i \
               (s_i is 1 there and else 0), with the range check k_i. It ends with A^2 + A.",
        files: &["glsl/ssao.frag", "src/reference/ssao.rs"],
    },
];

/// Converts an equation to MathML.
fn mathml(latex: &str) -> String {
    let (storage, mut text) = (Storage::new(), String::new());
    let config = RenderConfig { display_mode: DisplayMode::Block, ..RenderConfig::default() };
    // Writing to a string cannot fail, and the tests show that every equation can be read.
    let _ = push_mathml(&mut text, Parser::new(latex, &storage), config);
    text
}

pub(super) fn section() -> Markup {
    html! {
        h2 #equations { "Equations, and what computes them" }
        p {
            "As they are used: P is the surface point of the pixel, S a sample, n the normal, R the radius of influence, and r the \
             distance of S from P. The files are those of the repository: each shader stands beside its twin in float64."
        }
        @for equation in &EQUATIONS {
            section.equation id={ "equation-" (equation.name.replace([' ', ','], "-")) } {
                div.scroll tabindex="0" { (PreEscaped(mathml(equation.latex))) }
                p {
                    b { @if equation.name.starts_with("6.2") { "Eq. " } (equation.name) } ". " (unbroken(equation.text))
                    @for file in equation.files { " " code { (file) } }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_equation_can_be_read_and_the_files_beside_it_are_there() {
        for Equation { name, latex, files, .. } in &EQUATIONS {
            let shown = mathml(latex);
            assert!(
                shown.starts_with("<math") && shown.contains("</math>") && !shown.contains("merror"),
                "{name}: {shown}"
            );
            for file in *files {
                assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(file).is_file(), "{name}: there is no {file}");
            }
        }
    }
}
