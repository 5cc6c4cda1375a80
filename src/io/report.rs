//! What happened to the entities of a file while it was read: the contract that nothing is dropped silently.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// How much a report line matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Read as it stands, but not the way the file has it (a trimmed face as its whole surface).
    Info,
    /// Read with a repair or a guess.
    Warning,
    /// Not read: this geometry is missing from the document.
    Skipped,
}

impl Severity {
    /// The word for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Skipped => "skipped",
        }
    }
}

/// One thing worth knowing about one entity of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportLine {
    /// How much it matters.
    pub severity: Severity,
    /// The entity's type in the words of the format ("IGES 144", "header").
    pub entity: String,
    /// Where it is: the directory entry of IGES, the statement number of STEP; `None` for the whole file.
    pub at: Option<usize>,
    /// The line of the file, from 1, where known.
    pub line: Option<usize>,
    /// What was done, and why.
    pub reason: String,
}

impl fmt::Display for ReportLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.severity.name(), self.entity)?;
        if let Some(at) = self.at {
            write!(f, " #{at}")?;
        }
        if let Some(line) = self.line {
            write!(f, " (line {line})")?;
        }
        write!(f, ": {}", self.reason)
    }
}

/// What happened to the entities of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImportReport {
    /// How many entities of each type the file has.
    pub found: BTreeMap<String, usize>,
    /// Surfaces that were read.
    pub surfaces: usize,
    /// Free curves that were read.
    pub curves: usize,
    /// Meshes and structured blocks that were read.
    #[serde(default)]
    pub meshes: usize,
    /// Everything else worth knowing, in file order.
    pub lines: Vec<ReportLine>,
}

impl ImportReport {
    /// Adds a line.
    pub fn add(
        &mut self,
        severity: Severity,
        entity: impl Into<String>,
        at: Option<usize>,
        line: Option<usize>,
        reason: impl Into<String>,
    ) {
        self.lines.push(ReportLine { severity, entity: entity.into(), at, line, reason: reason.into() });
    }

    /// How many lines have this severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.lines.iter().filter(|l| l.severity == severity).count()
    }

    /// The lines with equal severity, entity type and reason counted together, the gravest first.
    pub fn grouped(&self) -> Vec<(Severity, &str, &str, usize)> {
        let mut groups: Vec<(Severity, &str, &str, usize)> = Vec::new();
        let mut places = BTreeMap::new();
        for line in &self.lines {
            let key = (line.severity, line.entity.as_str(), line.reason.as_str());
            let place = *places.entry(key).or_insert_with(|| {
                groups.push((key.0, key.1, key.2, 0));
                groups.len() - 1
            });
            groups[place].3 += 1;
        }
        groups.sort_by_key(|g| std::cmp::Reverse(g.0));
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_lines_are_counted_together_gravest_first() {
        let mut report = ImportReport::default();
        for at in 0..3 {
            report.add(Severity::Info, "IGES 144", Some(at), None, "whole surface");
        }
        report.add(Severity::Skipped, "IGES 120", Some(7), Some(12), "not read");
        let expected =
            [(Severity::Skipped, "IGES 120", "not read", 1), (Severity::Info, "IGES 144", "whole surface", 3)];
        assert_eq!(report.grouped(), expected);
        assert_eq!(report.lines[3].to_string(), "skipped: IGES 120 #7 (line 12): not read");
    }
}
