//! Where the triangulations of two surfaces cannot be trusted: places at which the surfaces are near and their normals
//! agree.
//!
//! HJR99 section 4: critical points, "where the normals of both intersecting surfaces are exactly or nearly collinear",
//! are where the intersection of triangulations "may not accurately reflect the intersection of the underlying
//! surfaces". Every closed curve that is too small for the triangles encloses such a point (Sederberg et al.), and
//! every junction is one, so away from such places the topology of the triangles is that of the surfaces. The places are
//! rectangles of one surface, which the hybrid engine then intersects on its own (see [`super::places`]).

use glam::{DVec2, DVec3};

use super::sheet::Sheet;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;

/// How often the triangles of a pair are quartered to see whether their normals really agree.
const QUARTERED: usize = 3;

/// The room around a triangle that belongs to its place, as a part of its extent: not a whole one, so that the border of a
/// place does not run along grid lines.
const ROOM: f64 = 0.73;
/// From this part of the first surface on the places are no longer told apart.
const MOST: f64 = 0.5;

/// A triangle of a surface with what the surface has at its corners.
#[derive(Clone, Copy)]
struct Cell {
    uv: [DVec2; 3],
    points: [DVec3; 3],
    normals: [DVec3; 3],
}

impl Cell {
    fn new(surface: &Surface, uv: [DVec2; 3]) -> Self {
        let jets = uv.map(|uv| surface.jet(uv, 1));
        let normals = jets.each_ref().map(|j| j.normal().unwrap_or(DVec3::ZERO));
        Self { uv, points: jets.each_ref().map(|j| j.p()), normals }
    }

    /// The normal of the triangle and the angle up to which the surface's normal differs from it: twice that at the
    /// corners, to be on the safe side. Where there is none, every normal is allowed.
    fn cone(&self) -> (DVec3, f64) {
        let [a, b, c] = self.points;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == DVec3::ZERO || self.normals.contains(&DVec3::ZERO) {
            return (DVec3::ZERO, std::f64::consts::PI);
        }
        let angle = |n: DVec3| n.dot(normal).abs().min(1.0).acos();
        (normal, 2.0 * self.normals.map(angle).into_iter().fold(0.0, f64::max))
    }

    fn quarters(&self, surface: &Surface) -> [Self; 4] {
        let [a, b, c] = self.uv;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|uv| Self::new(surface, uv))
    }
}

/// Whether two triangles are within `margin` of one another, as far as boxes and planes tell, with normals that may agree.
fn agree(a: &Cell, b: &Cell, margin: f64) -> bool {
    let extent = |c: &Cell| {
        let [p, q, r] = c.points;
        (p.min(q).min(r), p.max(q).max(r))
    };
    let ((low, high), (other_low, other_high)) = (extent(a), extent(b));
    if (low - margin).cmpgt(other_high).any() || (other_low - margin).cmpgt(high).any() {
        return false;
    }
    let ((na, wa), (nb, wb)) = (a.cone(), b.cone());
    let beside = |normal: DVec3, plane: &Cell, other: &Cell| {
        let heights = other.points.map(|p| normal.dot(p - plane.points[0]));
        heights.iter().all(|h| *h > margin) || heights.iter().all(|h| *h < -margin)
    };
    na.dot(nb).abs().min(1.0).acos() <= wa + wb && !beside(na, a, b) && !beside(nb, b, a)
}

fn search(surfaces: [&Surface; 2], a: &Cell, b: &Cell, margin: f64, left: usize) -> bool {
    if !agree(a, b, margin) {
        return false;
    }
    if left == 0 {
        return true;
    }
    let (parts, others) = (a.quarters(surfaces[0]), b.quarters(surfaces[1]));
    parts.iter().any(|p| others.iter().any(|q| search(surfaces, p, q, margin, left - 1)))
}

/// A rectangle of the first surface's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its lower corner.
    pub low: DVec2,
    /// Its upper corner.
    pub high: DVec2,
}

impl Place {
    fn overlaps(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// Whether it holds these parameters.
    pub fn contains(&self, uv: DVec2) -> bool {
        self.low.cmple(uv).all() && uv.cmple(self.high).all()
    }
}

/// The places at which two surfaces are within `margin` of one another with normals that agree, as far as the triangles
/// quartered [`QUARTERED`] times tell: disjoint rectangles of the first surface, each with room around its triangles.
/// `None` where they are most of that surface, so that nothing is won by telling them apart.
pub fn near_places(a: &Sheet, b: &Sheet, margin: f64, job: &Job) -> Option<Vec<Place>> {
    let (Some(sa), Some(sb)) = (a.surface(), b.surface()) else { return Some(Vec::new()) };
    let mut pairs = a.tree().pairs_within(b.tree(), margin, job);
    pairs.sort_unstable();
    let domain = sa.domain();
    let [low, high] = [0, 1].map(|k| DVec2::new(domain[0][k], domain[1][k]));
    let mut places: Vec<Place> = Vec::new();
    for same in pairs.chunk_by(|p, q| p[0] == q[0]) {
        let ta = same[0][0];
        let corners = a.corner_uv(ta);
        let p = Cell::new(sa, corners);
        let held = |place: &Place| corners.iter().all(|&uv| place.contains(uv));
        let agrees = |tb: u32| search([sa, sb], &p, &Cell::new(sb, b.corner_uv(tb)), margin, QUARTERED);
        if places.iter().any(held) || !same.iter().any(|pair| agrees(pair[1])) {
            continue;
        }
        let [from, to] = [corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2])];
        let room = ROOM * (to - from);
        let mut place = Place { low: from - room, high: to + room };
        // No slivers along the border.
        for k in 0..2 {
            if place.low[k] < low[k] + room[k] {
                place.low[k] = low[k];
            }
            if place.high[k] > high[k] - room[k] {
                place.high[k] = high[k];
            }
        }
        while let Some(other) = places.iter().position(|other| other.overlaps(&place)) {
            let other = places.swap_remove(other);
            place = Place { low: place.low.min(other.low), high: place.high.max(other.high) };
        }
        places.push(place);
        let area: f64 = places.iter().map(|p| (p.high - p.low).element_product()).sum();
        if area > MOST * (high - low).element_product() {
            return None;
        }
    }
    places.sort_by(|p, q| p.low.x.total_cmp(&q.low.x).then(p.low.y.total_cmp(&q.low.y)));
    Some(places)
}
