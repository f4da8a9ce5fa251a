//! Flags that take a value, and the reading of values: text, numbers, words and paths.

use clap::{Arg, ArgMatches, value_parser};
use hbao::Error;
use std::path::PathBuf;

/// Makes a flag that takes a value.
pub(crate) fn valued(name: &'static str, value: &'static str, help: impl Into<String>) -> Arg {
    Arg::new(name).long(name).value_name(value).allow_negative_numbers(true).help(help.into())
}

/// Makes a flag whose value may begin with a minus even if it is more than a number: `-1,2,3`, `-1%`.
pub(crate) fn signed(name: &'static str, value: &'static str, help: impl Into<String>) -> Arg {
    valued(name, value, help).allow_hyphen_values(true)
}

/// Makes a flag that takes a path.
pub(crate) fn path(name: &'static str, value: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).value_name(value).value_parser(value_parser!(PathBuf)).help(help)
}

/// Returns the value whose name is the text of a flag, from a list of names and values.
pub(crate) fn word<T: Copy>(flag: &str, text: &str, names: &[(&str, T)]) -> Result<T, Error> {
    let found = names.iter().find(|(name, _)| *name == text);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<_> = names.iter().map(|&(name, _)| name).collect();
        Error::Usage(format!("--{flag}: '{text}' is not one of {}", names.join(", ")))
    })
}

/// Returns the text of a flag's value, if the flag was given.
pub(crate) fn text<'a>(matches: &'a ArgMatches, name: &str) -> Option<&'a str> {
    matches.get_one::<String>(name).map(String::as_str)
}

/// Returns the number that a flag gives, if the flag was given.
pub(crate) fn number(matches: &ArgMatches, name: &str) -> Result<Option<f64>, Error> {
    let Some(text) = text(matches, name) else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| Error::Usage(format!("--{name}: '{text}' is not a number")))
}

/// Returns the N numbers of a flag's value, which are separated by commas. `form` says in a message what they are.
pub(crate) fn numbers<const N: usize>(matches: &ArgMatches, name: &str, form: &str) -> Result<Option<[f64; N]>, Error> {
    let Some(text) = text(matches, name) else { return Ok(None) };
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let numbers = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    numbers.map(Some).ok_or_else(|| Error::Usage(format!("--{name}: '{text}' is not {form}")))
}
