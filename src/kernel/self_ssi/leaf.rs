//! The leaf conversion of thesis 4.2.2 and Fig. 4.8: a cell with a miter quadrangle becomes an inner node.
//!
//! The cell is split in three by the vertical slab around the quadrangle Q, its middle child in three by the horizontal slab;
//! the middle leaf R is the smallest rectangle around Q. Where S(R) fits into the ball of Q, R replaces it; otherwise R holds Q and
//! four triangles, one for each edge of Q. A Q that overlaps several cells belongs to the one with the largest overlap,
//! which is expanded to contain it. Here the proof of the neighbourhood is the cross-cap test of the windows, which holds in
//! Q as well; the conversion describes the tree for whoever bounds the neighbourhood by the ball.

use glam::DVec2;

use super::hull::Rect;
use super::sheet::Sheet;

/// A converted leaf, in the surface's parameters. Boxes are `[[u0, u1], [v0, v1]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvertedLeaf {
    /// The index of the miter point in the result.
    pub miter: usize,
    /// The cell, expanded where the quadrangle reaches out of it.
    pub cell: [[f64; 2]; 2],
    /// Whether the cell was expanded at its neighbours' cost.
    pub expanded: bool,
    /// The three children: left, the vertical slab, right. Empty ones have no width.
    pub slabs: [[[f64; 2]; 2]; 3],
    /// The three children of the vertical slab: below, R, above.
    pub middle: [[[f64; 2]; 2]; 3],
    /// Whether the image of R fits into the ball, so that R replaces the quadrangle.
    pub whole: bool,
    /// Where R does not: the four triangles between it and the quadrangle.
    pub triangles: Vec<[DVec2; 3]>,
}

/// Converts the cell that a quadrangle around `at` overlaps most. `lines` are the grid lines of the unit domain,
/// `quad` and `radius` the quadrangle and its ball in the unit domain and the space of size 1.
pub(crate) fn convert(
    sheet: &Sheet,
    lines: &[Vec<f64>; 2],
    miter: usize,
    at: DVec2,
    quad: [DVec2; 4],
    radius: f64,
) -> ConvertedLeaf {
    let r = quad.iter().fold(Rect::new(quad[0], quad[0]), |r, &c| r.union(&Rect::new(c, c)));
    // The quadrangle of a point on a seam reaches out of the domain: look at the cells it starts from.
    let spans = [0, 1].map(|d| overlapped(&lines[d], r.low[d], r.high[d], sheet.periodic[d]));
    let cell = Rect::new(DVec2::new(spans[0][0], spans[1][0]), DVec2::new(spans[0][1], spans[1][1]));
    let whole_cell = cell.union(&r);
    let part = |u: [f64; 2], v: [f64; 2]| {
        let (low, high) = (sheet.to_surface(DVec2::new(u[0], v[0])), sheet.to_surface(DVec2::new(u[1], v[1])));
        [[low.x, high.x], [low.y, high.y]]
    };
    let u = [whole_cell.low.x, r.low.x, r.high.x, whole_cell.high.x];
    let v = [whole_cell.low.y, r.low.y, r.high.y, whole_cell.high.y];
    let all = [v[0], v[3]];
    let center = sheet.point(at);
    let whole = sheet.hull(&r).pos.iter().all(|p| p.distance(center) <= radius);
    let triangles = if whole { Vec::new() } else { corner_triangles(&r, quad) };
    ConvertedLeaf {
        miter,
        cell: part([u[0], u[3]], all),
        expanded: whole_cell != cell,
        slabs: [part([u[0], u[1]], all), part([u[1], u[2]], all), part([u[2], u[3]], all)],
        middle: [0, 1, 2].map(|k| part([u[1], u[2]], [v[k], v[k + 1]])),
        whole,
        triangles: triangles.into_iter().map(|t| t.map(|c| sheet.to_surface(c))).collect(),
    }
}

/// The cell of one direction that an interval overlaps most.
fn overlapped(lines: &[f64], low: f64, high: f64, periodic: bool) -> [f64; 2] {
    let turns = if periodic { -1..=1 } else { 0..=0 };
    let mut best = (f64::NEG_INFINITY, [0.0, 1.0]);
    for turn in turns {
        for cell in lines.windows(2) {
            let (a, b) = (cell[0] + f64::from(turn), cell[1] + f64::from(turn));
            let overlap = high.min(b) - low.max(a);
            if overlap > best.0 {
                best = (overlap, [a, b]);
            }
        }
    }
    best.1
}

/// The triangles between a convex quadrangle and the rectangle around it.
fn corner_triangles(r: &Rect, quad: [DVec2; 4]) -> Vec<[DVec2; 3]> {
    (0..4)
        .filter_map(|k| {
            let (a, b) = (quad[k], quad[(k + 1) % 4]);
            // The corner of the rectangle beyond the edge.
            let corner = [DVec2::new(a.x, b.y), DVec2::new(b.x, a.y)].into_iter().find(|c| {
                let on = |x: f64, y: f64| (x - y).abs() <= 1e-12 * (1.0 + r.size().max_element());
                (on(c.x, r.low.x) || on(c.x, r.high.x)) && (on(c.y, r.low.y) || on(c.y, r.high.y))
            })?;
            let area = (b - a).perp_dot(corner - a).abs();
            (area > 0.0).then_some([a, corner, b])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrangle_and_triangles_fill_the_rectangle() {
        let at = DVec2::new(0.3, 0.6);
        for angle in [0.2_f64, 1.0, 2.0, 4.5] {
            let (e, x) = (DVec2::from_angle(angle) * 0.02, DVec2::from_angle(angle).perp() * 0.003);
            let quad = [at + e + x, at - e + x, at - e - x, at + e - x];
            let r = quad.iter().fold(Rect::new(quad[0], quad[0]), |r, &c| r.union(&Rect::new(c, c)));
            let triangles = corner_triangles(&r, quad);
            assert_eq!(triangles.len(), 4);
            let area = |t: &[DVec2; 3]| 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]).abs();
            let sum: f64 = triangles.iter().map(area).sum::<f64>() + 4.0 * e.perp_dot(x).abs();
            assert!((sum - r.size().element_product()).abs() < 1e-15, "{sum}");
        }
    }

    #[test]
    fn an_interval_on_a_line_belongs_to_the_larger_side() {
        let lines = [0.0, 0.25, 0.5, 0.75, 1.0];
        assert_eq!(overlapped(&lines, 0.24, 0.28, false), [0.25, 0.5]);
        assert_eq!(overlapped(&lines, 0.2, 0.26, false), [0.0, 0.25]);
        assert_eq!(overlapped(&lines, -0.05, 0.01, true), [-0.25, 0.0]);
    }
}
