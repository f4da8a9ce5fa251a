//! The claims of ShaderX7 6.2 on formats, the blur, half resolution and multisampling.

use super::jitter_noise::noise;
use super::test::Test;
use crate::report::claim::{Bound, Claim, Found, Verdict, at_most, percent, steps, times};
use crate::report::lab::{Lab, compare};
use crate::report::measures::Measures;
use crate::report::subject::Subject;
use hbao::image::Image;
use hbao::measure::{blur_ms, median};
use hbao::settings::{AoFormat, BlurKernel, Edges, Method, NormalFormat};
use hbao::{Error, Request, Settings, size_limit};

pub(super) const ALL: &[Test] = &[
    normals_of_8_bits,
    ambient_occlusion_of_8_bits,
    separated_blur,
    the_blur_shrinks,
    half_resolution,
    supersampled_edges,
];

/// A change of A by more than this counts as visible.
const VISIBLE: f64 = 4.0 / 255.0;

/// Measures the effect of a change of one setting in every scene. The bound limits the root of the mean squared
/// difference. `from` and `to` name the two values of the setting.
fn changes(
    lab: &Lab,
    bound: Bound,
    [from, to]: [&str; 2],
    change: impl Fn(Settings) -> Settings,
) -> Result<Vec<Found>, Error> {
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let exact = subject.exact(Method::Hbao);
        let covered = lab.see(subject, lab.size, &exact)?.covered();
        let (exact_image, changed) = (lab.ao(subject, &exact)?, lab.ao(subject, &change(exact.clone()))?);
        let errors = compare(&changed, &exact_image, &covered)?;
        let [a, b] = [lab.errors_of(subject, &exact_image, &exact)?, lab.errors_of(subject, &changed, &exact)?];
        let text = format!(
            "A moves by {} RMS, {} at most; RMSE against the truth {:.4} with {to}, {:.4} with {from}",
            steps(errors.rmse),
            steps(errors.max),
            b.rmse,
            a.rmse
        );
        found.push(bound.found(&subject.name, errors.rmse, text));
    }
    Ok(found)
}

fn normals_of_8_bits(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.0 / 255.0, VISIBLE);
    Ok(Claim {
        id: "normals-8-bit",
        says: "8 bits per component are enough for the normals.",
        source: "6.2, Per-pixel normals",
        found: changes(lab, bound, ["RGBA16F", "RGBA8_SNORM"], |exact| Settings {
            normal_format: NormalFormat::Rgba8Snorm,
            ..exact
        })?,
        rule: bound.rule("the root mean square of what they move A by", steps),
        ..Claim::default()
    })
}

fn ambient_occlusion_of_8_bits(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.0 / 255.0, VISIBLE);
    Ok(Claim {
        id: "ao-8-bit",
        says: "A buffer of 8 bits and one channel is enough for ambient occlusion.",
        source: "6.2, Implementation considerations",
        found: changes(lab, bound, ["R32F", "R8"], |exact| Settings { ao_format: AoFormat::R8, ..exact })?,
        rule: bound.rule("the root mean square of what they move A by, after both blurs,", steps),
        ..Claim::default()
    })
}

fn separated_blur(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.0 / 255.0, VISIBLE);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        for blur in [9, 21] {
            let of = |blur_kernel| Settings { blur, blur_kernel, ..subject.exact(Method::Hbao) };
            let covered = lab.see(subject, lab.size, &of(BlurKernel::Full))?.covered();
            let both = [BlurKernel::Separable, BlurKernel::Full].map(|kernel| -> Result<_, Error> {
                let request = Request { timings: true, ..Request::default() };
                let (mut pipeline, _) = lab.render(subject, lab.size, &of(kernel), request)?;
                let camera = subject.camera(lab.size)?;
                let mut times = Vec::new();
                for _ in 0..5 {
                    times.push(blur_ms(&pipeline.render(&subject.mesh, &camera)?));
                }
                Ok((pipeline.ao()?, median(&times)))
            });
            let [separable, full] = both;
            let ((separable, fast), (full, slow)) = (separable?, full?);
            let errors = compare(&separable, &full, &covered)?;
            let text = format!(
                "A differs by {} RMS, {} at most; the full blur takes {:.1} times as long",
                steps(errors.rmse),
                steps(errors.max),
                slow / fast
            );
            let mut one = bound.found(format!("{}, {blur}x{blur}", subject.name), errors.rmse, text);
            if one.verdict == Verdict::Holds && slow < 2.0 * fast {
                one.verdict = Verdict::InPart;
            }
            found.push(one);
        }
    }
    Ok(Claim {
        id: "separable-blur",
        says: "Separated in X and Y, the bilateral blur is fast and has very few visible artefacts.",
        source: "6.2, Cross-bilateral filter",
        found,
        rule: bound.rule("the root mean square difference from the full blur", steps)
            + "; in part also where the full blur takes less than twice as long",
        ..Claim::default()
    })
}

