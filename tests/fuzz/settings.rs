//! Settings files.

#![no_main]

#[path = "../hostile/promises.rs"]
mod promises;

libfuzzer_sys::fuzz_target!(|text: &str| {
    promises::settings(text);
});
