//! The bytes of a model's file, for the readers of the formats, and what they make of them.

use super::{CameraMotion, Mesh, View};
use crate::Error;
use std::io::{self, BufRead};
use std::path::{Path, PathBuf};

/// What a file holds.
pub(super) struct Contents {
    pub(super) mesh: Mesh,
    pub(super) cameras: Vec<(String, View)>,
    pub(super) motions: Vec<(String, CameraMotion)>,
    /// The files that it names.
    pub(super) files: Vec<PathBuf>,
    pub(super) notices: Vec<String>,
}

impl Contents {
    /// The contents of a file that holds no more than a mesh.
    pub(super) fn of(mesh: Mesh) -> Contents {
        Contents { mesh, cameras: Vec::new(), motions: Vec::new(), files: Vec::new(), notices: Vec::new() }
    }
}

/// The file of a model, which may also be a pipe or a device.
pub(super) struct Source<'a, R> {
    /// The bytes, from the first one on.
    pub(super) bytes: R,
    pub(super) path: &'a Path,
    /// The number of bytes, if it is known before they are read.
    pub(super) length: Option<u64>,
}

impl<R> Source<'_, R> {
    /// Returns the error that the file is invalid, because of `what`.
    pub(super) fn refuse(&self, what: impl Into<String>) -> Error {
        Error::input(self.path, what.into())
    }
}

/// Fills `buffer`. Returns false if the bytes end before.
pub(super) fn fill(bytes: &mut impl BufRead, buffer: &mut [u8]) -> Result<bool, String> {
    match bytes.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(format!("cannot be read: {e}")),
    }
}
