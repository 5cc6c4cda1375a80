//! The surfaces, trimmed faces and patches of a document as shells: faces that share their edges and vertices, as STEP files
//! and meshers want them.
//!
//! Trimmed faces share the edges that they share in the document. Borders of whole surfaces and patches within the joining tolerance of each other are one edge ([`EdgeNet`]), whose curve is that of the first of
//! them; their ends are one vertex. Patches of one heal have such borders bit for bit; what others are apart is
//! measured in [`Seams`], together with the angle between the normals on both sides. A border without length (a pole) is
//! no edge; its ends are one vertex. Faces that hang together by edges are one shell, turned so that their normals
//! agree; where that is impossible (a Moebius strip), or where more than two faces share an edge, the result says so.
//!
//! Cost: that of the edge net, and [`SAMPLES`] evaluations on both sides of a seam.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::document::{Document, EntityId};
use crate::kernel::geom::trim::{EdgeRole, Face};
use crate::kernel::geom::{Curve, Side, Surface};
use crate::kernel::mesh::edge_net::{Along, EdgeNet};

/// Places along a seam at which its two sides are compared.
pub const SAMPLES: usize = 33;

/// An edge.
#[derive(Clone, Debug)]
pub struct ShellEdge {
    /// Its curve.
    pub curve: Arc<Curve>,
    /// The vertices at the start and end of the curve.
    pub ends: [usize; 2],
}

/// One use of an edge by a face.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeUse {
    /// Which edge.
    pub edge: usize,
    /// Whether the loop runs against the curve.
    pub reversed: bool,
    /// The curve in the parameters of the surface (z = 0), with the parameter of the edge's curve; of trimmed faces.
    pub pcurve: Option<Curve>,
}

/// A face: a surface and the loops on it.
#[derive(Clone, Debug)]
pub struct ShellFace {
    /// The surface, face or patch of the document.
    pub entity: EntityId,
    /// Its surface.
    pub surface: Arc<Surface>,
    /// Its loops, the outer one first and counter-clockwise in the parameters of the surface, holes clockwise. None for a
    /// surface all of whose borders are poles.
    pub rings: Vec<Vec<EdgeUse>>,
    /// Whether the face looks against the normal of its surface, so that it agrees with its neighbours.
    pub turned: bool,
}

/// How well neighbours fit.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Seams {
    /// Pairs of borders that are one edge.
    pub count: usize,
    /// The largest distance of two such borders.
    pub largest_gap: f64,
    /// Between which two it is, by name.
    pub gap_between: Option<[String; 2]>,
    /// The largest angle between the normals on both sides, in degrees.
    pub largest_angle_deg: f64,
    /// Between which two it is, by name.
    pub angle_between: Option<[String; 2]>,
    /// Edges that more than two borders share.
    pub non_manifold: usize,
    /// Shells whose faces cannot all be turned the same way.
    pub one_sided: usize,
}

/// The faces of a document and how they hang together.
#[derive(Clone, Debug, Default)]
pub struct Shells {
    /// Where the vertices are.
    pub vertices: Vec<DVec3>,
    /// The edges.
    pub edges: Vec<ShellEdge>,
    /// The faces, in the order of the document.
    pub faces: Vec<ShellFace>,
    /// The faces of each shell.
    pub shells: Vec<Vec<usize>>,
    /// How well neighbours fit.
    pub seams: Seams,
}

impl Shells {
    /// Finds the shells of a document; borders of whole surfaces and patches may be `joining` apart and still be one edge.
    pub fn of(document: &Document, joining: f64) -> Self {
        let (mut names, mut surfaces) = (Vec::new(), Vec::new());
        for entity in document.entities().iter().filter(|e| e.face().is_none()) {
            if let Some(surface) = entity.surface() {
                names.push(entity.name.as_str());
                surfaces.push(Arc::clone(surface));
            }
        }
        let net = EdgeNet::new(&surfaces, joining);
        if net.borders.len() != 4 * surfaces.len() {
            return Self::default();
        }
        let mut builder = Builder::new(&net, document.tolerances().follow * 1e-3);
        let mut whole = 0;
        for entity in document.entities() {
            if let Some(face) = entity.face() {
                builder.trimmed(entity.id, face);
            } else if let Some(surface) = entity.surface() {
                builder.whole(entity.id, surface, whole);
                whole += 1;
            }
        }
        let mut out = Self { seams: seams(&net, &surfaces, &names), ..builder.finish() };
        out.gather();
        out
    }

