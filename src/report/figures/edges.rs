//! The figure of ShaderX7 6.2 on bleeding at edges.

use super::picture::{detail, grey};
use crate::report::figure::Figure;
use crate::report::lab::Lab;
use hbao::image::Image;
use hbao::scene::CORNELL_BOX;
use hbao::settings::{Edges, Method};
use hbao::{Apply, Error, Request, Settings};

pub(super) fn edge_bleeding(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", CORNELL_BOX]);
    let request = Request { composite: Some(Apply::All), edges: true, ..Request::default() };
    let supersampled = subject.settings(Method::Hbao);
    let naive = Settings { edges: Edges::Off, ..supersampled.clone() };
    let (with, _) = lab.render(subject, lab.size, &supersampled, request)?;
    let (without, _) = lab.render(subject, lab.size, &naive, request)?;
    let (Some(with_final), Some(without_final), Some(edges)) = (with.composite()?, without.composite()?, with.edges())
    else {
        return Err(Error::Usage("the final images were not kept".into()));
    };
    // The window shows the place where the two blurs differ most.
    let side = 96.min(with_final.width).min(with_final.height);
    let difference = with.ao()?.texels.iter().zip(&without.ao()?.texels).map(|(a, b)| (a - b).abs()).collect();
    let difference = Image { width: with_final.width, height: with_final.height, texels: difference };
    let at = largest(&difference, side);
    let window = (side, side);
    let shown = |image: &Image<[u8; 3]>, file: &str, caption: &str| detail(image, at, window, 4, file, caption);
    let mut pictures = vec![
        shown(&with.colour()?, "6.2.15-a", "colour, no ambient occlusion")?,
        shown(
            &without_final,
            "6.2.15-b",
            "the blur around the resolved depth: what is behind bleeds into silhouettes",
        )?,
        shown(&with_final, "6.2.15-c", "the supersampling blur at edges")?,
    ];
    for (image, file, caption) in
        [(&without, "6.2.15-b-ao", "visibility, plain blur"), (&with, "6.2.15-c-ao", "visibility, supersampling blur")]
    {
        pictures.push(detail(&grey(&image.ao()?), at, window, 4, file, caption)?);
    }
    let marked = edges.map(|edge| if edge { 255u8 } else { 0 });
    pictures.push(detail(&marked, at, window, 4, "6.2.15-edges", "which pixels are edges")?);
    Ok(Figure {
        id: "6.2.15".into(),
        title: "Bleeding at edges, and the supersampling blur".into(),
        text: format!(
            "{}, with {} depth samples a pixel: {side}x{side} pixels where the two blurs differ most, enlarged.",
            subject.name,
            with.samples()
        ),
        pictures,
        ..Figure::default()
    })
}

/// Finds the window of `side` by `side` pixels that has the largest sum, on a grid of half its side, and returns its
/// lower left corner.
fn largest(image: &Image<f32>, side: usize) -> (usize, usize) {
    let step = (side / 2).max(1);
    let sum = |(left, bottom): &(usize, usize)| -> f32 {
        (0..side * side).map(|i| image.at(left + i % side, bottom + i / side)).sum()
    };
    let rows = (0..=image.height - side).step_by(step);
    let corners = rows.flat_map(|y| (0..=image.width - side).step_by(step).map(move |x| (x, y)));
    corners.max_by(|a, b| sum(a).total_cmp(&sum(b))).unwrap_or((0, 0))
}
