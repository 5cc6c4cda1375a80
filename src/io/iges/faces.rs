//! Trimmed faces: trimmed surfaces (144 with 142), bounded surfaces (143 with 141) and faces of B-reps (510 with 508, 504
//! and 502).
//!
//! Loops are taken edge by edge: the members of composite curves (102) stay edges of their own. The curves in space
//! lead where there are any, because neighbours agree on them; parameter curves (of splines, whose parameters are those
//! of the file) then only say which side of a seam is meant, and are the edge where no curve in space can be read. An
//! edge of an edge list (504) is one edge for all faces that use it. Orientations in files cannot be
//! trusted, so edges are put head to tail by their ends. A face whose loops cannot be followed is opened as its
//! whole surface, and the report says why.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::params::{ParamError, Params};
use super::{Geometry, Reader, Severity, kinds};
use crate::io::faces::{FaceJob, reach};
use crate::io::iges::uses::Uses;
use crate::kernel::geom::ring::{self, EdgeInput};
use crate::kernel::geom::trim::SurfaceKind;
use crate::kernel::geom::{Curve, Surface};
use crate::model::document::Shape;

/// The loops of a face, each with its edges in order.
#[derive(Debug, Default)]
pub(super) struct Loops {
    rings: Vec<Vec<EdgeInput>>,
}

/// The surface of a face, in several parts where it jumps, with its properties.
#[derive(Clone, Debug)]
pub(super) struct FaceSurfaces {
    surfaces: Vec<Arc<Surface>>,
    properties: Vec<usize>,
}

/// Curves of edge lists by edge list, place in it and place in space, so that faces share them.
pub(super) type Edges = HashMap<(usize, usize, (usize, usize)), (u64, Arc<Curve>)>;

