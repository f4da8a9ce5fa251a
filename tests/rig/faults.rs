//! A driver that refuses calls. Every entry point that the library calls is wrapped, and each can be told to fail. A
//! call that is refused does what OpenGL specifies for a call that causes an error: nothing, except for setting the
//! error flag.
//!
//! All this belongs to one thread, like a context. Objects that are made and deleted are counted too.

use glow::HasContext as _;
use hbao::context::Context;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::c_void;
use std::sync::Arc;

/// A fault. It happens at the call with this number, counted from 0, of the calls that it can happen to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A call is ignored and causes an error.
    Ignored { nth: usize, error: u32 },
    /// The same, but only calls of one entry point are counted.
    Refused { entry: &'static str, nth: usize, error: u32 },
    /// `glGetError` once reports an error that no call has caused.
    Error { nth: usize, error: u32 },
    /// The context is lost. From this call on all calls are ignored, and `glGetError` reports nothing else.
    Lost { nth: usize },
    /// A framebuffer is not complete.
    Incomplete { nth: usize, status: u32 },
    /// A shader does not compile.
    NotCompiled { nth: usize },
    /// A program does not link.
    NotLinked { nth: usize },
    /// The name of a new object is 0, and no error says why.
    Nameless { nth: usize },
    /// A query never has a result.
    NoResult,
}

