//! How two surfaces lie to each other near a pair of points: osculating tori, their binormals, and the exact
//! collinear-normal point that they lead to, with its signed gap and relative second fundamental form.
//!
//! Thesis 5.3: the binormals of the tori approximate those of the surfaces; the sign of the distance along them says
//! which kind of (almost) tangential intersection there is. The exact point is found from the tori's by Newton's method
//! ([`super::binormal::polish`]), so that the tori only have to lead to the right one. Cost: about 20 us.

use glam::{DVec2, DVec3};

use super::binormal::{Binormal, polish};
use super::correct::PointPair;
use super::piece::{Patch, Piece};
use super::side::{Frame, Side, closest_from};
use super::torus_binormal::{CommonNormal, CommonNormals, Spine, common_normals};
use crate::kernel::bvh::OsculatingTorus;
use crate::kernel::geom::{Curvature, Surface};

/// What the tangency of two surfaces at a pair of points is.
#[derive(Clone, Debug)]
pub struct Tangency {
    /// The osculating tori at the two points, in model units; bounds of their fit are not computed.
    pub tori: [OsculatingTorus; 2],
    /// Their binormals, nearest first; none where they form a family.
    pub binormals: Vec<CommonNormal>,
    /// Whether the binormals form a family.
    pub family: bool,
    /// The exact collinear-normal point that they lead to.
    pub point: Option<TangencyPoint>,
}

/// A line that is normal to both surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangencyPoint {
    /// Its parameters on the first surface.
    pub uv: DVec2,
    /// Its parameters on the second surface.
    pub st: DVec2,
    /// The point midway between the surfaces.
    pub xyz: DVec3,
    /// The unit normal of the first surface.
    pub normal: DVec3,
    /// The signed distance (A - B) . normal.
    pub gap: f64,
    /// The eigenvalues of the difference of the second fundamental forms, the larger in magnitude first.
    pub curvatures: [f64; 2],
    /// The unit direction in space that belongs to the first.
    pub direction: DVec3,
}

/// The torus that osculates a surface at a point: the larger curvature is that of the tube.
pub fn osculating_torus(surface: &Surface, uv: DVec2) -> Option<OsculatingTorus> {
    let curvature = Curvature::of(&surface.jet(uv, 2))?;
    let point = surface.eval(uv);
    Some(torus_of(point, curvature.normal, curvature.k, curvature.e))
}

fn torus_of(point: DVec3, normal: DVec3, k: [f64; 2], e: [DVec3; 2]) -> OsculatingTorus {
    let first = usize::from(k[1].abs() > k[0].abs());
    let e0 = e[first];
    OsculatingTorus {
        point,
        e: [e0, normal.cross(e0)],
        normal,
        k: [k[first], k[1 - first]],
        half: [0.0; 2],
        corners: [DVec2::ZERO; 4],
        deviation: 0.0,
        normal_sin: f64::INFINITY,
    }
}

/// The osculating torus of a piece, by the eigenvectors of its second form as a graph over the tangent plane.
fn torus_on(piece: &Piece, at: DVec2) -> Option<OsculatingTorus> {
    let jet = piece.jet2(at);
    let normal = jet.u.cross(jet.v).try_normalize()?;
    let x = jet.u.try_normalize()?;
    let y = normal.cross(x);
    let det = jet.u.dot(x) * jet.v.dot(y);
    if !(det.abs() > 1e-14) {
        return None;
    }
    // Columns of the inverse of [u v] in the basis x, y (u has no y part).
    let (ux, vx, vy) = (jet.u.dot(x), jet.v.dot(x), jet.v.dot(y));
    let inverse = [DVec2::new(1.0 / ux, 0.0), DVec2::new(-vx / (ux * vy), 1.0 / vy)];
    let [l, m, n] = jet.second.map(|d| d.dot(normal));
    let form = |p: DVec2, q: DVec2| l * p.x * q.x + m * (p.x * q.y + p.y * q.x) + n * p.y * q.y;
    let (xx, xy, yy) = (form(inverse[0], inverse[0]), form(inverse[0], inverse[1]), form(inverse[1], inverse[1]));
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let e = DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
    let space = |d: DVec2| x * d.x + y * d.y;
    Some(torus_of(jet.p, normal, [mean + radius, mean - radius], [space(e), space(e.perp())]))
}

