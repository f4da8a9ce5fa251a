//! `hbao paper`: the pictures, the tables and the claims of the papers, regenerated into one page.

use super::flags;
use super::folder::MadeFolder;
use super::session::open_context;
use crate::report::{self, FIGURES, Made, Options, PAGE};
use crate::terminal::say;
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::image::Outputs;
use hbao::{Error, check_size};
use std::path::PathBuf;

/// The least width and height of the pictures in pixels. Smaller pictures show nothing.
const SMALLEST: (u32, u32) = (64, 48);

const EXPLANATION: &str = "\
The page is DIR/index.html, which needs no other file. Its pictures and drawings are also written as files of their own,
and report.json holds its numbers. --models may hold the models of the papers: sibenik.obj, dragon.obj, and sponza.obj
for the pictures of 6.1. The page names the models that are missing and what it leaves out without them; the built-in
nave replaces Sibenik. Nothing else should run on the machine while the command measures times.

Examples:
  hbao paper -o report --size 320x240
  hbao paper -o report --models models";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("DIR").required(true);
    let (width, height) = SMALLEST;
    let own = [
        output.value_parser(value_parser!(PathBuf)).help("The folder to write into, which is created if needed"),
        flags::path("models", "DIR", "The folder that holds the papers' models"),
        flags::valued(
            "size",
            "WxH",
            format!("Width and height of the pictures in pixels [at least {width}x{height}; default: 1600x1200]"),
        ),
        flags::truth_rays(),
        flags::valued("runs", "N", "Number of timed runs of each measurement [1 to 1000; default: 3]"),
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
        let what = "no such folder: give --models the folder that holds the papers' models, or leave it out";
        return Err(Error::Input { path: models.clone(), what: what.into() });
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
