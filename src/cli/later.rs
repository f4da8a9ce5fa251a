//! Options of the contract that are not built yet. They are known, so that a program that spells out the defaults
//! works today, and one that asks for more is told so rather than that there is no such flag.

use clap::{Arg, ArgAction, ArgMatches};
use hbao::Error;
use hbao::settings::Method;

/// The methods to come, beside those that [`hbao::settings::Method`] names.
const METHODS: &[&str] = &["hbao-view", "ssao"];

/// What an option takes.
enum Takes {
    Nothing,
    Word(&'static [&'static str]),
}

/// One option to come.
struct Later {
    name: &'static str,
    value: &'static str,
    takes: Takes,
    /// The values that ask for nothing beyond what is built.
    accepted: &'static [&'static str],
    /// Why an accepted value has no effect; none where it says what is done anyway.
    idle: Option<&'static str>,
    help: &'static str,
}

const NOT_YET_SSAO: Option<&str> = Some("without --method ssao, which is not built yet");

static OPTIONS: &[Later] = &[
    Later {
        name: "msaa",
        value: "N",
        takes: Takes::Word(&["1", "2", "4", "8"]),
        accepted: &["1"],
        idle: None,
        help: "Depth samples a pixel",
    },
    Later {
        name: "edges",
        value: "EDGES",
        takes: Takes::Word(&["supersample", "off"]),
        accepted: &["supersample", "off"],
        idle: Some("without MSAA"),
        help: "Blur around every depth sample of edge pixels, or not",
    },
    Later {
        name: "half-res",
        value: "",
        takes: Takes::Nothing,
        accepted: &[],
        idle: None,
        help: "Ambient occlusion at half the width and height",
    },
    Later {
        name: "ssao-rotation",
        value: "ROTATION",
        takes: Takes::Word(&["matrix", "mirror"]),
        accepted: &["matrix"],
        idle: NOT_YET_SSAO,
        help: "Turn the offsets of ssao, or reflect them",
    },
    Later {
        name: "ssao-depth",
        value: "DEPTH",
        takes: Takes::Word(&["full", "half"]),
        accepted: &["full"],
        idle: NOT_YET_SSAO,
        help: "The size of the depth image that ssao reads",
    },
    Later {
        name: "ssao-normals",
        value: "NORMALS",
        takes: Takes::Word(&["off", "on"]),
        accepted: &["off"],
        idle: NOT_YET_SSAO,
        help: "Flip the offsets of ssao into the normal's hemisphere, or not",
    },
    Later {
        name: "ssao-samples",
        value: "N",
        takes: Takes::Word(&["8", "16", "24"]),
        accepted: &["16"],
        idle: NOT_YET_SSAO,
        help: "The samples of ssao",
    },
    Later {
        name: "ssao-curve",
        value: "CURVE",
        takes: Takes::Word(&["on", "off"]),
        accepted: &["on"],
        idle: NOT_YET_SSAO,
        help: "The final A^2 + A of ssao, or not",
    },
];

/// The options as clap's arguments.
pub(crate) fn arguments() -> impl Iterator<Item = Arg> {
    OPTIONS.iter().map(|option| {
        let arg = Arg::new(option.name).long(option.name).help_heading("Not built yet");
        let takes = match option.takes {
            Takes::Nothing => return arg.action(ArgAction::SetTrue).help(option.help),
            Takes::Word(words) => words.join(", "),
        };
        let today = match option.accepted {
            [only] => format!("only {only} may be given"),
            _ => "no effect".into(),
        };
        let help = format!("{} [{takes}; today {today}]", option.help);
        arg.value_name(option.value).allow_negative_numbers(true).help(help)
    })
}

/// What `--help` adds to the methods there are.
pub(crate) fn methods_help() -> String {
    format!("\n(not built yet: {})", METHODS.join(", "))
}

/// Refuses a method to come; an unknown word is left to the settings.
pub(crate) fn check_method(method: &str) -> Result<(), Error> {
    if METHODS.contains(&method) {
        return Err(Error::Usage(format!(
            "--method {method} is not built yet: use one of {}",
            Method::NAMES.join(", ")
        )));
    }
    Ok(())
}

/// Refuses what is not built yet, and what never will be; returns what to say of options without effect.
pub(crate) fn check(matches: &ArgMatches) -> Result<Vec<String>, Error> {
    let mut notices = Vec::new();
    for option in OPTIONS {
        let name = option.name;
        if let Takes::Nothing = option.takes {
            if matches.get_flag(name) {
                return Err(Error::Usage(format!("--{name} is not built yet: leave it out")));
            }
            continue;
        }
        let Some(text) = matches.get_one::<String>(name) else { continue };
        let (known, range) = match option.takes {
            Takes::Word(words) => (words.contains(&text.as_str()), format!("is none of {}", words.join(", "))),
            Takes::Nothing => (true, String::new()),
        };
        if !known {
            return Err(Error::Usage(format!("--{name}: '{text}' {range}")));
        }
        if !option.accepted.contains(&text.as_str()) {
            let built = option.accepted.join(" or ");
            return Err(Error::Usage(format!("--{name} {text} is not built yet: use {built}, or leave it out")));
        }
        notices.extend(option.idle.map(|why| format!("--{name} has no effect {why}")));
    }
    Ok(notices)
}
