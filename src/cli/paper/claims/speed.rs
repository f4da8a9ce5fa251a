//! What the papers say of speed.

use super::Test;

pub(super) const ALL: &[Test] = &[];
