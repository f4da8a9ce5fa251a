//! Keeps numbers and their units on one line.

/// The words that belong to the number before them.
const UNITS: [&str; 14] = [
    "%",
    "RMS",
    "ms",
    "s",
    "R",
    "degrees",
    "times",
    "rays",
    "directions",
    "steps",
    "pixels",
    "texels",
    "samples",
    "MPixels/s",
];

/// Returns the text with a space that does not break between every number and its unit.
pub(super) fn unbroken(text: &str) -> String {
    let mut whole = String::new();
    let mut number = false;
    for (i, word) in text.split(' ').enumerate() {
        let unit = UNITS.contains(&word.trim_end_matches([',', '.', ';', ':', ')']));
        if i > 0 {
            whole.push(if number && unit { '\u{a0}' } else { ' ' });
        }
        whole += word;
        number = word.ends_with(|c: char| c.is_ascii_digit());
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_and_its_unit_stay_together_and_nothing_else_changes() {
        assert_eq!(unbroken("off by 0.06/255 RMS, 5 % of it"), "off by 0.06/255\u{a0}RMS, 5\u{a0}% of it");
        for text in ["", "  a  b ", "hbao bench --runs 1 --size 64x48", "8 more pixels"] {
            assert_eq!(unbroken(text), text);
        }
    }
}
