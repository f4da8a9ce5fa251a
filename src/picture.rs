//! The images of a rendering that can be written to files, with one row of facts for each. `--show`, `--dump`, their
//! help texts and the notices about flags without effect are all made from these rows.

use hbao::image::{Image, Outputs, exr, png};
use hbao::measure::Reach;
use hbao::settings::{MethodBlur, Settings};
use hbao::{Apply, Error, Pipeline, Request, rotation_tile};
use std::path::Path;

/// An image that can be written.
pub(crate) struct ImageKind {
    /// The name of the image for `--show`; `None` for an image that only `--dump` writes.
    pub(crate) name: Option<&'static str>,
    /// The name of the image's file in the folder of `--dump`; `None` for an image that `--dump` does not write.
    pub(crate) dumped: Option<&'static str>,
    /// The text of `--help` that says what the pixels of the image hold.
    pub(crate) help: &'static str,
    /// Adds to a request what the pipeline must make for this image. `Apply` is the light that ambient occlusion
    /// darkens.
    needs: fn(Request, Apply) -> Request,
    /// True for an image that is made before the blur, so that it needs no blur.
    unblurred: bool,
    /// Whether the setting of this name can change the image, given the values of the other settings.
    decided_by: fn(&str, &Settings) -> bool,
    /// Reads the image back.
    read: fn(&Pipeline, &Settings) -> Result<Pixels, Error>,
}

/// Declares a static for each row, and the list of all rows.
macro_rules! images {
    ($($(#[$doc:meta])* $image:ident { $($fact:tt)* })+) => {
        $($(#[$doc])* pub(crate) static $image: ImageKind = ImageKind { $($fact)* };)+

        /// Every image, in the order in which `--show` lists them.
        pub(crate) static ALL: &[&ImageKind] = &[$(&$image),+];
    };
}

const VISIBILITY: &str = "visibility after the blur (ao) and before it (ao-raw), 1 where nothing occludes: grey in a\n\
                          PNG, Y in an EXR";
const COLOURS: &str = "the shaded colour with ambient occlusion (final) and without it (color): RGB; an EXR holds\n\
                       the 8-bit values divided by 255";

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
        needs: |request, _| Request { colour: true, ..request },
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "normals"),
        read: |pipeline, _| Ok(Pixels::Colours(pipeline.colour()?)),
    }
    /// Eye-space depth.
    DEPTH {
        name: Some("depth"),
        dumped: Some("depth.exr"),
        help: "eye-space z. A PNG holds grey: 0 for the nearest surface in view, 254 for the farthest, 255\n\
               for the background. An EXR holds Y in scene units, and +infinity for the background",
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "depth-format"),
        read: |pipeline, _| Ok(Pixels::Depth(pipeline.depth()?)),
    }
    /// Eye-space normals.
    NORMALS {
        name: Some("normals"),
        dumped: Some("normals.exr"),
        help: "the normal n in eye space: x points right, y up, z forward. A PNG holds (n + 1)/2 as RGB, black\n\
               for the background. An EXR holds x, y, z as R, G, B, and 0, 0, 0 for the background",
        needs: |request, _| request,
        unblurred: false,
        decided_by: |knob, _| matches!(knob, "msaa" | "normals" | "normal-format"),
        read: |pipeline, _| Ok(Pixels::Vectors(pipeline.normals()?)),
    }
    /// The pixels that hold several surfaces.
    EDGES {
        name: Some("edges"),
        dumped: Some("edges.png"),
        help: "255 (in an EXR 1) at pixels that hold several surfaces, 0 at all others; without MSAA no pixel does",
        needs: |request, _| Request { edges: true, ..request },
        unblurred: false,
        // A pixel is an edge if its depth samples differ by more than the blur's depth sigma. Every setting that
        // determines this sigma can therefore change the image, even if the method has no blur.
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
    /// The texels at which the method exits early.
    EXITS {
        name: Some("exits"),
        dumped: None,
        help: "orange where the method exits early with visibility 1, because R covers too few texels there (see\n\
               --exit), and elsewhere visibility before the blur as grey, black for the background: RGB; an EXR\n\
               holds the 8-bit values divided by 255",
        needs: |request, _| Request { gbuffer_only: false, raw: true, ..request },
        unblurred: true,
        decided_by: |knob, settings| AO_RAW.is_decided_by(knob, settings),
        read: |pipeline, settings| {
            let raw = pipeline.ao_raw().ok_or_else(|| not_kept("ambient occlusion before the blur"))?;
            let projection = pipeline.projection().ok_or_else(|| not_kept("a picture"))?;
            let exits = Reach::exits_at(&pipeline.depth()?, projection, settings)?;
            let texel = |(&exits, &visibility): (&Option<bool>, &f32)| match exits {
                None => Exiting::Background,
                Some(true) => Exiting::Exits,
                Some(false) => Exiting::Visibility(visibility),
            };
            let texels = exits.texels.iter().zip(&raw.texels).map(texel).collect();
            Ok(Pixels::Exits(Image { width: exits.width, height: exits.height, texels }))
        },
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
        read: |_, settings| Ok(Pixels::Rotations(rotation_tile(settings))),
    }
}

fn not_kept(what: &str) -> Error {
    Error::Usage(format!("{what} was not asked for"))
}

/// Returns the request for a pipeline that makes these images.
pub(crate) fn request<'a>(images: impl IntoIterator<Item = &'a ImageKind>, apply: Apply) -> Request {
    let gbuffer = Request { gbuffer_only: true, ..Request::default() };
    images.into_iter().fold(gbuffer, |request, image| (image.needs)(request, apply))
}

