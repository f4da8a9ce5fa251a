//! The two parts of a glTF file: JSON, and binary data if it is a GLB file.

use super::json::Root;
use crate::Error;
use crate::scene::source::{Source, fill};
use std::io::{self, BufRead, BufReader, ErrorKind, Read};

/// The deepest nesting of brackets in JSON, which is the deepest that serde_json reads.
const DEEPEST: u32 = 128;
/// The most bytes of JSON.
pub(super) const MOST_JSON: u64 = 1 << 29;
const TEXT_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// Extensions that a file may require, because they do not change the shape of surfaces or are read. So are all that
/// begin with [`OF_MATERIALS`].
const KNOWN: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "KHR_xmp_json_ld",
    "EXT_texture_webp",
    "EXT_texture_avif",
    "MSFT_texture_dds",
];
const OF_MATERIALS: &str = "KHR_materials_";

/// Reads the two parts of a GLB file.
pub(super) fn chunks<R: BufRead>(source: &mut Source<R>) -> Result<(Root, Option<Vec<u8>>), String> {
    let bytes = &mut source.bytes;
    let mut numbers = [0; 12];
    if !fill(bytes, &mut numbers)? {
        return Err("this GLB file ends inside its header".into());
    }
    let [_, version, length] = [0, 4, 8].map(|at| number(&numbers[at..]));
    if version != 2 {
        return Err(format!("this is glTF {version}, and only glTF 2 is read: export it as glTF 2"));
    }
    if let Some(holds) = source.length.filter(|&holds| holds < u64::from(length)) {
        return Err(format!("this GLB file claims {length} bytes, and has {holds}: it has been cut short"));
    }
    let left = length.saturating_sub(12);
    let Some((kind, size)) = chunk(bytes, left)? else { return Err("this GLB file holds no JSON".into()) };
    if kind != TEXT_CHUNK || u64::from(size) > MOST_JSON {
        return Err(format!("this GLB file does not begin with JSON, or with more than {MOST_JSON} bytes of it"));
    }
    let mut text = bytes.take(size.into());
    let root = parse(&mut text)?;
    if text.limit() > 0 {
        return Err("this GLB file ends inside its JSON: it has been cut short".into());
    }
    let left = left.saturating_sub(8).saturating_sub(size);
    let binary = match chunk(bytes, left)? {
        Some((BINARY_CHUNK, size)) => {
            let mut binary = Vec::new();
            // The size is that of a part of the file if the file's length is known.
            binary.reserve_exact(if source.length.is_some() { size as usize } else { 0 });
            bytes.take(size.into()).read_to_end(&mut binary).map_err(|e| format!("cannot be read: {e}"))?;
            if binary.len() < size as usize {
                return Err("this GLB file ends inside its binary part: it has been cut short".into());
            }
            Some(binary)
        }
        _ => None,
    };
    Ok((root, binary))
}

/// Reads the head of a part of a GLB file, of which `left` bytes are left: its kind and its size.
fn chunk(bytes: &mut impl BufRead, left: u32) -> Result<Option<(u32, u32)>, String> {
    let mut numbers = [0; 8];
    if left < 8 || !fill(bytes, &mut numbers)? {
        return Ok(None);
    }
    let [size, kind] = [0, 4].map(|at| number(&numbers[at..]));
    if size > left - 8 {
        return Err(format!("a part of this GLB file claims {size} bytes, and {} are left", left - 8));
    }
    Ok(Some((kind, size)))
}

fn number(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Parses the JSON, to the end of `text`.
pub(super) fn parse(text: &mut impl Read) -> Result<Root, String> {
    let text = Shallow { text, depth: 0, string: false, escaped: false };
    let root: Root = serde_json::from_reader(BufReader::new(text)).map_err(|e| {
        match e.io_error_kind() {
            Some(ErrorKind::InvalidData) => return format!("this is no glTF 2: {e}"),
            Some(_) => return format!("cannot be read: {e}"),
            None => {}
        }
        let (line, column) = (e.line(), e.column());
        let what = e.to_string();
        let what = what.rsplit_once(" at line ").map_or(what.as_str(), |(what, _)| what);
        format!("this is no glTF 2: line {line}, column {column}: {}", Error::shown(what))
    })?;
    if !root.asset.version.starts_with("2.") {
        let version = Error::shown(&root.asset.version);
        return Err(format!("this is glTF {version}, and only glTF 2 is read: export it as glTF 2"));
    }
    match root
        .extensions_required
        .iter()
        .find(|name| !name.starts_with(OF_MATERIALS) && !KNOWN.contains(&name.as_str()))
    {
        None => Ok(root),
        Some(name) => {
            let name = Error::shown(name);
            Err(format!("it requires the extension {name}, which is not read: export it without"))
        }
    }
}

/// Reads JSON whose brackets are not nested too deeply. serde_json keeps a byte for each open bracket of what it skips.
struct Shallow<R> {
    text: R,
    depth: u32,
    /// Whether the text stands in a string, and after a backslash.
    string: bool,
    escaped: bool,
}

impl<R: Read> Read for Shallow<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.text.read(buffer)?;
        for &byte in &buffer[..count] {
            match (self.string, byte) {
                _ if std::mem::take(&mut self.escaped) => {}
                (true, b'\\') => self.escaped = true,
                (_, b'"') => self.string = !self.string,
                (false, b'[' | b'{') => self.depth += 1,
                (false, b']' | b'}') => self.depth = self.depth.saturating_sub(1),
                _ => {}
            }
            if self.depth > DEEPEST {
                let what = format!("its JSON has brackets more than {DEEPEST} deep");
                return Err(io::Error::new(ErrorKind::InvalidData, what));
            }
        }
        Ok(count)
    }
}
