//! Faces with their loops: ADVANCED_FACE and FACE_SURFACE with edge loops, poly loops and vertex loops, and
//! CURVE_BOUNDED_SURFACE.
//!
//! Edges are taken from their curves in space; parameter curves of the file repeat them and are not needed. An EDGE_CURVE
//! is one edge for all faces that use it at the same place of an assembly. A face whose loops cannot be followed is
//! opened as its whole surface, and the report says why.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::access::{self, Access, Problem, reference, references};
use super::curves::{Bounds, curve, segments};
use crate::kernel::geom::Curve;
use crate::kernel::geom::ring::{self, EdgeInput};

/// The number of an edge and its curve.
type KnownEdge = (u64, Arc<Curve>);

/// The edges of a place of an assembly by statement; those of faceted solids by their two points.
#[derive(Debug, Default)]
pub struct Edges {
    known: HashMap<(u64, u64, usize), Result<KnownEdge, Problem>>,
    next: u64,
}

impl Edges {
    fn next(&mut self) -> u64 {
        self.next += 1;
        self.next
    }
}

/// The loops of a face, placed in space; and whether its borders are vertices only (a whole sphere).
pub fn loops(
    file: Access<'_, '_>,
    number: u64,
    place: (usize, &DAffine3),
    edges: &mut Edges,
) -> Result<Vec<Vec<EdgeInput>>, Problem> {
    let face = file.record(number, &["ADVANCED_FACE", "FACE_SURFACE"])?;
    let same_sense = access::is_true(face, 3);
    let mut rings = Vec::new();
    for bound in references(face, 1)? {
        let bound = file.record(bound, &["FACE_OUTER_BOUND", "FACE_BOUND"])?;
        let forward = access::is_true(bound, 2) == same_sense;
        let ring = reference(bound, 1)?;
        let instance = file.instance(ring)?;
        let mut out = if instance.record("EDGE_LOOP").is_some() {
            edge_loop(file, ring, place, edges)?
        } else if instance.record("POLY_LOOP").is_some() {
            poly_loop(file, ring, place, edges)?
        } else if instance.record("VERTEX_LOOP").is_some() {
            continue; // a pole, or the point of a surface without borders
        } else {
            return Err(format!("#{ring} {}: a kind of loop that is not read", instance.type_name()));
        };
        if !forward {
            out.reverse();
            out.iter_mut().for_each(|e| e.reversed = !e.reversed);
        }
        if !out.is_empty() {
            rings.push(out);
        }
    }
    Ok(rings)
}

fn edge_loop(
    file: Access<'_, '_>,
    number: u64,
    (at, place): (usize, &DAffine3),
    edges: &mut Edges,
) -> Result<Vec<EdgeInput>, Problem> {
    let ring = file.record(number, &["EDGE_LOOP"])?;
    let mut out = Vec::new();
    for oriented in references(ring, 1)? {
        file.spend(1)?;
        let oriented = file.record(oriented, &["ORIENTED_EDGE"])?;
        let (edge, forward) = (reference(oriented, 3)?, access::is_true(oriented, 4));
        let key = (edge, 0, at);
        if !edges.known.contains_key(&key) {
            let made = edge_curve(file, edge).map(|c| (edges.next(), Arc::new(c.transformed(place))));
            edges.known.insert(key, made);
        }
        let (id, curve) = edges.known.get(&key).cloned().unwrap_or_else(|| Err(format!("#{edge} is lost")))?;
        let same_sense = access::is_true(file.record(edge, &["EDGE_CURVE"])?, 4);
        out.push(EdgeInput { id, curve: Some(curve), guide: None, reversed: forward != same_sense });
    }
    Ok(out)
}

/// The curve of an edge between its vertices, in its own direction.
fn edge_curve(file: Access<'_, '_>, number: u64) -> Result<Curve, Problem> {
    let edge = file.record(number, &["EDGE_CURVE"])?;
    let vertex = |at: usize| -> Result<DVec3, Problem> {
        let vertex = file.record(reference(edge, at)?, &["VERTEX_POINT"])?;
        file.point(reference(vertex, 1)?)
    };
    let ends = [vertex(1)?, vertex(2)?];
    let in_order = if access::is_true(edge, 4) { ends } else { [ends[1], ends[0]] };
    curve(file, reference(edge, 3)?, Bounds::Ends(in_order), 0).map_err(|e| format!("edge #{number}: {e}"))
}

fn poly_loop(
    file: Access<'_, '_>,
    number: u64,
    (at, place): (usize, &DAffine3),
    edges: &mut Edges,
) -> Result<Vec<EdgeInput>, Problem> {
    let mut points = references(file.record(number, &["POLY_LOOP"])?, 1)?;
    points.dedup();
    let mut out = Vec::new();
    file.spend(points.len())?;
    for (k, &a) in points.iter().enumerate() {
        let b = points[(k + 1) % points.len()];
        if a == b {
            continue;
        }
        let key = (a.min(b), a.max(b), at);
        if !edges.known.contains_key(&key) {
            let made = file.point(key.0).and_then(|p| Ok((p, file.point(key.1)?))).and_then(|(p, q)| {
                let (p, q) = (place.transform_point3(p), place.transform_point3(q));
                Ok((edges.next(), Arc::new(Curve::segment(p, q).map_err(|e| e.to_string())?)))
            });
            edges.known.insert(key, made);
        }
        let (id, curve) = edges.known.get(&key).cloned().unwrap_or_else(|| Err(format!("#{a} is lost")))?;
        out.push(EdgeInput { id, curve: Some(curve), guide: None, reversed: a > b });
    }
    Ok(out)
}

/// The loops of a CURVE_BOUNDED_SURFACE, in no known direction.
pub fn bounded(
    file: Access<'_, '_>,
    number: u64,
    place: &DAffine3,
    edges: &mut Edges,
) -> Result<Vec<Vec<EdgeInput>>, Problem> {
    let record = file.record(number, &["CURVE_BOUNDED_SURFACE"])?;
    let mut rings = Vec::new();
    for boundary in references(record, 2)? {
        let names = ["OUTER_BOUNDARY_CURVE", "BOUNDARY_CURVE", "COMPOSITE_CURVE_ON_SURFACE"];
        let composite = file.record(boundary, &names)?;
        let mut ring = Vec::new();
        for (piece, _) in segments(file, composite)? {
            let curve = curve(file, piece, Bounds::Own, 0)?;
            let curve = Some(Arc::new(curve.transformed(place)));
            ring.push(EdgeInput { id: edges.next(), curve, guide: None, reversed: false });
        }
        ring::head_to_tail(&mut ring);
        if !ring.is_empty() {
            rings.push(ring);
        }
    }
    Ok(rings)
}

/// The points of the vertex loops of a face.
pub fn vertices(file: Access<'_, '_>, number: u64) -> Vec<DVec3> {
    let found = || -> Result<Vec<DVec3>, Problem> {
        let face = file.record(number, &["ADVANCED_FACE", "FACE_SURFACE"])?;
        let mut out = Vec::new();
        for bound in references(face, 1)? {
            let bound = file.record(bound, &["FACE_OUTER_BOUND", "FACE_BOUND"])?;
            if let Ok(ring) = file.record(reference(bound, 1)?, &["VERTEX_LOOP"]) {
                let vertex = file.record(reference(ring, 1)?, &["VERTEX_POINT"])?;
                out.push(file.point(reference(vertex, 1)?)?);
            }
        }
        Ok(out)
    };
    found().unwrap_or_default()
}
