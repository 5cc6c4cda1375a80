//! How two surfaces lie to each other in one place: signed gap, angle, difference of the curvatures, and the tori that
//! osculate them there (thesis 5.3; ALGORITHMS 4, step 2).
//!
//! The gap is (A - B) . n with n the normal of A and B met along n. The relative curvatures are the eigenvalues of the
//! difference of the two second fundamental forms in the tangent plane of A; they decide contact where the surfaces are
//! tangent and are only an indication where they cross at an angle, which is therefore always given with them.

use glam::{DMat2, DVec2, DVec3};

use super::Found;
use crate::kernel::bvh::OsculatingTorus;
use crate::kernel::geom::Curvature;
use crate::kernel::geom::closest::{closed_directions, line_from};
use crate::kernel::ssi::osculating_torus;

/// A torus is drawn over at most this part of the size of the model on each side of the place.
const REACH: f64 = 0.06;
/// And over at most this angle.
const ANGLE: f64 = 0.9;
/// Cells of a drawn torus along each direction.
const CELLS: usize = 12;

/// One surface in the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// The surface's number.
    pub number: usize,
    /// Its parameters.
    pub uv: DVec2,
    /// The point.
    pub p: DVec3,
    /// Normal, principal curvatures and directions.
    pub curvature: Curvature,
    /// The torus that osculates there.
    pub torus: OsculatingTorus,
}

/// Two surfaces in the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The first surface.
    pub a: Local,
    /// The second one.
    pub b: Local,
    /// (A - B) . n.
    pub gap: f64,
    /// The angle between the tangent planes in radians, 0 to a right angle.
    pub angle: f64,
    /// The relative principal curvatures, the larger magnitude first.
    pub relative: [f64; 2],
    /// Their directions, unit vectors in the tangent plane of A.
    pub directions: [DVec3; 2],
}

impl Contact {
    /// What the numbers mean, in words, for gaps judged with `gap_tol`.
    pub fn words(&self, gap_tol: f64) -> &'static str {
        let [k1, k2] = self.relative;
        let touching = self.gap.abs() <= gap_tol;
        let flat = k2.abs() <= 1e-6 * k1.abs().max(f64::MIN_POSITIVE);
        match () {
            () if self.angle > 0.02 => "The surfaces cross here at an angle",
            () if k1 == 0.0 || flat && k1.abs() * self.reach() < 1e-9 => "The surfaces agree to second order here",
            () if flat => "Relative curvature in one direction only: they touch along a curve or nearly so",
            () if k1 * k2 < 0.0 && touching => "Two branches cross here (saddle)",
            () if k1 * k2 < 0.0 => "Two branches pass each other here (saddle with a gap)",
            () if touching => "The surfaces touch in a point here",
            () if k1 * self.gap < 0.0 => "A small closed loop lies around here",
            () => "The surfaces are nearest to each other near here and do not meet",
        }
    }

    fn reach(&self) -> f64 {
        self.a.torus.half[0]
    }
}

impl Local {
    fn new(found: &Found, number: usize, uv: DVec2) -> Option<Self> {
        let surface = found.surface(number)?;
        let jet = surface.jet(surface.clamped(uv), 2);
        let curvature = Curvature::of(&jet)?;
        let size = REACH * surface.bounds().diagonal();
        let mut torus = osculating_torus(surface, surface.clamped(uv))?;
        // It osculates in one point; the patch that is drawn is as large as looks well.
        torus.half = torus.k.map(|k| size.min(2.0 * (0.5 * ANGLE).tan() / k.abs().max(f64::MIN_POSITIVE)));
        Some(Self { number, uv, p: jet.p(), curvature, torus })
    }

    /// The used patch of the torus as a grid of points and its triangles.
    pub fn patch(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: usize| 2.0 * i as f64 / CELLS as f64 - 1.0;
        let half = DVec2::from(self.torus.half);
        let grid = (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| DVec2::new(at(i), at(j))));
        let points = grid.map(|st| self.torus.eval(st * half)).collect();
        let row = CELLS as u32 + 1;
        let cells = (0..CELLS as u32).flat_map(|j| (0..CELLS as u32).map(move |i| j * row + i));
        (points, cells.flat_map(|a| [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]).collect())
    }

    /// Major and minor radius of the torus, `None` where it is flat in one direction.
    pub fn radii(&self) -> Option<[f64; 2]> {
        self.torus.radii().map(|t| [t.major, t.minor])
    }
}

