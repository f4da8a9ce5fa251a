//! Tables of measurements. `hbao bench` and `hbao trade` print them as text, and the page shows them as HTML.

pub(crate) mod bench;
pub(crate) mod cells;
pub(crate) mod trade;