    /// Gathers the faces that hang together and turns them the same way.
    fn gather(&mut self) {
        let mut uses: Vec<Vec<(usize, bool)>> = vec![Vec::new(); self.edges.len()];
        for (face, f) in self.faces.iter().enumerate() {
            f.rings.iter().flatten().for_each(|u| uses[u.edge].push((face, u.reversed)));
        }
        self.seams.non_manifold = uses.iter().filter(|u| u.len() > 2).count();
        let mut turned: Vec<Option<bool>> = vec![None; self.faces.len()];
        for first in 0..self.faces.len() {
            if turned[first].is_some() {
                continue;
            }
            turned[first] = Some(false);
            let (mut shell, mut next, mut one_sided) = (vec![first], 0, false);
            while next < shell.len() {
                let face = shell[next];
                let own = turned[face] == Some(true);
                next += 1;
                for used in self.faces[face].rings.iter().flatten() {
                    let around = &uses[used.edge];
                    // Three faces at an edge have no common side.
                    let pair = around.len() == 2;
                    for &(other, reversed) in around.iter().filter(|(other, _)| *other != face) {
                        // Neighbours agree where their loops run through the edge in opposite directions.
                        let wanted = own ^ (reversed == used.reversed);
                        match turned[other] {
                            Some(is) => one_sided |= pair && is != wanted,
                            None => {
                                turned[other] = Some(wanted && pair);
                                shell.push(other);
                            }
                        }
                    }
                }
            }
            self.seams.one_sided += usize::from(one_sided);
            shell.sort_unstable();
            self.shells.push(shell);
        }
        for (face, turned) in self.faces.iter_mut().zip(turned) {
            face.turned = turned == Some(true);
        }
    }
}

/// Whether a counter-clockwise loop runs against the border in this place of [`Side::ALL`].
fn backwards(slot: usize) -> bool {
    slot >= 2
}

/// What names an edge while shells are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum EdgeKey {
    /// The first of the borders that are one edge.
    Border(usize),
    /// An edge that trimmed faces share.
    Face(u64),
}

/// Gathers faces and edges; vertices are places of edge ends until all that are the same have been united.
struct Builder<'n> {
    net: &'n EdgeNet,
    /// A border shorter than this is a point.
    shortest: f64,
    edges: Vec<ShellEdge>,
    known: HashMap<EdgeKey, usize>,
    faces: Vec<ShellFace>,
    /// Where each end is, and the end that it is united with.
    places: Vec<DVec3>,
    parent: Vec<usize>,
    /// The ends that stand for the vertices of the edge net.
    of_net: HashMap<usize, usize>,
}

impl<'n> Builder<'n> {
    fn new(net: &'n EdgeNet, shortest: f64) -> Self {
        Self {
            net,
            shortest,
            edges: Vec::new(),
            known: HashMap::new(),
            faces: Vec::new(),
            places: Vec::new(),
            parent: Vec::new(),
            of_net: HashMap::new(),
        }
    }

    fn end(&mut self, at: DVec3) -> usize {
        self.places.push(at);
        self.parent.push(self.parent.len());
        self.parent.len() - 1
    }

    /// The end that stands for a vertex of the net; it is where it was met first.
    fn end_of(&mut self, vertex: usize, at: DVec3) -> usize {
        if let Some(&end) = self.of_net.get(&vertex) {
            return end;
        }
        let end = self.end(at);
        self.of_net.insert(vertex, end);
        end
    }

