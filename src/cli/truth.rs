//! `hbao truth`: ray-traced ambient occlusion as an image, on the CPU in float64, without OpenGL.

use super::flags::{self, Flags, Opened};
use super::picture::{FileFormat, visibility};
use super::{bar, say};
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::Error;
use hbao::image::{Image, Outputs, metadata};
use hbao::reference::truth::{Traced, Truth};
use hbao::scene::{Camera, Mesh};
use hbao::settings::Settings;
use std::path::PathBuf;
use std::time::Instant;

/// As many as 8192x8192. A pixel under way takes some 60 bytes.
const MOST_PIXELS: u64 = 1 << 26;

const EXPLANATION: &str = "\
Eq. 6.2.3 of ShaderX7: rays in uniform directions of the hemisphere about the triangle's normal, from the surface point on
the ray of each pixel's centre; triangles occlude from both sides. Of the settings only --radius and --attenuation matter.
The noise is the root of the mean variance of a pixel, estimated from two independent halves of the rays.

Examples:
  hbao truth -o truth.exr --size 400x300
  hbao truth sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 -o truth.exr --truth-rays 1024";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let own = [output.value_parser(value_parser!(PathBuf)).help("The image to write, OUT.exr (Y, float) or OUT.png")];
    Command::new("truth")
        .about("Ray-trace ambient occlusion on the triangles")
        .args(own)
        .arg(flags::truth_rays())
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

/// Traces every pixel, with a progress bar, and says what it took and how noisy it is.
pub(crate) fn trace(
    mesh: &Mesh,
    camera: &Camera,
    (width, height): (u32, u32),
    settings: &Settings,
    rays: u32,
) -> Result<Traced, Error> {
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(Error::Usage(format!("--size {width}x{height}: at most {MOST_PIXELS} pixels can be traced")));
    }
    let truth = Truth::new(mesh, camera, (width as usize, height as usize), settings, rays)?;
    let pixels: Vec<usize> = (0..width as usize * height as usize).collect();
    let start = Instant::now();
    let progress = bar(pixels.len() as u64, "pixels traced");
    let traced = truth.trace(&pixels, |done| progress.inc(done as u64));
    progress.finish_and_clear();
    let covered = traced.covered.iter().filter(|&&covered| covered).count();
    say(&format!(
        "truth: {covered} covered pixels, {rays} rays each, {:.2} million rays a second, noise {:.5} RMS",
        covered as f64 * f64::from(rays) / start.elapsed().as_secs_f64() / 1e6,
        traced.noise_rmse
    ));
    Ok(traced)
}

/// That a knob changes nothing; but a method brings an attenuation of its own, unless there is one given.
pub(crate) fn without_effect(knob: &str, settings: &Settings, on: &str) -> String {
    let attenuation = settings.attenuation.name();
    if knob == "method" && settings.attenuation == Settings::for_method(settings.method).attenuation {
        return format!("--method has no effect on {on} but for its attenuation, {attenuation}");
    }
    format!("--{knob} has no effect on {on}")
}

/// Traces every pixel, writes the image, and says how noisy it is.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let rays = flags::read_truth_rays(matches)?;
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let format = FileFormat::of(&output)?;
    Outputs::check([output.clone()])?;
    let Opened { scene, settings, camera, notices } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| !matches!(*knob, "radius" | "attenuation"));
    idle.map(|knob| without_effect(knob, &settings, "rays")).chain(notices).for_each(|notice| say(&notice));

    let (width, height) = (flags.size.0 as usize, flags.size.1 as usize);
    let resolved = settings.resolved(scene.mesh.diagonal());
    let traced = trace(&scene.mesh, &camera, flags.size, &resolved, rays)?;

    let mut render = flags.seen(&camera);
    render.insert("truth-rays".into(), i64::from(rays).into());
    render.insert("noise_rmse".into(), traced.noise_rmse.into());
    let origin = flags::with_origin(&settings, render);
    let image = Image { width, height, texels: traced.visibility.iter().map(|&a| a as f32).collect() };
    let mut outputs = Outputs::new();
    outputs.stage(output, &visibility(&image, format, &metadata(&origin))?)?;
    outputs.commit()
}
