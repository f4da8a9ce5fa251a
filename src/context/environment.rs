//! The environment variables that change what Mesa's drivers do. Some of their values make Mesa crash or wait for ever:
//! these are refused before Mesa is asked. If a context cannot be had, the variables that are set are named.
//!
//! What is refused here was observed with Mesa 22.3.6, for which `src/measure/drivers.md` has the whole list.

use crate::Error;
use std::ffi::{OsStr, OsString};

/// The beginnings of the names of variables that Mesa's drivers, the loaders of EGL, or Vulkan's loader read.
const PREFIXES: [&str; 13] = [
    "DRAW_USE_LLVM",
    "DRI_PRIME",
    "EGL_",
    "GALLIUM_",
    "GALLIVM_",
    "LIBGL_",
    "LP_",
    "MESA_",
    "ST_DEBUG",
    "VK_",
    "ZINK_",
    "__EGL_",
    "__GLX_",
];

/// Variables with such names that only decide what is logged or cached, and how many threads draw.
const HARMLESS: [&str; 9] = [
    "EGL_LOG_LEVEL",
    "LIBGL_DEBUG",
    "LP_NUM_THREADS",
    "MESA_DEBUG",
    "MESA_DISK_CACHE",
    "MESA_GLSL_CACHE",
    "MESA_INFO",
    "MESA_LOG",
    "MESA_SHADER_CACHE",
];

/// The extensions on which OpenGL 3.0 depends in Mesa. Without one of them Mesa crashes when it is asked for a core
/// profile.
const REQUIRED: [&str; 22] = [
    "GL_ARB_depth_buffer_float",
    "GL_ARB_draw_instanced",
    "GL_ARB_fragment_shader",
    "GL_ARB_framebuffer_object",
    "GL_ARB_framebuffer_sRGB",
    "GL_ARB_half_float_vertex",
    "GL_ARB_map_buffer_range",
    "GL_ARB_occlusion_query",
    "GL_ARB_pixel_buffer_object",
    "GL_ARB_shader_texture_lod",
    "GL_ARB_shadow",
    "GL_ARB_texture_buffer_object",
    "GL_ARB_texture_compression_rgtc",
    "GL_ARB_texture_float",
    "GL_ARB_texture_non_power_of_two",
    "GL_ARB_texture_rectangle",
    "GL_ARB_texture_rg",
    "GL_ARB_uniform_buffer_object",
    "GL_ARB_vertex_shader",
    "GL_ATI_blend_equation_separate",
    "GL_ATI_separate_stencil",
    "GL_ATI_texture_float",
];

/// A variable, the values with which Mesa crashes or waits for ever, and what is wrong with them.
struct Harmful {
    variable: &'static str,
    value: fn(&str) -> bool,
    why: &'static str,
}

/// Values that are refused for every backend.
const HARMFUL: [Harmful; 3] = [
    Harmful {
        variable: "MESA_GLSL_VERSION_OVERRIDE",
        value: |text| number(text).is_some_and(|version| version < 330),
        why: "the shaders need GLSL 330, and Mesa may crash: unset it",
    },
    Harmful {
        variable: "MESA_EXTENSION_OVERRIDE",
        value: |text| text.split(' ').filter_map(|word| word.strip_prefix('-')).any(|name| REQUIRED.contains(&name)),
        why: "it takes away a part of OpenGL 3.0, and Mesa may crash: unset it",
    },
    Harmful {
        variable: "LP_NATIVE_VECTOR_WIDTH",
        value: |text| number(text).is_some_and(|width| width < 32),
        why: "Mesa crashes if its vectors have fewer than 32 bits: unset it",
    },
];

/// Values that are refused for OSMesa only. EGL reports an error, or works.
const HARMFUL_TO_OSMESA: [Harmful; 2] = [
    Harmful {
        variable: "DRAW_USE_LLVM",
        value: |text| ["0", "f", "false", "n", "no"].contains(&text.to_ascii_lowercase().as_str()) && !softpipe(),
        why: "OSMesa crashes: unset it",
    },
    Harmful {
        variable: "GALLIUM_TRACE",
        value: |text| !text.is_empty(),
        why: "OSMesa waits for ever: unset it, or use the backend egl (--backend egl)",
    },
];

fn softpipe() -> bool {
    std::env::var_os("GALLIUM_DRIVER").is_some_and(|driver| driver == "softpipe")
}

/// Returns the number that a text begins with.
fn number(text: &str) -> Option<u32> {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    // A number that is too large for the type is larger than every bound here.
    (end > 0).then(|| text[..end].parse().unwrap_or(u32::MAX))
}

