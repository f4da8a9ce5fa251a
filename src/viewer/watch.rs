//! Notices that a file of the scene has changed: the model, or a file that it names.

use eframe::egui;
use std::path::PathBuf;
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
    scenes: Option<Sender<Files>>,
    has_changed: Arc<AtomicBool>,
    /// The window that is woken by a change, once there is one.
    window: Arc<OnceLock<egui::Context>>,
    thread: Option<JoinHandle<()>>,
}

/// The files of a scene, the model first, and the time before which they were not read.
type Files = (Vec<PathBuf>, SystemTime);

impl Watch {
    /// Watches files that were read after this time. A change after it is noticed even if it came before this call.
    pub(super) fn start(files: &[PathBuf], since: SystemTime) -> Watch {
        let (scenes, shown) = channel();
        let has_changed = Arc::new(AtomicBool::new(false));
        let window = Arc::new(OnceLock::<egui::Context>::new());
        let (changed, wakes, first) = (has_changed.clone(), window.clone(), (files.to_vec(), since));
        let look = move || {
            look(&shown, first, || {
                changed.store(true, Ordering::Relaxed);
                if let Some(window) = wakes.get() {
                    window.request_repaint();
                }
            });
        };
        // Without the thread, a change is not noticed, and everything else works.
        let thread = std::thread::Builder::new().name("watch".into()).spawn(look).ok();
        Watch { scenes: Some(scenes), has_changed, window, thread }
    }

    /// Lets a change wake this window.
    pub(super) fn wakes(&self, window: &egui::Context) {
        let _ = self.window.set(window.clone());
    }

    /// Watches other files instead, as [`Watch::start`] does.
    pub(super) fn of(&self, files: &[PathBuf], since: SystemTime) {
        if let Some(scenes) = &self.scenes {
            let _ = scenes.send((files.to_vec(), since));
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
        self.scenes = None;
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

/// Looks at the files of the scene that was shown last, until nobody can show another.
fn look(shown: &Receiver<Files>, first: Files, changed: impl Fn()) {
    let as_read = |files: &[PathBuf], since: SystemTime| {
        // What was written since may not be what was read.
        let read = |stamp: Stamp| stamp.filter(|(modified, _)| *modified < since);
        stamps(files).into_iter().map(read).collect::<Vec<_>>()
    };
    let mut files = first.0;
    let (mut known, mut seen) = (as_read(&files, first.1), None);
    loop {
        match shown.recv_timeout(PERIOD) {
            Ok((others, since)) => {
                files = others;
                (known, seen) = (as_read(&files, since), None);
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let now = stamps(&files);
                // A model that is missing is being replaced.
                let is_there = now.first().is_some_and(Option::is_some);
                if now == known || !is_there {
                    seen = None;
                } else if seen.as_ref() == Some(&now) {
                    (known, seen) = (now, None);
                    changed();
                } else {
                    seen = Some(now);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn waited(watch: &Watch, periods: u32) -> bool {
        let changed = |_| {
            std::thread::sleep(PERIOD / 5);
            watch.has_changed()
        };
        (0..5 * periods).any(changed)
    }

    #[test]
    fn a_change_of_any_file_is_noticed_once() {
        let folder = tempfile::tempdir().unwrap();
        let files = ["a.obj", "a.mtl", "missing.png"].map(|name| folder.path().join(name));
        files[..2].iter().for_each(|file| fs::write(file, "v 0 0 0\n").unwrap());
        let watch = Watch::start(&files, SystemTime::now() + PERIOD);
        assert!(!waited(&watch, 3));
        fs::write(&files[1], "newmtl a\n").unwrap();
        assert!(waited(&watch, 60));
        assert!(!waited(&watch, 3));
        // A texture that was missing is there now.
        fs::write(&files[2], "a picture").unwrap();
        assert!(waited(&watch, 60));
    }

    #[test]
    fn a_change_while_the_files_were_read_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.obj");
        let since = SystemTime::now();
        std::thread::sleep(PERIOD / 5);
        fs::write(&file, "v 0 0 0\n").unwrap();
        let watch = Watch::start(&[file], since);
        assert!(waited(&watch, 60));
        assert!(!waited(&watch, 3));
    }

    #[test]
    fn a_scene_without_files_does_not_change() {
        assert!(!waited(&Watch::start(&[], SystemTime::now()), 2));
    }
}
