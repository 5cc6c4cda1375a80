//! Places where two sheets of the surface touch without crossing: in a point, or along a curve.
//!
//! There the pair test has no parameter along which solutions are unique, however small the boxes. The two places, boxes
//! apart in the domain, are two surfaces that touch: the intersector of two surfaces decides them, with its proof (thesis
//! 5, [`crate::kernel::ssi`]). Where that is complete every pair of boxes inside is settled. Settled places that hang
//! together count as one, with the box around them; at the end that is intersected as a whole, so that a curve of contact
//! is one curve and the whole place is proved. Where the sheets are tangent and cross as well, the branches in the place must
//! be known to the search, which has followed them through it; they are cut where they cross.
//!
//! Cost: about 5 us for a pair of boxes that is looked at, some milliseconds for a place where sheets do touch. How it
//! fails: a contact of higher order than the second, or one whose branches the search lost, is listed as unresolved,
//! once, with the reason.

use glam::DVec2;

use super::hull::Rect;
use super::sheet::Sheet;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::ssi::binormal::{Binormal, polish};
use crate::kernel::ssi::result::{CurveEnd, CurveKind, Intersection, IntersectionCurve, Junction, JunctionKind};
use crate::kernel::ssi::{Jet1, Jet2, Patch, PointPair, SsiOptions, intersect};

/// Contact is looked for between boxes of these sizes.
const LARGEST: f64 = 1.0 / 24.0;
const FINEST: f64 = 1.0 / 2048.0;
/// The least difference of curvatures that counts, for a surface of size 1.
const LEAST_BEND: f64 = 1e-3;
/// How sharp the parameters of points of contact are, of [0, 1].
const SHARP: f64 = 1e-9;
/// The most places that are handed to the intersector.
const MOST: usize = 512;
/// Why a place with crossing tangent sheets is open.
const CROSSING: &str = "two sheets are tangent here and cross along a curve that could not be followed further";
/// Why a place is open that the intersector did not settle.
const UNSETTLED: &str = "two sheets touch here in a way that could not be decided";

/// What became of a pair of boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Touch {
    /// Nothing touches here, as far as could be seen.
    No,
    /// Everything inside is known.
    Settled,
    /// The place is listed as unresolved, once for all boxes in it.
    Open,
}

/// The places where sheets touch.
pub(crate) struct Touches<'a> {
    surface: &'a Surface,
    sheet: &'a Sheet,
    number: usize,
    options: SsiOptions,
    gap: f64,
    /// Settled places, those that hang together as one where its two boxes stay apart.
    settled: Vec<[Rect; 2]>,
    /// What is open, with the reason.
    pub open: Vec<([Rect; 2], &'static str)>,
    tried: usize,
}

/// What touches.
#[derive(Debug, Default)]
pub(crate) struct Contacts {
    pub points: Vec<Junction>,
    /// Points of contact through which branches of the search pass.
    pub crossings: Vec<Junction>,
    pub curves: Vec<IntersectionCurve>,
    /// Places whose curves could not be made one.
    pub open: Vec<([Rect; 2], &'static str)>,
}

impl<'a> Touches<'a> {
    /// `tol` and `gap` are in model units.
    pub fn new(surface: &'a Surface, sheet: &'a Sheet, number: usize, tol: f64, gap: f64) -> Self {
        let options = SsiOptions { tol: Some(tol), gap_tol: Some(gap), ..SsiOptions::default() };
        Self { surface, sheet, number, options, gap, settled: Vec::new(), open: Vec::new(), tried: 0 }
    }

    /// Whether a pair of boxes lies in a place that was looked at.
    pub fn known(&self, a: &Rect, b: &Rect) -> Touch {
        let inside = |[x, y]: &[Rect; 2]| holds(x, a) && holds(y, b) || holds(x, b) && holds(y, a);
        match () {
            () if self.settled.iter().any(inside) => Touch::Settled,
            () if self.open.iter().any(|(pair, _)| inside(pair)) => Touch::Open,
            () => Touch::No,
        }
    }

