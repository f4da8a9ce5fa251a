//! Describes what is wrong with a command line, in one line.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Describes an error of clap in one line. The line is made from the error's kind and context, because clap's own
/// message has several lines. Errors about a value out of range do not come from clap, because `flags` reads the
/// values.
pub(super) fn one_line(error: &clap::Error) -> String {
    let about = |kind| error.get(kind).map(named).unwrap_or_default();
    let argument = about(ContextKind::InvalidArg);
    let what = match error.kind() {
        ErrorKind::UnknownArgument => {
            let known = suggestion("argument", &about(ContextKind::SuggestedArg));
            format!("unexpected argument {argument} found{known}")
        }
        ErrorKind::InvalidSubcommand => {
            let known = suggestion("subcommand", &about(ContextKind::SuggestedSubcommand));
            format!("unrecognized subcommand {}{known}", about(ContextKind::InvalidSubcommand))
        }
        ErrorKind::MissingSubcommand => {
            let verbs = about(ContextKind::ValidSubcommand);
            format!("{} requires a subcommand, one of {verbs}", about(ContextKind::InvalidSubcommand))
        }
        ErrorKind::MissingRequiredArgument => format!("{argument} is required but was not given"),
        ErrorKind::InvalidValue if is_empty(error.get(ContextKind::InvalidValue)) => {
            format!("a value is required for {argument} but none was supplied")
        }
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => {
            format!("invalid value {} for {argument}", about(ContextKind::InvalidValue))
        }
        ErrorKind::TooManyValues => {
            format!("unexpected value {} for {argument}, which takes no more", about(ContextKind::InvalidValue))
        }
        ErrorKind::ArgumentConflict => match about(ContextKind::PriorArg) {
            other if other == argument => format!("the argument {argument} cannot be used multiple times"),
            other => format!("the argument {argument} cannot be used with {other}"),
        },
        ErrorKind::InvalidUtf8 => "an argument is not valid UTF-8".into(),
        // This command line should not make clap return an error of another kind. If one does occur, the message is its
        // kind.
        kind => kind.as_str().unwrap_or("the command line is not understood").into(),
    };
    format!("{what} (see --help)")
}

fn suggestion(what: &str, known: &str) -> String {
    if known.is_empty() { String::new() } else { format!("; a similar {what} exists: {known}") }
}

/// Returns arguments, values or subcommands in quotes, separated by commas.
fn named(value: &ContextValue) -> String {
    let quoted = |text: &String| format!("'{text}'");
    match value {
        ContextValue::String(text) => quoted(text),
        ContextValue::Strings(texts) => texts.iter().map(quoted).collect::<Vec<_>>().join(", "),
        _ => String::new(),
    }
}

fn is_empty(value: Option<&ContextValue>) -> bool {
    match value {
        None => true,
        Some(ContextValue::String(text)) => text.is_empty(),
        Some(_) => false,
    }
}
