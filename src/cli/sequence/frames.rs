//! Which frames of a sequence are rendered, and what their files are called.

use crate::cli::flags::{text, valued};
use clap::{Arg, ArgMatches};
use hbao::Error;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Makes the flags that choose frames.
pub(super) fn arguments() -> [Arg; 2] {
    [
        valued("frames", "A-B,STEP", "Render only frames A to B, every STEP-th of them [default: all]"),
        valued(
            "chunk",
            "I/N",
            "Render only part I of N equal parts of the frames, counted from 0: one for each machine",
        ),
    ]
}

/// Returns those of the frames that the flags choose.
pub(super) fn read(matches: &ArgMatches, all: RangeInclusive<u32>) -> Result<Vec<u32>, Error> {
    let mut frames: Vec<u32> = match text(matches, "frames") {
        None => all.collect(),
        Some(given) => {
            let refuse = |what: String| Error::Usage(format!("--frames: '{given}' {what}"));
            let (range, step) = given.split_once(',').unwrap_or((given, "1"));
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            let numbers = [first, last, step].map(|text| text.trim().parse::<u32>().ok());
            let [Some(first), Some(last), Some(step @ 1..)] = numbers else {
                return Err(refuse("is not A-B,STEP, whole numbers such as 10-20,2, or 10-20, or 10".into()));
            };
            if first > last {
                return Err(refuse(format!("has its first frame, {first}, after its last, {last}")));
            }
            if !all.contains(&first) || !all.contains(&last) {
                let (start, end) = all.into_inner();
                return Err(refuse(format!("has frames that there are not: they are {start} to {end}")));
            }
            (first..=last).step_by(step as usize).collect()
        }
    };
    if let Some(given) = text(matches, "chunk") {
        let numbers =
            given.split_once('/').map(|(index, count)| [index, count].map(|text| text.trim().parse::<usize>()));
        let Some([Ok(index), Ok(count)]) =
            numbers.filter(|[index, count]| matches!((index, count), (Ok(i), Ok(n)) if i < n))
        else {
            let what = "is not I/N, the part I, from 0 to N - 1, of N, such as 0/4";
            return Err(Error::Usage(format!("--chunk: '{given}' {what}")));
        };
        let end = |index: usize| (frames.len() as u128 * index as u128 / count as u128) as usize;
        frames = frames[end(index)..end(index + 1)].to_vec();
    }
    Ok(frames)
}

/// The most signs `#` in a name.
const MOST_DIGITS: usize = 20;

/// The names of the files: the number of a frame takes the place of the signs `#`.
pub(super) struct Names {
    before: String,
    digits: usize,
    after: String,
    folder: PathBuf,
}

impl Names {
    /// Reads the value of `--output`.
    pub(super) fn read(output: &Path) -> Result<Names, Error> {
        let refuse = |what: &str| Err(Error::Usage(format!("--output {}: {what}", output.display())));
        let Some(name) = output.file_name().and_then(|name| name.to_str()) else {
            return refuse("it must end with the name of the frames' files, in UTF-8, such as frame.####.png");
        };
        let Some(start) = name.find('#') else {
            return refuse("its name must hold the signs #### where the frame's number goes, such as frame.####.png");
        };
        let digits = name[start..].chars().take_while(|&c| c == '#').count();
        if digits > MOST_DIGITS {
            return refuse("its name holds more signs # than a number has digits: 20 at most");
        }
        let (before, after) = (name[..start].to_string(), name[start + digits..].to_string());
        if after.contains('#') {
            return refuse("its name may hold only one row of the signs ####, for the frame's number");
        }
        Ok(Names { before, digits, after, folder: output.parent().unwrap_or(Path::new("")).into() })
    }

    /// Returns the path of a frame's file. A number with more digits than there are signs has all of them.
    pub(super) fn of(&self, frame: u32) -> PathBuf {
        let Names { before, digits, after, folder } = self;
        folder.join(format!("{before}{frame:0digits$}{after}"))
    }
}
