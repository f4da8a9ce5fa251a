//! Writes several files at once, each either completely or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf, is_separator};

use tempfile::TempPath;

use crate::Error;

/// The message for two outputs of the same name.
const TWICE: &str = "two outputs have this name: give each its own";

/// The files of one run. [`Outputs::stage`] writes each under a temporary name in its own folder. When all are staged,
/// [`Outputs::commit`] gives them their names. If the value is dropped before that, the temporary files are deleted.
///
/// At every moment, each name refers either to the earlier file (or to none) or to the complete new file. This holds
/// even if the process is killed or runs out of memory. In these cases no destructor runs, and files with temporary
/// names, `.hbao-*.tmp`, may be left behind. Nothing reads them, and they may be deleted. Files are not flushed to the
/// disk, so nothing is promised for a loss of power.
///
/// If a path is a symbolic link, the link stays and the file that it points to is replaced. If a path is neither a file
/// nor a folder (a terminal, `/dev/null`, a FIFO), or leads to an open file of this process, such as `/dev/stdout`, the
/// bytes are written to it instead of replacing it. The path `-` stands for standard output.
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

/// A complete file that still has its temporary name.
#[derive(Debug)]
struct StagedFile {
    path: PathBuf,
    temporary: TempPath,
    target: PathBuf,
}

/// Bytes for a destination that can be written to but not replaced.
#[derive(Debug)]
struct StagedStream {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// The kind of thing to which a path leads.
enum Destination {
    /// A file that exists or can be created, by its absolute path.
    File(PathBuf),
    /// Something that can only be written to.
    Stream,
}

impl Outputs {
    /// Makes an empty set of files.
    pub fn new() -> Outputs {
        Outputs::default()
    }

    /// Checks whether files could be written to these paths, so that a mistake is reported before any work is done. The
    /// temporary files that this creates are deleted at once.
    ///
    /// # Errors
    /// The same as for [`Outputs::stage`].
    pub fn check<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Result<(), Error> {
        let mut rehearsal = Outputs::new();
        paths.into_iter().try_for_each(|path| rehearsal.stage(path, b""))
    }

    /// Returns true if the bytes for this path would be written to something that exists and is not replaced: standard
    /// output, a pipe, a device, or an open file of this process.
    #[must_use]
    pub fn is_stream(path: impl AsRef<Path>) -> bool {
        matches!(destination(path.as_ref()), Ok(Destination::Stream))
    }

    /// Returns true if the path names standard output: `-` or `/dev/stdout`.
    #[must_use]
    pub fn is_standard_output(path: impl AsRef<Path>) -> bool {
        [Path::new("-"), Path::new("/dev/stdout")].contains(&path.as_ref())
    }

    /// Writes `bytes` under a temporary name in the folder of `path`. If `path` can be written to but not replaced, the
    /// bytes are kept in memory instead.
    ///
    /// # Errors
    /// [`Error::Output`] if `path` cannot be written, or if an earlier call staged a file for the same path.
    pub fn stage(&mut self, path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
        let path = path.as_ref();
        self.stage_by(path, |to| to.write_all(bytes).map_err(|e| Error::output(path, e)))
    }

    /// Lets `write` write the bytes, piece by piece, so that a large file need not fit into memory.
    ///
    /// # Errors
    /// The same as for [`Outputs::stage`], and what `write` returns.
    pub fn stage_by(
        &mut self,
        path: impl AsRef<Path>,
        write: impl FnOnce(&mut dyn Write) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let path = path.as_ref();
        let target = match destination(path).map_err(|what| Error::output(path, what))? {
            Destination::File(target) => target,
            Destination::Stream => {
                let taken = self.streams.iter().any(|stream| Outputs::is_standard_output(&stream.path));
                if taken && Outputs::is_standard_output(path) {
                    return Err(Error::output("standard output", TWICE));
                }
                let mut bytes = Vec::new();
                write(&mut bytes)?;
                self.streams.push(StagedStream { path: path.into(), bytes });
                return Ok(());
            }
        };
        if self.files.iter().any(|file| file.target == target) {
            return Err(Error::output(path, TWICE));
        }
        // The file is created with `File::create_new`, so that its permissions follow the umask. Files that tempfile
        // creates itself have the permissions 0600.
        let folder = target.parent().unwrap_or(&target);
        let mut file = tempfile::Builder::new()
            .prefix(".hbao-")
            .suffix(".tmp")
            .make_in(folder, |name| File::create_new(name))
            .map_err(|e| Error::output(path, format!("no file can be created in {}: {e}", folder.display())))?;
        let mut buffered = BufWriter::new(file.as_file_mut());
        write(&mut buffered)?;
        buffered.flush().map_err(|e| Error::output(path, e))?;
        drop(buffered);
        self.files.push(StagedFile { path: path.into(), temporary: file.into_temp_path(), target });
        Ok(())
    }

    /// Gives every staged file its name, and replaces the file that had this name. Streams such as pipes and devices,
    /// which cannot be replaced, are written first, so that a broken pipe leaves all files as they were.
    ///
    /// # Errors
    /// [`Error::Output`] if writing or renaming fails. If renaming fails, the files that were staged earlier have
    /// already been replaced, and those staged later have not.
    pub fn commit(self) -> Result<(), Error> {
        for StagedStream { path, bytes } in &self.streams {
            if Outputs::is_standard_output(path) {
                let mut stdout = io::stdout();
                let written = stdout.write_all(bytes).and_then(|()| stdout.flush());
                written.map_err(|e| Error::output("standard output", e))?;
                continue;
            }
            // Appending keeps what a log file contains when the shell has opened it with `>> log`. For pipes and
            // devices it makes no difference.
            let mut stream = OpenOptions::new().append(true).open(path).map_err(|e| Error::output(path, e))?;
            stream.write_all(bytes).map_err(|e| Error::output(path, e))?;
        }
        for StagedFile { path, temporary, target } in self.files {
            temporary.persist(target).map_err(|e| Error::output(path, e.error))?;
        }
        Ok(())
    }
}

/// Finds out what `path` leads to, or why nothing can be written there. Links are followed and the folder is made
/// absolute, so that two different paths of one file are recognised as the same.
fn destination(path: &Path) -> Result<Destination, String> {
    if path.to_string_lossy().ends_with(is_separator) {
        return Err("it is the name of a folder: add the name of a file".into());
    }
    if Outputs::is_standard_output(path) {
        return Ok(Destination::Stream);
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
        return Err("it does not end with the name of a file: add one".into());
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

/// Follows symbolic links from `path` until a path is not a link. That path need not exist. It also stops at an open
/// file of this process, because the link of such a file may not be a path (`pipe:[4711]`).
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    const MOST_LINKS: usize = 40; // Linux follows as many
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if is_descriptor(&target) {
            return Ok(target);
        }
        let Ok(link) = fs::read_link(&target) else {
            return Ok(target);
        };
        target.pop();
        target.push(link); // an absolute link replaces the whole path
    }
    Err(io::Error::other("too many symbolic links"))
}

/// Returns true for paths by which Unix shows a process its open files, such as the one that `/dev/stdout` links to.
/// Even if the open file is a regular file it must not be replaced by renaming another file, because the shell that
/// opened it would keep the old one.
fn is_descriptor(path: &Path) -> bool {
    path.starts_with("/dev/fd") || path.starts_with("/proc")
}
