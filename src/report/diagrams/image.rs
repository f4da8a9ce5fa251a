//! The diagrams of the way to the image: Figures 6.2.11 and 6.2.12, and the talk's Figure 2c.

use super::Diagram;
use super::canvas::Canvas;
use super::horizon::Rising;
use super::section::degrees;
use super::specimen::{self, RADIUS, View};
use crate::report::figure::{Drawing, Figure};
use crate::report::lab::Lab;
use glam::{DVec2, DVec3, dvec2};
use hbao::Error;
use hbao::settings::{Method, Radius, Snap};

/// Where the image plane is drawn, as a share of the way to P.
const IMAGE: f64 = 0.45;

/// Figure 6.2.11: R projected to the image.
pub(super) fn projected_radius(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let (anatomy, subject) = (rising.view.anatomy()?, specimen::scene(lab));
    let Some(start) = anatomy.start(rising.place.pixel) else {
        return Ok(Diagram::Missing("6.2.11", "a surface"));
    };
    let [_, half] = subject.camera(specimen::SIZE)?.projection.half_extents();
    // Depth runs to the right, and y up.
    let (z, y, radius) = (start.P.z, start.P.y, RADIUS);
    let place = |z: f64, y: f64| dvec2(z, y);
    let mut canvas = Canvas::new(720.0, 460.0, dvec2(-0.06 * z, -half * z * 1.05), dvec2(1.2 * z, half * z * 1.05));
    for side in [-1.0, 1.0] {
        canvas.line("dg-thin", DVec2::ZERO, place(1.12 * z, side * half * 1.12 * z));
    }
    canvas.arrow("dg-thin", DVec2::ZERO, place(1.16 * z, 0.0));
    let image = |y: f64| place(IMAGE * z, IMAGE * y);
    canvas.line("dg-ink", image(-half * z), image(half * z));
    canvas.line("dg-blue dg-dash", DVec2::ZERO, place(z, y));
    canvas.line("dg-blue dg-dash", DVec2::ZERO, place(z, y + radius));
    canvas.arrow("dg-red", place(z, y), place(z, y + radius));
    canvas.arrow("dg-red", image(y), image(y + radius));
    let steps = start.steps + 1;
    for i in 0..=steps {
        let at = image(y + radius * f64::from(i) / f64::from(steps));
        canvas.line("dg-red", at, at + dvec2(canvas.pixels(7.0), 0.0));
    }
    canvas.dot("dg-mark", DVec2::ZERO, 4.5);
    canvas.dot("dg-mark", place(z, y), 4.5);
    let (share, height) = (start.radius_px.y / f64::from(specimen::SIZE.1), f64::from(specimen::SIZE.1));
    canvas.label(DVec2::ZERO, 90.0, "eye");
    canvas.label(place(z, y), -60.0, "P");
    canvas.label(place(z, y + radius / 2.0), 0.0, format!("R = {radius:.0}"));
    canvas.label(image(half * z), 90.0, format!("image, {height:.0} texels high"));
    canvas.label(image(y + radius / 2.0), 180.0, format!("{:.1} texels", start.radius_px.y));
    canvas.label(place(0.75 * z, 0.0), 90.0, format!("P.z = {z:.1}"));
    canvas.label(place(0.16 * z, 0.0), 0.0, format!("fov_y = {:.1}°", 2.0 * half.atan().to_degrees()));
    Ok(Diagram::Drawn(Figure {
        id: "6.2.11".into(),
        title: "The radius of influence projected into the image".into(),
        text: format!(
            "{}, seen from the side in true proportions; the image plane may be drawn at any depth.",
            rising.words(lab)
        ),
        drawings: vec![Drawing {
            file: "6.2.11.svg".into(),
            caption: format!(
                "By similar triangles R = {radius:.0} at P.z = {z:.1} covers R_uv / 2 = {share:.4} of the image's height, with f = \
                 cot(fov_y/2) = {:.4}: {:.2} texels. N_s + 1 = {steps} steps divide it, each {:.2} texels long.",
                1.0 / half,
                start.radius_px.y,
                start.step_px.y
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Figure 6.2.12: the tangent of a step, by a ray that meets the tangent plane.
pub(super) fn tangent_by_ray(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let (anatomy, pixel) = (rising.view.anatomy()?, rising.place.pixel);
    let drawn = anatomy.slice(pixel, rising.place.k).and_then(|slice| {
        let offset = slice.stride * f64::from(rising.view.settings.steps);
        Some((anatomy.start(pixel)?, offset, anatomy.tangent_by_ray(pixel, offset)?, anatomy.tangent(pixel, offset)?))
    });
    let Some((start, offset, cast, linear)) = drawn else {
        return Ok(Diagram::Missing("6.2.12", "a ray that meets the tangent plane"));
    };
    // The plane of the eye and the two rays: the way to P runs to the right.
    let ahead = start.P.normalize_or_zero();
    let aside = (cast - ahead * cast.dot(ahead)).normalize_or_zero();
    let from_eye = |p: DVec3| dvec2(p.dot(ahead), p.dot(aside));
    let (p, end) = (from_eye(start.P), from_eye(start.P + cast));
    let far = p.x.max(end.x);
    let along = (end - p).normalize_or_zero();
    let wide = (end - p).length();
    let high = 2.2 * (end - p).y.abs().max(0.15 * far);
    let mut canvas = Canvas::new(720.0, 270.0, dvec2(-0.05 * far, -0.4 * high), dvec2(1.12 * far, 0.6 * high));
    canvas.line("dg-surface", p - 0.5 * wide * along, end + 0.35 * wide * along);
    for at in [p, end] {
        canvas.line("dg-blue dg-dash", DVec2::ZERO, at);
    }
    let [low, top] = [-0.3 * high, 0.5 * high].map(|y| dvec2(IMAGE * p.x, y));
    canvas.line("dg-ink", low, top);
    let [uv, next] = [p, end].map(|at| at * (IMAGE * p.x / at.x));
    canvas.arrow("dg-red", uv, next);
    canvas.arrow("dg-red", p, end);
    let normal = dvec2(start.normal.dot(ahead), start.normal.dot(aside));
    canvas.arrow("dg-green", p, p + 0.5 * wide.max(0.1 * far) * normal);
    for at in [DVec2::ZERO, p, end, uv, next] {
        canvas.dot("dg-mark", at, 4.0);
    }
    canvas.label(DVec2::ZERO, 90.0, "eye");
    canvas.label(p, -90.0, "P");
    canvas.label((p + end) / 2.0, 0.0, "T");
    canvas.label(p + 0.5 * wide.max(0.1 * far) * normal, 180.0, "n");
    canvas.label((uv + next) / 2.0, 180.0, format!("Δuv: {}, {} texels", offset.x, offset.y));
    canvas.label(top, 0.0, "image plane");
    canvas.label(end + 0.35 * wide * along, 90.0, "tangent plane");
    let sine = |t: DVec3| -t.z / t.length();
    Ok(Diagram::Drawn(Figure {
        id: "6.2.12".into(),
        title: "The tangent vector of a step in the image".into(),
        text: format!("{}, in the plane of the eye and two rays, in true proportions.", rising.words(lab)),
        drawings: vec![Drawing {
            file: "6.2.12.svg".into(),
            caption: format!(
                "The ray through the texel at P plus {} steps of the direction meets the tangent plane {:.1} from P. T leads from P \
                 to that point, and rises by {} towards the eye. Eq. 6.2.11, by which the method computes T, gives {}.",
                rising.view.settings.steps,
                cast.length(),
                degrees(sine(cast)),
                degrees(sine(linear))
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// The talk's Figure 2c: the samples of 4 directions with a step of 2 texels. `None` on background.
pub(super) fn sample_locations(lab: &Lab, rising: &Rising) -> Result<Option<Drawing>, Error> {
    const STEP: f64 = 2.0;
    const STEPS: u32 = 4;
    let pixel = rising.place.pixel;
    let Some(start) = rising.view.anatomy()?.start(pixel) else { return Ok(None) };
    // R at which a step is 2 texels long.
    let radius = RADIUS * STEP * f64::from(STEPS + 1) / start.radius_px.y;
    let view = View::new(lab, Method::HbaoTalk, |settings| {
        settings.radius = Radius::Units(radius);
        (settings.directions, settings.steps, settings.snap) = (4, STEPS, Snap::Sample);
    })?;
    let anatomy = view.anatomy()?;
    let Some(start) = anatomy.start(pixel) else { return Ok(None) };
    let slices: Vec<_> = (0..view.settings.directions).filter_map(|k| anatomy.slice(pixel, k)).collect();
    let reach = 10.5;
    let mut canvas = Canvas::new(440.0, 440.0, DVec2::splat(-reach), DVec2::splat(reach));
    let square =
        |middle: DVec2| [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| middle + dvec2(x, y));
    for sample in slices.iter().flat_map(|slice| &slice.samples) {
        canvas.area("dg-wedge", &square(sample.taken));
    }
    canvas.area("dg-solid", &square(DVec2::ZERO));
    for i in -11..=11 {
        let edge = f64::from(i) - 0.5;
        canvas.line("dg-thin", dvec2(edge, -reach), dvec2(edge, reach));
        canvas.line("dg-thin", dvec2(-reach, edge), dvec2(reach, edge));
    }
    for slice in &slices {
        canvas.line("dg-blue", DVec2::ZERO, 1.1 * STEP * f64::from(STEPS + 1) * slice.direction);
        for sample in &slice.samples {
            canvas.dot("dg-hollow", sample.meant, 3.5);
            canvas.dot("dg-mark-red", sample.taken, 3.5);
        }
    }
    canvas.dot("dg-mark", DVec2::ZERO, 4.5);
    let [cos_a, sin_a, b] = start.jitter;
    Ok(Some(Drawing {
        file: "talk-2-c.svg".into(),
        caption: format!(
            "(c) The samples of 4 directions around the pixel in the middle. With R = {radius:.2} a step is {:.2} texels long. The \
             tile turns the directions by {:.1}° and shifts the samples by {b:.2} of a step: hollow dots. Each is snapped to the centre \
             of its texel: filled dots.",
            start.step_px.y,
            sin_a.atan2(cos_a).to_degrees()
        ),
        svg: canvas.finish(),
    }))
}