/// Returns the images that `--show` can name, with their names.
pub(crate) fn names() -> impl Iterator<Item = (&'static str, &'static ImageKind)> {
    ALL.iter().filter_map(|image| Some((image.name?, *image)))
}

/// Returns the images that `--dump` writes, with the names of their files.
pub(crate) fn dumped() -> impl Iterator<Item = (&'static str, &'static ImageKind)> {
    ALL.iter().filter_map(|image| Some((image.dumped?, *image)))
}

impl ImageKind {
    /// Whether the setting of this name can change the image, given the values of the other settings.
    pub(crate) fn is_decided_by(&self, knob: &str, settings: &Settings) -> bool {
        (self.decided_by)(knob, settings)
    }

    /// True for an image that is made before the blur, so that it needs no blur.
    pub(crate) fn is_unblurred(&self) -> bool {
        self.unblurred
    }

    /// Reads the image back.
    pub(crate) fn pixels(&self, pipeline: &Pipeline, settings: &Settings) -> Result<Pixels, Error> {
        (self.read)(pipeline, settings)
    }

    /// Encodes the image as the bytes of a file.
    pub(crate) fn encode(
        &self,
        pipeline: &Pipeline,
        settings: &Settings,
        format: FileFormat,
        text: Text,
    ) -> Result<Vec<u8>, Error> {
        (self.read)(pipeline, settings)?.encode(format, text)
    }

    /// Encodes a part of the image as the bytes of a file.
    pub(crate) fn encode_part(
        &self,
        pipeline: &Pipeline,
        settings: &Settings,
        format: FileFormat,
        text: Text,
        kept: &Kept,
    ) -> Result<Vec<u8>, Error> {
        (self.read)(pipeline, settings)?.part(kept).encode(format, text)
    }
}

/// The part of a rendering that is written, in pixels, y up.
pub(crate) struct Kept {
    /// Width and height of the rendering.
    pub(crate) rendered: (u32, u32),
    /// The lower left pixel of the part.
    pub(crate) corner: (u32, u32),
    /// Width and height of the part.
    pub(crate) size: (u32, u32),
}

impl Kept {
    /// Returns the part as its left and bottom pixel, its width and its height.
    pub(crate) fn part(&self) -> [u32; 4] {
        [self.corner.0, self.corner.1, self.size.0, self.size.1]
    }

    /// Cuts the part out of an image of the rendering. If the image has half resolution, the part consists of those
    /// texels that stand for its pixels: the texel i for the pixel 2i. If there is none, it is the one texel that holds
    /// the part's pixels.
    pub(crate) fn of<T: Copy>(&self, image: &Image<T>) -> Image<T> {
        let along = |rendered: u32, texels: usize, first: u32, count: u32| {
            let (first, end) = (first as usize, (first + count) as usize);
            match rendered as usize == texels {
                true => [first, count as usize],
                false if first.div_ceil(2) == end.div_ceil(2) => [first / 2, 1],
                false => [first.div_ceil(2), end.div_ceil(2) - first.div_ceil(2)],
            }
        };
        let [x, width] = along(self.rendered.0, image.width, self.corner.0, self.size.0);
        let [y, height] = along(self.rendered.1, image.height, self.corner.1, self.size.1);
        image.part((x, y), (width, height))
    }
}

