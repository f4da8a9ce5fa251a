//! Opens a context with GLX, on the X display that the environment variable `DISPLAY` names: for drivers that have no
//! EGL devices, as those of the GeForce 8 may be the last to support it. Nothing is shown: the context is current on a
//! pixel buffer, or, where the server has none, on a window that is never mapped.

use super::environment::remedy;
use super::wanted;
use crate::Error;
use glutin::api::glx::XlibErrorHookRegistrar;
use glutin::api::glx::config::Config;
use glutin::api::glx::context::{NotCurrentContext, PossiblyCurrentContext};
use glutin::api::glx::display::Display;
use glutin::api::glx::surface::Surface;
use glutin::config::ConfigSurfaceTypes;
use glutin::error::ErrorKind;
use glutin::platform::x11::X11GlConfigExt as _;
use glutin::prelude::*;
use glutin::surface::{PbufferSurface, SurfaceAttributesBuilder, WindowSurface};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle, XlibDisplayHandle, XlibWindowHandle};
use std::ffi::{CStr, c_int, c_ulong, c_void};
use std::num::NonZeroU32;
use std::ptr::{self, NonNull};
use std::sync::{Mutex, OnceLock, PoisonError};
use x11_dl::xlib::{self, Xlib};

/// What to install: the libraries, and Mesa's drivers.
const INSTALL: &str = "install the Debian packages libx11-6 libgl1 libglx-mesa0";

/// The width and height of the surface, which nothing is drawn to: all rendering goes to framebuffer objects.
const SIDE: NonZeroU32 = NonZeroU32::MIN;

/// A GLX context, current on its thread until it is dropped.
pub(super) struct Glx {
    // Fields are dropped in the order of their declaration: the context before its surface, and both before the
    // connection to the X server.
    context: Option<PossiblyCurrentContext>,
    display: Display,
    _surface: Drawable,
    _connection: Connection,
}

/// What the context is current on.
enum Drawable {
    Pbuffer { _surface: Surface<PbufferSurface> },
    Window { _surface: Surface<WindowSurface>, _window: HiddenWindow },
}

impl Glx {
    /// Opens a context of OpenGL 3.3 core.
    pub(super) fn open() -> Result<Glx, Error> {
        Glx::open_on(None, &[Glx::on_pbuffer, Glx::on_window])
    }

    /// Opens a context on the X display of this name, and on the first kind of surface that works. Without a name it is
    /// the one that `DISPLAY` names.
    fn open_on(name: Option<&CStr>, kinds: &[Kind]) -> Result<Glx, Error> {
        let connection = Connection::open(name)?;
        let _errors = ErrorHandler::install(connection.xlib);
        let failed = |error: &dyn std::fmt::Display| {
            Error::Context(format!("glx: no OpenGL 3.3 core context ({error}): {}", remedy(INSTALL)))
        };
        // SAFETY: the connection stays open for as long as the display is used: see the order of the fields.
        let display = unsafe { Display::new(connection.handle(), ErrorHandler::registrar()) }.map_err(|error| {
            match error.error_kind() {
                ErrorKind::NotFound => Error::Context(format!("glx: libGL.so.1 cannot be loaded: {INSTALL}")),
                ErrorKind::InitializationFailed => {
                    Error::Context("glx: the X server has no GLX: start it with its extension GLX".into())
                }
                _ => failed(&error),
            }
        })?;
        let mut failures = Vec::new();
        for kind in kinds {
            match kind(&display, &connection) {
                Ok((context, surface)) => {
                    return Ok(Glx { context: Some(context), display, _surface: surface, _connection: connection });
                }
                Err(error) => failures.push(error.to_string()),
            }
        }
        Err(failed(&failures.join(", ")))
    }

    fn on_pbuffer(
        display: &Display,
        _: &Connection,
    ) -> Result<(PossiblyCurrentContext, Drawable), glutin::error::Error> {
        let (config, context) = context(display, ConfigSurfaceTypes::PBUFFER)?;
        let attributes = SurfaceAttributesBuilder::<PbufferSurface>::new().build(SIDE, SIDE);
        // SAFETY: a pixel buffer needs no native object.
        let surface = unsafe { display.create_pbuffer_surface(&config, &attributes)? };
        Ok((context.make_current(&surface)?, Drawable::Pbuffer { _surface: surface }))
    }

