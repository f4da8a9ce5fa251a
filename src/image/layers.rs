//! Pictures of many layers, as renderers write them: the names of all channels, and the samples of those that are
//! wanted. The others are decompressed, but not kept.

use super::Image;
use super::channels::{Channels, check_pixels};
use super::exr::{self, Chunks};
use super::file::{damaged, first_bytes};
use super::png;
use crate::Error;
use ::exr::block::UncompressedBlock;
use ::exr::block::lines::LineRef;
use ::exr::block::reader::ChunksReader as _;
use ::exr::meta::attribute::ChannelDescription;
use ::exr::meta::header::Header;
use ::exr::prelude::{SampleType, Vec2, f16};
use std::path::{Path, PathBuf};

/// A PNG or EXR file whose channels are known and not yet read. An EXR file may have one or several parts, with
/// scanlines or tiles, and any compression but those of deep images. A picture is as large as its display window.
pub struct Layers {
    path: PathBuf,
    width: usize,
    height: usize,
    aspect: f32,
    channels: Vec<Found>,
    source: Source,
}

/// A channel of a file.
struct Found {
    name: String,
    /// The indices of the part and of the channel in it.
    place: (usize, usize),
    half: bool,
}

enum Source {
    Exr(Box<Chunks>),
    /// A PNG file has few channels and is read at once.
    Png(Channels),
}

impl Layers {
    /// Opens a file and reads which channels it has. What the file is follows from its first bytes.
    ///
    /// # Errors
    /// [`Error::Input`] if the file cannot be read, is damaged, is neither a PNG nor an EXR file, has too many pixels,
    /// or is deep.
    pub fn open(path: &Path) -> Result<Layers, Error> {
        match &first_bytes(path)? {
            b"\x89PNG" => Ok(Layers::of_png(path, png::read_channels(path)?)),
            b"\x76\x2f\x31\x01" => Layers::of_exr(path, exr::chunks(path)?),
            _ => Err(Error::input(path, "it is neither a PNG nor an EXR file: convert it to one of these")),
        }
    }

    fn of_png(path: &Path, picture: Channels) -> Layers {
        let found = |(i, name): (usize, &String)| Found { name: name.clone(), place: (0, i), half: false };
        let names: Vec<String> = picture.channels.iter().map(|channel| channel.name.clone()).collect();
        Layers {
            path: path.into(),
            width: picture.width,
            height: picture.height,
            aspect: 1.0,
            channels: names.iter().enumerate().map(found).collect(),
            source: Source::Png(picture),
        }
    }

    fn of_exr(path: &Path, chunks: Chunks) -> Result<Layers, Error> {
        let headers = chunks.headers();
        let shared = &headers[0].shared_attributes;
        let Vec2(width, height) = shared.display_window.size;
        if width == 0 || height == 0 {
            return Err(Error::input(path, "its display window has no pixels"));
        }
        check_pixels(path, width, height)?;
        let flat = || headers.iter().enumerate().filter(|(_, header)| !header.deep);
        if flat().next().is_none() {
            return Err(Error::input(path, "it is a deep image: flatten it, to one sample per pixel"));
        }
        let channels = flat().flat_map(|(part, header)| {
            let named = header.channels.list.iter().enumerate();
            named.map(move |(i, channel)| Found {
                name: full_name(header, channel, headers.len() > 1),
                place: (part, i),
                half: channel.sample_type == SampleType::F16,
            })
        });
        let (channels, aspect) = (channels.collect(), shared.pixel_aspect);
        Ok(Layers { path: path.into(), width, height, aspect, channels, source: Source::Exr(Box::new(chunks)) })
    }

    /// Returns whether the file is a PNG, whose samples are from 0 to 1.
    #[must_use]
    pub fn is_png(&self) -> bool {
        matches!(self.source, Source::Png(_))
    }

    /// Returns the width and height of the picture in pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Returns how many times as wide as high a pixel is, as the file has it.
    #[must_use]
    pub fn pixel_aspect(&self) -> f32 {
        self.aspect
    }

