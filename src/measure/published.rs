//! The figures that the papers of 2008 published. All other code takes them from here. Sizes are in pixels, times in
//! milliseconds.

use super::median;
use crate::settings::Method;

/// The columns of [`TABLE_6_2_1`]: the frame without ambient occlusion and blur, the frame with the blur over A = 1,
/// and frames with the numbers of directions and steps that the name gives.
pub const COLUMNS: [&str; 5] = ["no AO/no blur", "no AO", "4/4", "8/8", "16/16"];
/// The column that has as many samples as the talk's figure.
pub const EIGHT: usize = 3;

/// One row of [`TABLE_6_2_1`]: one mode on one graphics card.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableRow {
    /// `half` has ambient occlusion at half resolution and one depth sample per pixel; `msaa1` and `msaa4` have it at
    /// full resolution, with 1 and 4 depth samples per pixel.
    pub mode: &'static str,
    /// The graphics card, a GeForce.
    pub card: &'static str,
    /// Frames per second, in the order of [`COLUMNS`].
    pub fps: [f64; 5],
}

/// The width and height of the image in [`TABLE_6_2_1`], in pixels.
pub const TABLE_SIZE: (u32, u32) = (1600, 1200);
/// The width of the blur in [`TABLE_6_2_1`], in pixels.
pub const TABLE_BLUR: u32 = 9;

/// ShaderX7 6.2, Table 6.2.1: whole frames of the Sibenik Cathedral.
pub const TABLE_6_2_1: [TableRow; 9] = [
    TableRow { mode: "half", card: "8600 GTS", fps: [88.0, 43.0, 26.0, 15.0, 6.0] },
    TableRow { mode: "half", card: "8800 GT", fps: [234.0, 127.0, 81.0, 48.0, 20.0] },
    TableRow { mode: "half", card: ULTRA, fps: [301.0, 155.0, 100.0, 59.0, 24.0] },
    TableRow { mode: "msaa1", card: "8600 GTS", fps: [86.0, 42.0, 10.0, 4.2, 1.5] },
    TableRow { mode: "msaa1", card: "8800 GT", fps: [234.0, 128.0, 26.0, 10.0, 4.0] },
    TableRow { mode: "msaa1", card: ULTRA, fps: [299.0, 155.0, 41.0, 17.0, 5.8] },
    TableRow { mode: "msaa4", card: "8600 GTS", fps: [38.0, 26.0, 8.8, 4.2, 1.5] },
    TableRow { mode: "msaa4", card: "8800 GT", fps: [88.0, 67.0, 22.0, 9.8, 3.9] },
    TableRow { mode: "msaa4", card: ULTRA, fps: [138.0, 97.0, 36.0, 16.0, 5.7] },
];

/// The fastest of the table's cards, which the talk's figure was measured on too.
pub const ULTRA: &str = "8800 Ultra";

/// The SIGGRAPH 2008 talk, Figure 1: megapixels per second of ambient occlusion alone on [`ULTRA`], with 8 directions
/// of 8 steps. Ray marching casts 4 rays in each direction. The talk does not give the image's size.
pub const FIGURE_1: [(Method, f64); 2] = [(Method::HbaoTalk, 67.0), (Method::RayMarch, 15.0)];

/// ShaderX7 6.1, Results: the time of the ambient occlusion of Crysis with its blur on a GeForce 8800 GTX, in
/// milliseconds.
pub const CRYSIS_MS: f64 = 3.0;
/// The width and height of the image for [`CRYSIS_MS`], in pixels.
pub const CRYSIS_SIZE: (u32, u32) = (1280, 720);
/// ShaderX7 6.1, Future improvements: the factor by which the shader is roughly faster with a smaller depth image.
pub const CRYSIS_SMALL_DEPTH: f64 = 2.0;

/// The part of a frame whose cost is read from the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// The whole frame.
    Frame,
    /// Ambient occlusion without the blur. From the table it is the time of the frame minus that of the column 'no AO'.
    Ao,
    /// The blur. From the table it is the time of the column 'no AO' minus that of 'no AO/no blur'.
    Blur,
}

impl TableRow {
    /// Returns the cost in one of [`COLUMNS`], in milliseconds.
    pub fn ms(&self, cost: Cost, column: usize) -> f64 {
        let frame = |column: usize| 1e3 / self.fps[column];
        match cost {
            Cost::Frame => frame(column),
            Cost::Ao => frame(column) - frame(1),
            Cost::Blur => frame(1) - frame(0),
        }
    }
}

/// Returns the megapixels per second that [`FIGURE_1`] gives for a method.
pub fn figure_1(method: Method) -> Option<f64> {
    FIGURE_1.iter().find(|(known, _)| *known == method).map(|&(_, mpixels_per_s)| mpixels_per_s)
}

/// Returns the megapixels per second that the table implies for 8 directions of 8 steps at one depth sample per pixel
/// on [`ULTRA`]. [`FIGURE_1`] gives 67 megapixels per second for the same samples.
pub fn table_mpixels_per_s() -> f64 {
    let pixels = f64::from(TABLE_SIZE.0) * f64::from(TABLE_SIZE.1);
    let ms =
        TABLE_6_2_1.iter().filter(|row| row.mode == "msaa1" && row.card == ULTRA).map(|row| row.ms(Cost::Ao, EIGHT));
    pixels / median(&ms.collect::<Vec<_>>()) / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_papers_disagree_by_a_factor_of_1_8() {
        // The table implies 1/17 - 1/155 of a second for 1.92 megapixels.
        let implied = table_mpixels_per_s();
        assert!((implied - 36.66).abs() < 0.01, "{implied}");
        assert!((figure_1(Method::HbaoTalk).unwrap() / implied - 1.83).abs() < 0.01);
    }

    #[test]
    fn every_mode_has_every_card_and_more_samples_take_longer() {
        for mode in ["half", "msaa1", "msaa4"] {
            let rows: Vec<_> = TABLE_6_2_1.iter().filter(|row| row.mode == mode).collect();
            assert_eq!(rows.iter().map(|row| row.card).collect::<Vec<_>>(), ["8600 GTS", "8800 GT", ULTRA]);
            assert!(rows.iter().all(|row| row.fps.windows(2).all(|pair| pair[0] > pair[1])));
        }
        let half = TABLE_6_2_1[2];
        // The expected times are 1/59 - 1/155, 1/155 - 1/301 and 1/301 of a second.
        for (cost, column, ms) in [(Cost::Ao, EIGHT, 10.498), (Cost::Blur, EIGHT, 3.129), (Cost::Frame, 0, 3.322)] {
            assert!((half.ms(cost, column) - ms).abs() < 1e-3, "{cost:?}");
        }
    }
}
