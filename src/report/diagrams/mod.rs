//! The papers' diagrams, drawn again from a real pixel of a rendered view with the numbers that the float64 twins
//! compute there.

mod azimuths;
mod canvas;
mod horizon;
mod image;
mod rays;
mod section;
mod specimen;

use super::figure::Figure;
use super::lab::Lab;
use hbao::Error;
use horizon::Rising;

/// A diagram, or the reason why there is none.
enum Diagram {
    Drawn(Figure),
    /// The number of the figure, and what the view lacks.
    Missing(&'static str, &'static str),
}

/// Makes the diagram of a place.
type Make = fn(&Lab, &Rising) -> Result<Diagram, Error>;

/// All diagrams.
pub(super) struct Diagrams {
    /// The figures, in the papers' order.
    pub(super) figures: Vec<Figure>,
    /// A line for each diagram that is missing.
    pub(super) missing: Vec<String>,
}

/// Draws all diagrams.
pub(super) fn draw(lab: &Lab) -> Result<Diagrams, Error> {
    let mut all = vec![horizon::outlier(lab)?];
    if let Some(rising) = Rising::find(lab)? {
        let make: [Make; 9] = [
            rays::traced,
            rays::solid,
            rays::hemisphere,
            rays::marched,
            horizon::horizon_angle,
            horizon::parameters,
            horizon::incremental,
            image::projected_radius,
            image::tangent_by_ray,
        ];
        for make in make {
            all.push(make(lab, &rising)?);
        }
        all.push(match image::sample_locations(lab, &rising)? {
            Some(samples) => horizon::talk(lab, &rising, samples)?,
            None => Diagram::Missing("talk-2", "a surface"),
        });
    } else {
        let lacks = "a pixel over which the horizon rises several times on one side";
        let rest = ["6.1.2", "6.1.3", "6.2.2", "6.2.5", "6.2.7", "6.2.8", "6.2.9", "6.2.11", "6.2.12", "talk-2"];
        all.extend(rest.map(|id| Diagram::Missing(id, lacks)));
    }
    let mut drawn = Diagrams { figures: Vec::new(), missing: Vec::new() };
    for diagram in all {
        match diagram {
            Diagram::Drawn(figure) => drawn.figures.push(figure),
            Diagram::Missing(id, lacks) => drawn.missing.push(format!(
                "Diagram {id}: left out, because the view of {} has not {lacks}",
                specimen::scene(lab).name
            )),
        }
    }
    Ok(drawn)
}

/// Puts the diagrams between the other figures, in the order of the papers' numbers.
pub(super) fn insert(figures: &mut Vec<Figure>, diagrams: Vec<Figure>) {
    for diagram in diagrams {
        let place = figures.iter().position(|figure| order(&figure.id) > order(&diagram.id)).unwrap_or(figures.len());
        figures.insert(place, diagram);
    }
}

/// Returns what figures are sorted by. The talk's figures come after the chapters', and what has no number in the
/// papers comes last.
fn order(id: &str) -> Vec<u32> {
    id.split(['.', '-']).map(|part| part.parse().unwrap_or(if part == "talk" { 100 } else { 1000 })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hbao::context::{Backend, Context};

    #[test]
    fn every_diagram_can_be_drawn_in_a_report_of_any_size() {
        let context = Context::open(Backend::Auto).unwrap();
        let lab = Lab::open(context.gl(), (64, 48), 16, None).unwrap();
        let Diagrams { figures, missing } = draw(&lab).unwrap();
        assert!(missing.is_empty(), "{missing:?}");
        let ids: Vec<&str> = figures.iter().map(|figure| figure.id.as_str()).collect();
        assert_eq!(ids.len(), 11, "{ids:?}");
        for drawing in figures.iter().flat_map(|figure| &figure.drawings) {
            let svg = &drawing.svg;
            // Links and identifiers would clash in one page.
            assert!(!svg.contains("url(") && !svg.contains(" id=") && !svg.contains("NaN"), "{}", drawing.file);
            let labels = areas(svg);
            assert!(labels.len() > 1 || drawing.file == "talk-2-c.svg", "{}: {labels:?}", drawing.file);
            for (i, (one, text)) in labels.iter().enumerate() {
                let [left, top, right, bottom] = *one;
                let [width, height] = ["width", "height"].map(|name| number(svg, name));
                assert!(left >= 0.0 && top >= 0.0 && right <= width && bottom <= height, "{}: {text}", drawing.file);
                let over = labels[..i].iter().find(|(other, _)| {
                    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
                });
                assert!(over.is_none(), "{}: {text} covers {over:?}", drawing.file);
            }
        }
    }

    /// Returns the first number that an attribute has in a text.
    fn number(text: &str, attribute: &str) -> f64 {
        let value = text.split(&format!(" {attribute}=\"")).nth(1).and_then(|rest| rest.split('"').next());
        value.unwrap().parse().unwrap()
    }

    /// Returns the area [left, top, right, bottom] that each label covers in a font of usual width, with its text.
    fn areas(svg: &str) -> Vec<([f64; 4], &str)> {
        let of = |rest: &str| -> Option<[f64; 4]> {
            let (x, y) = (number(rest, "x"), number(rest, "y"));
            let half = 14.0 * 0.56 * rest.split('>').nth(1)?.split('<').next()?.chars().count() as f64 / 2.0;
            Some([x - half, y - 11.0, x + half, y + 3.0])
        };
        svg.split("<text").skip(1).map(|rest| (of(rest).unwrap(), rest.split(['>', '<']).nth(1).unwrap())).collect()
    }

    #[test]
    fn diagrams_come_between_the_figures_in_the_order_of_the_papers() {
        let figures = |ids: &[&str]| ids.iter().map(|id| Figure { id: (*id).into(), ..Figure::default() }).collect();
        let mut all: Vec<Figure> = figures(&["6.1.1", "6.1.4", "6.2.1", "6.2.10", "talk-1", "methods"]);
        insert(&mut all, figures(&["talk-2", "6.2.12", "6.2.9", "6.1.2", "6.2.2"]));
        let ids: Vec<&str> = all.iter().map(|figure| figure.id.as_str()).collect();
        let expected =
            ["6.1.1", "6.1.2", "6.1.4", "6.2.1", "6.2.2", "6.2.9", "6.2.10", "6.2.12", "talk-1", "talk-2", "methods"];
        assert_eq!(ids, expected);
    }
}
