//! Reads the diffuse colours of materials from MTL files, and decides where a model's MTL files may lie.

use super::statement::{Statements, number, quoted};
use crate::Error;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::{Component, Path, PathBuf};

/// The colour of triangles that have no material, or a material without `Kd`.
pub(super) const WHITE: [f32; 3] = [1.0; 3];

/// The most material files that a model may name. The number is limited because each of them is searched for and
/// opened.
pub(super) const MOST_LIBRARIES: usize = 200;

/// Reads the diffuse colours of the materials in `wanted` from an MTL file, clamped to [0, 1]. `wanted` maps names to
/// the numbers by which the result is indexed. If a file defines a name twice, the last definition counts. All other
/// materials are ignored.
///
/// Of each material only `Kd` is read. Many files have mistakes in other statements (`illum 2.0`, comments in Latin-1),
/// which therefore do not matter.
pub(super) fn colours(
    file: impl BufRead,
    path: &Path,
    wanted: &HashMap<Box<str>, u32>,
) -> Result<HashMap<u32, [f32; 3]>, Error> {
    let mut colours = HashMap::new();
    // `None` before the first `newmtl`, `Some(None)` in a material that is not wanted, and otherwise its number.
    let mut current: Option<Option<u32>> = None;
    let mut statements = Statements::new(file, path);
    while let Some(statement) = statements.next()? {
        match (statement.keyword(), current) {
            ("newmtl", _) if statement.name().is_empty() => return Err(statement.refuse("newmtl needs a name")),
            ("newmtl", _) => {
                let material = wanted.get(statement.name()).copied();
                current = Some(material);
                colours.extend(material.map(|material| (material, WHITE)));
            }
            ("Kd", None) => return Err(statement.refuse("Kd belongs after a newmtl")),
            ("Kd", Some(material)) => {
                let colour = colour(statement.words()).map_err(|what| statement.refuse(what))?;
                colours.extend(material.map(|material| (material, colour)));
            }
            _ => {}
        }
    }
    Ok(colours)
}

/// Parses the numbers of `Kd r g b`, or of `Kd r`, which is a grey.
fn colour<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let mut component = || words.next().map(number).transpose();
    let numbers = match [component()?, component()?, component()?] {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        [Some(grey), None, None] => [grey; 3],
        _ => return Err("Kd needs three numbers, red green blue".into()),
    };
    Ok(numbers.map(|x| x.clamp(0.0, 1.0) as f32))
}

/// Returns the MTL files that one `mtllib` statement names. All of them must lie in one of the model's `folders`:
/// models are often files from somebody else, and must not be able to make this program open files elsewhere.
pub(super) fn libraries(folders: &[PathBuf], name: &str) -> Result<Vec<PathBuf>, String> {
    // The words are taken for several names only if all end in `.mtl` and no file has all of them as its name: a name
    // that contains spaces is more frequent than a statement with several names.
    let words = || name.split_whitespace();
    let several = words().nth(1).is_some() && words().all(|word| word.to_ascii_lowercase().ends_with(".mtl"));
    if several && inside(folders, name).is_err() {
        words().take(MOST_LIBRARIES + 1).map(|word| inside(folders, word)).collect()
    } else {
        Ok(vec![inside(folders, name)?])
    }
}

/// Finds the file `name` in the first of `folders` that has it. Its symbolic links are followed, and what they lead to
/// must lie in one of the folders, too.
fn inside(folders: &[PathBuf], name: &str) -> Result<PathBuf, String> {
    if name.is_empty() {
        return Err("mtllib needs a file name".into());
    }
    let what = |why: &str| format!("material file {} {why}", quoted(name));
    let relative = PathBuf::from(name.replace('\\', "/")); // exporters on Windows write backslashes
    let plain = |part: Component| match part {
        Component::CurDir => true,
        Component::Normal(part) => !part.as_encoded_bytes().contains(&b':'), // a drive, C:
        _ => false,
    };
    let leads_out = what("leads out of the model's folder; move it beside the model");
    if !relative.components().all(plain) {
        return Err(leads_out);
    }
    let missing = |e| what(&format!("cannot be read ({e}); put it beside the model or remove the mtllib line"));
    let mut found = Err(missing(std::io::ErrorKind::NotFound.into()));
    for folder in folders.iter().rev() {
        found = folder.join(&relative).canonicalize().map_err(missing).or(found);
    }
    let file = found?;
    let real = |folder: &PathBuf| folder.canonicalize().is_ok_and(|folder| file.starts_with(folder));
    if !folders.iter().any(real) {
        return Err(leads_out);
    }
    // Anything else is refused: to open a pipe, for example, could wait for ever.
    if !file.is_file() {
        return Err(what("is not a file; name the MTL file itself"));
    }
    Ok(file)
}
