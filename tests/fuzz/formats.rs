//! Fuzzes the readers of PLY, STL and glTF files, which are told apart by their content.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each fuzz target uses only some of the functions
mod promises;

libfuzzer_sys::fuzz_target!(|model: &[u8]| {
    promises::any_model(model);
});