/// Refuses an environment that makes Mesa crash or wait for ever with any backend.
pub(super) fn check() -> Result<(), Error> {
    refuse(&HARMFUL, "", |variable| std::env::var_os(variable))
}

/// Refuses an environment that makes OSMesa crash or wait for ever.
pub(super) fn check_for_osmesa() -> Result<(), Error> {
    refuse(&HARMFUL_TO_OSMESA, "osmesa: ", |variable| std::env::var_os(variable))
}

fn refuse(all: &[Harmful], backend: &str, variable: impl Fn(&str) -> Option<OsString>) -> Result<(), Error> {
    for harmful in all {
        if let Some(value) = variable(harmful.variable)
            && (harmful.value)(&value.to_string_lossy())
        {
            let Harmful { variable, why, .. } = harmful;
            let value = Error::shown(&value.to_string_lossy());
            return Err(Error::Context(format!("{backend}{variable}={value}: {why}")));
        }
    }
    Ok(())
}

/// Advice for the user if a driver refuses: to unset the variables that are set and may be the cause, or `otherwise`.
pub(super) fn remedy(otherwise: &str) -> String {
    match in_force(std::env::vars_os().map(|(name, _)| name)).as_slice() {
        [] => otherwise.into(),
        names => format!("unset {}, or {otherwise}", names.join(" and ")),
    }
}

/// Returns those of the variables that may make a driver refuse, in alphabetical order.
fn in_force<S: AsRef<OsStr>>(names: impl Iterator<Item = S>) -> Vec<String> {
    let begins = |name: &str, with: &[&str]| with.iter().any(|start| name.starts_with(start));
    let names = names.filter_map(|name| name.as_ref().to_str().map(String::from));
    let mut found: Vec<_> = names.filter(|name| begins(name, &PREFIXES) && !begins(name, &HARMLESS)).collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(variable: &str, value: &str) -> bool {
        let of = |name: &str| (name == variable).then(|| value.into());
        let refused = refuse(&HARMFUL, "", of).and_then(|()| refuse(&HARMFUL_TO_OSMESA, "osmesa: ", of));
        if let Err(error) = &refused {
            assert!(error.to_string().contains(&format!("{variable}={value}: ")), "{error}");
        }
        refused.is_err()
    }

    #[test]
    fn values_that_crash_mesa_are_refused_and_no_others() {
        for (variable, harmful, harmless) in [
            (
                "MESA_GLSL_VERSION_OVERRIDE",
                ["0", "100", "130", "320es", " 329", "0x82"],
                ["", "330", "331", "460", "-5", "99999999999"],
            ),
            (
                "MESA_EXTENSION_OVERRIDE",
                [
                    "-GL_ARB_texture_float",
                    "-GL_ARB_shadow",
                    "GL_X -GL_ARB_shadow",
                    "-GL_ARB_sync -GL_ARB_shadow",
                    "-GL_ATI_texture_float",
                    "-GL_ARB_texture_rg +GL_X",
                ],
                ["", "-", "+GL_ARB_shadow", "GL_ARB_shadow", "-GL_ARB_sync -GL_KHR_debug", "junk"],
            ),
            ("LP_NATIVE_VECTOR_WIDTH", ["0", "1", "8", "16", "31", "0x80"], ["", "junk", "-1", "32", "128", "512"]),
            ("DRAW_USE_LLVM", ["0", "n", "NO", "f", "False", "no"], ["", "1", "yes", "true", "off", "junk"]),
            ("GALLIUM_TRACE", ["trace.xml", "/tmp/t", "a", "0", "no", " "], [""; 6]),
        ] {
            for value in harmful {
                assert!(refused(variable, value), "{variable}={value}");
            }
            for value in harmless {
                assert!(!refused(variable, value), "{variable}={value}");
            }
        }
    }

    #[test]
    fn every_variable_in_force_that_may_make_a_driver_refuse_is_named() {
        let named = [
            "DRAW_USE_LLVM",
            "EGL_PLATFORM",
            "GALLIUM_DRIVER",
            "LIBGL_ALWAYS_SOFTWARE",
            "LIBGL_DRIVERS_PATH",
            "MESA_EXTENSION_OVERRIDE",
            "MESA_GLSL_VERSION_OVERRIDE",
            "MESA_GL_VERSION_OVERRIDE",
            "MESA_LOADER_DRIVER_OVERRIDE",
            "__EGL_VENDOR_LIBRARY_FILENAMES",
        ];
        let others = ["PATH", "LP_NUM_THREADS", "MESA_SHADER_CACHE_DISABLE", "MESA_DEBUG", "LIBGL_DEBUG", "HELP_ME"];
        assert_eq!(in_force(others.iter().chain(&named)), named);
        assert!(in_force(others.iter()).is_empty());
    }
}