    fn find(&self, mut end: usize) -> usize {
        while self.parent[end] != end {
            end = self.parent[end];
        }
        end
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b);
    }

    /// A whole surface, the `k`-th of the net.
    fn whole(&mut self, entity: EntityId, surface: &Arc<Surface>, k: usize) {
        let net = self.net;
        let mut ring = Vec::new();
        for slot in 0..4 {
            let Along { of, reversed } = net.edge[4 * k + slot];
            let border = &net.borders[of];
            let points = border.curve.ends();
            let ends = [0, 1].map(|end| self.end_of(net.vertices[of][end], points[end]));
            if border.arc.length() <= self.shortest {
                self.unite(ends[0], ends[1]);
                continue;
            }
            let edge = self.edge(EdgeKey::Border(of), || (Arc::new(border.curve.clone()), ends));
            ring.push(EdgeUse { edge, reversed: reversed ^ backwards(slot), pcurve: None });
        }
        let rings = if ring.is_empty() { Vec::new() } else { vec![ring] };
        self.faces.push(ShellFace { entity, surface: Arc::clone(surface), rings, turned: false });
    }

    fn edge(&mut self, key: EdgeKey, make: impl FnOnce() -> (Arc<Curve>, [usize; 2])) -> usize {
        if let Some(&edge) = self.known.get(&key) {
            return edge;
        }
        let (curve, ends) = make();
        self.edges.push(ShellEdge { curve, ends });
        self.known.insert(key, self.edges.len() - 1);
        self.edges.len() - 1
    }

    /// A trimmed face.
    fn trimmed(&mut self, entity: EntityId, face: &Face) {
        let mut rings = Vec::new();
        for ring in face.rings() {
            let mut uses: Vec<EdgeUse> = Vec::new();
            for part in ring.edges.iter().filter(|e| e.role != EdgeRole::Pole) {
                let key = EdgeKey::Face(part.id);
                let edge = match self.known.get(&key) {
                    Some(&edge) => edge,
                    None => {
                        let ends = part.curve.ends().map(|p| self.end(p));
                        self.edge(key, || (Arc::clone(&part.curve), ends))
                    }
                };
                uses.push(EdgeUse { edge, reversed: part.reversed, pcurve: Some(part.pcurve.clone()) });
            }
            // Each begins where the one before ends; poles between them are points.
            for k in 0..uses.len() {
                let (before, after) = (&uses[(k + uses.len() - 1) % uses.len()], &uses[k]);
                let leaves = self.edges[before.edge].ends[usize::from(!before.reversed)];
                let enters = self.edges[after.edge].ends[usize::from(after.reversed)];
                self.unite(leaves, enters);
            }
            if !uses.is_empty() {
                rings.push(uses);
            }
        }
        self.faces.push(ShellFace { entity, surface: Arc::clone(face.surface()), rings, turned: false });
    }

    /// Numbers the vertices.
    fn finish(mut self) -> Shells {
        let (mut vertices, mut numbers) = (Vec::new(), HashMap::new());
        for at in 0..self.edges.len() {
            let ends = self.edges[at].ends.map(|end| {
                let found = self.find(end);
                *numbers.entry(found).or_insert_with(|| {
                    vertices.push(self.places[found]);
                    vertices.len() - 1
                })
            });
            self.edges[at].ends = ends;
        }
        Shells { vertices, edges: self.edges, faces: self.faces, ..Shells::default() }
    }
}

/// The surface parameters at a parameter of a border.
fn uv_on(surface: &Surface, slot: usize, t: f64) -> DVec2 {
    let [u, v] = surface.domain();
    match Side::ALL[slot] {
        Side::VMin => DVec2::new(t, v[0]),
        Side::UMax => DVec2::new(u[1], t),
        Side::VMax => DVec2::new(t, v[1]),
        Side::UMin => DVec2::new(u[0], t),
    }
}

