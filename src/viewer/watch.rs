//! Notices that a model's file, or a material file that it names, has changed.

use eframe::egui;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// The time between two looks at the files. A change is reported when two looks in succession find the same, so that a
/// program that is writing has ended.
const PERIOD: Duration = Duration::from_millis(500);

/// A thread that looks at the files, and sleeps in between. It ends when this is dropped.
pub(super) struct Watch {
    /// `None` once the thread has been told to end, or if it could not be started.
    names: Option<Sender<OsString>>,
    has_changed: Arc<AtomicBool>,
    /// The window that is woken by a change, once there is one.
    window: Arc<OnceLock<egui::Context>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Watches the files of a scene, given by its name or path. A built-in scene has none.
    pub(super) fn start(name: &OsStr) -> Watch {
        let (names, named) = channel();
        let has_changed = Arc::new(AtomicBool::new(false));
        let window = Arc::new(OnceLock::<egui::Context>::new());
        let (changed, wakes, first) = (has_changed.clone(), window.clone(), name.to_owned());
        let look = move || {
            look(&named, first, || {
                changed.store(true, Ordering::Relaxed);
                if let Some(window) = wakes.get() {
                    window.request_repaint();
                }
            });
        };
        // Without the thread, a change is not noticed, and everything else works.
        let thread = std::thread::Builder::new().name("watch".into()).spawn(look).ok();
        Watch { names: Some(names), has_changed, window, thread }
    }

    /// Lets a change wake this window.
    pub(super) fn wakes(&self, window: &egui::Context) {
        let _ = self.window.set(window.clone());
    }

    /// Watches the files of another scene instead.
    pub(super) fn of(&self, name: &OsStr) {
        if let Some(names) = &self.names {
            let _ = names.send(name.to_owned());
        }
        self.has_changed.store(false, Ordering::Relaxed);
    }

    /// Returns whether the files have changed since the last call.
    pub(super) fn has_changed(&self) -> bool {
        self.has_changed.swap(false, Ordering::Relaxed)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.names = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The modification time and the size of a file; `None` if there is no such file.
type Stamp = Option<(SystemTime, u64)>;

fn stamps(files: &[PathBuf]) -> Vec<Stamp> {
    let stamp = |path: &PathBuf| {
        let found = std::fs::metadata(path).ok()?;
        Some((found.modified().ok()?, found.len()))
    };
    files.iter().map(stamp).collect()
}

/// Looks at the files of the scene that was named last, until nobody can name another.
fn look(named: &Receiver<OsString>, mut name: OsString, changed: impl Fn()) {
    let mut files = files_of(Path::new(&name));
    let (mut known, mut seen) = (stamps(&files), None);
    loop {
        match named.recv_timeout(PERIOD) {
            Ok(other) => {
                name = other;
                files = files_of(Path::new(&name));
                (known, seen) = (stamps(&files), None);
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let now = stamps(&files);
                // A model that is missing is being replaced.
                let is_there = now.first().is_some_and(Option::is_some);
                if now == known || !is_there {
                    seen = None;
                } else if seen.as_ref() == Some(&now) {
                    // It may name other materials now.
                    files = files_of(Path::new(&name));
                    (known, seen) = (stamps(&files), None);
                    changed();
                } else {
                    seen = Some(now);
                }
            }
        }
    }
}

/// Returns a model's file, and the files that it may name as its materials. Some of these may not exist. A file that
/// is no model, and a built-in scene, has none.
fn files_of(path: &Path) -> Vec<PathBuf> {
    // Opening a pipe would wait for its writer.
    if !path.is_file() {
        return Vec::new();
    }
    let Ok(file) = File::open(path) else { return Vec::new() };
    let mut files = vec![path.to_path_buf()];
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    if !is_obj {
        return files;
    }
    for line in BufReader::new(file).split(b'\n').map_while(Result::ok) {
        let Some(names) = line.trim_ascii_start().strip_prefix(b"mtllib") else { continue };
        // Exporters on Windows write backslashes. A statement names one file, or several.
        let names = String::from_utf8_lossy(names.trim_ascii()).replace('\\', "/");
        for name in [names.as_str()].into_iter().chain(names.split_whitespace()) {
            let file = path.with_file_name(name);
            if !files.contains(&file) {
                files.push(file);
            }
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_and_its_materials_are_watched_and_a_built_in_scene_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "v 0 0 0\nmtllib a.mtl\n  mtllib parts\\b c.mtl\nmtllib a.mtl\n").unwrap();
        let expected = ["a.obj", "a.mtl", "parts/b c.mtl", "parts/b", "c.mtl"].map(|name| folder.path().join(name));
        assert_eq!(files_of(&path), expected);
        assert!(files_of(Path::new(hbao::scene::CORNELL_BOX)).is_empty());
        assert!(files_of(folder.path()).is_empty());
    }

    #[test]
    fn a_change_is_noticed_once_and_the_new_material_file_is_watched() {
        let folder = tempfile::tempdir().unwrap();
        let [model, material] = ["a.obj", "a.mtl"].map(|name| folder.path().join(name));
        std::fs::write(&model, "v 0 0 0\n").unwrap();
        let watch = Watch::start(model.as_os_str());
        let waited = |periods: u32| {
            let changed = |_| {
                std::thread::sleep(PERIOD / 5);
                watch.has_changed()
            };
            (0..5 * periods).any(changed)
        };
        assert!(!waited(3));
        std::fs::write(&model, "v 0 0 0\nmtllib a.mtl\n").unwrap();
        assert!(waited(60));
        assert!(!waited(3));
        std::fs::write(&material, "newmtl a\n").unwrap();
        assert!(waited(60));
    }
}
