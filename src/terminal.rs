//! Output to the terminal: results go to stdout, notices and progress to stderr.

use hbao::Error;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write as _};

/// Writes one line to stderr. Control characters, which may come from a file or a flag, become spaces, so that it stays
/// one line. A stderr that nobody reads is no error.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "hbao: {}", line.replace(char::is_control, " "));
}

/// Writes a result to stdout. It is no error if the reader closes the pipe early, as `head` does.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Output { path: "standard output".into(), what: e.to_string() })
        }
        _ => Ok(()),
    }
}

/// Makes a progress bar on stderr. It shows nothing if stderr is no terminal.
pub(crate) fn bar(length: u64, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(length).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
