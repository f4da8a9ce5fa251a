//! MTL files: the diffuse colours of materials, and where a model may keep them.

use super::statement::{Statements, number, quoted};
use crate::Error;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::{Component, Path, PathBuf};

/// The colour of what has no material, or a material without `Kd`.
pub(super) const WHITE: [f32; 3] = [1.0; 3];

/// A model names at most as many material files: each is looked for, and opened.
pub(super) const MOST_LIBRARIES: usize = 200;

/// The diffuse colours in an MTL file of the materials in `wanted`, clamped to [0, 1]; where a name is given twice, the
/// last. All other materials are read and forgotten.
///
/// Of each material only `Kd` is read: many files hold slips elsewhere (`illum 2.0`, Latin-1 comments) that change no
/// colour.
pub(super) fn colours(
    file: impl BufRead,
    path: &Path,
    wanted: &HashMap<Box<str>, u32>,
) -> Result<HashMap<u32, [f32; 3]>, Error> {
    let mut colours = HashMap::new();
    // The material at hand, and which of the wanted it is.
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

/// `Kd r g b`, or `Kd r` for a grey.
fn colour<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let mut component = || words.next().map(number).transpose();
    let numbers = match [component()?, component()?, component()?] {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        [Some(grey), None, None] => [grey; 3],
        _ => return Err("Kd needs three numbers, red green blue".into()),
    };
    Ok(numbers.map(|x| x.clamp(0.0, 1.0) as f32))
}

/// The MTL files that one `mtllib` statement names, checked to lie inside the model's folder.
///
/// A model is often somebody else's file, and must not make us open others' files elsewhere.
pub(super) fn libraries(folders: &[PathBuf], name: &str) -> Result<Vec<PathBuf>, String> {
    // Names hold spaces more often than statements hold several names.
    let words = || name.split_whitespace();
    let several = words().nth(1).is_some() && words().all(|word| word.to_ascii_lowercase().ends_with(".mtl"));
    if several && inside(folders, name).is_err() {
        words().take(MOST_LIBRARIES + 1).map(|word| inside(folders, word)).collect()
    } else {
        Ok(vec![inside(folders, name)?])
    }
}

/// The file `name` in the first of `folders` that has it, with symbolic links followed and still inside one of them.
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
    // Opening a pipe would wait for ever.
    if !file.is_file() {
        return Err(what("is not a file; name the MTL file itself"));
    }
    Ok(file)
}