fn the_blur_shrinks(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    const QUIET: f64 = 1.0 / 255.0;
    const WIDTHS: [u32; 10] = [0, 3, 5, 7, 9, 13, 17, 21, 31, 41];
    /// Represents a blur that is wider than the widest.
    const BEYOND: u32 = 43;
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let (mut needed, mut list) = (Vec::new(), Vec::new());
        'counts: for count in [4, 8, 16] {
            let settings = |blur| Settings { directions: count, steps: count, blur, ..subject.exact(Method::Hbao) };
            let depth = lab.see(subject, lab.size, &settings(0))?.depth;
            let mut enough = None;
            for blur in WIDTHS {
                let Some(left) = noise(&lab.ao(subject, &settings(blur))?, &depth) else { break 'counts };
                if blur == 0 {
                    list.push(format!("{count}/{count} has {} of noise", steps(left)));
                }
                if left <= QUIET {
                    enough = Some(blur);
                    break;
                }
            }
            needed.push(enough.unwrap_or(BEYOND));
            let width = enough.map_or("more than 41".into(), |blur| blur.to_string());
            list.push(format!("needs a blur of {width}"));
        }
        if needed.len() < 3 {
            continue;
        }
        let verdict = match needed[..] {
            [a, b, c] if a > b && b > c => Verdict::Holds,
            [a, b, c] if a >= b && b >= c && a > c => Verdict::InPart,
            _ => Verdict::DoesNotHold,
        };
        let value = f64::from(needed[0]) - f64::from(needed[2]);
        found.push(Found { scene: subject.name.clone(), text: list.join(", "), value, verdict });
    }
    Ok(Claim {
        id: "blur-shrinks",
        says: "As directions and steps grow, the blur can be made considerably smaller.",
        source: "6.2, Cross-bilateral filter; Figure 6.2.16",
        found,
        rule: format!(
            "holds where the smallest blur that leaves at most {} falls from 4/4 to 8/8 and again to 16/16, in part where it \
             falls once",
            steps(QUIET)
        ),
        note: "Noise is what the 4x4 residues of the tile differ by over windows of 32x32 pixels of smooth surfaces, the root of \
               the mean variance. A blur wider than 5 takes none of it: what few directions do beyond that is no noise, but \
               wide bars and fans."
            .into(),
        unmeasured: Some("in no view 10 windows of 32x32 pixels lie on smooth surfaces: give a larger --size".into()),
    })
}

fn half_resolution(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(1.05, 1.2);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let full = subject.exact(Method::Hbao);
        let half = Settings { half_res: true, ..full.clone() };
        let covered = lab.see(subject, lab.size, &full)?.covered();
        let [f, h] = [lab.ao(subject, &full)?, lab.ao(subject, &half)?];
        let between = compare(&h, &f, &covered)?;
        let [f, h] = [lab.errors_of(subject, &f, &full)?, lab.errors_of(subject, &h, &full)?];
        let text = format!(
            "RMSE against the truth {:.4}, at full resolution {:.4}; A moves by {} RMS",
            h.rmse,
            f.rmse,
            steps(between.rmse)
        );
        let mut one = bound.found(&subject.name, h.rmse / f.rmse, text);
        if one.verdict == Verdict::Holds && between.rmse > VISIBLE {
            one.verdict = Verdict::InPart;
        }
        found.push(one);
    }
    Ok(Claim {
        id: "half-resolution",
        says: "Ambient occlusion at half resolution, upsampled by the blur, has little impact on the image.",
        source: "6.2, Working at lower resolution",
        found,
        rule: bound.rule("RMSE against the truth over that at full resolution", times)
            + &format!("; in part also where A moves by more than {} RMS", steps(VISIBLE)),
        ..Claim::default()
    })
}

