//! The statements of OBJ and MTL files: both formats share the rules for lines, comments and numbers.

use std::borrow::Cow;

/// Splits a file into statements: the number of the line a statement starts on, its keyword, and what follows.
/// Blank lines and comment lines are passed over; a line that ends with `\` continues on the next.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, Statement<'_>)> {
    let mut lines = text.strip_prefix('\u{feff}').unwrap_or(text).lines().zip(1..);
    std::iter::from_fn(move || {
        loop {
            let (line, number) = lines.next()?;
            let line = line.trim();
            // A comment does not continue: one that ends in a Windows path would swallow the line after it.
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let mut whole = Cow::Borrowed(line);
            while whole.ends_with('\\') {
                let joined = whole.to_mut();
                joined.pop();
                joined.push(' ');
                joined.push_str(lines.next().map_or("", |(next, _)| next.trim()));
            }
            return Some((number, Statement(whole)));
        }
    })
}

/// One statement: its text without surrounding white space, never empty.
pub(super) struct Statement<'a>(Cow<'a, str>);

impl Statement<'_> {
    /// The first word.
    pub(super) fn keyword(&self) -> &str {
        self.0.split_whitespace().next().unwrap_or("")
    }

    /// Everything after the keyword: names may hold spaces and `#`.
    pub(super) fn name(&self) -> &str {
        self.0.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the keyword, up to a comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.0.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
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

/// A word of a file as it may appear in a message: on one line, printable and not too long.
pub(super) fn quoted(word: &str) -> String {
    const LONGEST: usize = 60;
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?}...", &word[..end]),
        None => format!("{word:?}"),
    }
}
