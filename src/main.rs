//! The `hbao` command: hands over to [`cli`], says what went wrong in one line, and sets the exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    // At a limit of file sizes (`ulimit -f`) a write is then an error, which is told and cleaned up after, where the
    // signal's default ends the process. Rust does the same for broken pipes.
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and to ignore a signal needs no handler.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    match cli::run(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::say(&error.to_string());
            ExitCode::from(if error.is_usage() { 2 } else { 1 })
        }
    }
}
