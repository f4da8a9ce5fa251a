//! Fuzzes the readers of PNG and EXR files, from which settings are read.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each fuzz target uses only some of the functions
mod promises;

use std::path::PathBuf;
use std::sync::LazyLock;

/// The file is in memory if the system has a folder for that.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("hbao-fuzz-{}", std::process::id()))
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).unwrap();
    promises::picture(&FILE);
});
