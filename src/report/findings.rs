//! The findings that the page begins with. Each asks a question, and answers it with numbers and pictures.

use super::bars;
use super::claim::{Claim, Verdict, percent, steps};
use super::figure::{Drawing, Figure, Picture};
use super::figures::{detail, grey, picture};
use super::lab::Lab;
use super::measures::Measures;
use super::sweep::Sweep;
use super::tables::cells::number;
use crate::picture::AO;
use hbao::measure::decomposition::Decomposition;
use hbao::measure::published::{FIGURE_1, ULTRA, table_mpixels_per_s};
use hbao::measure::table::{Column, Table};
use hbao::settings::{Method, NormalFormat};
use hbao::{Error, Settings};

/// A question, its answer, and what shows it.
pub(super) struct Finding {
    /// The answer in a sentence or two.
    pub(super) answer: String,
    /// The claims that decide it, by their names.
    pub(super) claims: &'static [&'static str],
    /// The figure whose title is the question.
    pub(super) figure: Figure,
}

/// Makes every finding, in the order of the page.
pub(super) fn all(lab: &Lab, measures: &Measures, claims: &[Claim]) -> Result<Vec<Finding>, Error> {
    let claim = |id: &str| claims.iter().find(|claim| claim.id == id);
    Ok(vec![
        normals(lab, claim("normals-8-bit"))?,
        half_resolution(lab, measures, claim("half-resolution"))?,
        two_papers(lab, measures)?,
        parts(measures),
    ])
}

/// Shows visibility under two settings, and `louder` times their difference.
fn pair(
    lab: &Lab,
    [one, other]: [&Settings; 2],
    [first, second]: [&str; 2],
    louder: f32,
    file: &str,
) -> Result<Vec<Picture>, Error> {
    let church = lab.church();
    let mut pictures = Vec::new();
    for (settings, name, part) in [(one, first, "a"), (other, second, "b")] {
        let caption = format!("{}, {name}", church.name);
        pictures.push(picture(lab, church, lab.size, settings, &AO, &format!("{file}-{part}"), &caption)?);
    }
    let [mut difference, other] = [lab.ao(church, one)?, lab.ao(church, other)?];
    difference.texels.iter_mut().zip(&other.texels).for_each(|(a, b)| *a = (louder * (*a - b).abs()).min(1.0));
    let size = (difference.width, difference.height);
    let caption = format!("{louder} times the difference of the two: black is none");
    pictures.push(detail(&grey(&difference), (0, 0), size, 1, &format!("{file}-difference"), &caption)?);
    Ok(pictures)
}

fn normals(lab: &Lab, claim: Option<&Claim>) -> Result<Finding, Error> {
    let fine = lab.church().exact(Method::Hbao);
    let coarse = Settings { normal_format: NormalFormat::Rgba8Snorm, ..fine.clone() };
    let worst = claim.iter().flat_map(|claim| &claim.found).map(|found| found.value).fold(0.0, f64::max);
    let verdict = match claim.map_or(Verdict::NotMeasured, Claim::verdict) {
        Verdict::Holds => "Yes",
        Verdict::InPart => "Nearly",
        Verdict::DoesNotHold => "No",
        Verdict::NotMeasured => "Not measured",
    };
    Ok(Finding {
        answer: format!(
            "{verdict}: normals of 8 bits a component move visibility by {} RMS in the scene where they do most, and an \
             8-bit picture has steps of 1/255.",
            steps(worst)
        ),
        claims: &["normals-8-bit", "ao-8-bit"],
        figure: Figure {
            id: "finding-normals".into(),
            title: "Do 8-bit normals suffice?".into(),
            text: "The last table of the page, 'False occlusion of a floor, which is open', shows what they do to a floor, and \
                   which angle bias removes it."
                .into(),
            pictures: pair(
                lab,
                [&fine, &coarse],
                ["normals of 16 bits (RGBA16F)", "normals of 8 bits (RGBA8_SNORM)"],
                64.0,
                "finding-normals",
            )?,
            ..Figure::default()
        },
    })
}

