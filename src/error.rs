//! The one error type of the library.

use std::path::PathBuf;

/// The errors of the library. The message of each error is one line that says what is wrong, where it is wrong, and
/// what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting, flag, size or argument is outside its allowed range. Nothing was attempted.
    #[error("{0}")]
    Usage(String),
    /// An OpenGL 3.3 core context could not be opened.
    #[error("{0}")]
    Context(String),
    /// A model, material, image or settings file cannot be read, or its contents are invalid.
    #[error("{}: {what}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What is wrong with the file, and at which place in it.
        what: String,
    },
    /// A file cannot be written. An earlier file of that name is left as it was, and no part of the new one remains.
    #[error("cannot write {}: {what}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why it cannot be written.
        what: String,
    },
    /// The driver refused a shader, a framebuffer, an allocation or a call.
    #[error("OpenGL: {place}: {what}")]
    #[non_exhaustive]
    Gl {
        /// The pass or object at which OpenGL refused.
        place: String,
        /// What the driver reported, or what this library found wrong.
        what: String,
        /// The reason in a form that the library itself can test.
        #[doc(hidden)]
        cause: GlCause,
    },
}

/// Why OpenGL refused, in a form that the library can test. See [`crate::gl::is_refusal`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GlCause {
    /// The error code that `glGetError` returned.
    Code(u32),
    /// The driver made no object and recorded no error.
    NoObject,
    /// A failure that `glGetError` does not report: an incomplete framebuffer, or a shader that does not compile.
    Finding,
}

impl Error {
    /// Returns true if the request itself was wrong (exit code 2 of the command), false if carrying it out failed (exit
    /// code 1).
    #[must_use]
    pub fn is_usage(&self) -> bool {
        matches!(self, Error::Usage(_))
    }

    /// Prepares text from a file or a flag for a message: escapes what is not printable, line ends included, and cuts
    /// the text after 100 characters.
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
