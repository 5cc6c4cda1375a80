//! From representations to entities: the walk through solids, shells and sets to faces, surfaces and curves.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::access::{Access, Budget, Problem, TOO_OFTEN, optional_reference, reference, references};
use super::assembly::placed_representations;
use super::curves::{self, Bounds};
use super::faces::{self, Edges};
use super::part21::{self, Exchange, Value};
use super::style::Styles;
use super::surfaces;
use super::units::{ContextUnits, units};
use crate::io::faces::{FaceJob, make, reach, show_all_if_all_are_hidden};
use crate::io::report::{ImportReport, Severity};
use crate::kernel::geom::trim::SurfaceKind;
use crate::model::document::{Document, Entity, EntityId, Shape};

/// How deep assemblies and item lists may be nested.
pub const MAX_DEPTH: usize = 64;
/// How many placed items a file may have, so that a small file cannot ask for endless copies.
pub const MAX_ITEMS: usize = 1_000_000;

/// Reads a file.
pub fn read(text: &str, report: &mut ImportReport) -> Document {
    let exchange = part21::parse(text);
    for fault in &exchange.faults {
        report.add(
            Severity::Skipped,
            "STEP statement",
            fault.number.map(|n| n as usize),
            Some(fault.line),
            &fault.reason,
        );
    }
    if !exchange.ended {
        let reason = "it does not end with END-ISO-10303-21; the file may be cut off";
        report.add(Severity::Warning, "file", None, None, reason);
    }
    for instance in exchange.instances.values() {
        *report.found.entry(instance.type_name()).or_default() += 1;
    }
    let budget = Budget::of(text.len());
    let file = Access::new(&exchange, &budget);
    let (unit, factors) = units(&exchange, file, report);
    let styles = Styles::of(&exchange, file);
    let mut walk = Walk {
        file,
        exchange: &exchange,
        report,
        entities: Vec::new(),
        factors,
        styles,
        met: HashSet::new(),
        jobs: Vec::new(),
        edges: Edges::default(),
        items: 0,
        is_cut: false,
        places: 0,
    };
    let (placed, left_out) = placed_representations(&exchange, file);
    if let Some(number) = left_out {
        let reason = format!(
            "assemblies are nested deeper than {MAX_DEPTH} or lead back to themselves, or parts stand at too many \
             places; from this part on some are left out"
        );
        walk.skip(number, reason);
    }
    for (representation, place) in placed {
        let name = walk.styles.names.get(&representation).cloned().unwrap_or_default();
        let manner = Manner { name, color: walk.styles.colors.get(&representation).copied(), visible: true };
        walk.representation(representation, place, &manner, 0);
    }
    for (number, reason) in make(&std::mem::take(&mut walk.jobs), &mut walk.entities) {
        walk.warn(number, reason);
    }
    walk.report.lines.sort_by_key(|l| l.line);
    walk.rest();
    show_all_if_all_are_hidden(&mut walk.entities, walk.report);
    Document::from_parts(unit, walk.entities, 0)
}

struct Walk<'r, 'f, 'a> {
    file: Access<'f, 'a>,
    exchange: &'f Exchange<'a>,
    report: &'r mut ImportReport,
    entities: Vec<Entity>,
    /// The units of each representation context.
    factors: HashMap<u64, ContextUnits>,
    styles: Styles,
    met: HashSet<u64>,
    /// Faces to be made at the end.
    jobs: Vec<FaceJob<u64>>,
    edges: Edges,
    items: usize,
    /// Whether the file has unfolded too far.
    is_cut: bool,
    /// How many placed representations there were: edges are shared inside one only.
    places: usize,
}

/// How an item shows if it does not say itself.
#[derive(Clone, Debug)]
struct Manner {
    name: String,
    color: Option<[f32; 3]>,
    visible: bool,
}

