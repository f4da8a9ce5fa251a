//! `hbao paper`: every picture, table and claim of the papers, regenerated into one page.

use super::flags;
use super::folder::MadeFolder;
use super::session::open_context;
use crate::report::{self, FIGURES, Made, Options, PAGE};
use crate::terminal::say;
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::image::Outputs;
use hbao::{Error, check_size};
use std::path::PathBuf;

/// The least size: with fewer pixels the pictures show nothing.
const SMALLEST: (u32, u32) = (64, 48);

const EXPLANATION: &str = "\
DIR/index.html needs no other file. Its pictures and drawings also lie beside it, and report.json holds its numbers. The
models are those of the papers: sibenik.obj and dragon.obj, and sponza.obj for the pictures of 6.1. The page says which of
them are missing and what it leaves out for that; the built-in nave stands in for Sibenik. The machine should have nothing
else to do.

Examples:
  hbao paper -o report --size 320x240
  hbao paper -o report --models models";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("DIR").required(true);
    let (width, height) = SMALLEST;
    let own = [
        output.value_parser(value_parser!(PathBuf)).help("The folder to write into; made if it is missing"),
        flags::path("models", "DIR", "Where the papers' models lie"),
        flags::valued(
            "size",
            "WxH",
            format!("Width and height of the pictures [at least {width}x{height}; default: 1600x1200]"),
        ),
        flags::truth_rays(),
        flags::valued("runs", "N", "Counted runs of what is timed [1 to 1000; default: 3]"),
        flags::backend_argument(),
    ];
    Command::new("paper").about("Regenerate the papers' pictures, tables and claims").args(own).after_help(EXPLANATION)
}

/// Measures and renders everything, and writes the page.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let models = matches.get_one::<PathBuf>("models").cloned();
    let size = flags::read_size(matches)?;
    if size.0 < SMALLEST.0 || size.1 < SMALLEST.1 {
        let (width, height) = SMALLEST;
        return Err(Error::Usage(format!("--size {}x{}: the report needs at least {width}x{height}", size.0, size.1)));
    }
    let rays = flags::read_truth_rays(matches)?;
    let runs = flags::read_runs(matches, 3)?;
    let backend = flags::read_backend(matches)?;
    if let Some(models) = models.as_ref().filter(|models| !models.is_dir()) {
        return Err(Error::Usage(format!("--models {}: no such folder", models.display())));
    }
    {
        // The folder is removed again at once, so that an interrupt in the minutes to come leaves no empty folder.
        let _rehearsal = MadeFolder::ensure(&output)?;
        Outputs::check([output.join(PAGE), output.join(FIGURES)])?;
    }

    let context = open_context(backend)?;
    check_size(context.gl(), size.0, size.1)?;
    let Made { files, claims, figures } = report::make(&context, &Options { models, size, rays, runs })?;

    let made = MadeFolder::ensure(&output)?;
    let mut outputs = Outputs::new();
    files.iter().try_for_each(|file| outputs.stage(output.join(&file.name), &file.bytes))?;
    outputs.commit()?;
    made.keep();
    say(&format!("{}: {claims} claims, {figures} figures", output.join(PAGE).display()));
    Ok(())
}
