//! PNG files with text: grey or RGB, with 8 bits per component.

use std::borrow::Cow;
use std::fmt::Display;
use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;

use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError, Reader, Transformations};

use super::Image;
use super::channels::{Channel, Channels, Samples, check_pixels};
use super::file::{MOST_TEXT, Texel, check_claim, damaged, open};
use crate::Error;

/// Encodes an image as the bytes of a PNG file. `text` is stored in it as pairs (keyword, text). A keyword has 1 to 79
/// characters of Latin-1, and the text may contain any characters.
///
/// # Errors
/// [`Error::Usage`] for an image that is empty or too large for the format, and for a keyword that is not allowed.
pub fn encode<T: Texel<Component = u8>>(image: &Image<T>, text: &[(&str, &str)]) -> Result<Vec<u8>, Error> {
    let refused = |what: String| {
        Error::Usage(format!("an image of {}x{} cannot be written as PNG: {what}", image.width, image.height))
    };
    let (Ok(width), Ok(height)) = (u32::try_from(image.width), u32::try_from(image.height)) else {
        return Err(refused("too large".into()));
    };
    if image.is_empty() {
        return Err(refused("it has no pixels".into()));
    }
    let rows: Vec<u8> = image.rows_from_top().flatten().flat_map(T::components).copied().collect();

    let write = || -> Result<Vec<u8>, EncodingError> {
        let mut bytes = Vec::new();
        let mut writer = encoder(&mut bytes, (width, height), color::<T>(), text)?.write_header()?;
        writer.write_image_data(&rows)?;
        writer.finish()?;
        Ok(bytes)
    };
    write().map_err(|e| refused(e.to_string()))
}

/// Encodes an image row by row, so that it need not fit into memory, and writes the file to `to` meanwhile. The image
/// has `size` (width, height) texels of 8-bit components: 1 for grey, 3 for RGB. `rows` writes the bytes of all rows,
/// from the top. `text` is stored as by [`encode`]. `path` names the file in errors.
///
/// # Errors
/// [`Error::Output`] for what `to` reports, for missing rows, an empty size, and a keyword that is not allowed. Also
/// what `rows` returns.
pub fn encode_rows(
    path: &Path,
    to: &mut dyn Write,
    size: (u32, u32),
    components: usize,
    text: &[(&str, &str)],
    rows: impl FnOnce(&mut dyn Write) -> Result<(), Error>,
) -> Result<(), Error> {
    let failed = |e: EncodingError| Error::output(path, e);
    let color = if components == 1 { ColorType::Grayscale } else { ColorType::Rgb };
    let mut writer = encoder(to, size, color, text).and_then(Encoder::write_header).map_err(failed)?;
    let mut stream = writer.stream_writer().map_err(failed)?;
    rows(&mut stream)?;
    stream.finish().map_err(failed)?;
    writer.finish().map_err(failed)
}

/// Prepares a file of 8-bit texels of a colour type, with text.
fn encoder<'t, W: Write>(
    to: W,
    (width, height): (u32, u32),
    color: ColorType,
    text: &[(&str, &str)],
) -> Result<Encoder<'t, W>, EncodingError> {
    let mut encoder = Encoder::new(to, width, height);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    for &(keyword, text) in text {
        // Every reader supports tEXt, but its text is Latin-1. The text of iTXt is UTF-8.
        if text.is_ascii() {
            encoder.add_text_chunk(keyword.into(), text.into())?;
        } else {
            encoder.add_itxt_chunk(keyword.into(), text.into())?;
        }
    }
    Ok(encoder)
}

/// Reads a PNG file with 8 bits per component. A grey image is read as `u8`, and an RGB image as `[u8; 3]`.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read, is damaged, or holds another kind of image.
pub fn read<T: Texel<Component = u8>>(path: &Path) -> Result<Image<T>, Error> {
    let mut reader = reader(path, |_| ())?;
    let found = (reader.info().color_type, reader.info().bit_depth);
    let wanted = (color::<T>(), BitDepth::Eight);
    if found != wanted {
        let name = |(color, depth): (ColorType, BitDepth)| format!("{color:?} of {} bits", depth as u8);
        return Err(Error::input(
            path,
            format!("this must be a PNG in {}, but it is in {}", name(wanted), name(found)),
        ));
    }
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let mut bytes = vec![0; width * height * T::COMPONENTS];
    reader.next_frame(&mut bytes).map_err(|e| damaged(path, &e))?;
    Ok(Image::from_fn(width, height, |x, y| {
        let texel = ((height - 1 - y) * width + x) * T::COMPONENTS;
        T::from_components(|i| bytes[texel + i])
    }))
}

