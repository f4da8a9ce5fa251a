//! The one error type of the library.

use std::path::PathBuf;

/// What can go wrong. Each message is one line that says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting, flag or size outside what is allowed. Nothing was attempted.
    #[error("{0}")]
    Usage(String),
    /// No OpenGL 3.3 context could be had.
    #[error("{0}")]
    Context(String),
    /// A model, material or settings file that cannot be read or makes no sense.
    #[error("{}: {what}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where in it.
        what: String,
    },
    /// A file that cannot be written. Nothing is left under its name.
    #[error("cannot write {}: {what}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why not.
        what: String,
    },
    /// The driver refused something: a shader, a framebuffer, an allocation.
    #[error("OpenGL: {place}: {what}")]
    #[non_exhaustive]
    Gl {
        /// The pass or object.
        place: String,
        /// The driver's words.
        what: String,
        /// What the library itself goes by.
        #[doc(hidden)]
        cause: GlCause,
    },
}

/// Why OpenGL refused, for the library to act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GlCause {
    /// An error's code.
    Code(u32),
    /// No object was made, and no error says why.
    NoObject,
    /// The place's own finding: a framebuffer that is incomplete, a shader that does not compile.
    Finding,
}

impl Error {
    /// True where the request itself was wrong (exit code 2), false where carrying it out failed (exit code 1).
    #[must_use]
    pub fn is_usage(&self) -> bool {
        matches!(self, Error::Usage(_))
    }

    /// Text of a file or a flag as it may appear in a message: on one line, printable and not too long.
    pub(crate) fn shown(text: &str) -> String {
        const LONGEST: usize = 100;
        let cut = text.char_indices().nth(LONGEST).map(|(end, _)| end);
        let quoted = format!("{:?}", &text[..cut.unwrap_or(text.len())]);
        format!("{}{}", &quoted[1..quoted.len() - 1], if cut.is_some() { "..." } else { "" })
    }

    pub(crate) fn gl(place: impl Into<String>, what: impl Into<String>) -> Error {
        Error::gl_because(place, what, GlCause::Finding)
    }

    pub(crate) fn gl_because(place: impl Into<String>, what: impl Into<String>, cause: GlCause) -> Error {
        Error::Gl { place: place.into(), what: what.into(), cause }
    }

    pub(crate) fn input(path: impl Into<PathBuf>, what: impl Into<String>) -> Error {
        Error::Input { path: path.into(), what: what.into() }
    }

    pub(crate) fn output(path: impl Into<PathBuf>, what: impl ToString) -> Error {
        Error::Output { path: path.into(), what: what.to_string() }
    }
}
