//! Stands in for `glx.rs` on platforms without X11: Windows, macOS, Android and the web.

use crate::Error;
use std::ffi::{CStr, c_void};

/// A GLX context on a platform without X11. The type has no values, so its methods are never reached.
pub(super) enum Glx {}

impl Glx {
    /// Always fails.
    pub(super) fn open() -> Result<Glx, Error> {
        Err(Error::Context("glx: this platform has no X11: use another backend".into()))
    }

    pub(super) fn get_proc_address(&self, _name: &CStr) -> *const c_void {
        match *self {}
    }
}
