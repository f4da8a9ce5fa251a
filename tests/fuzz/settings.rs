//! Settings files.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each target holds one of them
mod promises;

libfuzzer_sys::fuzz_target!(|text: &str| {
    promises::settings(text);
});
