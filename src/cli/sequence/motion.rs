//! How the camera of a sequence moves: by a file of keys, or about the scene.

use crate::cli::camera::point;
use crate::cli::flags::{number, path, text, valued, word};
use clap::{Arg, ArgMatches};
use glam::DVec3;
use hbao::Error;
use hbao::scene::{CameraMotion, CameraPath, Interpolation, Key, Mesh, Scene, Turntable, View};
use serde_json::{Map, Value};
use std::fmt::Display;
use std::fs::File;
use std::io::Read as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::slice::from_ref;

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
    Path {
        path: CameraPath,
        file: PathBuf,
    },
    /// A camera of a glTF file, and the frames per second of its animation.
    Camera(CameraMotion, f64),
    /// A turn in this number of frames, about the axis that `--up` gives.
    Turntable(u32, Option<DVec3>),
}

/// Makes the flags of the motion. One of --path, --turntable and --camera must be given.
pub(super) fn arguments() -> [Arg; 4] {
    let names = INTERPOLATIONS.map(|(name, _)| name).join(", ");
    [
        path("path", "FILE", "The camera path: keys in time, as JSON or CSV").conflicts_with_all([
            "turntable",
            "eye",
            "target",
            "view-matrix",
        ]),
        valued(
            "turntable",
            "N",
            "Turn the camera once about the scene's up axis (--up; default: the scene's own, or 0,1,0) through the \
             target, in N frames. With --view-matrix or a glTF camera, the target is the point of the view's axis that \
             is nearest to the scene's centre",
        )
        .conflicts_with_all(["fps", "interpolation"]),
        valued(
            "fps",
            "N",
            format!(
                "Frames per second of the path or of a camera's animation [above 0; default: the path's, or {FPS}]"
            ),
        ),
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
            let Some(frames) = frames else {
                let what = format!("--turntable: '{given}' is not a whole number from 1 to {MOST_FRAMES}");
                return Err(Error::Usage(what));
            };
            let up = point(matches, "up")?;
            View { up, ..View::default() }.check()?;
            return Ok(Motion::Turntable(frames, up));
        }
        let fps = number(matches, "fps")?;
        let interpolation = text(matches, "interpolation").map(|text| word("interpolation", text, &INTERPOLATIONS));
        let interpolation = interpolation.transpose()?;
        let file = matches.get_one::<PathBuf>("path").cloned().unwrap_or_default();
        let found = read_file(&file)?.map_err(|what| no_path(&file, &what))?;
        let interpolation = interpolation.or(found.interpolation).unwrap_or_default();
        let at = |fps| CameraPath::new(found.keys.clone(), interpolation, fps);
        let own = at(found.fps.unwrap_or(FPS));
        let path = match fps {
            // What is right at the file's own rate is wrong by the flag only.
            Some(fps) => at(fps).map_err(|error| match &own {
                Ok(_) => Error::Usage(format!("--fps {fps}: {error}")),
                Err(own) => no_path(&file, own),
            })?,
            None => own.map_err(|error| no_path(&file, &error))?,
        };
        Ok(Motion::Path { path, file })
    }

    /// Returns whether a camera of the scene tells the motion.
    pub(super) fn is_of_camera(matches: &ArgMatches) -> Result<bool, Error> {
        if text(matches, "turntable").is_some() || matches.contains_id("path") {
            return Ok(false);
        }
        let what = "give --path, a file of keys, or --turntable, a number of frames, or --camera, a camera of a glTF file that \
                    an animation moves";
        text(matches, "camera").map(|_| true).ok_or_else(|| Error::Usage(what.into()))
    }

    /// Takes the motion from the camera of the scene that the flags name.
    pub(super) fn of_camera(matches: &ArgMatches, scene: &Scene) -> Result<Motion, Error> {
        let name = text(matches, "camera").unwrap_or_default();
        let motion = scene.motion(name)?;
        if let Some(flag) = ["eye", "target", "up", "view-matrix", "interpolation"]
            .into_iter()
            .find(|flag| text(matches, flag).is_some())
        {
            let what = "cannot be used with the animation of --camera: give --path or --turntable too, or leave it out";
            return Err(Error::Usage(format!("--{flag} {what}")));
        }
        let fps = number(matches, "fps")?.unwrap_or(FPS);
        if !(fps.is_finite() && fps > 0.0) {
            return Err(Error::Usage(format!("--fps {fps}: the number of frames per second must be above 0")));
        }
        if motion.frames(fps).is_none() {
            let what = "no frame, or one after frame 10000000, lies in the animation of --camera";
            return Err(Error::Usage(format!("--fps {fps}: {what}")));
        }
        Ok(Motion::Camera(motion.clone(), fps))
    }

    /// Returns the numbers of the frames.
    pub(super) fn frames(&self) -> RangeInclusive<u32> {
        match self {
            Motion::Path { path, .. } => path.frames(),
            Motion::Camera(motion, fps) => motion.frames(*fps).unwrap_or(0..=0),
            Motion::Turntable(frames, _) => 0..=frames - 1,
        }
    }

    /// Refuses frames whose view is wrong, before the first one is rendered.
    pub(super) fn check(&self, frames: &[u32]) -> Result<(), Error> {
        match self {
            Motion::Path { path, file } => path.check(frames.iter().copied()).map_err(|error| no_path(file, &error)),
            Motion::Camera(motion, fps) => frames.iter().try_for_each(|&frame| {
                let view = motion.view(f64::from(frame) / fps);
                let none = || Error::Usage("the camera has no direction".into());
                let checked = view.ok_or_else(none).and_then(|view| view.check());
                checked.map_err(|error| Error::Usage(format!("--camera: frame {frame} of its animation: {error}")))
            }),
            Motion::Turntable(..) => Ok(()),
        }
    }

    /// Returns the views of the frames. `own` is the scene's camera, and `given` the one that the flags give, completed
    /// by it. It says what the motion leaves open.
    pub(super) fn views(
        &self,
        given: &View,
        own: &View,
        mesh: &Mesh,
        size: (u32, u32),
    ) -> Result<impl Fn(u32) -> View + Sync, Error> {
        let turntable = match self {
            Motion::Path { .. } | Motion::Camera(..) => None,
            Motion::Turntable(frames, axis) => {
                let (camera, _) = given.camera(mesh, size.0, size.1)?;
                let Some(target) = given.pivot(&camera, mesh) else {
                    let what = "--turntable: the scene's centre does not lie before the camera, so that it cannot turn \
                                about it: give --eye and --target, the point to turn about";
                    return Err(Error::Usage(what.into()));
                };
                // The direction up in the picture of a camera that is tilted is not the scene's.
                let axis = axis.or(own.up.filter(|_| !own.direction_only)).unwrap_or(DVec3::Y);
                Some(Turntable { eye: camera.eye, target, axis, up: given.up.unwrap_or(axis), frames: *frames })
            }
        };
        Ok(move |frame| {
            let view = match (self, turntable) {
                (Motion::Path { path, .. }, _) => path.view(frame),
                // The flags may give another lens.
                (Motion::Camera(motion, fps), _) => {
                    View { lens: None, ..motion.view(f64::from(frame) / fps).unwrap_or_default() }
                }
                (_, Some(turntable)) => turntable.view(frame),
                _ => View::default(),
            };
            View { up: view.up.or(given.up), lens: view.lens.or(given.lens), near: given.near, far: given.far, ..view }
        })
    }

    /// Returns whether the motion tells the field of view.
    pub(super) fn has_lens(&self) -> bool {
        matches!(self, Motion::Path { path, .. } if path.view(0).lens.is_some())
    }
}

