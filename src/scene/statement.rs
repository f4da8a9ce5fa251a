//! Splits OBJ and MTL files into statements. Both formats have the same rules for lines, comments and numbers.

use crate::Error;
use std::borrow::Cow;
use std::io::{BufRead, ErrorKind};
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
    /// True if the last line ended with a carriage return. A line feed that follows belongs to the same line end.
    after_return: bool,
    whole: Vec<u8>,
}

impl<'a, R: BufRead> Statements<'a, R> {
    /// Splits `input`. `path` names it in messages.
    pub(super) fn new(input: R, path: &'a Path) -> Statements<'a, R> {
        Statements { input, path, lines: 0, line: Vec::new(), after_return: false, whole: Vec::new() }
    }

    /// Reads the next statement, or returns `None` at the end of the file. Blank lines and comment lines are skipped. A
    /// line that ends with `\` continues on the next line.
    pub(super) fn next(&mut self) -> Result<Option<Statement<'_>>, Error> {
        self.whole.clear();
        let (mut start, mut bytes) = (0, 0);
        while self.read_line()? {
            let line = trimmed(&self.line);
            if start == 0 {
                // A `\` at the end of a comment does not continue it. Otherwise a comment that ends with a Windows
                // folder would swallow the next line.
                if line.is_empty() || line.starts_with(b"#") {
                    continue;
                }
                start = self.lines;
            }
            bytes += self.line.len();
            if bytes > LONGEST {
                return Err(too_long(self.path, start));
            }
            self.whole.extend_from_slice(line);
            if !self.whole.ends_with(b"\\") {
                break;
            }
            self.whole.pop();
            self.whole.push(b' ');
        }
        let bytes = trimmed(&self.whole);
        let text = String::from_utf8_lossy(bytes);
        Ok((start > 0).then_some(Statement { path: self.path, line: start, bytes, text }))
    }

    /// Reads the next line into `self.line`, without its line end: a line feed, a carriage return, or both. Returns
    /// false at the end of the file.
    fn read_line(&mut self) -> Result<bool, Error> {
        self.line.clear();
        self.lines += 1;
        let mut at_end = true;
        loop {
            let bytes = match self.input.fill_buf() {
                Ok(bytes) => bytes,
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(e) => return Err(Error::input(self.path, format!("cannot be read: {e}"))),
            };
            if bytes.is_empty() {
                break;
            }
            if std::mem::take(&mut self.after_return) && bytes[0] == b'\n' {
                self.input.consume(1);
                continue;
            }
            at_end = false;
            let bytes = &bytes[..bytes.len().min(LONGEST + 1 - self.line.len())];
            let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            self.after_return = end.is_some_and(|end| bytes[end] == b'\r');
            self.line.extend_from_slice(&bytes[..end.unwrap_or(bytes.len())]);
            let read = end.map_or(bytes.len(), |end| end + 1);
            self.input.consume(read);
            if self.line.len() > LONGEST {
                return Err(too_long(self.path, self.lines));
            }
            if end.is_some() {
                break;
            }
        }
        // A byte order mark stands at the beginning of a file, or of each file of several that were joined into one.
        while self.line.starts_with("\u{feff}".as_bytes()) {
            self.line.drain(..3);
        }
        Ok(!at_end)
    }
}

/// Removes the white space around a line. Lines that are not UTF-8 occur in old files, and have ASCII's white space.
fn trimmed(line: &[u8]) -> &[u8] {
    std::str::from_utf8(line).map_or_else(|_| line.trim_ascii(), |text| text.trim().as_bytes())
}

fn too_long(path: &Path, line: u64) -> Error {
    Error::input(path, format!("line {line}: more than {LONGEST} bytes on one line; give a text file, OBJ or MTL"))
}

/// One statement, without the white space around it.
pub(super) struct Statement<'a> {
    path: &'a Path,
    line: u64,
    /// The statement as it is in the file.
    bytes: &'a [u8],
    /// The same as text. Bytes that are not UTF-8 are replaced by U+FFFD.
    text: Cow<'a, str>,
}

impl<'a> Statement<'a> {
    /// Returns the number of the line on which the statement starts, counted from 1.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// Returns the first word.
    pub(super) fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// Returns everything after the keyword. Names are read in this way, since they may contain spaces and `#`, and
    /// bytes that are not UTF-8. Quotes around it are left out.
    pub(super) fn name(&self) -> &'a [u8] {
        let space = |byte: &u8| byte.is_ascii_whitespace();
        let name: &[u8] = match std::str::from_utf8(self.bytes) {
            Ok(text) => text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim()).as_bytes(),
            Err(_) => self.bytes.iter().position(space).map_or(b"", |at| self.bytes[at..].trim_ascii()),
        };
        name.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(name)
    }

    /// Returns the words after the keyword, up to a comment if there is one.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        let before_comment = self.text.split('#').next().unwrap_or_default();
        before_comment.split_whitespace().skip(1)
    }

    /// Returns the error that this statement is invalid, because of `what`.
    pub(super) fn refuse(&self, what: impl AsRef<str>) -> Error {
        Error::input(self.path, on_line(self.line, what))
    }

    /// Returns the beginning of a notice about this statement: the file, the line and `what`.
    pub(super) fn notice(&self, what: impl AsRef<str>) -> String {
        self.refuse(what).to_string()
    }
}

/// Returns `what`, after the line that it is about.
pub(super) fn on_line(line: u64, what: impl AsRef<str>) -> String {
    format!("line {line}: {}", what.as_ref())
}

/// Parses a finite number.
pub(super) fn number(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("{} is not a finite number", quoted(word))),
        Err(_) if word.contains(',') => Err(format!("{} is not a number; write a decimal point", quoted(word))),
        Err(_) => Err(format!("{} is not a number", quoted(word))),
    }
}

/// Quotes a word of a file for a message. See [`Error::shown`].
pub(super) fn quoted(word: impl AsRef<[u8]>) -> String {
    format!("\"{}\"", Error::shown(&String::from_utf8_lossy(word.as_ref())))
}
