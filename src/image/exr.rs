//! OpenEXR files with text: 32-bit float, with the channel `Y` or the channels `R`, `G` and `B`.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Seek as _};
use std::path::Path;

use ::exr::meta::header::Header;
use ::exr::meta::{Headers, MetaData};
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, Text, WritableImage,
};

use super::Image;
use super::channels::{Channel, Channels, Samples};
use super::file::{MOST_TEXT, Texel, check_claim, damaged, open};
use crate::Error;

/// Encodes an image as the bytes of an EXR file. Every value is stored exactly, including infinities. `text` is stored
/// as pairs (keyword, text) in string attributes. The attributes' names are the keywords in lower case, like EXR's own
/// `software` and `comments`.
///
/// # Errors
/// [`Error::Usage`] for an image without texels.
pub fn encode<T: Texel<Component = f32>>(image: &Image<T>, text: &[(&str, &str)]) -> Result<Vec<u8>, Error> {
    let refused = |what: String| {
        Error::Usage(format!("an image of {}x{} cannot be written as EXR: {what}", image.width, image.height))
    };
    if image.is_empty() {
        return Err(refused("it has no pixels".into()));
    }
    let channel = |(i, name): (usize, &&str)| {
        let samples = image.rows_from_top().flatten().map(|texel| texel.components()[i]).collect();
        AnyChannel::new(*name, FlatSamples::F32(samples))
    };
    // EXR requires channels to be in the alphabetical order of their names.
    let channels = AnyChannels::sort(channel_names::<T>().iter().enumerate().map(channel).collect());

    let mut attributes = LayerAttributes::default();
    for &(keyword, text) in text {
        // An EXR string is a sequence of bytes without a declared encoding. Readers display it as UTF-8.
        let text = Text::from_slice_unchecked(text.as_bytes());
        match keyword.to_lowercase().as_str() {
            "software" => attributes.software_name = Some(text),
            "comments" => attributes.comments = Some(text),
            name => {
                let name = Text::from_slice_unchecked(name.as_bytes());
                attributes.other.insert(name, AttributeValue::Text(text));
            }
        }
    }
    // ZIP compression of 16 rows at a time is lossless, and every reader of EXR supports it.
    let encoding = ::exr::image::Encoding {
        compression: Compression::ZIP16,
        blocks: ::exr::image::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((image.width, image.height), attributes, encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().to_buffered(&mut bytes).map_err(|e| refused(e.to_string()))?;
    Ok(bytes.into_inner())
}

/// Reads the first layer of an EXR file. The channel `Y` is read as `f32`, and the channels `R`, `G` and `B` as
/// `[f32; 3]`. Other channels are ignored.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read, is damaged, or lacks these channels.
pub fn read<T: Texel<Component = f32>>(path: &Path) -> Result<Image<T>, Error> {
    let (layer, _) = first_layer(path)?;
    let (width, height) = (layer.size.width(), layer.size.height());
    let mut planes = Vec::new();
    for &name in channel_names::<T>() {
        let Some(channel) = layer.channel_data.list.iter().find(|channel| channel.name.eq(name)) else {
            let found: Vec<String> = layer.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
            let found = Error::shown(&found.join(", "));
            let what = format!("this must be an EXR image with the channel {name}, but the file has {found}");
            return Err(Error::input(path, what));
        };
        let plane: Vec<f32> = channel.sample_data.values_as_f32().collect();
        if plane.len() != width * height {
            return Err(Error::input(path, format!("the channel {name} does not have one value per pixel")));
        }
        planes.push(plane);
    }
    Ok(Image::from_fn(width, height, |x, y| T::from_components(|i| planes[i][(height - 1 - y) * width + x])))
}

/// Reads all channels of the first layer of an EXR file.
pub(super) fn read_channels(path: &Path) -> Result<Channels, Error> {
    let (layer, layers) = first_layer(path)?;
    let (width, height) = (layer.size.width(), layer.size.height());
    let mut channels = Vec::new();
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        if channel.sample_data.len() != width * height {
            let what = format!("the channel {} does not have one value per pixel", Error::shown(&name));
            return Err(Error::input(path, what));
        }
        channels.push(Channel { name, samples: Samples::Exr(channel.sample_data) });
    }
    Ok(Channels { width, height, channels, layers })
}

/// Reads the first layer of a file. Returns also how many layers the file has.
fn first_layer(path: &Path) -> Result<(Layer<AnyChannels<FlatSamples>>, usize), Error> {
    let chunks = chunks(path)?;
    let layers = chunks.headers().len();
    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_chunks(chunks)
        .map_err(|e| damaged(path, &e))?;
    Ok((image.layer_data, layers))
}

/// Reads the string attributes of an EXR file's first layer as pairs (name, text), in no particular order.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read, is damaged, or has a header longer than 16 MiB.
pub fn read_text(path: &Path) -> Result<Vec<(String, String)>, Error> {
    let (file, length) = open(path)?;
    let headers = headers(path, file, length)?;
    let attributes = &headers[0].own_attributes;
    let string = |text: &Text| String::from_utf8_lossy(text.bytes()).into_owned();
    let mut pairs = Vec::new();
    for (name, text) in [("software", &attributes.software_name), ("comments", &attributes.comments)] {
        pairs.extend(text.as_ref().map(|text| (name.into(), string(text))));
    }
    for (name, value) in &attributes.other {
        if let AttributeValue::Text(text) = value {
            pairs.push((string(name), string(text)));
        }
    }
    Ok(pairs)
}

/// A file of which the headers were read and checked.
pub(super) type Chunks = ::exr::block::reader::Reader<BufReader<File>>;

/// Opens a file and reads its headers. Its pixels are read later.
pub(super) fn chunks(path: &Path) -> Result<Chunks, Error> {
    let (mut file, length) = open(path)?;
    let refused = |e: &dyn std::fmt::Display| Error::input(path, e.to_string());
    headers(path, &mut file, length)?;
    file.rewind().map_err(|e| refused(&e))?;
    ::exr::block::read(file, false).map_err(|e| refused(&e))
}

/// Reads the headers of the layers, of which there must be at least one, and checks what they claim.
fn headers(path: &Path, file: impl BufRead, length: u64) -> Result<Headers, Error> {
    let mut file = file.take(MOST_TEXT as u64);
    let read = MetaData::read_from_buffered(&mut file, false);
    let headers = match read {
        Ok(meta) => meta.headers,
        Err(_) if file.limit() == 0 => return Err(Error::input(path, "its header is longer than 16 MiB")),
        Err(e) => return Err(Error::input(path, e.to_string())),
    };
    let bytes = |header: &Header| {
        header.layer_size.0 as u128 * header.layer_size.1 as u128 * header.channels.bytes_per_pixel as u128
    };
    // A file in the format for several layers may have none.
    if headers.is_empty() {
        return Err(Error::input(path, "it holds no image"));
    }
    check_claim(path, length, headers.iter().map(bytes).sum())?;
    Ok(headers)
}

/// Returns the names of the channels that store the components of a texel.
fn channel_names<T: Texel>() -> &'static [&'static str] {
    if T::COMPONENTS == 1 { &["Y"] } else { &["R", "G", "B"] }
}
