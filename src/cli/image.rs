//! `hbao image`: computes the ambient occlusion of a picture that another program rendered, from its depth.

mod camera;
mod channels;
mod depth;
mod findings;
mod normals;

use super::camera::read_matrix;
use super::flags::{self, KnobFlags};
use super::session::{open_context, timings};
use super::unmeant;
use crate::picture::{AO, AO_RAW, FINAL, FileFormat, ImageKind, Pixels, byte};
use crate::terminal::say;
use camera::Camera;
use clap::{Arg, ArgMatches, Command, value_parser};
use depth::{Depth, DepthFlags};
use hbao::image::{Image, Outputs, exr, png};
use hbao::measure::Reach;
use hbao::settings::{Radius, Settings};
use hbao::{AmbientOcclusion, BACKGROUND_R32F, Error, InputTextures, Inputs, PassTime, Timers, glow};
use normals::NormalsFlags;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The images that the verb writes.
const SHOWN: [(&str, &ImageKind); 3] = [("ao", &AO), ("ao-raw", &AO_RAW), ("final", &FINAL)];

const RADIUS_HELP: &str = "R, the distance beyond which nothing occludes: in the unit of z, or as N%view of the view's height \
                           at the depth of the pixel [above 0; default: 5%view]";

const EXPLANATION: &str = "\
DEPTH is an EXR file of any layout: with one or several layers or parts, scanlines or tiles, half, float or whole
numbers. Its picture is its display window, and nothing is where it has no data. Depth must not be filtered: a pixel at
an edge that holds the mean of two depths is a surface between them. NORMALS may be a PNG of 8 or 16 bits, and may be
the same file as DEPTH. Without NORMALS they are rebuilt from depth. A picture has one depth per pixel, and is read as
float: --msaa, --edges, --normals, --normal-format and --depth-format have no effect.

The images of --show:
  ao, ao-raw    visibility after the blur (ao) and before it (ao-raw), 1 where nothing occludes: grey in a
                PNG, Y in an EXR
  final         PICTURE times visibility, without its alpha. Values are multiplied as the file holds them; no
                gamma is applied

Values of --depth-is hardware lie from 0 to 1, and 0 is the near plane unless depth is reversed. With --near and --far
the range of z in clip space makes no difference. Without them the planes, and whether depth is reversed, follow from
--projection.

The command compares NORMALS with DEPTH, and says which flag would make them fit. The image holds the settings that it
was made with: a PNG in the text chunk 'hbao', an EXR in the attribute 'hbao'.

Examples:
  hbao image depth.exr -o ao.png --fov-y 50
  hbao image render.exr render.exr -o ao.exr --depth-channel ViewLayer.Depth.Z --normals-channels ViewLayer.Normal \\
      --normals-are world --view-matrix view.txt --fov-y 39.6 --radius 0.5
  hbao image depth.exr normals.png -o dark.png --show final --color beauty.png --intrinsics 800,800,640,360 --radius 0.2
  hbao image zbuffer.exr -o ao.png --depth-is hardware --near 0.1 --far inf --reversed --fov-y 60 --radius 1
  hbao image dump/depth.exr dump/normals.exr --normals-are left -o ao.png --fov-y 50 --radius 80";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let file = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).value_name(value).value_parser(value_parser!(PathBuf)).help(help)
    };
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let shows = SHOWN.map(|(name, _)| name).join(", ");
    let outputs = [
        output.value_parser(value_parser!(PathBuf)).help(flags::IMAGE_HELP),
        flags::valued("show", "IMAGE", format!("The image that is written to OUT [{shows}; default: ao]")),
        flags::path("timings", "FILE.json", "Write the time of each pass that the image needs, in milliseconds"),
        flags::no_metadata(),
    ];
    let pictures = depth::arguments().into_iter().chain(normals::arguments()).chain(normals::colour_arguments());
    let command = Command::new("image")
        .about("Compute the ambient occlusion of a picture that another program rendered")
        .arg(file("depth-file", "DEPTH", "The picture's depth, an EXR file").required(true))
        .arg(file("normals-file", "NORMALS", "The picture's normals, an EXR or PNG file"))
        .args(outputs.map(|arg| arg.help_heading("Output")))
        .args(pictures.map(|arg| arg.help_heading("Pictures")));
    camera::with_flags(command)
        .args(flags::knob_arguments().map(|arg| if arg.get_id() == "radius" { arg.help(RADIUS_HELP) } else { arg }))
        .arg(flags::backend_argument())
        .after_help(EXPLANATION)
}

