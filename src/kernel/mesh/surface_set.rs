//! Several bodies that are projected on together: true closest points and true segment hits (HJR99 3.3).
//!
//! The triangles of a tessellation find candidates, Newton on the real surfaces decides. HJR99 (8)-(9) map a hit
//! on a triangle to (u, v) by barycentric coordinates and take s(u, v), which leaves the segment; the Newton step
//! after it puts the point on both. A foot is global up to the tessellation: every surface point lies within the
//! chord tolerance of its triangles, so that all triangles within the foot's distance plus that tolerance are
//! tried. A segment that passes just beside the triangles at a border is tried on the real surfaces too.
//!
//! Meshes and blocks come as they are: without a parametric description the triangle hit is the condition (HJR99 3.3),
//! so their triangles are both tree and truth, and a point's parameters are the number of its triangle and 0.
//!
//! Of a trimmed face only the trimmed part counts: a segment meets it inside its loops, and a closest point outside of
//! them gives way to the nearest place of the triangles, which is at the border within the chord tolerance.
//!
//! Cost: a few microseconds a query. Cells cut short by the tessellation's cap weaken the guarantee;
//! [`SurfaceSet::capped`] names them.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::body::Body;
use super::face_mesh::tessellate_face;
use super::tessellate::{SurfaceMesh, TessellateOptions, tessellate};
use super::tri_tree::{Hit, Nearest, TriTree};
use crate::kernel::geom::Aabb;
use crate::kernel::geom::closest::{Closed, Foot, closed_directions, closest_from, line_from};
use crate::kernel::geom::trim::Sheet;
use crate::kernel::job::Job;

/// What two hits may be apart and still be one, and what a segment may pass by a border and still hit it, as a
/// fraction of the diagonal.
const SAME: f64 = 1e-9;
/// How far a foot from a guess may be, in chord tolerances, for the search to start from it.
const GOOD: f64 = 4.0;
/// How far outside its loops a face is still hit, as a fraction of its chord tolerance: neighbours leave no slit.
const RIM: f64 = 1e-2;
/// The most candidates of one query that are polished on the real surfaces.
const CANDIDATES: usize = 64;

/// What stands behind some of the triangles.
#[derive(Clone, Debug)]
enum Truth {
    /// A surface, and along which parameters it is closed.
    Surface(Sheet, Closed),
    /// The triangles themselves.
    Triangles,
}

/// Bodies with their triangles.
#[derive(Clone, Debug)]
pub struct SurfaceSet {
    truths: Vec<Truth>,
    numbers: Vec<usize>,
    tree: TriTree,
    /// The triangles at borders, and their numbers in `tree`.
    border: (TriTree, Vec<u32>),
    uv: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    /// The first triangle of every surface.
    first: Vec<u32>,
    chord_tol: f64,
    diagonal: f64,
    capped: Vec<usize>,
}

/// A point on one of the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnSurface {
    /// The number of the surface, as it was given.
    pub surface: usize,
    /// Its parameters there.
    pub uv: DVec2,
    /// The point.
    pub point: DVec3,
    /// Its distance from what was asked for.
    pub distance: f64,
}

/// Where a segment meets one of the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentHit {
    /// The number of the surface, as it was given.
    pub surface: usize,
    /// The parameters there.
    pub uv: DVec2,
    /// The point, on the surface.
    pub point: DVec3,
    /// The place on the segment, 0..=1.
    pub t: f64,
}

/// Reusable space for queries.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    hits: Vec<Hit>,
    near: Vec<Nearest>,
    ids: Vec<u32>,
}

