//! Listens to what the driver reports while a test renders, through OpenGL's debug output (KHR_debug) if it has that.

use glow::HasContext as _;
use hbao::context::Context;
use std::ffi::c_void;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex};

/// One message of the driver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    pub severity: u32,
    pub source: u32,
    pub kind: u32,
    pub text: String,
}

impl Message {
    /// True for high and medium severity: errors, undefined behaviour and operations that cost much.
    pub fn is_severe(&self) -> bool {
        matches!(self.severity, glow::DEBUG_SEVERITY_HIGH | glow::DEBUG_SEVERITY_MEDIUM)
    }
}

/// Collects a context's messages until it is dropped. It then panics if one of the remaining messages is severe.
#[must_use]
pub struct Watch<'a> {
    messages: Arc<Mutex<Vec<Message>>>,
    /// Owns the callback. The driver must be told to forget the callback before this is dropped.
    gl: Option<glow::Context>,
    set: SetCallback,
    _context: PhantomData<&'a Context>,
}

type SetCallback = unsafe extern "system" fn(callback: *const c_void, user: *const c_void);

unsafe extern "system" fn without_debug_output(_: *const c_void, _: *const c_void) {}

/// Listens to the context from here on: `let _watch = rig::debug::watch(&context);`. Only one watch may exist at a
/// time.
///
/// Without debug output no message arrives; see [`Watch::listens`].
pub fn watch(context: &Context) -> Watch<'_> {
    let messages = Arc::new(Mutex::new(Vec::new()));
    let mut watch = Watch { messages: messages.clone(), gl: None, set: without_debug_output, _context: PhantomData };
    let address = context.get_proc_address(c"glDebugMessageCallback");
    if !context.gl().supports_debug() || address.is_null() {
        return watch;
    }
    // SAFETY: the context is current on this thread, and the entry points are its own. The callback lives until the
    // driver is told to forget it, in `drop`: the context cannot be dropped before that.
    unsafe {
        watch.set = std::mem::transmute::<*const c_void, SetCallback>(address);
        let mut gl = glow::Context::from_loader_function_cstr(|name| context.get_proc_address(name));
        gl.debug_message_callback(move |source, kind, _, severity, text| {
            messages.lock().unwrap().push(Message { severity, source, kind, text: text.trim().to_string() });
        });
        gl.enable(glow::DEBUG_OUTPUT);
        // Messages are delivered during the call that causes them, so none can arrive after the end of the watch.
        gl.enable(glow::DEBUG_OUTPUT_SYNCHRONOUS);
        // Messages of low severity are off by default.
        gl.debug_message_control(glow::DONT_CARE, glow::DONT_CARE, glow::DONT_CARE, &[], true);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        watch.gl = Some(gl);
    }
    watch
}

impl Watch<'_> {
    /// Whether the driver has debug output.
    pub fn listens(&self) -> bool {
        self.gl.is_some()
    }

    /// Takes the messages that have arrived since the last call. The caller must judge them: they no longer make the
    /// watch panic.
    pub fn messages(&self) -> Vec<Message> {
        std::mem::take(&mut self.messages.lock().unwrap())
    }
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        if let Some(gl) = &self.gl {
            // SAFETY: the context is current on this thread: it is still alive, because it is borrowed, and it stays on
            // its thread.
            unsafe {
                (self.set)(std::ptr::null(), std::ptr::null());
                gl.disable(glow::DEBUG_OUTPUT);
            }
        }
        let severe: Vec<Message> = self.messages().into_iter().filter(Message::is_severe).collect();
        // A second panic would end the process and hide the first.
        if !std::thread::panicking() {
            assert!(severe.is_empty(), "the driver reported problems: {severe:#?}");
        }
    }
}
