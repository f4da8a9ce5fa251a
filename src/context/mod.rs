//! Opens an OpenGL 3.3 core context without a window. Three backends can do this: EGL, which uses a GPU or Mesa's
//! software driver, OSMesa, which renders in memory, and GLX, which needs an X display.
//!
//! A context is current on the thread that opened it, from [`Context::open`] until it is dropped. It has no usable
//! default framebuffer, so all rendering must go to framebuffer objects. Several threads may each have a context, from
//! the same backend or from different ones. Each must be joined before the process ends: Mesa releases what it holds
//! for a thread when the thread ends, and the rest at the end of the process. Where both happen at once, the
//! heap is corrupted. The end of a `std::thread::scope` does not wait for a thread's own end; joining its handles does.
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

mod driver_threads;
mod environment;
// glutin has EGL on Windows and on Unix, except on Apple's systems and the web (`egl_backend` in its build script).
// libloading opens libraries on Windows and on Unix. On every other target, a stand-in with the same interface reports
// that the backend is missing.
#[cfg(all(any(unix, windows), not(target_vendor = "apple"), not(target_family = "wasm")))]
mod egl;
#[cfg(not(all(any(unix, windows), not(target_vendor = "apple"), not(target_family = "wasm"))))]
#[path = "without_egl.rs"]
mod egl;
#[cfg(all(any(unix, windows), not(target_vendor = "apple"), not(target_family = "wasm")))]
mod wanted;
// glutin has GLX where there may be X11: on Unix, except on Apple's systems and Android.
#[cfg(all(unix, not(target_vendor = "apple"), not(target_os = "android"), not(target_family = "wasm")))]
mod glx;
#[cfg(not(all(unix, not(target_vendor = "apple"), not(target_os = "android"), not(target_family = "wasm"))))]
#[path = "without_glx.rs"]
mod glx;
#[cfg(any(unix, windows))]
mod osmesa;
#[cfg(not(any(unix, windows)))]
#[path = "without_osmesa.rs"]
mod osmesa;

pub use driver_threads::fewer_threads;

use crate::Error;
use driver_threads::{check_zink, shortage};
use environment::{check_for_osmesa, remedy};
use glow::HasContext as _;
use std::cell::Cell;
use std::ffi::{CStr, c_void};
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;
use std::sync::Arc;

/// The library that creates the context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// The first that works of EGL, OSMesa and, if the environment names an X display, GLX.
    Auto,
    /// EGL: a GPU's driver, or Mesa's software driver. It is not available on macOS.
    Egl,
    /// OSMesa: Mesa's software driver as a single library, which is loaded at run time.
    Osmesa,
    /// GLX: the driver of the X display that `DISPLAY` names. Nothing is shown there.
    Glx,
}

impl Backend {
    /// Every backend that can be asked for.
    pub const ALL: [Backend; 4] = [Backend::Auto, Backend::Egl, Backend::Osmesa, Backend::Glx];

    /// The name of every backend, as the command line spells it.
    pub const NAMES: [&'static str; 4] =
        [Backend::Auto.name(), Backend::Egl.name(), Backend::Osmesa.name(), Backend::Glx.name()];

    /// Returns the backend's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Backend::Auto => "auto",
            Backend::Egl => "egl",
            Backend::Osmesa => "osmesa",
            Backend::Glx => "glx",
        }
    }
}

impl FromStr for Backend {
    type Err = Error;

    fn from_str(name: &str) -> Result<Backend, Error> {
        Backend::ALL.into_iter().find(|backend| backend.name() == name).ok_or_else(|| {
            Error::Usage(format!("--backend: '{}' is not one of {}", Error::shown(name), Backend::NAMES.join(", ")))
        })
    }
}

/// An OpenGL 3.3 core context without a window, current on the thread that made it until it is dropped.
///
/// A thread has at most one such context. The context cannot be sent to or shared with another thread:
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
/// Opening a context makes it current in place of any context that the caller made current by other means. An
/// application that has its own context does not need this type.
#[must_use = "the context is destroyed when it is dropped"]
pub struct Context {
    gl: Arc<glow::Context>,
    platform: Platform,
    passed_over: Option<String>,
    // Fields are dropped in the order of their declaration. `platform` must come before this one: its context must be
    // destroyed before the thread may open another.
    _place: ThreadsPlace,
    // A context is current on one thread only. The raw pointer keeps the type from being Send or Sync.
    _stays: PhantomData<*const ()>,
}

