//! `hbao render`: renders a scene to an image and, on request, writes every intermediate image too.

use super::flags::{self, Flags, Opened};
use super::folder::MadeFolder;
use super::poster::{self, Poster};
use super::session::{open_context, samples_given, timings};
use super::tile::{self, Region, Tile};
use super::unmeant;
use crate::picture::{self, FileFormat, ImageKind, Kept};
use crate::terminal::say;
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::context::Context;
use hbao::image::Outputs;
use hbao::settings::Settings;
use hbao::{Apply, Error, Pipeline, Request, size_limit};
use std::path::PathBuf;

pub(super) const APPLY: [(&str, Apply); 2] = [("all", Apply::All), ("ambient", Apply::Ambient)];

const EXPLANATION: &str = "\
Each image also holds the settings that it was made with, and the name of the scene's file without its folder: a PNG in
the text chunk 'hbao', an EXR in the attribute 'hbao'. --settings reads them back, and --no-metadata leaves them out.

Examples:
  hbao render -o cornell.png
  hbao render -o ao.exr --show ao --size 800x600 --radius 80 --directions 16 --steps 16
  hbao render -o left.png --eye -200,300,-600 --target 278,273,280 --fov-y 50
  hbao render -o plan.png --eye 278,1000,280 --target 278,0,280 --up 0,0,1 --ortho 600 --near 500 --radius 400
  hbao render -o final.png --dump images --timings times.json
  hbao render -o poster.png --size 30000x20000 --radius 40 --blur 0
  hbao render -o poster-1-0.png --size 30000x20000 --tile 1/4,0/3
  hbao render -o - > cornell.png";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let shows = picture::names().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
    let applies = APPLY.map(|(name, _)| name).join(", ");
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let outputs = [
        output.value_parser(value_parser!(PathBuf)).help(flags::IMAGE_HELP),
        flags::valued("show", "IMAGE", format!("The image that is written to OUT [{shows}; default: final]")),
        flags::valued("apply", "PART", format!("The light that ambient occlusion darkens [{applies}; default: all]")),
        flags::path("dump", "DIR", "Write every intermediate image into this folder, which is created if needed"),
        flags::path("timings", "FILE.json", "Write the time of each pass that the images need, in milliseconds"),
        flags::no_metadata(),
    ];
    Command::new("render")
        .about("Render a scene with ambient occlusion")
        .args(outputs.map(|arg| arg.help_heading("Output")))
        .args(flags::arguments())
        .arg(tile::argument().help_heading("Camera"))
        .arg(poster::argument().help_heading("Output"))
        .after_help(format!("The images of --show:\n{}\n{EXPLANATION}", images_in_words()))
}

/// Returns the part of the help text that explains the images of `--show`. Images with the same explanation share an
/// entry.
fn images_in_words() -> String {
    let mut explained: Vec<(String, &str)> = Vec::new();
    for (name, image) in picture::names() {
        match explained.iter_mut().find(|(_, help)| *help == image.help) {
            Some((names, _)) => *names += &format!(", {name}"),
            None => explained.push((name.into(), image.help)),
        }
    }
    let lines = explained.iter().map(|(names, help)| {
        let help = help.replace('\n', &format!("\n{:16}", ""));
        format!("  {names:<14}{help}\n")
    });
    lines.collect()
}

/// The images and files that the user asked for.
struct Wanted {
    output: PathBuf,
    format: FileFormat,
    show: &'static ImageKind,
    /// The name of `show`.
    shown: &'static str,
    apply: Apply,
    dump: Option<PathBuf>,
    timings: Option<PathBuf>,
}

impl Wanted {
    fn read(matches: &ArgMatches) -> Result<Wanted, Error> {
        // Removes a trailing separator or dot, which does not change the folder that a path names.
        let folder = |path: &PathBuf| path.components().collect::<PathBuf>();
        let (output, format) = flags::read_image_output(matches)?;
        let names: Vec<_> = picture::names().map(|(name, image)| (name, (name, image))).collect();
        let (shown, show) = flags::word("show", flags::text(matches, "show").unwrap_or("final"), &names)?;
        Ok(Wanted {
            output,
            format,
            show,
            shown,
            apply: flags::word("apply", flags::text(matches, "apply").unwrap_or("all"), &APPLY)?,
            dump: matches.get_one::<PathBuf>("dump").map(folder),
            timings: flags::path_of(matches, "timings", "json")?,
        })
    }