impl Reader<'_> {
    /// Opens a face: its loops are read here, and made at the end on all threads.
    pub(super) fn face(&mut self, at: usize, uses: &Uses) {
        let Some(surface_at) = uses.surface_of(at) else {
            return self.note(Severity::Skipped, at, "the surface that it trims does not exist");
        };
        let kind = self.directory.entries[surface_at].kind;
        let loops = self.loops(at);
        let map = self.placement(surface_at, Some(at));
        if let Ok(loops) = &loops {
            // An unbounded surface reaches as far as the loops, which are in the coordinates of the model here.
            let back = map.map_or(DAffine3::IDENTITY, |m| m.inverse());
            self.reach = reach(&loops.rings).map(|p| back.transform_point3(p)).collect();
        }
        let read = self.surfaces_of_face(at, surface_at, map.as_ref());
        self.reach.clear();
        let FaceSurfaces { surfaces, properties } = match read {
            Ok(read) => read,
            Err(reason) => return self.note(Severity::Skipped, at, reason),
        };
        let name = self.name_of(at, uses.properties_of(at)).or_else(|| self.name_of(surface_at, &properties));
        let count = surfaces.len();
        let mut first = None;
        for (part, surface) in surfaces.iter().enumerate() {
            if let Err(reason) = super::sound(surface.points()) {
                self.note(Severity::Skipped, at, reason);
                continue;
            }
            first.get_or_insert((self.entities.len(), Arc::clone(surface)));
            self.add(Shape::Surface(Arc::clone(surface)), at, surface_at, name.as_deref(), (part, count));
        }
        let Some((place, surface)) = first else { return };
        let loops = match loops {
            Ok(loops) => loops,
            Err(reason) => {
                return self.note(Severity::Warning, at, format!("opened as its whole surface: {reason}"));
            }
        };
        if loops.rings.is_empty() {
            return self.note(Severity::Info, at, "its boundary is that of its surface");
        }
        if count > 1 {
            let reason =
                format!("opened as its whole surface: that is in {count} parts, which cannot be trimmed together");
            return self.note(Severity::Warning, at, reason);
        }
        let exact = matches!(kind, 128 | 114);
        let mut rings = Vec::new();
        for mut edges in loops.rings {
            if !exact {
                edges.iter_mut().for_each(|e| e.guide = None);
            }
            ring::head_to_tail(&mut edges);
            rings.push(edges);
        }
        self.faces.push(FaceJob { name: at, at: place, surface, kind: surface_kind(kind), rings, oriented: false });
    }

    /// The surface under a face at its place. Faces that share one at the same place share it in memory too.
    fn surfaces_of_face(
        &mut self,
        at: usize,
        surface_at: usize,
        map: Option<&DAffine3>,
    ) -> Result<FaceSurfaces, String> {
        let kind = self.directory.entries[surface_at].kind;
        let key = (surface_at, self.directory.entries[at].transform, self.instance.map_or(0, |i| i.0));
        let bounded = !matches!(kind, 108 | 190 | 192 | 194);
        if bounded && let Some(known) = self.face_surfaces.get(&key) {
            return Ok(known.clone());
        }
        // The first reading is part of reading the file; others unfold it.
        if !self.read_surfaces.insert(surface_at) {
            let lines =
                self.directory.entries[surface_at].parameter_lines.clamp(1, self.sections.parameter.len().max(1));
            self.unfold(64 * lines).map_err(|reason| format!("not opened at all of its places: {reason}"))?;
        }
        let (surfaces, properties) = match self.geometry(surface_at, 0) {
            Ok((Geometry::Surfaces(surfaces), properties)) => (surfaces, properties),
            Ok(_) => return Err(format!("its surface is of type {kind} ({}), which is no surface", kinds::name(kind))),
            Err(reason) => return Err(format!("its surface, of type {kind} ({}): {reason}", kinds::name(kind))),
        };
        let moved = |surface: Surface| Arc::new(map.map_or_else(|| surface.clone(), |map| surface.transformed(map)));
        let out = FaceSurfaces { surfaces: surfaces.into_iter().map(moved).collect(), properties };
        if bounded {
            self.face_surfaces.insert(key, out.clone());
        }
        Ok(out)
    }

    /// The map of everything that belongs to a face: its own transform and the model's scale.
    fn face_map(&mut self, at: usize) -> Option<DAffine3> {
        let scale = 1.0 / self.header.scale;
        let own = self.transform(self.directory.entries[at].transform).ok().flatten();
        let place = self.instance.map_or(DAffine3::IDENTITY, |i| i.1);
        let map = DAffine3::from_scale(DVec3::splat(scale)) * place * own.unwrap_or(DAffine3::IDENTITY);
        (map != DAffine3::IDENTITY).then_some(map)
    }

    fn loops(&mut self, at: usize) -> Result<Loops, String> {
        let kind = self.directory.entries[at].kind;
        let map = self.face_map(at);
        let list = self.record(at, |_, params| boundary_list(kind, params))?.map_err(|e| e.to_string())?;
        let mut out = Loops::default();
        for pointer in list {
            let Some(boundary) = self.directory.find(pointer) else {
                return Err(format!("its boundary, entity {pointer}, does not exist"));
            };
            let ring = match self.directory.entries[boundary].kind {
                142 => self.curve_on_surface(boundary, map.as_ref())?,
                141 => self.boundary(boundary, map.as_ref())?,
                508 => self.brep_loop(boundary, at, map.as_ref())?,
                other => {
                    return Err(format!("its boundary, entity {pointer}, is of type {other} ({})", kinds::name(other)));
                }
            };
            if !ring.is_empty() {
                out.rings.push(ring);
            }
        }
        Ok(out)
    }

    fn new_edge(&mut self) -> u64 {
        self.next_edge += 1;
        self.next_edge
    }

    /// The curves that a pointer names, the members of a composite one by one.
    fn members(&mut self, pointer: usize, depth: usize) -> Result<Vec<Curve>, String> {
        let Some(at) = self.directory.find(pointer) else { return Err(format!("entity {pointer} does not exist")) };
        if self.directory.entries[at].kind != 102 || depth >= 8 {
            return self.placed_curves(pointer, depth);
        }
        let transform = self.directory.entries[at].transform;
        let own = self.transform(transform)?;
        self.unfold(64 * self.directory.entries[at].parameter_lines.clamp(1, self.sections.parameter.len().max(1)))?;
        let pointers = self.record(at, |_, params| -> Result<Vec<usize>, ParamError> {
            (0..params.count("members", 1)?).map(|_| params.pointer()).collect()
        })?;
        let mut out = Vec::new();
        for pointer in pointers.map_err(|e| e.to_string())? {
            let kind = self.directory.find(pointer).map(|at| self.directory.entries[at].kind);
            if !matches!(kind, Some(116 | 132)) {
                out.extend(self.members(pointer, depth + 1)?);
            }
        }
        Ok(match own {
            Some(map) => out.iter().map(|c| c.transformed(&map)).collect(),
            None => out,
        })
    }

    /// The pieces of a loop given by curves in space and parameter curves, either of which may be missing.
    fn pieces(&mut self, space: usize, parameter: usize, map: Option<&DAffine3>) -> Result<Vec<EdgeInput>, String> {
        let read = |reader: &mut Self, pointer: usize| {
            if pointer == 0 { Err("there is none".into()) } else { reader.members(pointer, 0) }
        };
        let curves = read(self, space);
        let guides = read(self, parameter);
        let curves = match (curves, &guides) {
            (Ok(curves), _) => curves,
            (Err(_), Ok(guides)) => {
                return Ok(guides
                    .iter()
                    .map(|guide| EdgeInput {
                        id: self.new_edge(),
                        curve: None,
                        guide: Some(guide.clone()),
                        reversed: false,
                    })
                    .collect());
            }
            (Err(reason), Err(other)) => {
                return Err(format!("curve in space: {reason}; parameter curve: {other}"));
            }
        };
        let guides = guides.ok().filter(|g| g.len() == curves.len());
        let moved = |c: &Curve| map.map_or_else(|| c.clone(), |map| c.transformed(map));
        Ok(curves
            .iter()
            .enumerate()
            .map(|(k, c)| EdgeInput {
                id: self.new_edge(),
                curve: Some(Arc::new(moved(c))),
                guide: guides.as_ref().and_then(|g| g.get(k).cloned()),
                reversed: false,
            })
            .collect())
    }

    /// A curve on a surface (142).
    fn curve_on_surface(&mut self, at: usize, map: Option<&DAffine3>) -> Result<Vec<EdgeInput>, String> {
        let [parameter, space] = self
            .record(at, |_, params| -> Result<[usize; 2], ParamError> {
                params.next();
                params.pointer()?;
                Ok([params.pointer()?, params.pointer()?])
            })?
            .map_err(|e| e.to_string())?;
        let sequence = self.directory.entries[at].sequence;
        self.pieces(space, parameter, map).map_err(|e| format!("its boundary, entity {sequence}: {e}"))
    }

    /// A boundary (141): curves in space with their parameter curves.
    fn boundary(&mut self, at: usize, map: Option<&DAffine3>) -> Result<Vec<EdgeInput>, String> {
        let list = self.record(at, |_, params| -> Result<Vec<(usize, Vec<usize>)>, ParamError> {
            params.next();
            params.next();
            params.pointer()?;
            let mut out = Vec::new();
            for _ in 0..params.count("curves", 3)? {
                let curve = params.pointer()?;
                params.next();
                let count = params.count("parameter curves", 1)?;
                out.push((curve, (0..count).map(|_| params.pointer()).collect::<Result<_, _>>()?));
            }
            Ok(out)
        })?;
        let mut out = Vec::new();
        for (space, parameters) in list.map_err(|e| e.to_string())? {
            let parameter = if parameters.len() == 1 { parameters[0] } else { 0 };
            out.extend(self.pieces(space, parameter, map)?);
        }
        Ok(out)
    }

    /// A loop of a B-rep (508): edges of edge lists.
    fn brep_loop(&mut self, at: usize, face: usize, map: Option<&DAffine3>) -> Result<Vec<EdgeInput>, String> {
        let uses = self.record(at, |_, params| brep_edges(params))?.map_err(|e| e.to_string())?;
        let place = (self.directory.entries[face].transform, self.instance.map_or(0, |i| i.0));
        let mut out = Vec::new();
        for use_ in uses {
            if use_.is_vertex {
                continue; // a vertex stands for a pole: the edges around it close there
            }
            let Some(list) = self.directory.find(use_.list).filter(|&l| self.directory.entries[l].kind == 504) else {
                return Err(format!("the edge list {} of a loop does not exist", use_.list));
            };
            let key = (list, use_.index, place);
            let known = self.edges.get(&key).cloned();
            let known = match known {
                Some(known) => Some(known),
                None => {
                    let curve = self.listed_edge(list, use_.index)?;
                    let made = curve.map(|c| {
                        let c = map.map_or_else(|| c.clone(), |map| c.transformed(map));
                        (self.new_edge(), Arc::new(c))
                    });
                    if let Some(made) = &made {
                        self.edges.insert(key, made.clone());
                    }
                    made
                }
            };
            let guide =
                use_.parameter.and_then(|p| self.members(p, 0).ok()).filter(|g| g.len() == 1).and_then(|mut g| g.pop());
            match known {
                Some((id, curve)) => {
                    out.push(EdgeInput { id, curve: Some(curve), guide, reversed: use_.reversed });
                }
                None if guide.is_some() => {
                    out.push(EdgeInput { id: self.new_edge(), curve: None, guide, reversed: false });
                }
                None => {}
            }
        }
        Ok(out)
    }

    /// The curve of an edge of an edge list (504), between its vertices; `None` where it has no length.
    fn listed_edge(&mut self, list: usize, index: usize) -> Result<Option<Curve>, String> {
        let sequence = self.directory.entries[list].sequence;
        let entries = match self.edge_lists.get(&list) {
            Some(entries) => Arc::clone(entries),
            None => {
                let read = self.record(list, |_, params| -> Result<Vec<[usize; 5]>, ParamError> {
                    let mut out = Vec::new();
                    for _ in 0..params.count("edges", 5)? {
                        let mut edge = [0; 5];
                        for value in &mut edge {
                            *value = params.pointer()?;
                        }
                        out.push(edge);
                    }
                    Ok(out)
                })?;
                let read = Arc::new(read.map_err(|e| format!("edge list {sequence}: {e}"))?);
                self.edge_lists.insert(list, Arc::clone(&read));
                read
            }
        };
        let Some(&[curve, start_list, start, end_list, end]) = index.checked_sub(1).and_then(|i| entries.get(i)) else {
            return Err(format!("edge list {sequence} has no edge {index}; it has {}", entries.len()));
        };
        let mut pieces = self.placed_curves(curve, 0).map_err(|e| format!("edge {index} of list {sequence}: {e}"))?;
        let (Some(curve), 0) = (pieces.pop(), pieces.len()) else {
            return Err(format!("edge {index} of list {sequence} is in several pieces"));
        };
        // The vertices only tell which way round: the curve of an edge is the edge.
        let vertices = [self.vertex(start_list, start), self.vertex(end_list, end)];
        if let [Some(a), Some(b)] = vertices {
            let [p, q] = curve.ends();
            if p.distance(b) + q.distance(a) < p.distance(a) + q.distance(b) {
                return Ok(Some(curve.reversed()));
            }
        }
        Ok(Some(curve))
    }

    /// A vertex of a vertex list (502), in its own coordinates.
    fn vertex(&mut self, list: usize, index: usize) -> Option<DVec3> {
        let at = self.directory.find(list).filter(|&at| self.directory.entries[at].kind == 502)?;
        let points = match self.vertex_lists.get(&at) {
            Some(points) => Arc::clone(points),
            None => {
                let read = self.record(at, |_, params| -> Result<Vec<DVec3>, ParamError> {
                    let count = params.count("vertices", 3)?;
                    let mut out = Vec::new();
                    for _ in 0..count {
                        out.push(DVec3::new(
                            params.real("a coordinate")?,
                            params.real("a coordinate")?,
                            params.real("a coordinate")?,
                        ));
                    }
                    Ok(out)
                });
                let points = Arc::new(read.ok()?.ok()?);
                self.vertex_lists.insert(at, Arc::clone(&points));
                points
            }
        };
        points.get(index.checked_sub(1)?).copied()
    }
}

