//! Opens the file of a model, finds its format by its content, and tells how much of it has been read.

use super::foreign::{self, Model};
use super::notices::Notices;
use super::source::{Contents, Source};
use super::{Mesh, gltf, ply, stl};
use crate::Error;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// How many bytes are read from the file at once.
const BLOCK: usize = 1 << 16;

/// Reads a model. `progress` is called with the number of bytes that have been read, and with how many there are, or 0
/// if that is not known.
pub(super) fn read(path: &Path, progress: &dyn Fn(u64, u64)) -> Result<Contents, Error> {
    if path.is_dir() {
        return Err(Error::input(path, "is a folder; name a file: OBJ, PLY, STL or glTF"));
    }
    let file = File::open(path).map_err(|e| cannot_read(path, &e))?;
    let length = file.metadata().ok().filter(|file| file.is_file()).map(|file| file.len());
    let counted = Counted { file, read: 0, length: length.unwrap_or(0), progress };
    read_from(BufReader::with_capacity(BLOCK, counted), path, length)
}

/// Reads a model from a stream. `path` names it in messages, and the files that it names are looked for beside it.
pub(super) fn read_from(bytes: impl BufRead, path: &Path, length: Option<u64>) -> Result<Contents, Error> {
    let (head, bytes) = foreign::head(bytes).map_err(|e| cannot_read(path, &e))?;
    let source = Source { bytes, path, length };
    let mut notices = Notices::default();
    let contents = match foreign::model(&head, length) {
        Model::Obj => {
            let (mesh, notices, files) = Mesh::from_obj(source.bytes, path)?;
            return Ok(Contents { files, notices, ..Contents::of(mesh) });
        }
        Model::Ply => Contents::of(ply::read(source, &mut notices)?),
        Model::BinaryStl => Contents::of(stl::read_binary(source, &mut notices)?),
        Model::TextStl => Contents::of(stl::read_text(source, &mut notices)?),
        Model::Glb => gltf::read_binary(source, &mut notices)?,
        Model::Gltf => gltf::read_text(source, &mut notices)?,
    };
    Ok(Contents { notices: notices.lines(), ..contents })
}

fn cannot_read(path: &Path, error: &io::Error) -> Error {
    Error::input(path, format!("cannot be read: {error}"))
}

/// Counts the bytes that are read from a file.
struct Counted<'a> {
    file: File,
    read: u64,
    length: u64,
    progress: &'a dyn Fn(u64, u64),
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // A whole buffer may be asked for in one call, and it would be filled without a word.
        let most = buffer.len().min(16 * BLOCK);
        let count = self.file.read(&mut buffer[..most])?;
        self.read += count as u64;
        (self.progress)(self.read, self.length);
        Ok(count)
    }
}