impl SurfaceSet {
    /// Tessellates the bodies (with their numbers) to a chord tolerance. A cancelled job leaves out the rest.
    pub fn new<B: Into<Body>>(bodies: Vec<(usize, B)>, chord_tol: f64, job: &Job) -> Self {
        let bodies: Vec<(usize, Body)> = bodies.into_iter().map(|(n, b)| (n, b.into())).collect();
        let options = TessellateOptions::new(chord_tol);
        let meshes: Vec<_> = bodies
            .par_iter()
            .map(|(_, body)| {
                (!job.is_cancelled()).then(|| match body {
                    Body::Surface(s) => {
                        let sheet = Sheet::Whole(Arc::clone(s));
                        (tessellate(s, &options), Truth::Surface(sheet, closed_directions(s)))
                    }
                    Body::Face(f) => {
                        let mesh = tessellate_face(f, &options, &[Vec::new(), Vec::new()]).mesh;
                        (mesh, Truth::Surface(Sheet::Trimmed(Arc::clone(f)), closed_directions(f.surface())))
                    }
                    Body::Facets(f) => {
                        let (points, triangles) = f.mesh().shared();
                        (SurfaceMesh { points, triangles, ..SurfaceMesh::default() }, Truth::Triangles)
                    }
                })
            })
            .collect();
        let parametric = bodies.iter().any(|(_, body)| !matches!(body, Body::Facets(_)));
        let mut set = Self {
            truths: Vec::new(),
            numbers: Vec::new(),
            tree: TriTree::default(),
            border: (TriTree::default(), Vec::new()),
            uv: Vec::new(),
            triangles: Vec::new(),
            first: Vec::new(),
            chord_tol: if parametric { chord_tol } else { 0.0 },
            diagonal: 0.0,
            capped: Vec::new(),
        };
        let mut points = Vec::new();
        for ((number, _), mesh) in bodies.into_iter().zip(meshes) {
            let Some((mesh, truth)) = mesh.filter(|_| !job.is_cancelled()) else { break };
            let base = points.len() as u32;
            let first = set.triangles.len() as u32;
            if let Truth::Surface(sheet, _) = &truth {
                let is_border = border_vertices(sheet, &mesh);
                let on_border =
                    mesh.triangles.iter().enumerate().filter(|(_, t)| t.iter().any(|&k| is_border[k as usize]));
                set.border.1.extend(on_border.map(|(k, _)| first + k as u32));
            }
            if mesh.capped {
                set.capped.push(number);
            }
            set.first.push(first);
            set.triangles.extend(mesh.triangles.iter().map(|t| t.map(|k| k + base)));
            points.extend(mesh.points.iter());
            set.uv.extend(mesh.uv);
            set.uv.resize(points.len(), DVec2::ZERO);
            set.truths.push(truth);
            set.numbers.push(number);
        }
        set.diagonal = Aabb::of(points.iter().copied()).diagonal();
        let corners: Vec<DVec3> =
            (set.border.1.iter()).flat_map(|&t| set.triangles[t as usize].map(|k| points[k as usize])).collect();
        let own: Vec<[u32; 3]> = (0..set.border.1.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        set.border.0 = TriTree::new(corners, &own);
        set.tree = TriTree::new(points, &set.triangles);
        set
    }

    /// Numbers of surfaces whose tessellation was cut short.
    pub fn capped(&self) -> &[usize] {
        &self.capped
    }

    /// Whether there is nothing to project on.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty()
    }

    /// A box around the triangles.
    pub fn bounds(&self) -> Option<Aabb> {
        self.tree.bounds()
    }

    /// The tree over all triangles, for picking.
    pub fn tree(&self) -> &TriTree {
        &self.tree
    }

    /// The number of the surface of a triangle of [`Self::tree`], and the parameters of a point in it.
    pub fn locate(&self, triangle: u32, barycentric: DVec3) -> (usize, DVec2) {
        let (index, uv) = self.place(triangle, barycentric);
        (self.numbers[index], uv)
    }

    /// HJR99 (9): the index of the surface, and (u, v) by barycentric coordinates.
    fn place(&self, triangle: u32, barycentric: DVec3) -> (usize, DVec2) {
        let index = self.first.partition_point(|&f| f <= triangle) - 1;
        if matches!(self.truths[index], Truth::Triangles) {
            return (index, DVec2::new(f64::from(triangle - self.first[index]), 0.0));
        }
        let [a, b, c] = self.triangles[triangle as usize].map(|k| self.uv[k as usize]);
        (index, a * barycentric.x + b * barycentric.y + c * barycentric.z)
    }

    /// Whether a foot lies in the triangle's cell or one next to it, so that its Newton would find it again.
    fn beside(&self, triangle: u32, uv: DVec2) -> bool {
        let corners = self.triangles[triangle as usize].map(|k| self.uv[k as usize]);
        let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        let reach = high - low;
        (low - reach).cmple(uv).all() && uv.cmple(high + reach).all()
    }

