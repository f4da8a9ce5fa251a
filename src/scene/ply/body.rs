//! The records of a PLY file.

use super::super::source::fill;
use super::super::statement::quoted;
use super::header::{Element, Lines, Number, Order, Property};
use std::io::BufRead;

/// Reads the numbers of a PLY file in their order.
pub(super) struct Body<R> {
    input: R,
    order: Order,
    lines: Lines,
    /// How much of the line has been read.
    read: usize,
    /// The name of the element and the number of the record, counted from 1.
    record: (String, u64),
}

impl<R: BufRead> Body<R> {
    /// `lines` lines of the file have been read.
    pub(super) fn new(input: R, order: Order, lines: Lines) -> Body<R> {
        Body { input, order, lines, read: 0, record: (String::new(), 0) }
    }

    /// Returns `what`, after the place in the file.
    pub(super) fn at(&self, what: impl AsRef<str>) -> String {
        let what = what.as_ref();
        match self.order {
            Order::Text => format!("line {}: {what}", self.lines.count),
            _ => format!("{} {}: {what}", crate::Error::shown(&self.record.0), self.record.1),
        }
    }

    fn cut_short(&self) -> String {
        let (name, number) = &self.record;
        format!("this PLY file ends before {} {number} ends: it has been cut short", crate::Error::shown(name))
    }

    /// Begins record number `i` of `element`, counted from 0.
    pub(super) fn start(&mut self, element: &Element, i: u64) -> Result<(), String> {
        if i == 0 {
            self.record.0.clone_from(&element.name);
        }
        self.record.1 = i + 1;
        if self.order == Order::Text {
            self.read = 0;
            loop {
                if self.lines.next(&mut self.input)? == 0 {
                    return Err(self.cut_short());
                }
                if !self.lines.line.trim_ascii().is_empty() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Ends the record.
    pub(super) fn end(&mut self) -> Result<(), String> {
        if self.order == Order::Text && !self.lines.line[self.read..].trim_ascii().is_empty() {
            return Err(self.at(format!("more numbers than {} has properties", crate::Error::shown(&self.record.0))));
        }
        Ok(())
    }

    /// Reads a number.
    pub(super) fn number(&mut self, kind: Number) -> Result<f64, String> {
        if self.order == Order::Text {
            let word = self.word()?;
            let word = &self.lines.line[word];
            // Text has more digits than float32, and they are kept.
            let x = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
            return x.ok_or_else(|| self.at(format!("{} is not a number", quoted(word))));
        }
        let mut bytes = [0; 8];
        let size = kind.size();
        if !fill(&mut self.input, &mut bytes[..size])? {
            return Err(self.cut_short());
        }
        if self.order == Order::Big {
            bytes[..size].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match kind {
            Number::I8 => f64::from(a as i8),
            Number::U8 => f64::from(a),
            Number::I16 => f64::from(i16::from_le_bytes([a, b])),
            Number::U16 => f64::from(u16::from_le_bytes([a, b])),
            Number::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Number::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Number::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Number::F64 => f64::from_le_bytes(bytes),
        })
    }

    /// Reads the number of entries of a list.
    pub(super) fn count(&mut self, property: &Property) -> Result<u64, String> {
        let Some(kind) = property.count else { return Ok(1) };
        let x = self.number(kind)?;
        if x.fract() == 0.0 && (0.0..=u32::MAX as f64).contains(&x) {
            return Ok(x as u64);
        }
        Err(self.at(format!("a list cannot have {x} entries")))
    }

    /// Skips a number or a list.
    pub(super) fn skip(&mut self, property: &Property) -> Result<(), String> {
        for _ in 0..self.count(property)? {
            if self.order == Order::Text {
                self.word()?;
            } else {
                self.number(property.kind)?;
            }
        }
        Ok(())
    }

    /// Returns where the next word of the line stands.
    fn word(&mut self) -> Result<std::ops::Range<usize>, String> {
        let rest = &self.lines.line[self.read..];
        let Some(start) = rest.iter().position(|byte| !byte.is_ascii_whitespace()) else {
            return Err(self.at(format!("fewer numbers than {} has properties", crate::Error::shown(&self.record.0))));
        };
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        let word = self.read + start..self.read + start + length;
        self.read = word.end;
        Ok(word)
    }
}
