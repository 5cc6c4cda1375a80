//! The intersection tools without a window: what goes in, what came out, and what is shown of it.
//!
//! [`Picks`] says which surfaces go in, [`compute`] runs the kernel on a worker, [`Found`] binds the result to the
//! entities of the document. From it come the drawing ([`marks`]), the list ([`list`]), the certificate in words
//! ([`certificate`]), the cursor that runs along a curve in space and in both domains ([`cursor`]), the gap between
//! two surfaces as a field ([`gap`]), what two surfaces do to second order in one point ([`contact`]), and free curves
//! of the document ([`keep`]). The results of the two engines are laid over one another by [`compare`].

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::intersect::Engine;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::result::{CurvePoint, Intersection};
use crate::model::document::{Document, Entity, EntityId, Shape};

pub mod biarcs;
pub mod certificate;
pub mod compare;
pub mod compute;
pub mod contact;
pub mod cursor;
pub mod domains;
pub mod gap;
pub mod hatch;
pub mod keep;
pub mod list;
pub mod marks;
pub mod picks;
pub mod place;
pub mod plane;
pub mod style;

pub use compare::Comparison;
pub use compute::{Request, compute};
pub use cursor::OnCurve;
pub use hatch::Hatch;
pub use marks::Drawing;
pub use picks::{Picks, Task};
pub use style::Class;

/// A surface that takes part.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The entity.
    pub id: EntityId,
    /// Its name.
    pub name: String,
    /// What of it counts: all of a surface or patch, the inside of a face, the triangles of a mesh or block.
    pub body: Body,
}

impl Subject {
    /// Its surface, of a face the whole surface under it; a mesh has none.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        self.body.surface()
    }
}

/// What of an entity can be intersected.
pub fn body_of(entity: &Entity) -> Option<Body> {
    match &entity.shape {
        Shape::Face(face) => Some(Body::Face(Arc::clone(face))),
        Shape::Mesh(facets) | Shape::Block(facets) => Some(Body::Facets(Arc::clone(facets))),
        _ => entity.surface().map(|surface| Body::Surface(Arc::clone(surface))),
    }
}

/// Everything of a document that can be intersected: surfaces, faces and patches in its order, then meshes and blocks.
pub fn subjects(document: &Document) -> Vec<Subject> {
    let subject = |e: &Entity| Some(Subject { id: e.id, name: e.name.clone(), body: body_of(e)? });
    let mut all: Vec<Subject> = document.entities().iter().filter_map(|e| subject(e)).collect();
    all.sort_by_key(|s| s.surface().is_none());
    all
}

/// One thing in a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Item {
    /// A curve.
    Curve(usize),
    /// A point of contact.
    Junction(usize),
    /// A miter point.
    Miter(usize),
    /// A coincident region.
    Region(usize),
    /// What could not be decided.
    Unresolved(usize),
}

/// A result, bound to the surfaces it is about.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The surfaces; `a` and `b` of the result are places in this list.
    pub subjects: Vec<Subject>,
    /// What the kernel found.
    pub result: Intersection,
    /// Whether surfaces were intersected with themselves.
    pub with_itself: bool,
    /// The engine that found it.
    pub engine: Engine,
    /// The hatching of regions that run over several patches, one list for each region.
    pub hatches: Vec<Vec<Hatch>>,
    /// Whether it was stopped before it was done; then this is what was ready.
    pub cancelled: bool,
    /// What the kernel warned of.
    pub warnings: Vec<String>,
}

impl Found {
    /// A surface by its number in the result; a mesh has none.
    pub fn surface(&self, number: usize) -> Option<&Arc<Surface>> {
        self.subjects.get(number).and_then(Subject::surface)
    }

    /// The surfaces with their numbers in the result.
    pub fn surfaces(&self) -> Vec<(usize, &Surface)> {
        let all = self.subjects.iter().enumerate();
        all.filter_map(|(n, s)| Some((n, s.surface()?.as_ref()))).collect()
    }

    /// The entity of a number in the result.
    pub fn id(&self, number: usize) -> Option<EntityId> {
        self.subjects.get(number).map(|s| s.id)
    }

    /// The name of a surface by its number in the result.
    pub fn name(&self, number: usize) -> &str {
        self.subjects.get(number).map_or("a deleted surface", |s| &s.name)
    }

    /// The number of an entity in the result.
    pub fn number(&self, id: EntityId) -> Option<usize> {
        self.subjects.iter().position(|s| s.id == id)
    }

    /// Whether nothing at all was found, not even something unresolved.
    pub fn is_empty(&self) -> bool {
        let r = &self.result;
        r.curves.is_empty()
            && r.junctions.is_empty()
            && r.miters.is_empty()
            && r.regions.is_empty()
            && r.unresolved.is_empty()
    }

