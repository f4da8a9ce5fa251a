//! A figure of the page: pictures, drawings and tables under one title.

use hbao::measure::table::Table;

/// A picture. It is embedded in the page, and also written as a PNG file beside the page.
#[derive(Clone)]
pub(super) struct Picture {
    pub(super) file: String,
    pub(super) caption: String,
    pub(super) png: Vec<u8>,
    /// Width and height in pixels.
    pub(super) size: (usize, usize),
    /// The least factor by which the page enlarges the picture. Each pixel is shown as a square.
    pub(super) enlarged: usize,
    /// The command line that makes the same file, if there is one.
    pub(super) command: Option<String>,
}

/// A drawing. It is embedded in the page, and also written as an SVG file beside the page.
pub(super) struct Drawing {
    pub(super) file: String,
    pub(super) caption: String,
    pub(super) svg: String,
}

/// One of the papers' figures, or a part of the report that is shown like one.
#[derive(Default)]
pub(super) struct Figure {
    /// The number of the figure in the paper. The anchor of the figure in the page is made from it.
    pub(super) id: String,
    pub(super) title: String,
    pub(super) text: String,
    pub(super) pictures: Vec<Picture>,
    pub(super) drawings: Vec<Drawing>,
    pub(super) tables: Vec<Table>,
}