    /// The closest point of all surfaces within `limit` of `p`.
    pub fn closest(&self, p: DVec3, limit: f64, scratch: &mut Scratch) -> Option<OnSurface> {
        let nearest = self.tree.nearest(p, limit + self.chord_tol)?;
        let start = self.foot(p, &nearest);
        let best = self.better(p, start, start.1.distance.min(nearest.distance), scratch);
        (best.distance <= limit).then_some(best)
    }

    /// The closest point of all surfaces, given where about it is: the number of a surface and parameters there. The
    /// answer is the same as without; a good guess saves most of the search.
    pub fn closest_near(&self, p: DVec3, guess: (usize, DVec2), scratch: &mut Scratch) -> Option<OnSurface> {
        let index = self.numbers.iter().position(|&n| n == guess.0);
        if let Some(index) = index
            && let Truth::Surface(sheet, closed) = &self.truths[index]
        {
            let foot = closest_from(sheet.surface(), *closed, p, guess.1);
            if foot.distance <= GOOD * self.chord_tol && sheet.reaches(foot.uv, RIM * self.chord_tol) {
                let start = OnSurface { surface: guess.0, uv: foot.uv, point: foot.point, distance: foot.distance };
                return Some(self.better(p, (index, start), start.distance, scratch));
            }
        }
        self.closest(p, f64::INFINITY, scratch)
    }

    /// The foot that a triangle's nearest point leads to, with the index of its surface.
    fn foot(&self, p: DVec3, n: &Nearest) -> (usize, OnSurface) {
        let (index, uv) = self.place(n.triangle, n.barycentric);
        let surface = self.numbers[index];
        let found = match &self.truths[index] {
            Truth::Surface(sheet, closed) => {
                let mut foot = closest_from(sheet.surface(), *closed, p, uv);
                if !sheet.reaches(foot.uv, RIM * self.chord_tol) {
                    let point = sheet.surface().eval(sheet.surface().clamped(uv));
                    foot = Foot { uv, point, distance: point.distance(p), converged: false };
                }
                OnSurface { surface, uv: foot.uv, point: foot.point, distance: foot.distance }
            }
            Truth::Triangles => OnSurface { surface, uv, point: n.point, distance: n.distance },
        };
        (index, found)
    }

    /// The closest point, given a foot, with its surface's index, and a distance that none nearer to `p` exceeds: a
    /// surface point within it has a triangle within it and the chord tolerance.
    fn better(
        &self,
        p: DVec3,
        (mut at, mut best): (usize, OnSurface),
        within: f64,
        scratch: &mut Scratch,
    ) -> OnSurface {
        self.tree.within(p, within + self.chord_tol, &mut scratch.near);
        let mut tried = 0;
        for candidate in &scratch.near {
            if candidate.distance - self.chord_tol >= best.distance || tried >= CANDIDATES {
                break;
            }
            let (index, _) = self.place(candidate.triangle, candidate.barycentric);
            let known = match self.truths[index] {
                Truth::Surface(..) => index == at && self.beside(candidate.triangle, best.uv),
                Truth::Triangles => candidate.distance >= best.distance,
            };
            if known {
                continue;
            }
            tried += 1;
            let (index, other) = self.foot(p, candidate);
            if other.distance < best.distance {
                (at, best) = (index, other);
            }
        }
        best
    }

    /// All points where the segment from `a` to `b` meets the surfaces, by increasing t. Points that coincide
    /// (along shared edges) are reported once, on the surface of the lowest number. A segment that passes a border
    /// within 1e-9 of the diagonal meets it.
    pub fn segment(&self, a: DVec3, b: DVec3, scratch: &mut Scratch) -> Vec<SegmentHit> {
        let mut out: Vec<(usize, SegmentHit)> = Vec::new();
        self.tree.segment_hits(a, b, &mut scratch.hits);
        for hit in &scratch.hits {
            let (index, uv) = self.place(hit.triangle, hit.barycentric);
            match self.truths[index] {
                Truth::Surface(..) => self.polish(index, uv, a, b, &mut out),
                Truth::Triangles => {
                    let point = a + (b - a) * hit.t;
                    self.keep(index, SegmentHit { surface: self.numbers[index], uv, point, t: hit.t }, &mut out);
                }
            }
        }
        // Where a curved border reaches past its chords, the triangles miss what the surface does not.
        self.border.0.near_segment(a, b, self.chord_tol, &mut scratch.ids);
        let mut tried = 0;
        for &id in &scratch.ids {
            let triangle = self.border.1[id as usize];
            let (index, uv) = self.place(triangle, DVec3::splat(1.0 / 3.0));
            let known = out.iter().any(|(i, h)| *i == index && self.beside(triangle, h.uv));
            if !known && tried < CANDIDATES {
                tried += 1;
                self.polish(index, uv, a, b, &mut out);
            }
        }
        let mut out: Vec<SegmentHit> = out.into_iter().map(|(_, hit)| hit).collect();
        out.sort_by(|x, y| x.t.total_cmp(&y.t).then(x.surface.cmp(&y.surface)));
        out
    }

