//! The built-in scene looks as it did when somebody last looked: `tests/passes/golden/*.png`.
//!
//! `HBAO_BLESS=1 cargo test --test passes golden` makes the images anew. Look at them before they are committed.

use crate::rig;
use crate::rig::{Frame, Limits, hold, scenes};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::{Image, Texel, png};
use hbao::settings::Radius;
use std::path::Path;

const SIZE: (u32, u32) = (160, 120);

/// Another processor or LLVM may round a colour or A by one step of 8 bits, the blur may carry two into a pixel, and a
/// normal in RGBA8_SNORM is renormalised before it is shown. Where float32 decides otherwise, rare pixels differ by
/// more: an ambiguous one darkens what the blur spreads it over.
const LIMITS: Limits = Limits { tolerance: 2.0, share: 0.005 };

/// With one sample: where several lie is the driver's choice.
fn frame() -> Frame {
    let shot = scenes::cornell_box();
    let settings = Settings { radius: Radius::Units(shot.radius), msaa: 1, ..Settings::default() };
    rig::render(Context::open(Backend::Auto).unwrap().gl(), &shot, SIZE, &settings)
}

/// Holds an image to the file of that name, channel by channel, or makes the file.
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
