//! Makes the pictures of the figures.

use crate::picture::{self, FileFormat, ImageKind};
use crate::report::figure::Picture;
use crate::report::lab::Lab;
use crate::report::subject::Subject;
use hbao::image::{Image, Texel, metadata, png};
use hbao::settings::{KNOBS, Kind, Method};
use hbao::{Apply, Error, Settings};

/// Renders one picture of an image.
pub(in crate::report) fn picture(
    lab: &Lab,
    subject: &Subject,
    size: (u32, u32),
    settings: &Settings,
    show: &ImageKind,
    file: &str,
    caption: &str,
) -> Result<Picture, Error> {
    let (pipeline, _) = lab.render(subject, size, settings, picture::request([show], Apply::All))?;
    let file = format!("{file}.png");
    let text = settings.to_toml();
    let name = show.name.unwrap_or_default();
    Ok(Picture {
        caption: caption.into(),
        png: show.encode(&pipeline, settings, FileFormat::Png, &metadata(&text))?,
        size: (size.0 as usize, size.1 as usize),
        enlarged: 1,
        command: subject.arguments.as_ref().map(|arguments| {
            let size = format!("--size {}x{}", size.0, size.1);
            format!("hbao render {arguments} {size} --show {name}{} -o {file}", flags(subject, settings))
        }),
        file,
    })
}

/// Returns the flags for all settings that differ from the command's defaults for this scene.
fn flags(subject: &Subject, settings: &Settings) -> String {
    let default = subject.settings(settings.method);
    let mut flags = String::new();
    for knob in KNOBS {
        let text = knob.text(settings);
        let given = match knob.name {
            "method" => settings.method != Method::default(),
            _ => text != knob.text(&default),
        };
        if given && knob.kind == Kind::Switch {
            flags += &format!(" --{}", knob.name);
        } else if given {
            flags += &format!(" --{} {text}", knob.name);
        }
    }
    flags
}

/// Makes a picture of a part of an image, in which each pixel is shown `enlarged` times as large.
pub(in crate::report) fn detail<T: Texel<Component = u8>>(
    image: &Image<T>,
    (left, bottom): (usize, usize),
    (width, height): (usize, usize),
    enlarged: usize,
    file: &str,
    caption: &str,
) -> Result<Picture, Error> {
    let (width, height) = (width.min(image.width), height.min(image.height));
    let (left, bottom) = (left.min(image.width - width), bottom.min(image.height - height));
    let part = Image::from_fn(width, height, |x, y| image.at(left + x, bottom + y));
    Ok(Picture {
        file: format!("{file}.png"),
        caption: caption.into(),
        png: png::encode(&part, &metadata(""))?,
        size: (width, height),
        enlarged,
        command: None,
    })
}

/// Converts visibility to grey.
pub(in crate::report) fn grey(image: &Image<f32>) -> Image<u8> {
    image.map(|a| (255.0 * a).round() as u8)
}