/// Refuses a radius that no picture gives a meaning to.
fn check_radius(settings: &Settings) -> Result<(), Error> {
    match settings.radius {
        Radius::Percent(percent) if settings.method.reads("radius") => Err(Error::Usage(format!(
            "radius {percent}% is a share of a scene's size, which a picture does not tell: give --radius in the unit of z, \
             such as 0.5, or as a share of the view's height, such as {percent}%view"
        ))),
        _ => Ok(()),
    }
}

/// What the user asked for.
struct Wanted {
    output: PathBuf,
    format: FileFormat,
    shown: &'static str,
    show: &'static ImageKind,
    timings: Option<PathBuf>,
    color: Option<PathBuf>,
    color_channels: Option<String>,
}

impl Wanted {
    fn read(matches: &ArgMatches) -> Result<Wanted, Error> {
        let (output, format) = flags::read_image_output(matches)?;
        let names = SHOWN.map(|(name, image)| (name, (name, image)));
        let (shown, show) = flags::word("show", flags::text(matches, "show").unwrap_or("ao"), &names)?;
        let wanted = Wanted {
            output,
            format,
            shown,
            show,
            timings: flags::path_of(matches, "timings", "json")?,
            color: matches.get_one("color").cloned(),
            color_channels: flags::text(matches, "color-channels").map(String::from),
        };
        if shown == "final" && wanted.color.is_none() {
            return Err(Error::Usage("--show final needs the picture that is darkened: give --color PICTURE".into()));
        }
        Ok(wanted)
    }

    /// Returns why a flag of a setting changes nothing that is written, if it was given and changes nothing.
    fn idle(&self, flag: &str, settings: &Settings) -> Option<String> {
        let why = match flag {
            "msaa" | "edges" => "on a picture, which has one depth per pixel".into(),
            "normals" => "on a picture: its normals are NORMALS, or are rebuilt from depth".into(),
            "normal-format" | "depth-format" => "on a picture, which is read as 32-bit float".into(),
            _ if self.show.is_decided_by(flag, settings) => return None,
            _ => settings.idle(flag).map_or_else(|| format!("with --show {}", self.shown), |idle| idle.to_string()),
        };
        Some(format!("--{flag} has no effect {why}"))
    }

    /// Returns the notices about flags of the picture to darken that have no effect.
    fn idle_colours(&self) -> impl Iterator<Item = String> {
        let given = [("color", self.color.is_some()), ("color-channels", self.color_channels.is_some())];
        let unused = |flag: &str| self.shown != "final" || flag == "color-channels" && self.color.is_none();
        let idle = given.into_iter().filter(move |(flag, given)| *given && unused(flag));
        idle.map(|(flag, _)| format!("--{flag} has no effect unless --show is final")).collect::<Vec<_>>().into_iter()
    }
}

