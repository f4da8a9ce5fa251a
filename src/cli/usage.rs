//! Describes what is wrong with a command line, in one line that also says what to type.

use crate::picture;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};
use hbao::scene::{CORNELL_BOX, NAVE};
use std::ffi::OsString;
use std::path::Path;

/// The longest part of a command line that a message repeats, in characters.
const LONGEST: usize = 100;

/// Describes an error of clap in one line. The line is made from the error's kind and context, because clap's own
/// message has several lines. `cli` describes the whole command line, and `arguments` are all arguments as they were
/// given, the program's name included. Errors about a value out of range do not come from clap, because `flags` reads
/// the values.
pub(super) fn one_line(error: &clap::Error, cli: &Command, arguments: &[OsString]) -> String {
    let about = |kind| error.get(kind).map(named).unwrap_or_default();
    let argument = about(ContextKind::InvalidArg);
    let what = match error.kind() {
        ErrorKind::UnknownArgument => {
            let words: Vec<_> = arguments.iter().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
            unknown_argument(error, cli, &words)
        }
        ErrorKind::InvalidSubcommand => invalid_subcommand(error, cli),
        ErrorKind::MissingSubcommand | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => missing_subcommand(&[]),
        ErrorKind::MissingRequiredArgument => format!("{argument} is required but was not given"),
        ErrorKind::InvalidValue if is_empty(error.get(ContextKind::InvalidValue)) => {
            format!("a value is required for {argument} but none was supplied")
        }
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => {
            let value = about(ContextKind::InvalidValue);
            match error.get(ContextKind::ValidValue) {
                Some(ContextValue::Strings(valid)) => format!("{value} is not one of {}", valid.join(", ")),
                _ => format!("invalid value {value} for {argument}"),
            }
        }
        ErrorKind::TooManyValues => {
            format!("unexpected value {} for {argument}, which takes no more", about(ContextKind::InvalidValue))
        }
        ErrorKind::ArgumentConflict => {
            format!("the argument {argument} cannot be used with {}", about(ContextKind::PriorArg))
        }
        ErrorKind::InvalidUtf8 => "an argument is not valid UTF-8".into(),
        // This command line should not make clap return an error of another kind. If one does occur, the message is its
        // kind.
        kind => kind.as_str().unwrap_or("the command line is not understood").into(),
    };
    format!("{what} (see --help)")
}

/// Says so if a long flag was written with one dash. clap reads it as short flags or as the value of one: `-output` as
/// `-o` with the value `utput`.
pub(super) fn one_dash(cli: &Command, arguments: &[OsString]) -> Option<String> {
    let words = arguments.iter().skip(1).take_while(|word| *word != "--").filter_map(|word| word.to_str());
    let verb = words.clone().find_map(|word| cli.find_subcommand(word))?;
    words.clone().filter(|word| word.starts_with('-')).find_map(|word| {
        let two = format!("-{}", word.split('=').next()?);
        let name = two.strip_prefix("--").filter(|name| name.len() > 1)?;
        flag_of(verb, &two).or_else(|| flag_of(cli, &two))?;
        Some(format!("unexpected argument '-{name}' found: write two dashes, '{two}' (see --help)"))
    })
}

/// Describes an argument that the subcommand does not take. `words` are all arguments after the program's name.
fn unknown_argument(error: &clap::Error, cli: &Command, words: &[String]) -> String {
    let given = string(error.get(ContextKind::InvalidArg));
    let quoted = shortened(&given);
    let Some(verb) = words.iter().find_map(|word| cli.find_subcommand(word)) else {
        return missing_subcommand(words);
    };
    let name = verb.get_name();
    if flag_of(verb, &given).is_some() {
        return format!("'{quoted}' stands before the subcommand: write it after 'hbao {name}'");
    }
    if let Some(joined) = numbers_apart(verb, &given, words) {
        return joined;
    }
    if !given.starts_with('-') || given == "-" {
        return match first_scene(cli, words) {
            Some(first) => format!("two scenes are given, '{}' and '{quoted}': {name} takes one", shortened(&first)),
            None => format!("unexpected argument '{quoted}' found"),
        };
    }
    let others = cli.get_subcommands().filter(|other| flag_of(other, &given).is_some());
    let others: Vec<_> = others.map(Command::get_name).collect();
    if !others.is_empty() {
        let take = if others.len() == 1 { "takes" } else { "take" };
        return format!("{name} does not take '{quoted}'; {} {take} it", others.join(", "));
    }
    let suggested = string(error.get(ContextKind::SuggestedArg));
    let known = match other_spelling(verb, &given) {
        Some(flags) => format!("; write {flags}"),
        None if is_near(&given, &suggested) => format!("; a similar argument exists: '{suggested}'"),
        None => String::new(),
    };
    format!("unexpected argument '{quoted}' found{known}")
}

