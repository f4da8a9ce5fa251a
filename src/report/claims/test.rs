//! The form of a claim's test.

use crate::report::claim::Claim;
use crate::report::lab::Lab;
use crate::report::measures::Measures;
use hbao::Error;

/// Measures one claim.
pub(super) type Test = fn(&Lab, &Measures) -> Result<Claim, Error>;
