//! What the drivers complain of, for the log: OpenGL errors, and messages of medium and high severity of the driver's
//! debug output. Both contexts are heard, that of the window and that of the thread that renders.

use hbao::glow::{self, HasContext as _};
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// If this environment variable names a context, an OpenGL error is made in it once, so that a test can see that it is
/// heard. It has no effect without `--log`.
const PLANT: &str = "HBAO_PLANT_GL_ERROR";

/// The complaints that no line of the log has yet. All clones share one list.
#[derive(Clone, Default)]
pub(super) struct Complaints(Arc<Mutex<Vec<String>>>);

impl Complaints {
    /// Takes the complaints so far.
    pub(super) fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn add(&self, complaint: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(complaint);
    }
}

/// A context that is heard.
pub(super) struct Heard {
    gl: Arc<glow::Context>,
    /// What the log calls the context: `window` or `render`.
    name: &'static str,
    complaints: Complaints,
    /// Whether the driver has debug output. Without it, only errors are heard.
    has_debug_output: bool,
    planted: bool,
}

/// What the driver's callback is given. It lives as long as the program, because a context may outlive [`Heard`].
struct Ear {
    name: &'static str,
    complaints: Complaints,
}

type Callback = unsafe extern "system" fn(u32, u32, u32, u32, i32, *const c_char, *const c_void);

impl Heard {
    /// Listens to the context from here on. `load` returns the address of an OpenGL function, or null.
    ///
    /// # Safety
    /// The context must be current. An address that is not null must be that of the function of this name in it.
    pub(super) unsafe fn new(
        gl: &Arc<glow::Context>,
        load: impl Fn(&CStr) -> *const c_void,
        name: &'static str,
        complaints: &Complaints,
    ) -> Heard {
        let mut heard = Heard {
            gl: gl.clone(),
            name,
            complaints: complaints.clone(),
            has_debug_output: false,
            planted: std::env::var(PLANT).is_ok_and(|context| context == name),
        };
        // The loader is asked too, because it may lack functions of an extension that the driver has.
        let [set, control] = [load(c"glDebugMessageCallback"), load(c"glDebugMessageControl")];
        if !gl.supports_debug() || set.is_null() || control.is_null() {
            return heard;
        }
        let ear: &'static Ear = Box::leak(Box::new(Ear { name, complaints: complaints.clone() }));
        // SAFETY: the addresses are those of functions with these signatures, and the context is current, by the
        // contract of this function. What the callback is given lives for ever.
        unsafe {
            let set = std::mem::transmute::<*const c_void, unsafe extern "system" fn(Callback, *const c_void)>(set);
            let control = std::mem::transmute::<
                *const c_void,
                unsafe extern "system" fn(u32, u32, u32, i32, *const u32, u8),
            >(control);
            gl.enable(glow::DEBUG_OUTPUT);
            // Each message arrives during the call that it is about.
            gl.enable(glow::DEBUG_OUTPUT_SYNCHRONOUS);
            for severity in [glow::DEBUG_SEVERITY_HIGH, glow::DEBUG_SEVERITY_MEDIUM] {
                control(glow::DONT_CARE, glow::DONT_CARE, severity, 0, std::ptr::null(), 1);
            }
            set(hear, std::ptr::from_ref(ear).cast());
        }
        heard.has_debug_output = true;
        heard
    }

    /// Asks for errors, which a driver without debug output does not report by itself. The context must be current.
    pub(super) fn ask(&mut self) {
        if std::mem::take(&mut self.planted) {
            // SAFETY: the context is current. OpenGL has no capability with the number 0, so that this is an error.
            unsafe { self.gl.enable(0) };
        }
        // The number is bounded because a lost context may report errors without end.
        for _ in 0..16 {
            // SAFETY: the context is current.
            match unsafe { self.gl.get_error() } {
                glow::NO_ERROR => break,
                // The message of this error has arrived already, and says more.
                _ if self.has_debug_output => {}
                code => self.complaints.add(format!("{}: OpenGL error 0x{code:04x}", self.name)),
            }
        }
    }
}

/// Notes a message of the driver.
unsafe extern "system" fn hear(
    _source: u32,
    _kind: u32,
    _id: u32,
    severity: u32,
    length: i32,
    text: *const c_char,
    ear: *const c_void,
) {
    let severity = match severity {
        glow::DEBUG_SEVERITY_HIGH => "high",
        glow::DEBUG_SEVERITY_MEDIUM => "medium",
        _ => return,
    };
    // SAFETY: the driver gives a text of this length, and what `Heard::new` gave it, which lives for ever.
    let (text, ear) = unsafe {
        let bytes = std::slice::from_raw_parts(text.cast::<u8>(), usize::try_from(length).unwrap_or(0));
        (String::from_utf8_lossy(bytes), &*ear.cast::<Ear>())
    };
    ear.complaints.add(format!("{}: {severity}: {}", ear.name, text.trim().replace('\n', " ")));
}

/// What to do about a driver that gives the window too little.
pub(super) const REMEDY: &str = "update the driver, or set LIBGL_ALWAYS_SOFTWARE=1";

/// Says why a context cannot be used, if it has less than OpenGL 3.3. The window would be drawn with less, but a driver
/// that gives less here is not the one that was asked for, and its window may be anything.
pub(super) fn too_old(version: &glow::Version, renderer: &str) -> Option<String> {
    let &glow::Version { major, minor, is_embedded, .. } = version;
    let kind = if is_embedded { "OpenGL ES" } else { "OpenGL" };
    (is_embedded || (major, minor) < (3, 3)).then(|| {
        format!("the window's driver, {renderer}, gives {kind} {major}.{minor}, and OpenGL 3.3 is needed: {REMEDY}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hbao::context::{Backend, Context};

    #[test]
    fn an_error_is_heard_with_debug_output_and_without() {
        let context = Context::open(Backend::Auto).unwrap();
        let complaints = Complaints::default();
        for has_debug_output in [true, false] {
            // SAFETY: the context is current, and the addresses are its own.
            let mut heard = unsafe {
                let load = |name: &CStr| {
                    if has_debug_output { context.get_proc_address(name) } else { std::ptr::null() }
                };
                Heard::new(context.gl(), load, "render", &complaints)
            };
            assert_eq!(heard.has_debug_output, has_debug_output);
            heard.ask();
            assert!(complaints.take().is_empty());
            // SAFETY: the context is current.
            unsafe { context.gl().enable(0) };
            if !has_debug_output {
                // The callback of the first round is still there.
                complaints.take();
            }
            heard.ask();
            let heard = complaints.take();
            assert!(heard.len() == 1 && heard[0].starts_with("render: "), "{heard:?}");
            assert_eq!(heard[0].contains("high: "), has_debug_output, "{heard:?}");
        }
    }

    #[test]
    fn a_window_with_less_than_opengl_3_3_is_refused() {
        let context = Context::open(Backend::Auto).unwrap();
        let mut version = context.gl().version().clone();
        assert_eq!(too_old(&version, "x"), None);
        (version.major, version.minor) = (3, 3);
        assert_eq!(too_old(&version, "x"), None);
        version.minor = 2;
        assert!(too_old(&version, "x").unwrap().contains("x, gives OpenGL 3.2, and OpenGL 3.3 is needed"));
        (version.major, version.minor, version.is_embedded) = (3, 2, true);
        assert!(too_old(&version, "x").unwrap().contains("OpenGL ES 3.2"));
    }
}
