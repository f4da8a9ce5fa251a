//! The command line, one verb per file.
//!
//! Nothing here panics on the contents of a flag or a file: each error becomes one line on stderr and an exit code.

mod bench;
mod compare;
mod flags;
mod folder;
mod info;
mod paper;
mod render;
mod session;
mod trade;
mod truth;
mod tune;
mod unmeant;
mod usage;

use crate::terminal::print;
use clap::Command;
use clap::error::ErrorKind;
use hbao::Error;
use std::ffi::OsString;

/// Runs the command line. The first argument is the program's name.
pub(crate) fn run(arguments: impl Iterator<Item = OsString>) -> Result<(), Error> {
    let matches = match command().try_get_matches_from(arguments) {
        Ok(matches) => matches,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return print(&error.to_string());
        }
        Err(error) => return Err(Error::Usage(usage::one_line(&error))),
    };
    match matches.subcommand() {
        Some(("render", matches)) => render::run(matches),
        Some(("truth", matches)) => truth::run(matches),
        Some(("trade", matches)) => trade::run(matches),
        Some(("tune", matches)) => tune::run(matches),
        Some(("bench", matches)) => bench::run(matches),
        Some(("paper", matches)) => paper::run(matches),
        Some(("compare", matches)) => compare::run(matches),
        Some(("info", _)) => info::run(),
        // clap accepts no other subcommand.
        _ => Err(Error::Usage("no command given: see hbao --help".into())),
    }
}

/// Makes the description of the whole command line.
fn command() -> Command {
    Command::new("hbao")
        .version(env!("CARGO_PKG_VERSION"))
        .about("The screen-space ambient occlusion of 2008, on OpenGL 3.3")
        .subcommand_required(true)
        .disable_help_subcommand(true)
        .subcommand(render::command())
        .subcommand(truth::command())
        .subcommand(trade::command())
        .subcommand(tune::command())
        .subcommand(bench::command())
        .subcommand(paper::command())
        .subcommand(compare::command())
        .subcommand(info::command())
}
