//! A document for other programs: as B-splines (STEP, IGES), triangles (STL, OBJ) or structured grids (Plot3D).
//!
//! What leaves is accounted for before it is written: how far borders of neighbours are apart, and for B-splines the
//! largest angle between the normals on both sides of an edge ([`crate::model::shell`]).
//!
//! Surfaces and patches are divided together, so that edges they share have the same points in both (see
//! [`crate::kernel::mesh::structured`]); the result says by how much borders had to be moved for that, before anything
//! is written. Meshes and blocks of the document go out as they are. What a format cannot hold is counted in notes.

use std::path::Path;
use std::sync::Arc;

use super::plot3d::{self, Encoding};
use super::{Format, SaveError, Saved, atomic, iges, obj, step, stl};
use crate::kernel::geom::{Side, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::grid::Grid;
use crate::kernel::mesh::structured::{Counts, GridOptions, GridSet, Spacing, StructuredError, structured, welded};
use crate::kernel::mesh::tri_mesh::{Group, MeshError, TriMesh};
use crate::model::document::{Document, Shape};
use crate::model::shell::Shells;

/// The points of an edge of a Plot3D grid where nothing else is asked for.
pub const POINTS: usize = 33;
/// How far triangles of STL and OBJ files are from surfaces where nothing else is asked for, as a fraction of the
/// diagonal.
pub const CHORD: f64 = 1e-4;

/// How a document is made into triangles or grids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExportOptions {
    /// How many points edges get; for the format's default see [`POINTS`] and [`CHORD`].
    pub counts: Option<Counts>,
    /// How they are spaced.
    pub spacing: Spacing,
    /// The sides that attract grid lines: the place among the surfaces and patches of the document, and the side.
    pub clusters: Vec<(usize, Side)>,
    /// What two borders may be apart and still be one edge; 1e-3 of the diagonal when left out.
    pub joining: Option<f64>,
    /// Text instead of bytes (STL, Plot3D).
    pub ascii: bool,
    /// In Fortran records (Plot3D, bytes).
    pub records: bool,
    /// The most significant byte first (Plot3D, bytes).
    pub big_endian: bool,
    /// In single precision (Plot3D, bytes).
    pub single: bool,
}

/// Why a document was not made into triangles or grids.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// The surfaces could not be divided.
    #[error(transparent)]
    Structured(#[from] StructuredError),
    /// There are more triangles or vertices than the format can count.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The document has nothing that the format can hold.
    #[error("the document has nothing that {} can hold: expected {expected}", format.name())]
    Nothing {
        /// The format.
        format: Format,
        /// What it can hold.
        expected: &'static str,
    },
    /// It was stopped.
    #[error("stopped before all grids were made; nothing was written")]
    Cancelled,
}

/// What was made of the surfaces and patches of a document.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ExportSummary {
    /// Surfaces and patches that were divided.
    pub surfaces: usize,
    /// Meshes and blocks that go out as they are.
    pub as_they_are: usize,
    /// Points of all grids; vertices of triangles.
    pub points: usize,
    /// Cells of all grids; triangles.
    pub cells: usize,
    /// Pairs of borders that are one edge.
    pub seams: usize,
    /// The largest distance of two such borders. Triangles and grids close it; B-splines leave as they are.
    pub largest_gap: f64,
    /// Between which two it is, by name.
    pub largest_between: Option<[String; 2]>,
    /// The largest angle between the normals on both sides of a seam; for B-splines only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_angle_deg: Option<f64>,
    /// Between which two it is, by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_between: Option<[String; 2]>,
    /// How far the middles of cells and cell edges are from the surfaces at most.
    pub chord_error: f64,
    /// What the format cannot hold, and what a cap cut short.
    pub notes: Vec<String>,
}

/// What is about to be written.
#[derive(Clone, Debug)]
pub struct Prepared {
    format: Format,
    content: Content,
    /// What it is.
    pub summary: ExportSummary,
}

#[derive(Clone, Debug)]
enum Content {
    Triangles(TriMesh),
    Grids(Vec<Grid>),
    Splines(Document),
}

