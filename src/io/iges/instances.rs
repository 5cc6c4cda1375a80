//! Subfigures: definitions (308) that stand where their instances (408) put them, nested ones included.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use super::params::ParamError;
use super::{Reader, Severity};

/// How deep subfigures may contain one another.
const MAX_DEPTH: usize = 16;
/// The most places of all subfigures together.
const MAX_PLACES: usize = 100_000;

/// Where the members of subfigures stand. What is in no subfigure stands where it says.
#[derive(Debug, Default)]
pub(super) struct Instances {
    places: HashMap<usize, Vec<DAffine3>>,
}

impl Instances {
    pub fn of(reader: &mut Reader<'_>) -> Self {
        let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
        let mut nested = std::collections::HashSet::new();
        let kinds: Vec<i64> = reader.directory.entries.iter().map(|e| e.kind).collect();
        for (at, _) in kinds.iter().enumerate().filter(|(_, k)| **k == 308) {
            let list = reader.record(at, |_, params| -> Result<Vec<usize>, ParamError> {
                params.next(); // the depth, which nobody gets right
                params.next(); // the name
                (0..params.count("members", 1)?).map(|_| params.pointer()).collect()
            });
            match list {
                Ok(Ok(list)) => {
                    let list: Vec<usize> = list.iter().filter_map(|&p| reader.directory.find(p)).collect();
                    nested.extend(list.iter().copied());
                    members.insert(at, list);
                }
                Ok(Err(e)) => reader.note(Severity::Skipped, at, e.to_string()),
                Err(reason) => reader.note(Severity::Skipped, at, reason),
            }
        }
        let mut out = Self::default();
        if members.is_empty() {
            return out;
        }
        // Members of a definition without an instance stand nowhere; they still get their (empty) list.
        for &member in members.values().flatten() {
            out.places.entry(member).or_default();
        }
        let mut total = 0;
        for (at, _) in kinds.iter().enumerate().filter(|(_, k)| **k == 408) {
            if nested.contains(&at) {
                continue; // reached through the definition that contains it
            }
            let mut stack = vec![(at, DAffine3::IDENTITY, 0)];
            while let Some((at, outer, depth)) = stack.pop() {
                let (definition, map) = match instance(reader, at) {
                    Ok(found) => found,
                    Err(reason) => {
                        reader.note(Severity::Skipped, at, reason);
                        continue;
                    }
                };
                for &member in members.get(&definition).map_or(&[][..], Vec::as_slice) {
                    total += 1;
                    if depth >= MAX_DEPTH || total > MAX_PLACES {
                        let reason = format!("nested deeper than {MAX_DEPTH}, or more than {MAX_PLACES} places");
                        reader.note(Severity::Skipped, at, reason);
                        break;
                    }
                    if kinds.get(member) == Some(&408) {
                        stack.push((member, outer * map, depth + 1));
                    } else {
                        out.places.entry(member).or_default().push(outer * map);
                    }
                }
            }
        }
        out
    }

    /// The places of an entity; `None` for the one where it says.
    pub fn places(&self, at: usize) -> Option<&[DAffine3]> {
        self.places.get(&at).map(Vec::as_slice)
    }
}

/// The definition of an instance and its map: scaled, then moved, then put where its own transform says.
fn instance(reader: &mut Reader<'_>, at: usize) -> Result<(usize, DAffine3), String> {
    let (definition, offset, scale) = reader
        .record(at, |_, params| -> Result<(usize, DVec3, f64), ParamError> {
            let definition = params.pointer()?;
            let mut offset = DVec3::ZERO;
            for axis in 0..3 {
                offset[axis] = params.real_or(0.0, "a coordinate")?;
            }
            Ok((definition, offset, params.real_or(1.0, "a scale")?))
        })?
        .map_err(|e| e.to_string())?;
    let found = reader.directory.find(definition).filter(|&d| reader.directory.entries[d].kind == 308);
    let found = found.ok_or_else(|| format!("subfigure {definition} does not exist"))?;
    let own = reader.transform(reader.directory.entries[at].transform)?.unwrap_or(DAffine3::IDENTITY);
    let map = own * DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(scale));
    if map.is_finite() && scale != 0.0 { Ok((found, map)) } else { Err("its place is not finite".into()) }
}
