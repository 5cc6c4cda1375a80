//! Wavefront OBJ files, the polygon part: `v`, `f`, `g`, `o`, in and out.
//!
//! Faces of more than three corners become fans. Texture and normal indices are passed over. Negative indices
//! count back from the last vertex. Everything else in the file (materials, free-form geometry) is counted in
//! the report by keyword.

use std::collections::BTreeMap;

use glam::DVec3;

use super::report::{ImportReport, Severity};
use crate::kernel::mesh::tri_mesh::{Group, TriMesh};

/// Keywords that describe looks or smoothing, not shape.
const HARMLESS: [&str; 7] = ["vn", "vt", "s", "usemtl", "mtllib", "maplib", "usemap"];

/// Reads a mesh; what had to be left out is in the report.
pub fn read(bytes: &[u8], report: &mut ImportReport) -> TriMesh {
    let text = String::from_utf8_lossy(bytes);
    let mut points: Vec<DVec3> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut groups: Vec<Group> = Vec::new();
    let mut name: Option<String> = None;
    let mut passed_over: BTreeMap<String, usize> = BTreeMap::new();
    let mut collapsed = 0;
    let mut end_group = |name: &mut Option<String>, end: usize| {
        let start = groups.last().map_or(0, |g: &Group| g.triangles.end);
        if end > start || name.is_some() {
            groups.push(Group { name: name.take().unwrap_or_default(), triangles: start..end });
        }
    };
    for (number, line) in joined_lines(&text) {
        let (word, rest) = line.trim().split_once(char::is_whitespace).unwrap_or((line.trim(), ""));
        match word {
            "" => {}
            w if w.starts_with('#') => {}
            "v" => {
                let mut values = rest.split_whitespace().map(|v| v.parse().unwrap_or(f64::NAN));
                let mut next = || values.next().unwrap_or(f64::NAN);
                let p = DVec3::new(next(), next(), next());
                if !p.is_finite() {
                    let reason = "a vertex without three finite coordinates; faces at it are left out";
                    report.add(Severity::Skipped, "OBJ v", None, Some(number), reason);
                }
                points.push(p);
            }
            "f" => {
                let count = points.len();
                let corners: Option<Vec<u32>> = rest.split_whitespace().map(|c| corner(c, count)).collect();
                match corners.filter(|c| c.len() >= 3 && c.iter().all(|&k| points[k as usize].is_finite())) {
                    Some(corners) => {
                        for k in 1..corners.len() - 1 {
                            let [a, b, c] = [corners[0], corners[k], corners[k + 1]];
                            if a == b || b == c || c == a {
                                collapsed += 1;
                            } else {
                                triangles.push([a, b, c]);
                            }
                        }
                    }
                    None => {
                        let reason =
                            format!("a face needs three or more corners out of 1..={count}; it has \"{rest}\"");
                        report.add(Severity::Skipped, "OBJ f", None, Some(number), reason);
                    }
                }
            }
            "g" | "o" => {
                end_group(&mut name, triangles.len());
                name = Some(rest.trim().to_owned());
            }
            w if HARMLESS.contains(&w) => {}
            w => *passed_over.entry(w.chars().take(20).collect()).or_default() += 1,
        }
    }
    end_group(&mut name, triangles.len());
    groups.retain(|g| !g.triangles.is_empty());
    if collapsed > 0 {
        report.add(Severity::Skipped, "OBJ f", None, None, format!("{collapsed} triangles with two equal corners"));
    }
    for (word, count) in passed_over {
        report.add(
            Severity::Skipped,
            format!("OBJ {word}"),
            None,
            None,
            format!("{count} lines of a kind that is not read"),
        );
    }
    // Vertices that are no numbers are used by no face; zero stands in for them so that indices stay.
    points.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = DVec3::ZERO);
    let mut mesh = match TriMesh::new(points, triangles) {
        Ok(mesh) => mesh,
        Err(error) => {
            report.add(Severity::Skipped, "OBJ", None, None, error.to_string());
            return TriMesh::default();
        }
    };
    mesh.groups = groups;
    mesh
}

/// Lines with their numbers, those that end in a backslash joined with the next.
fn joined_lines(text: &str) -> impl Iterator<Item = (usize, String)> + '_ {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = first.to_owned();
        while line.ends_with('\\') {
            line.pop();
            line.push(' ');
            match lines.next() {
                Some((_, next)) => line.push_str(next),
                None => break,
            }
        }
        Some((number + 1, line))
    })
}

/// The vertex of a corner `v`, `v/t`, `v//n` or `v/t/n`.
fn corner(text: &str, count: usize) -> Option<u32> {
    let index: i64 = text.split('/').next()?.parse().ok()?;
    let from_zero = if index < 0 { i64::try_from(count).ok()?.checked_add(index)? } else { index - 1 };
    u32::try_from(from_zero).ok().filter(|&k| (k as usize) < count)
}

/// A mesh with its groups and all digits.
pub fn write(mesh: &TriMesh) -> String {
    use std::fmt::Write as _;
    let mut out = String::new();
    for p in mesh.points() {
        let _infallible = writeln!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z);
    }
    let whole = [Group { name: String::new(), triangles: 0..mesh.triangles().len() }];
    for group in if mesh.groups.is_empty() { &whole[..] } else { &mesh.groups } {
        if !group.name.is_empty() {
            let _infallible = writeln!(out, "g {}", group.name);
        }
        for [a, b, c] in &mesh.triangles()[group.triangles.clone()] {
            let _infallible = writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reread(text: &str) -> (TriMesh, ImportReport) {
        let mut report = ImportReport::default();
        let mesh = read(text.as_bytes(), &mut report);
        (mesh, report)
    }

    #[test]
    fn corners_groups_and_continued_lines_are_read() {
        let (mesh, report) = reread(
            "# a square and a triangle\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1.0\ng square\nf 1/1/1 2//2 \\\n3 4\n\
             o tri\nv 0 0 1\nf -1 -5 2\nvn 0 0 1\ncurv 0 1 2\n",
        );
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [4, 0, 1]]);
        let names: Vec<_> = mesh.groups.iter().map(|g| (g.name.as_str(), g.triangles.clone())).collect();
        assert_eq!(names, [("square", 0..2), ("tri", 2..3)]);
        assert_eq!(report.lines.len(), 1);
        assert!(report.lines[0].entity.contains("curv"));
    }

    #[test]
    fn writing_and_reading_is_the_identity() {
        let points = vec![DVec3::new(0.1, -2e-17, 3e8), DVec3::X, DVec3::new(1.0 / 3.0, 1.0, 0.0)];
        let mut mesh = TriMesh::new(points, vec![[0, 1, 2], [2, 1, 0]]).unwrap();
        mesh.groups = vec![Group { name: "a".into(), triangles: 0..1 }, Group { name: "b c".into(), triangles: 1..2 }];
        assert_eq!(reread(&write(&mesh)).0, mesh);
    }

    #[test]
    fn bad_lines_are_counted_and_the_rest_is_read() {
        let (mesh, report) =
            reread("v 0 0 0\nv 1 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\nf 1 2\nf 1 1 2\nf 1 2 4\nf -9 1 2\n");
        assert_eq!(mesh.triangles(), [[0, 1, 3]]);
        assert_eq!(report.count(Severity::Skipped), 6);
    }
}