/// The error of a file that holds no path.
fn no_path(file: &Path, what: &dyn Display) -> Error {
    Error::Input { path: file.into(), what: format!("no camera path: {what}") }
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
    let keys = keys.iter().enumerate().map(|(i, value)| {
        let Value::Object(table) = value else { return Err(format!("key {i} is no object")) };
        known(table, &FIELDS.map(|field| field.name), &format!("key {i}"))?;
        key(i, |field| {
            let Some(value) = table.get(field.name) else { return Ok(None) };
            let entries = if field.is_point { value.as_array().map(Vec::as_slice) } else { Some(from_ref(value)) };
            let numbers = entries.and_then(|entries| entries.iter().map(Value::as_f64).collect::<Option<Vec<_>>>());
            let form = if field.is_point { "a list of three numbers" } else { "a number" };
            let refuse = || format!("{} of key {i} is not {form}", field.name);
            numbers.filter(|numbers| numbers.len() == field.columns().len()).map(Some).ok_or_else(refuse)
        })
    });
    Ok(Found { keys: keys.collect::<Result<_, _>>()?, interpolation: interpolation.transpose()?, fps })
}

/// What a key holds.
struct Field {
    name: &'static str,
    /// Whether it is a point or a direction: three numbers, and three columns of a table.
    is_point: bool,
    required: bool,
}

