//! Reports all state that OpenGL 3.3 can report. Every enum of the core's registry is given to every getter, and
//! whatever has an answer is state. Nobody has to keep a list, so nothing can be missing from it.

use gl_generator::{Api, Fallbacks, Profile, Registry};
use hbao::context::Context;
use std::collections::BTreeMap;
use std::ffi::CStr;
use std::fmt::Debug;

/// The values of all state as text, by name.
pub(crate) type State = BTreeMap<String, String>;

/// Loads entry points of OpenGL 3.3 core, including some that glow does not have.
macro_rules! entry_points {
    ($($name:ident = $symbol:literal ($($argument:ty),*) $(-> $result:ty)?;)*) => {
        pub(crate) struct Raw { $(pub(crate) $name: unsafe extern "system" fn($($argument),*) $(-> $result)?,)* }

        impl Raw {
            pub(crate) fn load(context: &Context) -> Raw {
                let address = |name: &CStr| {
                    let address = context.get_proc_address(name);
                    assert!(!address.is_null(), "{name:?}");
                    address
                };
                // SAFETY: each address is that of the function with that name, and OpenGL defines its signature.
                unsafe { Raw { $($name: std::mem::transmute::<
                    *const std::ffi::c_void,
                    unsafe extern "system" fn($($argument),*) $(-> $result)?
                >(address($symbol)),)* } }
            }
        }
    };
}

entry_points! {
    error = c"glGetError"() -> u32;
    is_enabled = c"glIsEnabled"(u32) -> u8;
    enable = c"glEnable"(u32);
    disable = c"glDisable"(u32);
    get = c"glGetDoublev"(u32, *mut f64);
    get_integer = c"glGetIntegeri_v"(u32, u32, *mut i32);
    get_long = c"glGetInteger64i_v"(u32, u32, *mut i64);
    get_boolean = c"glGetBooleani_v"(u32, u32, *mut u8);
    get_query = c"glGetQueryiv"(u32, u32, *mut i32);
    get_attribute = c"glGetVertexAttribdv"(u32, u32, *mut f64);
    get_attribute_pointer = c"glGetVertexAttribPointerv"(u32, u32, *mut *mut std::ffi::c_void);
    get_texture = c"glGetTexParameterfv"(u32, u32, *mut f32);
    get_sampler = c"glGetSamplerParameterfv"(u32, u32, *mut f32);
    get_buffer = c"glGetBufferParameteri64v"(u32, u32, *mut i64);
    get_renderbuffer = c"glGetRenderbufferParameteriv"(u32, u32, *mut i32);
    get_attachment = c"glGetFramebufferAttachmentParameteriv"(u32, u32, u32, *mut i32);
    get_program = c"glGetProgramiv"(u32, u32, *mut i32);
    active_texture = c"glActiveTexture"(u32);
    sample_mask = c"glSampleMaski"(u32, u32);
    provoking_vertex = c"glProvokingVertex"(u32);
    primitive_restart_index = c"glPrimitiveRestartIndex"(u32);
    logic_op = c"glLogicOp"(u32);
    clamp_color = c"glClampColor"(u32, u32);
    point_size = c"glPointSize"(f32);
    point_parameter = c"glPointParameterf"(u32, f32);
    pixel_store = c"glPixelStorei"(u32, i32);
    texture_buffer = c"glTexBuffer"(u32, u32, u32);
    color_mask = c"glColorMaski"(u32, u8, u8, u8, u8);
}

/// Queries the state of one context.
pub(crate) struct Reporter {
    pub(crate) raw: Raw,
    /// Every enum of OpenGL 3.3 core, with one name for each number.
    enums: Vec<(String, u32)>,
    /// The enums that glGet answers.
    pub(crate) plain: Vec<(String, u32)>,
    /// The enums that glIsEnabled answers.
    pub(crate) switches: Vec<(String, u32)>,
}

/// More values than any parameter has.
const ROOM: usize = 1024;

impl Reporter {
    pub(crate) fn new(context: &Context) -> Reporter {
        let raw = Raw::load(context);
        let core = Registry::new(Api::Gl, (3, 3), Profile::Core, Fallbacks::None, []);
        let number = |text: &str| match text.strip_prefix("0x") {
            Some(digits) => u32::from_str_radix(digits, 16).ok(),
            None => text.parse().ok(),
        };
        let numbers: BTreeMap<u32, String> =
            core.enums.iter().filter_map(|e| Some((number(&e.value)?, e.ident.clone()))).collect();
        let enums: Vec<(String, u32)> = numbers.into_iter().map(|(value, name)| (name, value)).collect();
        let mut reporter = Reporter { raw, enums, plain: Vec::new(), switches: Vec::new() };
        // Time is not state.
        let asked = |(name, value): &(String, u32)| name != "TIMESTAMP" && reporter.plain_value(*value).is_some();
        let plain: Vec<_> = reporter.enums.iter().filter(|e| asked(e)).cloned().collect();
        // SAFETY: the context is current. For the number of anything else, the call only causes a GL error.
        let switch = |value: u32| reporter.answers(|| unsafe { (reporter.raw.is_enabled)(value) });
        let switches: Vec<_> = reporter.enums.iter().filter(|(_, value)| switch(*value)).cloned().collect();
        (reporter.plain, reporter.switches) = (plain, switches);
        assert!(reporter.plain.len() > 200 && reporter.switches.len() > 25, "{}", reporter.plain.len());
        reporter
    }