fn half_resolution(lab: &Lab, measures: &Measures, claim: Option<&Claim>) -> Result<Finding, Error> {
    let full = lab.church().exact(Method::Hbao);
    let half = Settings { half_res: true, ..full.clone() };
    let errors = claim.iter().flat_map(|claim| &claim.found);
    let errors: Vec<_> = errors.map(|found| format!("{:.2} times ({})", found.value, found.scene)).collect();
    let ratio = |what: &str| measures.ratios.iter().find(|ratio| ratio.what == what);
    let frame = ratio("frame at half over full resolution, 8/8")
        .map_or(String::new(), |frame| format!(", and the whole frame {}", percent(frame.ours)));
    let time = ratio("AO at half over full resolution, 8/8").map_or(String::new(), |ratio| {
        let then = ratio.papers.iter().map(|(_, share)| *share);
        let (least, most) = then.fold((f64::INFINITY, 0.0f64), |(low, high), share| (low.min(share), high.max(share)));
        format!(
            "With 8 directions of 8 steps at {}x{}, the ambient occlusion pass takes {} of the time at full resolution \
             ({} to {} on the cards of 2008){frame}. ",
            lab.size.0,
            lab.size.1,
            percent(ratio.ours),
            percent(least),
            percent(most)
        )
    });
    Ok(Finding {
        answer: format!("{time}Its error is {} that of full resolution.", errors.join(" and ")),
        claims: &["half-resolution", "half-resolution-balance"],
        figure: Figure {
            id: "finding-half-resolution".into(),
            title: "What does half resolution cost?".into(),
            text: format!(
                "At half resolution R covers half as many texels. Where its steps are shorter than a texel, the chapter \
                 exits early and leaves the surface open. That happens more often in small pictures: the second claim below \
                 is about pictures of {}x{}, and has larger errors.",
                lab.small().0,
                lab.small().1
            ),
            pictures: pair(lab, [&full, &half], ["full resolution", "half resolution"], 8.0, "finding-half")?,
            ..Figure::default()
        },
    })
}

fn two_papers(lab: &Lab, measures: &Measures) -> Result<Finding, Error> {
    let church = lab.church();
    let [chapter, talk] = [Method::Hbao, Method::HbaoTalk].map(|method| church.settings(method));
    let here = |method: Method| {
        let case = measures.of_case("figure1", method.name());
        number(case.map_or(f64::NAN, |one| one.mpixels_per_s()), 2)
    };
    let (in_talk, in_chapter) = (FIGURE_1[0].1, table_mpixels_per_s());
    let errors = [&talk, &chapter].map(|settings| -> Result<String, Error> {
        let image = lab.ao(church, settings)?;
        Ok(format!("{:.4}", lab.errors_of(church, &image, settings)?.rmse))
    });
    let [talks_error, chapters_error] = errors;
    let row = |cells: [&str; 3]| cells.map(String::from).to_vec();
    let rows = [
        row([&format!("MPixels/s on the {ULTRA}, 2008"), &number(in_talk, 0), &number(in_chapter, 1)]),
        row(["MPixels/s here", &here(Method::HbaoTalk), &here(Method::Hbao)]),
        row([&format!("RMSE here, {}", church.name), &talks_error?, &chapters_error?]),
        row(["weight", "1 - r/R, of the horizon", "1 - (r/R)^2, of each sample"]),
        row(["samples", "each is snapped to a texel", "the step is snapped"]),
        row(["what is random", "the step", "where the first step begins"]),
    ];
    let named = |name: &str| format!("{}, {name}", church.name);
    let of =
        |settings: &Settings, file: &str, name: &str| picture(lab, church, lab.size, settings, &AO, file, &named(name));
    Ok(Finding {
        answer: format!(
            "The talk (SIGGRAPH 2008) and the chapter (ShaderX7 6.2) disagree on speed by a factor of {:.2}: on the same \
             card the talk has {in_talk:.0} MPixels/s, and Table 6.2.1 of the chapter implies {in_chapter:.1}, with 8 \
             directions of 8 steps each. Here the two take nearly the same time ({} and {} MPixels/s). They also disagree \
             on what a sample weighs.",
            in_talk / in_chapter,
            here(Method::HbaoTalk),
            here(Method::Hbao)
        ),
        claims: &["attenuation-per-sample", "quadratic-attenuation", "talk-figure-1"],
        figure: Figure {
            id: "finding-two-papers".into(),
            title: "Where do the two papers disagree?".into(),
            text: "The chapter's number is that of its frames with 8/8 less those with no AO, at one sample a pixel. The errors \
                   are against rays, each with the weight of its own paper."
                .into(),
            tables: vec![
                Table::new(["", "the talk (hbao-talk)", "the chapter (hbao)"].map(|heading| Column::left(heading, 0)))
                    .captioned("The algorithm as each of the two describes it")
                    .filled(rows)
                    .noted(["The row 'what is random' is about the papers. Our hbao-talk has the chapter's jitter, so that the two methods \
                             differ in nothing but their equations.".into()]),
            ],
            pictures: vec![
                of(&talk, "finding-papers-talk", "the talk (hbao-talk)")?,
                of(&chapter, "finding-papers-chapter", "the chapter (hbao)")?,
            ],
            ..Figure::default()
        },
    })
}

