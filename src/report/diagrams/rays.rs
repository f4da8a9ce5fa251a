//! The diagrams of rays and points about P: Figures 6.1.2, 6.1.3, 6.2.2 and 6.2.5.

use super::Diagram;
use super::canvas::Canvas;
use super::horizon::{DRAWN, Rising};
use super::section::{ground, index, profile};
use super::specimen::{self, RADIUS, View};
use crate::report::figure::{Drawing, Figure};
use crate::report::lab::{Lab, to_world};
use glam::{DVec2, DVec3, dvec2};
use hbao::Error;
use hbao::reference::anatomy::{Ray, RayStep};
use hbao::reference::trace::Tracer;
use hbao::settings::{Method, Toggle};
use std::f64::consts::PI;

/// The number of rays of Figure 6.1.2, and of each half of 6.2.2.
const RAYS: u32 = 16;

/// Figure 6.1.2: rays from P, traced on the triangles.
pub(super) fn traced(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let (subject, anatomy) = (specimen::scene(lab), rising.view.anatomy()?);
    let section = rising.section(&anatomy);
    let tangent = section.as_ref().and_then(|s| anatomy.tangent(rising.place.pixel, s.slice.stride));
    let (Some(section), Some(tangent)) = (section, tangent) else {
        return Ok(Diagram::Missing("6.1.2", "a tangent"));
    };
    let camera = subject.camera(specimen::SIZE)?;
    let tracer = Tracer::new(&subject.mesh);
    // The rays lie in the plane of P, the tangent and the eye, in which the depth image was cut.
    let p = section.start.P;
    let along = tangent.normalize_or_zero();
    let up = (-p - along * (-p).dot(along)).normalize_or_zero();
    let mut canvas = Canvas::new(680.0, 440.0, dvec2(-1.35, -0.75), dvec2(1.35, 1.15));
    section.surface(&mut canvas);
    let mut hits = 0;
    for i in 0..RAYS {
        let angle = (f64::from(i) + 0.5) * PI / f64::from(RAYS);
        let way = angle.cos() * along + angle.sin() * up;
        let from = to_world(&camera, p);
        // The start is a little in front of P, which lies on a surface.
        let hit = tracer.nearest(from, camera.direction_to_world(way * RADIUS), 1e-4..=1.0);
        let length = hit.map_or(1.0, |hit| hit.t) * RADIUS;
        let end = section.at(length * way);
        if hit.is_some() {
            hits += 1;
            canvas.line("dg-ink", DVec2::ZERO, end);
            canvas.dot("dg-mark", end, 3.5);
        } else {
            canvas.arrow("dg-red", DVec2::ZERO, end);
        }
    }
    section.sphere(&mut canvas);
    Ok(Diagram::Drawn(Figure {
        id: "6.1.2".into(),
        title: "Rays from a point into the space around it".into(),
        text: format!("{}. {DRAWN}", rising.words(lab)),
        drawings: vec![Drawing {
            file: "6.1.2.svg".into(),
            caption: format!(
                "{RAYS} rays from P = ({:.1}, {:.1}, {:.1}) in one plane, traced on the triangles up to R = {:.0}. The {hits} \
                 dark rays that end in a dot meet a surface; the {} red arrows meet none.",
                p.x,
                p.y,
                p.z,
                RADIUS,
                RAYS - hits
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Figure 6.1.3: the points of `ssao`.
pub(super) fn solid(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let view = View::new(lab, Method::Ssao, |settings| settings.ssao_curve = Some(Toggle::Off))?;
    let (anatomy, pixel) = (view.anatomy()?, rising.place.pixel);
    let hbao = rising.view.anatomy()?;
    let heading = rising.section(&hbao).map(|s| s.slice.direction);
    let drawn = heading.and_then(|heading| Some((heading, anatomy.position(pixel)?, anatomy.points(pixel)?)));
    let Some((heading, p, points)) = drawn else { return Ok(Diagram::Missing("6.1.3", "a surface")) };
    let at = |d: DVec3| dvec2(d.truncate().dot(heading), -d.z);
    let surface = |point: &hbao::reference::anatomy::Point| {
        let place = at(point.position - p);
        dvec2(place.x, p.z - point.surface.min(1e9))
    };
    let reach = points.iter().map(|point| at(point.position - p).abs().max_element()).fold(0.0, f64::max) * 1.2;
    let mut canvas = Canvas::new(680.0, 560.0, DVec2::splat(-reach), DVec2::splat(reach));
    let profile = profile(&anatomy, pixel, heading).unwrap_or_default();
    ground(&mut canvas, &profile, p, &at);
    for point in &points {
        let (place, seen) = (at(point.position - p), surface(point));
        canvas.line("dg-thin dg-dash", place, seen);
        let half = dvec2(canvas.pixels(6.0), 0.0);
        canvas.line("dg-blue", seen - half, seen + half);
    }
    for point in &points {
        canvas.dot(if point.open { "dg-hollow" } else { "dg-mark-red" }, at(point.position - p), 4.5);
    }
    canvas.dot("dg-mark", DVec2::ZERO, 4.5);
    canvas.label(DVec2::ZERO, -90.0, "P");
    // The farthest point of each kind tells what it is.
    let far = |open: bool| {
        let kind = points.iter().filter(|point| point.open == open).map(|point| at(point.position - p));
        kind.reduce(|a, b| if b.length() > a.length() { b } else { a })
    };
    for (open, name) in [(true, "in front: free"), (false, "behind: solid")] {
        if let Some(place) = far(open) {
            canvas.label(place, 0.0, name);
        }
    }
    let solid = points.iter().filter(|point| !point.open).count();
    let a = anatomy.visibility(pixel).unwrap_or(1.0);
    Ok(Diagram::Drawn(Figure {
        id: "6.1.3".into(),
        title: "The amount of solid geometry around a point".into(),
        text: format!(
            "{}, by ssao. Points stand at their distance from P along the direction across, and towards the eye. Grey is what \
             lies behind the depth image along that direction.",
            rising.words(lab)
        ),
        drawings: vec![Drawing {
            file: "6.1.3.svg".into(),
            caption: format!(
                "{} points about P, up to {:.0} away from it. A dashed line leads from each to the depth that the image holds at \
                 its texel, a blue mark; points lie beside the direction too, so that this need not be the surface drawn. \
                 The {solid} filled points lie behind that depth, inside of something; the {} hollow ones lie in front. With the \
                 depth range check the open share is {a:.4}.",
                points.len(),
                points.iter().map(|point| point.position.distance(p)).fold(0.0, f64::max),
                points.len() - solid
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Figure 6.2.2: rays of `ray-march` over the hemisphere about the normal.
pub(super) fn hemisphere(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let view = View::new(lab, Method::RayMarch, |settings| settings.rays = RAYS / 2)?;
    let (anatomy, pixel, half) = (view.anatomy()?, rising.place.pixel, view.settings.directions / 2);
    let stopped = |j: u32| anatomy.rays(pixel, j).unwrap_or_default().iter().filter(|ray| ray.weight.is_some()).count();
    // Two azimuths that are opposite to each other, of which the first has the most occlusion.
    let j = (0..view.settings.directions).max_by_key(|&j| (stopped(j), std::cmp::Reverse(j))).unwrap_or(0);
    let both = [j, (j + half) % view.settings.directions].map(|j| anatomy.rays(pixel, j).unwrap_or_default());
    let Some(normal) =
        anatomy.start(pixel).map(|start| start.normal).filter(|_| both.iter().all(|rays| !rays.is_empty()))
    else {
        return Ok(Diagram::Missing("6.2.2", "a surface"));
    };
    let lowest = both[0][0].direction;
    let azimuth = (lowest - normal * lowest.dot(normal)).normalize_or_zero();
    let mut canvas = Canvas::new(680.0, 420.0, dvec2(-1.5, -0.15), dvec2(1.5, 1.35));
    let [low, high] = canvas.corners();
    canvas.area("dg-solid", &[low, dvec2(high.x, low.y), dvec2(high.x, 0.0), dvec2(low.x, 0.0)]);
    canvas.line("dg-surface", dvec2(low.x, 0.0), dvec2(high.x, 0.0));
    canvas.arc("dg-thin dg-dash", DVec2::ZERO, 1.0, 0.0, PI);
    let (mut hits, mut sum, mut farthest, mut open) = (0, 0.0, (DVec2::ZERO, 0.0), None);
    for ray in both.iter().flatten() {
        let way = dvec2(ray.direction.dot(azimuth), ray.direction.dot(normal));
        let stop = ray.steps.iter().find(|step| step.stops).and_then(|step| step.surface);
        match (stop, ray.weight) {
            (Some(surface), Some(weight)) => {
                hits += 1;
                sum += weight;
                let end = way * surface.length() / RADIUS;
                canvas.line("dg-ink", DVec2::ZERO, end);
                canvas.dot("dg-mark", end, 3.5);
                if end.length() > farthest.0.length() {
                    farthest = (end, weight);
                }
            }
            _ => {
                canvas.arrow("dg-red", DVec2::ZERO, way * ray.E.length() / RADIUS);
                open = Some(way * ray.E.length() / RADIUS);
            }
        }
    }
    if hits > 0 {
        canvas.label(farthest.0, 45.0, format!("V = 1, W = {:.2}", farthest.1));
    }
    if let Some(end) = open {
        canvas.label(end, 110.0, "V = 0");
    }
    canvas.arrow("dg-green", DVec2::ZERO, dvec2(0.0, 1.2));
    canvas.label(dvec2(0.0, 1.2), 0.0, "n");
    canvas.dot("dg-mark", DVec2::ZERO, 4.5);
    canvas.label(DVec2::ZERO, -90.0, "P");
    canvas.label(DVec2::from_angle(0.2), 0.0, format!("R = {RADIUS:.0}"));
    let cosine = |ray: &Ray| ray.direction.dot(normal);
    Ok(Diagram::Drawn(Figure {
        id: "6.2.2".into(),
        title: "Rays distributed in the hemisphere about the normal".into(),
        text: format!(
            "{}, by ray-march with {} rays a direction, uniform over the hemisphere. The drawing's plane contains the \
             normal n = ({:.2}, {:.2}, {:.2}) and the azimuths {j} and {}.",
            rising.words(lab),
            RAYS / 2,
            normal.x,
            normal.y,
            normal.z,
            (j + half) % view.settings.directions
        ),
        drawings: vec![Drawing {
            file: "6.2.2.svg".into(),
            caption: format!(
                "{RAYS} rays with ω·n from {:.4} to {:.4}. V(ω) = 1 for the {hits} dark rays, which end in a dot at the distance of \
                 the surface that stops them; V(ω) = 0 for the {} red arrows. With the attenuation these rays add \
                 {sum:.3} of {RAYS}.",
                cosine(&both[0][0]),
                cosine(&both[0][both[0].len() - 1]),
                RAYS - hits
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Figure 6.2.5: one ray, step by step over the depth image.
pub(super) fn marched(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let view = View::new(lab, Method::RayMarch, |settings| settings.rays = RAYS / 2)?;
    let (anatomy, pixel) = (view.anatomy()?, rising.place.pixel);
    let all = (0..view.settings.directions).flat_map(|j| anatomy.rays(pixel, j).unwrap_or_default());
    // Of the rays that a surface stops, the one with the most steps before that.
    let stopped = all.filter(|ray| ray.weight.is_some() && ray.steps.iter().all(|step| step.surface.is_some()));
    let longest = stopped.reduce(|a, b| if b.steps.len() > a.steps.len() { b } else { a });
    let Some((ray, start)) =
        longest.filter(|ray| ray.steps.len() > 2).and_then(|ray| Some((ray, anatomy.start(pixel)?)))
    else {
        return Ok(Diagram::Missing("6.2.5", "a ray that goes several steps before a surface stops it"));
    };
    // The plane of the eye, P and E: the eye is straight up.
    let up = (-start.P).normalize_or_zero();
    let along = (ray.E - up * ray.E.dot(up)).normalize_or_zero();
    let at = |d: DVec3| dvec2(d.dot(along), d.dot(up)) / RADIUS;
    let heading = ray.steps.last().map_or(DVec2::X, |step| step.taken);
    let profile = profile(&anatomy, pixel, heading).unwrap_or_default();

    let end = at(ray.E);
    let seen = ray.steps.iter().filter_map(|step| step.surface.map(at));
    let [low, high] =
        seen.fold([DVec2::ZERO.min(end), DVec2::ZERO.max(end)], |[low, high], p| [low.min(p), high.max(p)]);
    let mut canvas = Canvas::new(680.0, 440.0, low - dvec2(0.25, 0.2), high + dvec2(0.25, 0.3));
    ground(&mut canvas, &profile, start.P, &at);
    let eye = dvec2(0.0, start.P.length() / RADIUS);
    for step in &ray.steps {
        let (on_ray, surface) = (at(step.on_ray), step.surface.map_or(DVec2::ZERO, at));
        let lower = if on_ray.y < surface.y { on_ray } else { surface };
        canvas.line("dg-thin dg-dash", lower, eye);
    }
    canvas.arrow("dg-red", DVec2::ZERO, end);
    for step in &ray.steps {
        mark(&mut canvas, step, &at);
    }
    canvas.dot("dg-mark", DVec2::ZERO, 4.5);
    canvas.label(DVec2::ZERO, -120.0, "P");
    canvas.label(end, 0.0, "E");
    let (steps, weight) = (ray.steps.len(), ray.weight.unwrap_or_default());
    let stop = ray.steps.last().and_then(|step| Some((step, step.surface?)));
    let (behind, distance) = stop.map_or((0.0, 0.0), |(step, s)| (step.on_ray.z - s.z, s.length()));
    Ok(Diagram::Drawn(Figure {
        id: "6.2.5".into(),
        title: "A ray marched over the depth image".into(),
        text: format!(
            "{} at {}x{}, pixel ({}, {}) with y up, by ray-march. The drawing's plane contains the eye, which is far above, P and \
             the ray's end E.",
            specimen::scene(lab).name,
            specimen::SIZE.0,
            specimen::SIZE.1,
            pixel.0,
            pixel.1
        ),
        drawings: vec![Drawing {
            file: "6.2.5.svg".into(),
            caption: format!(
                "The ray goes from P to E, at the distance R = {RADIUS:.0}, in {} steps. At each the depth of the ray (Q, hollow) \
                 is compared with that of the depth image at the same texel (S, filled), along the dashed line of sight. At step \
                 {steps} the surface is in front of the ray, by {behind:.1}, and {distance:.1} from P: the ray stops and adds W = {weight:.4}.",
                view.settings.steps
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

fn mark(canvas: &mut Canvas, step: &RayStep, at: &dyn Fn(DVec3) -> DVec2) {
    let Some(surface) = step.surface.map(at) else { return };
    canvas.dot("dg-hollow", at(step.on_ray), 4.0);
    canvas.dot(if step.stops { "dg-mark-red" } else { "dg-mark" }, surface, 4.0);
    let (q, s) = if step.stops { (-90.0, 90.0) } else { (90.0, -90.0) };
    canvas.label(at(step.on_ray), q, format!("Q{}", index(step.index)));
    canvas.label(surface, s, format!("S{}", index(step.index)));
}
