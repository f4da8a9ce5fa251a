//! Folders that a verb creates for its files.

use hbao::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// A folder that was created so that files can be written into it. Dropping this value removes the folder, unless
/// [`MadeFolder::keep`] is called or the folder existed before.
pub(crate) struct MadeFolder(Option<PathBuf>);

impl MadeFolder {
    /// Creates the folder, unless it exists already.
    pub(crate) fn ensure(path: &Path) -> Result<MadeFolder, Error> {
        if path.is_dir() {
            return Ok(MadeFolder(None));
        }
        let refused = |what: String| Error::Output { path: path.into(), what };
        if path.exists() {
            return Err(refused("it is a file, where a folder is wanted".into()));
        }
        fs::create_dir(path).map_err(|e| refused(format!("the folder cannot be made: {e}")))?;
        Ok(MadeFolder(Some(path.into())))
    }

    /// Keeps the folder.
    pub(crate) fn keep(mut self) {
        self.0 = None;
    }
}

impl Drop for MadeFolder {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            let _ = fs::remove_dir(path);
        }
    }
}
