//! Opens a context with OSMesa, a library that holds Mesa's software drivers and renders to memory. The library is
//! loaded at run time.

use super::environment::remedy;
use crate::Error;
use libloading::Library;
use std::ffi::{CStr, OsStr, c_char, c_int, c_uint, c_void};
use std::ptr::{self, NonNull};
use std::sync::LazyLock;

/// The library's file name.
const LIBRARY: &str = if cfg!(windows) {
    "osmesa.dll"
} else if cfg!(target_vendor = "apple") {
    "libOSMesa.8.dylib"
} else {
    "libOSMesa.so.8"
};

/// How to install the library.
const INSTALL: &str = if cfg!(windows) {
    "put the osmesa.dll of Mesa for Windows in a folder of PATH"
} else if cfg!(target_vendor = "apple") {
    "install a Mesa before 25.1 that was built with OSMesa"
} else {
    "install the Debian package libosmesa6"
};

/// The drivers of OSMesa that `GALLIUM_DRIVER` may select.
const DRIVERS: [&str; 2] = ["llvmpipe", "softpipe"];

// Constants of GL/osmesa.h and GL/gl.h.
const OSMESA_FORMAT: c_int = 0x22;
const OSMESA_DEPTH_BITS: c_int = 0x30;
const OSMESA_STENCIL_BITS: c_int = 0x31;
const OSMESA_PROFILE: c_int = 0x33;
const OSMESA_CORE_PROFILE: c_int = 0x34;
const OSMESA_CONTEXT_MAJOR_VERSION: c_int = 0x36;
const OSMESA_CONTEXT_MINOR_VERSION: c_int = 0x37;
const OSMESA_RGBA: c_int = 0x1908;
const GL_UNSIGNED_BYTE: c_uint = 0x1401;

// GL/osmesa.h declares its functions with GLAPIENTRY, which is stdcall on 32-bit Windows.
type CreateContextAttribs = unsafe extern "system" fn(attributes: *const c_int, share: *mut c_void) -> *mut c_void;
type MakeCurrent = unsafe extern "system" fn(
    context: *mut c_void,
    buffer: *mut c_void,
    kind: c_uint,
    width: c_int,
    height: c_int,
) -> u8;
type DestroyContext = unsafe extern "system" fn(context: *mut c_void);
type GetProcAddress = unsafe extern "system" fn(name: *const c_char) -> *const c_void;

/// The library, and the functions in it that are called.
struct Functions {
    create_context_attribs: CreateContextAttribs,
    make_current: MakeCurrent,
    destroy_context: DestroyContext,
    get_proc_address: GetProcAddress,
    // The functions above, and every address that `get_proc_address` returned, lie in this library.
    _library: Library,
}

impl Functions {
    fn load(library: &str) -> Result<Functions, String> {
        let missing = |error: libloading::Error| format!("osmesa: {error}: {INSTALL}");
        // SAFETY: the library's initialisers have no preconditions.
        let library = unsafe { Library::new(library) }.map_err(missing)?;
        // SAFETY: the types are those of GL/osmesa.h, and the library is stored together with the addresses.
        unsafe {
            Ok(Functions {
                create_context_attribs: *library.get(b"OSMesaCreateContextAttribs\0").map_err(missing)?,
                make_current: *library.get(b"OSMesaMakeCurrent\0").map_err(missing)?,
                destroy_context: *library.get(b"OSMesaDestroyContext\0").map_err(missing)?,
                get_proc_address: *library.get(b"OSMesaGetProcAddress\0").map_err(missing)?,
                _library: library,
            })
        }
    }

    /// Returns the functions, loaded once per process. The library is deliberately never unloaded: a clone of a
    /// context's `Arc<glow::Context>` may hold addresses of its functions indefinitely, and Mesa's worker threads and
    /// destructors of thread-local variables run its code after the last context is gone.
    fn of_process() -> Result<&'static Functions, Error> {
        static FUNCTIONS: LazyLock<Result<Functions, String>> = LazyLock::new(|| Functions::load(LIBRARY));
        FUNCTIONS.as_ref().map_err(|why| Error::Context(why.clone()))
    }
}

