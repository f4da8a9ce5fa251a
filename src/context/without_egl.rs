//! Stands in for `egl.rs` on platforms where glutin has no EGL: macOS, iOS and the web.

use crate::Error;
use std::ffi::{CStr, c_void};

/// An EGL context on a platform without EGL. The type has no values, so its methods are never reached.
pub(super) enum Egl {}

impl Egl {
    /// Always fails.
    pub(super) fn open() -> Result<Egl, Error> {
        Err(Error::Context("egl: this platform has no EGL: use the backend osmesa (--backend osmesa)".into()))
    }

    pub(super) fn get_proc_address(&self, _name: &CStr) -> *const c_void {
        match *self {}
    }
}