    /// Returns the images of `--dump`, each with the path that it is written to.
    fn dumped(&self) -> impl Iterator<Item = (PathBuf, &'static ImageKind)> {
        self.dump.iter().flat_map(|folder| picture::dumped().map(|(name, image)| (folder.join(name), image)))
    }

    /// Returns every image that is written.
    fn images(&self) -> impl Iterator<Item = &'static ImageKind> {
        [self.show].into_iter().chain(self.dumped().map(|(_, image)| image))
    }

    /// Returns the path of every file that is written.
    fn paths(&self) -> impl Iterator<Item = PathBuf> {
        self.dumped().map(|(path, _)| path).chain([self.output.clone()]).chain(self.timings.clone())
    }

    fn request(&self) -> Request {
        Request { timings: self.timings.is_some(), ..picture::request(self.images(), self.apply) }
    }

    /// Returns why a flag changes nothing that is written, or `None` if it does change something.
    fn without_effect(&self, flag: &str, settings: &Settings) -> Option<String> {
        if flag == "apply" {
            return self.request().composite.is_none().then(|| "unless --show is final".into());
        }
        if self.images().any(|image| image.is_decided_by(flag, settings)) {
            return None;
        }
        Some(settings.idle(flag).map_or_else(|| format!("with --show {}", self.shown), |idle| idle.to_string()))
    }

    /// Refuses what cannot be written in tiles.
    fn check_poster(&self, reason: &str) -> Result<(), Error> {
        let as_exr = if self.shown == "depth" { ", as EXR" } else { "" };
        let refuse = |what: &str| {
            Err(Error::Usage(format!(
                "{reason}, so the image is rendered in tiles, and {what}: render its parts by --tile instead{as_exr}"
            )))
        };
        if self.format == FileFormat::Exr {
            return refuse("an EXR is written in one piece");
        }
        if self.shown == "depth" {
            return refuse("the greys of a PNG of depth depend on the whole image");
        }
        if self.dump.is_some() || self.timings.is_some() {
            return refuse("--dump and --timings are of an image in one piece");
        }
        Ok(())
    }

    /// Returns the settings to render with. The blur is turned off if no written image needs it.
    fn needed(&self, settings: Settings) -> Settings {
        let blur = if self.images().all(ImageKind::is_unblurred) { 0 } else { settings.blur };
        Settings { blur, ..settings }
    }
}

/// Renders and writes the files. The cheap checks come first: the flags, then the files to be written, then the scene,
/// and at last OpenGL.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    render(matches, None)
}

/// Does what the verb does with these arguments, in a context that is open already.
#[cfg(feature = "view")]
pub(super) fn run_in(context: &Context, arguments: &[std::ffi::OsString]) -> Result<(), Error> {
    let matches = command().args_override_self(true).try_get_matches_from(arguments);
    let matches = matches.map_err(|error| Error::Usage(error.kind().to_string()))?;
    render(&matches, Some(context))
}

