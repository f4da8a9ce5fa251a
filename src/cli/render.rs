//! `hbao render`: a scene to an image, and on request to every image on the way to it.

use super::flags::{self, Flags, Opened};
use super::folder::MadeFolder;
use super::session::open_context;
use crate::picture::{FileFormat, Show, encode};
use crate::terminal::say;
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::context::Context;
use hbao::image::{Outputs, exr, metadata};
use hbao::scene::Camera;
use hbao::settings::{Method, Settings};
use hbao::{Apply, Error, PassTime, Pipeline, Request, rotation_tile};
use serde_json::json;
use std::path::PathBuf;

const APPLY: [(&str, Apply); 2] = [("all", Apply::All), ("ambient", Apply::Ambient)];

/// The files of `--dump`, beside `rotation.exr`.
const DUMPED: [(&str, Show); 6] = [
    ("depth.exr", Show::Depth),
    ("normals.exr", Show::Normals),
    ("ao_raw.exr", Show::AoRaw),
    ("ao.exr", Show::Ao),
    ("color.png", Show::Color),
    ("edges.png", Show::Edges),
];
const ROTATION: &str = "rotation.exr";

const EXAMPLES: &str = "\
What --show writes:
  final, color  RGB; in an EXR the 8-bit values over 255
  ao, ao-raw    visibility after and before the blur, 1 is open: grey, or Y in an EXR
  depth         eye-space z: grey from 0, the nearest surface in view, to 254, the farthest, and 255 background;
                in an EXR Y in scene units, +infinity for background
  normals       in eye space, x right, y up, z forward: (n + 1)/2 as RGB, background black; in an EXR R, G, B are
                x, y, z, and 0, 0, 0 background
  edges         255 (in an EXR 1) on pixels of several surfaces, 0 elsewhere: 0 everywhere without MSAA

Each file holds the settings that made it, which --settings reads: in a PNG as the text 'hbao', in an EXR as the
attribute 'hbao'.

Examples:
  hbao render -o cornell.png
  hbao render -o ao.exr --show ao --size 800x600 --radius 80 --directions 16 --steps 16
  hbao render -o left.png --eye -200,300,-600 --target 278,273,280 --fov-y 50
  hbao render -o plan.png --eye 278,1000,280 --target 278,0,280 --up 0,0,1 --ortho 600 --near 500 --radius 400
  hbao render -o final.png --dump images --timings times.json";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let shows = Show::NAMES.map(|(name, _)| name).join(", ");
    let applies = APPLY.map(|(name, _)| name).join(", ");
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let outputs = [
        output.value_parser(value_parser!(PathBuf)).help("The image to write, OUT.png or OUT.exr"),
        flags::valued("show", "IMAGE", format!("What OUT shows [{shows}; default: final]")),
        flags::valued("apply", "PART", format!("Which light ambient occlusion darkens [{applies}; default: all]")),
        flags::path("dump", "DIR", "Write every intermediate image into this folder; made if it is missing"),
        flags::path("timings", "FILE.json", "Write what each pass took"),
    ];
    Command::new("render")
        .about("Render a scene with ambient occlusion")
        .args(outputs.map(|arg| arg.help_heading("Output")))
        .args(flags::arguments())
        .after_help(EXAMPLES)
}

/// What is to be written, and where.
struct Wanted {
    output: PathBuf,
    format: FileFormat,
    show: Show,
    apply: Apply,
    dump: Option<PathBuf>,
    timings: Option<PathBuf>,
}

impl Wanted {
    fn read(matches: &ArgMatches) -> Result<Wanted, Error> {
        // A trailing separator or dot says nothing more about a folder.
        let folder = |path: &PathBuf| path.components().collect::<PathBuf>();
        let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
        Ok(Wanted {
            format: FileFormat::of(&output)?,
            output,
            show: flags::word("show", flags::text(matches, "show").unwrap_or("final"), &Show::NAMES)?,
            apply: flags::word("apply", flags::text(matches, "apply").unwrap_or("all"), &APPLY)?,
            dump: matches.get_one::<PathBuf>("dump").map(folder),
            timings: flags::path_of(matches, "timings", "json")?,
        })
    }

    fn paths(&self) -> Vec<PathBuf> {
        let dumped = DUMPED.map(|(name, _)| name).into_iter().chain([ROTATION]);
        let dumped = self.dump.iter().flat_map(|folder| dumped.clone().map(|name| folder.join(name)));
        dumped.chain([self.output.clone()]).chain(self.timings.clone()).collect()
    }

    fn request(&self) -> Request {
        Request {
            gbuffer_only: !self.whole() && !matches!(self.show, Show::Final | Show::Ao | Show::AoRaw),
            composite: (self.show == Show::Final).then_some(self.apply),
            raw: self.show == Show::AoRaw || self.dump.is_some(),
            edges: self.show == Show::Edges || self.dump.is_some(),
            timings: self.timings.is_some(),
            ..Request::default()
        }
    }

    /// True where every pass is wanted: its image, or its time.
    fn whole(&self) -> bool {
        self.dump.is_some() || self.timings.is_some()
    }

