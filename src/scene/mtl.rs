//! MTL files: the diffuse colours of materials, and where a model may keep them.

use super::statement::{number, quoted, statements};
use crate::Error;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

/// The colour of what has no material, or a material without `Kd`.
pub(super) const WHITE: [f32; 3] = [1.0; 3];

/// The diffuse colour of each material in an MTL file, clamped to [0, 1]; where a name is given twice, the last.
///
/// Reduced to `newmtl` and `Kd` before tobj sees it: tobj 4.0.5 panics on a colour of fewer than three numbers, and
/// refuses whole files for statements that do not matter here (`illum 2.0`, `d -halo 0.5`, Latin-1 comments).
pub(super) fn colours(bytes: &[u8], path: &Path) -> Result<HashMap<String, [f32; 3]>, Error> {
    let mut plain = String::new();
    let mut named = false;
    for (line, statement) in statements(&String::from_utf8_lossy(bytes)) {
        let refuse = |what: String| Error::input(path, format!("line {line}: {what}"));
        match statement.keyword() {
            "newmtl" if statement.name().is_empty() => return Err(refuse("newmtl needs a name".into())),
            "newmtl" => {
                named = true;
                let _ = writeln!(plain, "newmtl {}", statement.name());
            }
            "Kd" if !named => return Err(refuse("Kd belongs after a newmtl".into())),
            "Kd" => {
                let [r, g, b] = colour(statement.words()).map_err(refuse)?;
                let _ = writeln!(plain, "Kd {r} {g} {b}");
            }
            _ => {}
        }
    }
    let (materials, by_name) =
        tobj::load_mtl_buf(&mut plain.as_bytes()).map_err(|e| Error::input(path, e.to_string()))?;
    let colour_of = |i: usize| materials[i].diffuse.map_or(WHITE, |kd| kd.map(|x| x as f32));
    Ok(by_name.into_iter().map(|(name, i)| (name, colour_of(i))).collect())
}

/// `Kd r g b`, or `Kd r` for a grey.
fn colour<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let mut component = || words.next().map(number).transpose();
    let numbers = [component()?, component()?, component()?];
    match numbers {
        [Some(r), Some(g), Some(b)] => Ok([r, g, b].map(|x| x.clamp(0.0, 1.0))),
        [Some(grey), None, None] => Ok([grey.clamp(0.0, 1.0); 3]),
        _ => Err("Kd needs three numbers, red green blue".into()),
    }
}

/// The MTL files that one `mtllib` statement names, checked to lie inside the model's folder.
///
/// A model is often somebody else's file, and must not make us open others' files elsewhere.
pub(super) fn libraries(folders: &[PathBuf], name: &str) -> Result<Vec<PathBuf>, String> {
    // Names hold spaces more often than statements hold several names.
    let words: Vec<&str> = name.split_whitespace().collect();
    let several = words.len() > 1 && words.iter().all(|word| word.to_ascii_lowercase().ends_with(".mtl"));
    if several && inside(folders, name).is_err() {
        words.iter().map(|word| inside(folders, word)).collect()
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
