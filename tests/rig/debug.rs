//! What the driver has to say while a test renders: OpenGL's debug output (KHR_debug), where it has that.

use glow::HasContext as _;
use hbao::context::Context;
use std::ffi::c_void;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex};

/// One message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    pub severity: u32,
    pub source: u32,
    pub kind: u32,
    pub text: String,
}

impl Message {
    /// High or medium: an error, undefined behaviour, or what costs much.
    pub fn is_severe(&self) -> bool {
        matches!(self.severity, glow::DEBUG_SEVERITY_HIGH | glow::DEBUG_SEVERITY_MEDIUM)
    }
}

/// Collects a context's messages until it is dropped, and then panics where one of them is severe.
#[must_use]
pub struct Watch<'a> {
    messages: Arc<Mutex<Vec<Message>>>,
    /// Holds the callback, which the driver must be told to forget before this is dropped.
    gl: Option<glow::Context>,
    set: SetCallback,
    _context: PhantomData<&'a Context>,
}

type SetCallback = unsafe extern "system" fn(callback: *const c_void, user: *const c_void);

unsafe extern "system" fn without_debug_output(_: *const c_void, _: *const c_void) {}

/// Listens to the context from here on: `let _watch = rig::debug::watch(&context);`. One at a time.
///
/// A driver without debug output has nothing to say; [`Watch::listens`] tells.
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
        // At the call that they are about, so that none comes after the end.
        gl.enable(glow::DEBUG_OUTPUT_SYNCHRONOUS);
        // Those of low severity are off at first.
        gl.debug_message_control(glow::DONT_CARE, glow::DONT_CARE, glow::DONT_CARE, &[], true);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        watch.gl = Some(gl);
    }
    watch
}

impl Watch<'_> {
    /// Whether there is anything to hear.
    pub fn listens(&self) -> bool {
        self.gl.is_some()
    }

    /// The messages since it was last asked. Those that were told so are the caller's to judge.
    pub fn messages(&self) -> Vec<Message> {
        std::mem::take(&mut self.messages.lock().unwrap())
    }
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        if let Some(gl) = &self.gl {
            // SAFETY: the context is current on this thread, since it lives and stays there.
            unsafe {
                (self.set)(std::ptr::null(), std::ptr::null());
                gl.disable(glow::DEBUG_OUTPUT);
            }
        }
        let severe: Vec<Message> = self.messages().into_iter().filter(Message::is_severe).collect();
        // A second panic would end the process, and hide the first.
        if !std::thread::panicking() {
            assert!(severe.is_empty(), "the driver complains: {severe:#?}");
        }
    }
}
