//! Reads the diffuse colours of materials from MTL files, and decides where a model's MTL files may lie. Whatever is
//! wrong with an MTL file, its materials are white, and a notice says so.
//!
//! tobj reads the materials, from text that is written here: only the materials that a model uses, each once, and of
//! these only valid statements. tobj 4.0.5 itself panics on `Kd 1 1`, stops at any statement that it cannot read, and
//! keeps some 600 bytes for each `newmtl`.

use super::foreign;
use super::notices::{Kind, Notices};
use super::statement::{Statement, Statements, number, quoted};
use std::collections::{BTreeMap, HashMap};
use std::ffi::{OsStr, OsString};
use std::io::{BufRead, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// The colour of triangles that have no material, or a material without `Kd`.
pub(super) const WHITE: [f32; 3] = [1.0; 3];

/// The most material files of a model that are read. The number is limited because each of them is searched for and
/// opened.
pub(super) const MOST_LIBRARIES: usize = 200;

/// Says that a model names more material files than are read.
pub(super) fn too_many_libraries() -> String {
    format!("this is material file {}, and only {MOST_LIBRARIES} are read: join them", MOST_LIBRARIES + 1)
}

/// Materials by their names. Each has a number, counted from 1 in the order of appearance, and the line on which it
/// appears first. The number 0 means no material.
pub(super) type Materials = HashMap<Box<[u8]>, (u32, u64)>;

/// Reads the diffuse colours of the materials in `wanted` from an MTL file, clamped to [0, 1], by the materials'
/// numbers. If a file defines a name twice, the last definition counts. All other materials are ignored. What cannot be
/// read is told to `notices`.
///
/// Of each material only `Kd` is read. Many files have mistakes in other statements (`illum 2.0`, comments in Latin-1),
/// which therefore do not matter.
pub(super) fn colours(
    file: impl BufRead,
    path: &Path,
    wanted: &Materials,
    notices: &mut Notices,
) -> HashMap<u32, [f32; 3]> {
    let mut colours = HashMap::new();
    let mut not_read = |why: String| notices.add(Kind::Library, || why);
    let (head, file) = match foreign::head(file) {
        Ok(read) => read,
        Err(e) => {
            not_read(format!("{}: cannot be read: {e}", path.display()));
            return colours;
        }
    };
    if let Some((what, remedy)) = foreign::certain(&head) {
        let remedy = if remedy == foreign::ENCODE { remedy } else { "and not MTL" };
        not_read(format!("{}: this is {what}, {remedy}", path.display()));
        return colours;
    }
    // `None` before the first `newmtl`, `Some(None)` in a material that is not wanted, and otherwise its number.
    let mut current: Option<Option<u32>> = None;
    // The last valid statement of each kind, by the materials' numbers.
    let mut definitions: BTreeMap<u32, Definition> = BTreeMap::new();
    let mut statements = Statements::new(file, path);
    loop {
        let statement = match statements.next() {
            Ok(Some(statement)) => statement,
            Ok(None) => break,
            Err(error) => {
                // Nothing of a file that cannot be read to its end is used.
                notices.add(Kind::Library, || error.to_string());
                return colours;
            }
        };
        let mut set = |keyword: &'static str, value: String| {
            if let Some(definition) = current.flatten().and_then(|material| definitions.get_mut(&material)) {
                definition.insert(keyword, value);
            }
        };
        match statement.keyword() {
            "newmtl" => {
                let material = wanted.get(statement.name()).map(|&(number, _)| number);
                current = Some(material);
                definitions.extend(material.map(|material| (material, Definition::new())));
            }
            "Kd" => match (colour(&statement), current) {
                (Ok(colour), Some(material)) => {
                    if material.is_some() && colour.iter().any(|x| *x > 1.0) {
                        notices.add(Kind::Bright, || statement.notice("Kd is above 1"));
                    }
                    let [r, g, b] = colour.map(|x| x.clamp(0.0, 1.0));
                    set("Kd", format!("{r} {g} {b}"));
                }
                (Ok(_), None) => notices.add(Kind::Colour, || statement.notice("Kd belongs after a newmtl")),
                (Err(what), _) => notices.add(Kind::Colour, || statement.notice(what)),
            },
            "map_Kd" if current.flatten().is_some() => {
                notices.add(Kind::Texture, || statement.notice("the texture of map_Kd is not read"));
            }
            _ => {}
        }
    }
    let mut text = String::new();
    for (material, definition) in definitions {
        text += &format!("newmtl {material}\n");
        definition.into_iter().for_each(|(keyword, value)| text += &format!("{keyword} {value}\n"));
    }
    match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((materials, _)) => colours.extend(materials.into_iter().filter_map(|material| {
            let colour = material.diffuse.map_or(WHITE, |colour| colour.map(|x| x as f32));
            material.name.parse().ok().map(|number| (number, colour))
        })),
        // tobj accepts whatever is written above, so that this is no error which a file can cause.
        Err(e) => notices.add(Kind::Library, || format!("{}: cannot be read: {e}", path.display())),
    }
    colours
}

/// The statements of a material that tobj reads: their keywords, and what follows them.
type Definition = BTreeMap<&'static str, String>;

/// Parses the numbers of `Kd r g b`, or of `Kd r`, which is a grey.
fn colour(statement: &Statement) -> Result<[f64; 3], String> {
    let mut words = statement.words().peekable();
    if let Some(form @ (&"spectral" | &"xyz")) = words.peek() {
        return Err(format!("Kd {form} is not read, only Kd red green blue"));
    }
    let mut component = || words.next().map(number).transpose();
    Ok(match [component()?, component()?, component()?] {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        [Some(grey), None, None] => [grey; 3],
        _ => return Err("Kd needs three numbers, red green blue".into()),
    })
}

