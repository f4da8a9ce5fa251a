//! Measures what each part of a frame costs, in interleaved rounds over the cases of the papers of 2008 and of the
//! scaling series; and what an application pays that embeds the library.
#![doc = include_str!("../tables_of_2008.md")]

mod cases;
mod embedding;
mod measurement;
mod power_law;
mod rounds;

pub use cases::{Case, FIXED, crysis, figure1, scaling, table};
pub use embedding::{Change, InputCost, SMALL, changes, input_costs};
pub use measurement::Measurement;
pub use power_law::exponent;
pub use rounds::measure;
