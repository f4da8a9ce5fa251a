//! The page of `hbao paper`: every picture, table and claim of the papers, regenerated. Other verbs share its tables.

mod bars;
mod claim;
mod claims;
mod diagrams;
mod drawing;
mod extremes;
pub(crate) mod fields;
mod figure;
mod figures;
mod findings;
pub(crate) mod json;
mod lab;
mod machine;
mod measures;
mod models;
mod page;
pub(crate) mod plot;
mod run;
mod scenes;
mod speeds;
mod spots;
mod subject;
mod sweep;
pub(crate) mod tables;
pub(crate) mod ticks;
pub(crate) mod words;

pub(crate) use run::{FIGURES, Made, Options, PAGE, make};
pub(crate) use sweep::DECOMPOSED_PIXELS;
