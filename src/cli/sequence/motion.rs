//! How the camera of a sequence moves: by a file of keys, or about the scene.

use crate::cli::flags::{number, path, text, valued, word};
use clap::{Arg, ArgMatches};
use glam::DVec3;
use hbao::Error;
use hbao::scene::{CameraPath, Interpolation, Key, Mesh, Turntable, View};
use serde_json::{Map, Value};
use std::fs::File;
use std::io::Read as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// The longest file of a path that is read, in bytes: some 100,000 keys.
const LONGEST: u64 = 1 << 24;

/// The frames of a second of a path that does not tell it.
const FPS: f64 = 24.0;

/// The largest number of frames of a turn.
const MOST_FRAMES: u32 = 10_000_000;

const INTERPOLATIONS: [(&str, Interpolation); 2] =
    [("linear", Interpolation::Linear), ("catmull-rom", Interpolation::CatmullRom)];

/// How the camera moves.
pub(super) enum Motion {
    Path(CameraPath),
    Turntable(u32),
}

/// Makes the flags of the motion. One of --path and --turntable must be given.
pub(super) fn arguments() -> [Arg; 4] {
    let names = INTERPOLATIONS.map(|(name, _)| name).join(", ");
    [
        path("path", "FILE", "The camera path: keys in time, as JSON or CSV").conflicts_with_all([
            "turntable",
            "eye",
            "target",
            "view-matrix",
        ]),
        valued("turntable", "N", "Turn the eye once about the up axis through the target, in N frames")
            .required_unless_present("path")
            .conflicts_with_all(["fps", "interpolation"]),
        valued("fps", "N", format!("Frames per second of the path [above 0; default: the file's, or {FPS}]")),
        valued(
            "interpolation",
            "KIND",
            format!("How eye and target move between keys [{names}; default: the file's, or catmull-rom]"),
        ),
    ]
}

impl Motion {
    /// Reads the flags, and the file of the path.
    pub(super) fn read(matches: &ArgMatches) -> Result<Motion, Error> {
        if let Some(given) = text(matches, "turntable") {
            let frames = given.parse().ok().filter(|frames| (1..=MOST_FRAMES).contains(frames));
            return frames.map(Motion::Turntable).ok_or_else(|| {
                Error::Usage(format!("--turntable: '{given}' is not a whole number from 1 to {MOST_FRAMES}"))
            });
        }
        let fps = number(matches, "fps")?;
        let interpolation = text(matches, "interpolation").map(|text| word("interpolation", text, &INTERPOLATIONS));
        let interpolation = interpolation.transpose()?;
        let path = matches.get_one::<PathBuf>("path").cloned().unwrap_or_default();
        let refuse = |what: String| Error::Input { path: path.clone(), what };
        let found = read_file(&path)?;
        let found = found.map_err(|what| refuse(format!("no camera path: {what}")))?;
        let interpolation = interpolation.or(found.interpolation).unwrap_or_default();
        let motion = CameraPath::new(found.keys, interpolation, fps.or(found.fps).unwrap_or(FPS));
        motion.map(Motion::Path).map_err(|error| refuse(format!("no camera path: {error}")))
    }

    /// Returns the numbers of the frames.
    pub(super) fn frames(&self) -> RangeInclusive<u32> {
        match self {
            Motion::Path(path) => path.frames(),
            Motion::Turntable(frames) => 0..=frames - 1,
        }
    }

    /// Returns the views of the frames. `given` is the camera that the flags give, completed by the scene. It says what
    /// the motion leaves open.
    pub(super) fn views(
        &self,
        given: &View,
        mesh: &Mesh,
        size: (u32, u32),
    ) -> Result<impl Fn(u32) -> View + Sync, Error> {
        let turntable = match self {
            Motion::Path(_) => None,
            Motion::Turntable(frames) => {
                let (camera, _) = given.camera(mesh, size.0, size.1)?;
                let (low, high) = mesh.bounds();
                let (target, up) = (given.target.unwrap_or(low.midpoint(high)), given.up.unwrap_or(DVec3::Y));
                Some(Turntable { eye: camera.eye, target, up, frames: *frames })
            }
        };
        Ok(move |frame| {
            let view = match (self, turntable) {
                (Motion::Path(path), _) => path.view(frame),
                (_, Some(turntable)) => turntable.view(frame),
                _ => View::default(),
            };
            View { up: view.up.or(given.up), lens: view.lens.or(given.lens), near: given.near, far: given.far, ..view }
        })
    }

    /// Returns whether the motion tells the field of view.
    pub(super) fn has_lens(&self) -> bool {
        matches!(self, Motion::Path(path) if path.view(0).lens.is_some())
    }
}

/// What a file of a path says.
#[derive(Default)]
struct Found {
    keys: Vec<Key>,
    interpolation: Option<Interpolation>,
    fps: Option<f64>,
}

