//! The statements of OBJ and MTL files: both formats share the rules for lines, comments and numbers.

use crate::Error;
use std::io::{BufRead, Read as _};
use std::path::Path;

/// Bytes of the longest line, and of the longest statement when its lines are joined: 32 for each corner of the largest
/// face. What is longer, as all of a file without line ends is, is refused before more of it is kept.
const LONGEST: usize = 1 << 21;

/// Splits a file into statements while it is read, so that one of them at a time is in memory.
pub(super) struct Statements<'a, R> {
    input: R,
    path: &'a Path,
    /// Lines read so far.
    lines: u64,
    line: Vec<u8>,
    whole: String,
}

impl<'a, R: BufRead> Statements<'a, R> {
    /// The statements of `input`; `path` is for messages.
    pub(super) fn new(input: R, path: &'a Path) -> Statements<'a, R> {
        Statements { input, path, lines: 0, line: Vec::new(), whole: String::new() }
    }

    /// The next statement. Blank lines and comment lines are passed over; a line that ends with `\` continues on the
    /// next. Bytes that are not UTF-8, as in names and comments of old files, are replaced.
    pub(super) fn next(&mut self) -> Result<Option<Statement<'_>>, Error> {
        self.whole.clear();
        let (mut start, mut bytes) = (0, 0);
        while self.read_line()? {
            let text = String::from_utf8_lossy(&self.line);
            let text = text.trim();
            if start == 0 {
                // A comment does not continue: one that ends in a Windows path would swallow the line after it.
                if text.is_empty() || text.starts_with('#') {
                    continue;
                }
                start = self.lines;
            }
            // Bytes of the file: what stands for one that is not UTF-8 has three.
            bytes += self.line.len();
            if bytes > LONGEST {
                return Err(too_long(self.path, start));
            }
            self.whole.push_str(text);
            if !self.whole.ends_with('\\') {
                break;
            }
            self.whole.pop();
            self.whole.push(' ');
        }
        let text = self.whole.trim_end();
        Ok((start > 0).then_some(Statement { path: self.path, line: start, text }))
    }

    /// Reads the next line, false at the end of the file.
    fn read_line(&mut self) -> Result<bool, Error> {
        self.line.clear();
        let most = LONGEST as u64 + 1;
        let read = (&mut self.input).take(most).read_until(b'\n', &mut self.line);
        let read = read.map_err(|e| Error::input(self.path, format!("cannot be read: {e}")))?;
        self.lines += 1;
        if read as u64 == most {
            return Err(too_long(self.path, self.lines));
        }
        if self.lines == 1 && self.line.starts_with("\u{feff}".as_bytes()) {
            self.line.drain(..3);
        }
        Ok(read > 0)
    }
}

fn too_long(path: &Path, line: u64) -> Error {
    Error::input(path, format!("line {line}: more than {LONGEST} bytes on one line; is it a text file?"))
}

/// One statement: its text without surrounding white space.
pub(super) struct Statement<'a> {
    path: &'a Path,
    line: u64,
    text: &'a str,
}

impl<'a> Statement<'a> {
    /// The number of the line it starts on.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// The first word.
    pub(super) fn keyword(&self) -> &'a str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// Everything after the keyword: names may hold spaces and `#`.
    pub(super) fn name(&self) -> &'a str {
        self.text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the keyword, up to a comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &'a str> {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    /// That it makes no sense, and why.
    pub(super) fn refuse(&self, what: impl AsRef<str>) -> Error {
        Error::input(self.path, format!("line {}: {}", self.line, what.as_ref()))
    }
}

/// Reads a finite number.
pub(super) fn number(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("{} is not a finite number", quoted(word))),
        Err(_) => Err(format!("{} is not a number", quoted(word))),
    }
}

/// A word of a file as it may appear in a message.
pub(super) fn quoted(word: &str) -> String {
    format!("\"{}\"", Error::shown(word))
}
