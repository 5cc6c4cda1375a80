//! The project: a whole document as RON, healed patches with their specifications and reports included.
//!
//! ```text
//! (version: 2, program: "Patchwright 0.1.0", unit: Millimetre, next_id: 2, entities: [
//!   (id: 0, name: "hood", visible: true, color: None, shape: Surface((knots: (..), points: [..], weights: None))),
//! ])
//! ```
//!
//! Version 2 added trimmed faces, meshes and blocks; projects of version 1 are read. Numbers are written so that they read back bit for bit. A file of a later version is refused by its number;
//! an entity whose numbers make no curve or surface is reported and loses itself only.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{ImportReport, Opened, Severity};
use crate::kernel::geom::trim::{EdgeRole, Face, FaceEdge, Ring, SurfaceKind};
use crate::kernel::geom::{Curve, Knots, Surface};
use crate::kernel::mesh::facets::{Facets, FacetsData};
use crate::model::document::{Document, Entity, EntityId, Patch, Shape, Unit};
use crate::model::spec::{HealSpec, PatchReport, PatchSpec};

/// The version that is written. Older versions are read, later ones refused.
pub const VERSION: u32 = 2;

/// Why a file is no project that can be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProjectError {
    /// A later version of the program wrote it.
    #[error("it is a project of version {got}, this program reads up to {limit}; update the program")]
    TooNew {
        /// Its version.
        got: u32,
        /// The last version that can be read.
        limit: u32,
    },
    /// It is no text.
    #[error("byte {at} is not UTF-8 text, as a project must be")]
    NotText {
        /// The first such byte, from 0.
        at: usize,
    },
    /// It is no project, or a damaged one.
    #[error("line {line}, column {column}: {reason}; a project is expected here")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// The column, from 1.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
}

/// Why a document cannot be written as a project.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the document cannot be written as RON: {0}")]
pub struct ProjectWriteError(pub String);

#[derive(Serialize)]
struct ProjectOut<'a> {
    version: u32,
    program: &'a str,
    unit: Unit,
    next_id: u64,
    entities: Vec<EntityOut<'a>>,
}

#[derive(Serialize)]
struct EntityOut<'a> {
    id: u64,
    name: &'a str,
    visible: bool,
    color: Option<[f32; 3]>,
    shape: ShapeOut<'a>,
}