/// The format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileFormat {
    Png,
    Exr,
}

impl FileFormat {
    /// Returns the format that belongs to the extension of the file's name. A path with another name, or with
    /// none, is PNG if it leads to standard output, a pipe or a device.
    pub(crate) fn of(path: &Path) -> Result<FileFormat, Error> {
        match path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).as_deref() {
            Some("png") => Ok(FileFormat::Png),
            Some("exr") => Ok(FileFormat::Exr),
            _ if Outputs::is_stream(path) => Ok(FileFormat::Png),
            _ => Err(Error::Usage(format!(
                "--output {}: its name must end in .png or .exr, or be - for a PNG on standard output",
                path.display()
            ))),
        }
    }
}

/// Pairs of keyword and text that are stored in the file.
type Text<'a> = &'a [(&'static str, &'a str)];

/// An image that was read back. Each variant is stored differently in a file.
pub(crate) enum Pixels {
    /// 8-bit colours. An EXR holds them divided by 255.
    Colours(Image<[u8; 3]>),
    /// Visibility. A PNG holds it as grey.
    Visibility(Image<f32>),
    /// Eye-space z. A PNG holds it as grey, from the nearest surface to the farthest.
    Depth(Image<f32>),
    /// Unit vectors. A PNG holds them as colours.
    Vectors(Image<[f32; 3]>),
    /// The rotation tile, which is the same for every part of a picture. It is stored like vectors.
    Rotations(Image<[f32; 3]>),
    /// True or false. A PNG holds 255 or 0, an EXR 1 or 0.
    Mask(Image<bool>),
    /// Where the method exits early. It is stored like colours.
    Exits(Image<Exiting>),
}

/// A texel of the image that shows where a method exits early.
#[derive(Clone, Copy)]
pub(crate) enum Exiting {
    Background,
    /// The method exits early: visibility is 1.
    Exits,
    /// The method does not: this is visibility before the blur.
    Visibility(f32),
}

impl Exiting {
    fn colour(self) -> [u8; 3] {
        match self {
            Exiting::Background => [0; 3],
            Exiting::Exits => [255, 140, 0],
            Exiting::Visibility(a) => [byte(a); 3],
        }
    }
}

impl Pixels {
    /// Returns the part of the image that is kept.
    pub(crate) fn part(&self, kept: &Kept) -> Pixels {
        match self {
            Pixels::Colours(image) => Pixels::Colours(kept.of(image)),
            Pixels::Visibility(image) => Pixels::Visibility(kept.of(image)),
            Pixels::Depth(image) => Pixels::Depth(kept.of(image)),
            Pixels::Vectors(image) => Pixels::Vectors(kept.of(image)),
            Pixels::Mask(image) => Pixels::Mask(kept.of(image)),
            Pixels::Exits(image) => Pixels::Exits(kept.of(image)),
            Pixels::Rotations(image) => Pixels::Rotations(image.clone()),
        }
    }

    /// Encodes the image as the bytes of a file.
    pub(crate) fn encode(&self, format: FileFormat, text: Text) -> Result<Vec<u8>, Error> {
        if format == FileFormat::Png {
            return match self.eight_bit() {
                EightBit::Grey(image) => png::encode(&image, text),
                EightBit::Colours(image) => png::encode(&image, text),
            };
        }
        match self {
            Pixels::Colours(image) => exr::encode(&image.map(|colour| colour.map(unit)), text),
            Pixels::Visibility(image) | Pixels::Depth(image) => exr::encode(image, text),
            Pixels::Vectors(image) | Pixels::Rotations(image) => exr::encode(image, text),
            Pixels::Mask(image) => exr::encode(&image.map(|set| if set { 1.0 } else { 0.0 }), text),
            Pixels::Exits(image) => Pixels::Colours(image.map(Exiting::colour)).encode(format, text),
        }
    }