/// Reads a PNG file of any kind, as the channels `Y`, or `R`, `G` and `B`, and `A`. A palette is resolved, and a
/// transparent colour becomes alpha. Text and colour profiles are not read.
pub(super) fn read_channels(path: &Path) -> Result<Channels, Error> {
    let mut reader = reader(path, |decoder| {
        decoder.set_transformations(Transformations::EXPAND);
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
    })?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_pixels(path, width, height)?;
    let length = reader.output_buffer_size().ok_or_else(|| Error::input(path, "it is too large for this machine"))?;
    let mut bytes = vec![0; length];
    reader.next_frame(&mut bytes).map_err(|e| damaged(path, &e))?;
    let (color, depth) = reader.output_color_type();
    let names: &[&str] = match color {
        ColorType::Grayscale => &["Y"],
        ColorType::GrayscaleAlpha => &["Y", "A"],
        ColorType::Rgba => &["R", "G", "B", "A"],
        ColorType::Rgb | ColorType::Indexed => &["R", "G", "B"],
    };
    let samples = |i: usize| match depth {
        BitDepth::Sixteen => {
            let words = bytes.chunks_exact(2).skip(i).step_by(names.len());
            Samples::Words(words.map(|word| u16::from_be_bytes([word[0], word[1]])).collect())
        }
        _ => Samples::Bytes(bytes.iter().skip(i).step_by(names.len()).copied().collect()),
    };
    let channels = names.iter().enumerate().map(|(i, name)| Channel { name: (*name).into(), samples: samples(i) });
    Ok(Channels { width, height, channels: channels.collect(), layers: 1 })
}

/// Reads the text of a PNG file as pairs (keyword, text), in no particular order. At most 16 MiB of text are read,
/// because a small file can contain gigabytes of compressed text.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read, is damaged, or has more text.
pub fn read_text(path: &Path) -> Result<Vec<(String, String)>, Error> {
    let mut reader = reader(path, |_| ())?;
    reader.finish().map_err(|e| Error::input(path, e.to_string()))?; // reads the text that follows the pixels, too
    let info = reader.info();
    let refused = |e: &dyn Display| Error::input(path, format!("its text cannot be read, or is past 16 MiB: {e}"));
    let mut pairs = Vec::new();
    let mut room = MOST_TEXT;
    let mut keep = |keyword: &str, text: Cow<str>, room: &mut usize| {
        *room = room.checked_sub(text.len()).ok_or_else(|| refused(&"too long"))?;
        pairs.push((keyword.to_owned(), text.into_owned()));
        Ok(())
    };
    for chunk in &info.uncompressed_latin1_text {
        keep(&chunk.keyword, Cow::Borrowed(&chunk.text), &mut room)?;
    }
    // `decompress_text_with_limit` does not limit text that is not compressed. `keep` counts all text.
    for chunk in &info.compressed_latin1_text {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(room).map_err(|e| refused(&e))?;
        keep(&chunk.keyword, Cow::Owned(chunk.get_text().map_err(|e| refused(&e))?), &mut room)?;
    }
    for chunk in &info.utf8_text {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(room).map_err(|e| refused(&e))?;
        keep(&chunk.keyword, Cow::Owned(chunk.get_text().map_err(|e| refused(&e))?), &mut room)?;
    }
    Ok(pairs)
}

/// Opens a PNG file, reads its header and checks what the header claims. `prepare` says how the file is decoded.
fn reader(path: &Path, prepare: impl FnOnce(&mut Decoder<BufReader<File>>)) -> Result<Reader<BufReader<File>>, Error> {
    let (file, length) = open(path)?;
    let mut decoder = Decoder::new(file);
    prepare(&mut decoder);
    let info = decoder.read_header_info().map_err(|e| damaged(path, &e))?;
    let claimed = u128::from(info.width) * u128::from(info.height) * info.bits_per_pixel() as u128 / 8;
    check_claim(path, length, claimed)?;
    decoder.read_info().map_err(|e| damaged(path, &e))
}

fn color<T: Texel>() -> ColorType {
    if T::COMPONENTS == 1 { ColorType::Grayscale } else { ColorType::Rgb }
}