    /// Looks for contact in and around a pair of boxes, each in [0, 1]^2 on one piece, which the pair test left open.
    pub fn look(&mut self, [(a, pa), (b, pb)]: [(&Rect, usize); 2], job: &Job) -> Touch {
        let size = a.size().max_element().max(b.size().max_element());
        if !(FINEST..LARGEST).contains(&size) || self.tried >= MOST || !self.nearly_touch(a, b) {
            return Touch::No;
        }
        let place = [a, b].map(|r| {
            let r = r.grown(1.0);
            Rect::new(r.low.max(DVec2::ZERO), r.high.min(DVec2::ONE))
        });
        if overlap(&place[0], &place[1]) {
            return Touch::No;
        }
        if !self.touch_near([(a, pa), (b, pb)]) {
            return Touch::No;
        }
        let Some(parts) = self.parts(&place) else { return Touch::No };
        self.tried += 1;
        let Some(found) = self.met(&parts, job) else { return Touch::No };
        if !found.regions.is_empty() || job.is_cancelled() {
            // A coincident region has its own test.
            return Touch::No;
        }
        if found.complete {
            self.settle(place);
            return Touch::Settled;
        }
        self.open.push((place, UNSETTLED));
        Touch::Open
    }

    /// A cheap look at the middles: near each other for their size, with nearly parallel tangent planes.
    fn nearly_touch(&self, a: &Rect, b: &Rect) -> bool {
        let (ja, jb) = (self.sheet.jet(a.center(), 1), self.sheet.jet(b.center(), 1));
        let normal = |d: [glam::DVec3; 2]| d[0].cross(d[1]).normalize_or_zero();
        let reach = |d: [glam::DVec3; 2], r: &Rect| d[0].length() * r.size().x + d[1].length() * r.size().y;
        normal(ja.d).cross(normal(jb.d)).length() < 0.5 && ja.s.distance(jb.s) <= reach(ja.d, a) + reach(jb.d, b)
    }

    /// Whether the common normal to which the middles lead is one of sheets that touch in or beside the boxes.
    fn touch_near(&self, boxes: [(&Rect, usize); 2]) -> bool {
        let [a, b] = boxes.map(|(rect, piece)| OnBox { sheet: self.sheet, piece, rect: *rect });
        let middles = PointPair { uv: DVec2::splat(0.5), st: DVec2::splat(0.5) };
        let near = |x: DVec2| (x - 0.5).abs().max_element() <= 1.0;
        // Where the sheets agree to second order they may coincide, which has its own test.
        let touches = |c: &Binormal| c.gap.abs() * self.sheet.scale <= self.gap && c.principal().0.abs() > LEAST_BEND;
        // A point of contact, or the floor of a valley that is one along a curve.
        [false, true].into_iter().any(|ridge| {
            let found = polish(&a, &b, middles, 0.1, ridge);
            found.is_some_and(|c| touches(&c) && near(c.at.uv) && near(c.at.st))
        })
    }

    fn parts(&self, place: &[Rect; 2]) -> Option<[Surface; 2]> {
        let part = |r: &Rect| {
            let [u, v] = self.sheet.in_surface(r);
            self.surface.restricted(u, v).ok()
        };
        Some([part(&place[0])?, part(&place[1])?])
    }

    fn met(&self, parts: &[Surface; 2], job: &Job) -> Option<Intersection> {
        let [a, b] = parts;
        intersect(&[(self.number, a)], &[(self.number, b)], &self.options, &job.part(0.0, 0.0)).ok()
    }

    /// Adds a settled place; places that it hangs together with become one, unless its boxes would overlap.
    fn settle(&mut self, place: [Rect; 2]) {
        let mut all = place;
        let mut rest = self.settled.clone();
        // A box that grows may reach others.
        while let Some(at) = rest.iter().position(|o| joined(o, &all).is_some()) {
            let Some(one) = joined(&rest.swap_remove(at), &all) else { break };
            all = one;
        }
        if overlap(&all[0], &all[1]) {
            self.settled.push(place);
        } else {
            rest.push(all);
            self.settled = rest;
        }
    }