/// Computes and writes the image. The cheap checks come first: the flags, then the files to be written, then the
/// pictures, and at last OpenGL.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let knobs = KnobFlags::read(matches)?;
    // A picture has one depth per pixel.
    let settings = Settings { msaa: 1, ..knobs.own_settings(Settings::for_method)? };
    settings.validate()?;
    check_radius(&settings)?;
    let wanted = Wanted::read(matches)?;
    let backend = flags::read_backend(matches)?;
    let depth_flags = DepthFlags::read(matches)?;
    let camera = Camera::read(matches, &depth_flags.path)?;
    let normals_flags = NormalsFlags::read(matches)?;
    let reads_near = settings.method.facts().reads_near;
    if reads_near && camera.near() == 0.0 && !depth_flags.is_hardware() {
        let what = "--method ray-march ends its rays at the near plane: give its z as --near";
        return Err(Error::Usage(what.into()));
    }
    Outputs::check([&wanted.output].into_iter().chain(&wanted.timings))?;
    let read = [Some(depth_flags.path.as_path()), normals_flags.path(), wanted.color.as_deref()];
    if let Some(path) = read.into_iter().flatten().find(|path| is_same_file(path, &wanted.output)) {
        return Err(Error::Usage(format!(
            "-o {} would replace a picture that is read: name another file",
            path.display()
        )));
    }

    let (depth, projection) = depth_flags.open(&camera)?;
    let size = (depth.image.width as u32, depth.image.height as u32);
    let normals = normals_flags.open(&depth)?;
    let colours = match &wanted.color {
        Some(path) if wanted.shown == "final" => {
            Some(normals::colours(path, wanted.color_channels.as_deref(), &depth)?)
        }
        _ => None,
    };

    let context = open_context(backend)?;
    let idle = knobs.given().filter_map(|flag| wanted.idle(flag, &settings)).chain(wanted.idle_colours());
    let idle = idle.chain(normals_flags.idle().iter().cloned()).chain(depth_flags.idle());
    idle.chain(camera.idle(depth_flags.is_hardware(), reads_near)).for_each(|notice| say(&notice));
    if normals.is_some() && !settings.reads_normals() {
        say(&format!("NORMALS have no effect with --method {}", settings.method.name()));
    }
    if depth.pixel_aspect != 1.0 && camera.takes_square_pixels() {
        say(&format!(
            "DEPTH says that its pixels are {} times as wide as high, and they are taken as square: give --frustum or \
             --intrinsics if they are not",
            depth.pixel_aspect
        ));
    }

    let gl = context.gl();
    // Without its blur, the result is that before the blur.
    let needed = Settings { blur: if wanted.show.is_unblurred() { 0 } else { settings.blur }, ..settings.clone() };
    let mut ao = AmbientOcclusion::new(gl.clone(), size, &needed)?;
    let textures = InputTextures::new(gl, &depth.image, normals.as_ref().map(|normals| &normals.image))?;
    let mut inputs = Inputs { depth_encoding: depth.encoding, near: camera.near(), ..textures.inputs(projection) };
    if let Some(normals) = &normals {
        (inputs.normal_encoding, inputs.normal_space) = (normals.encoding, normals.space);
    }
    let mut timers = Timers::new(gl, wanted.timings.is_some())?;
    ao.render_timed(&inputs, &mut timers)?;
    let mut times: Vec<PassTime> = timers.take();
    if wanted.timings.is_some() {
        // Drivers compile shaders in the first frame, and compiling is not part of a pass's time.
        ao.render_timed(&inputs, &mut timers)?;
        times = timers.take();
    }
    let visibility = ao.image()?;
    doubts(gl, &needed, &ao, &inputs, &depth, &visibility)?.iter().for_each(|notice| say(notice));

    let color = wanted.color.as_deref().filter(|_| wanted.shown == "final");
    let origin = flags::with_origin(&settings, origin(matches, (&depth_flags, &normals_flags, color), size));
    let text = flags::stored_text(matches, &origin);
    let image = match (&colours, wanted.format) {
        (None, format) => Pixels::Visibility(visibility).encode(format, &text)?,
        (Some(colours), FileFormat::Exr) => exr::encode(&darkened(colours, &visibility), &text)?,
        (Some(colours), FileFormat::Png) => png::encode(&darkened(colours, &visibility).map(|c| c.map(byte)), &text)?,
    };
    let mut outputs = Outputs::new();
    outputs.stage(&wanted.output, &image)?;
    if let Some(path) = &wanted.timings {
        outputs.stage(path, timings(&context, size, (1, 1), &times).as_bytes())?;
    }
    outputs.commit()
}