    fn on_window(
        display: &Display,
        connection: &Connection,
    ) -> Result<(PossiblyCurrentContext, Drawable), glutin::error::Error> {
        let (config, context) = context(display, ConfigSurfaceTypes::WINDOW)?;
        let window = HiddenWindow::new(connection, &config).ok_or(ErrorKind::BadNativeWindow)?;
        let handle = RawWindowHandle::Xlib(XlibWindowHandle::new(window.id));
        let attributes = SurfaceAttributesBuilder::<WindowSurface>::new().build(handle, SIDE, SIDE);
        // SAFETY: the window outlives the surface: see the order of the fields of `Drawable::Window`.
        let surface = unsafe { display.create_window_surface(&config, &attributes)? };
        Ok((context.make_current(&surface)?, Drawable::Window { _surface: surface, _window: window }))
    }

    pub(super) fn get_proc_address(&self, name: &CStr) -> *const c_void {
        self.display.get_proc_address(name)
    }
}

/// A way to make a context current on a surface.
type Kind = fn(&Display, &Connection) -> Result<(PossiblyCurrentContext, Drawable), glutin::error::Error>;

/// Makes a context for surfaces of this type.
fn context(display: &Display, kind: ConfigSurfaceTypes) -> Result<(Config, NotCurrentContext), glutin::error::Error> {
    // SAFETY: the template names no native window.
    let config = unsafe { display.find_configs(wanted::configuration(kind))? }.next().ok_or(ErrorKind::BadConfig)?;
    // SAFETY: the attributes name neither a native window nor a context to share objects with.
    let context = unsafe { display.create_context(&config, &wanted::context())? };
    Ok((config, context))
}

impl Drop for Glx {
    fn drop(&mut self) {
        // A context that is current when it is destroyed lives on until its thread makes another one current.
        if let Some(context) = self.context.take() {
            let _ = context.make_not_current();
        }
    }
}

/// Returns Xlib, which is loaded once, and set up for use by several threads.
fn xlib() -> Result<&'static Xlib, Error> {
    static XLIB: OnceLock<Option<Xlib>> = OnceLock::new();
    let loaded = XLIB.get_or_init(|| {
        let xlib = Xlib::open().ok()?;
        // SAFETY: the function has no preconditions, and is the first of Xlib's that this library calls.
        (unsafe { (xlib.XInitThreads)() } != 0).then_some(xlib)
    });
    loaded.as_ref().ok_or_else(|| Error::Context(format!("glx: libX11.so.6 cannot be loaded: {INSTALL}")))
}

/// A connection to an X server, closed when it is dropped.
struct Connection {
    xlib: &'static Xlib,
    display: NonNull<xlib::Display>,
}

impl Connection {
    /// Connects to the server of this name, or without one to that which `DISPLAY` names.
    fn open(name: Option<&CStr>) -> Result<Connection, Error> {
        let xlib = xlib()?;
        // SAFETY: without a name, Xlib reads it from the environment.
        let display = unsafe { (xlib.XOpenDisplay)(name.map_or(ptr::null(), CStr::as_ptr)) };
        let display = NonNull::new(display).ok_or_else(|| {
            let why = match std::env::var_os("DISPLAY") {
                None => "DISPLAY names no X display: start the command in an X session, or by xvfb-run".into(),
                Some(name) => {
                    let name = name.to_string_lossy();
                    format!("the X display '{}' cannot be opened: set DISPLAY to one that runs", Error::shown(&name))
                }
            };
            Error::Context(format!("glx: {why}"))
        })?;
        Ok(Connection { xlib, display })
    }

    fn screen(&self) -> c_int {
        // SAFETY: the connection is open.
        unsafe { (self.xlib.XDefaultScreen)(self.display.as_ptr()) }
    }

    fn handle(&self) -> RawDisplayHandle {
        XlibDisplayHandle::new(Some(self.display.cast()), self.screen()).into()
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // SAFETY: the connection is open, and all that used it is gone.
        unsafe { (self.xlib.XCloseDisplay)(self.display.as_ptr()) };
    }
}

/// A window that is never mapped, destroyed when it is dropped.
struct HiddenWindow {
    xlib: &'static Xlib,
    display: NonNull<xlib::Display>,
    id: c_ulong,
}

