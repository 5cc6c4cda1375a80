//! From representations to entities: units, placements, and the walk through shells to surfaces.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::access::{self, Access, Problem, optional_reference, reference, references};
use super::part21::{self, Exchange, Value};
use super::shapes;
use crate::io::report::{ImportReport, Severity};
use crate::model::document::{Document, Shape, Unit};

/// How deep assemblies and item lists may be nested.
const MAX_DEPTH: usize = 64;
/// How many placed items a file may have, so that a small file cannot ask for endless copies.
const MAX_ITEMS: usize = 1_000_000;

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
    for instance in exchange.instances.values() {
        *report.found.entry(instance.type_name()).or_default() += 1;
    }
    let file = Access::new(&exchange);
    let (unit, factors) = units(&exchange, file, report);
    let mut walk = Walk {
        file,
        exchange: &exchange,
        report,
        document: Document::new(unit),
        factors,
        met: HashSet::new(),
        untrimmed: 0,
        items: 0,
    };
    for (representation, place) in placed_representations(&exchange, file) {
        walk.representation(representation, place, 0);
    }
    walk.rest();
    walk.document
}

struct Walk<'r, 'f, 'a> {
    file: Access<'f, 'a>,
    exchange: &'f Exchange<'a>,
    report: &'r mut ImportReport,
    document: Document,
    /// Factor from each representation context to the unit of the document.
    factors: HashMap<u64, f64>,
    met: HashSet<u64>,
    untrimmed: usize,
    items: usize,
}

