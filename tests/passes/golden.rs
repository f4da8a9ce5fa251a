//! Compares the built-in scene with images that somebody has looked at and approved: `tests/passes/golden/*.png`.
//!
//! `HBAO_BLESS=1 cargo test --test passes golden` writes the images again. Look at them before you commit them.

use crate::rig;
use crate::rig::{Frame, Limits, hold, scenes};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::{Image, Texel, png};
use hbao::settings::Radius;
use std::path::Path;

const SIZE: (u32, u32) = (160, 120);

/// Another processor or LLVM version may round a colour or A differently by one 8-bit step, the blur may turn that into
/// two steps, and a normal in RGBA8_SNORM is renormalised before it is shown. A few pixels differ by more where a
/// decision in float32 falls the other way: one such ambiguous pixel changes all pixels that the blur spreads it over.
const LIMITS: Limits = Limits { tolerance: 2.0, share: 0.005 };

/// Renders with one sample per pixel, because the positions of several samples are the driver's choice.
fn frame() -> Frame {
    let shot = scenes::cornell_box();
    let settings = Settings { radius: Radius::Units(shot.radius), msaa: 1, ..Settings::default() };
    rig::render(Context::open(Backend::Auto).unwrap().gl(), &shot, SIZE, &settings)
}

/// Compares an image with the file of that name, channel by channel. With `HBAO_BLESS=1` it writes the file instead.
#[track_caller]
fn hold_to_file<T: Texel<Component = u8>>(name: &str, got: &Image<T>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/passes/golden").join(name);
    if std::env::var_os("HBAO_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(&path, png::encode(got, &[]).unwrap()).unwrap();
        return;
    }
    let again = "HBAO_BLESS=1 cargo test --test passes golden";
    let golden: Image<T> = png::read(&path).unwrap_or_else(|e| panic!("{e}\nto make it: {again}"));
    for channel in 0..T::COMPONENTS {
        let [got, golden] = [got, &golden].map(|image| image.map(|texel| texel.components()[channel]));
        let context = format!("{}\nif the new image is right: {again}", path.display());
        hold(name, &got, &golden, &got.map(|_| true), LIMITS, &context);
    }
}

#[test]
fn the_final_image() {
    hold_to_file("final.png", &frame().composite);
}

#[test]
fn ambient_occlusion() {
    hold_to_file("ao.png", &frame().ao.map(|a| (a * 255.0).round() as u8));
}

#[test]
fn normals() {
    hold_to_file("normals.png", &frame().normals.map(|n| n.map(|c| ((c * 0.5 + 0.5) * 255.0).round() as u8)));
}
