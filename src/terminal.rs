//! Output to the terminal: results go to stdout; notices, progress and errors go to stderr.

use hbao::Error;
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::OnceCell;
use std::io::{self, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Whether `--quiet` was given.
static QUIET: AtomicBool = AtomicBool::new(false);
/// Whether stdout carries a file, as with `-o -`.
static STDOUT_IS_A_FILE: AtomicBool = AtomicBool::new(false);

/// Turns off notices and progress. Errors, and results that go to stdout, are still written.
pub(crate) fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Keeps stdout for a file that is written to it. Results then go to stderr.
pub(crate) fn keep_stdout_for_a_file() {
    STDOUT_IS_A_FILE.store(true, Ordering::Relaxed);
}

/// Writes the line of an error to stderr. Control characters, which may come from a file or a flag, become spaces, so
/// that it stays one line. A stderr that nobody reads is no error.
pub(crate) fn report_error(line: &str) {
    let _ = writeln!(io::stderr(), "hbao: {}", line.replace(char::is_control, " "));
}

/// Writes the line of a notice to stderr, in the same way, unless `--quiet` was given.
pub(crate) fn say(line: &str) {
    if !QUIET.load(Ordering::Relaxed) {
        report_error(line);
    }
}

/// Writes a result to stdout. It is no error if the reader closes the pipe early, as `head` does. If stdout carries a
/// file, the result goes to stderr, as notices do.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    if STDOUT_IS_A_FILE.load(Ordering::Relaxed) {
        if !QUIET.load(Ordering::Relaxed) {
            let _ = io::stderr().write_all(text.as_bytes());
        }
        return Ok(());
    }
    let mut stdout = io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Output { path: "standard output".into(), what: e.to_string() })
        }
        _ => Ok(()),
    }
}

/// Makes a progress bar on stderr. It shows nothing if stderr is no terminal, or if `--quiet` was given.
pub(crate) fn bar(length: u64, what: &'static str) -> ProgressBar {
    if QUIET.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(length).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left") {
        bar.set_style(style);
    }
    bar
}

/// The progress of reading a file. Nothing is shown of a file that is read within a second.
pub(crate) struct Loading {
    start: Instant,
    bar: OnceCell<ProgressBar>,
}

impl Loading {
    /// Begins to read a file.
    pub(crate) fn new() -> Loading {
        Loading { start: Instant::now(), bar: OnceCell::new() }
    }

    /// Shows that `done` of `total` bytes have been read. A total of 0 is unknown, and nothing is shown.
    pub(crate) fn show(&self, done: u64, total: u64) {
        const MB: u64 = 1_000_000;
        if total > 0 && self.start.elapsed() >= Duration::from_secs(1) {
            self.bar.get_or_init(|| bar(total.div_ceil(MB), "MB of the model")).set_position(done / MB);
        }
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.bar.get().inspect(|bar| bar.finish_and_clear());
    }
}
