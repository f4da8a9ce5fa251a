//! Stands in for `osmesa.rs` on platforms that cannot open a library at run time, such as the web.

use crate::Error;
use std::ffi::{CStr, c_void};

/// An OSMesa context on a platform without OSMesa. The type has no values, so its methods are never reached.
pub(super) enum Osmesa {}

impl Osmesa {
    /// Always fails.
    pub(super) fn open() -> Result<Osmesa, Error> {
        Err(Error::Context("osmesa: this platform cannot open libOSMesa: run hbao on Linux, Windows or macOS".into()))
    }

    pub(super) fn get_proc_address(&self, _name: &CStr) -> *const c_void {
        match *self {}
    }
}
