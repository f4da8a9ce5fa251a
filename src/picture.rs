//! The images that can be written of a rendering, with one row of facts each: `--show`, `--dump`, their help texts and
//! the notices on flags without effect all ask these rows.

use hbao::image::{Image, exr, png};
use hbao::settings::{MethodBlur, Settings};
use hbao::{Apply, Error, Pipeline, Request, rotation_tile};
use std::path::Path;

/// An image that can be written.
pub(crate) struct ImageKind {
    /// Its name for `--show`; none for an image that only `--dump` writes.
    pub(crate) name: Option<&'static str>,
    /// The name of its file in the folder of `--dump`; none for an image that is not dumped.
    pub(crate) dumped: Option<&'static str>,
    /// What its pixels hold, as `--help` says it.
    pub(crate) help: &'static str,
    /// Adds what the image needs of the pipeline to a request. `Apply` is the light that ambient occlusion darkens.
    needs: fn(Request, Apply) -> Request,
    /// True for an image that is made before the blur, so that it needs no blur.
    unblurred: bool,
    /// Whether the setting of this name can change the image, as the other settings are.
    decided_by: fn(&str, &Settings) -> bool,
    /// Reads the image back.
    read: fn(&Pipeline, &Settings) -> Result<Pixels, Error>,
}

/// Declares the rows, and the list of all of them.
macro_rules! images {
    ($($(#[$doc:meta])* $image:ident { $($fact:tt)* })+) => {
        $($(#[$doc])* pub(crate) static $image: ImageKind = ImageKind { $($fact)* };)+

        /// Every image, in the order in which `--show` lists them.
        pub(crate) static ALL: &[&ImageKind] = &[$(&$image),+];
    };
}

const VISIBILITY: &str = "visibility after and before the blur, 1 is open: grey, or Y in an EXR";
const COLOURS: &str = "RGB; in an EXR the 8-bit values over 255";

images! {
    /// The shaded colour, darkened by ambient occlusion.
    FINAL {
        name: Some("final"),
        dumped: None,
        help: COLOURS,
        needs: |request, apply| Request { gbuffer_only: false, composite: Some(apply), ..request },
        unblurred: false,
        decided_by: |knob, settings| settings.idle(knob).is_none(),
        read: |pipeline, _| Ok(Pixels::Colours(pipeline.composite()?.ok_or_else(|| not_kept("the final image"))?)),
    }
    /// Ambient occlusion after the blur.
    AO {
        name: Some("ao"),
        dumped: Some("ao.exr"),
        help: VISIBILITY,
        needs: |request, _| Request { gbuffer_only: false, ..request },
        unblurred: false,
        decided_by: |knob, settings| settings.idle(knob).is_none(),
        read: |pipeline, _| Ok(Pixels::Visibility(pipeline.ao()?)),
    }
    /// Ambient occlusion before the blur.
    AO_RAW {
        name: Some("ao-raw"),
        dumped: Some("ao_raw.exr"),
        help: VISIBILITY,
        needs: |request, _| Request { gbuffer_only: false, raw: true, ..request },
        unblurred: true,
        decided_by: |knob, settings| {
            let of_the_blur = settings.blur > 0 && (knob.starts_with("blur") || knob == "edges");
            settings.idle(knob).is_none() && !of_the_blur
        },
        read: |pipeline, _| {
            let raw = pipeline.ao_raw().ok_or_else(|| not_kept("ambient occlusion before the blur"))?;
            Ok(Pixels::Visibility(raw.clone()))
        },
    }
    /// The shaded colour without ambient occlusion.
    COLOR {
        name: Some("color"),
        dumped: Some("color.png"),
        help: COLOURS,
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "normals"),
        read: |pipeline, _| Ok(Pixels::Colours(pipeline.colour()?)),
    }
    /// Eye-space depth.
    DEPTH {
        name: Some("depth"),
        dumped: Some("depth.exr"),
        help: "eye-space z: grey from 0, the nearest surface in view, to 254, the farthest, and 255 background;\n\
               in an EXR Y in scene units, +infinity for background",
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "depth-format"),
        read: |pipeline, _| Ok(Pixels::Depth(pipeline.depth()?)),
    }
    /// Eye-space normals.
    NORMALS {
        name: Some("normals"),
        dumped: Some("normals.exr"),
        help: "in eye space, x right, y up, z forward: (n + 1)/2 as RGB, background black; in an EXR R, G, B are\n\
               x, y, z, and 0, 0, 0 background",
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "normals" | "normal-format"),
        read: |pipeline, _| Ok(Pixels::Vectors(pipeline.normals()?)),
    }
    /// The pixels that hold several surfaces.
    EDGES {
        name: Some("edges"),
        dumped: Some("edges.png"),
        help: "255 (in an EXR 1) on pixels of several surfaces, 0 elsewhere: 0 everywhere without MSAA",
        needs: |request, _| Request { edges: true, ..request },
        unblurred: false,
        // Pixels are edges where their depths differ by more than the blur's depth sigma. What that sigma follows from
        // decides it, even where the method has no blur.
        decided_by: |knob, settings| {
            let of_depth = settings.method.facts().blur == MethodBlur::Crysis;
            match knob {
                "msaa" | "depth-format" | "method" | "blur-depth-sigma" => true,
                "radius" => settings.blur_depth_sigma.is_none() && !of_depth,
                "ssao-samples" => settings.blur_depth_sigma.is_none() && of_depth,
                _ => false,
            }
        },
        read: |pipeline, _| Ok(Pixels::Mask(pipeline.edges().ok_or_else(|| not_kept("which pixels are edges"))?.clone())),
    }
    /// The 4x4 tile of rotations.
    ROTATION {
        name: None,
        dumped: Some("rotation.exr"),
        help: "",
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, settings| {
            settings.idle(knob).is_none() && matches!(knob, "method" | "directions" | "jitter")
        },
        read: |_, settings| Ok(Pixels::Vectors(rotation_tile(settings))),
    }
}

fn not_kept(what: &str) -> Error {
    Error::Usage(format!("{what} was not asked for"))
}

/// The request for a pipeline that makes these images.
pub(crate) fn request<'a>(images: impl IntoIterator<Item = &'a ImageKind>, apply: Apply) -> Request {
    let gbuffer = Request { gbuffer_only: true, ..Request::default() };
    images.into_iter().fold(gbuffer, |request, image| (image.needs)(request, apply))
}