/// Makes triangles, grids or shells of a document, without writing anything. Projects need no preparation and are none of
/// these.
pub fn prepare(
    document: &Document,
    format: Format,
    options: &ExportOptions,
    job: &Job,
) -> Result<Prepared, ExportError> {
    if matches!(format, Format::Step | Format::Iges) {
        return splines(document, format, options);
    }
    let grids = format == Format::Plot3d;
    let mut summary = ExportSummary::default();
    let mut surfaces: Vec<Arc<Surface>> = Vec::new();
    let mut names: Vec<String> = Vec::new();
    let mut left_out = [0_usize; 2];
    for entity in document.entities() {
        match &entity.shape {
            Shape::Mesh(_) if grids => left_out[1] += 1,
            Shape::Mesh(_) | Shape::Block(_) => summary.as_they_are += 1,
            Shape::Curve(_) => left_out[0] += 1,
            _ => {
                if let Some(surface) = entity.surface() {
                    surfaces.push(Arc::clone(surface));
                    names.push(entity.name.clone());
                }
            }
        }
    }
    if surfaces.is_empty() && summary.as_they_are == 0 {
        let expected = if grids { "surfaces, patches or blocks" } else { "surfaces, patches, meshes or blocks" };
        return Err(ExportError::Nothing { format, expected });
    }
    for (count, what) in left_out.into_iter().zip(["curves", "triangle meshes"]) {
        if count > 0 {
            summary.notes.push(format!("{count} {what} were left out: {} does not hold them", format.name()));
        }
    }
    let set = if surfaces.is_empty() {
        GridSet { complete: true, ..GridSet::default() }
    } else {
        let chord = CHORD * document.bounds().diagonal().max(f64::MIN_POSITIVE);
        let counts =
            options.counts.unwrap_or(if grids { Counts::Points(POINTS) } else { Counts::ChordTolerance(chord) });
        let made = GridOptions {
            spacing: options.spacing,
            clusters: options.clusters.clone(),
            ..GridOptions::new(counts, joining(document, options))
        };
        structured(&surfaces, &made, job)?
    };
    if !set.complete {
        return Err(ExportError::Cancelled);
    }
    summary.surfaces = surfaces.len();
    (summary.seams, summary.largest_gap, summary.chord_error) = (set.seams, set.largest_gap, set.chord_error);
    summary.largest_between = set.largest_between.map(|pair| pair.map(|k| names[k].clone()));
    if set.capped {
        summary
            .notes
            .push("some grids have the most points that are possible and are coarser than asked for".to_owned());
    }
    let content = if grids {
        Content::Grids(grids_of(document, set))
    } else {
        Content::Triangles(mesh_of(document, &set, &names)?)
    };
    (summary.points, summary.cells) = match &content {
        Content::Triangles(mesh) => (mesh.points().len(), mesh.triangles().len()),
        Content::Grids(grids) => {
            let cells = |g: &Grid| g.counts().iter().map(|&c| c.saturating_sub(1).max(1)).product::<usize>();
            (grids.iter().map(|g| g.points().len()).sum(), grids.iter().map(cells).sum())
        }
        Content::Splines(_) => (0, 0),
    };
    Ok(Prepared { format, content, summary })
}

/// A document that leaves as B-splines, and how well its surfaces fit.
fn splines(document: &Document, format: Format, options: &ExportOptions) -> Result<Prepared, ExportError> {
    let held = |e: &crate::model::document::Entity| e.facets().is_none();
    if !document.entities().iter().any(|e| held(e)) {
        return Err(ExportError::Nothing { format, expected: "surfaces, patches or curves" });
    }
    let seams = Shells::of(document, joining(document, options)).seams;
    let mut notes = Vec::new();
    if seams.non_manifold > 0 {
        notes.push(format!("{} edges have more than two faces; meshers may not take that", seams.non_manifold));
    }
    if seams.one_sided > 0 {
        notes.push(format!("{} shells cannot be turned so that all their faces look the same way", seams.one_sided));
    }
    let summary = ExportSummary {
        surfaces: document.entities().iter().filter(|e| e.surface().is_some()).count(),
        seams: seams.count,
        largest_gap: seams.largest_gap,
        largest_between: seams.gap_between,
        largest_angle_deg: Some(seams.largest_angle_deg),
        angle_between: seams.angle_between,
        notes,
        ..ExportSummary::default()
    };
    Ok(Prepared { format, content: Content::Splines(document.clone()), summary })
}