impl Context {
    /// Opens a context by `backend` and makes it current on this thread.
    ///
    /// # Errors
    ///
    /// [`Error::Context`] in these cases. The message says why, and what to install or to change.
    ///
    /// - This thread already has a context, or none can be opened.
    /// - The environment has a variable with which Mesa would crash or wait for ever.
    /// - The driver is Mesa's llvmpipe, and it cannot start all of its threads. See [`fewer_threads`].
    pub fn open(backend: Backend) -> Result<Context, Error> {
        environment::check()?;
        match backend {
            Backend::Auto if std::env::var_os("DISPLAY").is_some() => {
                Context::open_first(&[Backend::Egl, Backend::Osmesa, Backend::Glx])
            }
            Backend::Auto => Context::open_first(&[Backend::Egl, Backend::Osmesa]),
            Backend::Egl => Context::open_on(|| {
                check_zink()?;
                egl::Egl::open().map(Platform::Egl)
            }),
            Backend::Osmesa => Context::open_on(|| {
                check_for_osmesa()?;
                osmesa::Osmesa::open().map(Platform::Osmesa)
            }),
            Backend::Glx => Context::open_on(|| {
                check_zink()?;
                glx::Glx::open().map(Platform::Glx)
            }),
        }
    }

    fn open_first(backends: &[Backend]) -> Result<Context, Error> {
        // If the thread already has a context, this reports it once rather than once for each backend.
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
        let fewer = fewer_threads();
        let platform = open()?;
        // SAFETY: the platform's context is current on this thread, and the addresses come from that platform.
        let gl = unsafe { glow::Context::from_loader_function_cstr(|name| platform.get_proc_address(name)) };
        let context = Context { gl: Arc::new(gl), platform, passed_over: None, _place: place, _stays: PhantomData };
        context.check_version()?;
        match fewer {
            // zink's name for itself contains that of the driver below it.
            Some(fewer) if context.renderer().contains("llvmpipe") => Err(shortage(context.backend().name(), fewer)),
            _ => Ok(context),
        }
    }

    /// Refuses a context that is not OpenGL 3.3 core. Drivers give at least the version that was asked for, or fail.
    /// The exception is an environment variable that overrides Mesa's version: `MESA_GL_VERSION_OVERRIDE=3.3COMPAT`
    /// gives a compatibility profile.
    fn check_version(&self) -> Result<(), Error> {
        let version = self.gl.version();
        // SAFETY: the context is current on this thread. Versions before 3.2, which have no profiles, are ruled out
        // first.
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

    /// OpenGL's functions. They may be called only on this context's thread and only before the context is dropped,
    /// which is when it is current.
    #[must_use]
    pub fn gl(&self) -> &Arc<glow::Context> {
        &self.gl
    }

    /// Returns the backend that provides the context: [`Backend::Egl`] or [`Backend::Osmesa`], never [`Backend::Auto`].
    #[must_use]
    pub fn backend(&self) -> Backend {
        match self.platform {
            Platform::Egl(_) => Backend::Egl,
            Platform::Osmesa(_) => Backend::Osmesa,
            Platform::Glx(_) => Backend::Glx,
        }
    }

    /// Describes the backend, the renderer and its version for people, in one line:
    /// `egl: llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5 (Core Profile) Mesa 22.3.6`.
    #[must_use]
    pub fn describe(&self) -> String {
        format!("{}: {}, OpenGL {}", self.backend().name(), self.renderer(), self.version())
    }

    /// Returns the renderer, as the driver names it.
    pub fn renderer(&self) -> String {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        unsafe { self.gl.get_parameter_string(glow::RENDERER) }
    }

    /// Returns the version of OpenGL, as the driver words it.
    pub fn version(&self) -> String {
        // SAFETY: the context is current on this thread, and this is a core parameter.
        unsafe { self.gl.get_parameter_string(glow::VERSION) }
    }

    /// If [`Backend::Auto`] tried another backend before this one: why that backend failed, in one line. Otherwise
    /// `None`.
    #[must_use]
    pub fn passed_over(&self) -> Option<&str> {
        self.passed_over.as_deref()
    }

    /// Returns the address of OpenGL's function `name`, for a loader other than glow, or null if the backend does not
    /// know the function. Some EGL libraries return an address for any name, so an address does not prove that the
    /// driver has the function.
    #[must_use]
    pub fn get_proc_address(&self, name: &CStr) -> *const c_void {
        self.platform.get_proc_address(name)
    }
}

impl fmt::Debug for Context {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context").field("backend", &self.backend()).finish_non_exhaustive()
    }
}

/// The context of either library. It is current from when it is opened until it is dropped.
enum Platform {
    Egl(egl::Egl),
    Osmesa(osmesa::Osmesa),
    Glx(glx::Glx),
}

impl Platform {
    fn get_proc_address(&self, name: &CStr) -> *const c_void {
        match self {
            Platform::Egl(egl) => egl.get_proc_address(name),
            Platform::Osmesa(osmesa) => osmesa.get_proc_address(name),
            Platform::Glx(glx) => glx.get_proc_address(name),
        }
    }
}

thread_local! {
    static TAKEN: Cell<bool> = const { Cell::new(false) };
}

/// This thread's permission to have a context. There is one per thread, and dropping this value gives it back.
///
/// Two contexts on one thread would have to be made current in turns. EGL and OSMesa would not even notice each other:
/// both come from Mesa and share its thread-local table of entry points.
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
        let error = "wgl".parse::<Backend>().unwrap_err();
        assert!(error.is_usage());
        assert_eq!(error.to_string(), "--backend: 'wgl' is not one of auto, egl, osmesa, glx");
    }
}
