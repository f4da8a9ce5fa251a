//! The figures of ShaderX7 6.2 on creases and the angle bias.

use super::picture::picture;
use crate::picture::AO;
use crate::report::drawing::{self, Axes};
use crate::report::figure::{Drawing, Figure};
use crate::report::lab::Lab;
use crate::report::scenes::{self, BIAS_DEGREES, FACETS};
use hbao::settings::{Jitter, Method, Radius};
use hbao::{Error, Request, Settings};

pub(super) fn low_tessellation(lab: &Lab) -> Result<Figure, Error> {
    let vault = scenes::vault(FACETS, false)?;
    let settings =
        |bias: f64| Settings { bias: bias.to_radians(), directions: 16, steps: 16, ..vault.settings(Method::Hbao) };
    let biased = format!("bias {BIAS_DEGREES} degrees");
    Ok(Figure {
        id: "6.2.13".into(),
        title: "Creases of low tessellation".into(),
        text: format!("The inside of a round vault of {FACETS} flat strips, which meet at {} degrees.", 180 / FACETS),
        pictures: vec![
            picture(lab, &vault, lab.small(), &settings(0.0), &AO, "6.2.13-a", "bias 0")?,
            picture(lab, &vault, lab.small(), &settings(BIAS_DEGREES), &AO, "6.2.13-b", &biased)?,
        ],
        ..Figure::default()
    })
}

pub(super) fn angle_bias(lab: &Lab) -> Result<Figure, Error> {
    let (size, beside) = ((320, 240), (161, 120));
    let mut series = Vec::new();
    for bias in [0.0, 15.0, 30.0, 45.0f64] {
        let mut points = Vec::new();
        for degrees in (0..=90).step_by(6) {
            // Both faces rise by half of the angle, so that each rises over the plane of the other by the whole angle.
            let subject = scenes::fold("fold", "fold", -f64::from(degrees).to_radians() / 2.0, size)?;
            let settings = Settings {
                radius: Radius::Units(12.0),
                bias: bias.to_radians(),
                directions: 16,
                steps: 16,
                jitter: Jitter::None,
                blur: 0,
                ..subject.exact(Method::Hbao)
            };
            let image = lab.render(&subject, size, &settings, Request::default())?.0.ao()?;
            points.push((f64::from(degrees), 1.0 - f64::from(image.at(beside.0, beside.1))));
        }
        series.push((format!("bias {bias}\u{b0}"), points));
    }
    let axes = Axes {
        x: "angle by which one face rises over the other's plane, degrees",
        y: "occlusion 1 - A beside the crease",
        logarithmic: false,
    };
    Ok(Figure {
        id: "6.2.14".into(),
        title: "What an angle bias ignores".into(),
        text: "Two faces that meet in a crease: occlusion one pixel beside it, by the angle between them. Directions whose \
               horizon rises over the tangent by less than the bias add nothing, and the others less."
            .into(),
        drawings: vec![Drawing {
            file: "6.2.14.svg".into(),
            caption: "occlusion beside a crease".into(),
            svg: drawing::lines(&series, &axes)?,
        }],
        ..Figure::default()
    })
}
