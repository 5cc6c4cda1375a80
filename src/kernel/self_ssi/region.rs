//! Coincident regions: areas over which the surface lies on itself, from the pairs of cells that coincide.
//!
//! Pairs that touch in both domains make one region, whichever of the two sides each names first; folds beside them
//! belong to it. Its outline comes from [`super::outline`] and must agree with the area of the cells; otherwise it is that
//! of the union of the cells on the first side, every corner matched with its closest point on the second, known to within
//! one cell, which the result says.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use super::coincidence::{Coincidence, foot};
use super::cusp::CuspEdge;
use super::hull::Rect;
use super::outline;
use super::sheet::Sheet;

/// One region.
#[derive(Clone, Debug, Default)]
pub(crate) struct Area {
    /// Closed loops of matched parameter points, interior on the left, so that outer loops run counter-clockwise.
    pub loops: Vec<Vec<[DVec2; 2]>>,
    /// The largest distance that was measured between matched points.
    pub distance: f64,
    /// Boxes around the two sides.
    pub boxes: Option<[Rect; 2]>,
    /// Whether the loops are the cells' outline only.
    pub rough: bool,
}

/// Collects coincident pairs and folds into regions. A fold without pairs beside it is an area without loops.
pub(crate) fn regions(sheet: &Sheet, pairs: &[Coincidence], folds: &[(usize, Rect)], edges: &[CuspEdge]) -> Vec<Area> {
    let touch = |a: &Rect, b: &Rect| {
        let slack = DVec2::splat(1e-12);
        (a.low - slack).cmple(b.high).all() && (b.low - slack).cmple(a.high).all()
    };
    let mut waiting: Vec<Coincidence> = pairs.to_vec();
    let mut left: Vec<(usize, Rect)> = folds.to_vec();
    let mut out = Vec::new();
    while let Some(first) = waiting.pop() {
        let mut group = vec![first];
        let mut own: Vec<(usize, Rect)> = Vec::new();
        let mut at = 0;
        while at < group.len() {
            let here = group[at];
            at += 1;
            waiting.retain(|other| {
                if touch(&here.a, &other.a) && touch(&here.b, &other.b) {
                    group.push(*other);
                    false
                } else if touch(&here.a, &other.b) && touch(&here.b, &other.a) {
                    group.push(other.swapped());
                    false
                } else {
                    true
                }
            });
            if at < group.len() {
                continue;
            }
            // All windows of a fold beside the group belong to it, and with them the pairs beside these.
            let beside = |rect: &Rect| group.iter().any(|c| touch(&c.a, rect) || touch(&c.b, rect));
            let Some(number) = left.iter().find(|f| beside(&f.1)).map(|f| f.0) else { continue };
            let (windows, others): (Vec<_>, Vec<_>) = left.into_iter().partition(|f| f.0 == number);
            left = others;
            let side = |c: &Coincidence| edges.get(number).is_some_and(|e| e.side_of(c.a.center()) > 0.0);
            let first = side(&group[0]);
            waiting.retain(|other| {
                let joins = windows.iter().any(|(_, rect)| touch(&other.a, rect) || touch(&other.b, rect));
                if joins {
                    group.push(if side(other) == first { *other } else { other.swapped() });
                }
                !joins
            });
            own.extend(windows);
        }
        out.push(area(sheet, &group, &own, edges));
    }
    for (_, rect) in left {
        out.push(Area { boxes: Some([rect; 2]), rough: true, ..Area::default() });
    }
    // Where two sides meet (a fold), cells close to the fold can be named either way: the order must not depend on it.
    out.sort_by(|x, y| {
        let low = |a: &Area| a.boxes.map_or(DVec2::ZERO, |b| b[0].low);
        (low(x).y, low(x).x).partial_cmp(&(low(y).y, low(y).x)).unwrap_or(std::cmp::Ordering::Equal)
    });
    out
}

fn area(sheet: &Sheet, group: &[Coincidence], folds: &[(usize, Rect)], edges: &[CuspEdge]) -> Area {
    let mut result = Area::default();
    for c in group {
        let [a, b] = result.boxes.unwrap_or([c.a, c.b]);
        result.boxes = Some([a.union(&c.a), b.union(&c.b)]);
    }
    let rough = outlines(&group.iter().map(|c| c.a).collect::<Vec<_>>());
    let exact = outline::loops(sheet, group, folds, edges);
    if agrees(&exact, &rough, group, folds) {
        let apart = |&[p, q]: &[DVec2; 2]| sheet.point(p).distance(sheet.point(q));
        result.distance = exact.iter().flatten().map(apart).fold(0.0, f64::max);
        result.loops = exact;
        return result;
    }
    result.rough = true;
    for outline in rough {
        let mut matched = Vec::with_capacity(outline.len());
        for p in outline {
            // On a fold, where the two sides meet, a point is its own partner.
            if group.iter().any(|c| c.a.grown(1e-9).contains(p) && c.b.grown(1e-9).contains(p)) {
                matched.push([p, p]);
                continue;
            }
            // Otherwise the partner is on the cell that this corner belongs to.
            let s = sheet.point(p);
            let partner = group
                .iter()
                .filter(|c| c.a.grown(1e-9).contains(p))
                .filter_map(|c| foot(sheet, sheet.piece_at(c.b.center()), c.b.center(), s))
                .min_by(|x, y| x.1.total_cmp(&y.1));
            if let Some((q, distance)) = partner.filter(|found| found.1 <= 1e-9) {
                result.distance = result.distance.max(distance);
                matched.push([p, q]);
            }
        }
        if matched.len() >= 4 {
            result.loops.push(matched);
        }
    }
    result
}

