//! Transforms (entity 124): followed through their own transforms, each computed once.

use glam::{DAffine3, DMat3, DVec3};

use super::Reader;
use super::params::Params;

/// A transform that was asked for before.
#[derive(Clone, Debug)]
pub(super) enum Known {
    Map(DAffine3),
    Broken(String),
}

/// The map of one record: R11 R12 R13 T1, R21 .. T2, R31 .. T3.
fn matrix(params: &mut Params<'_>) -> Result<DAffine3, String> {
    let mut rows = [[0.0; 4]; 3];
    for (r, row) in rows.iter_mut().enumerate() {
        for (c, value) in row.iter_mut().enumerate() {
            // A left-out value of the rotation is that of the identity.
            let default = if r == c { 1.0 } else { 0.0 };
            *value = params.real_or(default, "a matrix element").map_err(|e| e.to_string())?;
        }
    }
    let linear = DMat3::from_cols_array_2d(&std::array::from_fn(|c| std::array::from_fn(|r| rows[r][c])));
    let map = DAffine3 { matrix3: linear, translation: DVec3::from(rows.map(|row| row[3])) };
    if map.is_finite() { Ok(map) } else { Err("a matrix element is not finite".into()) }
}

impl Reader<'_> {
    /// The map of the transform that a directory entry names, `None` for none. A transform may have a transform:
    /// the inner one acts first. Cycles and broken records are errors that say where.
    pub fn transform(&mut self, pointer: usize) -> Result<Option<DAffine3>, String> {
        if pointer == 0 {
            return Ok(None);
        }
        let mut chain = Vec::new();
        let mut next = pointer;
        let mut outer = Ok(DAffine3::IDENTITY);
        while next != 0 {
            if let Some(known) = self.transforms.get(&next) {
                outer = match known {
                    Known::Map(map) => Ok(*map),
                    Known::Broken(reason) => Err(reason.clone()),
                };
                break;
            }
            if chain.iter().any(|&(sequence, _)| sequence == next) {
                outer = Err(format!("transform {next} leads back to itself"));
                break;
            }
            // A chain can be as long as the file has entries; looking back over it must not cost its square.
            if chain.len() > 64 {
                outer = Err(format!("transform {pointer} has more than 64 transforms above it"));
                break;
            }
            match self.own_matrix(next) {
                Ok((map, above)) => {
                    chain.push((next, map));
                    next = above;
                }
                Err(reason) => {
                    outer = Err(reason);
                    break;
                }
            }
        }
        for (sequence, map) in chain.into_iter().rev() {
            outer = outer.map(|outer| outer * map);
            let known = match &outer {
                Ok(map) => Known::Map(*map),
                Err(reason) => Known::Broken(reason.clone()),
            };
            self.transforms.insert(sequence, known);
        }
        outer.map(Some)
    }

    /// The matrix of one entry and the transform above it.
    fn own_matrix(&mut self, sequence: usize) -> Result<(DAffine3, usize), String> {
        let Some(at) = self.directory.find(sequence) else {
            return Err(format!("transform {sequence} does not exist"));
        };
        let entry = &self.directory.entries[at];
        if entry.kind != 124 {
            return Err(format!("entity {sequence} is of type {}, not a transform", entry.kind));
        }
        let above = entry.transform;
        let map = self.record(at, |_, params| matrix(params))?;
        Ok((map.map_err(|reason| format!("transform {sequence}: {reason}"))?, above))
    }
}