/// The images that `--show` can name, with their names.
pub(crate) fn names() -> impl Iterator<Item = (&'static str, &'static ImageKind)> {
    ALL.iter().filter_map(|image| Some((image.name?, *image)))
}

/// The images that `--dump` writes, and the names of their files.
pub(crate) fn dumped() -> impl Iterator<Item = (&'static str, &'static ImageKind)> {
    ALL.iter().filter_map(|image| Some((image.dumped?, *image)))
}

impl ImageKind {
    /// Whether the setting of this name can change the image, as the other settings are.
    pub(crate) fn is_decided_by(&self, knob: &str, settings: &Settings) -> bool {
        (self.decided_by)(knob, settings)
    }

    /// True for an image that is made before the blur, so that it needs no blur.
    pub(crate) fn is_unblurred(&self) -> bool {
        self.unblurred
    }

    /// The bytes of a file that holds the image.
    pub(crate) fn encode(
        &self,
        pipeline: &Pipeline,
        settings: &Settings,
        format: FileFormat,
        text: Text,
    ) -> Result<Vec<u8>, Error> {
        (self.read)(pipeline, settings)?.encode(format, text)
    }
}

/// The format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileFormat {
    Png,
    Exr,
}

impl FileFormat {
    /// The format that the extension of the file's name says.
    pub(crate) fn of(path: &Path) -> Result<FileFormat, Error> {
        match path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).as_deref() {
            Some("png") => Ok(FileFormat::Png),
            Some("exr") => Ok(FileFormat::Exr),
            _ => Err(Error::Usage(format!("--output {}: its name must end in .png or .exr", path.display()))),
        }
    }
}

/// Pairs of keyword and text that are stored in the file.
type Text<'a> = &'a [(&'static str, &'a str)];

/// An image that was read back. The kind of its pixels says how each file format holds them.
pub(crate) enum Pixels {
    /// 8-bit colours; in EXR over 255.
    Colours(Image<[u8; 3]>),
    /// Visibility; in PNG as grey.
    Visibility(Image<f32>),
    /// Eye-space z; in PNG as grey from the nearest surface to the farthest.
    Depth(Image<f32>),
    /// Unit vectors; in PNG as colours.
    Vectors(Image<[f32; 3]>),
    /// True or false; in PNG 255 or 0, in EXR 1 or 0.
    Mask(Image<bool>),
}

impl Pixels {
    /// The bytes of a file that holds the image.
    pub(crate) fn encode(&self, format: FileFormat, text: Text) -> Result<Vec<u8>, Error> {
        match (self, format) {
            (Pixels::Colours(image), FileFormat::Png) => png::encode(image, text),
            (Pixels::Colours(image), FileFormat::Exr) => exr::encode(&image.map(|colour| colour.map(unit)), text),
            (Pixels::Visibility(image), FileFormat::Png) => png::encode(&image.map(byte), text),
            (Pixels::Visibility(image) | Pixels::Depth(image), FileFormat::Exr) => exr::encode(image, text),
            (Pixels::Depth(image), FileFormat::Png) => png::encode(&grey_depth(image), text),
            (Pixels::Vectors(image), FileFormat::Png) => png::encode(&image.map(vector_colour), text),
            (Pixels::Vectors(image), FileFormat::Exr) => exr::encode(image, text),
            (Pixels::Mask(image), FileFormat::Png) => png::encode(&image.map(|set| if set { 255 } else { 0 }), text),
            (Pixels::Mask(image), FileFormat::Exr) => exr::encode(&image.map(|set| if set { 1.0 } else { 0.0 }), text),
        }
    }
}

fn unit(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

fn byte(unit: f32) -> u8 {
    (255.0 * unit).round() as u8
}

/// Depth as grey: 0 is the nearest surface in view, 254 the farthest, 255 background.
fn grey_depth(depth: &Image<f32>) -> Image<u8> {
    let surfaces = depth.texels.iter().map(|&z| f64::from(z)).filter(|z| z.is_finite());
    let (near, far) = surfaces.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
    let span = if far > near { far - near } else { 1.0 };
    depth.map(|z| if z.is_finite() { (254.0 * (f64::from(z) - near) / span).round() as u8 } else { 255 })
}

/// n/2 + 1/2 as a colour. Background, which has no normal, is black.
fn vector_colour(normal: [f32; 3]) -> [u8; 3] {
    if normal == [0.0; 3] { [0; 3] } else { normal.map(|x| byte(0.5 * x + 0.5)) }
}
