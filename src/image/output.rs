//! Files written whole or not at all, several at once.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf, is_separator};

use tempfile::TempPath;

use crate::Error;

/// The files of one run. Each is staged under a temporary name in its own folder; once all are, [`Outputs::commit`]
/// gives them their names. Dropped before that, nothing is left.
///
/// Whenever the process is killed, or ended for want of memory (then no destructor runs), under each name is what was
/// there before or the new file, whole. It may leave files of the temporary names behind, `.hbao-*.tmp`, which
/// nothing reads and anyone may delete. Nothing is flushed to the disk: a loss of power is another matter.
///
/// A symbolic link is followed: it stays, and what it points to is replaced. What is neither a file nor a folder (a
/// terminal, `/dev/null`, a FIFO), and whatever `/dev/stdout` leads to, keeps its place: the bytes are sent into it.
///
/// ```
/// # fn main() -> Result<(), hbao::Error> {
/// # let folder = tempfile::tempdir().unwrap();
/// # let (image, table) = (folder.path().join("ao.png"), folder.path().join("timings.json"));
/// let mut outputs = hbao::image::Outputs::new();
/// outputs.stage(&image, b"...")?;
/// outputs.stage(&table, b"...")?;
/// outputs.commit()?; // now both exist
/// # assert!(image.exists() && table.exists());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
#[must_use = "nothing is written until `commit` is called"]
pub struct Outputs {
    files: Vec<StagedFile>,
    streams: Vec<StagedStream>,
}

/// A file that is complete but for its name.
#[derive(Debug)]
struct StagedFile {
    path: PathBuf,
    temporary: TempPath,
    target: PathBuf,
}

/// Bytes for a thing that cannot be replaced, only written to.
#[derive(Debug)]
struct StagedStream {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// What a path leads to.
enum Destination {
    File(PathBuf),
    Stream,
}

impl Outputs {
    /// Nothing to write yet.
    pub fn new() -> Outputs {
        Outputs::default()
    }

    /// Finds out whether files of these names could be written, before any work is done for them. It leaves nothing.
    pub fn check<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Result<(), Error> {
        let mut rehearsal = Outputs::new();
        paths.into_iter().try_for_each(|path| rehearsal.stage(path, b""))
    }

    /// Writes `bytes` under a temporary name beside `path`, or keeps them where `path` cannot be replaced.
    pub fn stage(&mut self, path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
        let path = path.as_ref();
        let target = match destination(path).map_err(|what| Error::output(path, what))? {
            Destination::File(target) => target,
            Destination::Stream => {
                self.streams.push(StagedStream { path: path.into(), bytes: bytes.into() });
                return Ok(());
            }
        };
        if self.files.iter().any(|file| file.target == target) {
            return Err(Error::output(path, "two outputs have this name: give each its own"));
        }
        // The file is created as any other, so that its permissions follow the umask; tempfile's own are 0600.
        let folder = target.parent().unwrap_or(&target);
        let mut file = tempfile::Builder::new()
            .prefix(".hbao-")
            .suffix(".tmp")
            .make_in(folder, |name| File::create_new(name))
            .map_err(|e| Error::output(path, format!("the folder {} takes no files: {e}", folder.display())))?;
        file.as_file_mut().write_all(bytes).map_err(|e| Error::output(path, e))?;
        self.files.push(StagedFile { path: path.into(), temporary: file.into_temp_path(), target });
        Ok(())
    }

    /// Gives every staged file its name, replacing what had it. Streams go first, since a broken pipe should leave the
    /// files as they were. Should a rename fail all the same, the files before it are in place, those after it are not.
    pub fn commit(self) -> Result<(), Error> {
        for StagedStream { path, bytes } in &self.streams {
            // Appending leaves alone what `>> log` had in it, and means nothing to a pipe or a device.
            let mut stream = OpenOptions::new().append(true).open(path).map_err(|e| Error::output(path, e))?;
            stream.write_all(bytes).map_err(|e| Error::output(path, e))?;
        }
        for StagedFile { path, temporary, target } in self.files {
            temporary.persist(target).map_err(|e| Error::output(path, e.error))?;
        }
        Ok(())
    }
}

/// Where the bytes for `path` have to go, or why they cannot: links followed, and the folder absolute, so that two
/// spellings of one file are known as one.
fn destination(path: &Path) -> Result<Destination, String> {
    if path.to_string_lossy().ends_with(is_separator) {
        return Err("it is the name of a folder: add that of a file".into());
    }
    let target = follow_links(path).map_err(|e| e.to_string())?;
    if let Ok(existing) = fs::metadata(path) {
        if existing.is_dir() {
            return Err("it is a folder: name a file".into());
        }
        if !existing.is_file() || is_descriptor(&target) {
            return Ok(Destination::Stream);
        }
        if existing.permissions().readonly() {
            return Err("the file is read-only: choose another name, or make it writable".into());
        }
    }
    let Some(name) = target.file_name() else {
        return Err("this is no name for a file".into());
    };
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match folder.canonicalize() {
        Ok(absolute) if absolute.is_dir() => Ok(Destination::File(absolute.join(name))),
        Ok(_) => Err(format!("{} is not a folder", folder.display())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            Err(format!("the folder {} does not exist: create it first", folder.display()))
        }
        Err(e) => Err(format!("the folder {}: {e}", folder.display())),
    }
}

/// Follows symbolic links from `path` to a name that is none, which need not exist. It stops at an open descriptor,
/// whose link may lead to no name at all (`pipe:[4711]`).
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    const MOST_LINKS: usize = 40; // as many as Linux follows
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if is_descriptor(&target) {
            return Ok(target);
        }
        let Ok(link) = fs::read_link(&target) else {
            return Ok(target);
        };
        target.pop();
        target.push(link); // replaces all where the link is absolute
    }
    Err(io::Error::other("too many symbolic links"))
}

/// True for the names by which Unix shows a process its open files, such as what `/dev/stdout` links to. Where one is a
/// regular file, a rename would put another file in its place behind the back of the shell that opened it.
fn is_descriptor(path: &Path) -> bool {
    path.starts_with("/dev/fd") || path.starts_with("/proc")
}