/// The parts of an error, as the page names them.
const PARTS: [&str; 4] = ["model", "sampling", "filtering", "quantisation"];

/// Returns the root mean square of each of [`PARTS`].
fn sizes(parts: &Decomposition) -> [f64; 4] {
    [parts.model, parts.sampling, parts.filtering, parts.quantisation].map(|part| part.rmse)
}

fn parts(measures: &Measures) -> Finding {
    let shares = |swept: &Sweep| {
        let (_, parts) = swept.parts.iter().find(|(s, _)| (s.directions, s.half_res) == (8, false))?;
        let squares = sizes(parts).map(|size| size * size);
        Some((swept.scene.clone(), squares.map(|square| percent(square / squares.iter().sum::<f64>()))))
    };
    let (scenes, shares): (Vec<_>, Vec<_>) = measures.sweeps.iter().filter_map(shares).unzip();
    let of = |(scene, shares): (&String, &[String; 4])| {
        let each: Vec<String> = PARTS.iter().zip(shares).map(|(part, share)| format!("{part} {share}")).collect();
        format!("{scene}: {}", each.join(", "))
    };
    let found: Vec<String> = scenes.iter().zip(&shares).map(of).collect();
    let drawn = |swept: &Sweep| {
        let group = |(s, parts): &(Settings, Decomposition)| {
            let half = if s.half_res { ", half" } else { "" };
            (format!("{}/{}{half}", s.directions, s.steps), sizes(parts))
        };
        let groups: Vec<_> = swept.parts.iter().map(group).collect();
        Drawing {
            file: format!("error-parts-{}.svg", swept.key),
            caption: format!("{}: RMSE of each part, by directions and steps", swept.scene),
            svg: bars::bars(&groups, PARTS, "RMSE"),
        }
    };
    Finding {
        answer: format!("Of the parts' squared errors with 8/8: {}.", found.join("; ")),
        claims: &["more-samples", "blur-shrinks"],
        figure: Figure {
            id: "finding-error".into(),
            title: "Where does the error come from?".into(),
            text: "The model's part is what would be left with endlessly many samples, because a depth image shows one surface a \
                   pixel, and nothing beyond its border. Sampling adds the error of so few directions and steps, filtering \
                   that of the blur, quantisation that of 8-bit targets. The shares are of the sum of the four squares. The \
                   square of the whole error also has cross terms between the parts, which the section Tables lists. Where \
                   more steps make the part of sampling larger, the chapter exits early at more pixels."
                .into(),
            drawings: measures.sweeps.iter().map(drawn).collect(),
            ..Figure::default()
        },
    }
}