/// What two borders may be apart and still be one edge.
fn joining(document: &Document, options: &ExportOptions) -> f64 {
    options.joining.unwrap_or(document.tolerances().joining)
}

/// The grids of surfaces and patches and the blocks, in the order of the document.
fn grids_of(document: &Document, set: GridSet) -> Vec<Grid> {
    let mut made = set.grids.into_iter();
    let mut out = Vec::new();
    for entity in document.entities() {
        match &entity.shape {
            Shape::Block(facets) => out.extend(facets.grid().cloned()),
            _ if entity.surface().is_some() => out.extend(made.next()),
            _ => {}
        }
    }
    out
}

/// The triangles of surfaces and patches with shared vertices, and the meshes and blocks behind them.
fn mesh_of(document: &Document, set: &GridSet, names: &[String]) -> Result<TriMesh, ExportError> {
    let first = welded(&set.grids, names)?;
    if document.meshes().next().is_none() {
        return Ok(first);
    }
    let (mut points, mut triangles) = (first.points().to_vec(), first.triangles().to_vec());
    let mut groups = first.groups;
    for entity in document.entities() {
        let Some(facets) = entity.facets() else { continue };
        let base = u32::try_from(points.len());
        let base = base.map_err(|_| MeshError::TooMany { got: points.len(), limit: u32::MAX as usize })?;
        let start = triangles.len();
        points.extend(facets.mesh().points());
        triangles.extend(facets.mesh().triangles().iter().map(|t| t.map(|k| k.saturating_add(base))));
        groups.push(Group { name: entity.name.clone(), triangles: start..triangles.len() });
    }
    let mut mesh = TriMesh::new(points, triangles)?;
    mesh.groups = groups;
    Ok(mesh)
}

/// Writes what was prepared, in one step.
pub fn write(path: &Path, prepared: &Prepared, options: &ExportOptions) -> Result<Saved, SaveError> {
    let summary = &prepared.summary;
    let mut saved = Saved { entities: summary.surfaces + summary.as_they_are, ..Saved::default() };
    let file_name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let time = std::time::SystemTime::now();
    let bytes = match &prepared.content {
        Content::Grids(grids) => {
            let encoding = if options.ascii {
                Encoding::Ascii
            } else {
                let (records, big_endian) = (options.records, options.big_endian);
                Encoding::Binary { records, big_endian, double: !options.single }
            };
            plot3d::write(grids, encoding)
        }
        Content::Triangles(mesh) if prepared.format == Format::Obj => obj::write(mesh).into_bytes(),
        Content::Triangles(mesh) if options.ascii => stl::write_ascii(mesh).into_bytes(),
        Content::Triangles(mesh) => stl::write_binary(mesh),
        Content::Splines(document) => {
            let (text, written) = if prepared.format == Format::Step {
                let joining = joining(document, options);
                step::write(document, &step::StepOptions { file_name, time, joining })
            } else {
                iges::write(document, &iges::IgesOptions { file_name, time })
                    .map_err(|source| SaveError::Iges { path: path.into(), source })?
            };
            saved = written;
            text.into_bytes()
        }
    };
    atomic::write(path, &bytes)?;
    saved.notes.extend(summary.notes.iter().cloned());
    Ok(Saved { export: Some(summary.clone()), ..saved })
}

/// Both steps.
pub(super) fn save(
    path: &Path,
    document: &Document,
    format: Format,
    options: &ExportOptions,
) -> Result<Saved, SaveError> {
    let prepared = prepare(document, format, options, &Job::new());
    let prepared = prepared.map_err(|source| SaveError::Export { path: path.into(), format, source })?;
    write(path, &prepared, options)
}
