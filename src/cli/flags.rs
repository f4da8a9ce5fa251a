//! The flags that verbs share: the scene, the camera, and every knob of [`KNOBS`].
//!
//! clap accepts every value as text, and this module converts the text. In this way each message is one line that names
//! the flag and the values it accepts, and a value may begin with a minus.

use super::camera;
pub(crate) use super::values::{number, path, signed, text, valued, word};
use crate::picture::FileFormat;
use crate::terminal::{Loading, keep_stdout_for_a_file};
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use glam::DVec3;
use hbao::Error;
use hbao::context::Backend;
use hbao::image::{Outputs, exr, metadata, png};
use hbao::scene::{CORNELL_BOX, Camera, Lens, NAVE, NOTHING_IN_VIEW, Scene, View};
use hbao::settings::{KNOBS, Kind, Knob, Method, MethodBlur, Radius, Settings};
use std::ffi::OsString;
use std::fs::File;
use std::io::{ErrorKind, IsTerminal as _, Read as _};
use std::path::{Path, PathBuf};

/// The longest settings file that is read, in bytes. Real ones are far shorter; a device such as /dev/zero has no end.
const LONGEST_SETTINGS: u64 = 1 << 20;
/// The message for a file longer than [`LONGEST_SETTINGS`].
const TOO_LONG: &str = "too long for settings: more than 1 MiB";

/// The help of the flag for an image to write.
pub(crate) const IMAGE_HELP: &str =
    "The image to write, OUT.png or OUT.exr, which holds floats; - writes a PNG to standard output";

/// The values of the shared flags, as they were read from the command line.
pub(crate) struct Flags {
    /// The name of a built-in scene, or the path of a file.
    pub(crate) scene: OsString,
    /// Width and height in pixels.
    pub(crate) size: (u32, u32),
    /// The parts of the camera that flags set. The scene's own camera supplies the rest.
    pub(crate) view: View,
    /// Notices about the flags of the camera.
    pub(crate) notices: Vec<String>,
    /// The name of the scene's camera to look through.
    camera: Option<String>,
    /// Which library creates the OpenGL context.
    pub(crate) backend: Backend,
    knobs: KnobFlags,
}

/// The settings that flags give, and those of the settings file.
pub(crate) struct KnobFlags {
    file: Option<(PathBuf, String)>,
    knobs: Vec<(&'static Knob, String)>,
}

/// The scene, the settings and the camera that the shared flags describe.
pub(crate) struct Opened {
    pub(crate) scene: Scene,
    /// The settings. The radius may still be a percentage of the scene's size.
    pub(crate) settings: Settings,
    pub(crate) camera: Camera,
    /// Notices about the scene's files and the camera.
    pub(crate) notices: Vec<String>,
    /// Whether the notices say that nothing is in view.
    pub(crate) empty: bool,
}

/// Returns the path that a flag gives, if the flag was given. The path must have the extension `wanted`, or be `-` for
/// standard output, or lead to a device or pipe. In this way no model or settings file is overwritten by mistake.
pub(crate) fn path_of(matches: &ArgMatches, name: &str, wanted: &str) -> Result<Option<PathBuf>, Error> {
    let Some(path) = matches.get_one::<PathBuf>(name) else { return Ok(None) };
    let right = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted));
    if !right && !Outputs::is_stream(path) {
        return Err(Error::Usage(format!("--{name} {}: its name must end in .{wanted}", path.display())));
    }
    if Outputs::is_standard_output(path) {
        keep_stdout_for_a_file();
    }
    Ok(Some(path.clone()))
}

/// Reads the value of `--output` for an image. Its format follows from its name.
pub(crate) fn read_image_output(matches: &ArgMatches) -> Result<(PathBuf, FileFormat), Error> {
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let format = FileFormat::of(&output)?;
    if Outputs::is_standard_output(&output) {
        if std::io::stdout().is_terminal() {
            let what = "standard output is a terminal, which cannot show an image: redirect it, as in -o - > a.png";
            return Err(Error::Usage(format!("--output {}: {what}", output.display())));
        }
        keep_stdout_for_a_file();
    }
    Ok((output, format))
}

