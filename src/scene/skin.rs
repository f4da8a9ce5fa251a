//! Reads the statements `map_Kd` and `map_d` of materials, and opens the textures that they name.

use super::find::{expected, find};
use super::notices::{Kind, Notices};
use super::statement::{Statement, number, quoted};
use super::texture::{self, Map, Pictures, Placed, Reading, Skin, Texture, Wrap};
use glam::DVec2;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A statement `map_Kd` or `map_d`, whose texture is not opened yet.
#[derive(Clone)]
pub(super) struct Named {
    /// The name of the texture's file, as it is in the material file.
    name: Box<[u8]>,
    placed: Placed,
    reading: Reading,
    /// The material file.
    path: PathBuf,
    line: u64,
}

/// Parses `map_Kd` or `map_d`: options, and then a name, which may contain spaces. Returns what is wrong with it.
pub(super) fn named(statement: &Statement, path: &Path) -> Result<Named, String> {
    let mut rest = statement.name();
    let mut placed = Placed { scale: DVec2::ONE, offset: DVec2::ZERO, wrap: [Wrap::Repeat; 2] };
    let mut reading = Reading::PLAIN;
    while let Some((option, after)) = word(rest).filter(|(word, _)| word.starts_with(b"-")) {
        let most = match option {
            b"-s" | b"-o" | b"-t" => 3,
            b"-mm" => 2,
            b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-imfchan" | b"-texres" | b"-type" | b"-boost" | b"-bm" => {
                1
            }
            _ => break, // a name that starts with a dash
        };
        rest = after;
        let text = matches!(option, b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-imfchan" | b"-type");
        let mut values: Vec<f64> = Vec::new();
        let mut value: &[u8] = b"";
        while let Some((next, after)) = word(rest).filter(|_| values.len() < most) {
            let read = std::str::from_utf8(next).ok().and_then(|next| number(next).ok());
            // The last word is the name, even if it is a number. `-s` and others have up to three numbers.
            if !text && (read.is_none() || (word(after).is_none() && !values.is_empty())) {
                break;
            }
            (value, rest) = (next, after);
            values.push(read.unwrap_or_default());
        }
        if values.is_empty() || (option == b"-mm" && values.len() < 2) {
            return Err(format!(
                "{} needs {}",
                quoted(option),
                if option == b"-mm" { "two numbers" } else { "a value" }
            ));
        }
        let pair = |default: f64| DVec2::new(values[0], values.get(1).copied().unwrap_or(default));
        match option {
            b"-s" => placed.scale = pair(1.0),
            b"-o" => placed.offset = pair(0.0),
            b"-mm" => reading.base_gain = [values[0], values[1]],
            b"-clamp" => match value {
                b"on" => placed.wrap = [Wrap::Clamp; 2],
                b"off" => placed.wrap = [Wrap::Repeat; 2],
                other => return Err(format!("\"-clamp\" is on or off, not {}", quoted(other))),
            },
            b"-imfchan" => match value {
                [channel @ (b'r' | b'g' | b'b' | b'm' | b'l')] => reading.channel = Some(*channel),
                other => return Err(format!("\"-imfchan\" is r, g, b, m or l, not {}", quoted(other))),
            },
            _ => {} // these do not matter here
        }
    }
    let name = rest.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(rest);
    if name.is_empty() {
        return Err(format!("{} names no file", statement.keyword()));
    }
    Ok(Named { name: name.into(), placed, reading, path: path.into(), line: statement.line() })
}

/// Splits off the first word.
fn word(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let text = text.trim_ascii();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    (!text.is_empty()).then(|| (&text[..end], text[end..].trim_ascii()))
}

/// The textures of a model. Each is opened once.
pub(super) struct Textures {
    /// The model's folders. Textures elsewhere are not opened. Without any, none is.
    folders: Vec<PathBuf>,
    pictures: Pictures,
    /// The files of textures, and where those were expected that are not there.
    files: BTreeSet<PathBuf>,
}

impl Textures {
    pub(super) fn new(folders: Vec<PathBuf>) -> Textures {
        Textures { folders, pictures: Pictures::default(), files: BTreeSet::new() }
    }

    /// Returns the files of the textures, and where those were looked for first that are not there.
    pub(super) fn into_files(self) -> BTreeSet<PathBuf> {
        self.files
    }

    /// Opens the textures of a material. What cannot be read is told to `notices`.
    pub(super) fn skin(&mut self, colour: Option<&Named>, cut: Option<&Named>, notices: &mut Notices) -> Skin {
        let mut open = |named: Option<&Named>, kind: Kind, what: What| {
            let named = named?;
            let texture = self.open(named, what).unwrap_or_else(|why| {
                let path = named.path.display();
                notices.add(kind, || format!("{path}: line {}: texture {} {why}", named.line, quoted(&named.name)));
                None
            });
            texture.map(|texture| Map { texture, placed: named.placed })
        };
        let seen = open(colour, Kind::Texture, What::Colours);
        let cut = match cut {
            // The texture of the colour cuts only if no other does. If it cannot be read, one notice is enough.
            None if seen.is_none() => None,
            None => open(colour, Kind::Texture, What::AlphaOfColours),
            cut => open(cut, Kind::Cut, What::Alpha),
        };
        Skin { colour: seen, cut }
    }

    fn open(&mut self, named: &Named, what: What) -> Result<Option<Arc<Texture>>, String> {
        // Names are relative to the material file, or to the model.
        let beside =
            named.path.parent().map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
        let folders = beside.filter(|_| !self.folders.is_empty()).map(Path::to_path_buf);
        let folders: Vec<PathBuf> = folders.into_iter().chain(self.folders.iter().cloned()).collect();
        if folders.is_empty() {
            return Err("is not read, because the model is not read from a file".into());
        }
        let name: Vec<u8> = named.name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
        let found = find(&folders, &name);
        self.files.extend(found.as_ref().map_or_else(|_| expected(&folders, &name), |found| Some(found.real.clone())));
        let found = found?;
        let reading = named.reading;
        let shown = found.shown.display().to_string();
        self.pictures.texture(
            &format!("{:?}", found.real),
            format!("{:?}", (what, reading)),
            || texture::decode(&found.real),
            |image| match what {
                What::Colours => Some(texture::colours(image, reading, shown)),
                What::Alpha => texture::cut(image, reading, false, shown),
                What::AlphaOfColours => texture::cut(image, reading, true, shown),
            },
        )
    }
}

/// What a texture is read for.
#[derive(Clone, Copy, Debug)]
enum What {
    Colours,
    Alpha,
    AlphaOfColours,
}