/// The place of surface `a` at `uv`, with surface `b` met along the normal from near `st`. An error says why there is
/// nothing to compare.
pub fn contact(found: &Found, a: usize, uv: DVec2, b: usize, st: DVec2) -> Result<Contact, &'static str> {
    let gone = "a surface is gone";
    let is_mesh = |n: usize| found.subjects.get(n).is_some_and(|s| s.surface().is_none());
    if is_mesh(a) || is_mesh(b) {
        return Err("one of them is a mesh: it has no curvature to compare");
    }
    let local = Local::new(found, a, uv).ok_or("the first surface has no normal here")?;
    let other = found.surface(b).ok_or(gone)?;
    let n = local.curvature.normal;
    let foot = line_from(other, closed_directions(other), local.p, n, st);
    if foot.residual > 1e-9 * found.size() {
        return Err("the normal of the first surface does not meet the second one here");
    }
    let second = Local::new(found, b, foot.uv).ok_or("the second surface has no normal here")?;
    // Both forms bend towards the normal of A.
    let turn = if second.curvature.normal.dot(n) < 0.0 { -1.0 } else { 1.0 };
    let cos = (second.curvature.normal.dot(n) * turn).clamp(0.0, 1.0);
    // Near 1 the cosine has no digits left.
    let sin = second.curvature.normal.cross(n).length();
    let angle = sin.atan2(cos);
    let [x, y] = local.curvature.e;
    let form = |c: &Curvature, sign: f64| -> [f64; 3] {
        let on = |v: DVec3, w: DVec3| -> f64 { (0..2).map(|k| sign * c.k[k] * c.e[k].dot(v) * c.e[k].dot(w)).sum() };
        [on(x, x), on(x, y), on(y, y)]
    };
    let (fa, fb) = (form(&local.curvature, 1.0), form(&second.curvature, turn));
    let [xx, xy, yy] = [fa[0] - fb[0], fa[1] - fb[1], fa[2] - fb[2]];
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let e = DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
    let in_space = DMat2::from_cols(e, e.perp());
    let vector = |d: DVec2| x * d.x + y * d.y;
    let (mut relative, mut directions) =
        ([mean + radius, mean - radius], [vector(in_space.x_axis), vector(in_space.y_axis)]);
    if relative[1].abs() > relative[0].abs() {
        relative.swap(0, 1);
        directions.swap(0, 1);
    }
    Ok(Contact { a: local, b: second, gap: -foot.t, angle, relative, directions })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::intersection::testing::{document, graph, met, square};

    fn at(f: impl Fn(f64, f64) -> f64, z: f64) -> Contact {
        let floor = square(DVec3::Z * z, DVec3::X * 1.5, DVec3::Y * 1.5);
        let found = met(&document([graph(f), floor]));
        // The floor's own parameters run from 0 to 1.
        contact(&found, 0, DVec2::ZERO, 1, DVec2::splat(0.5)).unwrap()
    }

    #[test]
    fn a_saddle_over_its_tangent_plane_has_its_own_curvatures() {
        let c = at(|x, y| x * x - 2.0 * y * y, 0.0);
        assert!(c.gap.abs() < 1e-15 && c.angle < 1e-15);
        assert!((c.relative[0] + 4.0).abs() < 1e-12 && (c.relative[1] - 2.0).abs() < 1e-12, "{:?}", c.relative);
        assert!(c.directions[0].dot(DVec3::Y).abs() > 1.0 - 1e-12);
        assert!(c.words(1e-11).contains("cross"));
        assert!(at(|x, y| x * x - 2.0 * y * y, -1e-3).words(1e-11).contains("pass each other"));
    }

    #[test]
    fn the_gap_is_positive_above_and_a_bowl_below_the_plane_has_a_loop() {
        let c = at(|x, y| x * x + y * y, 0.01);
        assert!((c.gap + 0.01).abs() < 1e-12, "{}", c.gap);
        assert!(c.words(1e-11).contains("loop"));
        let above = at(|x, y| x * x + y * y, -0.01);
        assert!((above.gap - 0.01).abs() < 1e-12 && above.words(1e-11).contains("do not meet"));
        assert!(at(|x, y| x * x + y * y, 0.0).words(1e-11).contains("touch in a point"));
        assert!(at(|x, _| x * x, 0.0).words(1e-11).contains("one direction"));
    }

    #[test]
    fn the_torus_has_the_radii_of_the_curvatures_and_touches() {
        let c = at(|x, y| 0.5 * x * x + 0.25 * y * y, 0.0);
        let mut radii = c.a.radii().unwrap();
        radii.sort_by(f64::total_cmp);
        // Curvatures 1 and 1/2: radii 1 and 2, so tube and spine are 1 and 1, or 2 and 1.
        assert!((radii[0] - 1.0).abs() < 1e-9, "{radii:?}");
        assert!(c.b.radii().is_none(), "a plane has no finite torus");
        let (points, triangles) = c.a.patch();
        assert!(triangles.iter().flatten().all(|&k| (k as usize) < points.len()));
        for p in points.iter().filter(|p| p.truncate().length() < 0.05) {
            let z = 0.5 * p.x * p.x + 0.25 * p.y * p.y;
            assert!((p.z - z).abs() < 1e-5, "{p}");
        }
    }

    #[test]
    fn where_the_normal_misses_the_other_surface_that_is_said() {
        let far = square(DVec3::new(9.0, 0.0, 0.1), DVec3::X, DVec3::Y);
        let found = met(&document([graph(|_, _| 0.0), far]));
        assert!(contact(&found, 0, DVec2::ZERO, 1, DVec2::splat(0.5)).unwrap_err().contains("does not meet"));
        assert!(contact(&found, 7, DVec2::ZERO, 1, DVec2::ZERO).is_err());
    }
}