/// Makes the flag `--no-metadata`.
pub(crate) fn no_metadata() -> Arg {
    let arg = Arg::new("no-metadata").long("no-metadata").action(ArgAction::SetTrue).help_heading("Output");
    arg.help("Leave the settings and the program's name out of the images")
}

/// Returns the pairs of keyword and text that each image stores: none with `--no-metadata`.
pub(crate) fn stored_text<'a>(matches: &ArgMatches, origin: &'a str) -> Vec<(&'static str, &'a str)> {
    if matches.get_flag("no-metadata") { Vec::new() } else { metadata(origin).into() }
}

/// Reads the value of `--runs`.
pub(crate) fn read_runs(matches: &ArgMatches, default: usize) -> Result<usize, Error> {
    let Some(text) = text(matches, "runs") else { return Ok(default) };
    let runs = text.parse().ok().filter(|runs| (1..=1000).contains(runs));
    runs.ok_or_else(|| Error::Usage(format!("--runs: '{text}' is not a whole number from 1 to 1000")))
}

/// Makes the shared flags.
pub(crate) fn arguments() -> Vec<Arg> {
    let scene = format!(
        "A model (OBJ, PLY, STL, glTF, GLB), or a built-in scene, {CORNELL_BOX} or {NAVE} [default: {CORNELL_BOX}]"
    );
    let scene = Arg::new("scene").value_name("SCENE").value_parser(value_parser!(OsString)).help(scene);
    let mut all = vec![scene, size_argument()];
    all.extend(camera::arguments());
    all.extend(knob_arguments());
    all.push(backend_argument());
    all
}

/// Makes the flags of all settings, and that of the settings file.
pub(crate) fn knob_arguments() -> impl Iterator<Item = Arg> {
    let file = path(
        "settings",
        "FILE",
        "Read the settings above from a TOML file, or from an image that hbao wrote; flags override the file",
    );
    KNOBS.iter().map(knob_argument).chain([file.help_heading("Settings")])
}

/// Makes the flag `--size`.
pub(crate) fn size_argument() -> Arg {
    signed(
        "size",
        "WxH",
        "Width and height of the image in pixels [each from 1 to the driver's limit; default: 1600x1200]",
    )
}

/// Reads the value of `--size`.
pub(crate) fn read_size(matches: &ArgMatches) -> Result<(u32, u32), Error> {
    size(text(matches, "size").unwrap_or("1600x1200"))
}

/// Makes the flag `--backend`.
pub(crate) fn backend_argument() -> Arg {
    valued("backend", "BACKEND", {
        let names = Backend::NAMES.join(", ");
        format!("The library that creates the OpenGL context [{names}; default: auto]")
    })
}

/// Reads the value of `--backend`.
pub(crate) fn read_backend(matches: &ArgMatches) -> Result<Backend, Error> {
    text(matches, "backend").unwrap_or("auto").parse()
}

/// Makes the flag `--truth-rays`.
pub(crate) fn truth_rays() -> Arg {
    valued("truth-rays", "N", "Rays per pixel for ray-traced ambient occlusion [even, 2 to 65536; default: 256]")
}

/// Reads the value of `--truth-rays`.
pub(crate) fn read_truth_rays(matches: &ArgMatches) -> Result<u32, Error> {
    let Some(text) = text(matches, "truth-rays") else { return Ok(256) };
    let rays = text.trim().parse().ok().filter(|rays: &u32| (2..=65536).contains(rays) && rays.is_multiple_of(2));
    rays.ok_or_else(|| Error::Usage(format!("--truth-rays: '{text}' is not an even number from 2 to 65536")))
}

