//! STL files, binary and ASCII, in and out.
//!
//! A file is binary when its length is what its triangle count says, whatever its header begins with (many
//! binary files begin with `solid`); else ASCII when its beginning is text that speaks of facets, whether or not it
//! begins with `solid`; else it is read as binary up to its last whole triangle, with a warning. Solids keep their names as groups. Equal corners become one vertex.

use glam::DVec3;
use rayon::prelude::*;

use super::report::{ImportReport, Severity};
use crate::kernel::mesh::tri_mesh::{Group, TriMesh};
use crate::kernel::mesh::weld::{Welder, weld};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Whether these bytes are an STL file.
pub fn looks_like(bytes: &[u8]) -> bool {
    is_exact_binary(bytes) || is_ascii(bytes)
}

fn declared_count(bytes: &[u8]) -> Option<usize> {
    bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
}

fn is_exact_binary(bytes: &[u8]) -> bool {
    declared_count(bytes)
        .is_some_and(|n| n > 0 && Some(bytes.len()) == n.checked_mul(RECORD).and_then(|b| b.checked_add(HEADER)))
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
    if !is_exact_binary(bytes) && is_ascii(bytes) { read_ascii(bytes, report) } else { read_binary(bytes, report) }
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

fn read_binary(bytes: &[u8], report: &mut ImportReport) -> TriMesh {
    let declared = declared_count(bytes).unwrap_or(0);
    let body = bytes.get(HEADER..).unwrap_or_default();
    let there = body.len() / RECORD;
    if declared != there || body.len() % RECORD != 0 {
        let reason =
            format!("the file declares {declared} triangles and holds {there}; those that are there were read");
        report.add(Severity::Warning, "STL header", None, None, reason);
    }
    let records: Vec<&[u8]> = body.chunks_exact(RECORD).take(declared).collect();
    let corner = |record: &[u8], k: usize| {
        let float = |at: usize| {
            let four = record.get(at..at + 4).and_then(|b| b.try_into().ok()).unwrap_or([0xFF; 4]);
            f64::from(f32::from_le_bytes(four))
        };
        DVec3::new(float(12 + 12 * k), float(16 + 12 * k), float(20 + 12 * k))
    };
    let whole = |record: &&[u8]| (0..3).all(|k| corner(record, k).is_finite());
    let usable: Vec<&[u8]> = if records.par_iter().all(whole) {
        records
    } else {
        let usable: Vec<&[u8]> = records.par_iter().copied().filter(|r| whole(r)).collect();
        skipped(report, records.len() - usable.len(), NOT_FINITE);
        usable
    };
    let Some((points, corners)) = weld(3 * usable.len(), |k| corner(usable[k / 3], k % 3)) else {
        report.add(Severity::Skipped, "STL", None, None, "it has more corners than can be numbered (2^32)");
        return TriMesh::default();
    };
    let count = usable.len();
    drop(usable);
    let triangles: Vec<[u32; 3]> = corners
        .par_chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]])
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    skipped(report, count - triangles.len(), COLLAPSED);
    let name = String::from_utf8_lossy(&bytes[..bytes.len().min(80)]);
    let name = name.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned();
    let groups = vec![(name, 0, triangles.len())];
    let mut mesh = TriMesh::new(points, triangles).unwrap_or_default();
    mesh.set_groups(groups);
    mesh
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
        assert!(looks_like(&bytes));
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
