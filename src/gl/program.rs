//! Shader programs, assembled from the files in `glsl/` and from `#define`s for the settings in use.

use super::{check, not_made};
use crate::Error;
use glow::HasContext;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// A shader file of `glsl/`.
#[derive(Clone, Copy)]
pub(crate) struct Source {
    /// The path within `glsl/`.
    pub(crate) name: &'static str,
    pub(crate) text: &'static str,
}

/// Includes a file of `glsl/` in the executable, as a [`Source`].
macro_rules! source {
    ($name:literal) => {
        $crate::gl::Source { name: $name, text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/glsl/", $name)) }
    };
}
pub(crate) use source;

/// The `#define`s with which a shader is compiled.
#[derive(Clone, Default, PartialEq, Debug)]
pub(crate) struct Defines(String);

impl Defines {
    /// Defines `name` as `value`.
    pub(crate) fn value(mut self, name: &str, value: impl std::fmt::Display) -> Defines {
        let _ = writeln!(self.0, "#define {name} {value}");
        self
    }

    /// Defines `name` as 1 if `on` is true.
    pub(crate) fn flag(self, name: &str, on: bool) -> Defines {
        if on { self.value(name, 1) } else { self }
    }

    /// Defines `PREFIX_WORD` as 1. For example, the prefix `SNAP` and the word `step` define `SNAP_STEP`.
    pub(crate) fn word(self, prefix: &str, word: &str) -> Defines {
        let name = format!("{prefix}_{}", word.to_uppercase().replace('-', "_"));
        self.value(&name, 1)
    }
}

/// Returns the source string number of piece `index` of `count`, for `#line`. The last piece, which is the pass's own
/// file, gets number 0: inside expressions Mesa reports 0 in place of the number, and most errors are in the pass's own
/// file.
fn number(index: usize, count: usize) -> usize {
    (index + 1) % count
}

/// Returns the text that is given to the driver. A `#line` before each piece makes errors name the piece and the line
/// within it.
pub(crate) fn assemble(defines: &Defines, pieces: &[Source]) -> String {
    let mut text = format!("#version 330 core\n{}", defines.0);
    for (index, piece) in pieces.iter().enumerate() {
        let _ = write!(text, "#line 1 {}\n{}", number(index, pieces.len()), piece.text);
    }
    text
}

/// A linked program.
pub(crate) struct Program {
    gl: Arc<glow::Context>,
    id: glow::Program,
    /// The uniforms that were set so far; `None` for one that the program does not read. They are looked up once, since
    /// glow copies the name at every query. The lock is there because programs are shared, and never waits.
    uniforms: Mutex<Vec<(&'static str, Option<glow::UniformLocation>)>>,
}

impl Program {
    /// Compiles and links a program. `fragment` is the shared pieces in order, followed by the pass's own file, which
    /// also names the program in errors. The outputs `out_0` to `out_2` are bound to the draw buffers 0 to 2.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        defines: &Defines,
        vertex: Source,
        fragment: &[Source],
    ) -> Result<Program, Error> {
        let name = fragment.last().map_or(vertex.name, |piece| piece.name);
        // SAFETY: the context is current. Every object made here is deleted on every way out.
        unsafe {
            let id = gl.create_program().map_err(|_| not_made(gl, name))?;
            let program = Program { gl: gl.clone(), id, uniforms: Mutex::default() };
            for (stage, pieces) in [(glow::VERTEX_SHADER, &[vertex][..]), (glow::FRAGMENT_SHADER, fragment)] {
                let shader = gl.create_shader(stage).map_err(|_| not_made(gl, name))?;
                gl.shader_source(shader, &assemble(defines, pieces));
                gl.compile_shader(shader);
                if !gl.get_shader_compile_status(shader) {
                    let log = gl.get_shader_info_log(shader);
                    gl.delete_shader(shader);
                    return Err(refused(gl, name, "compile", &with_file_names(&log, pieces)));
                }
                gl.attach_shader(id, shader);
                // OpenGL keeps an attached shader until its program is deleted.
                gl.delete_shader(shader);
            }
            for (index, output) in ["out_0", "out_1", "out_2"].into_iter().enumerate() {
                gl.bind_frag_data_location(id, index as u32, output);
            }
            gl.link_program(id);
            if !gl.get_program_link_status(id) {
                let log = gl.get_program_info_log(id);
                return Err(refused(gl, name, "link", &one_line(&log)));
            }
            check(gl, name)?;
            Ok(program)
        }
    }

    /// Makes this the program in use.
    pub(crate) fn bind(&self) -> &Program {
        // SAFETY: the context is current and the program is ours.
        unsafe { self.gl.use_program(Some(self.id)) };
        self
    }

    /// Returns the location of a vertex attribute, or `None` if the program does not read it.
    pub(crate) fn attribute(&self, name: &str) -> Option<u32> {
        // SAFETY: the context is current and the program is ours.
        unsafe { self.gl.get_attrib_location(self.id, name) }
    }

    /// Returns the location of a uniform, or `None` if the program does not read it.
    fn uniform(&self, name: &'static str) -> Option<glow::UniformLocation> {
        let mut uniforms = self.uniforms.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, location)) = uniforms.iter().find(|(known, _)| *known == name) {
            return *location;
        }
        // SAFETY: the context is current and the program is ours.
        let location = unsafe { self.gl.get_uniform_location(self.id, name) };
        uniforms.push((name, location));
        location
    }

    /// Sets a float of the program, which must be in use. As with all setters here, a uniform that the program does not
    /// have is ignored. A value beyond float32's range becomes the largest float32 number, since an infinity would
    /// become NaN when multiplied by 0.
    pub(crate) fn float(&self, name: &'static str, value: f64) -> &Program {
        let value = value.clamp(f32::MIN.into(), f32::MAX.into()) as f32;
        // SAFETY: the context is current and the program in use.
        unsafe { self.gl.uniform_1_f32(self.uniform(name).as_ref(), value) };
        self
    }

    /// Sets a vec2 of the program, which must be in use.
    pub(crate) fn vec2(&self, name: &'static str, [x, y]: [f64; 2]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_2_f32(self.uniform(name).as_ref(), x as f32, y as f32) };
        self
    }

    /// Sets a vec3 of the program, which must be in use.
    pub(crate) fn vec3(&self, name: &'static str, [x, y, z]: [f32; 3]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_3_f32(self.uniform(name).as_ref(), x, y, z) };
        self
    }

    /// Sets a vec4 of the program, which must be in use.
    pub(crate) fn vec4(&self, name: &'static str, [x, y, z, w]: [f32; 4]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_4_f32(self.uniform(name).as_ref(), x, y, z, w) };
        self
    }

    /// Sets a mat3, given column by column, of the program, which must be in use.
    pub(crate) fn mat3(&self, name: &'static str, columns: &[f32; 9]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_matrix_3_f32_slice(self.uniform(name).as_ref(), false, columns) };
        self
    }

    /// Sets a mat4, given column by column, of the program, which must be in use.
    pub(crate) fn mat4(&self, name: &'static str, columns: &[f32; 16]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_matrix_4_f32_slice(self.uniform(name).as_ref(), false, columns) };
        self
    }

    /// Sets an int of the program, which must be in use.
    pub(crate) fn int(&self, name: &'static str, value: i32) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_1_i32(self.uniform(name).as_ref(), value) };
        self
    }

    /// Sets an ivec2 of the program, which must be in use.
    pub(crate) fn ivec2(&self, name: &'static str, [x, y]: [i32; 2]) -> &Program {
        // SAFETY: as `float`.
        unsafe { self.gl.uniform_2_i32(self.uniform(name).as_ref(), x, y) };
        self
    }

    /// Makes a sampler of the program, which must be in use, read a texture unit.
    pub(crate) fn unit(&self, name: &'static str, unit: u32) -> &Program {
        self.int(name, unit as i32)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // SAFETY: the program is ours, and the context current by the contract of `gl`.
        unsafe { self.gl.delete_program(self.id) };
    }
}