/// Returns the methods whose default for this setting differs from that of the default method, each with its own
/// default: `hbao-talk linear`.
fn own_defaults(knob: &'static Knob) -> impl Iterator<Item = String> {
    let of = move |method: Method| knob.text(&Settings::for_scene(method));
    // The setting `method` is left out: its value is the method's name, which always differs.
    let methods = Method::ALL.iter().filter(move |_| knob.name != "method");
    methods
        .filter(move |&&method| of(method) != of(Method::default()))
        .map(move |&method| format!("{} {}", method.name(), of(method)))
}

/// Describes the default depth sigma of the blur as a share of R, first that of the default method, then those of
/// methods that differ from it: `R/4; hbao-view R/16`. `others` is added at the end.
fn own_sigmas(others: String) -> String {
    let share = |method: Method| format!("R/{}", 1.0 / method.facts().depth_sigma);
    let usual = share(Method::default());
    let methods = Method::ALL.iter().filter(|method| method.facts().blur == MethodBlur::Gaussian);
    let own = methods.filter(|&&method| share(method) != usual);
    let own: String = own.map(|&method| format!("; {} {}", method.name(), share(method))).collect();
    usual + &own + &others
}

fn knob_argument(knob: &'static Knob) -> Arg {
    let takes = if knob.kind == Kind::Switch { "or =true, =false".into() } else { knob.kind.to_string() };
    let default = knob.text(&Settings::for_scene(Method::default()));
    let own_blur = Method::ALL.iter().filter(|method| method.facts().blur == MethodBlur::Crysis);
    let own_blur = own_blur.map(|method| method.name()).collect::<Vec<_>>().join(", ");
    let default = match (knob.name, default.strip_suffix(".0").unwrap_or(&default)) {
        ("radius", default) => format!("the scene's own, or {default}"),
        ("blur", default) => format!("{default}; {own_blur} always uses its own 4x4 blur, which 0 turns off"),
        ("blur-depth-sigma", "") => own_sigmas(format!("; for {own_blur} a share of the depth")),
        ("ssao-curve", "") => "on; off with --ssao-normals on".into(),
        ("msaa", default) => format!("{default}, if the driver supports it"),
        (_, default) => own_defaults(knob).fold(default.into(), |text: String, own| text + "; " + &own),
    };
    let help = format!("{} [{takes}; default: {default}]", knob.help);
    let arg = if knob.kind == Kind::Length { signed } else { valued };
    let arg = arg(knob.name, knob.value, help).help_heading("Settings");
    // A switch also accepts a value, so that a flag can turn off a setting that a settings file turns on.
    let switch = |arg: Arg| arg.num_args(0..=1).require_equals(true).default_missing_value("true");
    if knob.kind == Kind::Switch { switch(arg).value_name("BOOL") } else { arg }
}

impl Flags {
    /// Reads and checks all shared flags. The settings file is the only file that it opens.
    pub(crate) fn read(matches: &ArgMatches) -> Result<Flags, Error> {
        let size = read_size(matches)?;
        let (view, notices) = camera::read(matches, size)?;
        let flags = Flags {
            scene: matches.get_one("scene").cloned().unwrap_or_else(|| CORNELL_BOX.into()),
            size,
            view,
            notices,
            camera: text(matches, "camera").map(String::from),
            backend: read_backend(matches)?,
            knobs: KnobFlags::read(matches)?,
        };
        flags.knobs.own_settings(Settings::for_scene)?.validate()?;
        Ok(flags)
    }

    /// Opens the scene, and takes the scene's own values for the camera and the settings that neither flags nor the
    /// settings file give.
    pub(crate) fn open(&self) -> Result<Opened, Error> {
        let (scene, settings) = self.open_scene()?;
        let (camera, of_camera) = self.view.or(&scene.view).camera(&scene.mesh, self.size.0, self.size.1)?;
        let empty = of_camera.iter().any(|notice| notice.contains(NOTHING_IN_VIEW));
        let notices = [self.notices.as_slice(), &scene.notices, &of_camera].concat();
        Ok(Opened { scene, settings, camera, notices, empty })
    }

