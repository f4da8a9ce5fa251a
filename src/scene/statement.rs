//! Splits OBJ and MTL files into statements. Both formats have the same rules for lines, comments and numbers.

use crate::Error;
use std::io::{BufRead, Read as _};
use std::path::Path;

/// The most bytes that a line may have, and a statement after its lines are joined. This is 32 bytes for each corner of
/// the largest face that is allowed. A longer line is refused before more of it is kept in memory, so that a large file
/// without line ends does not fill the memory.
const LONGEST: usize = 1 << 21;

/// Splits a file into statements while it is being read, so that only one statement at a time is in memory.
pub(super) struct Statements<'a, R> {
    input: R,
    path: &'a Path,
    /// The number of lines read so far.
    lines: u64,
    line: Vec<u8>,
    whole: String,
}

impl<'a, R: BufRead> Statements<'a, R> {
    /// Splits `input`. `path` names it in messages.
    pub(super) fn new(input: R, path: &'a Path) -> Statements<'a, R> {
        Statements { input, path, lines: 0, line: Vec::new(), whole: String::new() }
    }

    /// Reads the next statement, or returns `None` at the end of the file. Blank lines and comment lines are skipped. A
    /// line that ends with `\` continues on the next line. Bytes that are not UTF-8, which occur in names and comments
    /// of old files, are replaced by U+FFFD.
    pub(super) fn next(&mut self) -> Result<Option<Statement<'_>>, Error> {
        self.whole.clear();
        let (mut start, mut bytes) = (0, 0);
        while self.read_line()? {
            let text = String::from_utf8_lossy(&self.line);
            let text = text.trim();
            if start == 0 {
                // A `\` at the end of a comment does not continue it. Otherwise a comment that ends with a Windows
                // folder would swallow the next line.
                if text.is_empty() || text.starts_with('#') {
                    continue;
                }
                start = self.lines;
            }
            // The file's own bytes are counted, not those of `text`, in which U+FFFD takes three bytes.
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

    /// Reads the next line into `self.line`. Returns false at the end of the file.
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
    Error::input(path, format!("line {line}: more than {LONGEST} bytes on one line; give a text file, OBJ or MTL"))
}

/// One statement, without the white space around it.
pub(super) struct Statement<'a> {
    path: &'a Path,
    line: u64,
    text: &'a str,
}

impl<'a> Statement<'a> {
    /// Returns the number of the line on which the statement starts, counted from 1.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// Returns the first word.
    pub(super) fn keyword(&self) -> &'a str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// Returns everything after the keyword. Names are read in this way, since they may contain spaces and `#`.
    pub(super) fn name(&self) -> &'a str {
        self.text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// Returns the words after the keyword, up to a comment if there is one.
    pub(super) fn words(&self) -> impl Iterator<Item = &'a str> {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    /// Returns the error that this statement is invalid, because of `what`.
    pub(super) fn refuse(&self, what: impl AsRef<str>) -> Error {
        Error::input(self.path, format!("line {}: {}", self.line, what.as_ref()))
    }
}

/// Parses a finite number.
pub(super) fn number(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("{} is not a finite number", quoted(word))),
        Err(_) => Err(format!("{} is not a number", quoted(word))),
    }
}

/// Quotes a word of a file for a message. See [`Error::shown`].
pub(super) fn quoted(word: &str) -> String {
    format!("\"{}\"", Error::shown(word))
}