    /// Whether a call causes no error.
    fn answers<T>(&self, call: impl FnOnce() -> T) -> bool {
        // SAFETY: the context is current.
        let error = || unsafe { (self.raw.error)() };
        assert_eq!(error(), 0, "an earlier call left an error");
        call();
        let answered = error() == 0;
        while error() != 0 {}
        answered
    }

    /// Returns what a getter writes, if it has an answer. `unset` must be a value that no getter writes.
    fn values<T: Copy + PartialEq + Debug>(&self, unset: T, get: impl FnOnce(*mut T)) -> Option<String> {
        let mut values = vec![unset; ROOM];
        if !self.answers(|| get(values.as_mut_ptr())) {
            return None;
        }
        let count = values.iter().rposition(|&value| value != unset).map_or(0, |last| last + 1);
        Some(format!("{:?}", &values[..count]))
    }

    fn plain_value(&self, parameter: u32) -> Option<String> {
        // SAFETY: the context is current, here and below, and there is room for the values of any parameter.
        self.values(-7.7e77, |into| unsafe { (self.raw.get)(parameter, into) })
    }

    fn number(&self, parameter: u32) -> u32 {
        let mut value = [0.0; 4];
        // SAFETY: as above. Only parameters with one to four values are queried.
        unsafe { (self.raw.get)(parameter, value.as_mut_ptr()) };
        value[0] as u32
    }

    /// Returns the enums whose names contain `part`, to query objects of one kind with.
    fn named(&self, part: &'static str) -> impl Iterator<Item = &(String, u32)> {
        self.enums.iter().filter(move |(name, _)| name.contains(part))
    }

    /// Returns everything that can be reported about the context and the objects that are bound.
    pub(crate) fn state(&self) -> State {
        let mut state = State::new();
        for (name, parameter) in &self.plain {
            state.insert(name.clone(), self.plain_value(*parameter).unwrap());
        }
        for (name, switch) in &self.switches {
            // SAFETY: as above.
            let on = unsafe { (self.raw.is_enabled)(*switch) } != 0;
            state.insert(format!("{name} is on"), on.to_string());
        }
        self.indexed(&mut state);
        self.units(&mut state);
        self.vertices(&mut state);
        self.objects(&mut state);
        state
    }

    /// Adds the state that exists once per draw buffer, uniform block, transform feedback buffer or word of the sample
    /// mask.
    fn indexed(&self, state: &mut State) {
        for (name, parameter) in &self.enums {
            for index in 0..256 {
                // SAFETY: as above.
                let answers = unsafe {
                    [
                        self.values(-77_777, |into| (self.raw.get_integer)(*parameter, index, into)),
                        self.values(-77_777, |into| (self.raw.get_long)(*parameter, index, into)),
                        self.values(0x77, |into| (self.raw.get_boolean)(*parameter, index, into)),
                    ]
                };
                if answers.iter().all(Option::is_none) {
                    break;
                }
                state.insert(format!("{name}[{index}]"), format!("{:?}", answers.map(Option::unwrap_or_default)));
            }
        }
    }

    /// Adds what is bound to each texture unit, and for the first units how the textures are sampled.
    fn units(&self, state: &mut State) {
        let active = self.number(glow::ACTIVE_TEXTURE);
        for unit in 0..self.number(glow::MAX_COMBINED_TEXTURE_IMAGE_UNITS) {
            // SAFETY: as above, and this unit exists.
            unsafe { (self.raw.active_texture)(glow::TEXTURE0 + unit) };
            for (name, parameter) in &self.plain {
                if name.starts_with("TEXTURE_BINDING") || name == "SAMPLER_BINDING" {
                    state.insert(format!("{name} of unit {unit}"), self.plain_value(*parameter).unwrap());
                }
            }
            if unit > 5 {
                continue;
            }
            let sampler = self.number(glow::SAMPLER_BINDING);
            for (name, parameter) in self.named("TEXTURE_") {
                for (kind, target) in TEXTURES {
                    // SAFETY: as above.
                    let value =
                        self.values(-7.7e37, |into| unsafe { (self.raw.get_texture)(target, *parameter, into) });
                    value.map(|value| state.insert(format!("{name} of the {kind} texture of unit {unit}"), value));
                }
                // SAFETY: as above.
                let value = self.values(-7.7e37, |into| unsafe { (self.raw.get_sampler)(sampler, *parameter, into) });
                value.map(|value| state.insert(format!("{name} of the sampler of unit {unit}"), value));
            }
        }
        // SAFETY: as above.
        unsafe { (self.raw.active_texture)(active) };
    }

