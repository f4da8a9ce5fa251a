//! The figure on what ambient occlusion darkens: the whole colour, or the ambient light alone (ShaderX7 6.2, Combining
//! with the color buffer).

use super::picture::picture;
use crate::picture::{self, COLOR, FINAL, FileFormat};
use crate::report::figure::{Figure, Picture};
use crate::report::lab::Lab;
use crate::report::subject::Subject;
use hbao::image::{Image, metadata};
use hbao::measure::table::Table;
use hbao::settings::Method;
use hbao::{Apply, Error, Request, Settings};

/// Renders the final picture with ambient occlusion applied to ambient light alone.
fn on_ambient_light(
    lab: &Lab,
    subject: &Subject,
    settings: &Settings,
    file: &str,
    caption: &str,
) -> Result<Picture, Error> {
    let whole = picture(lab, subject, lab.size, settings, &FINAL, file, caption)?;
    let (pipeline, _) = lab.render(subject, lab.size, settings, picture::request([&FINAL], Apply::Ambient))?;
    let png = FINAL.encode(&pipeline, settings, FileFormat::Png, &metadata(&settings.to_toml()))?;
    let command = whole.command.map(|command| command.replace(" --show final", " --show final --apply ambient"));
    Ok(Picture { png, command, ..whole })
}

/// Returns the mean of the three colours over the pixels where the mask is true.
fn brightness(image: &Image<[u8; 3]>, mask: &Image<bool>) -> f64 {
    let pixels = || image.texels.iter().zip(&mask.texels).filter(|(_, inside)| **inside);
    let sum: f64 = pixels().map(|(rgb, _)| rgb.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0).sum();
    sum / pixels().count().max(1) as f64
}

pub(super) fn applied(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.church();
    let settings = subject.settings(Method::Hbao);
    let mut rows = Vec::new();
    for subject in lab.data_sets() {
        let settings = subject.settings(Method::Hbao);
        let covered = lab.see(subject, lab.small(), &settings)?.covered();
        let mut row = vec![subject.name.clone()];
        for apply in [Apply::All, Apply::Ambient] {
            let request = Request { composite: Some(apply), ..Request::default() };
            let (pipeline, _) = lab.render(subject, lab.small(), &settings, request)?;
            let shown = pipeline.composite()?.ok_or_else(|| Error::Usage("the final image was not kept".into()))?;
            let left = brightness(&shown, &covered) / brightness(&pipeline.colour()?, &covered).max(f64::MIN_POSITIVE);
            row.push(format!("{:.1} %", 100.0 * (1.0 - left)));
        }
        rows.push(row);
    }
    let name = &subject.name;
    Ok(Figure {
        id: "apply".into(),
        title: "Over all light, or over ambient light alone".into(),
        text: "The chapter finds that ambient occlusion makes the most sense as a shadow of ambient light, since it has no \
               cosine terms, and still multiplies it over the full colours in its own results, direct light included. Here \
               are both. Of the colour of a surface that faces the light, 40 % is ambient; a surface that is turned away \
               from the light has ambient light only, and the two pictures are the same there. Which is better is a matter \
               of taste, and no claim is made of it."
            .into(),
        pictures: vec![
            picture(lab, subject, lab.size, &settings, &FINAL, "apply-all", &format!("{name}, over all light"))?,
            on_ambient_light(lab, subject, &settings, "apply-ambient", &format!("{name}, over ambient light alone"))?,
            picture(lab, subject, lab.size, &settings, &COLOR, "apply-none", &format!("{name}, without it"))?,
        ],
        tables: vec![
            Table::headed(["scene", "over all light", "over ambient light"])
                .captioned("What ambient occlusion takes of the brightness of the surfaces, on average")
                .filled(rows),
        ],
        ..Figure::default()
    })
}
