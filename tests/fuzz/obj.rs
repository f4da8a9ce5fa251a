//! Fuzzes the reader of OBJ files.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each fuzz target uses only some of the functions
mod promises;

libfuzzer_sys::fuzz_target!(|obj: &[u8]| {
    promises::model(obj, b"newmtl a\nKd 0.5 1 0\nnewmtl b\nKd 1\n");
});