/// An OSMesa context, current on its thread until it is dropped.
pub(super) struct Osmesa {
    functions: &'static Functions,
    context: NonNull<c_void>,
    // OSMesa makes a context current only together with a buffer to draw to. This one is never drawn to or read, but it
    // must outlive the context. It does, because fields are freed after `drop` below has run.
    _buffer: Vec<u8>,
}

impl Osmesa {
    pub(super) fn open() -> Result<Osmesa, Error> {
        check_driver(std::env::var_os("GALLIUM_DRIVER").as_deref())?;
        let functions = Functions::of_process()?;

        // The default framebuffer is never used, so it needs neither depth nor stencil.
        let attributes = [
            [OSMESA_FORMAT, OSMESA_RGBA],
            [OSMESA_DEPTH_BITS, 0],
            [OSMESA_STENCIL_BITS, 0],
            [OSMESA_PROFILE, OSMESA_CORE_PROFILE],
            [OSMESA_CONTEXT_MAJOR_VERSION, 3],
            [OSMESA_CONTEXT_MINOR_VERSION, 3],
            [0, 0],
        ];
        // SAFETY: the list consists of pairs and ends with 0, and no context is given to share objects with.
        let context = unsafe { (functions.create_context_attribs)(attributes.as_ptr().cast(), ptr::null_mut()) };
        let context = NonNull::new(context)
            .ok_or_else(|| Error::Context(format!("osmesa: no OpenGL 3.3 core context: {}", remedy("update Mesa"))))?;

        let (width, height) = (1, 1);
        let mut buffer = vec![0; 4 * width * height];
        let address = buffer.as_mut_ptr().cast();
        let osmesa = Osmesa { functions, context, _buffer: buffer };
        // SAFETY: the buffer holds width x height texels of four bytes, and outlives the context.
        let made = unsafe {
            (functions.make_current)(context.as_ptr(), address, GL_UNSIGNED_BYTE, width as c_int, height as c_int)
        };
        if made == 0 {
            return Err(Error::Context("osmesa: the context cannot be made current: update Mesa".into()));
        }
        Ok(osmesa)
    }

    pub(super) fn get_proc_address(&self, name: &CStr) -> *const c_void {
        // SAFETY: a `CStr` ends with 0.
        unsafe { (self.functions.get_proc_address)(name.as_ptr()) }
    }
}

impl Drop for Osmesa {
    fn drop(&mut self) {
        // SAFETY: the context belongs to this value and is on its own thread. It is no longer current when it is
        // destroyed, and the buffer has not been freed yet.
        unsafe {
            (self.functions.make_current)(ptr::null_mut(), ptr::null_mut(), 0, 0, 0);
            (self.functions.destroy_context)(self.context.as_ptr());
        }
    }
}

/// Refuses drivers that OSMesa does not have, zink included. OSMesa itself crashes if `GALLIUM_DRIVER` names one.
fn check_driver(driver: Option<&OsStr>) -> Result<(), Error> {
    match driver {
        None => Ok(()),
        Some(driver) if driver.is_empty() || DRIVERS.iter().any(|&known| driver == known) => Ok(()),
        Some(driver) => Err(Error::Context(format!(
            "osmesa: it has no driver {driver:?}: unset GALLIUM_DRIVER, or set it to {}",
            DRIVERS.join(" or ")
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_drivers_that_osmesa_has_are_let_through() {
        for driver in [None, Some(""), Some("llvmpipe"), Some("softpipe")] {
            check_driver(driver.map(OsStr::new)).unwrap();
        }
        for driver in ["zink", "nonsense", "LLVMpipe", "llvmpipe "] {
            let error = check_driver(Some(OsStr::new(driver))).unwrap_err().to_string();
            assert!(error.contains(driver) && error.contains("GALLIUM_DRIVER"), "{error}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_library_that_is_not_there_is_named_with_its_package() {
        let error = Functions::load("libOSMesa.so.0-none").err().unwrap();
        assert!(error.contains("libOSMesa.so.0-none") && error.contains("libosmesa6"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_library_without_osmesas_functions_is_refused() {
        let error = Functions::load("libc.so.6").err().unwrap();
        assert!(error.contains("OSMesaCreateContextAttribs"), "{error}");
    }
}