/// What a surface of this type was.
pub(super) fn surface_kind(kind: i64) -> SurfaceKind {
    match kind {
        108 | 190 => SurfaceKind::Plane,
        118 => SurfaceKind::Ruled,
        120 => SurfaceKind::Revolution,
        122 => SurfaceKind::Extrusion,
        140 => SurfaceKind::Offset,
        192 => SurfaceKind::Cylinder,
        194 => SurfaceKind::Cone,
        196 => SurfaceKind::Sphere,
        198 => SurfaceKind::Torus,
        _ => SurfaceKind::Spline,
    }
}

/// The boundaries that a face names, the outer one first.
fn boundary_list(kind: i64, params: &mut Params<'_>) -> Result<Vec<usize>, ParamError> {
    let mut out = Vec::new();
    match kind {
        144 => {
            params.pointer()?;
            let has_outer = params.integer("whether there is an outer boundary")? != 0;
            let inner = params.count("inner boundaries", 1)?;
            let outer = params.pointer()?;
            if has_outer && outer != 0 {
                out.push(outer);
            }
            for _ in 0..inner {
                out.push(params.pointer()?);
            }
        }
        143 => {
            params.next();
            params.pointer()?;
            for _ in 0..params.count("boundaries", 1)? {
                out.push(params.pointer()?);
            }
        }
        _ => {
            params.pointer()?;
            let loops = params.count("loops", 1)?;
            params.next();
            for _ in 0..loops {
                out.push(params.pointer()?);
            }
        }
    }
    Ok(out)
}

/// One use of an edge in a loop of a B-rep.
struct EdgeUse {
    is_vertex: bool,
    list: usize,
    index: usize,
    parameter: Option<usize>,
    /// Whether the file says that the loop runs against the edge.
    reversed: bool,
}

fn brep_edges(params: &mut Params<'_>) -> Result<Vec<EdgeUse>, ParamError> {
    let mut out = Vec::new();
    for _ in 0..params.count("edges", 5)? {
        let is_vertex = params.integer("the kind of edge")? == 1;
        let list = params.pointer()?;
        let index = params.pointer()?;
        let reversed = params.integer("an orientation")? == 0;
        let count = params.count("parameter curves", 2)?;
        let mut parameter = None;
        for k in 0..count {
            params.next();
            let curve = params.pointer()?;
            parameter = (k == 0 && count == 1).then_some(curve);
        }
        out.push(EdgeUse { is_vertex, list, index, parameter, reversed });
    }
    Ok(out)
}
