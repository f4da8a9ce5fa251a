//! Reads materials from MTL files, and decides where a model's MTL files may lie. Whatever is
//! wrong with an MTL file, its materials are white, and a notice says so.
//!
//! tobj reads the materials, from text that is written here: only the materials that a model uses, each once, and of
//! these only valid statements. tobj 4.0.5 itself panics on `Kd 1 1`, stops at any statement that it cannot read, and
//! keeps some 600 bytes for each `newmtl`.

use super::find::{Found, find, inside, spellings};
use super::foreign;
use super::notices::{Kind, Notices};
use super::skin::{self, Named};
use super::statement::{Statement, Statements, number, quoted};
use std::collections::{BTreeMap, HashMap};
use std::io::BufRead;
use std::path::{Path, PathBuf};

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

/// What is read of a material.
pub(super) struct Material {
    /// The diffuse colour, clamped to [0, 1].
    pub(super) colour: [f32; 3],
    /// The line of a `d` below 1/2.
    pub(super) invisible: Option<u64>,
    pub(super) colour_map: Option<Named>,
    pub(super) cut_map: Option<Named>,
}

/// The materials of one file, by their numbers, so that notices about them are always in the same order.
type Read = BTreeMap<u32, Material>;

/// Reads the materials in `wanted` from an MTL file. If a file defines a name twice, the last definition counts. All
/// other materials are ignored. What cannot be read is told to `notices`.
///
/// Many files have mistakes in statements that are not read (`illum 2.0`, comments in Latin-1), which therefore do not
/// matter.
pub(super) fn materials(file: impl BufRead, path: &Path, wanted: &Materials, notices: &mut Notices) -> Read {
    let mut read = Read::new();
    let mut not_read = |why: String| notices.add(Kind::Library, || why);
    let (head, file) = match foreign::head(file) {
        Ok(read) => read,
        Err(e) => {
            not_read(format!("{}: cannot be read: {e}", path.display()));
            return read;
        }
    };
    if let Some((what, remedy)) = foreign::certain(&head) {
        let remedy = if remedy == foreign::ENCODE { remedy } else { "and not MTL" };
        not_read(format!("{}: this is {what}, {remedy}", path.display()));
        return read;
    }
    // `None` before the first `newmtl`, `Some(None)` in a material that is not wanted, and otherwise its number.
    let mut current: Option<Option<u32>> = None;
    // The last valid statement of each kind, by the materials' numbers.
    let mut definitions: BTreeMap<u32, Definition> = BTreeMap::new();
    let mut maps: HashMap<(u32, &'static str), Named> = HashMap::new();
    let mut dissolved: HashMap<(u32, &'static str), u64> = HashMap::new();
    let mut statements = Statements::new(file, path);
    loop {
        let statement = match statements.next() {
            Ok(Some(statement)) => statement,
            Ok(None) => break,
            Err(error) => {
                // Nothing of a file that cannot be read to its end is used.
                notices.add(Kind::Library, || error.to_string());
                return read;
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
            keyword @ ("d" | "Tr") => match dissolve(&statement) {
                Ok(number) => {
                    let (keyword, d) = if keyword == "d" { ("d", number) } else { ("Tr", 1.0 - number) };
                    set(keyword, d.to_string());
                    dissolved.extend(current.flatten().map(|material| ((material, keyword), statement.line())));
                }
                Err(what) if current.flatten().is_some() => {
                    notices.add(Kind::Dissolve, || statement.notice(what));
                }
                Err(_) => {}
            },
            keyword @ ("map_Kd" | "map_d") if current.flatten().is_some() => {
                let (keyword, kind) = if keyword == "map_d" { ("map_d", Kind::Cut) } else { ("map_Kd", Kind::Texture) };
                match skin::named(&statement, path) {
                    Ok(named) => {
                        set(keyword, keyword.into());
                        maps.extend(current.flatten().map(|material| ((material, keyword), named)));
                    }
                    Err(what) => notices.add(kind, || statement.notice(what)),
                }
            }
            keyword if current.flatten().is_some() && is_ignored(keyword) => {
                notices.add(Kind::Ignored, || statement.notice(format!("{} is not read", quoted(keyword))));
            }
            _ => {}
        }
    }
    let mut text = String::new();
    for (material, mut definition) in definitions {
        // `Tr` is 1 - d. Where a material has both, `d` counts: exporters differ in what they write for `Tr`.
        if let Some(d) = definition.remove("Tr")
            && !definition.contains_key("d")
        {
            definition.insert("d", d);
            dissolved.extend(dissolved.get(&(material, "Tr")).map(|&line| ((material, "d"), line)));
        }
        text += &format!("newmtl {material}\n");
        definition.into_iter().for_each(|(keyword, value)| text += &format!("{keyword} {value}\n"));
    }
    match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((materials, _)) => read.extend(materials.into_iter().filter_map(|material| {
            let number = material.name.parse().ok()?;
            let mut map =
                |texture: Option<String>| maps.remove(&(number, if texture? == "map_d" { "map_d" } else { "map_Kd" }));
            let read = Material {
                colour: material.diffuse.map_or(WHITE, |colour| colour.map(|x| x as f32)),
                invisible: material.dissolve.filter(|&d| d < 0.5).and_then(|_| dissolved.get(&(number, "d")).copied()),
                colour_map: map(material.diffuse_texture),
                cut_map: map(material.dissolve_texture),
            };
            Some((number, read))
        })),
        // tobj accepts whatever is written above, so that this is no error which a file can cause.
        Err(e) => notices.add(Kind::Library, || format!("{}: cannot be read: {e}", path.display())),
    }
    read
}

/// The statements of a material that tobj reads: their keywords, and what follows them.
type Definition = BTreeMap<&'static str, String>;

/// Returns whether a statement would change a picture, but is not read. Others, such as `Ks` and `illum`, are about
/// light that is not drawn, and nearly every file has them.
fn is_ignored(keyword: &str) -> bool {
    keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "decal" | "refl" | "norm")
}

/// Parses the number of `d`, `d -halo` or `Tr`.
fn dissolve(statement: &Statement) -> Result<f64, String> {
    let word = statement.words().find(|word| *word != "-halo");
    number(word.ok_or_else(|| format!("{} needs a number", statement.keyword()))?)
}

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
        return words().take(MOST_LIBRARIES + 1).map(|word| library(folders, word)).collect();
    }
    let found = library(folders, &name);
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

fn library(folders: &[PathBuf], name: &[u8]) -> Result<Found, String> {
    find(folders, name).map_err(|why| format!("material file {} {why}", quoted(name)))
}