    /// Opens the scene, and returns it with the settings. The radius may still be a percentage of the scene's size.
    pub(crate) fn open_scene(&self) -> Result<(Scene, Settings), Error> {
        let loading = Loading::new();
        let mut scene = Scene::open_with(&self.scene, &|done, total| loading.show(done, total))?;
        drop(loading);
        if let Some(name) = &self.camera {
            scene.view = scene.camera(name)?.clone();
        }
        let own = self.knobs.defaults(Settings::for_scene)?;
        let radius = scene.radius.map_or(own.radius, Radius::Units);
        let settings = self.knobs.settings(Settings { radius, ..own })?;
        if matches!(settings.radius, Radius::Percent(_)) && scene.mesh.diagonal() == 0.0 {
            let what =
                "all its points coincide, so a radius in percent of its size would be 0: give --radius in scene units";
            return Err(Error::Input { path: self.scene.clone().into(), what: what.into() });
        }
        Ok((scene, settings))
    }

    /// Returns the scene, the size and the camera in the form in which they are stored in the metadata of images.
    pub(crate) fn seen(&self, camera: &Camera) -> toml::Table {
        self.seen_through(camera, self.view.lens)
    }

    /// The same for a camera whose lens is not that of the flags.
    pub(crate) fn seen_through(&self, camera: &Camera, lens: Option<Lens>) -> toml::Table {
        let numbers = |v: DVec3| toml::Value::from(v.to_array().to_vec());
        let mut render = toml::Table::new();
        let mut put = |key: &str, value: toml::Value| render.insert(key.into(), value);
        put("version", env!("CARGO_PKG_VERSION").into());
        // The name alone: the same scene in another folder gives the same file, and the file does not tell the folder.
        let scene = Path::new(&self.scene);
        let name = scene.file_name().unwrap_or(scene.as_os_str());
        put("scene", name.to_string_lossy().into_owned().into());
        put("size", vec![i64::from(self.size.0), i64::from(self.size.1)].into());
        put("eye", numbers(camera.eye));
        put("target", numbers(camera.eye + camera.far * camera.forward));
        put("up", numbers(camera.up));
        let [half_width, half_height] = camera.projection.half_extents();
        // Extents that are those of a field of view or a height are written as these, so that the file is the same.
        let symmetric = camera.projection.middle_at(1.0) == [0.0; 2]
            && half_width == half_height * (f64::from(self.size.0) / f64::from(self.size.1));
        match lens {
            Some(Lens::Frustum(edges)) if !symmetric => put("frustum", edges.to_vec().into()),
            Some(Lens::OrthoFrustum(edges)) if !symmetric => put("ortho-frustum", edges.to_vec().into()),
            _ if camera.projection.is_perspective() => {
                put("fov-y", typed((2.0 * half_height.atan()).to_degrees()).into())
            }
            _ => put("ortho", (2.0 * half_height).into()),
        };
        put("near", camera.near.into());
        put("far", camera.far.into());
        render
    }

    /// Returns the names of the settings that flags set.
    pub(crate) fn knobs_given(&self) -> impl Iterator<Item = &'static str> {
        self.knobs.given()
    }

    /// Returns the names of the settings that flags or the settings file set.
    pub(crate) fn knobs_pinned(&self) -> Vec<&'static str> {
        let file: toml::Table = self.knobs.file.as_ref().and_then(|(_, text)| text.parse().ok()).unwrap_or_default();
        let given: Vec<_> = self.knobs_given().collect();
        let names = KNOBS.iter().map(|knob| knob.name);
        names.filter(|name| given.contains(name) || file.contains_key(*name)).collect()
    }
}

impl KnobFlags {
    /// Reads the flags of all settings, and the settings file.
    pub(crate) fn read(matches: &ArgMatches) -> Result<KnobFlags, Error> {
        let given = |knob: &'static Knob| text(matches, knob.name).map(|text| (knob, text.to_string()));
        Ok(KnobFlags {
            file: matches.get_one::<PathBuf>("settings").map(|path| settings_file(path)).transpose()?,
            knobs: KNOBS.iter().filter_map(given).collect(),
        })
    }