#[derive(Serialize)]
enum ShapeOut<'a> {
    Surface(&'a Surface),
    Face(FaceOut<'a>),
    Curve(&'a Curve),
    Patch(PatchOut<'a>),
    Mesh(&'a Facets),
    Block(&'a Facets),
}

#[derive(Serialize)]
struct FaceOut<'a> {
    surface: &'a Surface,
    kind: SurfaceKind,
    loops: Vec<Vec<FaceEdgeOut<'a>>>,
}

/// Edges that faces share are written with every face, and are one again by their number when they are read.
#[derive(Serialize)]
struct FaceEdgeOut<'a> {
    id: u64,
    curve: &'a Curve,
    pcurve: &'a Curve,
    reversed: bool,
    role: EdgeRole,
}

impl<'a> FaceOut<'a> {
    fn of(face: &'a Face) -> Self {
        let edge = |e: &'a FaceEdge| FaceEdgeOut {
            id: e.id,
            curve: &e.curve,
            pcurve: &e.pcurve,
            reversed: e.reversed,
            role: e.role,
        };
        let loops = face.rings().iter().map(|r| r.edges.iter().map(edge).collect()).collect();
        Self { surface: face.surface(), kind: face.kind, loops }
    }
}

#[derive(Serialize)]
struct PatchOut<'a> {
    surface: &'a Surface,
    spec: &'a PatchSpec,
    settings: &'a HealSpec,
    report: &'a PatchReport,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProjectIn {
    version: u32,
    #[serde(default, rename = "program")]
    _program: String,
    unit: Unit,
    #[serde(default)]
    next_id: u64,
    entities: Vec<EntityIn>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EntityIn {
    id: u64,
    name: String,
    visible: bool,
    color: Option<[f32; 3]>,
    shape: ShapeIn,
}

#[derive(Deserialize)]
enum ShapeIn {
    Surface(SurfaceIn),
    Face(FaceIn),
    Curve(CurveIn),
    Patch(Box<PatchIn>),
    Mesh(FacetsData),
    Block(FacetsData),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KnotsIn {
    degree: usize,
    values: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceIn {
    knots: [KnotsIn; 2],
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CurveIn {
    knots: KnotsIn,
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FaceIn {
    surface: SurfaceIn,
    #[serde(default)]
    kind: SurfaceKind,
    loops: Vec<Vec<FaceEdgeIn>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FaceEdgeIn {
    id: u64,
    curve: CurveIn,
    pcurve: CurveIn,
    #[serde(default)]
    reversed: bool,
    #[serde(default)]
    role: EdgeRole,
}

/// Edges by number, so that faces which share one share it again.
type Edges = HashMap<u64, Arc<Curve>>;

impl FaceIn {
    fn checked(self, edges: &mut Edges) -> Result<Face, String> {
        let surface = self.surface.checked()?;
        let mut rings = Vec::with_capacity(self.loops.len());
        for ring in self.loops {
            let mut out = Ring::default();
            for edge in ring {
                let (curve, pcurve) = (edge.curve.checked()?, edge.pcurve.checked()?);
                let known = edges.entry(edge.id).or_insert_with(|| Arc::new(curve.clone()));
                let curve = if **known == curve { Arc::clone(known) } else { Arc::new(curve) };
                let (reversed, role) = (edge.reversed, edge.role);
                out.edges.push(FaceEdge { id: edge.id, curve, pcurve, reversed, role });
            }
            rings.push(out);
        }
        Face::new(surface, rings, self.kind).map_err(|e| e.to_string())
    }
}

impl CurveIn {
    fn checked(self) -> Result<Curve, String> {
        let knots = Knots::new(self.knots.degree, self.knots.values).map_err(|e| format!("knots: {e}"))?;
        Curve::new(knots, self.points, self.weights).map_err(|e| e.to_string())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchIn {
    surface: SurfaceIn,
    spec: PatchSpec,
    #[serde(default)]
    settings: HealSpec,
    report: PatchReport,
}

impl SurfaceIn {
    fn checked(self) -> Result<Arc<Surface>, String> {
        let [u, v] = self.knots.map(|k| Knots::new(k.degree, k.values).map_err(|e| format!("knots: {e}")));
        Surface::new(u?, v?, self.points, self.weights).map(Arc::new).map_err(|e| e.to_string())
    }
}

impl ShapeIn {
    fn kind(&self) -> &'static str {
        match self {
            Self::Surface(_) => "surface",
            Self::Face(_) => "face",
            Self::Curve(_) => "curve",
            Self::Patch(_) => "patch",
            Self::Mesh(_) => "mesh",
            Self::Block(_) => "block",
        }
    }

    fn checked(self, edges: &mut Edges) -> Result<Shape, String> {
        Ok(match self {
            Self::Surface(surface) => Shape::Surface(surface.checked()?),
            Self::Face(face) => Shape::Face(Arc::new(face.checked(edges)?)),
            Self::Curve(curve) => Shape::Curve(Arc::new(curve.checked()?)),
            Self::Mesh(data) => Shape::Mesh(Arc::new(Facets::try_from(data).map_err(|e| e.to_string())?)),
            Self::Block(data) => Shape::Block(Arc::new(Facets::try_from(data).map_err(|e| e.to_string())?)),
            Self::Patch(patch) => {
                let surface = patch.surface.checked()?;
                Shape::Patch(Arc::new(Patch {
                    surface,
                    spec: patch.spec,
                    settings: patch.settings,
                    report: patch.report,
                }))
            }
        })
    }
}

/// The text of a document.
pub fn write(document: &Document) -> Result<String, ProjectWriteError> {
    let project = ProjectOut {
        version: VERSION,
        program: concat!("Patchwright ", env!("CARGO_PKG_VERSION")),
        unit: document.unit,
        next_id: document.next_id(),
        entities: document.entities().iter().map(|e| EntityOut::of(e)).collect(),
    };
    let pretty = ron::ser::PrettyConfig::new().depth_limit(3).indentor("  ").new_line("\n");
    let mut text = ron::ser::to_string_pretty(&project, pretty).map_err(|e| ProjectWriteError(e.to_string()))?;
    text.push('\n');
    Ok(text)
}

impl<'a> EntityOut<'a> {
    fn of(entity: &'a Entity) -> Self {
        let shape = match &entity.shape {
            Shape::Surface(surface) => ShapeOut::Surface(surface),
            Shape::Face(face) => ShapeOut::Face(FaceOut::of(face)),
            Shape::Curve(curve) => ShapeOut::Curve(curve),
            Shape::Mesh(facets) => ShapeOut::Mesh(facets),
            Shape::Block(facets) => ShapeOut::Block(facets),
            Shape::Patch(patch) => {
                let Patch { surface, spec, settings, report } = patch.as_ref();
                ShapeOut::Patch(PatchOut { surface, spec, settings, report })
            }
        };
        let (id, name, visible, color) = (entity.id.0, entity.name.as_str(), entity.visible, entity.color);
        Self { id, name, visible, color, shape }
    }
}

/// Reads the bytes of a file.
pub fn read(bytes: &[u8]) -> Result<Opened, ProjectError> {
    let text = std::str::from_utf8(bytes).map_err(|e| ProjectError::NotText { at: e.valid_up_to() })?;
    let newer = |version: u32| ProjectError::TooNew { got: version, limit: VERSION };
    let project: ProjectIn = ron::from_str(text).map_err(|error| match version_of(text) {
        Some(version) if version > VERSION => newer(version),
        _ => {
            let at = error.span.start;
            ProjectError::Syntax { line: at.line, column: at.col, reason: error.code.to_string() }
        }
    })?;
    if project.version > VERSION {
        return Err(newer(project.version));
    }
    let mut report = ImportReport::default();
    let mut entities = Vec::with_capacity(project.entities.len());
    let mut taken = HashSet::new();
    let mut edges = Edges::new();
    let mut next_id = project.next_id.max(project.entities.iter().map(|e| e.id.saturating_add(1)).max().unwrap_or(0));
    for (at, entity) in project.entities.into_iter().enumerate() {
        let kind = entity.shape.kind();
        *report.found.entry(kind.into()).or_default() += 1;
        let shape = match entity.shape.checked(&mut edges) {
            Ok(shape) => shape,
            Err(reason) => {
                report.add(Severity::Skipped, kind, Some(at), None, format!("`{}`: {reason}", entity.name));
                continue;
            }
        };
        let mut id = entity.id;
        if !taken.insert(id) || id == u64::MAX {
            let reason = format!("`{}`: its id {id} is that of another entity; it got the id {next_id}", entity.name);
            report.add(Severity::Warning, kind, Some(at), None, reason);
            id = next_id;
            taken.insert(id);
            next_id = next_id.saturating_add(1);
        }
        let color = entity.color.filter(|c| c.iter().all(|v| v.is_finite()));
        entities.push(Entity { id: EntityId(id), name: entity.name, shape, visible: entity.visible, color });
    }
    let document = Document::from_parts(project.unit, entities, next_id);
    report.surfaces = document.surfaces().count() + document.patches().count();
    report.curves = document.curves().count();
    report.meshes = document.meshes().count();
    Ok(Opened { document, report })
}

/// The version that a text states near its start, even if the rest cannot be read.
fn version_of(text: &str) -> Option<u32> {
    let at = text.find("version")?;
    let rest = text[at + "version".len()..].trim_start().strip_prefix(':')?.trim_start();
    let digits = rest.split(|c: char| !c.is_ascii_digit()).next()?;
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::spec::{BoundaryMode, HealStep, IsoAt, Piece};

    fn document() -> Document {
        let third = 1.0 / 3.0;
        let points: Vec<DVec3> = (0..4)
            .map(|i| DVec3::new(third * f64::from(i), -0.0, 5e-324))
            .chain((0..4).map(|i| DVec3::new(f64::from(i), 0.1, -1.7e300)))
            .collect();
        let knots = |degree| Knots::bezier(degree, 0.1, 0.3).unwrap();
        let weights = Some((1..=8).map(|i| f64::from(i).sqrt()).collect());
        let surface = Arc::new(Surface::new(knots(3), knots(1), points, weights).unwrap());
        let mut document = Document::new(Unit::Foot);
        document.add("deleted", Shape::Surface(surface.clone()), None);
        document.add("a \"quoted\" name\nwith lines", Shape::Surface(surface.clone()), Some([0.1, 0.25, 0.7]));
        let curve = Curve::segment(DVec3::ZERO, DVec3::new(1.0, 2.0, third)).unwrap();
        let id = document.add("curve", Shape::Curve(Arc::new(curve)), None);
        document.edit(id, |e| e.visible = false);
        let side = || vec![Piece::Iso { surface: 0, at: IsoAt::U(third), from: 0.0, to: 0.7 }];
        let spec = PatchSpec {
            name: "nose".into(),
            boundary: [BoundaryMode::Keep, BoundaryMode::Project, BoundaryMode::Keep, BoundaryMode::Keep],
            sides: [side(), side(), side(), vec![Piece::Polyline(vec![(0.0, third, 1.0), (2.0, 3.0, 4.0)])]],
            ..PatchSpec::default()
        };
        let report = PatchReport {
            max_error: 1e-5 * third,
            resolution: [8, 9],
            history: vec![HealStep { resolution: [8, 9], max_error: third }],
            ..PatchReport::default()
        };
        let settings = HealSpec { tol: Some(third), onto: Some(vec![0, 2]), ..HealSpec::default() };
        document.add("patch", Shape::Patch(Arc::new(Patch { surface, spec, settings, report })), None);
        document.retain(|e| e.name != "deleted");
        document
    }

    #[test]
    fn everything_comes_back_bit_for_bit() {
        let document = document();
        let text = write(&document).unwrap();
        let Opened { document: back, report } = read(text.as_bytes()).unwrap();
        assert!(report.lines.is_empty(), "{:?}", report.lines);
        assert_eq!((back.unit, back.next_id()), (Unit::Foot, 4));
        // `==` on floats would take 0.0 for -0.0; the text does not.
        assert_eq!(write(&back).unwrap(), text);
        for (a, b) in document.entities().iter().zip(back.entities()) {
            assert_eq!((a.id, &a.name, a.visible, a.color), (b.id, &b.name, b.visible, b.color));
            assert_eq!((a.surface(), a.curve()), (b.surface(), b.curve()));
        }
        let patch = |d: &Document| d.patches().next().map(|(_, p)| Arc::clone(p)).unwrap();
        assert_eq!(patch(&document).spec, patch(&back).spec);
        assert_eq!(patch(&document).settings, patch(&back).settings);
        assert_eq!(patch(&document).report, patch(&back).report);
        let bits = |d: &Document| -> Vec<u64> {
            let surface = d.surfaces().next().unwrap().1;
            surface.points().iter().flat_map(DVec3::to_array).map(f64::to_bits).collect()
        };
        assert_eq!(bits(&document), bits(&back));
    }

    #[test]
    fn later_versions_are_refused_by_number() {
        let text = write(&document()).unwrap();
        let newer = text.replacen(&format!("version: {VERSION}"), "version: 7", 1);
        assert_eq!(read(newer.as_bytes()).unwrap_err(), ProjectError::TooNew { got: 7, limit: VERSION });
        let unreadable = "(version: 9, something: New)";
        assert_eq!(read(unreadable.as_bytes()).unwrap_err(), ProjectError::TooNew { got: 9, limit: VERSION });
        assert!(matches!(read(b"(version: 1, unit: Cubit)"), Err(ProjectError::Syntax { line: 1, .. })));
        assert_eq!(read(b"(ve\xff").unwrap_err(), ProjectError::NotText { at: 3 });
    }

    #[test]
    fn a_bad_entity_loses_itself_only() {
        let text = write(&document()).unwrap();
        let broken = text.replacen("5e-324", "inf", 1);
        let opened = read(broken.as_bytes()).unwrap();
        assert_eq!(opened.document.entities().len(), 2);
        assert_eq!(opened.report.lines.len(), 1);
        assert!(opened.report.lines[0].to_string().contains("not finite"), "{}", opened.report.lines[0]);
        let twice = text.replacen("id: 2", "id: 1", 1);
        let opened = read(twice.as_bytes()).unwrap();
        assert_eq!(opened.report.count(Severity::Warning), 1);
        let ids: Vec<u64> = opened.document.entities().iter().map(|e| e.id.0).collect();
        assert_eq!((ids, opened.document.next_id()), (vec![1, 4, 3], 5));
    }
}
