//! The figures of ShaderX7 6.1.

use super::picture::picture;
use crate::picture::AO;
use crate::report::figure::Figure;
use crate::report::lab::Lab;
use crate::report::scenes;
use crate::report::subject::Subject;
use hbao::measure::table::Table;
use hbao::scene::CORNELL_BOX;
use hbao::settings::{Jitter, Method, Toggle};
use hbao::{Error, Settings};

pub(super) fn game_scene(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sponza", "sibenik"]);
    let settings = subject.settings(Method::Ssao);
    let caption = format!("{}, visibility by ssao, 16 samples and its 4x4 blur", subject.name);
    Ok(Figure {
        id: "6.1.1".into(),
        title: "Crysis' ambient occlusion of a game scene".into(),
        text: "The paper shows a scene of the game, which nobody else has; this is another.".into(),
        pictures: vec![picture(lab, subject, lab.size, &settings, &AO, "6.1.1", &caption)?],
        ..Figure::default()
    })
}

/// Returns the share of the space around a point in the middle of a fold that `ssao` finds to be free, before the curve
/// and the blur.
pub(in crate::report) fn open_share(lab: &Lab, subject: &Subject) -> Result<f64, Error> {
    let settings = Settings { ssao_curve: Some(Toggle::Off), blur: 0, ..subject.exact(Method::Ssao) };
    let image = lab.ao(subject, &settings)?;
    // Of the 4x4 pixels around the middle, each uses another texel of the rotation tile.
    let (x, y) = (image.width / 2, image.height / 2);
    let window = (0..16).map(|i| f64::from(image.at((x + i % 4).saturating_sub(2), (y + i / 4).saturating_sub(2))));
    Ok(window.sum::<f64>() / 16.0)
}

pub(super) fn scenarios(lab: &Lab) -> Result<Figure, Error> {
    let (mut pictures, mut rows) = (Vec::new(), Vec::new());
    for (subject, solid) in &scenes::folds(lab.size)? {
        let settings = Settings { ssao_curve: Some(Toggle::Off), ..subject.settings(Method::Ssao) };
        let caption = format!("{}: open share, without the curve A^2 + A", subject.name);
        let file = format!("6.1.4-{}", subject.key);
        pictures.push(picture(lab, subject, lab.small(), &settings, &AO, &file, &caption)?);
        rows.push(vec![subject.name.clone(), format!("{solid:.2}"), format!("{:.3}", 1.0 - open_share(lab, subject)?)]);
    }
    Ok(Figure {
        id: "6.1.4".into(),
        title: "Wall, corner and edge".into(),
        text: "The solid share of the space about a point on a wall, in a corner of two walls, and on an edge of two \
               faces, each at right angles."
            .into(),
        pictures,
        tables: vec![Table::headed(["scene", "paper", "found"]).captioned("Solid share").filled(rows)],
        ..Figure::default()
    })
}

pub(super) fn edges(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&[CORNELL_BOX]);
    let brighter = subject.settings(Method::Ssao);
    let by_normals = Settings { ssao_normals: Toggle::On, ..brighter.clone() };
    Ok(Figure {
        id: "6.1.5".into(),
        title: "Edges brighter than the faces they join".into(),
        text:
            "The paper leaves them so, since they help to recognize shapes. With normals, which it proposes as future \
               work, half of the samples are no longer behind the surface, and flat faces are open. The curve A^2 + A is \
               off then, since with it everything from A = 0.618 on would be white."
                .into(),
        pictures: vec![
            picture(lab, subject, lab.size, &brighter, &AO, "6.1.5", "ssao as in Crysis")?,
            picture(lab, subject, lab.size, &by_normals, &AO, "6.1.5-normals", "ssao with normals")?,
        ],
        ..Figure::default()
    })
}

pub(super) fn without_rotation(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sponza", "sibenik"]);
    let settings = Settings { jitter: Jitter::None, blur: 0, ..subject.settings(Method::Ssao) };
    Ok(Figure {
        id: "6.1.6".into(),
        title: "Without random rotation of the kernel".into(),
        text: "Sixteen samples at the same offsets for all pixels: shapes are seen again as ghosts beside themselves."
            .into(),
        pictures: vec![picture(
            lab,
            subject,
            lab.size,
            &settings,
            &AO,
            "6.1.6",
            &format!("{}, 16 samples, no rotation, no blur", subject.name),
        )?],
        ..Figure::default()
    })
}

pub(super) fn blur(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sponza", "sibenik"]);
    let on = subject.settings(Method::Ssao);
    let off = Settings { blur: 0, ..on.clone() };
    Ok(Figure {
        id: "6.1.7".into(),
        title: "The 4x4 blur off and on".into(),
        text: "Rotations repeat every 4x4 pixels, so that a mean over 4x4 pixels of like depth meets each once.".into(),
        pictures: vec![
            picture(lab, subject, lab.size, &off, &AO, "6.1.7-off", "blur off")?,
            picture(lab, subject, lab.size, &on, &AO, "6.1.7-on", "blur on")?,
        ],
        ..Figure::default()
    })
}
