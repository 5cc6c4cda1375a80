//! Groups (402, forms 1, 7, 14 and 15): a member's name begins with that of its group, so that what belongs together stays
//! together in lists and can be searched for. A group without a name is only counted in the report.

use std::collections::HashMap;

use super::params::{ParamError, Params};
use super::{Reader, Severity};

/// How deep groups may contain one another.
const MAX_DEPTH: usize = 8;

/// The names of the groups that entities belong to.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// By member: the entry of its group. The first group that names a member has it.
    group: HashMap<usize, usize>,
    names: HashMap<usize, String>,
    sizes: HashMap<usize, usize>,
}

impl Groups {
    pub fn of(reader: &mut Reader<'_>) -> Self {
        let mut out = Self::default();
        for at in 0..reader.directory.entries.len() {
            let entry = &reader.directory.entries[at];
            if entry.kind != 402 || !matches!(entry.form, 1 | 7 | 14 | 15) {
                continue;
            }
            let read = reader.record(at, |_, params| members(params));
            let (pointers, properties) = match read.and_then(|r| r.map_err(|e| e.to_string())) {
                Ok(read) => read,
                Err(reason) => {
                    reader.note(Severity::Skipped, at, reason);
                    continue;
                }
            };
            let found: Vec<usize> = pointers.iter().filter_map(|&p| reader.directory.find(p)).collect();
            if found.len() < pointers.len() {
                let reason = format!("{} of its {} members do not exist", pointers.len() - found.len(), pointers.len());
                reader.note(Severity::Warning, at, reason);
            }
            out.sizes.insert(at, found.len());
            for member in found {
                out.group.entry(member).or_insert(at);
            }
            if let Some(name) = reader.name_of(at, &properties) {
                out.names.insert(at, name);
            }
        }
        out
    }

    /// The names of the groups around an entity, the outermost first, with ` / ` behind each; empty without any.
    pub fn path(&self, at: usize) -> String {
        let mut out = String::new();
        let mut here = at;
        for _ in 0..MAX_DEPTH {
            let Some(&group) = self.group.get(&here) else { break };
            if let Some(name) = self.names.get(&group) {
                out = format!("{name} / {out}");
            }
            here = group;
        }
        out
    }

    /// What the report says of a group; nothing of one that could not be read.
    pub fn note(&self, at: usize) -> Option<String> {
        let members = self.sizes.get(&at)?;
        Some(match self.names.get(&at) {
            Some(name) => format!("group: the names of its {members} members begin with `{name}`"),
            None => format!("group of {members} members without a name; they are opened, the group is not kept"),
        })
    }
}

fn members(params: &mut Params<'_>) -> Result<(Vec<usize>, Vec<usize>), ParamError> {
    let count = params.count("members", 1)?;
    let members = (0..count).map(|_| params.pointer()).collect::<Result<_, _>>()?;
    Ok((members, params.properties()))
}