/// An object that exists: its kind and its name.
pub type Object = (&'static str, u32);

#[derive(Default)]
struct Driver {
    real: BTreeMap<&'static str, usize>,
    fault: Option<Fault>,
    /// The number of calls so far that the fault can happen to.
    seen: usize,
    /// The error flag.
    pending: Option<u32>,
    lost: bool,
    struck: bool,
    objects: BTreeSet<Object>,
    allocated: u64,
    twice: Vec<Object>,
    calls: BTreeMap<&'static str, usize>,
}

thread_local! {
    static DRIVER: RefCell<Driver> = RefCell::default();
}

impl Driver {
    /// Counts a call, and returns whether the fault happens at it.
    fn turn(&mut self, nth: usize) -> bool {
        self.seen += 1;
        self.struck |= self.seen == nth + 1;
        self.seen == nth + 1
    }

    /// Whether the call is ignored.
    fn ignores(&mut self, name: &'static str) -> bool {
        let fault = self.fault;
        let error = match fault {
            Some(Fault::Ignored { nth, error }) if self.turn(nth) => error,
            Some(Fault::Refused { entry, nth, error }) if entry == name && self.turn(nth) => error,
            Some(Fault::Lost { nth }) => {
                self.lost |= self.turn(nth);
                return self.lost;
            }
            _ => return false,
        };
        self.pending = self.pending.or(Some(error));
        true
    }
}

/// Returns the real entry point, or `None` if the call is ignored.
fn enter(name: &'static str) -> Option<usize> {
    DRIVER.with_borrow_mut(|driver| {
        *driver.calls.entry(name).or_default() += 1;
        (!driver.ignores(name)).then(|| driver.real[name])
    })
}

/// Returns the real entry point.
fn real(name: &'static str) -> usize {
    DRIVER.with_borrow_mut(|driver| {
        *driver.calls.entry(name).or_default() += 1;
        driver.real[name]
    })
}

fn turn_of(fault: impl FnOnce(Fault) -> Option<usize>) -> bool {
    DRIVER.with_borrow_mut(|driver| match driver.fault.and_then(fault) {
        Some(nth) => driver.turn(nth),
        None => false,
    })
}

/// Counts the bytes of images that a call allocates, as their formats say: a driver may take more.
fn count_memory(name: &str, arguments: &[i64]) {
    let (samples, format, width, height) = match (name, arguments) {
        ("glTexImage2D", &[_, _, format, width, height, ..]) => (1, format, width, height),
        ("glTexImage2DMultisample", &[_, samples, format, width, height, _]) => (samples, format, width, height),
        ("glRenderbufferStorageMultisample", &[_, samples, format, width, height]) => {
            (samples.max(1), format, width, height)
        }
        _ => return,
    };
    let texel = match format as u32 {
        glow::R8 => 1,
        glow::R16F => 2,
        glow::R32F | glow::RGBA8 | glow::RGBA8_SNORM | glow::DEPTH_COMPONENT32F | glow::DEPTH24_STENCIL8 => 4,
        glow::RGBA16F => 8,
        glow::RGBA32F => 16,
        other => panic!("{name}: no size is known for the format 0x{other:04x}"),
    };
    DRIVER.with_borrow_mut(|driver| driver.allocated += texel * (samples * width * height) as u64);
}

/// Returns the number of bytes of all images that were allocated so far.
pub fn allocated() -> u64 {
    DRIVER.with_borrow(|driver| driver.allocated)
}

/// Entry points that are either ignored or passed on. After `=>` stands what an ignored call returns. Addresses have
/// the type `usize`.
macro_rules! entry_points {
    ($($name:ident($($arg:ident: $type:ty),*) $(-> $result:ty => $ignored:expr)?;)*) => {
        #[allow(non_snake_case, clippy::too_many_arguments)]
        mod shim {
            $(pub(super) unsafe extern "system" fn $name($($arg: $type),*) $(-> $result)? {
                let Some(address) = super::enter(stringify!($name)) else { return $($ignored)? };
                super::count_memory(stringify!($name), &[$($arg as i64),*]);
                // SAFETY: this is the address of the driver's function of this name, and these are its arguments.
                unsafe {
                    let real: unsafe extern "system" fn($($type),*) $(-> $result)? = std::mem::transmute(address);
                    real($($arg),*)
                }
            })*
        }
        fn passed_on(name: &str) -> Option<*const c_void> {
            match name {
                $(stringify!($name) => Some(shim::$name as *const c_void),)*
                _ => None,
            }
        }
    };
}

entry_points! {
    glActiveTexture(unit: u32);
    glAttachShader(program: u32, shader: u32);
    glBeginQuery(target: u32, query: u32);
    glBindBuffer(target: u32, buffer: u32);
    glBindFragDataLocation(program: u32, number: u32, name: usize);
    glBindFramebuffer(target: u32, framebuffer: u32);
    glBindRenderbuffer(target: u32, renderbuffer: u32);
    glBindSampler(unit: u32, sampler: u32);
    glBindTexture(target: u32, texture: u32);
    glBindVertexArray(vertices: u32);
    glBlendEquation(mode: u32);
    glBlendEquationSeparate(rgb: u32, alpha: u32);
    glBlendFuncSeparate(src_rgb: u32, dst_rgb: u32, src_alpha: u32, dst_alpha: u32);
    glBufferData(target: u32, size: isize, data: usize, usage: u32);
    glClearBufferfv(buffer: u32, number: i32, value: usize);
    glClearBufferiv(buffer: u32, number: i32, value: usize);
    glColorMaski(number: u32, r: u8, g: u8, b: u8, a: u8);
    glCompileShader(shader: u32);
    glDepthFunc(func: u32);
    glDepthMask(on: u8);
    glDisable(switch: u32);
    glDisablei(switch: u32, number: u32);
    glDrawArrays(mode: u32, first: i32, count: i32);
    glDrawBuffer(buffer: u32);
    glDrawBuffers(count: i32, buffers: usize);
    glDrawElements(mode: u32, count: i32, kind: u32, offset: usize);
    glEnable(switch: u32);
    glEnablei(switch: u32, number: u32);
    glEnableVertexAttribArray(number: u32);
    glEndQuery(target: u32);
    glFramebufferTexture(target: u32, attachment: u32, texture: u32, level: i32);
    glFramebufferRenderbuffer(target: u32, attachment: u32, kind: u32, renderbuffer: u32);
    glFramebufferTexture2D(target: u32, attachment: u32, kind: u32, texture: u32, level: i32);
    glGetAttribLocation(program: u32, name: usize) -> i32 => -1;
    glGetBooleanv(parameter: u32, values: usize);
    glGetIntegeri_v(parameter: u32, number: u32, values: usize);
    glGetIntegerv(parameter: u32, values: usize);
    glGetProgramInfoLog(program: u32, size: i32, length: usize, log: usize);
    glGetShaderInfoLog(shader: u32, size: i32, length: usize, log: usize);
    glGetString(parameter: u32) -> usize => 0;
    glGetStringi(parameter: u32, number: u32) -> usize => 0;
    glGetTexImage(target: u32, level: i32, format: u32, kind: u32, texels: usize);
    glGetTexLevelParameteriv(target: u32, level: i32, parameter: u32, values: usize);
    glGetTexParameteriv(target: u32, parameter: u32, values: usize);
    glGetUniformLocation(program: u32, name: usize) -> i32 => -1;
    glIsEnabled(switch: u32) -> u8 => 0;
    glIsProgram(program: u32) -> u8 => 0;
    glIsTexture(texture: u32) -> u8 => 0;
    glLinkProgram(program: u32);
    glPixelStorei(parameter: u32, value: i32);
    glPolygonMode(face: u32, mode: u32);
    glReadBuffer(buffer: u32);
    glReadPixels(x: i32, y: i32, width: i32, height: i32, format: u32, kind: u32, texels: usize);
    glRenderbufferStorageMultisample(target: u32, samples: i32, format: u32, width: i32, height: i32);
    glSamplerParameteri(sampler: u32, parameter: u32, value: i32);
    glShaderSource(shader: u32, count: i32, texts: usize, lengths: usize);
    glStencilFunc(func: u32, reference: i32, mask: u32);
    glStencilFuncSeparate(face: u32, func: u32, reference: i32, mask: u32);
    glStencilMask(mask: u32);
    glStencilMaskSeparate(face: u32, mask: u32);
    glStencilOp(fail: u32, depth_fail: u32, pass: u32);
    glStencilOpSeparate(face: u32, fail: u32, depth_fail: u32, pass: u32);
    glTexImage2D(target: u32, level: i32, internal: i32, width: i32, height: i32, border: i32, format: u32, kind: u32, texels: usize);
    glTexImage2DMultisample(target: u32, samples: i32, internal: u32, width: i32, height: i32, fixed: u8);
    glTexParameteri(target: u32, parameter: u32, value: i32);
    glUniform1f(location: i32, x: f32);
    glUniform1i(location: i32, x: i32);
    glUniform2f(location: i32, x: f32, y: f32);
    glUniform3f(location: i32, x: f32, y: f32, z: f32);
    glUniform4f(location: i32, x: f32, y: f32, z: f32, w: f32);
    glUniformMatrix3fv(location: i32, count: i32, transpose: u8, values: usize);
    glUniformMatrix4fv(location: i32, count: i32, transpose: u8, values: usize);
    glUseProgram(program: u32);
    glVertexAttribPointer(number: u32, size: i32, kind: u32, normalised: u8, stride: i32, offset: usize);
    glViewport(x: i32, y: i32, width: i32, height: i32);
}

/// Entry points that make and delete `count` objects at a time.
macro_rules! objects {
    ($($made:ident $deleted:ident $kind:literal;)*) => {
        #[allow(non_snake_case)]
        mod object_shim {
            $(pub(super) unsafe extern "system" fn $made(count: i32, names: *mut u32) {
                let Some(address) = super::enter(stringify!($made)) else { return };
                // SAFETY: this is the address of the driver's function of this name, and there is room for `count`
                // names.
                unsafe {
                    if super::turn_of(super::nameless) {
                        return names.write_bytes(0, count as usize);
                    }
                    let real: unsafe extern "system" fn(i32, *mut u32) = std::mem::transmute(address);
                    real(count, names);
                    (0..count as usize).for_each(|i| super::made($kind, *names.add(i)));
                }
            }
            // Deleting is never ignored, because a driver that loses its context frees what it held.
            pub(super) unsafe extern "system" fn $deleted(count: i32, names: *const u32) {
                let address = super::real(stringify!($deleted));
                // SAFETY: as above.
                unsafe {
                    (0..count as usize).for_each(|i| super::deleted($kind, *names.add(i)));
                    let real: unsafe extern "system" fn(i32, *const u32) = std::mem::transmute(address);
                    real(count, names);
                }
            })*
        }
        fn of_objects(name: &str) -> Option<*const c_void> {
            match name {
                $(stringify!($made) => Some(object_shim::$made as *const c_void),)*
                $(stringify!($deleted) => Some(object_shim::$deleted as *const c_void),)*
                _ => None,
            }
        }
    };
}

objects! {
    glGenBuffers glDeleteBuffers "buffer";
    glGenFramebuffers glDeleteFramebuffers "framebuffer";
    glGenQueries glDeleteQueries "query";
    glGenRenderbuffers glDeleteRenderbuffers "renderbuffer";
    glGenSamplers glDeleteSamplers "sampler";
    glGenTextures glDeleteTextures "texture";
    glGenVertexArrays glDeleteVertexArrays "vertex array";
}

fn nameless(fault: Fault) -> Option<usize> {
    if let Fault::Nameless { nth } = fault { Some(nth) } else { None }
}

fn made(kind: &'static str, name: u32) {
    DRIVER.with_borrow_mut(|driver| driver.objects.insert((kind, name)));
}

fn deleted(kind: &'static str, name: u32) {
    DRIVER.with_borrow_mut(|driver| {
        if !driver.objects.remove(&(kind, name)) {
            driver.twice.push((kind, name));
        }
    });
}

/// The other entry points, each with a fault of its own.
#[allow(non_snake_case)]
mod own {
    use super::{Fault, deleted, enter, made, nameless, real, turn_of};
    use std::mem::transmute;

    type Of<A, R> = unsafe extern "system" fn(A) -> R;

    // SAFETY, here and below: each address is that of the driver's function of that name, and the types are those of
    // its arguments.
    pub(super) unsafe extern "system" fn glCreateShader(stage: u32) -> u32 {
        let Some(address) = enter("glCreateShader") else { return 0 };
        if turn_of(nameless) {
            return 0;
        }
        // SAFETY: as stated above.
        let name = unsafe { transmute::<usize, Of<u32, u32>>(address)(stage) };
        made("shader", name);
        name
    }

    pub(super) unsafe extern "system" fn glCreateProgram() -> u32 {
        let Some(address) = enter("glCreateProgram") else { return 0 };
        if turn_of(nameless) {
            return 0;
        }
        // SAFETY: as stated above.
        let name = unsafe { transmute::<usize, unsafe extern "system" fn() -> u32>(address)() };
        made("program", name);
        name
    }

    pub(super) unsafe extern "system" fn glDeleteShader(name: u32) {
        deleted("shader", name);
        // SAFETY: as stated above.
        unsafe { transmute::<usize, Of<u32, ()>>(real("glDeleteShader"))(name) }
    }

    pub(super) unsafe extern "system" fn glDeleteProgram(name: u32) {
        deleted("program", name);
        // SAFETY: as stated above.
        unsafe { transmute::<usize, Of<u32, ()>>(real("glDeleteProgram"))(name) }
    }

    pub(super) unsafe extern "system" fn glFinish() {
        // SAFETY: as stated above. In OpenGL, this call cannot cause an error.
        unsafe { transmute::<usize, unsafe extern "system" fn()>(real("glFinish"))() }
    }

    pub(super) unsafe extern "system" fn glFlush() {
        // SAFETY: as stated above. In OpenGL, this call cannot cause an error.
        unsafe { transmute::<usize, unsafe extern "system" fn()>(real("glFlush"))() }
    }

    pub(super) unsafe extern "system" fn glGetError() -> u32 {
        let address = real("glGetError");
        let fault = super::DRIVER.with_borrow(|driver| driver.fault);
        let told = super::DRIVER.with_borrow_mut(|driver| match fault {
            _ if driver.lost => Some(glow::CONTEXT_LOST),
            Some(Fault::Error { nth, error }) if driver.turn(nth) => Some(error),
            _ => driver.pending.take(),
        });
        // SAFETY: as stated above.
        told.unwrap_or_else(|| unsafe { transmute::<usize, unsafe extern "system" fn() -> u32>(address)() })
    }

    pub(super) unsafe extern "system" fn glCheckFramebufferStatus(target: u32) -> u32 {
        let Some(address) = enter("glCheckFramebufferStatus") else { return 0 };
        let fault = super::DRIVER.with_borrow(|driver| driver.fault);
        let told = super::DRIVER.with_borrow_mut(|driver| match fault {
            Some(Fault::Incomplete { nth, status }) if driver.turn(nth) => Some(status),
            _ => None,
        });
        // SAFETY: as stated above.
        told.unwrap_or_else(|| unsafe { transmute::<usize, Of<u32, u32>>(address)(target) })
    }

    type Get = unsafe extern "system" fn(u32, u32, *mut i32);

    pub(super) unsafe extern "system" fn glGetShaderiv(shader: u32, parameter: u32, value: *mut i32) {
        let Some(address) = enter("glGetShaderiv") else { return };
        let fails = |fault| if let Fault::NotCompiled { nth } = fault { Some(nth) } else { None };
        let refused = parameter == glow::COMPILE_STATUS && turn_of(fails);
        // SAFETY: as stated above.
        unsafe { if refused { *value = 0 } else { transmute::<usize, Get>(address)(shader, parameter, value) } }
    }

    pub(super) unsafe extern "system" fn glGetProgramiv(program: u32, parameter: u32, value: *mut i32) {
        let Some(address) = enter("glGetProgramiv") else { return };
        let fails = |fault| if let Fault::NotLinked { nth } = fault { Some(nth) } else { None };
        let refused = parameter == glow::LINK_STATUS && turn_of(fails);
        // SAFETY: as stated above.
        unsafe { if refused { *value = 0 } else { transmute::<usize, Get>(address)(program, parameter, value) } }
    }

    pub(super) unsafe extern "system" fn glGetQueryObjectui64v(query: u32, parameter: u32, value: *mut u64) {
        let Some(address) = enter("glGetQueryObjectui64v") else { return };
        if turn_of(|fault| (fault == Fault::NoResult).then_some(0)) {
            return;
        }
        // SAFETY: as stated above.
        unsafe { transmute::<usize, unsafe extern "system" fn(u32, u32, *mut u64)>(address)(query, parameter, value) }
    }

    pub(super) fn of(name: &str) -> Option<*const std::ffi::c_void> {
        Some(match name {
            "glCreateShader" => glCreateShader as *const _,
            "glCreateProgram" => glCreateProgram as *const _,
            "glDeleteShader" => glDeleteShader as *const _,
            "glDeleteProgram" => glDeleteProgram as *const _,
            "glFinish" => glFinish as *const _,
            "glFlush" => glFlush as *const _,
            "glGetError" => glGetError as *const _,
            "glCheckFramebufferStatus" => glCheckFramebufferStatus as *const _,
            "glGetShaderiv" => glGetShaderiv as *const _,
            "glGetProgramiv" => glGetProgramiv as *const _,
            "glGetQueryObjectui64v" => glGetQueryObjectui64v as *const _,
            _ => return None,
        })
    }
}

/// Returns the context's functions behind these wrappers. Any other function is missing, so that a call of one that
/// cannot be refused panics.
pub fn refusing(context: &Context) -> Arc<glow::Context> {
    DRIVER.take();
    // SAFETY: the context is current on this thread, and each function has the arguments that OpenGL gives to its name.
    let gl = unsafe {
        glow::Context::from_loader_function_cstr(|name| {
            let Ok(text) = name.to_str() else { return std::ptr::null() };
            let Some(shim) = passed_on(text).or_else(|| of_objects(text)).or_else(|| own::of(text)) else {
                return std::ptr::null();
            };
            let address = context.get_proc_address(name) as usize;
            assert_ne!(address, 0, "{text}");
            DRIVER.with_borrow_mut(|driver| driver.real.insert(text.to_string().leak(), address));
            shim
        })
    };
    Arc::new(gl)
}

/// The outcome of a run.
#[derive(Debug)]
pub struct Told {
    /// Whether the fault happened.
    pub struck: bool,
    /// The number of calls that it could have happened to.
    pub seen: usize,
    /// An error that was left behind, because nobody called `glGetError`.
    pub pending: Option<u32>,
    /// Objects that were made in the run and left behind.
    pub left: Vec<Object>,
    /// Objects that were deleted but did not exist.
    pub twice: Vec<Object>,
    /// How often each entry point was called.
    pub calls: BTreeMap<&'static str, usize>,
}

/// Calls `run` with a fault, in a context of [`refusing`].
pub fn run<T>(gl: &glow::Context, fault: Option<Fault>, run: impl FnOnce() -> T) -> (T, Told) {
    let before = DRIVER.with_borrow_mut(|driver| {
        let objects = std::mem::take(&mut driver.objects);
        *driver =
            Driver { real: std::mem::take(&mut driver.real), objects: objects.clone(), fault, ..Driver::default() };
        objects
    });
    let result = run();
    let told = DRIVER.with_borrow_mut(|driver| {
        driver.fault = None;
        driver.lost = false;
        Told {
            struck: driver.struck,
            seen: driver.seen,
            pending: driver.pending.take(),
            left: driver.objects.difference(&before).copied().collect(),
            twice: driver.twice.clone(),
            calls: std::mem::take(&mut driver.calls),
        }
    });
    // SAFETY: the context is current.
    let real = unsafe { gl.get_error() };
    let pending = told.pending.or(Some(real).filter(|&error| error != glow::NO_ERROR));
    (result, Told { pending, ..told })
}