    /// Why a flag changes nothing that is written, where it does not.
    fn without_effect(&self, flag: &str, settings: &Settings) -> Option<String> {
        if flag == "apply" {
            return (self.show != Show::Final).then(|| "unless --show is final".into());
        }
        if self.request().edges && decides_edges(flag, settings) {
            return None;
        }
        if let Some(idle) = settings.idle(flag) {
            return Some(idle.to_string());
        }
        if self.whole() {
            return None;
        }
        let matters = match (self.show, flag) {
            (Show::Final | Show::Ao, _) => true,
            (Show::AoRaw, _) => settings.blur == 0 || !flag.starts_with("blur") && flag != "edges",
            (_, "msaa") => true,
            (Show::Color, _) => flag == "normals",
            (Show::Depth, _) => flag == "depth-format",
            (Show::Normals, _) => flag == "normals" || flag == "normal-format",
            // What decides has been asked above.
            (Show::Edges, _) => false,
        };
        let show = Show::NAMES.iter().find(|&&(_, show)| show == self.show).map_or("", |&(name, _)| name);
        (!matters).then(|| format!("with --show {show}"))
    }
}

/// Whether a flag decides which pixels are edges: what the blur's depth sigma follows from does.
fn decides_edges(flag: &str, settings: &Settings) -> bool {
    match flag {
        "msaa" | "depth-format" | "method" | "blur-depth-sigma" => true,
        "radius" => settings.blur_depth_sigma.is_none() && settings.method != Method::Ssao,
        "ssao-samples" => settings.blur_depth_sigma.is_none() && settings.method == Method::Ssao,
        _ => false,
    }
}

/// Renders. Whatever can be found wrong is found before the next dearer step: flags, then files to be written, then
/// the scene, then OpenGL.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let wanted = Wanted::read(matches)?;
    let folder = || wanted.dump.as_deref().map(MadeFolder::ensure).transpose();
    {
        // Gone again at once, so that an interrupt while rendering leaves no empty folder.
        let _rehearsal = folder()?;
        Outputs::check(wanted.paths())?;
    }

    let Opened { scene, settings, camera, notices } = flags.open()?;

    let context = open_context(flags.backend)?;
    let apply = flags::text(matches, "apply").map(|_| "apply");
    let idle = flags
        .knobs_given()
        .chain(apply)
        .filter_map(|flag| Some(format!("--{flag} has no effect {}", wanted.without_effect(flag, &settings)?)));
    idle.chain(notices).for_each(|notice| say(&notice));

    let mut resolved = settings.resolved(scene.mesh.diagonal());
    if wanted.show == Show::AoRaw && !wanted.whole() {
        resolved.blur = 0; // nothing shows it
    }
    let mut pipeline = Pipeline::new(context.gl(), flags.size, &resolved, wanted.request())?;
    pipeline.notices().iter().for_each(|notice| say(notice));
    // Of the default nothing is said where the driver has as many.
    if flags.knobs_given().any(|flag| flag == "msaa") || pipeline.samples() != settings.msaa {
        say(&format!("msaa: asked for {}, given {}", settings.msaa, pipeline.samples()));
    }
    let mut times = pipeline.render(&scene.mesh, &camera)?;
    if wanted.timings.is_some() {
        // Drivers compile shaders when they first draw, which is not what a pass takes.
        times = pipeline.render(&scene.mesh, &camera)?;
    }

    let origin = origin(&settings, &flags, &camera, &wanted, &context, pipeline.samples());
    let text = metadata(&origin);
    // All is encoded before anything is written, so that an interrupt finds few moments with files under way.
    let mut files = vec![(wanted.output.clone(), encode(&pipeline, wanted.show, wanted.format, &text)?)];
    if let Some(folder) = &wanted.dump {
        for (name, show) in DUMPED {
            let path = folder.join(name);
            let bytes = encode(&pipeline, show, FileFormat::of(&path)?, &text)?;
            files.push((path, bytes));
        }
        files.push((folder.join(ROTATION), exr::encode(&rotation_tile(&resolved), &text)?));
    }
    files.extend(
        wanted.timings.clone().map(|path| {
            (path, timings(&context, flags.size, (settings.msaa, pipeline.samples()), &times).into_bytes())
        }),
    );
    // Lives longer than what is staged inside it.
    let made = folder()?;
    let mut outputs = Outputs::new();
    files.iter().try_for_each(|(path, bytes)| outputs.stage(path, bytes))?;
    outputs.commit()?;
    if let Some(made) = made {
        made.keep();
    }
    Ok(())
}

/// The settings as a settings file holds them, and in a table of its own, which [`Settings::read_toml`] passes over,
/// all else that the image follows from. The backend is not part of it: by EGL and by OSMesa, one driver renders the
/// same image, and the files are equal to the byte.
fn origin(
    settings: &Settings,
    flags: &Flags,
    camera: &Camera,
    wanted: &Wanted,
    context: &Context,
    samples: u32,
) -> String {
    let mut render = flags.seen(camera);
    let mut put = |key: &str, value: toml::Value| render.insert(key.into(), value);
    let apply = APPLY.iter().find(|&&(_, apply)| apply == wanted.apply).map_or("", |&(name, _)| name);
    put("apply", apply.into());
    put("samples", i64::from(samples).into());
    put("renderer", context.renderer().into());
    put("opengl", context.version().into());

    flags::with_origin(settings, render)
}

/// What `--timings` writes.
fn timings(context: &Context, size: (u32, u32), (asked, given): (u32, u32), times: &[PassTime]) -> String {
    let pass = |time: &PassTime| json!({ "name": time.name, "gpu_ms": time.gpu_ms, "wall_ms": time.wall_ms });
    let report = json!({
        "backend": context.backend().name(),
        "renderer": context.renderer(),
        "size": [size.0, size.1],
        "msaa": { "asked": asked, "given": given },
        "passes": times.iter().map(pass).collect::<Vec<_>>(),
        "total_ms": times.iter().map(|time| time.wall_ms).sum::<f64>(),
    });
    format!("{report:#}\n")
}
