//! Reads the shared cases: surfaces and what is true of them.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use std::path::PathBuf;

use glam::DVec3;
use patchwright::kernel::geom::Surface;
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
        let opened = patchwright::io::open(&folder.join(format!("{name}.igs"))).ok()?;
        let oracle = std::fs::read_to_string(folder.join(format!("{name}.oracle.json"))).ok()?;
        let surfaces = opened.document.surfaces().map(|(_, s)| s.as_ref().clone()).collect();
        Some(Self { name: name.to_owned(), surfaces, document: serde_json::from_str(&oracle).unwrap() })
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

/// The points of an oracle's list.
pub fn points(list: &Value) -> Vec<DVec3> {
    let point = |p: &Value| DVec3::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap(), p[2].as_f64().unwrap());
    list.as_array().map(|l| l.iter().map(point).collect()).unwrap_or_default()
}
