//! Names the passes for debuggers of OpenGL, such as RenderDoc and apitrace.

use glow::HasContext;
use std::ffi::{CStr, c_char, c_void};

/// `glPushDebugGroup` and `glPopDebugGroup`, which OpenGL has since version 4.3, and earlier versions with the
/// extension `GL_KHR_debug`.
///
/// They are called at their own addresses, and not through glow. A loader may lack them although the driver has the
/// extension, and glow, which goes by the extension, then panics.
#[derive(Clone, Copy)]
pub(crate) struct DebugGroups {
    push: unsafe extern "system" fn(u32, u32, i32, *const c_char),
    pop: unsafe extern "system" fn(),
}

impl DebugGroups {
    /// Finds the functions. `load` returns the address of an OpenGL function, or null. Returns `None` if the context or
    /// the loader does not have them. Both are asked, because some loaders return addresses of functions that the
    /// context lacks.
    ///
    /// # Safety
    /// An address that is not null must be that of the function of this name, in the context `gl`, for as long as the
    /// result is used.
    pub(crate) unsafe fn load(gl: &glow::Context, mut load: impl FnMut(&CStr) -> *const c_void) -> Option<DebugGroups> {
        if !gl.supports_debug() {
            return None;
        }
        let [push, pop] = [load(c"glPushDebugGroup"), load(c"glPopDebugGroup")];
        if push.is_null() || pop.is_null() {
            return None;
        }
        // SAFETY: the addresses are those of functions with these signatures, by the contract of this function.
        unsafe {
            Some(DebugGroups {
                push: std::mem::transmute::<*const c_void, unsafe extern "system" fn(u32, u32, i32, *const c_char)>(
                    push,
                ),
                pop: std::mem::transmute::<*const c_void, unsafe extern "system" fn()>(pop),
            })
        }
    }

    /// Begins a group of commands.
    pub(super) fn push(self, name: &str) {
        // SAFETY: the context is current by the contract of `gl`. The length is given, so no null is needed at the end.
        unsafe { (self.push)(glow::DEBUG_SOURCE_APPLICATION, 0, name.len() as i32, name.as_ptr().cast()) };
    }

    /// Ends the group that began last.
    pub(super) fn pop(self) {
        // SAFETY: the context is current by the contract of `gl`.
        unsafe { (self.pop)() };
    }
}
