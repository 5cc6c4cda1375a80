//! Reads the shared cases: surfaces and what is true of them.
#![allow(dead_code)]

use std::path::PathBuf;

use glam::DVec3;
use patchwright::kernel::geom::{Knots, Surface};
use serde_json::Value;

/// The folder of the shared cases, or `None` (with a message) where it is missing.
pub fn folder() -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases"));
    let path = std::env::var_os("PATCHWRIGHT_CASES").map_or(path, PathBuf::from);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: no shared data");
    None
}

/// A case: its surfaces in order and the oracle's document.
pub struct Case {
    pub name: String,
    pub surfaces: Vec<Surface>,
    pub document: Value,
}

impl Case {
    pub fn load(name: &str) -> Option<Self> {
        let folder = folder()?;
        let text = std::fs::read_to_string(folder.join(format!("{name}.igs"))).ok()?;
        let oracle = std::fs::read_to_string(folder.join(format!("{name}.oracle.json"))).ok()?;
        Some(Self {
            name: name.to_owned(),
            surfaces: surfaces(&text),
            document: serde_json::from_str(&oracle).unwrap(),
        })
    }

    /// How many of the surfaces belong to the first side.
    pub fn n_a(&self) -> usize {
        self.document["n_a"].as_u64().unwrap() as usize
    }

    pub fn oracle(&self) -> &Value {
        &self.document["oracle"]
    }

    pub fn sides(&self) -> [Vec<(usize, &Surface)>; 2] {
        let all: Vec<(usize, &Surface)> = self.surfaces.iter().enumerate().collect();
        let (a, b) = all.split_at(self.n_a());
        [a.to_vec(), b.to_vec()]
    }
}

/// The entities 128 of an IGES file whose delimiters are the usual ones: all that the shared cases contain.
fn surfaces(text: &str) -> Vec<Surface> {
    let mut records: Vec<String> = vec![String::new()];
    for line in text.lines().filter(|l| l.len() >= 73 && l.as_bytes()[72] == b'P') {
        let last = records.last_mut().unwrap();
        last.push_str(line[..64].trim_end());
        if line[..64].trim_end().ends_with(';') {
            records.push(String::new());
        }
    }
    records.iter().filter(|r| r.starts_with("128")).map(|r| surface(r)).collect()
}

fn surface(record: &str) -> Surface {
    let v: Vec<f64> =
        record.trim_end_matches(';').split(',').map(|s| s.trim().replace(['D', 'd'], "e").parse().unwrap()).collect();
    let int = |k: usize| v[k] as usize;
    let (k1, k2, m1, m2) = (int(1), int(2), int(3), int(4));
    let mut at = 10;
    let mut take = |n: usize| {
        at += n;
        v[at - n..at].to_vec()
    };
    let ku = take(k1 + m1 + 2);
    let kv = take(k2 + m2 + 2);
    let count = (k1 + 1) * (k2 + 1);
    let weights = take(count);
    let points = take(3 * count).chunks(3).map(DVec3::from_slice).collect();
    Surface::new(Knots::new(m1, ku).unwrap(), Knots::new(m2, kv).unwrap(), points, Some(weights)).unwrap()
}

/// The points of an oracle's list.
pub fn points(list: &Value) -> Vec<DVec3> {
    let point = |p: &Value| DVec3::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap(), p[2].as_f64().unwrap());
    list.as_array().map(|l| l.iter().map(point).collect()).unwrap_or_default()
}