    /// Returns the defaults of the method that is chosen: some methods have defaults of their own. `of` tells them:
    /// [`Settings::for_scene`], or [`Settings::for_method`] where there is no scene.
    fn defaults(&self, of: fn(Method) -> Settings) -> Result<Settings, Error> {
        Ok(of(self.settings(Settings::default())?.method))
    }

    /// Returns the settings, without a scene's own values.
    pub(crate) fn own_settings(&self, of: fn(Method) -> Settings) -> Result<Settings, Error> {
        self.settings(self.defaults(of)?)
    }

    /// Returns the settings. The settings file overrides `base`, and flags override both.
    fn settings(&self, mut base: Settings) -> Result<Settings, Error> {
        if let Some((path, text)) = &self.file {
            base.read_toml(text).map_err(|what| Error::Input { path: path.clone(), what })?;
        }
        for (knob, text) in &self.knobs {
            knob.set(&mut base, text).map_err(|e| Error::Usage(format!("--{e}")))?;
        }
        Ok(base)
    }

    /// Returns the names of the settings that flags set.
    pub(crate) fn given(&self) -> impl Iterator<Item = &'static str> {
        self.knobs.iter().map(|(knob, _)| knob.name)
    }
}

/// Returns the text of a settings file with these settings, followed by the table `[render]`. The table holds what else
/// an image was made with, and [`Settings::read_toml`] skips it.
pub(crate) fn with_origin(settings: &Settings, render: toml::Table) -> String {
    let render = toml::Table::from_iter([("render".to_string(), toml::Value::from(render))]);
    format!("{}\n{render}", settings.to_toml())
}

/// Rounds degrees to what the user typed. A field of view of 50 degrees is stored as a tangent; converted back to
/// degrees, it is 49.99999999999999.
fn typed(degrees: f64) -> f64 {
    (degrees * 1e10).round() / 1e10
}

fn size(text: &str) -> Result<(u32, u32), Error> {
    let side = |text: &str| text.parse().ok().filter(|&pixels: &u32| pixels > 0);
    let size = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    size.ok_or_else(|| {
        Error::Usage(format!("--size: '{text}' is not WxH, two whole numbers above 0 such as 1600x1200"))
    })
}

fn settings_file(path: &Path) -> Result<(PathBuf, String), Error> {
    let refused = |what: String| Error::Input { path: path.into(), what };
    let unreadable = |what: String| refused(format!("{what}: give a TOML file, or a PNG or EXR that hbao wrote"));
    let cannot = |e: std::io::Error| unreadable(format!("it cannot be read, {}", e.kind()));
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(unreadable("it is a folder".into())),
        Ok(_) => {}
        Err(e) if e.kind() == ErrorKind::NotFound => return Err(unreadable("no such file".into())),
        Err(e) => return Err(cannot(e)),
    }
    // An image that hbao wrote holds the settings that it was made with.
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let texts = match extension.as_deref() {
        Some("png") => Some(png::read_text(path)?),
        Some("exr") => Some(exr::read_text(path)?),
        _ => None,
    };
    if let Some(texts) = texts {
        let text = texts.into_iter().find(|(keyword, _)| keyword == "hbao").map(|(_, text)| text);
        let text = text.ok_or_else(|| {
            refused("no settings in it: hbao did not write this image, or wrote it with --no-metadata".into())
        })?;
        if text.len() as u64 > LONGEST_SETTINGS {
            return Err(refused(TOO_LONG.into()));
        }
        return Ok((path.into(), text));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(cannot)?;
    file.take(LONGEST_SETTINGS + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > LONGEST_SETTINGS {
        return Err(refused(TOO_LONG.into()));
    }
    let text = String::from_utf8(bytes).map_err(|_| refused("no settings file: it is not text in UTF-8".into()))?;
    Ok((path.into(), text))
}
