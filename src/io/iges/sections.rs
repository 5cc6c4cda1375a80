//! The lines of an IGES file, sorted by the letter in column 73 into its sections.
//!
//! Lines end with LF, CRLF or CR; a file without any line end is cut every 80 bytes. Lines without a section
//! letter are counted, not guessed at.

use super::IgesError;

/// One line of a section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Its text, all columns.
    pub text: &'a [u8],
    /// Its number in the file, from 1.
    pub number: usize,
}

impl<'a> Line<'a> {
    /// Columns `from..to`, counted from 0, cut at the end of the line.
    pub fn columns(&self, from: usize, to: usize) -> &'a [u8] {
        self.text.get(from.min(self.text.len())..to.min(self.text.len())).unwrap_or_default()
    }

    /// The number in columns `from..to`: 0 when blank, `None` when there is something else.
    pub fn integer(&self, from: usize, to: usize) -> Option<i64> {
        let field = self.columns(from, to).trim_ascii();
        if field.is_empty() { Some(0) } else { std::str::from_utf8(field).ok()?.parse().ok() }
    }
}

/// The lines of a file by section.
#[derive(Debug, Default)]
pub(super) struct Sections<'a> {
    pub global: Vec<Line<'a>>,
    pub directory: Vec<Line<'a>>,
    pub parameter: Vec<Line<'a>>,
    /// Whether the terminate section is there; a file that was cut off has none.
    pub terminated: bool,
    /// Lines without a section letter, and the first of them.
    pub strays: usize,
    pub first_stray: usize,
}

impl<'a> Sections<'a> {
    pub fn of(bytes: &'a [u8]) -> Result<Self, IgesError> {
        let mut sections = Self::default();
        let mut number = 0;
        let mut take = |text: &'a [u8]| -> Result<(), IgesError> {
            number += 1;
            if text.trim_ascii().is_empty() {
                return Ok(());
            }
            let line = Line { text, number };
            match text.get(72) {
                Some(b'S') => {}
                Some(b'G') => sections.global.push(line),
                Some(b'D') => sections.directory.push(line),
                Some(b'P') => sections.parameter.push(line),
                Some(b'T') => sections.terminated = true,
                Some(b'B') if number == 1 => return Err(IgesError::Binary),
                Some(b'C') if number == 1 => return Err(IgesError::Compressed),
                _ => {
                    sections.strays += 1;
                    if sections.strays == 1 {
                        sections.first_stray = number;
                    }
                }
            }
            Ok(())
        };
        if bytes.contains(&b'\n') {
            for text in bytes.split(|&b| b == b'\n') {
                take(text.strip_suffix(b"\r").unwrap_or(text))?;
            }
        } else if bytes.contains(&b'\r') {
            for text in bytes.split(|&b| b == b'\r') {
                take(text)?;
            }
        } else {
            for text in bytes.chunks(80) {
                take(text)?;
            }
        }
        Ok(sections)
    }
}
