//! `hbao truth`: ray-traced ambient occlusion as an image, on the CPU in float64, without OpenGL.

use super::flags::{self, Flags, Opened};
use super::session::{trace, without_effect};
use super::unmeant;
use crate::picture::Pixels;
use crate::terminal::say;
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::Error;
use hbao::image::Outputs;
use hbao::measure::{Shot, TruthImage};
use hbao::reference::truth::Weight;
use hbao::settings::Settings;
use std::path::PathBuf;

const WEIGHTS: [(&str, Weight); 2] = [("uniform", Weight::Uniform), ("cosine", Weight::Cosine)];

const EXPLANATION: &str = "\
The command evaluates Eq. 6.2.3 of ShaderX7 by rays whose directions are uniform over the hemisphere about the
triangle's normal. With --weight cosine a direction counts by the cosine of its angle to the normal, as in Eq. 6.2.1,
from which the chapter starts (that equation has no attenuation: give --attenuation none). The rays start at the surface
point that is seen through the pixel's centre, and triangles occlude from both sides. Of the settings, only --radius and
--attenuation have an effect. The noise that is reported is the square root of the variance of a pixel, averaged over
the pixels and estimated from two independent halves of the rays.

Examples:
  hbao truth -o truth.exr --size 400x300
  hbao truth -o eq-6.2.1.exr --weight cosine --attenuation none
  hbao truth sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 -o truth.exr --truth-rays 1024";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let own = [output.value_parser(value_parser!(PathBuf)).help(flags::IMAGE_HELP)];
    let names = WEIGHTS.map(|(name, _)| name).join(", ");
    let weight =
        flags::valued("weight", "WEIGHT", format!("How much each direction counts [{names}; default: uniform]"));
    Command::new("truth")
        .about("Ray-trace ambient occlusion on the scene's triangles, on the CPU")
        .args(own)
        .args([flags::truth_rays(), weight, flags::no_metadata()])
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

/// Traces every pixel, writes the image, and reports its noise.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let rays = flags::read_truth_rays(matches)?;
    let weight = flags::word("weight", flags::text(matches, "weight").unwrap_or("uniform"), &WEIGHTS)?;
    let (output, format) = flags::read_image_output(matches)?;
    Outputs::check([output.clone()])?;
    let Opened { scene, settings, camera, notices, empty } = flags.open()?;
    let idle = flags.knobs_given().filter(|knob| !matches!(*knob, "radius" | "attenuation"));
    idle.map(|knob| without_effect(knob, &settings, "rays")).chain(notices).for_each(|notice| say(&notice));

    let resolved = settings.resolved(scene.mesh.diagonal());
    let traced = trace(Shot { mesh: &scene.mesh, camera: &camera, size: flags.size }, &resolved, rays, weight)?;

    let mut render = flags.seen(&camera);
    render.insert("truth-rays".into(), i64::from(rays).into());
    let weight = WEIGHTS.iter().find(|&&(_, one)| one == weight).map_or("", |&(name, _)| name);
    render.insert("weight".into(), weight.into());
    render.insert("noise_rmse".into(), traced.noise_rmse.into());
    let origin = flags::with_origin(&settings, render);
    let truth = TruthImage::new(&traced, flags.size);
    let unmeant = if traced.covered.contains(&true) {
        unmeant::open(&truth.visibility, &Settings { strength: 1.0, ..resolved }, true)
    } else {
        (!empty).then(|| unmeant::empty(&flags, &scene.mesh, &camera))
    };
    unmeant.iter().for_each(|notice| say(notice));
    let mut outputs = Outputs::new();
    outputs
        .stage(output, &Pixels::Visibility(truth.visibility).encode(format, &flags::stored_text(matches, &origin))?)?;
    outputs.commit()
}
