//! Opens a context with EGL, on an EGL device rather than a display, and without a surface.

use super::environment::remedy;
use super::wanted;
use crate::Error;
use glutin::api::egl::context::PossiblyCurrentContext;
use glutin::api::egl::device::Device;
use glutin::api::egl::display::Display;
use glutin::config::ConfigSurfaceTypes;
use glutin::display::GetGlDisplay as _;
use glutin::error::ErrorKind;
use glutin::prelude::*;
use std::ffi::{CStr, c_void};

/// The library that glutin opens.
const LIBRARY: &str = if cfg!(windows) { "libEGL.dll" } else { "libEGL.so.1" };

/// What to install: the library, and on Debian also Mesa's drivers, which the library's package does not bring along.
const INSTALL: &str = if cfg!(windows) {
    "put the libEGL.dll of Mesa for Windows in a folder of PATH"
} else {
    "install the Debian packages libegl1 libgl1-mesa-dri"
};

/// An EGL context, current on its thread until it is dropped.
pub(super) struct Egl(PossiblyCurrentContext);

impl Egl {
    /// Opens a context on the first device that provides OpenGL 3.3 core. EGL lists GPUs before software renderers.
    pub(super) fn open() -> Result<Egl, Error> {
        let devices = Device::query_devices().map_err(|error| match error.error_kind() {
            ErrorKind::NotFound => Error::Context(format!("egl: {LIBRARY} cannot be loaded: {INSTALL}")),
            _ => Error::Context(format!("egl: the devices cannot be listed: {error}: {}", remedy(INSTALL))),
        })?;

        let mut failures = Vec::new();
        for device in devices {
            match open_on(&device) {
                Ok(context) => return Ok(Egl(context)),
                Err(error) => failures.push(format!("device {}: {error}", failures.len() + 1)),
            }
        }
        let why = if failures.is_empty() { "there is no device".into() } else { failures.join(", ") };
        Err(Error::Context(format!("egl: no OpenGL 3.3 core context ({why}): {}", remedy(INSTALL))))
    }

    pub(super) fn get_proc_address(&self, name: &CStr) -> *const c_void {
        self.0.display().get_proc_address(name)
    }
}

impl Drop for Egl {
    fn drop(&mut self) {
        // A context that is destroyed while it is current lives on until its thread makes another one current. That is
        // also what happens if this call fails, and a destructor cannot report the failure.
        let _ = self.0.make_not_current_in_place();
    }
}

fn open_on(device: &Device) -> Result<PossiblyCurrentContext, glutin::error::Error> {
    // SAFETY: a native display would have to be valid, but none is passed.
    let display = unsafe { Display::with_device(device, None)? };

    // SAFETY: the template names no native window.
    let config = unsafe { display.find_configs(wanted::configuration(ConfigSurfaceTypes::empty()))? }
        .next()
        .ok_or(ErrorKind::BadConfig)?;
    // SAFETY: the attributes name neither a native window nor a context to share objects with.
    let context = unsafe { display.create_context(&config, &wanted::context())? };
    context.make_current_surfaceless()
}
