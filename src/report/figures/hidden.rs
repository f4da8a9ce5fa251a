//! The figure of ShaderX7 6.2 on points that lie above the height field and are hidden from P all the same.

use super::picture::{detail, grey};
use crate::report::figure::Figure;
use crate::report::lab::{Lab, Seen, to_world};
use crate::report::scenes;
use crate::report::subject::Subject;
use hbao::image::Image;
use hbao::measure::table::Table;
use hbao::reference::anatomy::{Anatomy, Point};
use hbao::reference::trace::Tracer;
use hbao::reference::truth::Truth;
use hbao::settings::{Method, Toggle};
use hbao::{Error, Request, Settings};

/// The size of the images. In a square picture the offsets of `ssao` fill a ball.
const SIZE: (u32, u32) = (384, 384);
/// The width and height of the pictures, which are cut from the middle of the images.
const SHOWN: usize = 96;

/// Counts, over these pixels, the points of `ssao` that lie in front of the height field, and those of them that a
/// surface hides from P. Returns the number of hidden points, then that of all.
pub(in crate::report) fn hidden_points(
    seen: &Seen,
    subject: &Subject,
    size: (u32, u32),
    settings: &Settings,
    pixels: &[(usize, usize)],
) -> Result<(usize, usize), Error> {
    let inputs = seen.inputs();
    let twin = Anatomy::new(&inputs, settings)?;
    let tracer = Tracer::new(&subject.mesh);
    let camera = subject.camera(size)?;
    let (mut hidden, mut open) = (0, 0);
    for &pixel in pixels {
        let (Some(p), Some(points)) = (twin.position(pixel), twin.points(pixel)) else { continue };
        let p = to_world(&camera, p);
        // Points whose surface the range check fades are left out, and those over background.
        let counted = |point: &&Point| point.open && point.surface.is_finite() && point.range <= 0.01;
        for point in points.iter().filter(counted) {
            open += 1;
            // The ray goes from the point to P, but stops short of P, which lies on a surface.
            let from = to_world(&camera, point.position);
            hidden += usize::from(tracer.nearest(from, p - from, 0.0..=0.999).is_some());
        }
    }
    Ok((hidden, open))
}

/// Returns the mean of an image over these pixels.
fn mean(image: &Image<f32>, pixels: &[(usize, usize)]) -> f64 {
    pixels.iter().map(|&(x, y)| f64::from(image.at(x, y))).sum::<f64>() / pixels.len().max(1) as f64
}

pub(super) fn hidden_sample(lab: &Lab) -> Result<Figure, Error> {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    let corner = ((width - SHOWN) / 2, (height - SHOWN) / 2);
    let (mut pictures, mut rows) = (Vec::new(), Vec::new());
    for subject in [scenes::pit(SIZE, false)?, scenes::pit(SIZE, true)?] {
        let ssao = Settings { ssao_normals: Toggle::On, ssao_curve: Some(Toggle::Off), ..subject.exact(Method::Ssao) };
        // The steps are shorter than the rim is thick.
        let hbao = Settings { directions: 16, steps: 16, ..subject.exact(Method::Hbao) };
        let seen = lab.see(&subject, SIZE, &ssao)?;
        let camera = subject.camera(SIZE)?;
        let inside = seen.pixels_where(&camera, scenes::on_floor_of_pit);
        let (hidden, open) = hidden_points(&seen, &subject, SIZE, &ssao, &inside)?;

        let shown = |i: usize| (corner.1 + i / SHOWN) * width + corner.0 + i % SHOWN;
        let shown: Vec<usize> = (0..SHOWN * SHOWN).map(shown).collect();
        let traced = Truth::new(&subject.mesh, &camera, (width, height), &hbao, lab.rays)?.trace(&shown, |_| ());
        let mut truth = Image::filled(width, height, 1.0f32);
        shown.iter().zip(&traced.visibility).for_each(|(&i, &a)| truth.texels[i] = a as f32);

        let image = |settings: &Settings| lab.render(&subject, SIZE, settings, Request::default())?.0.ao();
        let images = [("ssao", image(&ssao)?), ("hbao", image(&hbao)?), ("rays", truth)];
        let mut row = vec![subject.name.clone()];
        for (who, image) in &images {
            let a = mean(image, &inside);
            row.push(format!("{a:.3}"));
            let caption = format!("{who}, {}: visibility of the floor inside {a:.2}", subject.name);
            let file = format!("6.2.4-{}-{who}", subject.key);
            pictures.push(detail(&grey(image), corner, (SHOWN, SHOWN), 4, &file, &caption)?);
        }
        row.push(format!("{:.1} %", 100.0 * hidden as f64 / open.max(1) as f64));
        rows.push(row);
    }
    Ok(Figure {
        id: "6.2.4".into(),
        title: "Above the height field, and hidden all the same".into(),
        text: "A floor seen from above, with a square rim upright on it. What lies over the floor outside the rim is in \
               front of the depth image's surface, but the rim hides it from the floor inside. In the second scene the \
               rim is a block that leaves nothing free beyond it. Seen from the floor inside, the two scenes are the \
               same: rays and the horizon find the same visibility in both. Crysis' method finds more behind the thin \
               rim, because it counts the hidden points beyond it as open. All three reach equally far: R is the length \
               of the longest offset of ssao, more than the width of the floor inside, and the field of view of 90 \
               degrees makes the offsets fill a ball. ssao has normals here, so that flat surfaces are open, and no \
               curve. The claim on hidden points counts them in other scenes too."
            .into(),
        pictures,
        tables: vec![
            Table::headed(["scene", "ssao", "hbao", "rays", "open points of ssao that are hidden"])
                .captioned("Mean visibility of the floor inside")
                .filled(rows),
        ],
        ..Figure::default()
    })
}