    /// Returns the names of all channels, in the order of the file. In a file with several parts the name of the part
    /// stands before it, as in `depth.Z`, unless the channel's name begins with that of the part. The channels of a PNG
    /// file are called `Y`, or `R`, `G` and `B`, and `A`.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.channels.iter().map(|channel| channel.name.as_str())
    }

    /// Returns whether the channel of this index in [`Layers::names`] holds half floats.
    #[must_use]
    pub fn is_half(&self, channel: usize) -> bool {
        self.channels[channel].half
    }

    /// Reads the channels of these indices in [`Layers::names`], at the largest level of resolution. Pixels outside of
    /// the part's data window are `outside`, and those of it that the file leaves out are NaN. Whole numbers above 2^24
    /// are rounded to float32.
    ///
    /// # Errors
    /// [`Error::Input`] if the file is damaged, or if a channel does not have one sample per pixel.
    pub fn read(self, wanted: &[usize], outside: f32) -> Result<Vec<Image<f32>>, Error> {
        let places: Vec<_> = wanted.iter().map(|&i| self.channels[i].place).collect();
        let (width, height) = (self.width, self.height);
        match self.source {
            Source::Png(picture) => Ok(places
                .iter()
                .map(|&(_, i)| {
                    let samples = &picture.channels[i].samples;
                    Image::from_fn(width, height, |x, y| samples.at((height - 1 - y) * width + x) as f32)
                })
                .collect()),
            Source::Exr(chunks) => {
                let picture = Image::filled(width, height, outside);
                read_exr(&self.path, *chunks, places.into_iter().map(|place| (place, picture.clone())).collect())
            }
        }
    }
}

/// Returns the name of a channel with that of its part, if the file has several parts.
fn full_name(header: &Header, channel: &ChannelDescription, several: bool) -> String {
    let name = channel.name.to_string();
    match &header.own_attributes.layer_name {
        Some(part) if several && !name.starts_with(&format!("{part}.")) => format!("{part}.{name}"),
        _ => name,
    }
}

/// Fills the images with the samples of the channels at these places.
fn read_exr(
    path: &Path,
    chunks: Chunks,
    mut images: Vec<((usize, usize), Image<f32>)>,
) -> Result<Vec<Image<f32>>, Error> {
    for ((part, channel), image) in &mut images {
        let header = &chunks.headers()[*part];
        // The blocks of a part with fewer samples of some channels have another layout.
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            let name = Error::shown(&full_name(header, &header.channels.list[*channel], false));
            let what = format!("the part with the channel {name} does not have one sample per pixel and channel");
            return Err(Error::input(path, what));
        }
        let Vec2(width, height) = header.layer_size;
        let (left, top) = offset(header);
        let columns = left..left + width as i64;
        let rows = top..top + height as i64;
        for y in (0..image.height as i64).filter(|y| rows.contains(y)) {
            (0..image.width as i64).filter(|x| columns.contains(x)).for_each(|x| put(image, x, y, f32::NAN));
        }
    }
    let parts: Vec<usize> = images.iter().map(|((part, _), _)| *part).collect();
    let largest = Vec2(0, 0);
    let chunks = chunks
        .filter_chunks(false, |_, tile, block| parts.contains(&block.layer) && tile.level_index == largest)
        .map_err(|e| damaged(path, &e))?;
    let headers = chunks.meta_data().headers.clone();
    // A part's blocks are decompressed one after the other, so that only one of them is in memory.
    for block in chunks.sequential_decompressor(false) {
        let block: UncompressedBlock = block.map_err(|e| damaged(path, &e))?;
        // A damaged file may have any block at a block's place.
        let Some(header) = headers.get(block.index.layer).filter(|_| block.index.level == largest) else { continue };
        let (left, top) = offset(header);
        for line in block.lines(&header.channels) {
            let place = (line.location.layer, line.location.channel);
            for (_, image) in images.iter_mut().filter(|(wanted, _)| *wanted == place) {
                let kind = header.channels.list[place.1].sample_type;
                let samples = floats(&line, kind).map_err(|e| damaged(path, &e))?;
                let Vec2(x, y) = line.location.position;
                for (i, sample) in samples.into_iter().enumerate() {
                    put(image, left + (x + i) as i64, top + y as i64, sample);
                }
            }
        }
    }
    Ok(images.into_iter().map(|(_, image)| image).collect())
}

/// Returns where a part's data window begins in the display window, from its upper left corner.
fn offset(header: &Header) -> (i64, i64) {
    let (data, display) = (header.own_attributes.layer_position, header.shared_attributes.display_window.position);
    (i64::from(data.0) - i64::from(display.0), i64::from(data.1) - i64::from(display.1))
}

/// Sets the pixel at column x of row y, from the top, if the image has it.
fn put(image: &mut Image<f32>, x: i64, y: i64, sample: f32) {
    let inside = |at: i64, size: usize| usize::try_from(at).ok().filter(|&at| at < size);
    if let (Some(x), Some(y)) = (inside(x, image.width), inside(y, image.height)) {
        image.texels[(image.height - 1 - y) * image.width + x] = sample;
    }
}

/// Returns the samples of a row.
fn floats(line: &LineRef, kind: SampleType) -> Result<Vec<f32>, ::exr::error::Error> {
    match kind {
        SampleType::F16 => line.read_samples::<f16>().map(|sample| Ok(sample?.to_f32())).collect(),
        SampleType::F32 => line.read_samples::<f32>().collect(),
        SampleType::U32 => line.read_samples::<u32>().map(|sample| Ok(sample? as f32)).collect(),
    }
}