impl Walk<'_, '_, '_> {
    fn skip(&mut self, number: u64, reason: impl Into<String>) {
        let (kind, line) = match self.exchange.instances.get(&number) {
            Some(instance) => (instance.type_name(), Some(instance.line)),
            None => ("STEP".to_owned(), None),
        };
        self.report.add(Severity::Skipped, kind, Some(number as usize), line, reason);
    }

    fn representation(&mut self, number: u64, place: DAffine3, depth: usize) {
        let Some(record) =
            self.exchange.instances.get(&number).and_then(|i| i.records.iter().find(|r| r.values.len() >= 3))
        else {
            return;
        };
        let factor = optional_reference(record, 2).and_then(|c| self.factors.get(&c)).copied().unwrap_or(1.0);
        // Lengths of the context become lengths of the document behind the placement.
        let place = place * DAffine3::from_scale(DVec3::splat(factor));
        for item in references(record, 1).unwrap_or_default() {
            self.item(item, &place, "", depth + 1);
        }
    }

    fn item(&mut self, number: u64, place: &DAffine3, name: &str, depth: usize) {
        self.items += 1;
        if depth > MAX_DEPTH || self.items > MAX_ITEMS {
            if depth == MAX_DEPTH + 1 || self.items == MAX_ITEMS + 1 {
                self.skip(number, format!("nested deeper than {MAX_DEPTH} or more than {MAX_ITEMS} placed items"));
            }
            return;
        }
        let Some(instance) = self.exchange.instances.get(&number) else {
            self.skip(number, "it is referred to and not in the file");
            return;
        };
        self.met.insert(number);
        let Some(record) = instance.records.first() else { return };
        let own = match record.values.first() {
            Some(Value::String(raw)) if !raw.is_empty() => part21::text(raw).into_owned(),
            _ => name.to_owned(),
        };
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
            | "ORIENTED_OPEN_SHELL" => Some(()),
            _ => None,
        };
        if list_at.is_some() {
            let inner: Vec<u64> = record.values.iter().skip(1).flat_map(all_references).collect();
            for next in inner {
                self.item(next, place, &own, depth + 1);
            }
            return;
        }
        match record.name {
            "ADVANCED_FACE" | "FACE_SURFACE" => self.face(number, place, &own),
            "MAPPED_ITEM" => match self.mapped(number) {
                Ok((representation, inner)) => self.representation(representation, *place * inner, depth + 1),
                Err(reason) => self.skip(number, reason),
            },
            n if n.starts_with("AXIS") || n == "CARTESIAN_POINT" || n == "VERTEX_POINT" => {}
            n if is_surface(instance, n) => match shapes::surface(self.file, number, &[], 0) {
                Ok(surface) => self.add(number, &own, Shape::Surface(Arc::new(surface.transformed(place)))),
                Err(reason) => self.skip(number, reason),
            },
            _ => match shapes::curve(self.file, number, None, 0) {
                Ok(curve) => self.add(number, &own, Shape::Curve(Arc::new(curve.transformed(place)))),
                Err(reason) => self.skip(number, reason),
            },
        }
    }

    fn add(&mut self, number: u64, name: &str, shape: Shape) {
        let finite = match &shape {
            Shape::Surface(s) => s.points().iter().all(|p| p.is_finite()),
            Shape::Curve(c) => c.points().iter().all(|p| p.is_finite()),
            _ => true,
        };
        if !finite {
            self.skip(number, "its coordinates overflow when it is placed");
            return;
        }
        match &shape {
            Shape::Curve(_) => self.report.curves += 1,
            _ => self.report.surfaces += 1,
        }
        let name = if name.is_empty() { format!("#{number}") } else { name.to_owned() };
        self.document.add(name, shape, None);
    }

    fn face(&mut self, number: u64, place: &DAffine3, name: &str) {
        let result = self.file.record(number, &["ADVANCED_FACE", "FACE_SURFACE"]).and_then(|record| {
            let mut reach = Vec::new();
            let mut edges = 0;
            for bound in references(record, 1)? {
                edges += self.bound(bound, &mut reach)?;
            }
            let basis = reference(record, 2)?;
            Ok((basis, shapes::surface(self.file, basis, &reach, 0)?, edges))
        });
        match result {
            Ok((basis, surface, edges)) => {
                self.met.insert(basis);
                self.untrimmed += usize::from(edges > 0);
                self.add(number, name, Shape::Surface(Arc::new(surface.transformed(place))));
            }
            Err(reason) => self.skip(number, reason),
        }
    }

    /// Gathers points on the edges of a face bound and counts the edges.
    fn bound(&mut self, number: u64, reach: &mut Vec<DVec3>) -> Result<usize, Problem> {
        let bound = self.file.record(number, &["FACE_OUTER_BOUND", "FACE_BOUND"])?;
        let ring = reference(bound, 1)?;
        let Ok(edge_loop) = self.file.record(ring, &["EDGE_LOOP"]) else { return Ok(0) };
        let edges = references(edge_loop, 1)?;
        for &oriented in &edges {
            let oriented = self.file.record(oriented, &["ORIENTED_EDGE"])?;
            let edge = self.file.record(reference(oriented, 3)?, &["EDGE_CURVE"])?;
            let vertex = |at: usize| -> Result<DVec3, Problem> {
                let vertex = self.file.record(reference(edge, at)?, &["VERTEX_POINT"])?;
                self.file.point(reference(vertex, 1)?)
            };
            let ends = [vertex(1)?, vertex(2)?];
            let carrier = reference(edge, 3)?;
            let in_order = if access::is_true(edge, 4) { ends } else { [ends[1], ends[0]] };
            reach.extend(ends);
            // An edge that cannot be read still leaves its ends.
            if let Ok(curve) = shapes::curve(self.file, carrier, Some(in_order), 0) {
                reach.extend(curve.sampled(4).into_iter().map(|(_, p)| p));
            }
        }
        Ok(edges.len())
    }

    /// The representation of a MAPPED_ITEM and where it goes.
    fn mapped(&self, number: u64) -> Result<(u64, DAffine3), Problem> {
        let item = self.file.record(number, &["MAPPED_ITEM"])?;
        let map = self.file.record(reference(item, 1)?, &["REPRESENTATION_MAP"])?;
        let origin = shapes::placement(self.file, reference(map, 0)?)?;
        let target = shapes::placement(self.file, reference(item, 2)?)?;
        Ok((reference(map, 1)?, target * origin.inverse()))
    }

    /// What no representation reached, and what was read other than it stands.
    fn rest(&mut self) {
        if self.untrimmed > 0 {
            let reason = format!("{} trimmed faces were opened as their whole surfaces", self.untrimmed);
            self.report.add(Severity::Info, "ADVANCED_FACE", None, None, reason);
        }
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
fn all_references(value: &Value<'_>) -> Vec<u64> {
    match value {
        Value::Reference(number) => vec![*number],
        Value::List(values) => values.iter().flat_map(all_references).collect(),
        _ => Vec::new(),
    }
}

/// The unit of the document (that of the first context with one) and the factor of every context to it.
fn units(exchange: &Exchange<'_>, file: Access<'_, '_>, report: &mut ImportReport) -> (Unit, HashMap<u64, f64>) {
    let mut metres: Vec<(u64, f64)> = Vec::new();
    for &number in &exchange.order {
        let Some(record) = exchange.instances.get(&number).and_then(|i| i.record("GLOBAL_UNIT_ASSIGNED_CONTEXT"))
        else {
            continue;
        };
        let unit = references(record, 0).unwrap_or_default().into_iter().find_map(|n| length_in_metres(file, n, 0));
        match unit {
            Some(metre) => metres.push((number, metre)),
            None => report.add(
                Severity::Warning,
                "STEP unit",
                Some(number as usize),
                None,
                "no length unit that can be read; lengths are kept as they are",
            ),
        }
    }
    let Some(&(_, first)) = metres.first() else { return (Unit::Unknown, HashMap::new()) };
    let known = [
        (Unit::Millimetre, 1e-3),
        (Unit::Metre, 1.0),
        (Unit::Inch, 0.0254),
        (Unit::Foot, 0.3048),
        (Unit::Centimetre, 1e-2),
        (Unit::Kilometre, 1e3),
        (Unit::Micrometre, 1e-6),
        (Unit::Mile, 1609.344),
        (Unit::Mil, 2.54e-5),
        (Unit::Microinch, 2.54e-8),
    ];
    let (unit, size) =
        known.into_iter().find(|(_, m)| (m / first - 1.0).abs() < 1e-9).unwrap_or((Unit::Millimetre, 1e-3));
    let factor = |m: f64| if (m / size - 1.0).abs() < 1e-9 { 1.0 } else { m / size };
    if metres.iter().any(|&(_, m)| factor(m) != 1.0) {
        let reason =
            format!("the file uses several units or an uncommon one; all lengths were converted to {}", unit.symbol());
        report.add(Severity::Info, "STEP unit", None, None, reason);
    }
    (unit, metres.into_iter().map(|(context, m)| (context, factor(m))).collect())
}

/// How many metres a length unit has; `None` for units of other things.
fn length_in_metres(file: Access<'_, '_>, number: u64, depth: usize) -> Option<f64> {
    let instance = file.instance(number).ok()?;
    instance.record("LENGTH_UNIT")?;
    if let Some(si) = instance.record("SI_UNIT") {
        let prefix = match si.values.iter().rev().nth(1) {
            Some(Value::Enum(name)) => match *name {
                "MILLI" => 1e-3,
                "CENTI" => 1e-2,
                "DECI" => 1e-1,
                "KILO" => 1e3,
                "MICRO" => 1e-6,
                "NANO" => 1e-9,
                _ => return None,
            },
            _ => 1.0,
        };
        return Some(prefix);
    }
    let conversion = instance.record("CONVERSION_BASED_UNIT")?;
    let measure = file.instance(reference(conversion, 1).ok()?).ok()?;
    let record = measure.records.iter().find(|r| r.values.len() >= 2)?;
    let value = access::real(record, 0).ok()?;
    let base = if depth < 4 { length_in_metres(file, reference(record, 1).ok()?, depth + 1)? } else { return None };
    Some(value * base).filter(|m| *m > 0.0 && m.is_finite())
}

/// Every representation of shape with the places where it occurs.
fn placed_representations(exchange: &Exchange<'_>, file: Access<'_, '_>) -> Vec<(u64, DAffine3)> {
    let is_shape = |n: &u64| {
        exchange.instances.get(n).is_some_and(|i| {
            i.records
                .iter()
                .any(|r| r.name.ends_with("SHAPE_REPRESENTATION") && matches!(r.values.get(1), Some(Value::List(_))))
        })
    };
    // Plain relationships make one node of several representations; those with a transformation are placements.
    let mut same: HashMap<u64, Vec<u64>> = HashMap::new();
    let mut children: HashMap<u64, Vec<(u64, DAffine3)>> = HashMap::new();
    let mut placed: HashSet<u64> = HashSet::new();
    for number in &exchange.order {
        let Some(instance) = exchange.instances.get(number) else { continue };
        let named = |n: &str| instance.record(n);
        let Some(base) = named("REPRESENTATION_RELATIONSHIP")
            .or_else(|| named("SHAPE_REPRESENTATION_RELATIONSHIP").filter(|r| r.values.len() >= 4))
        else {
            continue;
        };
        let (Ok(child), Ok(parent)) = (reference(base, 2), reference(base, 3)) else { continue };
        let operator = named("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION").and_then(|r| optional_reference(r, 0));
        match operator.and_then(|n| transformation(file, n).ok()) {
            Some(place) => {
                children.entry(parent).or_default().push((child, place));
                placed.insert(child);
            }
            None => {
                same.entry(child).or_default().push(parent);
                same.entry(parent).or_default().push(child);
            }
        }
    }
    let mapped: HashSet<u64> = exchange
        .instances
        .values()
        .filter_map(|i| i.record("REPRESENTATION_MAP").and_then(|r| reference(r, 1).ok()))
        .collect();
    let group = |start: u64| {
        let mut all = vec![start];
        let mut at = 0;
        while at < all.len() {
            for &next in same.get(&all[at]).map_or(&[][..], Vec::as_slice) {
                if !all.contains(&next) {
                    all.push(next);
                }
            }
            at += 1;
        }
        all
    };
    let mut out = Vec::new();
    let mut done: HashSet<u64> = HashSet::new();
    for &start in exchange.order.iter().filter(|n| is_shape(n) && !mapped.contains(n)) {
        if done.contains(&start) {
            continue;
        }
        let members = group(start);
        done.extend(&members);
        if members.iter().any(|m| placed.contains(m)) {
            continue;
        }
        let mut stack = vec![(members, DAffine3::IDENTITY, 0)];
        while let Some((members, place, depth)) = stack.pop() {
            for &member in &members {
                if is_shape(&member) {
                    out.push((member, place));
                }
                for (child, inner) in children.get(&member).map_or(&[][..], Vec::as_slice) {
                    if depth < MAX_DEPTH && out.len() + stack.len() < MAX_ITEMS {
                        stack.push((group(*child), place * *inner, depth + 1));
                    }
                }
            }
        }
    }
    out
}

/// ITEM_DEFINED_TRANSFORMATION: from the frame of its first item to that of its second.
fn transformation(file: Access<'_, '_>, number: u64) -> Result<DAffine3, Problem> {
    let record = file.record(number, &["ITEM_DEFINED_TRANSFORMATION"])?;
    let from = shapes::placement(file, reference(record, 2)?)?;
    let to = shapes::placement(file, reference(record, 3)?)?;
    Ok(to * from.inverse())
}
