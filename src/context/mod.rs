//! How an OpenGL 3.3 core context is had on a machine without a window: by EGL on a device, or by OSMesa in memory.
//!
//! A context is current on the thread that made it, from [`Context::open`] until it is dropped. It has no framebuffer
//! worth drawing to: render to framebuffer objects. Several threads may each have one, by the same backend or not.
//!
//! ```no_run
//! use glow::HasContext as _;
//! use hbao::context::{Backend, Context};
//!
//! let context = Context::open(Backend::Auto)?;
//! println!("{}", context.describe()); // egl: llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5 (Core Profile) Mesa 22.3.6
//! // SAFETY: the context is current on this thread.
//! unsafe { context.gl().clear_color(0.0, 0.0, 0.0, 1.0) };
//! # Ok::<(), hbao::Error>(())
//! ```

mod egl;
mod osmesa;

use crate::Error;
use glow::HasContext as _;
use std::cell::Cell;
use std::ffi::{CStr, c_void};
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;
use std::sync::Arc;

/// Which library gives the context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// The first of EGL and OSMesa that works.
    Auto,
    /// EGL: a GPU's driver without a window, or Mesa's software driver.
    Egl,
    /// OSMesa: Mesa's software driver in one library.
    Osmesa,
}

impl Backend {
    const ALL: [Backend; 3] = [Backend::Auto, Backend::Egl, Backend::Osmesa];

    /// Every backend's name, as the command line and settings files spell it.
    pub const NAMES: [&'static str; 3] = [Backend::Auto.name(), Backend::Egl.name(), Backend::Osmesa.name()];

    /// The backend's name.
    pub const fn name(self) -> &'static str {
        match self {
            Backend::Auto => "auto",
            Backend::Egl => "egl",
            Backend::Osmesa => "osmesa",
        }
    }
}

impl FromStr for Backend {
    type Err = Error;

    fn from_str(name: &str) -> Result<Backend, Error> {
        Backend::ALL.into_iter().find(|backend| backend.name() == name).ok_or_else(|| {
            Error::Usage(format!("there is no backend {name:?}: choose one of {}", Backend::NAMES.join(", ")))
        })
    }
}

/// An OpenGL 3.3 core context without a window, current on the thread that made it until it is dropped.
///
/// A thread has at most one, and it stays on its thread:
///
/// ```compile_fail,E0277
/// fn sent_to_another_thread<T: Send>() {}
/// sent_to_another_thread::<hbao::context::Context>();
/// ```
///
/// ```compile_fail,E0277
/// fn shared_between_threads<T: Sync>() {}
/// shared_between_threads::<hbao::context::Context>();
/// ```
///
/// Opening one replaces a context that the caller made current by other means; an application that has a context of
/// its own does not need this type.
pub struct Context {
    gl: Arc<glow::Context>,
    platform: Platform,
    passed_over: Option<String>,
    // Fields are dropped in this order: the platform's context must be gone before the thread may have another.
    _place: ThreadsPlace,
    // Being current is a matter between a context and one thread, so neither Send nor Sync.
    _stays: PhantomData<*const ()>,
}

impl Context {
    /// Opens a context by `backend` and makes it current on this thread.
    ///
    /// # Errors
    ///
    /// [`Error::Context`] if this thread already has one, or if none could be had: why not, and what to install.
    pub fn open(backend: Backend) -> Result<Context, Error> {
        match backend {
            Backend::Auto => Context::open_first(&[Backend::Egl, Backend::Osmesa]),
            Backend::Egl => Context::open_on(|| egl::Egl::open().map(Platform::Egl)),
            Backend::Osmesa => Context::open_on(|| osmesa::Osmesa::open().map(Platform::Osmesa)),
        }
    }

    fn open_first(backends: &[Backend]) -> Result<Context, Error> {
        // A thread that already has a context is told so once, not once for each backend.
        drop(ThreadsPlace::take()?);
        let mut failures = Vec::new();
        for &backend in backends {
            match Context::open(backend) {
                Ok(context) if failures.is_empty() => return Ok(context),
                Ok(context) => return Ok(Context { passed_over: Some(failures.join("; ")), ..context }),
                Err(error) => failures.push(error.to_string()),
            }
        }
        Err(Error::Context(format!("no backend works: {}", failures.join("; "))))
    }

    fn open_on(open: impl FnOnce() -> Result<Platform, Error>) -> Result<Context, Error> {
        let place = ThreadsPlace::take()?;
        let platform = open()?;
        // SAFETY: the platform's context is current on this thread, and these are its own entry points.
        let gl = unsafe { glow::Context::from_loader_function_cstr(|name| platform.get_proc_address(name)) };
        let context = Context { gl: Arc::new(gl), platform, passed_over: None, _place: place, _stays: PhantomData };
        context.check_version()?;
        Ok(context)
    }

