//! The bytes of a model's file, for the readers of the formats.

use crate::Error;
use std::io::{self, BufRead};
use std::path::Path;

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