/// Returns an image of half the size, in which each texel is the mean of 2x2 texels.
fn halved(image: &Image<f32>) -> Image<f32> {
    Image::from_fn(image.width / 2, image.height / 2, |x, y| {
        (0..4).map(|i| image.at(2 * x + i % 2, 2 * y + i / 2)).sum::<f32>() / 4.0
    })
}

fn supersampled_edges(lab: &Lab, _: &Measures) -> Result<Claim, Error> {
    let bound = at_most(0.5, 0.85);
    let mut found = Vec::new();
    for subject in lab.data_sets() {
        let Some((plain, supersampled, edges)) = bleeding(lab, subject)? else { continue };
        let text = format!(
            "mean error on {edges} edge pixels {plain:.4} by the plain blur, {supersampled:.4} by the supersampling one"
        );
        found.push(bound.found(&subject.name, supersampled / plain, text));
    }
    Ok(Claim {
        id: "edge-supersampling",
        says: "The plain blur bleeds at silhouettes; supersampled around each depth sample of edge pixels it does so less.",
        source: "6.2, Multisample antialiasing; Figure 6.2.15",
        unmeasured: Some(
            "no view has 100 pixels of several surfaces, or the driver has one sample a pixel or no images of twice the size"
                .into(),
        ),
        found,
        rule: bound.rule("mean error on edge pixels over that of the plain blur", percent),
        note: "Against the same at twice the size with a blur of as many eye-space units, averaged over 2x2.".into(),
    })
}

/// Returns the mean error on edge pixels without and with the supersampling blur, and the number of these pixels. A
/// pixel is left out if its blur reaches a surface on which a step is shorter than a texel. On such a surface the
/// chapter's method exits early at the smaller size, but not at the larger one.
fn bleeding(lab: &Lab, subject: &Subject) -> Result<Option<(f64, f64, usize)>, Error> {
    let settings = Settings { msaa: 4, ..subject.exact(Method::Hbao) };
    let twice = (2 * lab.size.0, 2 * lab.size.1);
    if twice.0.max(twice.1) > size_limit(lab.gl) {
        return Ok(None);
    }
    let request = Request { edges: true, ..Request::default() };
    let (with, _) = lab.render(subject, lab.size, &settings, request)?;
    let (without, _) = lab.render(subject, lab.size, &Settings { edges: Edges::Off, ..settings.clone() }, request)?;
    let Some(edges) = with.edges() else { return Ok(None) };
    let seen = lab.see(subject, lab.size, &settings)?;
    let farthest = seen.texels_at_depth_1() * subject.radius / f64::from(settings.steps + 1);
    let reach = settings.blur as usize / 2;
    let near = |v: usize, size: usize| v.saturating_sub(reach)..(v + reach + 1).min(size);
    let edges = Image::from_fn(edges.width, edges.height, |x, y| {
        let exits = |x: usize, y: usize| {
            let z = f64::from(seen.depth.at(x, y));
            z.is_finite() && z > farthest
        };
        edges.at(x, y) && !near(y, edges.height).any(|y| near(x, edges.width).any(|x| exits(x, y)))
    });
    let count = edges.texels.iter().filter(|&&edge| edge).count();
    if count < 100 {
        return Ok(None);
    }
    let wide = Settings { msaa: 1, blur: 2 * settings.blur - 1, ..settings.clone() };
    let (fine, _) = lab.render(subject, twice, &wide, Request::default())?;
    let fine = halved(&fine.ao()?);
    let mean = |image: Image<f32>| compare(&image, &fine, &edges).map(|errors| errors.mae);
    Ok(Some((mean(without.ao()?)?, mean(with.ao()?)?, count)))
}