    /// Drivers give at least what was asked for, or nothing. Not so where the environment overrides what they report:
    /// `MESA_GL_VERSION_OVERRIDE=3.3COMPAT` has another profile given.
    fn check_version(&self) -> Result<(), Error> {
        let version = self.gl.version();
        // SAFETY: the context is current on this thread. The profile is asked only of a version that has profiles.
        let fits = !version.is_embedded
            && (version.major, version.minor) >= (3, 3)
            && unsafe {
                self.gl.get_parameter_i32(glow::CONTEXT_PROFILE_MASK) & glow::CONTEXT_CORE_PROFILE_BIT as i32 != 0
            };
        if fits {
            return Ok(());
        }
        let remedy = remedy("update the driver");
        Err(Error::Context(format!("{}: this is not OpenGL 3.3 core: {remedy}", self.describe())))
    }

    /// OpenGL's functions. They act on this context while it is current, so on its thread and until it is dropped.
    pub fn gl(&self) -> &Arc<glow::Context> {
        &self.gl
    }

    /// The backend that gave the context: [`Backend::Egl`] or [`Backend::Osmesa`], never [`Backend::Auto`].
    pub fn backend(&self) -> Backend {
        match self.platform {
            Platform::Egl(_) => Backend::Egl,
            Platform::Osmesa(_) => Backend::Osmesa,
        }
    }

    /// The backend, the renderer and its version in one line, for people to read:
    /// `egl: llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5 (Core Profile) Mesa 22.3.6`.
    pub fn describe(&self) -> String {
        format!("{}: {}, OpenGL {}", self.backend().name(), self.renderer(), self.version())
    }

    /// The renderer, as the driver names it.
    pub fn renderer(&self) -> String {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        unsafe { self.gl.get_parameter_string(glow::RENDERER) }
    }

    /// The version of OpenGL, as the driver words it.
    pub fn version(&self) -> String {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        unsafe { self.gl.get_parameter_string(glow::VERSION) }
    }

    /// Why [`Backend::Auto`] passed over the backends that it tried before this one, in one line; none where it did
    /// not.
    pub fn passed_over(&self) -> Option<&str> {
        self.passed_over.as_deref()
    }

    /// The address of OpenGL's function `name`, for a loader other than glow. Null where the backend knows none; but
    /// some EGL libraries answer any name, so an address is no proof that the driver has the function.
    pub fn get_proc_address(&self, name: &CStr) -> *const c_void {
        self.platform.get_proc_address(name)
    }
}

impl fmt::Debug for Context {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context").field("backend", &self.backend()).finish_non_exhaustive()
    }
}

/// What to do about a driver that refuses: `first`, and to take back what the environment asks of Mesa, if anything.
fn remedy(first: &str) -> String {
    const ASKING: [&str; 4] =
        ["GALLIUM_DRIVER", "LIBGL_DRIVERS_PATH", "MESA_GL_VERSION_OVERRIDE", "MESA_LOADER_DRIVER_OVERRIDE"];
    let set: Vec<_> = ASKING.into_iter().filter(|variable| std::env::var_os(variable).is_some()).collect();
    if set.is_empty() { first.into() } else { format!("{first}, or unset {}", set.join(" and ")) }
}

/// A context of either library, current from when it is opened until it is dropped.
enum Platform {
    Egl(egl::Egl),
    Osmesa(osmesa::Osmesa),
}

impl Platform {
    fn get_proc_address(&self, name: &CStr) -> *const c_void {
        match self {
            Platform::Egl(egl) => egl.get_proc_address(name),
            Platform::Osmesa(osmesa) => osmesa.get_proc_address(name),
        }
    }
}

thread_local! {
    static TAKEN: Cell<bool> = const { Cell::new(false) };
}

/// This thread's one place for a context, free again when dropped.
///
/// Two contexts on a thread would need to be made current in turns, and EGL and OSMesa would not even notice each
/// other: they come from one Mesa and share its thread-local table of entry points.
struct ThreadsPlace(());

impl ThreadsPlace {
    fn take() -> Result<ThreadsPlace, Error> {
        if TAKEN.replace(true) {
            return Err(Error::Context(
                "this thread already has an OpenGL context: drop it first, or open the second on another thread".into(),
            ));
        }
        Ok(ThreadsPlace(()))
    }
}

impl Drop for ThreadsPlace {
    fn drop(&mut self) {
        TAKEN.set(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backends_are_read_by_their_names() {
        for (backend, name) in Backend::ALL.into_iter().zip(Backend::NAMES) {
            assert_eq!(name.parse::<Backend>().unwrap(), backend);
        }
    }

    #[test]
    fn an_unknown_backend_is_a_usage_error_that_lists_the_known() {
        let error = "glx".parse::<Backend>().unwrap_err();
        assert!(error.is_usage());
        assert_eq!(error.to_string(), r#"there is no backend "glx": choose one of auto, egl, osmesa"#);
    }
}