    /// Distances up to this are none but for rounding.
    pub fn rounding(&self) -> f64 {
        let far = self.subjects.iter().map(|s| s.body.bounds().max_abs()).filter(|m| m.is_finite()).fold(0.0, f64::max);
        64.0 * f64::EPSILON * far
    }

    /// The diagonal of a box around what takes part.
    pub fn size(&self) -> f64 {
        let numbers = self.numbers();
        let taking_part = numbers.iter().filter_map(|&n| self.subjects.get(n));
        let bounds = taking_part.fold(Aabb::EMPTY, |b, s| b.union(&s.body.bounds()));
        if bounds.is_empty() { 1.0 } else { bounds.diagonal().max(f64::MIN_POSITIVE) }
    }

    /// The numbers of the surfaces that occur in the result, in increasing order.
    pub fn numbers(&self) -> Vec<usize> {
        let r = &self.result;
        let ends = r.curves.iter().flat_map(|c| &c.points).flat_map(|p| [p.a, p.b]);
        let junctions = r.junctions.iter().flat_map(|j| [j.a, j.b]);
        let rest = r.miters.iter().map(|m| m.a).chain(r.unresolved.iter().flat_map(|u| [u.a, u.b]));
        let mut numbers: Vec<usize> = ends.chain(junctions).chain(rest).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    /// The points that show where an item is.
    pub fn points(&self, item: Item) -> Vec<DVec3> {
        let r = &self.result;
        let of = |points: &[CurvePoint]| -> Vec<DVec3> { points.iter().map(|p| p.xyz).collect() };
        let points = match item {
            Item::Curve(k) => r.curves.get(k).map(|c| of(&c.points)),
            Item::Junction(k) => r.junctions.get(k).map(|j| vec![j.xyz]),
            Item::Miter(k) => r.miters.get(k).map(|m| vec![m.xyz]),
            Item::Region(k) => r.regions.get(k).map(|g| g.boundary.iter().flat_map(|l| of(l)).collect()),
            Item::Unresolved(k) => r.unresolved.get(k).map(|u| {
                let boxes = [(u.a, u.uv_box), (u.b, u.st_box)];
                boxes.iter().flat_map(|(n, b)| self.box_outline(*n, *b)).collect()
            }),
        };
        points.unwrap_or_default()
    }

    /// Whether two successive points of a curve are joined by a straight step in the parameters of a side (0: first, 1:
    /// second): they are on the same surface and the step does not jump across a seam.
    pub fn joined(&self, p: &CurvePoint, q: &CurvePoint, side: usize) -> bool {
        let of = |p: &CurvePoint| if side == 0 { (p.a, p.uv) } else { (p.b, p.st) };
        let ((n, from), (m, to)) = (of(p), of(q));
        // On a mesh parameters mean nothing: there is no seam to jump across.
        let Some(surface) = self.surface(n) else { return n == m };
        if n != m {
            return false;
        }
        let [u, v] = surface.domain();
        let step = (to - from).abs() / DVec2::new(u[1] - u[0], v[1] - v[0]);
        if !(step.max_element() > 0.4) {
            return true;
        }
        // A long step may be a straight line on a flat patch: then its middle is where it should be.
        let middle = surface.eval(from.lerp(to, 0.5));
        let chord = p.xyz.distance(q.xyz);
        chord > 0.0 && middle.distance(p.xyz.lerp(q.xyz, 0.5)) < 0.25 * chord
    }

    /// The image of the border of a parameter box on a surface, as a closed polyline.
    pub fn box_outline(&self, number: usize, [u, v]: [[f64; 2]; 2]) -> Vec<DVec3> {
        /// Parts of each side.
        const PARTS: usize = 12;
        let Some(surface) = self.surface(number) else { return Vec::new() };
        let corners = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1]), (u[0], v[0])];
        let at = |k: usize| DVec2::new(corners[k].0, corners[k].1);
        let sides = (0..4).flat_map(|k| (0..PARTS).map(move |i| (k, i as f64 / PARTS as f64)));
        let inside = sides.map(|(k, f)| at(k).lerp(at(k + 1), f)).chain([at(4)]);
        inside.map(|uv| surface.eval(surface.clamped(uv))).filter(|p| p.is_finite()).collect()
    }

    /// A box around an item, never smaller than `least` across.
    pub fn bounds(&self, item: Item, least: f64) -> Option<Aabb> {
        let bounds = Aabb::of(self.points(item));
        if bounds.is_empty() {
            return None;
        }
        let grow = (0.5 * (least - bounds.diagonal())).max(0.0);
        Some(bounds.grown(grow))
    }
}

#[cfg(test)]
pub(crate) mod testing;