/// Compares both sides of every seam, at equal fractions of the arc length.
fn seams(net: &EdgeNet, surfaces: &[Arc<Surface>], names: &[&str]) -> Seams {
    let mut out = Seams { count: net.seams.len(), ..Seams::default() };
    for seam in &net.seams {
        let [a, b] = seam.borders;
        let against = net.edge[a].reversed ^ net.edge[b].reversed;
        let both = || Some([a, b].map(|border| names[border / 4].to_owned()));
        // Loops that run through the edge in the same direction belong to faces that look to opposite sides.
        let sign = if backwards(a % 4) == (backwards(b % 4) ^ against) { -1.0 } else { 1.0 };
        for k in 0..SAMPLES {
            let f = k as f64 / (SAMPLES - 1) as f64;
            let side = |border: usize, f: f64| {
                let (surface, own) = (&surfaces[border / 4], &net.borders[border]);
                let uv = uv_on(surface, border % 4, own.arc.parameter_at(&own.curve, f * own.arc.length()));
                let jet = surface.jet(surface.clamped(uv), 1);
                (jet.p(), jet.normal())
            };
            let ((p, m), (q, n)) = (side(a, f), side(b, if against { 1.0 - f } else { f }));
            if p.distance(q) > out.largest_gap {
                (out.largest_gap, out.gap_between) = (p.distance(q), both());
            }
            if let (Some(m), Some(n)) = (m, n) {
                let angle = m.cross(n).length().atan2(sign * m.dot(n)).to_degrees();
                if angle > out.largest_angle_deg {
                    (out.largest_angle_deg, out.angle_between) = (angle, both());
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::sweep;
    use crate::model::document::{Shape, Unit};

    fn document(surfaces: Vec<Surface>) -> Document {
        let mut out = Document::new(Unit::Millimetre);
        for (k, surface) in surfaces.into_iter().enumerate() {
            out.add(format!("s{k}"), Shape::Surface(Arc::new(surface)), None);
        }
        out
    }

    fn quad(corners: [[f64; 3]; 4]) -> Surface {
        Surface::bilinear(corners.map(DVec3::from_array)).unwrap()
    }

    #[test]
    fn a_box_of_six_squares_is_one_closed_shell_with_right_angles() {
        // Each face is given with its own orientation.
        let c =
            |bits: usize| [f64::from(bits as u8 & 1), f64::from(bits as u8 >> 1 & 1), f64::from(bits as u8 >> 2 & 1)];
        let faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 4, 1, 5], [2, 3, 6, 7], [0, 2, 4, 6], [5, 1, 7, 3]];
        let shells = Shells::of(&document(faces.map(|f| quad(f.map(c))).to_vec()), 1e-6);
        assert_eq!((shells.shells.len(), shells.edges.len(), shells.vertices.len()), (1, 12, 8), "V - E + F = 2");
        assert_eq!((shells.seams.count, shells.seams.non_manifold, shells.seams.one_sided), (12, 0, 0));
        assert!(shells.seams.largest_gap < 1e-15);
        assert!((shells.seams.largest_angle_deg - 90.0).abs() < 1e-9);
        // Turned the same way, all normals look out or all look in.
        let center = DVec3::splat(0.5);
        let out: Vec<bool> = shells
            .faces
            .iter()
            .map(|f| {
                let jet = f.surface.jet(DVec2::splat(0.5), 1);
                (jet.normal().unwrap().dot(jet.p() - center) > 0.0) ^ f.turned
            })
            .collect();
        assert!(out.iter().all(|&o| o == out[0]), "{out:?}");
    }

    #[test]
    fn normals_of_neighbours_make_the_dihedral_angle_whatever_their_orientation() {
        let flat = quad([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        let (s, c) = 30_f64.to_radians().sin_cos();
        let tilted = [[1.0, 0.0, 0.0], [1.0 + c, 0.0, s], [1.0, 1.0, 0.0], [1.0 + c, 1.0, s]];
        for other in [quad(tilted), quad(tilted).swapped()] {
            let shells = Shells::of(&document(vec![flat.clone(), other]), 1e-6);
            assert!((shells.seams.largest_angle_deg - 30.0).abs() < 1e-9, "{:?}", shells.seams);
            assert_eq!(shells.seams.angle_between, Some(["s0".to_owned(), "s1".to_owned()]));
            let loops = |k: usize| -> Vec<(usize, bool)> {
                let face = &shells.faces[k];
                face.rings[0].iter().map(|u| (u.edge, u.reversed ^ face.turned)).collect()
            };
            let shared: Vec<_> = loops(0).into_iter().filter(|a| loops(1).iter().any(|b| b.0 == a.0)).collect();
            assert_eq!(shared.len(), 1);
            assert!(loops(1).contains(&(shared[0].0, !shared[0].1)), "the edge is run through both ways");
        }
    }

    #[test]
    fn gaps_are_measured_and_too_large_ones_are_no_edges() {
        let tile = |x: f64, z: f64| quad([[x, 0.0, z], [x + 1.0, 0.0, z], [x, 1.0, z], [x + 1.0, 1.0, z]]);
        let near = Shells::of(&document(vec![tile(0.0, 0.0), tile(1.0, 1e-4)]), 1e-3);
        assert!((near.seams.largest_gap - 1e-4).abs() < 1e-15);
        assert_eq!((near.shells.len(), near.edges.len(), near.vertices.len()), (1, 7, 6));
        let far = Shells::of(&document(vec![tile(0.0, 0.0), tile(1.0, 1e-2)]), 1e-3);
        assert_eq!((far.shells.len(), far.edges.len(), far.seams.count), (2, 8, 0));
    }

    #[test]
    fn a_ball_has_one_seam_and_its_poles_are_vertices() {
        let half = sweep::arc(DVec3::ZERO, DVec3::Z, DVec3::X, 0.0, std::f64::consts::PI).unwrap();
        let ball = sweep::revolved(&half, DVec3::ZERO, DVec3::Z, 0.0, std::f64::consts::TAU).unwrap();
        let shells = Shells::of(&document(vec![ball]), 1e-6);
        assert_eq!((shells.edges.len(), shells.vertices.len(), shells.faces[0].rings[0].len()), (1, 2, 2));
        let ring = &shells.faces[0].rings[0];
        assert_ne!(ring[0].reversed, ring[1].reversed, "the seam is run through both ways");
        assert!(shells.seams.largest_angle_deg < 1e-6);
    }
}
