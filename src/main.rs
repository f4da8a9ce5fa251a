//! The `hbao` command: it hands over to [`cli`], prints an error as one line, and sets the exit code.

mod cli;
mod heat;
mod picture;
mod report;
mod terminal;
#[cfg(feature = "view")]
mod viewer;

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

fn main() -> ExitCode {
    // By default the signal SIGXFSZ ends the process at a write past the limit of file sizes (`ulimit -f`). If the
    // signal is ignored, the write returns an error, which can be reported, and half-written files can be removed. Rust
    // treats broken pipes in the same way.
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and ignoring a signal needs no handler.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    match cli::run(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::report_error(&error.to_string());
            ExitCode::from(if error.is_usage() { 2 } else { 1 })
        }
    }
}

/// The system's allocator. If memory runs out, the program prints one line and exits with code 1, as for every other
/// failure; Rust's own handler would abort.
struct Memory;

#[global_allocator]
static MEMORY: Memory = Memory;

// SAFETY: each function passes its arguments to the system's allocator, which has the same contract.
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        exit_where_null(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        exit_where_null(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        exit_where_null(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }
}

/// Returns the memory that the system gave, or ends the program if the pointer is null.
fn exit_where_null(memory: *mut u8, size: usize) -> *mut u8 {
    if memory.is_null() { out_of_memory(size) } else { memory }
}

#[cold]
fn out_of_memory(size: usize) -> ! {
    static REPORTED: AtomicBool = AtomicBool::new(false);
    if !REPORTED.swap(true, Ordering::Relaxed) {
        // Nothing in this branch allocates.
        let _ = writeln!(
            std::io::stderr(),
            "hbao: out of memory: {size} bytes more were not to be had; choose a smaller --size or model"
        );
        std::process::exit(1);
    }
    // Another thread has printed the line and is ending the program; this thread waits.
    loop {
        std::thread::sleep(Duration::from_secs(1));
    }
}