/// An MTL file that was found.
pub(super) struct Found {
    /// Its path beside the model's path, for messages.
    pub(super) shown: PathBuf,
    /// Its path without symbolic links.
    pub(super) real: PathBuf,
}

/// Finds the MTL files that one `mtllib` statement names, or says why a file is not opened. All of them must lie in one
/// of the model's `folders` or below it: models are often files from somebody else, and must not be able to make this
/// program open files elsewhere.
pub(super) fn libraries(folders: &[PathBuf], name: &[u8]) -> Vec<Result<Found, String>> {
    // Exporters on Windows write backslashes.
    let name: Vec<u8> = name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
    // The words are taken for several names only if all end in `.mtl` and no file has all of them as its name: a name
    // that contains spaces is more frequent than a statement with several names.
    let words = || name.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let several = words().nth(1).is_some() && words().all(|word| word.to_ascii_lowercase().ends_with(b".mtl"));
    if several && !spellings(&name).iter().any(|name| inside(folders, Path::new(name)).is_ok()) {
        return words().take(MOST_LIBRARIES + 1).map(|word| find(folders, word)).collect();
    }
    let found = find(folders, &name);
    // A name may contain `#`. It is the beginning of a comment only if no file has the whole name.
    let comment = name.windows(2).position(|pair| pair[0].is_ascii_whitespace() && pair[1] == b'#');
    let before = comment.map(|comment| name[..comment].trim_ascii()).filter(|name| !name.is_empty());
    match (&found, before) {
        (Err(_), Some(before)) => libraries(folders, before),
        _ => vec![found],
    }
}

/// Says that a material file cannot be opened or read.
pub(super) fn cannot_read(name: &[u8], error: &std::io::Error) -> String {
    format!("material file {} cannot be read ({error})", quoted(name))
}

/// Returns the file names that the bytes of a name may mean. On Unix these are the bytes themselves. Bytes that are not
/// UTF-8 may also be Latin-1, in which many programs on Windows write names; the file system then has the same letters.
pub(super) fn spellings(name: &[u8]) -> Vec<OsString> {
    if let Ok(name) = std::str::from_utf8(name) {
        return vec![name.into()];
    }
    let latin1: String = name.iter().map(|&byte| char::from(byte)).collect();
    #[cfg(unix)]
    let bytes = Some(std::os::unix::ffi::OsStrExt::from_bytes(name)).map(|name: &OsStr| name.to_os_string());
    #[cfg(not(unix))]
    let bytes = None;
    bytes.into_iter().chain([latin1.into()]).collect()
}

/// Finds one MTL file, whose name has slashes: under the name as it is written, then under the name's last part beside
/// the model, and then under that part in another case if only one file has it so.
fn find(folders: &[PathBuf], name: &[u8]) -> Result<Found, String> {
    let mut why = None;
    for spelling in spellings(name) {
        let written = PathBuf::from(spelling);
        let last = written.file_name().unwrap_or_default();
        let in_another_case = folders.iter().rev().filter_map(|folder| in_another_case(folder, last));
        for path in [written.clone(), last.into()].into_iter().chain(in_another_case) {
            match inside(folders, &path) {
                Ok(file) => return Ok(file),
                Err(NotOpened::Missing) => {}
                Err(NotOpened::Because(what)) => why = why.or(Some(what)),
            }
        }
    }
    let why = why.unwrap_or_else(|| "is not beside the model".into());
    Err(format!("material file {} {why}", quoted(name)))
}

/// Returns the name of the only file of a folder that has this name in another case.
fn in_another_case(folder: &Path, name: &OsStr) -> Option<PathBuf> {
    let wanted = name.to_str()?.to_lowercase();
    let names = folder.read_dir().ok()?.flatten().map(|entry| entry.file_name());
    let mut names = names.filter(|name| name.to_str().is_some_and(|name| name.to_lowercase() == wanted));
    let found = names.next()?;
    names.next().is_none().then(|| found.into())
}

/// Why a file is not opened.
enum NotOpened {
    Missing,
    Because(String),
}

/// Finds the file `relative` in the first of `folders` that has it. Its symbolic links are followed, and what they lead
/// to must lie in one of the folders, too.
fn inside(folders: &[PathBuf], relative: &Path) -> Result<Found, NotOpened> {
    let plain = |part: Component| match part {
        Component::CurDir => true,
        // On Windows a colon belongs to a drive, C:, or to a stream of a file.
        Component::Normal(part) => !cfg!(windows) || !part.as_encoded_bytes().contains(&b':'),
        _ => false,
    };
    if relative.as_os_str().is_empty() || !relative.components().all(plain) {
        return Err(NotOpened::Missing);
    }
    let mut found = Err(NotOpened::Missing);
    for folder in folders.iter().rev() {
        let path = folder.join(relative);
        found = match (path.canonicalize(), found) {
            (Ok(real), _) => Ok(Found { shown: path.strip_prefix(".").unwrap_or(&path).into(), real }),
            (Err(e), Err(NotOpened::Missing))
                if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) =>
            {
                Err(NotOpened::Because(format!("cannot be read ({e})")))
            }
            (_, found) => found,
        };
    }
    let file = found?;
    let holds = |folder: &PathBuf| folder.canonicalize().is_ok_and(|folder| file.real.starts_with(folder));
    if !folders.iter().any(holds) {
        return Err(NotOpened::Because("leads out of the model's folder".into()));
    }
    // Nothing else is opened: to open a pipe, for example, could wait for ever.
    if !file.real.is_file() {
        return Err(NotOpened::Because("is not a file".into()));
    }
    Ok(file)
}
