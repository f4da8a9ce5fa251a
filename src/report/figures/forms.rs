//! The figure on the two forms of ambient occlusion that ShaderX7 6.2 defines: with the cosine (Eq. 6.2.1) and without
//! it (Eq. 6.2.2).

use super::picture::grey;
use crate::report::figure::{Figure, Picture};
use crate::report::lab::{Lab, compare};
use hbao::image::{metadata, png};
use hbao::measure::TruthImage;
use hbao::measure::table::Table;
use hbao::reference::truth::{Truth, Weight};
use hbao::settings::{Attenuation, Method};
use hbao::{Error, Settings};

pub(super) fn two_forms(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.church();
    const QUARTER: u32 = 4;
    // The rays of every pixel are traced, so the pictures have a quarter of the report's width and height. The page
    // shows them as large as the others.
    let size = (lab.size.0.div_ceil(QUARTER), lab.size.1.div_ceil(QUARTER));
    let open = |attenuation| Settings { attenuation, ..subject.settings(Method::Hbao) };
    let camera = subject.camera(size)?;
    let (width, height) = (size.0 as usize, size.1 as usize);
    let all: Vec<usize> = (0..width * height).collect();
    let mut pictures = Vec::new();
    for (weight, name, equation) in [(Weight::Uniform, "uniform", "6.2.2"), (Weight::Cosine, "cosine", "6.2.1")] {
        let truth = Truth::new(&subject.mesh, &camera, (width, height), &open(Attenuation::None), lab.rays)?;
        let traced = truth.weighted(weight).trace(&all, |_| ());
        let file = format!("forms-{name}.png");
        pictures.push(Picture {
            caption: format!("{}, rays: {name} (Eq. {equation})", subject.name),
            png: png::encode(&grey(&TruthImage::new(&traced, size).visibility), &metadata(""))?,
            size: (width, height),
            enlarged: QUARTER as usize,
            command: subject.arguments.as_ref().map(|arguments| {
                format!(
                    "hbao truth {arguments} --size {}x{} --truth-rays {} --attenuation none --weight {name} -o {file}",
                    size.0, size.1, lab.rays
                )
            }),
            file,
        });
    }
    let mut rows = Vec::new();
    for subject in lab.data_sets() {
        for (attenuation, name) in [(Attenuation::None, "1"), (Attenuation::Quadratic, "1 - (r/R)\u{b2}")] {
            let settings = Settings { attenuation, ..subject.exact(Method::Hbao) };
            let uniform = lab.truth(subject, &settings)?;
            let cosine = lab.truth_weighted(subject, &settings, Weight::Cosine)?;
            let apart = compare(&cosine.visibility, &uniform.visibility, &uniform.mask)?;
            let hbao = lab.ao(subject, &settings)?;
            let against = |truth: &crate::report::lab::Traced| compare(&hbao, &truth.visibility, &truth.mask);
            rows.push(vec![
                subject.name.clone(),
                name.into(),
                format!("{:.4}", apart.rmse),
                format!("{:+.4}", apart.bias),
                format!("{:.4}", apart.max),
                format!("{:.4}", against(&uniform)?.rmse),
                format!("{:.4}", against(&cosine)?.rmse),
            ]);
        }
    }
    Ok(Figure {
        id: "forms".into(),
        title: "With the cosine, and without it".into(),
        text: "The chapter starts from ambient occlusion in which a direction counts by the cosine of its angle to the normal \
               (Eq. 6.2.1, diffuse reflection of ambient light), and then computes the form in which all directions count \
               the same (Eq. 6.2.2 and 6.2.3, the shadow of an environment light). Both are traced here on the triangles. \
               What stands low over a surface counts less with the cosine, so that most of a scene is lighter."
            .into(),
        pictures,
        tables: vec![
            Table::headed(["scene", "W", "RMS apart", "cosine less uniform", "most", "hbao, uniform", "hbao, cosine"])
                .captioned("How far the two forms are apart, and the RMSE of hbao against each")
                .filled(rows)
                .noted(["hbao has its default counts and blur, and float targets. The noise of the rays is in each number; it \
                         is at the head of this page."
                    .into()]),
        ],
        ..Figure::default()
    })
}