/// The exact binormal to which the tori at two points of two pieces lead: the one nearest to those points.
pub(super) fn from_tori(a: &Piece, b: &Piece, at: PointPair) -> Option<Binormal> {
    let tori = [torus_on(a, at.uv)?, torus_on(b, at.st)?];
    let near = 0.5 * (tori[0].point + tori[1].point);
    let (list, _) = sorted(&tori, near);
    list.iter().find_map(|line| polish(a, b, start_on([a, b], at, line, near), 0.1, false))
}

/// The binormals of two tori in the order of their distance to a point, and whether they form a family.
fn sorted(tori: &[OsculatingTorus; 2], near: DVec3) -> (Vec<CommonNormal>, bool) {
    let size = tori[0].point.distance(tori[1].point).max(near.length()).max(1e-3);
    match common_normals(&Spine::of(&tori[0], size), &Spine::of(&tori[1], size)) {
        CommonNormals::Continuum => (Vec::new(), true),
        CommonNormals::Isolated(mut list) => {
            let away = |c: &CommonNormal| (near - c.on[0]).cross(c.direction).length();
            list.sort_by(|x, y| away(x).total_cmp(&away(y)));
            (list, false)
        }
    }
}

/// Parameters near those of `at` where a line meets both pieces.
fn start_on(pieces: [&Piece; 2], at: PointPair, line: &CommonNormal, near: DVec3) -> PointPair {
    let foot = line.on[0] + line.direction * (near - line.on[0]).dot(line.direction);
    let place = |piece: &Piece, start: DVec2| closest_from(piece, foot, start).0;
    PointPair { uv: place(pieces[0], at.uv), st: place(pieces[1], at.st) }
}

/// Looks at two surfaces at a pair of parameter points that are near each other in space. `None` where a surface is
/// degenerate.
pub fn tangency(a: &Surface, b: &Surface, uv: DVec2, st: DVec2) -> Option<Tangency> {
    let tori = [osculating_torus(a, uv)?, osculating_torus(b, st)?];
    let near = 0.5 * (tori[0].point + tori[1].point);
    let (binormals, family) = sorted(&tori, near);
    // The exact point in the frame of the intersector, on the pieces under the given parameters.
    let bounds = a.bounds().union(&b.bounds());
    let frame = Frame::of(&bounds);
    let sides = [Side::new(&[(0, a)], &frame), Side::new(&[(0, b)], &frame)];
    let place = |side: usize, at: DVec2| {
        let away = |p: &Piece| (p.low - at).max(at - p.high).max_element();
        let piece = sides[side].pieces.iter().min_by(|x, y| away(x).total_cmp(&away(y)))?;
        Some((piece, (at - piece.low) / (piece.high - piece.low)))
    };
    let ((pa, uv), (pb, st)) = (place(0, uv)?, place(1, st)?);
    let at = PointPair { uv, st };
    let found = from_tori(pa, pb, at).or_else(|| polish(pa, pb, at, 0.1, false));
    let inside = |x: DVec2| x.min_element() > -1e-9 && x.max_element() < 1.0 + 1e-9;
    let point = found.filter(|b| inside(b.at.uv) && inside(b.at.st)).map(|b| {
        let (k1, e, k2) = b.principal();
        TangencyPoint {
            uv: pa.to_surface(b.at.uv),
            st: pb.to_surface(b.at.st),
            xyz: frame.to_model(b.p),
            normal: b.n,
            gap: b.gap / frame.scale,
            curvatures: [k1 * frame.scale, k2 * frame.scale],
            direction: b.in_space(e),
        }
    });
    Some(Tangency { tori, binormals, family, point })
}
