//! Draws groups of bars as SVG. They are legible in grey, because the bars of a group differ in lightness.

use maud::html;

/// The widths of the names and of the longest bar, the height of a bar and the gap between groups, in pixels.
const NAMES: f64 = 110.0;
const LONGEST: f64 = 520.0;
const BAR: f64 = 13.0;
const GAP: f64 = 12.0;

/// The greys of the bars of a group.
const GREYS: [&str; 4] = ["#282828", "#6e6e6e", "#a8a8a8", "#e0e0e0"];

/// A group of bars: its name, and the length of each bar.
pub(super) type Group = (String, [f64; 4]);

/// Draws horizontal bars. `names` are those of a group's bars, and `unit` stands behind each value that is told.
pub(super) fn bars(groups: &[Group], names: [&str; 4], unit: &str) -> String {
    let most = groups.iter().flat_map(|(_, values)| values).fold(1e-9f64, |most, &value| most.max(value));
    let (top, each) = (34.0, BAR * 4.0 + GAP);
    let (width, height) = (NAMES + LONGEST + 70.0, top + each * groups.len() as f64 + 6.0);
    let markup = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (width) " " (height) } width=(width) height=(height)
            font-family="sans-serif" font-size="13" fill="#282828"
        {
            rect width="100%" height="100%" fill="#ffffff" {}
            @for (i, (name, grey)) in names.iter().zip(GREYS).enumerate() {
                @let x = NAMES + 150.0 * i as f64;
                rect x=(x) y="10" width="12" height="12" fill=(grey) stroke="#282828" {}
                text x=(x + 18.0) y="21" { (name) }
            }
            @for (i, (group, values)) in groups.iter().enumerate() {
                @let y = top + each * i as f64;
                text x=(NAMES - 10.0) y=(y + BAR * 2.0 + 4.0) text-anchor="end" { (group) }
                @for (k, ((value, name), grey)) in values.iter().zip(names).zip(GREYS).enumerate() {
                    @let (y, length) = (y + BAR * k as f64, format!("{:.2}", LONGEST * value / most));
                    rect class="spot" x=(NAMES) y=(y) width=(length) height=(BAR - 2.0) fill=(grey) stroke="#282828" {
                        title { (group) ", " (name) ": " (format!("{value:.4}")) " " (unit) }
                    }
                    text x=(format!("{:.2}", NAMES + LONGEST * value / most + 6.0)) y=(y + BAR - 2.5) font-size="11" {
                        (format!("{value:.3}"))
                    }
                }
            }
        }
    };
    markup.into_string() + "\n"
}
