//! A figure of the page: pictures, drawings and tables under one title.

use hbao::measure::table::Table;

/// A picture. It is written beside the page as a PNG file, and stands inside the page too.
#[derive(Clone)]
pub(super) struct Picture {
    pub(super) file: String,
    pub(super) caption: String,
    pub(super) png: Vec<u8>,
    /// Width and height in pixels.
    pub(super) size: (usize, usize),
    /// How many times larger than its pixels it is shown at least. Each pixel is shown as a square.
    pub(super) enlarged: usize,
    /// The command line that makes the same file, if there is one.
    pub(super) command: Option<String>,
}

/// A drawing. It is written beside the page as an SVG file, and stands inside the page too.
pub(super) struct Drawing {
    pub(super) file: String,
    pub(super) caption: String,
    pub(super) svg: String,
}

/// One of the papers' figures, or a part of the report that is shown like one.
#[derive(Default)]
pub(super) struct Figure {
    /// Its number in the paper, which is its anchor too.
    pub(super) id: String,
    pub(super) title: String,
    pub(super) text: String,
    pub(super) pictures: Vec<Picture>,
    pub(super) drawings: Vec<Drawing>,
    pub(super) tables: Vec<Table>,
}
