//! What a pipeline rendered, as the bytes of an image file.

use hbao::image::{Image, exr, png};
use hbao::{Error, Pipeline};
use std::path::Path;

/// What `--show` names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Show {
    Final,
    Ao,
    AoRaw,
    Color,
    Depth,
    Normals,
    Edges,
}

impl Show {
    pub(crate) const NAMES: [(&'static str, Show); 7] = [
        ("final", Show::Final),
        ("ao", Show::Ao),
        ("ao-raw", Show::AoRaw),
        ("color", Show::Color),
        ("depth", Show::Depth),
        ("normals", Show::Normals),
        ("edges", Show::Edges),
    ];
}

/// An image file's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileFormat {
    Png,
    Exr,
}

impl FileFormat {
    /// By the name's extension.
    pub(crate) fn of(path: &Path) -> Result<FileFormat, Error> {
        match path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).as_deref() {
            Some("png") => Ok(FileFormat::Png),
            Some("exr") => Ok(FileFormat::Exr),
            _ => Err(Error::Usage(format!("--output {}: its name must end in .png or .exr", path.display()))),
        }
    }
}

/// Pairs of keyword and text that go into the file.
type Text<'a> = &'a [(&'static str, &'a str)];

/// The bytes of a file that shows `show`.
pub(crate) fn encode(pipeline: &Pipeline, show: Show, format: FileFormat, text: Text) -> Result<Vec<u8>, Error> {
    match show {
        Show::Final => rgb(&pipeline.composite()?.ok_or_else(|| not_kept("the final image"))?, format, text),
        Show::Color => rgb(&pipeline.colour()?, format, text),
        Show::Ao => visibility(&pipeline.ao()?, format, text),
        Show::AoRaw => {
            visibility(pipeline.ao_raw().ok_or_else(|| not_kept("ambient occlusion before the blur"))?, format, text)
        }
        Show::Depth => {
            let depth = pipeline.depth()?;
            match format {
                FileFormat::Png => png::encode(&grey_depth(&depth), text),
                FileFormat::Exr => exr::encode(&depth, text),
            }
        }
        Show::Normals => {
            let normals = pipeline.normals()?;
            match format {
                FileFormat::Png => png::encode(&normals.map(normal_colour), text),
                FileFormat::Exr => exr::encode(&normals, text),
            }
        }
        Show::Edges => {
            let edges = pipeline.edges().ok_or_else(|| not_kept("which pixels are edges"))?;
            let edges = edges.map(|edge| if edge { 255 } else { 0 });
            match format {
                FileFormat::Png => png::encode(&edges, text),
                FileFormat::Exr => exr::encode(&edges.map(unit), text),
            }
        }
    }
}

fn not_kept(what: &str) -> Error {
    Error::Usage(format!("{what} was not asked for"))
}

fn unit(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

fn byte(unit: f32) -> u8 {
    (255.0 * unit).round() as u8
}

fn rgb(image: &Image<[u8; 3]>, format: FileFormat, text: Text) -> Result<Vec<u8>, Error> {
    match format {
        FileFormat::Png => png::encode(image, text),
        FileFormat::Exr => exr::encode(&image.map(|colour| colour.map(unit)), text),
    }
}

pub(crate) fn visibility(image: &Image<f32>, format: FileFormat, text: Text) -> Result<Vec<u8>, Error> {
    match format {
        FileFormat::Png => png::encode(&image.map(byte), text),
        FileFormat::Exr => exr::encode(image, text),
    }
}

/// 0 is the nearest surface in view, 254 the farthest, 255 background.
fn grey_depth(depth: &Image<f32>) -> Image<u8> {
    let surfaces = depth.texels.iter().map(|&z| f64::from(z)).filter(|z| z.is_finite());
    let (near, far) = surfaces.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
    let span = if far > near { far - near } else { 1.0 };
    depth.map(|z| if z.is_finite() { (254.0 * (f64::from(z) - near) / span).round() as u8 } else { 255 })
}

/// n/2 + 1/2 as a colour; background, which has no normal, is black.
fn normal_colour(normal: [f32; 3]) -> [u8; 3] {
    if normal == [0.0; 3] { [0; 3] } else { normal.map(|x| byte(0.5 * x + 0.5)) }
}
