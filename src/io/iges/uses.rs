//! Who refers to whom: which curves only describe other entities, and which surfaces are trimmed by which faces.

use std::collections::{HashMap, HashSet};

use super::Reader;
use super::params::{ParamError, Params};

/// The references between the entities of a file.
#[derive(Debug, Default)]
pub(super) struct Uses {
    consumed: HashSet<usize>,
    faces: HashMap<usize, Vec<usize>>,
    surfaces: HashMap<usize, usize>,
    properties: HashMap<usize, Vec<usize>>,
}

/// Pointers of one record.
#[derive(Default)]
struct References {
    /// The surface that a face trims.
    surface: usize,
    /// Entities that only serve this one.
    parts: Vec<usize>,
    properties: Vec<usize>,
}

impl Uses {
    pub fn of(reader: &mut Reader<'_>) -> Self {
        let mut uses = Self::default();
        for at in 0..reader.directory.entries.len() {
            let kind = reader.directory.entries[at].kind;
            if !matches!(
                kind,
                102 | 108 | 118 | 120 | 122 | 130 | 140..=144 | 190..=198 | 504 | 508 | 510
            ) {
                continue;
            }
            let Ok(references) = reader.record(at, |_, params| references(kind, params)) else { continue };
            let directory = &reader.directory;
            uses.consumed.extend(references.parts.iter().filter_map(|&p| directory.find(p)));
            if let Some(surface) = directory.find(references.surface) {
                uses.surfaces.insert(at, surface);
                uses.faces.entry(surface).or_default().push(at);
            }
            if !references.properties.is_empty() {
                uses.properties.insert(at, references.properties);
            }
        }
        uses
    }

    /// Whether an entity only serves to describe another one.
    pub fn is_consumed(&self, at: usize) -> bool {
        self.consumed.contains(&at)
    }

    /// The faces that trim a surface.
    pub fn faces_of(&self, at: usize) -> &[usize] {
        self.faces.get(&at).map_or(&[], Vec::as_slice)
    }

    /// The surface that a face trims.
    pub fn surface_of(&self, at: usize) -> Option<usize> {
        self.surfaces.get(&at).copied()
    }

    /// The properties of a face.
    pub fn properties_of(&self, at: usize) -> &[usize] {
        self.properties.get(&at).map_or(&[], Vec::as_slice)
    }
}

/// The pointers of one record. One that is broken gives what was read up to there; it is reported where the
/// entity itself is read.
fn references(kind: i64, params: &mut Params<'_>) -> References {
    let mut found = References::default();
    if gather(kind, params, &mut found).is_ok() && matches!(kind, 143 | 144 | 510) {
        found.properties = params.properties();
    }
    found
}

fn gather(kind: i64, params: &mut Params<'_>, found: &mut References) -> Result<(), ParamError> {
    match kind {
        102 => {
            for _ in 0..params.count("members", 1)? {
                found.parts.push(params.pointer()?);
            }
        }
        108 => {
            for _ in 0..4 {
                params.next();
            }
            found.parts.push(params.pointer()?);
        }
        118 | 120 => found.parts.extend([params.pointer()?, params.pointer()?]),
        122 | 130 | 140 => {
            if kind == 140 {
                for _ in 0..4 {
                    params.next();
                }
            }
            found.parts.push(params.pointer()?);
        }
        141 => {
            params.next();
            params.next();
            params.pointer()?;
            for _ in 0..params.count("curves", 3)? {
                found.parts.push(params.pointer()?);
                params.next();
                for _ in 0..params.count("parameter curves", 1)? {
                    found.parts.push(params.pointer()?);
                }
            }
        }
        142 => {
            params.next();
            params.pointer()?;
            found.parts.extend([params.pointer()?, params.pointer()?]);
        }
        143 => {
            params.next();
            found.surface = params.pointer()?;
            for _ in 0..params.count("boundaries", 1)? {
                found.parts.push(params.pointer()?);
            }
        }
        144 => {
            found.surface = params.pointer()?;
            params.next();
            let inner = params.count("inner boundaries", 1)?;
            for _ in 0..=inner {
                found.parts.push(params.pointer()?);
            }
        }
        190..=198 => {
            // Points, directions and numbers: a number that happens to name an entity marks no curve as used,
            // because only the leading pointers are read.
            found.parts.extend([params.pointer()?, params.pointer()?]);
        }
        504 => {
            for _ in 0..params.count("edges", 5)? {
                found.parts.push(params.pointer()?);
                for _ in 0..4 {
                    params.next();
                }
            }
        }
        508 => {
            for _ in 0..params.count("edges", 5)? {
                for _ in 0..4 {
                    params.next();
                }
                for _ in 0..params.count("parameter curves", 2)? {
                    params.next();
                    found.parts.push(params.pointer()?);
                }
            }
        }
        510 => {
            found.surface = params.pointer()?;
            let loops = params.count("loops", 1)?;
            params.next();
            for _ in 0..loops {
                found.parts.push(params.pointer()?);
            }
        }
        _ => {}
    }
    Ok(())
}