impl HiddenWindow {
    /// Makes a window whose pixels are those of the configuration. `None` if there is no such window.
    fn new(connection: &Connection, config: &Config) -> Option<HiddenWindow> {
        let visual = config.x11_visual()?;
        let &Connection { xlib, display } = connection;
        // SAFETY: the connection is open, and the visual is one of its server's. Xlib reports a failure to the error
        // handler, and glutin then refuses the window.
        let id = unsafe {
            let raw = visual.into_raw().cast_mut();
            let visual = *raw.cast::<xlib::XVisualInfo>();
            (xlib.XFree)(raw);
            let root = (xlib.XDefaultRootWindow)(display.as_ptr());
            let mut attributes: xlib::XSetWindowAttributes = std::mem::zeroed();
            attributes.colormap = (xlib.XCreateColormap)(display.as_ptr(), root, visual.visual, xlib::AllocNone);
            let (input_output, depth) = (xlib::InputOutput as u32, visual.depth);
            let values = xlib::CWColormap | xlib::CWBorderPixel;
            (xlib.XCreateWindow)(
                display.as_ptr(),
                root,
                0,
                0,
                1,
                1,
                0,
                depth,
                input_output,
                visual.visual,
                values,
                &raw mut attributes,
            )
        };
        (id != 0).then_some(HiddenWindow { xlib, display, id })
    }
}

impl Drop for HiddenWindow {
    fn drop(&mut self) {
        // SAFETY: the connection is still open: see the order of the fields of `Glx`.
        unsafe { (self.xlib.XDestroyWindow)(self.display.as_ptr(), self.id) };
    }
}

/// glutin's handler of errors that the X server reports. Xlib's own handler would end the process.
type Hook = Box<dyn Fn(*mut c_void, *mut c_void) -> bool + Send + Sync>;

static HOOK: Mutex<Option<Hook>> = Mutex::new(None);

type Handler = unsafe extern "C" fn(*mut xlib::Display, *mut xlib::XErrorEvent) -> c_int;

/// The process's handler of X errors while a context is opened. The earlier one is put back when this value is dropped.
struct ErrorHandler {
    xlib: &'static Xlib,
    earlier: Option<Handler>,
}

impl ErrorHandler {
    fn install(xlib: &'static Xlib) -> ErrorHandler {
        // SAFETY: the handler has the type that Xlib asks for, and calls nothing of Xlib's.
        ErrorHandler { xlib, earlier: unsafe { (xlib.XSetErrorHandler)(Some(handle)) } }
    }

    /// Returns the function by which glutin gives its handler.
    fn registrar() -> XlibErrorHookRegistrar {
        Box::new(|hook| *HOOK.lock().unwrap_or_else(PoisonError::into_inner) = Some(hook))
    }
}

impl Drop for ErrorHandler {
    fn drop(&mut self) {
        // SAFETY: the handler is the one that was set before.
        unsafe { (self.xlib.XSetErrorHandler)(self.earlier) };
    }
}

unsafe extern "C" fn handle(display: *mut xlib::Display, event: *mut xlib::XErrorEvent) -> c_int {
    if let Some(hook) = &*HOOK.lock().unwrap_or_else(PoisonError::into_inner) {
        hook(display.cast(), event.cast());
    }
    0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glow::HasContext as _;
    use std::ffi::CString;
    use std::io::{BufRead as _, BufReader};
    use std::process::{Command, Stdio};

    #[test]
    fn a_hidden_window_serves_where_there_are_no_pixel_buffers() {
        let mut server = Command::new("Xvfb");
        server.args(["-displayfd", "1", "-noreset", "-screen", "0", "64x64x24"]).stderr(Stdio::null());
        let Ok(mut server) = server.stdout(Stdio::piped()).spawn() else {
            assert!(std::env::var_os("HBAO_REQUIRE_TOOLS").is_none(), "Xvfb is missing: install xvfb");
            eprintln!("not tested: Xvfb is missing");
            return;
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        let name = CString::new(format!(":{}", number.trim())).unwrap();
        let tried = std::panic::catch_unwind(|| {
            for kinds in [[Glx::on_pbuffer as Kind], [Glx::on_window as Kind]] {
                let glx = Glx::open_on(Some(&name), &kinds).unwrap();
                // SAFETY: the context is current, and the addresses are its own.
                let gl = unsafe { glow::Context::from_loader_function_cstr(|name| glx.get_proc_address(name)) };
                assert!((gl.version().major, gl.version().minor) >= (3, 3));
            }
        });
        server.kill().unwrap();
        server.wait().unwrap();
        tried.unwrap();
    }
}
