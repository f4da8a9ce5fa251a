//! The figures that show results: sample counts, shading, and the methods beside each other.

use super::picture::picture;
use crate::picture::{AO, COLOR, FINAL};
use crate::report::figure::Figure;
use crate::report::lab::Lab;
use crate::report::subject::Subject;
use hbao::scene::CORNELL_BOX;
use hbao::settings::{Attenuation, Method};
use hbao::{Error, Settings};

pub(super) fn sample_counts(lab: &Lab) -> Result<Figure, Error> {
    let views = ["sibenik", "sibenik-choir", "dragon"].map(|key| lab.subject(key));
    let mut views: Vec<&Subject> = views.into_iter().flatten().collect();
    if views.is_empty() {
        views = lab.data_sets();
    }
    let mut pictures = Vec::new();
    for subject in views {
        for (count, blur) in [(4, 21), (8, 15), (16, 9)] {
            let settings = Settings { directions: count, steps: count, blur, ..subject.settings(Method::Hbao) };
            let caption = format!("{}, {count}/{count}, blur {blur}x{blur}", subject.name);
            let file = format!("6.2.16-{}-{count}", subject.key);
            pictures.push(picture(lab, subject, lab.size, &settings, &AO, &file, &caption)?);
        }
    }
    Ok(Figure {
        id: "6.2.16".into(),
        title: "4/4, 8/8 and 16/16 directions and steps".into(),
        text: "The blur shrinks as the samples grow. Where a step is below a texel, far away and with many steps, the \
               chapter's early exit leaves surfaces open."
            .into(),
        pictures,
        ..Figure::default()
    })
}

pub(super) fn dragon(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", CORNELL_BOX]);
    let settings = subject.settings(Method::Hbao);
    Ok(Figure {
        id: "6.2.17".into(),
        title: "Diffuse shading, ambient occlusion, and both".into(),
        text: format!("{}.", subject.name),
        pictures: vec![
            picture(lab, subject, lab.size, &settings, &COLOR, "6.2.17-diffuse", "diffuse shading")?,
            picture(lab, subject, lab.size, &settings, &AO, "6.2.17-ao", "visibility")?,
            picture(lab, subject, lab.size, &settings, &FINAL, "6.2.17-final", "both")?,
        ],
        ..Figure::default()
    })
}

pub(super) fn talk(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", "sibenik"]);
    let horizons = subject.settings(Method::HbaoTalk);
    // The talk attenuates both linearly.
    let rays = Settings { attenuation: Attenuation::Linear, ..subject.settings(Method::RayMarch) };
    Ok(Figure {
        id: "talk-1".into(),
        title: "The talk's Figure 1: horizons and ray marching".into(),
        text: "8 directions of 8 steps; ray marching with 4 rays a direction. The section Tables has their speeds."
            .into(),
        pictures: vec![
            picture(lab, subject, lab.size, &horizons, &AO, "talk-1-hbao", "horizons (hbao-talk)")?,
            picture(lab, subject, lab.size, &rays, &AO, "talk-1-ray-march", "ray marching, 4 rays a direction")?,
        ],
        ..Figure::default()
    })
}

pub(super) fn methods(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let mut pictures = Vec::new();
    for &method in Method::ALL.iter().filter(|method| method.computes()) {
        let name = method.name();
        let settings = subject.settings(method);
        pictures.push(picture(lab, subject, lab.small(), &settings, &AO, &format!("method-{name}"), name)?);
    }
    Ok(Figure {
        id: "methods".into(),
        title: "Every method side by side".into(),
        text: format!("{}, each with its own defaults.", subject.name),
        pictures,
        ..Figure::default()
    })
}
