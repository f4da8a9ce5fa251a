//! The command line, one verb per file.
//!
//! Nothing here panics on the contents of a flag or a file: each error becomes one line on stderr and an exit code.

mod bench;
mod camera;
mod compare;
mod completions;
mod flags;
mod folder;
mod image;
mod info;
mod paper;
mod poster;
mod render;
mod sequence;
mod session;
mod tile;
mod trade;
mod truth;
mod tune;
mod unmeant;
mod usage;
mod values;
mod view;

use crate::terminal::{be_quiet, print};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, Command};
use hbao::Error;
use std::ffi::OsString;

/// Runs the command line. The first argument is the program's name.
pub(crate) fn run(arguments: impl Iterator<Item = OsString>) -> Result<(), Error> {
    let arguments: Vec<OsString> = arguments.collect();
    if let Some(what) = usage::one_dash(&command(), &arguments) {
        return Err(Error::Usage(what));
    }
    let matches = match command().try_get_matches_from(&arguments) {
        Ok(matches) => matches,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return print(&error.to_string());
        }
        Err(error) => {
            // `hbao` alone shows what there is to type. It is wrong usage all the same, so that a script whose
            // subcommand is empty does not succeed.
            if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
                print(&error.to_string())?;
            }
            return Err(Error::Usage(usage::one_line(&error, &command(), &arguments)));
        }
    };
    if matches.subcommand().is_some_and(|(_, matches)| matches.get_flag("quiet")) {
        be_quiet();
    }
    match matches.subcommand() {
        Some(("render", matches)) => render::run(matches),
        Some(("truth", matches)) => truth::run(matches),
        Some(("trade", matches)) => trade::run(matches),
        Some(("tune", matches)) => tune::run(matches),
        Some(("bench", matches)) => bench::run(matches),
        Some(("paper", matches)) => paper::run(matches),
        Some(("compare", matches)) => compare::run(matches),
        Some(("image", matches)) => image::run(matches),
        Some(("sequence", matches)) => sequence::run(matches),
        Some(("view", matches)) => view::run(matches),
        Some(("info", _)) => info::run(),
        Some(("completions", matches)) => completions::run(matches, command()),
        // clap accepts no other subcommand.
        _ => Err(Error::Usage("no command given: see hbao --help".into())),
    }
}

/// Makes the description of the whole command line.
fn command() -> Command {
    let quiet = Arg::new("quiet").long("quiet").action(ArgAction::SetTrue).global(true);
    let quiet = quiet
        .help("Print no notices and no progress; errors, and results on standard output, are printed all the same");
    Command::new("hbao")
        .version(env!("CARGO_PKG_VERSION"))
        .about("The screen-space ambient occlusion of 2008, on OpenGL 3.3")
        .subcommand_required(true)
        .arg_required_else_help(true)
        // Of a flag that is given twice the last value counts, so that a script can append flags to its own.
        .args_override_self(true)
        .arg(quiet)
        .subcommand(render::command())
        .subcommand(truth::command())
        .subcommand(trade::command())
        .subcommand(tune::command())
        .subcommand(bench::command())
        .subcommand(paper::command())
        .subcommand(compare::command())
        .subcommand(image::command())
        .subcommand(sequence::command())
        .subcommand(view::command())
        .subcommand(info::command())
        .subcommand(completions::command())
}
