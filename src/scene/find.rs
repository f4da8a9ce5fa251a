//! Finds the files that a model names. All of them must lie in one of the model's folders or below it: models are often
//! files from somebody else, and must not be able to make this program open files elsewhere.

use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// A file that was found.
pub(super) struct Found {
    /// Its path beside the model's path, for messages.
    pub(super) shown: PathBuf,
    /// Its path without symbolic links.
    pub(super) real: PathBuf,
}

/// Returns the file names that the bytes of a name may mean. On Unix these are the bytes themselves. Bytes that are not
/// UTF-8 may also be Latin-1, in which many programs on Windows write names; the file system then has the same letters.
pub(super) fn spellings(name: &[u8]) -> Vec<OsString> {
    if let Ok(name) = std::str::from_utf8(name) {
        return vec![name.into()];
    }
    let latin1: String = name.iter().map(|&byte| char::from(byte)).collect();
    #[cfg(unix)]
    let bytes = Some(std::os::unix::ffi::OsStrExt::from_bytes(name)).map(|name: &OsStr| name.to_os_string());
    #[cfg(not(unix))]
    let bytes = None;
    bytes.into_iter().chain([latin1.into()]).collect()
}

/// Returns the folders of a model: the one in its path, and the one in which the file lies if the path is a symbolic
/// link.
pub(super) fn folders_of(model: &Path) -> Vec<PathBuf> {
    let folder = |path: PathBuf| match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    };
    [Some(model.to_path_buf()), model.canonicalize().ok()].into_iter().flatten().map(folder).collect()
}

/// Finds one file, whose name has slashes: under the name as it is written, then under the name's last part beside
/// the model, and then under that part in another case if only one file has it so. Otherwise says why it is not opened,
/// in words that follow its name.
pub(super) fn find(folders: &[PathBuf], name: &[u8]) -> Result<Found, String> {
    let mut why = None;
    for spelling in spellings(name) {
        let written = PathBuf::from(spelling);
        let last = written.file_name().unwrap_or_default();
        let in_another_case = folders.iter().rev().filter_map(|folder| in_another_case(folder, last));
        for path in [written.clone(), last.into()].into_iter().chain(in_another_case) {
            match inside(folders, &path) {
                Ok(file) => return Ok(file),
                Err(NotOpened::Missing) => {}
                Err(NotOpened::Because(what)) => why = why.or(Some(what)),
            }
        }
    }
    Err(why.unwrap_or_else(|| "is not beside the model".into()))
}

/// Returns where a file is looked for first, or `None` if it could not be opened there.
pub(super) fn expected(folders: &[PathBuf], name: &[u8]) -> Option<PathBuf> {
    let name: Vec<u8> = name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
    let name = PathBuf::from(spellings(&name).swap_remove(0));
    is_below(&name).then(|| folders.first().map(|folder| folder.join(name))).flatten()
}

/// Returns the name of the only file of a folder that has this name in another case.
fn in_another_case(folder: &Path, name: &OsStr) -> Option<PathBuf> {
    let wanted = name.to_str()?.to_lowercase();
    let names = folder.read_dir().ok()?.flatten().map(|entry| entry.file_name());
    let mut names = names.filter(|name| name.to_str().is_some_and(|name| name.to_lowercase() == wanted));
    let found = names.next()?;
    names.next().is_none().then(|| found.into())
}

/// Returns whether a path leads into the folder in which it begins, if it meets no symbolic link.
fn is_below(path: &Path) -> bool {
    let plain = |part: Component| match part {
        Component::CurDir => true,
        // On Windows a colon belongs to a drive, C:, or to a stream of a file.
        Component::Normal(part) => !cfg!(windows) || !part.as_encoded_bytes().contains(&b':'),
        _ => false,
    };
    !path.as_os_str().is_empty() && path.components().all(plain)
}

/// Why a file is not opened.
pub(super) enum NotOpened {
    Missing,
    Because(String),
}

/// Finds the file `relative` in the first of `folders` that has it. Its symbolic links are followed, and what they lead
/// to must lie in one of the folders, too.
pub(super) fn inside(folders: &[PathBuf], relative: &Path) -> Result<Found, NotOpened> {
    if !is_below(relative) {
        return Err(NotOpened::Missing);
    }
    let mut found = Err(NotOpened::Missing);
    for folder in folders.iter().rev() {
        let path = folder.join(relative);
        found = match (path.canonicalize(), found) {
            (Ok(real), _) => Ok(Found { shown: path.strip_prefix(".").unwrap_or(&path).into(), real }),
            (Err(e), Err(NotOpened::Missing))
                if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) =>
            {
                Err(NotOpened::Because(format!("cannot be read ({e})")))
            }
            (_, found) => found,
        };
    }
    let file = found?;
    let holds = |folder: &PathBuf| folder.canonicalize().is_ok_and(|folder| file.real.starts_with(folder));
    if !folders.iter().any(holds) {
        return Err(NotOpened::Because("leads out of the model's folder".into()));
    }
    // Nothing else is opened: to open a pipe, for example, could wait for ever.
    if !file.real.is_file() {
        return Err(NotOpened::Because("is not a file".into()));
    }
    Ok(file)
}
