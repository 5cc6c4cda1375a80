//! STL files, binary and ASCII, in and out.
//!
//! A file is binary when its length is what its triangle count says, whatever its header begins with (many
//! binary files begin with `solid`); else ASCII when its beginning is text that speaks of facets, whether or not it
//! begins with `solid`; else it is read as binary up to its last whole triangle, with a warning. Solids keep their names as groups. Equal corners become one vertex.

use std::io::Read;

use glam::DVec3;
use rayon::prelude::*;

use super::report::{ImportReport, Severity};
use crate::kernel::mesh::soup::{self, Part};
use crate::kernel::mesh::tri_mesh::{Group, TriMesh};
use crate::kernel::mesh::weld::Welder;

const HEADER: usize = 84;
const RECORD: usize = 50;
/// Triangles that are sorted for welding at a time, and how many times as many are read at a time.
const PART: usize = 1 << 15;
const PARTS: usize = 4;

/// Whether a file of this length that begins like this is an STL file.
pub fn looks_like(beginning: &[u8], length: u64) -> bool {
    is_exact_binary(beginning, length) || is_ascii(beginning)
}

fn declared_count(bytes: &[u8]) -> Option<usize> {
    bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
}

/// Whether a file of this length that begins like this is binary and whole.
pub fn is_exact_binary(beginning: &[u8], length: u64) -> bool {
    declared_count(beginning).is_some_and(|n| n > 0 && length == n as u64 * RECORD as u64 + HEADER as u64)
}

fn starts_with_word(bytes: &[u8], word: &str) -> bool {
    bytes.trim_ascii_start().get(..word.len()).is_some_and(|b| b.eq_ignore_ascii_case(word.as_bytes()))
}

/// Whether the beginning is text that speaks of facets. Coordinates in bytes soon have one that no text has.
fn is_ascii(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    let text = head.iter().all(|&b| b >= b' ' || b.is_ascii_whitespace());
    text && contains_word(head, "facet") && contains_word(head, "vertex")
}

fn contains_word(bytes: &[u8], word: &str) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    head.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word.as_bytes()))
}

/// Reads a mesh; what had to be left out is in the report.
pub fn read(bytes: &[u8], report: &mut ImportReport) -> TriMesh {
    let length = bytes.len() as u64;
    if !is_exact_binary(bytes, length) && is_ascii(bytes) {
        return read_ascii(bytes, report);
    }
    read_binary(bytes, length, report).unwrap_or_else(|error| {
        // Not reached: bytes in memory are always there.
        report.add(Severity::Skipped, "STL", None, None, error.to_string());
        TriMesh::default()
    })
}

const NOT_FINITE: &str = "with a coordinate that is not a finite number";
const COLLAPSED: &str = "with two equal corners";

fn skipped(report: &mut ImportReport, count: usize, why: &str) {
    if count > 0 {
        let plural = if count == 1 { "triangle" } else { "triangles" };
        report.add(Severity::Skipped, "STL facet", None, None, format!("{count} {plural} {why}"));
    }
}

/// Gathers triangles and counts what cannot be used.
struct Gatherer {
    welder: Welder,
    triangles: Vec<[u32; 3]>,
    groups: Vec<Group>,
    not_finite: usize,
    collapsed: usize,
}

impl Gatherer {
    /// For about this many triangles.
    fn new(triangles: usize) -> Self {
        Self {
            welder: Welder::with_capacity(triangles / 2 + 16),
            triangles: Vec::with_capacity(triangles),
            groups: Vec::new(),
            not_finite: 0,
            collapsed: 0,
        }
    }

    fn add(&mut self, corners: [DVec3; 3]) {
        if !corners.iter().all(|p| p.is_finite()) {
            self.not_finite += 1;
            return;
        }
        let [a, b, c] = corners.map(|p| self.welder.vertex(p));
        if let (Some(a), Some(b), Some(c)) = (a, b, c) {
            if a == b || b == c || c == a {
                self.collapsed += 1;
            } else {
                self.triangles.push([a, b, c]);
            }
        }
    }

    fn end_group(&mut self, name: String) {
        let start = self.groups.last().map_or(0, |g| g.triangles.end);
        self.groups.push(Group { name, triangles: start..self.triangles.len() });
    }