/// Whether exact loops enclose about what the cells cover: within two cells along the outline, and the folds.
fn agrees(exact: &[Vec<[DVec2; 2]>], rough: &[Vec<DVec2>], group: &[Coincidence], folds: &[(usize, Rect)]) -> bool {
    if exact.is_empty() {
        return false;
    }
    let enclosed: f64 = exact.iter().map(|l| outline::area(l)).sum();
    let covered: f64 = rough.iter().flat_map(|l| l.windows(2)).map(|s| 0.5 * s[0].perp_dot(s[1])).sum();
    let around: f64 = rough.iter().flat_map(|l| l.windows(2)).map(|s| s[0].distance(s[1])).sum();
    let cell = group.iter().map(|c| c.a.size().max_element()).fold(0.0, f64::max);
    let strip: f64 = folds.iter().map(|f| f.1.size().element_product()).sum();
    (enclosed - covered).abs() <= 2.0 * cell * around + strip
}

/// The outlines of a union of rectangles: closed loops, the first point repeated, interior on the left.
fn outlines(rects: &[Rect]) -> Vec<Vec<DVec2>> {
    let bits = |x: f64| x.to_bits() as i64 ^ (((x.to_bits() as i64) >> 63) as u64 >> 1) as i64;
    let line = |values: Vec<f64>| -> Vec<f64> {
        let sorted: BTreeMap<i64, f64> = values.into_iter().map(|x| (bits(x), x)).collect();
        sorted.into_values().collect()
    };
    let xs = line(rects.iter().flat_map(|r| [r.low.x, r.high.x]).collect());
    let ys = line(rects.iter().flat_map(|r| [r.low.y, r.high.y]).collect());
    let at = |list: &[f64], x: f64| list.partition_point(|&y| y < x);
    let mut filled = BTreeSet::new();
    for r in rects {
        for i in at(&xs, r.low.x)..at(&xs, r.high.x) {
            for j in at(&ys, r.low.y)..at(&ys, r.high.y) {
                filled.insert((i as i64, j as i64));
            }
        }
    }
    // Directed edges between grid points with the inside on the left.
    let mut edges: BTreeMap<(i64, i64), Vec<(i64, i64)>> = BTreeMap::new();
    for &(i, j) in &filled {
        let sides = [
            ((i, j - 1), (i, j), (i + 1, j)),
            ((i + 1, j), (i + 1, j), (i + 1, j + 1)),
            ((i, j + 1), (i + 1, j + 1), (i, j + 1)),
            ((i - 1, j), (i, j + 1), (i, j)),
        ];
        for (neighbour, from, to) in sides {
            if !filled.contains(&neighbour) {
                edges.entry(from).or_default().push(to);
            }
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = edges.iter().find(|(_, to)| !to.is_empty()) {
        let mut nodes = vec![start];
        let mut here = start;
        while let Some(next) = edges.get_mut(&here).and_then(Vec::pop) {
            nodes.push(next);
            here = next;
            if here == start {
                break;
            }
        }
        loops.push(nodes.into_iter().map(|(i, j)| DVec2::new(xs[i as usize], ys[j as usize])).collect());
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_a_frame_is_two_loops() {
        let r = |a: f64, b: f64, c: f64, d: f64| Rect::new(DVec2::new(a, b), DVec2::new(c, d));
        let loops =
            outlines(&[r(0.0, 0.0, 3.0, 1.0), r(0.0, 2.0, 3.0, 3.0), r(0.0, 1.0, 1.0, 2.0), r(2.0, 1.0, 3.0, 2.0)]);
        let area = |l: &Vec<DVec2>| 0.5 * l.windows(2).map(|s| s[0].perp_dot(s[1])).sum::<f64>();
        let mut areas: Vec<f64> = loops.iter().map(area).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas, [-1.0, 9.0]);
        assert!(loops.iter().all(|l| l.first() == l.last()));
    }
}
