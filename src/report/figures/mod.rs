//! The papers' figures, rendered again.

mod boundaries;
mod combining;
mod creases;
mod crysis;
mod crysis_parts;
mod edges;
mod forms;
mod hidden;
mod horizon;
mod jitter;
mod picture;
mod results;
mod view;

use super::figure::Figure;
use super::lab::Lab;
use hbao::Error;

pub(super) use boundaries::{before_ledge, largest_step, steep_steps};
pub(super) use crysis::open_share;
pub(super) use crysis_parts::{border, halo, mixing};
pub(super) use hidden::hidden_points;
pub(super) use jitter::{Banding, jittered};
pub(super) use picture::{detail, grey, picture};

/// Makes one figure.
type Make = fn(&Lab) -> Result<Figure, Error>;

/// The figures in the papers' order.
pub(super) const ALL: [Make; 22] = [
    crysis::game_scene,
    crysis::scenarios,
    crysis::edges,
    crysis::without_rotation,
    crysis::blur,
    crysis_parts::range_check,
    crysis_parts::at_the_border,
    horizon::first_picture,
    forms::two_forms,
    horizon::attenuation,
    hidden::hidden_sample,
    combining::applied,
    horizon::snapped_directions,
    jitter::off_and_on,
    creases::low_tessellation,
    creases::angle_bias,
    edges::edge_bleeding,
    results::sample_counts,
    results::dragon,
    results::talk,
    results::methods,
    view::beyond,
];