    fn finish(self, report: &mut ImportReport) -> TriMesh {
        skipped(report, self.not_finite, NOT_FINITE);
        skipped(report, self.collapsed, COLLAPSED);
        let mut mesh = TriMesh::new(self.welder.into_points(), self.triangles).unwrap_or_default();
        mesh.groups = self.groups;
        mesh
    }
}

/// Reads a binary file of this length: while one batch is sorted for welding the next one is read.
pub fn read_binary(mut from: impl Read + Send, length: u64, report: &mut ImportReport) -> std::io::Result<TriMesh> {
    let mut header = [0_u8; HEADER];
    let header = &mut header[..HEADER.min(length as usize)];
    from.read_exact(header)?;
    let declared = declared_count(header).unwrap_or(0);
    let body = length.saturating_sub(HEADER as u64);
    let there = (body / RECORD as u64) as usize;
    if declared != there || !body.is_multiple_of(RECORD as u64) {
        let reason =
            format!("the file declares {declared} triangles and holds {there}; those that are there were read");
        report.add(Severity::Warning, "STL header", None, None, reason);
    }
    let count = declared.min(there);
    let mut left = count.min(soup::MOST);
    skipped(report, count - left, "beyond the number that can be welded");
    let mut read = |records: &mut Vec<u8>| {
        let count = left.min(PARTS * PART);
        left -= count;
        records.resize(count * RECORD, 0);
        from.read_exact(records)
    };
    let (mut records, mut next, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    read(&mut records)?;
    while !records.is_empty() {
        let sort = || -> Vec<Part> { records.par_chunks(PART * RECORD).map(sorted).collect() };
        let (sorted, done) = rayon::join(sort, || read(&mut next));
        done?;
        parts.extend(sorted);
        std::mem::swap(&mut records, &mut next);
    }
    drop((records, next));
    let welded = soup::weld(&parts);
    drop(parts);
    skipped(report, welded.not_finite, NOT_FINITE);
    skipped(report, welded.collapsed, COLLAPSED);
    let mut mesh = TriMesh::new(welded.points, welded.triangles).unwrap_or_default();
    let name = String::from_utf8_lossy(&header[..header.len().min(80)]);
    let name = name.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned();
    mesh.groups = vec![Group { name, triangles: 0..mesh.triangles().len() }];
    Ok(mesh)
}

/// The triangles of some records of a binary file.
fn sorted(records: &[u8]) -> Part {
    let triangle = |record: &[u8; RECORD]| {
        let float = |at: usize| f32::from_le_bytes([0, 1, 2, 3].map(|k| record[at + k]));
        [12, 24, 36].map(|at| [float(at), float(at + 4), float(at + 8)])
    };
    Part::new(records.as_chunks::<RECORD>().0.iter().map(triangle))
}

fn read_ascii(bytes: &[u8], report: &mut ImportReport) -> TriMesh {
    let text = String::from_utf8_lossy(bytes);
    let mut gatherer = Gatherer::new(bytes.len() / 200);
    let mut corners: Vec<DVec3> = Vec::with_capacity(4);
    let mut name: Option<String> = None;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match word.to_ascii_lowercase().as_str() {
            "vertex" => {
                let mut values = rest.split_whitespace().map(|v| v.parse().unwrap_or(f64::NAN));
                let mut next = || values.next().unwrap_or(f64::NAN);
                corners.push(DVec3::new(next(), next(), next()));
            }
            "endloop" | "endfacet" if !corners.is_empty() => {
                match <[DVec3; 3]>::try_from(corners.as_slice()) {
                    Ok(triangle) => gatherer.add(triangle),
                    Err(_) => {
                        let reason = format!("a facet with {} vertices, 3 are needed", corners.len());
                        report.add(Severity::Skipped, "STL facet", None, Some(number + 1), reason);
                    }
                }
                corners.clear();
            }
            "solid" => name = Some(rest.trim().to_owned()),
            "endsolid" => gatherer.end_group(name.take().unwrap_or_default()),
            _ => {}
        }
    }
    if let Some(name) = name {
        report.add(Severity::Warning, "STL solid", None, None, "the file ends inside a solid; it was cut off");
        gatherer.end_group(name);
    }
    gatherer.finish(report)
}

