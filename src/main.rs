//! The `hbao` command: hands over to [`cli`], says what went wrong in one line, and sets the exit code.

mod cli;

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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

/// The system's memory; where there is no more of it, one line and exit code 1 as for all else that fails. By itself
/// Rust would abort.
struct Memory;

#[global_allocator]
static MEMORY: Memory = Memory;

// SAFETY: each call is the system allocator's own, with the caller's own promises.
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        had(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        had(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        had(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }
}

fn had(memory: *mut u8, size: usize) -> *mut u8 {
    if memory.is_null() { out_of_memory(size) } else { memory }
}

#[cold]
fn out_of_memory(size: usize) -> ! {
    static SAID: AtomicBool = AtomicBool::new(false);
    if !SAID.swap(true, Ordering::Relaxed) {
        // Nothing here takes memory.
        let what = format_args!(
            "hbao: out of memory: {size} bytes more were not to be had; choose a smaller --size or model\n"
        );
        let _ = std::io::stderr().write_fmt(what);
        std::process::exit(1);
    }
    // Another thread has said so.
    loop {
        std::thread::sleep(Duration::from_secs(1));
    }
}
