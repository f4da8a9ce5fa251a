//! The papers' tables, and ours beside them.

/// What was timed and swept.
pub(super) struct Tables {}