/// A mesh as binary STL (coordinates rounded to `f32`, which is all that the format holds).
pub fn write_binary(mesh: &TriMesh) -> Vec<u8> {
    let mut out = vec![0_u8; 80];
    let name = mesh.groups.first().map_or("", |g| g.name.as_str()).as_bytes();
    // A header that begins with "solid" would make other readers take the file for ASCII.
    if !starts_with_word(name, "solid") {
        out[..name.len().min(80)].copy_from_slice(&name[..name.len().min(80)]);
    }
    out.extend((mesh.triangles().len() as u32).to_le_bytes());
    for t in 0..mesh.triangles().len() {
        let normal = mesh.area_vector(t).normalize_or_zero();
        for p in [normal].into_iter().chain(mesh.corners(t)) {
            for c in p.to_array() {
                out.extend((c as f32).to_le_bytes());
            }
        }
        out.extend([0, 0]);
    }
    out
}

/// A mesh as ASCII STL with its groups as solids and all digits.
pub fn write_ascii(mesh: &TriMesh) -> String {
    use std::fmt::Write as _;
    let whole = [Group { name: String::new(), triangles: 0..mesh.triangles().len() }];
    let groups = if mesh.groups.is_empty() { &whole[..] } else { &mesh.groups };
    let mut out = String::new();
    for group in groups {
        let _infallible = writeln!(out, "solid {}", group.name);
        for t in group.triangles.clone() {
            let n = mesh.area_vector(t).normalize_or_zero();
            let _infallible = writeln!(out, "facet normal {:e} {:e} {:e}\nouter loop", n.x, n.y, n.z);
            for p in mesh.corners(t) {
                let _infallible = writeln!(out, "vertex {:e} {:e} {:e}", p.x, p.y, p.z);
            }
            out.push_str("endloop\nendfacet\n");
        }
        let _infallible = writeln!(out, "endsolid {}", group.name);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.1, 0.25, 1.0 / 3.0)];
        let mut mesh = TriMesh::new(points, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
        mesh.groups =
            vec![Group { name: "base".into(), triangles: 0..1 }, Group { name: "rest of it".into(), triangles: 1..4 }];
        mesh
    }

    fn reread(bytes: &[u8]) -> (TriMesh, ImportReport) {
        let mut report = ImportReport::default();
        let mesh = read(bytes, &mut report);
        (mesh, report)
    }

    /// The same triangles in space, whatever the vertices are numbered.
    fn assert_same(a: &TriMesh, b: &TriMesh, tol: f64) {
        assert_eq!(a.triangles().len(), b.triangles().len());
        for t in 0..a.triangles().len() {
            for (p, q) in a.corners(t).into_iter().zip(b.corners(t)) {
                assert!(p.distance(q) <= tol);
            }
        }
    }

    #[test]
    fn ascii_keeps_every_bit_and_the_solids() {
        let mesh = tetrahedron();
        let (back, report) = reread(write_ascii(&mesh).as_bytes());
        assert_same(&mesh, &back, 0.0);
        assert_eq!((&back.groups, back.points().len()), (&mesh.groups, 4));
        assert!(report.lines.is_empty());
    }

    #[test]
    fn binary_is_recognised_even_when_its_header_says_solid() {
        let mut bytes = write_binary(&tetrahedron());
        bytes[..16].copy_from_slice(b"solid facet oops");
        assert!(looks_like(&bytes, bytes.len() as u64));
        let (back, report) = reread(&bytes);
        assert_same(&tetrahedron(), &back, 1e-7);
        assert!(report.lines.is_empty());
    }

    #[test]
    fn a_count_that_lies_and_a_cut_file_give_what_is_there_with_a_warning() {
        let mut bytes = write_binary(&tetrahedron());
        bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        let (back, report) = reread(&bytes);
        assert_eq!((back.triangles().len(), report.count(Severity::Warning)), (4, 1));
        for length in 0..bytes.len() {
            assert!(reread(&bytes[..length]).0.triangles().len() <= 4);
        }
        let text = write_ascii(&tetrahedron());
        for length in 0..text.len() {
            assert!(reread(&text.as_bytes()[..length]).0.triangles().len() <= 4);
        }
    }

    #[test]
    fn unusable_facets_are_counted() {
        let text = "solid x\nfacet\nvertex 0 0 0\nvertex nan 1 0\nvertex 1 0 0\nendloop\nendfacet\n\
                    vertex 0 0 0\nvertex 0 0 0\nvertex 1 0 0\nendloop\nvertex 1 2 3\nendloop\nendsolid";
        let (mesh, report) = reread(text.as_bytes());
        assert!(mesh.triangles().is_empty());
        assert_eq!(report.count(Severity::Skipped), 3);
    }
}