/// Reads a file. The inner error says what is wrong with what it holds.
fn read_file(path: &Path) -> Result<Result<Found, String>, Error> {
    let unreadable = |what: String| Error::Input { path: path.into(), what };
    let mut bytes = Vec::new();
    let file = File::open(path).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes));
    file.map_err(|e| unreadable(format!("it cannot be read, {e}: give a camera path as JSON or CSV")))?;
    if bytes.len() as u64 > LONGEST {
        return Err(unreadable(format!("too long for a camera path: more than {} MiB", LONGEST >> 20)));
    }
    let text = String::from_utf8(bytes).map_err(|_| unreadable("no camera path: it is not text in UTF-8".into()))?;
    let text = text.trim_start_matches('\u{feff}').trim_start();
    Ok(if text.starts_with(['{', '[']) { of_json(text) } else { of_csv(text) })
}

fn of_json(text: &str) -> Result<Found, String> {
    let value: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let Value::Object(table) = value else { return Err("it must be an object with \"keys\"".into()) };
    known(&table, &["fps", "interpolation", "keys"], "the path")?;
    let fps = table.get("fps").map(|fps| fps.as_f64().ok_or("fps is not a number")).transpose()?;
    let interpolation = table.get("interpolation").map(|given| {
        let named = |&&(name, _): &&(&str, Interpolation)| given.as_str() == Some(name);
        let found = INTERPOLATIONS.iter().find(named).map(|&(_, interpolation)| interpolation);
        found.ok_or_else(|| format!("interpolation {given} is not one of \"linear\", \"catmull-rom\""))
    });
    let keys = table.get("keys").and_then(Value::as_array).ok_or("it has no list \"keys\"")?;
    let keys = keys.iter().enumerate().map(|(i, key)| {
        let Value::Object(key) = key else { return Err(format!("key {i} is no object")) };
        known(key, &["time", "eye", "target", "up", "fov_y"], &format!("key {i}"))?;
        let number = |name: &str| {
            let value = key.get(name).ok_or_else(|| format!("key {i} has no {name}"))?;
            value.as_f64().ok_or_else(|| format!("{name} of key {i} is not a number"))
        };
        let point = |name: &str| -> Result<DVec3, String> {
            let value = key.get(name).ok_or_else(|| format!("key {i} has no {name}"))?;
            let numbers = value.as_array().map(|numbers| numbers.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
            let length = value.as_array().map_or(0, Vec::len);
            match numbers.as_deref() {
                Some(&[x, y, z]) if length == 3 => Ok(DVec3::new(x, y, z)),
                _ => Err(format!("{name} of key {i} is not a list of three numbers")),
            }
        };
        Ok(Key {
            time: number("time")?,
            eye: point("eye")?,
            target: point("target")?,
            up: key.contains_key("up").then(|| point("up")).transpose()?,
            fov_y: key.contains_key("fov_y").then(|| number("fov_y")).transpose()?.map(f64::to_radians),
        })
    });
    Ok(Found { keys: keys.collect::<Result<_, _>>()?, interpolation: interpolation.transpose()?, fps })
}

/// Refuses names that mean nothing, which are likely to be mistyped.
fn known(table: &Map<String, Value>, names: &[&str], what: &str) -> Result<(), String> {
    match table.keys().find(|name| !names.contains(&name.as_str())) {
        Some(name) => Err(format!("{what} has \"{name}\", which is not one of {}", names.join(", "))),
        None => Ok(()),
    }
}

/// The columns that a table must have, and those that it may have.
const COLUMNS: [&str; 7] = ["time", "eye_x", "eye_y", "eye_z", "target_x", "target_y", "target_z"];
const MORE_COLUMNS: [&str; 4] = ["up_x", "up_y", "up_z", "fov_y"];

fn of_csv(text: &str) -> Result<Found, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    let names = || COLUMNS.into_iter().chain(MORE_COLUMNS);
    if let Some(name) = header.iter().find(|name| !names().any(|known| known == *name)) {
        return Err(format!(
            "its first line must be {}[,up_x,up_y,up_z][,fov_y], and holds '{name}'; or give JSON",
            COLUMNS.join(",")
        ));
    }
    let column = |name: &str| header.iter().position(|column| column == name);
    if let Some(name) = COLUMNS.into_iter().find(|name| column(name).is_none()) {
        return Err(format!("its first line lacks the column {name}"));
    }
    let ups = MORE_COLUMNS[..3].iter().filter(|name| column(name).is_some()).count();
    if ups != 0 && ups != 3 {
        return Err("its first line must have all of up_x, up_y and up_z, or none".into());
    }
    let mut found = Found::default();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|e| e.to_string())?;
        let number = |name: &str| -> Result<f64, String> {
            let text = column(name).and_then(|at| record.get(at)).unwrap_or_default();
            text.parse().map_err(|_| format!("{name} of key {i} is '{text}', which is not a number"))
        };
        let point =
            |[x, y, z]: [&str; 3]| -> Result<DVec3, String> { Ok(DVec3::new(number(x)?, number(y)?, number(z)?)) };
        found.keys.push(Key {
            time: number("time")?,
            eye: point(["eye_x", "eye_y", "eye_z"])?,
            target: point(["target_x", "target_y", "target_z"])?,
            up: (ups == 3).then(|| point(["up_x", "up_y", "up_z"])).transpose()?,
            fov_y: column("fov_y").map(|_| number("fov_y")).transpose()?.map(f64::to_radians),
        });
    }
    Ok(found)
}