    /// The contacts of all settled places. `known` says whether a pair of points of [0, 1]^2 lies on a curve of the search.
    pub fn contacts(&self, known: impl Fn([DVec2; 2]) -> bool, job: &Job) -> Contacts {
        let mut out = Contacts::default();
        for &place in &self.settled {
            let found = self.parts(&place).and_then(|parts| self.met(&parts, job));
            let Some(found) = found.filter(|f| f.complete && f.regions.is_empty()) else {
                out.open.push((place, "two sheets touch along a curve that could not be followed as one"));
                continue;
            };
            let new = |c: &IntersectionCurve| {
                let middle = c.points.get(c.points.len() / 2);
                middle.is_some_and(|p| !known([p.uv, p.st].map(|uv| self.sheet.in_unit(uv))))
            };
            if found.curves.iter().any(|c| c.kind != CurveKind::Tangential && new(c)) {
                out.open.push((place, CROSSING));
                continue;
            }
            let (alone, crossed) = found.junctions.into_iter().partition(|j| j.kind == JunctionKind::Isolated);
            out.points.extend::<Vec<Junction>>(alone);
            out.crossings.extend::<Vec<Junction>>(crossed);
            for mut curve in found.curves.into_iter().filter(|c| c.kind == CurveKind::Tangential) {
                self.mark_ends(&mut curve, place, &mut out);
                out.curves.push(curve);
            }
        }
        out
    }
}

/// A piece of the sheet in the parameters of a box, which is [0, 1]^2.
struct OnBox<'a> {
    sheet: &'a Sheet,
    piece: usize,
    rect: Rect,
}

impl OnBox<'_> {
    fn jet(&self, uv: DVec2, order: usize) -> Jet2 {
        let size = self.rect.size();
        let jet = self.sheet.jet_on(self.piece, self.rect.low + size * uv, order);
        let [uu, uv, vv] = jet.dd;
        let second = [uu * (size.x * size.x), uv * (size.x * size.y), vv * (size.y * size.y)];
        Jet2 { p: jet.s, u: jet.d[0] * size.x, v: jet.d[1] * size.y, second }
    }
}

impl Patch for OnBox<'_> {
    fn jet1(&self, uv: DVec2) -> Jet1 {
        let Jet2 { p, u, v, .. } = self.jet(uv, 1);
        Jet1 { p, u, v }
    }

    fn jet2(&self, uv: DVec2) -> Jet2 {
        self.jet(uv, 2)
    }
}

impl Touches<'_> {
    /// Whether a point lies on a border that is no seam, as far as points of contact are sharp.
    fn at_open_border(&self, p: DVec2) -> bool {
        let near = |x: f64| {
            if x < SHARP {
                0.0
            } else if x > 1.0 - SHARP {
                1.0
            } else {
                x
            }
        };
        self.sheet.on_open_border(DVec2::new(near(p.x), near(p.y)))
    }

    /// The border of a place is no border of the surface: a curve of contact that ends there goes on unseen.
    fn mark_ends(&self, curve: &mut IntersectionCurve, place: [Rect; 2], out: &mut Contacts) {
        let ends = [curve.points.first(), curve.points.last()];
        for (end, p) in curve.ends.iter_mut().zip(ends) {
            let on_border =
                p.is_some_and(|p| [p.uv, p.st].into_iter().any(|uv| self.at_open_border(self.sheet.in_unit(uv))));
            if *end == CurveEnd::Boundary && !on_border {
                *end = CurveEnd::Unresolved;
                out.open.push((place, "a curve along which two sheets touch could not be followed further"));
            }
        }
    }
}

fn holds(outer: &Rect, inner: &Rect) -> bool {
    outer.contains(inner.low) && outer.contains(inner.high)
}

fn overlap(a: &Rect, b: &Rect) -> bool {
    a.low.cmplt(b.high).all() && b.low.cmplt(a.high).all()
}

/// Two places that overlap in both boxes as one.
fn joined(a: &[Rect; 2], b: &[Rect; 2]) -> Option<[Rect; 2]> {
    let with = |[x, y]: [Rect; 2]| (overlap(&x, &b[0]) && overlap(&y, &b[1])).then(|| [x.union(&b[0]), y.union(&b[1])]);
    with(*a).or_else(|| with([a[1], a[0]]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_overlap_in_both_boxes_are_one_whichever_comes_first() {
        let rect = |x: f64| Rect::new(DVec2::new(x, 0.0), DVec2::new(x + 0.3, 0.1));
        let far = |x: f64| rect(x).shifted(DVec2::new(0.0, 0.5));
        let one = joined(&[rect(0.0), far(0.0)], &[far(0.2), rect(0.2)]).unwrap();
        assert!(one.iter().all(|r| (r.size().x - 0.5).abs() < 1e-12), "{one:?}");
        assert!(one[0].low.y == 0.5 && one[1].low.y == 0.0, "in the order of the second");
        assert!(joined(&[rect(0.0), far(0.0)], &[rect(0.2), far(0.5)]).is_none());
    }
}
