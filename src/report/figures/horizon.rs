//! The figures of ShaderX7 6.2 on the method itself: attenuation and snapped directions.

use super::boundaries;
use super::picture::picture;
use crate::picture::{AO, COLOR, FINAL};
use crate::report::drawing;
use crate::report::figure::{Drawing, Figure};
use crate::report::lab::Lab;
use crate::report::scenes;
use hbao::reference::anatomy::Anatomy;
use hbao::settings::{Attenuation, Method, Radius, Snap};
use hbao::{Error, Settings};

pub(super) fn first_picture(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let settings = Settings { directions: 16, steps: 16, ..subject.settings(Method::Hbao) };
    let name = &subject.name;
    Ok(Figure {
        id: "6.2.1".into(),
        title: "Horizon-based ambient occlusion".into(),
        text: "The chapter's method: 16 directions of 16 steps, blur 9x9.".into(),
        pictures: vec![
            picture(lab, subject, lab.size, &settings, &FINAL, "6.2.1", &format!("{name}, times its colours"))?,
            picture(lab, subject, lab.size, &settings, &AO, "6.2.1-ao", &format!("{name}, visibility"))?,
            picture(lab, subject, lab.size, &settings, &COLOR, "6.2.1-color", &format!("{name}, without it"))?,
        ],
        ..Figure::default()
    })
}

pub(super) fn attenuation(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let with = subject.settings(Method::Hbao);
    let without = Settings { attenuation: Attenuation::None, ..with.clone() };
    Ok(Figure {
        id: "6.2.3".into(),
        title: "With and without attenuation".into(),
        text: "Without W occlusion ends abruptly where occluders come to lie further than R. The claim on attenuation measures \
               how much lower the steps are with it."
            .into(),
        pictures: vec![
            picture(lab, subject, lab.size, &without, &AO, "6.2.3-without", "without: W = 1")?,
            picture(lab, subject, lab.size, &with, &AO, "6.2.3-with", "with: W = 1 - (r/R)^2")?,
        ],
        drawings: vec![boundaries::profile(lab)?],
        ..Figure::default()
    })
}

pub(super) fn snapped_directions(lab: &Lab) -> Result<Figure, Error> {
    let (size, pixel) = ((160, 120), (80, 60));
    let wall = scenes::fold("wall", "wall", 0.0, size)?;
    let base = Settings { radius: Radius::Units(6.0), directions: 6, steps: 5, ..wall.exact(Method::Hbao) };
    let seen = lab.see(&wall, size, &base)?;
    let inputs = seen.inputs();
    let mut drawings = Vec::new();
    for (snap, caption) in [
        (Snap::Step, "the first offset and the step are rounded: every direction walks by whole texels, and bends off"),
        (Snap::Sample, "each sample is rounded by itself: the directions are kept"),
    ] {
        let settings = Settings { snap, ..base.clone() };
        let twin = Anatomy::new(&inputs, &settings)?;
        let directions: Vec<Vec<(f64, f64)>> = (0..settings.directions)
            .filter_map(|k| twin.slice(pixel, k))
            .map(|slice| {
                slice
                    .samples
                    .iter()
                    .filter(|sample| sample.found.is_some())
                    .map(|sample| (sample.taken.x, sample.taken.y))
                    .collect()
            })
            .collect();
        let [cos_a, sin_a, _] = hbao::rotation_tile(&settings).at(pixel.0 % 4, pixel.1 % 4).map(f64::from);
        let turn = sin_a.atan2(cos_a);
        drawings.push(Drawing {
            file: format!("6.2.10-{}.svg", snap.name()),
            caption: format!("snap = {}: {caption}", snap.name()),
            svg: drawing::texels(&directions, turn)?,
        });
    }
    Ok(Figure {
        id: "6.2.10".into(),
        title: "Snapped directions".into(),
        text: "The texels that one pixel of a wall reads, 6 directions of 5 steps; lines are the directions meant."
            .into(),
        drawings,
        ..Figure::default()
    })
}
