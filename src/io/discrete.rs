//! STL, OBJ and Plot3D files as documents: every solid, group or block becomes an entity, and what was left out is
//! counted.

use std::sync::Arc;

use super::plot3d::{self, Plot3dError};
use super::{Format, ImportReport, Opened, Severity, obj, stl};
use crate::kernel::mesh::facets::Facets;
use crate::kernel::mesh::tri_mesh::TriMesh;
use crate::model::document::{Document, Shape, Unit};

/// The most groups of a file that become entities of their own; with more, the groups stay inside one mesh.
const MOST_PARTS: usize = 256;

/// Why a file holds no mesh or grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiscreteError {
    /// No triangle was left.
    #[error(
        "it has no triangle that can be used ({skipped} lines of the report say what was skipped): expected {what}"
    )]
    NoTriangle {
        /// How many report lines are about skipped things.
        skipped: usize,
        /// What the format looks like.
        what: &'static str,
    },
    /// No layout explains the file.
    #[error(transparent)]
    Plot3d(#[from] Plot3dError),
    /// No block was left.
    #[error("none of its {blocks} blocks has a cell that can be used: expected counts of 2 or more and finite points")]
    NoBlock {
        /// How many blocks it has.
        blocks: usize,
    },
}

/// Reads a file of one of the three formats.
pub fn open(bytes: &[u8], format: Format) -> Result<Opened, DiscreteError> {
    let mut report = ImportReport::default();
    match format {
        Format::Plot3d => blocks(bytes, report),
        Format::Obj => {
            let mesh = obj::read(bytes, &mut report);
            meshes(mesh, "OBJ group", "lines \"v x y z\" and \"f i j k\"", report)
        }
        _ => {
            let mesh = stl::read(bytes, &mut report);
            of_stl(mesh, report)
        }
    }
}

/// The mesh of an STL file as a document.
pub fn of_stl(mesh: TriMesh, report: ImportReport) -> Result<Opened, DiscreteError> {
    meshes(mesh, "STL solid", "facets of three vertices, in ASCII or binary", report)
}

fn meshes(mesh: TriMesh, kind: &str, what: &'static str, mut report: ImportReport) -> Result<Opened, DiscreteError> {
    if mesh.triangles().is_empty() {
        return Err(DiscreteError::NoTriangle { skipped: report.count(Severity::Skipped), what });
    }
    let groups = mesh.groups.len();
    report.found.insert(kind.to_owned(), groups.max(1));
    report.found.insert("triangle".to_owned(), mesh.triangles().len());
    note_defects(&mesh, kind, &mut report);
    let parts = if groups > MOST_PARTS {
        let reason = format!("{groups} groups, more than {MOST_PARTS}: they stay together as one mesh");
        report.add(Severity::Info, kind, None, None, reason);
        vec![(String::new(), mesh)]
    } else {
        mesh.into_parts()
    };
    let mut document = Document::new(Unit::Unknown);
    let several = parts.len() > 1;
    for (k, (name, part)) in parts.into_iter().enumerate() {
        if part.triangles().is_empty() {
            report.add(Severity::Skipped, kind, Some(k), None, format!("`{name}` has no triangles"));
            continue;
        }
        let name = match (name.is_empty(), several) {
            (false, _) => name,
            (true, true) => format!("Mesh {k}"),
            (true, false) => "Mesh".to_owned(),
        };
        document.add(name, Shape::Mesh(Arc::new(Facets::of_mesh(part))), None);
        report.meshes += 1;
    }
    Ok(Opened { document, report })
}

/// Says what is irregular about a mesh that is read as it stands. Not for very large ones, where it costs seconds.
fn note_defects(mesh: &TriMesh, kind: &str, report: &mut ImportReport) {
    if mesh.triangles().len() > 1_000_000 {
        let reason = "over a million triangles: not searched for duplicate and non-manifold ones; `info` counts them";
        report.add(Severity::Info, kind, None, None, reason);
        return;
    }
    let defects = mesh.defects();
    for (count, noun, what) in [
        (defects.degenerate, "triangle", "without area"),
        (defects.duplicate, "triangle", "with the corners of another one"),
        (defects.non_manifold_edges, "edge", "of more than two triangles"),
    ] {
        let (plural, are) = if count == 1 { ("", "it is") } else { ("s", "they are") };
        if count > 0 {
            report.add(Severity::Warning, kind, None, None, format!("{count} {noun}{plural} {what}, kept as {are}"));
        }
    }
}

fn blocks(bytes: &[u8], mut report: ImportReport) -> Result<Opened, DiscreteError> {
    let (layout, grids) = plot3d::read(bytes, &mut report)?;
    let mut document = Document::new(Unit::Unknown);
    let count = grids.len();
    report.found.insert("Plot3D block".to_owned(), count + report.count(Severity::Skipped));
    for (k, grid) in grids.into_iter().enumerate() {
        let [i, j, l] = grid.counts();
        match Facets::of_block(grid) {
            Ok(facets) if facets.mesh().triangles().is_empty() => {
                let reason = format!("its {i} x {j} x {l} points make no cell");
                report.add(Severity::Skipped, "Plot3D block", Some(k), None, reason);
            }
            Ok(facets) => {
                let name = if layout.multi_block { format!("Block {k}") } else { "Block".to_owned() };
                document.add(name, Shape::Block(Arc::new(facets)), None);
                report.meshes += 1;
            }
            Err(error) => report.add(Severity::Skipped, "Plot3D block", Some(k), None, error.to_string()),
        }
    }
    if document.entities().is_empty() {
        return Err(DiscreteError::NoBlock { blocks: count });
    }
    Ok(Opened { document, report })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solids_become_entities_with_their_names() {
        let text = "solid floor\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n\
                    solid roof\nfacet\nvertex 0 0 1\nvertex 1 0 1\nvertex 0 1 1\nendloop\nendfacet\nendsolid\n";
        let opened = open(text.as_bytes(), Format::Stl).unwrap();
        let names: Vec<&str> = opened.document.entities().iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["floor", "roof"]);
        assert_eq!((opened.report.meshes, opened.report.found["triangle"]), (2, 2));
        assert!(opened.report.lines.is_empty());
    }

    #[test]
    fn files_without_anything_usable_are_errors_that_say_so() {
        for (bytes, format) in [
            (&b"solid x\nendsolid"[..], Format::Stl),
            (b"v 0 0 0\nv 1 0 0\n", Format::Obj),
            (b"hello", Format::Plot3d),
            (b"1 1 1\n0 0 0\n", Format::Plot3d),
        ] {
            assert!(!open(bytes, format).unwrap_err().to_string().is_empty());
        }
    }
}