/// Returns a driver's log in which the source string numbers are replaced by file names. Mesa writes `0:12(3): error`;
/// other drivers write `0(12) : error` or `ERROR: 0:12: ...`.
fn with_file_names(log: &str, pieces: &[Source]) -> String {
    let line = |line: &str| {
        let prefix = if line.starts_with("ERROR: ") { "ERROR: " } else { "" };
        let rest = &line[prefix.len()..];
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let number = rest[..digits].parse::<usize>().ok().filter(|_| rest[digits..].starts_with([':', '(']));
        let piece = |n| pieces.iter().enumerate().find(|&(i, _)| self::number(i, pieces.len()) == n).map(|(_, p)| p);
        match number.and_then(piece) {
            Some(piece) => format!("{prefix}{}{}", piece.name, &rest[digits..]),
            None => line.to_string(),
        }
    };
    one_line(&log.lines().map(line).collect::<Vec<_>>().join("\n"))
}

/// Returns the error for a shader that did not compile or link; `verb` says which. It quotes the driver's log if that
/// is not empty.
fn refused(gl: &glow::Context, name: &str, verb: &str, log: &str) -> Error {
    match check(gl, name) {
        _ if !log.is_empty() => Error::gl(name, log),
        Err(error) => error,
        Ok(()) => Error::gl(name, format!("the driver did not {verb} it and does not say why")),
    }
}

fn one_line(log: &str) -> String {
    log.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_file_and_the_line_in_it() {
        let pieces = [Source { name: "shared/a.glsl", text: "" }, Source { name: "b.frag", text: "" }];
        assert_eq!(with_file_names("0:12(3): error: no\n", &pieces), "b.frag:12(3): error: no");
        assert_eq!(with_file_names("1(7) : error C0", &pieces), "shared/a.glsl(7) : error C0");
        assert_eq!(
            with_file_names("ERROR: 0:2: x\nERROR: 1:3: y", &pieces),
            "ERROR: b.frag:2: x; ERROR: shared/a.glsl:3: y"
        );
        assert_eq!(with_file_names("2 errors", &pieces), "2 errors");
    }
}