    /// Adds the state of the bound vertex array, and the current values of the attributes.
    fn vertices(&self, state: &mut State) {
        for index in 0..self.number(glow::MAX_VERTEX_ATTRIBS) {
            for (name, parameter) in self.named("VERTEX_ATTRIB") {
                // SAFETY: as above.
                let value = self.values(-7.7e77, |into| unsafe { (self.raw.get_attribute)(index, *parameter, into) });
                value.map(|value| state.insert(format!("{name} of attribute {index}"), value));
            }
            let mut pointer = std::ptr::null_mut();
            // SAFETY: as above.
            unsafe { (self.raw.get_attribute_pointer)(index, glow::VERTEX_ATTRIB_ARRAY_POINTER, &raw mut pointer) };
            state.insert(format!("pointer of attribute {index}"), format!("{pointer:?}"));
        }
    }

    /// Adds the active queries, and the state of the bound buffers, framebuffers, renderbuffer and program.
    fn objects(&self, state: &mut State) {
        let program = self.number(glow::CURRENT_PROGRAM);
        let mut put = |name: &str, of: String, value: Option<String>| {
            value.map(|value| state.insert(format!("{name} of {of}"), value));
        };
        // SAFETY: as above, for all of these calls.
        unsafe {
            for (name, parameter) in self.named("QUERY") {
                for (kind, target) in QUERIES {
                    let value = self.values(-77_777, |into| (self.raw.get_query)(target, *parameter, into));
                    put(name, kind.into(), value);
                }
            }
            for (name, parameter) in self.named("BUFFER_") {
                for (kind, target) in BUFFERS {
                    let value = self.values(-77_777, |into| (self.raw.get_buffer)(target, *parameter, into));
                    put(name, format!("the {kind} buffer"), value);
                }
                let get = |into| (self.raw.get_renderbuffer)(glow::RENDERBUFFER, *parameter, into);
                put(name, "the renderbuffer".into(), self.values(-77_777, get));
            }
            for (name, parameter) in self.named("FRAMEBUFFER_") {
                for (kind, target) in FRAMEBUFFERS {
                    for point in (0..8).map(|i| glow::COLOR_ATTACHMENT0 + i).chain([glow::DEPTH_ATTACHMENT]) {
                        let get = |into| (self.raw.get_attachment)(target, point, *parameter, into);
                        put(name, format!("{kind} attachment {point:#x}"), self.values(-77_777, get));
                    }
                }
            }
            for (name, parameter) in &self.enums {
                let value = self.values(-77_777, |into| (self.raw.get_program)(program, *parameter, into));
                put(name, "the program".into(), value);
            }
        }
    }
}

pub(crate) const TEXTURES: [(&str, u32); 8] = [
    ("1D", glow::TEXTURE_1D),
    ("2D", glow::TEXTURE_2D),
    ("3D", glow::TEXTURE_3D),
    ("1D array", glow::TEXTURE_1D_ARRAY),
    ("2D array", glow::TEXTURE_2D_ARRAY),
    ("cube map", glow::TEXTURE_CUBE_MAP),
    ("rectangle", glow::TEXTURE_RECTANGLE),
    ("multisample", glow::TEXTURE_2D_MULTISAMPLE),
];

pub(crate) const QUERIES: [(&str, u32); 5] = [
    ("SAMPLES_PASSED", glow::SAMPLES_PASSED),
    ("ANY_SAMPLES_PASSED", glow::ANY_SAMPLES_PASSED),
    ("PRIMITIVES_GENERATED", glow::PRIMITIVES_GENERATED),
    ("TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN", glow::TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN),
    ("TIME_ELAPSED", glow::TIME_ELAPSED),
];

pub(crate) const BUFFERS: [(&str, u32); 9] = [
    ("array", glow::ARRAY_BUFFER),
    ("element array", glow::ELEMENT_ARRAY_BUFFER),
    ("uniform", glow::UNIFORM_BUFFER),
    ("pixel pack", glow::PIXEL_PACK_BUFFER),
    ("pixel unpack", glow::PIXEL_UNPACK_BUFFER),
    ("transform feedback", glow::TRANSFORM_FEEDBACK_BUFFER),
    ("copy read", glow::COPY_READ_BUFFER),
    ("copy write", glow::COPY_WRITE_BUFFER),
    ("texture", glow::TEXTURE_BUFFER),
];

const FRAMEBUFFERS: [(&str, u32); 2] = [("draw", glow::DRAW_FRAMEBUFFER), ("read", glow::READ_FRAMEBUFFER)];