const FIELDS: [Field; 5] = [
    Field { name: "time", is_point: false, required: true },
    Field { name: "eye", is_point: true, required: true },
    Field { name: "target", is_point: true, required: true },
    Field { name: "up", is_point: true, required: false },
    Field { name: "fov_y", is_point: false, required: false },
];

impl Field {
    /// The names of its columns in a table.
    fn columns(&self) -> Vec<String> {
        match self.is_point {
            true => ["x", "y", "z"].map(|axis| format!("{}_{axis}", self.name)).into(),
            false => vec![self.name.into()],
        }
    }
}

/// Makes the key of this number. `numbers` returns those of a field, as many as it has, or `None` if the key lacks it.
fn key(i: usize, numbers: impl Fn(&Field) -> Result<Option<Vec<f64>>, String>) -> Result<Key, String> {
    let mut found = [None; FIELDS.len()];
    for (field, found) in FIELDS.iter().zip(&mut found) {
        // A single number stands in x.
        let numbers = numbers(field)?;
        *found = numbers.map(|n| DVec3::new(n[0], n.get(1).map_or(0.0, |&y| y), n.get(2).map_or(0.0, |&z| z)));
        if field.required && found.is_none() {
            return Err(format!("key {i} has no {}", field.name));
        }
    }
    let [time, eye, target, up, fov_y] = found;
    let given = Option::unwrap_or_default;
    let (time, eye, target) = (given(time).x, given(eye), given(target));
    Ok(Key { time, eye, target, up, fov_y: fov_y.map(|degrees| degrees.x.to_radians()) })
}

/// Refuses names that mean nothing, which are likely to be mistyped.
fn known(table: &Map<String, Value>, names: &[&str], what: &str) -> Result<(), String> {
    match table.keys().find(|name| !names.contains(&name.as_str())) {
        Some(name) => Err(format!("{what} has \"{name}\", which is not one of {}", names.join(", "))),
        None => Ok(()),
    }
}

fn of_csv(text: &str) -> Result<Found, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    if let Some(name) = header.iter().find(|name| !FIELDS.iter().any(|f| f.columns().iter().any(|c| c == name))) {
        let columns = FIELDS.iter().map(|field| match field.required {
            true => format!(",{}", field.columns().join(",")),
            false => format!("[,{}]", field.columns().join(",")),
        });
        let columns: String = columns.collect();
        return Err(format!(
            "its first line must be {}, and holds '{name}'; or give JSON",
            columns.trim_start_matches(',')
        ));
    }
    let at = |name: &String| header.iter().position(|column| column == name);
    let mut places = Vec::new();
    for field in &FIELDS {
        let columns = field.columns();
        let found: Vec<_> = columns.iter().filter_map(at).collect();
        if field.required
            && let Some(name) = columns.iter().find(|name| at(name).is_none())
        {
            return Err(format!("its first line lacks the column {name}"));
        }
        if !found.is_empty() && found.len() < columns.len() {
            return Err(format!("its first line must have all of {}, or none", listed(&columns)));
        }
        places.push((field.name, columns, found));
    }
    let mut found = Found::default();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|e| e.to_string())?;
        let made = key(i, |field| {
            let Some((_, names, places)) = places.iter().find(|place| place.0 == field.name) else { return Ok(None) };
            let numbers = names.iter().zip(places).map(|(name, &at)| {
                let text = record.get(at).unwrap_or_default();
                text.parse::<f64>().map_err(|_| format!("{name} of key {i} is '{text}', which is not a number"))
            });
            let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
            Ok((!numbers.is_empty()).then_some(numbers))
        });
        found.keys.push(made?);
    }
    Ok(found)
}

/// Lists names as a sentence does.
fn listed(names: &[String]) -> String {
    match names {
        [names @ .., last] if !names.is_empty() => format!("{} and {last}", names.join(", ")),
        _ => names.concat(),
    }
}