    /// Moves a candidate onto surface and segment, and keeps it if it reaches both and is new.
    fn polish(&self, index: usize, uv: DVec2, a: DVec3, b: DVec3, out: &mut Vec<(usize, SegmentHit)>) {
        let Truth::Surface(sheet, closed) = &self.truths[index] else { return };
        let same = SAME * self.diagonal;
        let foot = line_from(sheet.surface(), *closed, a, b - a, uv);
        if foot.residual > same || !(-1e-12..=1.0 + 1e-12).contains(&foot.t) {
            return;
        }
        if !sheet.reaches(foot.uv, (RIM * self.chord_tol).max(same)) {
            return;
        }
        self.keep(index, SegmentHit { surface: self.numbers[index], uv: foot.uv, point: foot.point, t: foot.t }, out);
    }

    /// Keeps a hit if it is new; of two in one point that on the body of the lower number.
    fn keep(&self, index: usize, hit: SegmentHit, out: &mut Vec<(usize, SegmentHit)>) {
        let same = SAME * self.diagonal;
        match out.iter_mut().find(|(_, o)| o.point.distance(hit.point) <= same) {
            Some(o) if hit.surface < o.1.surface => *o = (index, hit),
            Some(_) => {}
            None => out.push((index, hit)),
        }
    }
}

