//! The diagrams of the horizon: Figures 6.2.6 to 6.2.9, and the talk's Figures 2a and 2b.

use super::canvas::Canvas;
use super::section::{Section, degrees, index};
use super::specimen::{self, Place, RADIUS, View};
use super::{Diagram, azimuths};
use crate::report::figure::{Drawing, Figure};
use crate::report::lab::Lab;
use glam::{DVec2, dvec2};
use hbao::Error;
use hbao::measure::table::Table;
use hbao::reference::anatomy::{Anatomy, Fate, SampleAnatomy, Slice};
use hbao::settings::Method;

/// The place that most of the diagrams show, as `hbao` sees it.
pub(super) struct Rising {
    pub(super) view: View,
    pub(super) place: Place,
}

impl Rising {
    /// Finds the place. `None` if the view has none that shows everything.
    pub(super) fn find(lab: &Lab) -> Result<Option<Rising>, Error> {
        let view = View::new(lab, Method::Hbao, |_| ())?;
        let place = specimen::rising(&view.anatomy()?, view.settings.directions);
        Ok(place.map(|place| Rising { view, place }))
    }

    /// Returns the section of the place by a view's method.
    pub(super) fn section(&self, anatomy: &Anatomy) -> Option<Section> {
        Section::new(anatomy, self.place)
    }

    /// Names the place in words.
    pub(super) fn words(&self, lab: &Lab) -> String {
        place_words(lab, self.place, self.view.settings.directions)
    }
}

/// Names a place in words.
pub(super) fn place_words(lab: &Lab, place: Place, directions: u32) -> String {
    let ((x, y), (width, height)) = (place.pixel, specimen::SIZE);
    format!(
        "{} at {width}x{height}, R = {RADIUS}, pixel ({x}, {y}) with y up, direction {} of {directions}",
        specimen::scene(lab).name,
        place.k
    )
}

/// Says how the sections are drawn.
pub(super) const DRAWN: &str = "Points stand at their distance from P across, |D.xy|, and towards the eye, -D.z, so that \
                                elevations and distances from P are true. The eye is far above. Grey is what lies behind the \
                                depth image, as far as the picture reaches.";

/// Draws a sample's place on the surface, with its name.
fn sample(canvas: &mut Canvas, section: &Section, sample: &SampleAnatomy, name: bool) {
    let Some(found) = sample.found else { return };
    let at = section.at(found.D);
    let class = if sample.fate == Fate::Raises { "dg-mark-red" } else { "dg-hollow" };
    canvas.dot(class, at, 4.0);
    if name {
        canvas.label(at, 60.0, format!("S{}", index(sample.index)));
    }
}

/// Draws the horizon and the tangent of a direction, with the angles from the XY plane.
fn angles(canvas: &mut Canvas, slice: &Slice, sin_h: f64, letter: &str) {
    let [t, h] = [slice.sin_t, sin_h].map(Section::elevated);
    canvas.line("dg-thin", dvec2(-1.25, 0.0), dvec2(1.25, 0.0));
    canvas.line("dg-blue", DVec2::ZERO, 1.2 * t);
    canvas.line("dg-red", DVec2::ZERO, 1.2 * h);
    canvas.arc("dg-blue", DVec2::ZERO, 0.42, 0.0, slice.sin_t.asin());
    canvas.arc("dg-red", DVec2::ZERO, 0.56, 0.0, sin_h.asin());
    let middle = |sine: f64, radius: f64| radius * DVec2::from_angle(sine.asin() / 2.0);
    canvas.label(middle(sin_h, 0.56), 30.0, format!("h{letter} = {}", degrees(sin_h)));
    canvas.label(
        middle(slice.sin_t, 0.42),
        if slice.sin_t < 0.0 { -30.0 } else { 150.0 },
        format!("t{letter} = {}", degrees(slice.sin_t)),
    );
}

/// The frame of the sections, in units of R.
fn sheet() -> Canvas {
    Canvas::new(680.0, 440.0, dvec2(-1.35, -0.8), dvec2(1.65, 1.15))
}