/// Returns the notices about a result that the user hardly meant.
fn doubts(
    gl: &Arc<glow::Context>,
    settings: &Settings,
    ao: &AmbientOcclusion,
    inputs: &Inputs,
    depth: &Depth,
    visibility: &Image<f32>,
) -> Result<Vec<String>, Error> {
    if depth.covered() == 0 {
        let what =
            "no pixel of DEPTH holds a surface, and all of the image is 1: check --depth-channel and --background";
        return Ok(vec![what.into()]);
    }
    if !settings.method.computes() {
        return Ok(Vec::new());
    }
    let size = (depth.image.width as u32, depth.image.height as u32);
    let mut found = findings::notices(gl, size, settings, inputs, depth.half)?;
    // With depth that is taken for something else, R would be judged at wrong depths.
    if found.is_empty() {
        let linear = ao.linear_depth_image()?.unwrap_or_else(|| depth.image.clone());
        let linear = linear.map(|z| if z >= BACKGROUND_R32F { f32::INFINITY } else { z });
        let reach = |settings: &Settings| Reach::of(&linear, inputs.projection, settings);
        let radius = unmeant::radius(settings, "--radius", reach)?;
        found.extend(radius.or(unmeant::open(visibility, settings, settings.method.reads("radius"))));
    }
    if ao.rebuilt_normals().is_some() {
        let coarse = if depth.half { "; DEPTH holds half floats, too coarse for that: steps show" } else { "" };
        let what = "no NORMALS are given, so that they are rebuilt from depth: curved surfaces are facetted, and silhouettes \
                    have errors";
        found.push(format!("{what}{coarse}"));
    }
    Ok(found)
}

/// Returns whether both paths lead to one file that exists.
fn is_same_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}

/// Returns the colours times visibility. Visibility may be that of a texel for each 2x2 pixels.
fn darkened(colours: &Image<[f32; 3]>, visibility: &Image<f32>) -> Image<[f32; 3]> {
    let scale = if (visibility.width, visibility.height) == (colours.width, colours.height) { 1 } else { 2 };
    Image::from_fn(colours.width, colours.height, |x, y| {
        let a = visibility.at(x / scale, y / scale);
        colours.at(x, y).map(|c| c * a)
    })
}

/// Returns the table of the metadata that says what the image was made from. Files are named without their folders.
fn origin(
    matches: &ArgMatches,
    (depth, normals, color): (&DepthFlags, &NormalsFlags, Option<&Path>),
    size: (u32, u32),
) -> toml::Table {
    const FLAGS: [&str; 15] = [
        "depth-channel",
        "depth-is",
        "background",
        "normals-are",
        "normals-encoding",
        "normals-channels",
        "view-axes",
        "fov-y",
        "ortho",
        "frustum",
        "ortho-frustum",
        "intrinsics",
        "near",
        "far",
        "clip-range",
    ];
    let mut table = toml::Table::new();
    let mut put = |key: &str, value: toml::Value| table.insert(key.into(), value);
    put("version", env!("CARGO_PKG_VERSION").into());
    put("image", depth::name(&depth.path).into());
    if let Some(path) = normals.path() {
        put("normals", depth::name(path).into());
    }
    if let Some(path) = color {
        put("color", depth::name(path).into());
        if let Some(channels) = flags::text(matches, "color-channels") {
            put("color-channels", channels.into());
        }
    }
    put("size", vec![i64::from(size.0), i64::from(size.1)].into());
    for flag in FLAGS {
        if let Some(text) = flags::text(matches, flag) {
            put(flag, text.parse::<f64>().map_or_else(|_| text.into(), toml::Value::from));
        }
    }
    for flag in ["view-matrix", "projection"] {
        if let Ok(Some(columns)) = read_matrix(matches, flag) {
            let rows: [f64; 16] = std::array::from_fn(|i| columns[4 * (i % 4) + i / 4]);
            put(flag, rows.to_vec().into());
        }
    }
    if matches.get_flag("reversed") {
        put("reversed", true.into());
    }
    table
}
