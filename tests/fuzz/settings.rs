//! Fuzzes the reader of settings files.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each fuzz target uses only some of the functions
mod promises;

libfuzzer_sys::fuzz_target!(|text: &str| {
    promises::settings(text);
});
