//! The directory section: one entry of two lines for each entity.

use std::collections::HashMap;

use super::sections::Line;
use crate::io::{ImportReport, Severity};

/// One directory entry.
#[derive(Clone, Debug, Default)]
pub(super) struct Entry {
    /// The sequence number of its first line, by which pointers name it.
    pub sequence: usize,
    /// The line of the file.
    pub line: usize,
    pub kind: i64,
    pub form: i64,
    /// The sequence number of the first line of its parameters, and their number of lines.
    pub parameters: usize,
    pub parameter_lines: usize,
    /// The entry of its transform, 0 for none.
    pub transform: usize,
    /// Its colour: a number, or minus the entry of a colour definition.
    pub color: i64,
    /// Whether it is not to be shown.
    pub blanked: bool,
    /// Whether another entity owns it physically.
    pub dependent: bool,
    /// What it is used for; 5 is a curve in parameter space.
    pub usage: i64,
    pub label: String,
}

/// All entries, findable by sequence number.
#[derive(Debug, Default)]
pub(super) struct Directory {
    pub entries: Vec<Entry>,
    by_sequence: HashMap<usize, usize>,
}

impl Directory {
    /// Reads the entries. Lines that pair with no other are reported and left out.
    pub fn of(lines: &[Line<'_>], report: &mut ImportReport) -> Self {
        let mut directory = Self::default();
        let mut at = 0;
        while at < lines.len() {
            let first = lines[at];
            let kind = first.integer(0, 8);
            let second = lines.get(at + 1).copied().filter(|second| {
                let other = second.integer(0, 8);
                kind.is_some() && (other == kind || other == Some(0))
            });
            let Some(second) = second else {
                let text = String::from_utf8_lossy(first.columns(0, 8)).trim().to_owned();
                report.add(
                    Severity::Skipped,
                    "directory",
                    None,
                    Some(first.number),
                    format!("a directory line of type `{text}` has no second line; the entity is lost"),
                );
                at += 1;
                continue;
            };
            let mut unreadable = 0;
            let mut field = |line: &Line<'_>, number: usize| {
                line.integer(8 * (number - 1), 8 * number).unwrap_or_else(|| {
                    unreadable += 1;
                    0
                })
            };
            let unsigned = |value: i64| usize::try_from(value).unwrap_or(0);
            let numbered = first.integer(73, 80).map(unsigned).filter(|n| n % 2 == 1);
            let mut entry = Entry {
                sequence: numbered.unwrap_or(at + 1),
                line: first.number,
                kind: field(&first, 1),
                parameters: unsigned(field(&first, 2)),
                transform: unsigned(field(&first, 7).abs()),
                color: field(&second, 3),
                parameter_lines: unsigned(field(&second, 4)),
                form: field(&second, 5),
                ..Entry::default()
            };
            let status = status_digits(first.columns(64, 72));
            entry.blanked = status[0] == 1;
            entry.dependent = matches!(status[1], 1 | 3);
            entry.usage = status[2];
            let label = String::from_utf8_lossy(second.columns(56, 64)).trim().to_owned();
            let subscript = second.integer(64, 72).unwrap_or(0);
            entry.label = if label.is_empty() || subscript == 0 { label } else { format!("{label} {subscript}") };
            if unreadable > 0 {
                report.add(
                    Severity::Warning,
                    format!("IGES {}", entry.kind),
                    Some(entry.sequence),
                    Some(entry.line),
                    format!("{unreadable} fields of the directory entry are no numbers and were taken as 0"),
                );
            }
            if directory.by_sequence.insert(entry.sequence, directory.entries.len()).is_some() {
                report.add(
                    Severity::Warning,
                    format!("IGES {}", entry.kind),
                    Some(entry.sequence),
                    Some(entry.line),
                    "two directory entries have this number; pointers to it lead to the second",
                );
            }
            directory.entries.push(entry);
            at += 2;
        }
        directory
    }

    /// The place in `entries` of the entry that a pointer names.
    pub fn find(&self, sequence: usize) -> Option<usize> {
        self.by_sequence.get(&sequence).copied()
    }
}

/// The four two-digit numbers of the status field, blanks as zeros.
fn status_digits(field: &[u8]) -> [i64; 4] {
    let mut digits = [0i64; 8];
    let field = field.trim_ascii_end();
    for (digit, &byte) in digits.iter_mut().rev().zip(field.iter().rev()) {
        *digit = if byte.is_ascii_digit() { i64::from(byte - b'0') } else { 0 };
    }
    std::array::from_fn(|i| 10 * digits[2 * i] + digits[2 * i + 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn status_digits_count_from_the_right() {
        assert_eq!(status_digits(b"01010500"), [1, 1, 5, 0]);
        assert_eq!(status_digits(b"   10301"), [0, 1, 3, 1]);
        assert_eq!(status_digits(b"        "), [0; 4]);
        assert_eq!(status_digits(b" 0 0 0 0"), [0; 4]);
    }
}