fn render(matches: &ArgMatches, open: Option<&Context>) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let wanted = Wanted::read(matches)?;
    let tile = Tile::read(matches, flags.size)?;
    if tile.is_some() && wanted.shown == "depth" && wanted.format == FileFormat::Png {
        say("the greys of a PNG of depth are those of this tile alone: write EXR to put tiles together");
    }
    let folder = || wanted.dump.as_deref().map(MadeFolder::ensure).transpose();
    {
        // The folder is removed again at once, so that an interrupt while rendering leaves no empty folder.
        let _rehearsal = folder()?;
        Outputs::check(wanted.paths())?;
    }

    let opened = flags.open()?;
    let Opened { scene, settings, camera, notices: told, .. } = &opened;
    tile.iter().try_for_each(|tile| tile.check(camera, settings))?;

    let opened_here = if open.is_none() { Some(open_context(flags.backend)?) } else { None };
    let Some(context) = open.or(opened_here.as_ref()) else { return Ok(()) };
    let apply = flags::text(matches, "apply").map(|_| "apply");
    let idle = flags
        .knobs_given()
        .chain(apply)
        .filter_map(|flag| Some(format!("--{flag} has no effect {}", wanted.without_effect(flag, settings)?)));
    idle.chain(told.iter().cloned()).for_each(|notice| say(&notice));

    let resolved = wanted.needed(settings.resolved(scene.mesh.diagonal()));
    let side = poster::read(matches)?;
    let ((width, height), limit) = (flags.size, size_limit(context.gl()));
    if tile.is_none() && (side.is_some() || width.max(height) > limit) {
        wanted.check_poster(&match side {
            Some(side) => format!("--tile-size {side} is given"),
            None => format!("--size {width}x{height} is above {limit}x{limit}, which this driver takes"),
        })?;
        // Its size does not matter: it gets that of each tile.
        let mut pipeline = Pipeline::new(context.gl(), (8, 8), &resolved, wanted.request())?;
        tell(&pipeline, settings);
        let origin = origin(settings, flags.seen(camera), wanted.apply, context, pipeline.samples());
        let text = flags::stored_text(matches, &origin);
        let (request, show) = (wanted.request(), wanted.show);
        let pipeline = &mut pipeline;
        return Poster { context, flags: &flags, opened: &opened, settings: &resolved, request, show, side, pipeline }
            .write(&wanted.output, &text);
    }
    let region = match &tile {
        Some(tile) => {
            let mut depths = tile::depths(context.gl(), &resolved, wanted.request())?;
            tile.region(context.gl(), &scene.mesh, camera, &resolved, depths.as_mut())?
        }
        None => Region { size: flags.size, camera: *camera, kept: None },
    };
    let mut pipeline = Pipeline::new(context.gl(), region.size, &resolved, wanted.request())?;
    pipeline.restrict(region.kept.as_ref().map(Kept::part));
    tell(&pipeline, settings);
    let mut times = pipeline.render(&scene.mesh, &region.camera)?;
    if wanted.timings.is_some() {
        // Drivers compile shaders in the first frame, and compiling is not part of a pass's time.
        times = pipeline.render(&scene.mesh, &region.camera)?;
    }

    let (depth, kept) = (pipeline.depth()?, region.kept.as_ref());
    let nothing = || match kept {
        Some(_) => Some("no surface lies in this tile".into()),
        None => (!opened.empty).then(|| unmeant::empty(&flags, &scene.mesh, camera)),
    };
    let unmeant = unmeant::of(&pipeline, &depth, region.camera.projection, &resolved, kept, nothing)?;
    unmeant.iter().for_each(|notice| say(notice));
    if std::ptr::eq(wanted.show, &raw const picture::EXITS) && !resolved.method.reads("exit") {
        say(&format!("{} {}: --show exits shows visibility alone", resolved.method.name(), picture::NEVER_EXITS));
    }

    let mut render = flags.seen(camera);
    if let Some(tile) = &tile {
        render.insert("tile".into(), tile.value().into());
    }
    let origin = origin(settings, render, wanted.apply, context, pipeline.samples());
    let text = flags::stored_text(matches, &origin);
    // All images are encoded before the first file is written, so that an interrupt is unlikely to leave only some of
    // the files.
    let encode = |image: &ImageKind, format| match &region.kept {
        Some(kept) => image.encode_part(&pipeline, &resolved, format, &text, kept),
        None => image.encode(&pipeline, &resolved, format, &text),
    };
    let mut files = vec![(wanted.output.clone(), encode(wanted.show, wanted.format)?)];
    for (path, image) in wanted.dumped() {
        let format = FileFormat::of(&path)?;
        files.push((path, encode(image, format)?));
    }
    files.extend(
        wanted.timings.clone().map(|path| {
            (path, timings(context, region.size, (settings.msaa, pipeline.samples()), &times).into_bytes())
        }),
    );
    // The folder must outlive the files that are staged inside it.
    let made = folder()?;
    let mut outputs = Outputs::new();
    files.iter().try_for_each(|(path, bytes)| outputs.stage(path, bytes))?;
    outputs.commit()?;
    if let Some(made) = made {
        made.keep();
    }
    Ok(())
}

/// Reports what the driver gives in place of what the settings ask for.
fn tell(pipeline: &Pipeline, settings: &Settings) {
    pipeline.notices().iter().for_each(|notice| say(notice));
    samples_given(settings.msaa, pipeline.samples()).iter().for_each(|notice| say(notice));
}

/// Returns the metadata of an image: the text of a settings file, followed by the table `render` with everything else
/// that determines the image, which [`Settings::read_toml`] skips. The backend is left out. A driver renders the same
/// image by EGL and by OSMesa, and without the backend the two files are equal to the byte.
pub(super) fn origin(
    settings: &Settings,
    mut render: toml::Table,
    apply: Apply,
    context: &Context,
    samples: u32,
) -> String {
    let mut put = |key: &str, value: toml::Value| render.insert(key.into(), value);
    let apply = APPLY.iter().find(|&&(_, one)| one == apply).map_or("", |&(name, _)| name);
    put("apply", apply.into());
    put("samples", i64::from(samples).into());
    put("renderer", context.renderer().into());
    put("opengl", context.version().into());

    flags::with_origin(settings, render)
}