fn invalid_subcommand(error: &clap::Error, cli: &Command) -> String {
    let given = string(error.get(ContextKind::InvalidSubcommand));
    let quoted = shortened(&given);
    if Path::new(&given).extension().is_some() || [CORNELL_BOX, NAVE].contains(&given.as_str()) {
        return format!("a subcommand is missing before '{quoted}', as in 'hbao render {quoted} -o a.png'");
    }
    let known = match error.get(ContextKind::SuggestedSubcommand).map(named) {
        Some(known) if !known.is_empty() => format!("a similar subcommand exists: {known}"),
        _ => {
            let verbs: Vec<_> = cli.get_subcommands().map(Command::get_name).collect();
            format!("the subcommands are {}", verbs.join(", "))
        }
    };
    format!("unrecognized subcommand '{quoted}'; {known}")
}

/// Says that there is no subcommand, and shows where it belongs. `words` are the arguments that were given.
fn missing_subcommand(words: &[String]) -> String {
    let rest = if words.is_empty() { "-o a.png".into() } else { shortened(&words.join(" ")) };
    format!("a subcommand is missing, as in 'hbao render {rest}'")
}

/// If an argument is the rest of several numbers that were separated by spaces (`--eye 1 2 3`), says how to write them.
fn numbers_apart(verb: &Command, given: &str, words: &[String]) -> Option<String> {
    let number = |word: &str| word.trim_matches(',').parse::<f64>().is_ok();
    if !number(given) {
        return None;
    }
    words.iter().enumerate().find_map(|(i, flag)| {
        let form = flag_of(verb, flag)?.get_value_names()?.first()?;
        let separator = [",", "x"].into_iter().find(|separator| form.contains(separator))?;
        let numbers = words[i + 1..].iter().take_while(|word| number(word)).map(|word| word.trim_matches(','));
        let numbers: Vec<_> = numbers.collect();
        let separated = if separator == "," { "commas" } else { "an x" };
        let joined = shortened(&numbers.join(separator));
        (numbers.len() > 1).then(|| format!("the numbers of {flag} are separated by {separated}: {flag} {joined}"))
    })
}

/// Returns the scene that the command line gives first.
fn first_scene(cli: &Command, words: &[String]) -> Option<String> {
    let program = ["hbao".to_string()];
    let all = program.iter().chain(words);
    let matches = cli.clone().ignore_errors(true).try_get_matches_from(all).ok()?;
    let (_, matches) = matches.subcommand()?;
    let scene = matches.try_get_raw("scene").ok()??.next()?;
    Some(scene.to_string_lossy().into_owned())
}

/// Returns the description of a flag of a subcommand, from the argument that gives it: `--size`, `--size=4x4`, `-o`.
fn flag_of<'a>(verb: &'a Command, given: &str) -> Option<&'a Arg> {
    let name = given.split('=').next()?;
    verb.get_arguments().find(|arg| match name.strip_prefix("--") {
        Some(long) => arg.get_long() == Some(long),
        None => arg.get_short().is_some_and(|short| name == format!("-{short}")),
    })
}

/// Returns what to write in place of a flag that does not exist but whose meaning is plain.
fn other_spelling(verb: &Command, given: &str) -> Option<String> {
    let name = given.trim_start_matches('-').split('=').next()?;
    let image = if name == "colour" { "color" } else { name };
    if flag_of(verb, "--show").is_some() && picture::names().any(|(name, _)| name == image) {
        return Some(format!("'--show {image}'"));
    }
    let size = matches!(name, "width" | "height") && flag_of(verb, "--size").is_some();
    size.then(|| "'--size WxH', such as '--size 800x600'".into())
}

/// Whether a flag is so near to the one that clap suggests that it may be meant. clap also suggests flags that merely
/// share letters, such as `--blur` for `--colour`.
fn is_near(given: &str, suggested: &str) -> bool {
    let (given, suggested) = (given.trim_start_matches('-'), suggested.trim_start_matches('-'));
    let changes = strsim::damerau_levenshtein(given, suggested);
    !suggested.is_empty()
        && (suggested.starts_with(given) || given.starts_with(suggested) || changes <= 2.min(given.len() / 3))
}

/// Returns arguments, values or subcommands in quotes, separated by commas.
fn named(value: &ContextValue) -> String {
    let quoted = |text: &String| format!("'{}'", shortened(text));
    match value {
        ContextValue::String(text) => quoted(text),
        ContextValue::Strings(texts) => texts.iter().map(quoted).collect::<Vec<_>>().join(", "),
        _ => String::new(),
    }
}

/// Returns the text of a value without quotes; the first one, if there are several.
fn string(value: Option<&ContextValue>) -> String {
    match value {
        Some(ContextValue::String(text)) => text.clone(),
        Some(ContextValue::Strings(texts)) => texts.first().cloned().unwrap_or_default(),
        _ => String::new(),
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.into(),
    }
}

fn is_empty(value: Option<&ContextValue>) -> bool {
    match value {
        None => true,
        Some(ContextValue::String(text)) => text.is_empty(),
        Some(_) => false,
    }
}
