//! The header of a PLY file: which records follow it, and in which form.

use crate::Error;
use std::io::{BufRead, ErrorKind};

/// The most bytes of a line.
pub(super) const LONGEST: usize = 1 << 21;
const MOST_ELEMENTS: usize = 64;
const MOST_PROPERTIES: usize = 1024;

/// How numbers are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Text,
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Number,
    /// The type of the number of entries, for a list.
    pub(super) count: Option<Number>,
}

pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

pub(super) struct Header {
    pub(super) order: Order,
    pub(super) elements: Vec<Element>,
    /// Its lines, which go on after it if the file is text.
    pub(super) lines: Lines,
    /// The number of its bytes.
    bytes: u64,
    /// The line of a comment that names the file of a texture, as MeshLab writes it.
    pub(super) texture: Option<u64>,
}

/// Splits a file into lines.
pub(super) struct Lines {
    /// The byte with which lines end. A carriage return before it belongs to the line end.
    pub(super) end: u8,
    pub(super) line: Vec<u8>,
    /// The number of lines read so far.
    pub(super) count: u64,
}

impl Lines {
    /// Reads the next line into `self.line`. Returns the number of its bytes in the file, or 0 at the file's end.
    pub(super) fn next(&mut self, input: &mut impl BufRead) -> Result<usize, String> {
        self.line.clear();
        self.count += 1;
        let mut read = 0;
        loop {
            let bytes = match input.fill_buf() {
                Ok(bytes) => bytes,
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(e) => return Err(format!("cannot be read: {e}")),
            };
            let end = bytes.iter().position(|&byte| byte == self.end);
            let part = end.map_or(bytes.len(), |end| end + 1);
            let at_end = bytes.is_empty();
            self.line.extend_from_slice(&bytes[..end.unwrap_or(bytes.len())]);
            input.consume(part);
            read += part;
            if self.line.len() > LONGEST {
                return Err(format!("line {}: more than {LONGEST} bytes on one line", self.count));
            }
            if at_end || end.is_some() {
                if self.line.ends_with(b"\r") {
                    self.line.pop();
                }
                return Ok(read);
            }
        }
    }
}

impl Number {
    fn of(name: &str) -> Option<Number> {
        Some(match name {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    /// Returns the number that stands for the full colour.
    pub(super) fn most(self) -> f64 {
        match self {
            Number::I8 => f64::from(i8::MAX),
            Number::U8 => f64::from(u8::MAX),
            Number::I16 => f64::from(i16::MAX),
            Number::U16 => f64::from(u16::MAX),
            Number::I32 => f64::from(i32::MAX),
            Number::U32 => f64::from(u32::MAX),
            Number::F32 | Number::F64 => 1.0,
        }
    }

    /// Returns the number of bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }
}

impl Header {
    /// Reads the header, of which the file begins with `ply` and a line end.
    pub(super) fn read(input: &mut impl BufRead) -> Result<Header, String> {
        // Files of the old Macintosh end lines with a carriage return alone.
        let start = input.fill_buf().map_err(|e| format!("cannot be read: {e}"))?;
        let end = if start.get(3) == Some(&b'\r') && start.get(4) != Some(&b'\n') { b'\r' } else { b'\n' };
        let lines = Lines { end, line: Vec::new(), count: 0 };
        let mut header = Header { order: Order::Text, elements: Vec::new(), lines, bytes: 0, texture: None };
        let mut format = false;
        loop {
            let read = header.lines.next(input)?;
            header.bytes += read as u64;
            if read == 0 {
                return Err("this PLY file ends inside its header, before end_header".into());
            }
            let text = String::from_utf8_lossy(&header.lines.line).into_owned();
            let words: Vec<&str> = text.split_ascii_whitespace().take(6).collect();
            let done = header.statement(&words, &mut format);
            if done.map_err(|what| format!("line {}: {what}", header.lines.count))? {
                return Ok(header);
            }
        }
    }

    /// Reads one line of the header. Returns true if it is the last one.
    fn statement(&mut self, words: &[&str], format: &mut bool) -> Result<bool, String> {
        let shown = |word: &str| format!("\"{}\"", Error::shown(word));
        let number = |word: &str| Number::of(word).ok_or_else(|| format!("{} is no type of PLY", shown(word)));
        match *words {
            ["comment", "TextureFile", ..] => self.texture = Some(self.lines.count),
            ["ply"] | [] | ["comment" | "obj_info", ..] => {}
            ["format", name, version] => {
                *format = true;
                self.order = match name {
                    "ascii" => Order::Text,
                    "binary_little_endian" => Order::Little,
                    "binary_big_endian" => Order::Big,
                    _ => return Err(format!("{} is no format of PLY", shown(name))),
                };
                if version != "1.0" {
                    return Err(format!("PLY {} is not read, only 1.0", shown(version)));
                }
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("{} is no number of records", shown(count)))?;
                if self.elements.iter().any(|element| element.name == name) {
                    return Err(format!("a second element {}", shown(name)));
                }
                let before = ["face", "tristrips"].iter().any(|of| self.elements.iter().any(|e| e.name == *of));
                if name == "vertex" && before {
                    return Err("the vertices stand after the faces; write them before".into());
                }
                if self.elements.len() == MOST_ELEMENTS {
                    return Err(format!("more than {MOST_ELEMENTS} elements"));
                }
                self.elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", ref kind @ .., name] => {
                let (kind, count) = match *kind {
                    ["list", count, kind] => (number(kind)?, Some(number(count)?)),
                    [kind] => (number(kind)?, None),
                    _ => return Err("write property TYPE NAME, or property list TYPE TYPE NAME".into()),
                };
                let element = self.elements.last_mut().ok_or("a property before the first element")?;
                if element.properties.iter().any(|property| property.name == name) {
                    return Err(format!("a second property {}", shown(name)));
                }
                if element.properties.len() == MOST_PROPERTIES {
                    return Err(format!("more than {MOST_PROPERTIES} properties"));
                }
                element.properties.push(Property { name: name.into(), kind, count });
            }
            ["end_header"] if *format => return Ok(true),
            ["end_header"] => return Err("the header has no line format".into()),
            [word, ..] => return Err(format!("{} is no line of a PLY header", shown(word))),
        }
        Ok(false)
    }

    /// Refuses a file that is shorter than its header claims. `length` is the number of its bytes.
    pub(super) fn check_length(&self, length: u64) -> Result<(), String> {
        let holds = u128::from(length.saturating_sub(self.bytes));
        let mut needed = 0;
        for Element { name, count, properties } in &self.elements {
            let least: usize = match self.order {
                // A digit and a space or a line end for each number.
                Order::Text => 2 * properties.len(),
                _ => properties.iter().map(|property| property.count.unwrap_or(property.kind).size()).sum(),
            };
            needed += u128::from(*count) * least as u128;
            // The last line of a text may lack its end.
            if needed > holds + 1 {
                return Err(format!(
                    "this PLY file claims {count} records of {}, which need more bytes than it has: it has been cut short",
                    Error::shown(name)
                ));
            }
        }
        Ok(())
    }
}