/// Figure 6.2.6: an outlier beyond R.
pub(super) fn outlier(lab: &Lab) -> Result<Diagram, Error> {
    let view = View::new(lab, Method::Hbao, |_| ())?;
    let anatomy = view.anatomy()?;
    let directions = view.settings.directions;
    let place = specimen::with_outlier(&anatomy, directions);
    let Some((place, section)) = place.and_then(|p| Some((p, Section::new(&anatomy, p)?))) else {
        return Ok(Diagram::Missing("6.2.6", "a sample beyond R that is higher than the horizon"));
    };
    let slice = &section.slice;
    let beyond = slice.samples.iter().filter(|sample| sample.fate == Fate::BeyondRadius);
    let highest =
        beyond.filter_map(|sample| Some((sample, sample.found?))).max_by(|a, b| a.1.sin_phi.total_cmp(&b.1.sin_phi));
    let Some((outlier, found)) = highest else {
        return Ok(Diagram::Missing("6.2.6", "a sample beyond R"));
    };
    let at = section.at(found.D);
    let [low, high] = [dvec2(-1.2, -0.7), dvec2(1.2, 1.1)];
    let mut canvas = Canvas::new(680.0, 480.0, low.min(at - 0.25), high.max(at + 0.3));
    section.surface(&mut canvas);
    section.sphere(&mut canvas);
    canvas.line("dg-red dg-dash", DVec2::ZERO, at);
    canvas.line("dg-blue", DVec2::ZERO, 1.15 * Section::elevated(slice.sin_h()));
    slice.samples.iter().for_each(|s| sample(&mut canvas, &section, s, false));
    let share = found.D.length() / RADIUS;
    canvas.label(at, 120.0, format!("outlier S{}, {share:.2} R from P", index(outlier.index)));
    canvas.label(1.15 * Section::elevated(slice.sin_h()), 0.0, format!("horizon {}", degrees(slice.sin_h())));
    Ok(Diagram::Drawn(Figure {
        id: "6.2.6".into(),
        title: "An outlier beyond the radius of influence".into(),
        text: format!("{}. {DRAWN}", place_words(lab, place, directions)),
        drawings: vec![Drawing {
            file: "6.2.6.svg".into(),
            caption: format!(
                "Sample {} lies {share:.2} R from P, on an object in front of it. At its elevation of {} it would hide everything lower. \
                 It is further than R, so it is ignored, and the horizon stays at {}. Hollow samples do not raise the horizon.",
                outlier.index,
                degrees(found.sin_phi),
                degrees(slice.sin_h())
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Figure 6.2.7: the horizon angle in tangent space.
pub(super) fn horizon_angle(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let anatomy = rising.view.anatomy()?;
    let section = rising.section(&anatomy);
    let Some((section, found)) = section.and_then(|s| {
        let found = s.slice.horizon_sample()?.found?;
        Some((s, found))
    }) else {
        return Ok(Diagram::Missing("6.2.7", "a horizon"));
    };
    let (slice, [t, h]) = (&section.slice, [section.slice.sin_t.asin(), section.slice.sin_h().asin()]);
    let mut canvas = sheet();
    section.surface(&mut canvas);
    let top = section.at(found.D);
    let wedge: Vec<DVec2> =
        (0..=20).map(|i| top.length() * DVec2::from_angle(t + (h - t) * f64::from(i) / 20.0)).collect();
    canvas.area("dg-wedge", &[&[DVec2::ZERO], wedge.as_slice()].concat());
    for i in 0..10 {
        let way = DVec2::from_angle(t + (f64::from(i) + 0.5) * std::f64::consts::PI / 10.0);
        match hit(way, &section) {
            Some(stop) if stop.length() <= 1.0 => {
                canvas.line("dg-ink", DVec2::ZERO, stop);
                canvas.dot("dg-mark", stop, 2.5);
            }
            _ => canvas.arrow("dg-thin", DVec2::ZERO, way),
        }
    }
    canvas.line("dg-blue", DVec2::ZERO, 1.2 * DVec2::from_angle(t));
    canvas.line("dg-red", DVec2::ZERO, 1.2 * DVec2::from_angle(h));
    section.sphere(&mut canvas);
    canvas.dot("dg-mark-red", top, 5.0);
    canvas.label(top, 60.0, "H");
    canvas.label(1.2 * DVec2::from_angle(t), 0.0, "T");
    canvas.label(0.5 * DVec2::from_angle((t + h) / 2.0), 0.0, format!("{:.1}°", (h - t).to_degrees()));
    Ok(Diagram::Drawn(Figure {
        id: "6.2.7".into(),
        title: "The horizon angle above the tangent".into(),
        text: format!("{}. {DRAWN}", rising.words(lab)),
        drawings: vec![Drawing {
            file: "6.2.7.svg".into(),
            caption: format!(
                "The horizon point H is sample {}, {:.1} from P ({:.2} R). It stands {:.1}° above the tangent T: rays between \
                 them meet the depth image within R, and those above do not. With W = 1 the direction adds sin h - sin t = {:.4} to \
                 the sum of occlusion; with the attenuation of each sample it adds {:.4}.",
                slice.horizon_sample().map_or(0, |sample| sample.index),
                found.D.length(),
                found.D.length() / RADIUS,
                (h - t).to_degrees(),
                slice.sin_h() - slice.sin_t,
                slice.occlusion
            ),
            svg: canvas.finish(),
        }],
        ..Figure::default()
    }))
}

/// Returns where a ray from P first meets the drawn surface; near P it does not look.
fn hit(way: DVec2, section: &Section) -> Option<DVec2> {
    let segments = section.profile.iter().flat_map(|run| run.windows(2));
    let at = segments.filter_map(|two| {
        let [a, b] = [two[0], two[1]].map(|d| section.at(d));
        let along = b - a;
        let across = way.perp_dot(along);
        let (distance, share) = (a.perp_dot(along) / across, a.perp_dot(way) / across);
        (distance > 0.03 && (0.0..=1.0).contains(&share)).then_some(distance)
    });
    at.reduce(f64::min).map(|distance| distance * way)
}

/// Figure 6.2.8, and the talk's 2a and 2b.
pub(super) fn parameters(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let anatomy = rising.view.anatomy()?;
    let drawn =
        rising.section(&anatomy).and_then(|s| Some((azimuths::hemisphere(&anatomy, rising.place, &s, ["Z", "φ"])?, s)));
    let Some((sphere, section)) = drawn else { return Ok(Diagram::Missing("6.2.8", "a tangent plane")) };
    Ok(Diagram::Drawn(Figure {
        id: "6.2.8".into(),
        title: "The hemisphere's parameters, and the horizon angle".into(),
        text: format!("{}. In (b): {DRAWN}", rising.words(lab)),
        drawings: vec![
            Drawing {
                file: "6.2.8-a.svg".into(),
                caption: format!(
                    "(a) The azimuth θ turns about the eye's Z axis and the elevation φ rises from the XY plane towards the eye. \
                     The direction shown leads to the horizon point. The hemisphere stands on the tangent plane, with the normal \
                     n = {}.",
                    vector(section.start.normal)
                ),
                svg: sphere,
            },
            Drawing {
                file: "6.2.8-b.svg".into(),
                caption: format!("(b) {}", angle_words(&section)),
                svg: both_angles(&section, ["XY plane", "-Z, to the eye"]),
            },
        ],
        ..Figure::default()
    }))
}

/// Writes a vector.
fn vector(v: glam::DVec3) -> String {
    format!("({:.2}, {:.2}, {:.2})", v.x, v.y, v.z)
}

/// Says what the angles of a section are.
fn angle_words(section: &Section) -> String {
    format!(
        "The tangent plane rises from the XY plane by t(θ) = {} in this direction and the horizon by h(θ) = {}. Rays \
         between the two are occluded.",
        degrees(section.slice.sin_t),
        degrees(section.slice.sin_h())
    )
}

/// Draws the angles t and h of a section.
fn both_angles(section: &Section, [plane, axis]: [&str; 2]) -> String {
    let mut canvas = sheet();
    section.surface(&mut canvas);
    let (slice, sin_h) = (&section.slice, section.slice.sin_h());
    angles(&mut canvas, slice, sin_h, "(θ)");
    canvas.arrow("dg-thin", DVec2::ZERO, dvec2(0.0, 1.05));
    section.sphere(&mut canvas);
    for one in &slice.samples {
        sample(&mut canvas, section, one, false);
    }
    canvas.label(dvec2(0.0, 1.05), 180.0, axis);
    canvas.label(dvec2(1.25, 0.0), 0.0, plane);
    canvas.label(1.2 * Section::elevated(slice.sin_t), 0.0, "tangent T");
    canvas.label(1.2 * Section::elevated(sin_h), 0.0, "horizon");
    canvas.finish()
}

/// The talk's Figure 2, of which `samples` is 2c.
pub(super) fn talk(lab: &Lab, rising: &Rising, samples: Drawing) -> Result<Diagram, Error> {
    let view = View::new(lab, Method::HbaoTalk, |_| ())?;
    let anatomy = view.anatomy()?;
    let drawn =
        rising.section(&anatomy).and_then(|s| Some((azimuths::hemisphere(&anatomy, rising.place, &s, ["V", "α"])?, s)));
    let Some((sphere, section)) = drawn else { return Ok(Diagram::Missing("talk-2", "a tangent plane")) };
    let slice = &section.slice;
    let weight = slice.horizon_sample().and_then(|sample| sample.found).map_or(0.0, |found| found.weight);
    let drawings = vec![
        Drawing {
            file: "talk-2-a.svg".into(),
            caption: format!(
                "(a) The azimuth θ about the view vector V, and the tangent angle t(θ) = {} of the surface in this direction.",
                degrees(slice.sin_t)
            ),
            svg: sphere,
        },
        Drawing {
            file: "talk-2-b.svg".into(),
            caption: format!(
                "(b) {} The talk attenuates the whole rise by W = {weight:.3} of the sample at the horizon: the direction adds \
                 (sin h - sin t) W = {:.4}.",
                angle_words(&section),
                slice.occlusion
            ),
            svg: both_angles(&section, ["perpendicular to V", "V, to the eye"]),
        },
        samples,
    ];
    Ok(Diagram::Drawn(Figure {
        id: "talk-2".into(),
        title: "The talk's Figure 2: azimuth, horizon and sample locations".into(),
        text: format!("{}, by hbao-talk. In (b): {DRAWN}", rising.words(lab)),
        drawings,
        ..Figure::default()
    }))
}

/// Figure 6.2.9: the horizon after one and after three samples.
pub(super) fn incremental(lab: &Lab, rising: &Rising) -> Result<Diagram, Error> {
    let anatomy = rising.view.anatomy()?;
    let Some(section) = rising.section(&anatomy) else {
        return Ok(Diagram::Missing("6.2.9", "a horizon"));
    };
    let slice = &section.slice;
    let mut drawings = Vec::new();
    for count in [1, 3] {
        let taken = &slice.samples[..count.min(slice.samples.len())];
        let mut raised = taken.iter().filter(|sample| sample.fate == Fate::Raises).filter_map(|sample| sample.found);
        let sin_h = raised.next_back().map_or(slice.sin_t, |found| found.sin_phi);
        let mut canvas = sheet();
        section.surface(&mut canvas);
        angles(&mut canvas, slice, sin_h, "");
        section.sphere(&mut canvas);
        for one in taken {
            sample(&mut canvas, &section, one, true);
        }
        canvas.label(1.2 * Section::elevated(slice.sin_t), 0.0, "T");
        canvas.label(1.2 * Section::elevated(sin_h), 0.0, "horizon");
        let sum: f64 = taken.iter().map(|sample| sample.contribution).sum();
        let (number, plural) = if count == 1 { ("one", "") } else { ("three", "s") };
        drawings.push(Drawing {
            file: format!("6.2.9-{count}.svg"),
            caption: format!(
                "After {number} sample{plural}: the horizon stands at {}, and {sum:.4} has been added.",
                degrees(sin_h)
            ),
            svg: canvas.finish(),
        });
    }
    let a = anatomy.visibility(rising.place.pixel).unwrap_or(1.0);
    Ok(Diagram::Drawn(Figure {
        id: "6.2.9".into(),
        title: "The horizon angle grows sample by sample".into(),
        text: format!(
            "{}. {DRAWN} All {} directions together leave A = {a:.4}.",
            rising.words(lab),
            rising.view.settings.directions
        ),
        drawings,
        tables: vec![samples_table(&section)],
        ..Figure::default()
    }))
}

fn samples_table(section: &Section) -> Table {
    let row = |sample: &SampleAnatomy| {
        let fate = match sample.fate {
            Fate::OwnTexel => "ignored: P's own texel",
            Fate::Background => "ignored: background",
            Fate::BeyondRadius => "ignored: beyond R",
            Fate::BelowHorizon => "ignored: not above the horizon",
            Fate::Raises => "raises the horizon",
        };
        let mut row = vec![sample.index.to_string(), format!("{}, {}", sample.taken.x, sample.taken.y)];
        row.extend(match sample.found {
            Some(found) => [
                format!("{:.2}", found.D.length()),
                degrees(found.sin_phi),
                degrees(found.sin_t),
                degrees(found.sin_before),
                if sample.fate == Fate::BeyondRadius { "-".into() } else { format!("{:.4}", found.weight) },
            ],
            None => ["-"; 5].map(String::from),
        });
        row.extend([format!("{:.4}", sample.contribution), fate.to_string()]);
        row
    };
    Table::headed(["sample", "texels from P", "|D|", "φ", "t", "horizon before", "W", "adds", "what becomes of it"])
        .captioned("The samples of this direction (Eq. 6.2.9)")
        .filled(section.slice.samples.iter().map(row))
}
