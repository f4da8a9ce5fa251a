//! Tells the values of a drawing's marks: whoever points at one is shown its text, without scripts too.

use maud::html;

/// A mark: its place in the drawing, in pixels from the upper left corner, and what it tells.
pub(super) struct Spot {
    pub(super) at: (i32, i32),
    pub(super) text: String,
}

/// Adds the spots to a drawing that is complete. Each is an invisible disc around its mark.
pub(super) fn add(svg: &str, spots: &[Spot]) -> String {
    let discs = html! {
        g fill="transparent" {
            @for Spot { at: (x, y), text } in spots { circle class="spot" cx=(x) cy=(y) r="7" { title { (text) } } }
        }
    };
    let Some((drawing, _)) = svg.rsplit_once("</svg>") else { return svg.into() };
    format!("{drawing}{}</svg>\n", discs.into_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_stands_inside_the_drawing_and_its_text_is_escaped() {
        let drawn = add("<svg><g/></svg>", &[Spot { at: (3, 4), text: "a < b".into() }]);
        let disc = r#"<circle class="spot" cx="3" cy="4" r="7"><title>a &lt; b</title></circle>"#;
        assert_eq!(drawn, format!("<svg><g/><g fill=\"transparent\">{disc}</g></svg>\n"));
    }
}
