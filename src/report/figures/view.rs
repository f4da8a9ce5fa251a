//! The figure on `hbao-view`, which is not of 2008: what each of its changes does to the error of the chapter's method.

use super::picture::picture;
use crate::picture::AO;
use crate::report::figure::Figure;
use crate::report::lab::Lab;
use crate::report::subject::Subject;
use hbao::measure::table::Table;
use hbao::settings::{Exit, Method, Quadrature, Zenith};
use hbao::{Error, Settings};

/// The chapter's method, its variant with fewer steps, and the changes that lead to `hbao-view`, each added to those
/// before it.
fn changes(subject: &Subject) -> Vec<(&'static str, Settings)> {
    let view =
        |zenith, spacing, quadrature| Settings { zenith, spacing, quadrature, ..subject.exact(Method::HbaoView) };
    let fewer = |directions, steps| Settings { directions, steps, ..subject.exact(Method::HbaoView) };
    let own = Settings::for_method(Method::HbaoView);
    vec![
        ("hbao", subject.exact(Method::Hbao)),
        ("hbao --exit shorten", Settings { exit: Exit::Shorten, ..subject.exact(Method::Hbao) }),
        ("samples are rounded one by one, with an even tile", view(Zenith::Axis, 1.0, Quadrature::End)),
        ("the zenith is the view ray", view(Zenith::View, 1.0, Quadrature::End)),
        ("samples are denser near P", view(Zenith::View, own.spacing, Quadrature::End)),
        ("W is the mean over an interval", view(Zenith::View, own.spacing, Quadrature::Interval)),
        ("the weight is that expected between samples: hbao-view", subject.exact(Method::HbaoView)),
        ("hbao-view with 4 directions of 8 steps", fewer(4, 8)),
        ("hbao-view with 4 directions of 4 steps", fewer(4, 4)),
    ]
}

pub(super) fn beyond(lab: &Lab) -> Result<Figure, Error> {
    let subjects = lab.data_sets();
    let table = |blur: u32, caption: &str| -> Result<Table, Error> {
        let columns = subjects.iter().map(|subject| -> Result<Vec<String>, Error> {
            let rmse = |(_, settings): (_, Settings)| lab.errors(subject, &Settings { blur, ..settings });
            changes(subject).into_iter().map(|change| Ok(format!("{:.4}", rmse(change)?.rmse))).collect()
        });
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        let names = subjects.first().map_or_else(Vec::new, |subject| changes(subject));
        let row = |(i, (name, _)): (usize, &(&str, Settings))| {
            std::iter::once((*name).to_string()).chain(columns.iter().map(|column| column[i].clone())).collect()
        };
        let headings = std::iter::once("").chain(subjects.iter().map(|subject| subject.name.as_str()));
        Ok(Table::headed(headings).captioned(caption).filled(names.iter().enumerate().map(row).collect::<Vec<_>>()))
    };
    let church = lab.church();
    let mut pictures = Vec::new();
    for (method, file) in [(Method::Hbao, "view-chapter"), (Method::HbaoView, "view-view")] {
        let caption = format!("{}, {}", church.name, method.name());
        pictures.push(picture(lab, church, lab.size, &church.exact(method), &AO, file, &caption)?);
    }
    Ok(Figure {
        id: "hbao-view".into(),
        title: "Beyond the papers: hbao-view".into(),
        text: "The same depth and normals, and as many samples as the chapter's method takes, but about the view ray through \
               each pixel, denser near the pixel, and with a better weight for what lies between two samples. Each row up \
               to hbao-view adds a change to the row before it; the third row also has the depth sigma of this method's blur, R/16 \
               in place of R/4. The numbers are RMSE against rays, with 8 directions of 8 steps but in the \
               last two rows, and with float targets."
            .into(),
        pictures,
        tables: vec![table(0, "RMSE before the blur")?, table(9, "RMSE after the blur of 9x9")?],
        ..Figure::default()
    })
}
