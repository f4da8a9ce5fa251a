//! MTL files.

#![no_main]

#[path = "../hostile/promises.rs"]
#[allow(dead_code)] // each target holds one of them
mod promises;

const OBJ: &[u8] = b"mtllib m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b c\nf 1 2 3\n";

libfuzzer_sys::fuzz_target!(|mtl: &[u8]| {
    promises::model(OBJ, mtl);
});