impl Walk<'_, '_, '_> {
    fn skip(&mut self, number: u64, reason: impl Into<String>) {
        let (kind, line) = match self.exchange.instances.get(&number) {
            Some(instance) => (instance.type_name(), Some(instance.line)),
            None => ("STEP".to_owned(), None),
        };
        self.report.add(Severity::Skipped, kind, Some(number as usize), line, reason);
    }

    fn representation(&mut self, number: u64, place: DAffine3, manner: &Manner, depth: usize) {
        let Some(record) =
            self.exchange.instances.get(&number).and_then(|i| i.records.iter().find(|r| r.values.len() >= 3))
        else {
            return;
        };
        let context = optional_reference(record, 2).and_then(|c| self.factors.get(&c)).copied();
        let items = references(record, 1).unwrap_or_default();
        if context.is_none() && !self.factors.is_empty() && !items.is_empty() {
            self.warn(number, "its context names no unit; its lengths are taken as those of the document");
        }
        let context = context.unwrap_or_default();
        // Lengths of the context become lengths of the document behind the placement.
        let place = place * DAffine3::from_scale(DVec3::splat(context.length));
        let outer = self.file;
        self.file = outer.with_angle(context.angle);
        self.places += 1;
        for item in items {
            self.item(item, &place, manner, depth + 1);
        }
        self.file = outer;
    }

    fn item(&mut self, number: u64, place: &DAffine3, outer: &Manner, depth: usize) {
        self.items += 1;
        if depth > MAX_DEPTH || self.items > MAX_ITEMS {
            if depth == MAX_DEPTH + 1 || self.items == MAX_ITEMS + 1 {
                self.skip(number, format!("nested deeper than {MAX_DEPTH} or more than {MAX_ITEMS} placed items"));
            }
            return;
        }
        if self.file.is_spent() || self.file.spend(1).is_err() {
            if !self.is_cut {
                self.is_cut = true;
                self.skip(number, TOO_OFTEN);
            }
            return;
        }
        let Some(instance) = self.exchange.instances.get(&number) else {
            self.skip(number, "it is referred to and not in the file");
            return;
        };
        self.met.insert(number);
        let Some(record) = instance.records.first() else { return };
        // A complex instance has its name in a record of its own.
        let name = match instance.record("REPRESENTATION_ITEM").unwrap_or(record).values.first() {
            Some(Value::String(raw)) if !matches!(*raw, "" | "NONE") => part21::text(raw).into_owned(),
            _ => outer.name.clone(),
        };
        let color = self.styles.colors.get(&number).copied().or(outer.color);
        let manner = Manner { name, color, visible: outer.visible && !self.styles.hidden.contains(&number) };
        let list_at = match record.name {
            "GEOMETRIC_SET"
            | "GEOMETRIC_CURVE_SET"
            | "SHELL_BASED_SURFACE_MODEL"
            | "SHELL_BASED_WIREFRAME_MODEL"
            | "FACE_BASED_SURFACE_MODEL"
            | "OPEN_SHELL"
            | "CLOSED_SHELL"
            | "CONNECTED_FACE_SET"
            | "MANIFOLD_SOLID_BREP"
            | "FACETED_BREP"
            | "BREP_WITH_VOIDS"
            | "ORIENTED_CLOSED_SHELL"
            | "ORIENTED_OPEN_SHELL"
            | "ORIENTED_FACE"
            | "SUBFACE"
            | "SURFACED_OPEN_SHELL" => Some(()),
            _ => None,
        };
        if list_at.is_some() {
            let inner: Vec<u64> = record.values.iter().skip(1).flat_map(all_references).collect();
            for next in inner {
                self.item(next, place, &manner, depth + 1);
            }
            return;
        }
        match record.name {
            "ADVANCED_FACE" | "FACE_SURFACE" => self.face(number, place, &manner),
            "CURVE_BOUNDED_SURFACE" => self.bounded(number, place, &manner),
            "MAPPED_ITEM" => match self.mapped(number) {
                Ok((representation, inner)) => {
                    let name = self.styles.names.get(&representation).cloned();
                    let manner = Manner { name: name.unwrap_or_else(|| manner.name.clone()), ..manner };
                    self.representation(representation, *place * inner, &manner, depth + 1);
                }
                Err(reason) => self.skip(number, reason),
            },
            n if n.starts_with("AXIS") || n == "CARTESIAN_POINT" || n == "VERTEX_POINT" => {}
            n if is_surface(instance, n) => match surfaces::surface(self.file, number, &[], 0) {
                Ok(surface) => {
                    self.add(number, &manner, Shape::Surface(Arc::new(surface.transformed(place))));
                }
                Err(reason) => self.skip(number, reason),
            },
            _ => match curves::curve(self.file, number, Bounds::Own, 0) {
                Ok(curve) => {
                    self.add(number, &manner, Shape::Curve(Arc::new(curve.transformed(place))));
                }
                Err(reason) => self.skip(number, reason),
            },
        }
    }

    /// Adds an entity and says at which place of the document.
    fn add(&mut self, number: u64, manner: &Manner, shape: Shape) -> Option<usize> {
        let finite = match &shape {
            Shape::Surface(s) => s.points().iter().all(|p| p.is_finite()),
            Shape::Curve(c) => c.points().iter().all(|p| p.is_finite()),
            _ => true,
        };
        if !finite {
            self.skip(number, "its coordinates overflow when it is placed");
            return None;
        }
        match &shape {
            Shape::Curve(_) => self.report.curves += 1,
            _ => self.report.surfaces += 1,
        }
        let name = if manner.name.is_empty() { format!("#{number}") } else { manner.name.clone() };
        let id = EntityId(self.entities.len() as u64);
        self.entities.push(Entity { id, name, shape, visible: manner.visible, color: manner.color });
        Some(self.entities.len() - 1)
    }

    /// A face: its loops are read here, and made on all threads at the end.
    fn face(&mut self, number: u64, place: &DAffine3, manner: &Manner) {
        let basis = self.file.record(number, &["ADVANCED_FACE", "FACE_SURFACE"]).and_then(|r| reference(r, 2));
        let basis = match basis {
            Ok(basis) => basis,
            Err(reason) => return self.skip(number, reason),
        };
        self.met.insert(basis);
        let rings = faces::loops(self.file, number, (self.places, place), &mut self.edges);
        let vertices = faces::vertices(self.file, number);
        self.trimmed(number, basis, rings, vertices, place, manner, true);
    }

    /// A surface between curves, without a topology.
    fn bounded(&mut self, number: u64, place: &DAffine3, manner: &Manner) {
        let record = self.file.record(number, &["CURVE_BOUNDED_SURFACE"]);
        match record.and_then(|r| reference(r, 1)) {
            Ok(basis) => {
                let rings = faces::bounded(self.file, number, place, &mut self.edges);
                self.trimmed(number, basis, rings, Vec::new(), place, manner, false);
            }
            Err(reason) => self.skip(number, reason),
        }
    }

    #[allow(clippy::too_many_arguments)] // what a face is
    fn trimmed(
        &mut self,
        number: u64,
        basis: u64,
        rings: Result<Vec<Vec<crate::kernel::geom::ring::EdgeInput>>, Problem>,
        vertices: Vec<DVec3>,
        place: &DAffine3,
        manner: &Manner,
        oriented: bool,
    ) {
        let back = place.inverse();
        let on_loops = rings.iter().flat_map(|rings| reach(rings)).map(|p| back.transform_point3(p));
        let to_reach: Vec<DVec3> = on_loops.chain(vertices).collect();
        let surface = match surfaces::surface(self.file, basis, &to_reach, 0) {
            Ok(surface) => Arc::new(surface.transformed(place)),
            Err(reason) => return self.skip(number, reason),
        };
        let kind = self.file.instance(basis).map_or(SurfaceKind::Spline, surfaces::kind);
        let Some(at) = self.add(number, manner, Shape::Surface(Arc::clone(&surface))) else { return };
        match rings {
            Ok(rings) if rings.is_empty() => {}
            Ok(rings) => self.jobs.push(FaceJob { name: number, at, surface, kind, rings, oriented }),
            Err(reason) => self.warn(number, format!("opened as its whole surface: {reason}")),
        }
    }

    fn warn(&mut self, number: u64, reason: impl Into<String>) {
        let instance = self.exchange.instances.get(&number);
        let (kind, line) = instance.map_or(("STEP".to_owned(), None), |i| (i.type_name(), Some(i.line)));
        self.report.add(Severity::Warning, kind, Some(number as usize), line, reason);
    }

    /// The representation of a MAPPED_ITEM and where it goes.
    fn mapped(&self, number: u64) -> Result<(u64, DAffine3), Problem> {
        let item = self.file.record(number, &["MAPPED_ITEM"])?;
        let map = self.file.record(reference(item, 1)?, &["REPRESENTATION_MAP"])?;
        let origin = curves::placement(self.file, reference(map, 0)?)?;
        let target = curves::placement(self.file, reference(item, 2)?)?;
        Ok((reference(map, 1)?, target * origin.inverse()))
    }

    /// What no representation reached, and what was read other than it stands.
    fn rest(&mut self) {
        let mut left: BTreeMap<String, usize> = BTreeMap::new();
        for number in &self.exchange.order {
            let Some(instance) = self.exchange.instances.get(number) else { continue };
            let is_face = instance.record("ADVANCED_FACE").is_some() || instance.record("FACE_SURFACE").is_some();
            if is_face && !self.met.contains(number) {
                *left.entry(instance.type_name()).or_default() += 1;
            }
        }
        for (kind, count) in left {
            let reason = format!("{count} that no shape representation of the file contains");
            self.report.add(Severity::Skipped, kind, None, None, reason);
        }
    }
}

fn is_surface(instance: &part21::Instance<'_>, name: &str) -> bool {
    (name.contains("SURFACE") && !name.contains("CURVE"))
        || name == "PLANE"
        || instance.record("B_SPLINE_SURFACE").is_some()
        || name == "CURVE_BOUNDED_SURFACE"
}

/// The references of a value, lists included.
pub fn all_references(value: &Value<'_>) -> Vec<u64> {
    match value {
        Value::Reference(number) => vec![*number],
        Value::List(values) => values.iter().flat_map(all_references).collect(),
        _ => Vec::new(),
    }
}
