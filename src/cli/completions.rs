//! `hbao completions`: prints the script by which a shell completes the command's subcommands, flags and values.

use crate::terminal::print;
use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgMatches, Command, ValueHint, value_parser};
use clap_complete::Shell;
use hbao::Error;
use hbao::settings::{KNOBS, Kind};

const EXPLANATION: &str = "\
Examples:
  hbao completions bash > ~/.local/share/bash-completion/completions/hbao
  hbao completions zsh > ~/.zfunc/_hbao                 # a folder of zsh's fpath
  hbao completions fish > ~/.config/fish/completions/hbao.fish";

/// Makes the verb's argument.
pub(crate) fn command() -> Command {
    let shell = Arg::new("shell").value_name("SHELL").required(true).value_parser(value_parser!(Shell));
    Command::new("completions")
        .about("Print the script by which a shell completes the subcommands and flags of hbao")
        .arg(shell.help("The shell that reads the script"))
        .after_help(EXPLANATION)
}

/// Prints the script for `cli`, the description of the whole command line.
pub(crate) fn run(matches: &ArgMatches, cli: Command) -> Result<(), Error> {
    let Some(&shell) = matches.get_one::<Shell>("shell") else { return Ok(()) };
    let verbs: Vec<String> = cli.get_subcommands().map(|verb| verb.get_name().to_string()).collect();
    let mut cli = verbs.iter().fold(cli, |cli, verb| cli.mut_subcommand(verb, |verb| verb.mut_args(with_values)));
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut cli, "hbao", &mut script);
    print(&String::from_utf8_lossy(&script))
}

/// Adds to a flag the values that the shell may offer. The command itself reads these values as text, and so its own
/// description has none.
fn with_values(arg: Arg) -> Arg {
    let knob = KNOBS.iter().find(|knob| arg.get_id() == knob.name);
    match knob.map(|knob| knob.kind) {
        Some(Kind::Word(words)) => arg.value_parser(PossibleValuesParser::new(words)),
        Some(Kind::Switch) => arg.value_parser(PossibleValuesParser::new(["true", "false"])),
        _ if arg.get_id() == "scene" => arg.value_hint(ValueHint::FilePath),
        _ => arg,
    }
}