/// Which vertices lie at a border: of a face all that belong to an edge of one triangle only, because its loops need not
/// be grid lines.
fn border_vertices(sheet: &Sheet, mesh: &SurfaceMesh) -> Vec<bool> {
    if let Sheet::Whole(surface) = sheet {
        let [u, v] = surface.domain();
        return mesh.uv.iter().map(|uv| u.contains(&uv.x) || v.contains(&uv.y)).collect();
    }
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * mesh.triangles.len());
    for t in mesh.triangles.iter() {
        edges.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]));
    }
    edges.sort_unstable();
    let mut out = vec![false; mesh.points.len()];
    for same in edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
        same[0].iter().for_each(|&k| out[k as usize] = true);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::{Knots, Surface};

    fn graph(f: impl Fn(f64, f64) -> f64, n: usize, low: DVec2, high: DVec2) -> Arc<Surface> {
        let breaks: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        let k = Knots::clamped(3, &breaks, 1).unwrap();
        let g = k.greville();
        let points = g
            .iter()
            .flat_map(|&y| g.iter().map(move |&x| low + (high - low) * DVec2::new(x, y)))
            .map(|p| p.extend(f(p.x, p.y)))
            .collect();
        Arc::new(Surface::new(k.clone(), k, points, None).unwrap())
    }

    fn waves(x: f64, y: f64) -> f64 {
        0.4 * (5.0 * x).sin() * (4.0 * y).cos()
    }

    #[test]
    fn the_closest_point_is_the_global_one_even_between_two_equally_good_triangles() {
        let s = graph(waves, 6, DVec2::ZERO, DVec2::splat(3.0));
        let other = graph(|x, y| 1.0 + 0.1 * x * y, 2, DVec2::ZERO, DVec2::splat(3.0));
        let set = SurfaceSet::new(vec![(4, s.clone()), (9, other.clone())], 0.02, &Job::new());
        let mut scratch = Scratch::default();
        for i in 0..60 {
            let p = DVec3::new(0.05 * f64::from(i), 3.2 - 0.06 * f64::from(i), 0.5 + 0.01 * f64::from(i % 7));
            let found = set.closest(p, f64::INFINITY, &mut scratch).unwrap();
            let mut slow = f64::INFINITY;
            for (_, s) in [(4, &s), (9, &other)] {
                for a in 0..=150 {
                    for b in 0..=150 {
                        let uv = DVec2::new(f64::from(a), f64::from(b)) / 150.0;
                        slow = slow.min(s.eval(uv).distance(p));
                    }
                }
            }
            assert!(found.distance <= slow + 1e-12, "{i}: {} {slow}", found.distance);
            let real = if found.surface == 4 { &s } else { &other };
            assert!(real.eval(found.uv).distance(found.point) < 1e-14);
        }
        assert!(set.closest(DVec3::new(0.0, 0.0, 50.0), 3.0, &mut scratch).is_none());
    }

    #[test]
    fn hits_lie_on_surface_and_segment_and_shared_edges_count_once() {
        let left = graph(waves, 4, DVec2::ZERO, DVec2::new(1.0, 2.0));
        let right = graph(waves, 4, DVec2::new(1.0, 0.0), DVec2::new(2.0, 2.0));
        let roof = graph(|_, _| 2.0, 1, DVec2::ZERO, DVec2::splat(2.0));
        let set = SurfaceSet::new(vec![(0, left), (1, right), (2, roof)], 1e-3, &Job::new());
        let mut scratch = Scratch::default();
        for i in 0..=20 {
            let (x, y) = (1.0, 0.1 * f64::from(i));
            let (a, b) = (DVec3::new(x, y, -1.0), DVec3::new(x, y, 3.0));
            let hits = set.segment(a, b, &mut scratch);
            assert_eq!(hits.len(), 2, "{i}: {hits:?}");
            for h in &hits {
                assert!((a + (b - a) * h.t).distance(h.point) < 1e-12);
            }
            assert_eq!(hits[1].surface, 2);
        }
        assert!(set.segment(DVec3::new(2.1, 1.0, -1.0), DVec3::new(2.1, 1.0, 3.0), &mut scratch).is_empty());
    }

    #[test]
    fn a_mesh_is_its_own_truth_and_goes_together_with_surfaces() {
        use crate::kernel::mesh::facets::Facets;
        use crate::kernel::mesh::tri_mesh::TriMesh;
        let roof = [(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, 2.0, 1.0), (0.0, 2.0, 2.0)].map(DVec3::from);
        let mesh = TriMesh::new(roof.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let floor = graph(|_, _| 0.0, 1, DVec2::ZERO, DVec2::splat(2.0));
        let bodies = vec![(0, Body::from(floor)), (1, Body::from(Arc::new(Facets::of_mesh(mesh))))];
        let set = SurfaceSet::new(bodies, 1e-3, &Job::new());
        let mut scratch = Scratch::default();
        let hits = set.segment(DVec3::new(0.5, 0.5, -1.0), DVec3::new(0.5, 0.5, 3.0), &mut scratch);
        assert_eq!(hits.iter().map(|h| (h.surface, h.point.z)).collect::<Vec<_>>(), [(0, 0.0), (1, 1.0)]);
        let foot = set.closest(DVec3::new(1.5, 0.5, 0.8), 9.0, &mut scratch).unwrap();
        assert_eq!((foot.surface, foot.point, foot.uv), (1, DVec3::new(1.5, 0.5, 1.0), DVec2::ZERO));
        assert_eq!(set.closest(DVec3::new(1.5, 0.5, 0.3), 9.0, &mut scratch).unwrap().surface, 0);
    }

    #[test]
    fn a_curved_border_is_hit_where_its_chords_fall_short() {
        // A disk sector's outer border bulges past the triangles.
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let points = vec![p(0.2, 0.0), p(1.0, 0.0), p(0.2, 0.2), p(1.0, 1.0), p(0.0, 0.2), p(0.0, 1.0)];
        let s = Surface::new(
            Knots::bezier(1, 0.0, 1.0).unwrap(),
            Knots::bezier(2, 0.0, 1.0).unwrap(),
            points,
            Some(vec![1.0, 1.0, w, w, 1.0, 1.0]),
        )
        .unwrap();
        let set = SurfaceSet::new(vec![(0, Arc::new(s))], 0.05, &Job::new());
        for i in 1..40 {
            let angle = f64::from(i) / 40.0 * std::f64::consts::FRAC_PI_2;
            for (r, expected) in [(1.0, 1), (1.0 - 1e-6, 1), (1.0 + 1e-6, 0)] {
                let at = p(r * angle.cos(), r * angle.sin());
                let hits = set.segment(at - DVec3::Z, at + DVec3::Z, &mut Scratch::default());
                assert_eq!(hits.len(), expected, "{r} {i}");
            }
        }
    }
}
