//! Fuzzes the reader of MTL files.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each fuzz target uses only some of the functions
mod promises;

const OBJ: &[u8] = b"mtllib m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b c\nf 1 2 3\n";

libfuzzer_sys::fuzz_target!(|mtl: &[u8]| {
    promises::model(OBJ, mtl);
});