    /// Returns the number of texels of a row.
    pub(crate) fn width(&self) -> usize {
        match self {
            Pixels::Colours(image) => image.width,
            Pixels::Visibility(image) | Pixels::Depth(image) => image.width,
            Pixels::Vectors(image) | Pixels::Rotations(image) => image.width,
            Pixels::Mask(image) => image.width,
            Pixels::Exits(image) => image.width,
        }
    }

    /// Returns what a PNG of the image holds.
    pub(crate) fn eight_bit(&self) -> EightBit {
        match self {
            Pixels::Colours(image) => EightBit::Colours(image.clone()),
            Pixels::Visibility(image) => EightBit::Grey(image.map(byte)),
            Pixels::Depth(image) => EightBit::Grey(grey_depth(image)),
            Pixels::Vectors(image) | Pixels::Rotations(image) => EightBit::Colours(image.map(vector_colour)),
            Pixels::Mask(image) => EightBit::Grey(image.map(|set| if set { 255 } else { 0 })),
            Pixels::Exits(image) => EightBit::Colours(image.map(Exiting::colour)),
        }
    }
}

/// An image as a PNG holds it.
pub(crate) enum EightBit {
    Grey(Image<u8>),
    Colours(Image<[u8; 3]>),
}

#[cfg(feature = "view")]
impl Pixels {
    /// Returns the colours that a PNG of the image shows.
    pub(crate) fn shown(&self) -> Image<[u8; 3]> {
        match self.eight_bit() {
            EightBit::Grey(image) => image.map(|grey| [grey; 3]),
            EightBit::Colours(image) => image,
        }
    }

    /// Returns the numbers of the texel with this index in words.
    pub(crate) fn in_words(&self, texel: usize) -> Option<String> {
        Some(match self {
            Pixels::Colours(image) => {
                let [r, g, b] = image.texels.get(texel)?;
                format!("{r}, {g}, {b}")
            }
            Pixels::Visibility(image) => format!("{:.4}", image.texels.get(texel)?),
            Pixels::Depth(image) => match image.texels.get(texel)? {
                z if z.is_finite() => format!("z = {z}"),
                _ => "background".into(),
            },
            Pixels::Vectors(image) | Pixels::Rotations(image) => match image.texels.get(texel)? {
                [0.0, 0.0, 0.0] => "background".into(),
                [x, y, z] => format!("{x:.3}, {y:.3}, {z:.3}"),
            },
            Pixels::Mask(image) => if *image.texels.get(texel)? { "an edge" } else { "no edge" }.into(),
            Pixels::Exits(image) => match image.texels.get(texel)? {
                Exiting::Background => "background".into(),
                Exiting::Exits => "exits early".into(),
                Exiting::Visibility(a) => format!("{a:.4}"),
            },
        })
    }

    /// Returns at how many texels the method exits early, and how many hold a surface; `None` for other images.
    pub(crate) fn exits(&self) -> Option<[usize; 2]> {
        let Pixels::Exits(image) = self else { return None };
        let count = |is: fn(&Exiting) -> bool| image.texels.iter().filter(|texel| is(texel)).count();
        Some([count(|texel| matches!(texel, Exiting::Exits)), count(|texel| !matches!(texel, Exiting::Background))])
    }
}

/// What is said of a method without an early exit.
pub(crate) const NEVER_EXITS: &str = "never exits early";

fn unit(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

/// Converts a number from 0 to 1 to 8 bits. Others are clamped.
pub(crate) fn byte(unit: f32) -> u8 {
    (255.0 * unit).round() as u8
}

/// Converts depth to grey: 0 for the nearest surface in view, 254 for the farthest, 255 for the background.
fn grey_depth(depth: &Image<f32>) -> Image<u8> {
    let surfaces = depth.texels.iter().map(|&z| f64::from(z)).filter(|z| z.is_finite());
    let (near, far) = surfaces.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
    let span = if far > near { far - near } else { 1.0 };
    depth.map(|z| if z.is_finite() { (254.0 * (f64::from(z) - near) / span).round() as u8 } else { 255 })
}

/// Converts a normal n to the colour n/2 + 1/2. The background, which has no normal, becomes black.
fn vector_colour(normal: [f32; 3]) -> [u8; 3] {
    if normal == [0.0; 3] { [0; 3] } else { normal.map(|x| byte(0.5 * x + 0.5)) }
}
