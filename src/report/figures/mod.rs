//! The papers' figures, rendered again.

mod creases;
mod crysis;
mod edges;
mod hidden;
mod horizon;
mod picture;
mod results;

use super::figure::Figure;
use super::lab::Lab;
use hbao::Error;

pub(super) use crysis::open_share;
pub(super) use hidden::hidden_points;
pub(super) use picture::{detail, grey, picture};

/// Makes one figure.
type Make = fn(&Lab) -> Result<Figure, Error>;

/// The figures in the papers' order.
pub(super) const ALL: [Make; 16] = [
    crysis::game_scene,
    crysis::scenarios,
    crysis::edges,
    crysis::without_rotation,
    crysis::blur,
    horizon::first_picture,
    horizon::attenuation,
    hidden::hidden_sample,
    horizon::snapped_directions,
    creases::low_tessellation,
    creases::angle_bias,
    edges::edge_bleeding,
    results::sample_counts,
    results::dragon,
    results::talk,
    results::methods,
];
