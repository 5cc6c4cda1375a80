//! What the picking tool shows while sides are being picked, in well under 50 ms: a ruled surface from two
//! sides, a Coons patch from three or four, and from four on a coarse projection with the status of its samples.
//!
//! Nothing here refuses: corners may be open (their gaps are in the result), sides may cross. With three sides
//! the fourth is the straight segment between the open ends. Two sides that meet in a corner span the surface
//! a(u) + b(v) - corner; others are ruled so that their ends are near each other.

use glam::DVec3;

use super::boundary_loop::{LoopChoice, arrange};
use super::coons::coons;
use super::grid::Grid;
use super::normals::normals;
use super::project::{Sample, project};
use super::side::SideCurve;
use super::slab;
use crate::kernel::geom::Curve;
use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};

/// A sketch of a patch.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The ruled or Coons grid.
    pub grid: Grid<DVec3>,
    /// Its unit normals.
    pub normals: Grid<DVec3>,
    /// The loop through four sides; `None` with fewer.
    pub choice: Option<LoopChoice>,
    /// Another loop that is almost as good.
    pub alternative: Option<LoopChoice>,
    /// Corner points (the middle of each gap) and the gap there, in loop order; as many as sides meet.
    pub corners: Vec<(DVec3, f64)>,
    /// Projected samples of the grid, `None` for gaps; empty with fewer than four sides or without originals.
    pub samples: Option<Grid<Option<Sample>>>,
    /// d of HJR99 (7) that was used for them.
    pub slab: f64,
    /// Whether the grid is folded: somewhere its normal turns against the mean normal.
    pub folded: bool,
}

/// How to sketch.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewOptions {
    /// Spans in each direction. Default 12.
    pub spans: usize,
    /// d of HJR99 (7); from the corners when `None`.
    pub slab: Option<f64>,
    /// How the four sides follow each other; searched when `None`.
    pub choice: Option<LoopChoice>,
}

impl Default for PreviewOptions {
    fn default() -> Self {
        Self { spans: 12, slab: None, choice: None }
    }
}

/// Sketches two to four sides; `None` with fewer than two that have any length, or when cancelled.
pub fn preview(sides: &[Vec<Curve>], set: Option<&SurfaceSet>, options: &PreviewOptions, job: &Job) -> Option<Preview> {
    // Gaps between the pieces of a side are closed whatever their size: this is only a sketch.
    let sides: Vec<SideCurve> = sides.iter().filter_map(|s| SideCurve::chain(s, f64::INFINITY).ok()).collect();
    let spans = options.spans.clamp(2, 256);
    let mut choice = None;
    let mut alternative = None;
    let (grid, corners) = match &sides[..] {
        [a, b] => two(a, b, spans),
        [a, b, c] => {
            let (gap, [a, b, c]) = best_three([a, b, c]);
            let closing = Curve::segment(c.ends()[1], a.ends()[0]).ok()?;
            let corners = vec![corner(&a, &b), corner(&b, &c)];
            match SideCurve::chain(&[closing], f64::INFINITY) {
                Ok(d) => (four([a, b, c, d], spans), corners),
                // The open ends coincide: a triangle, its fourth side a point.
                Err(_) => (triangle([a, b, c], spans), [corners, vec![(gap.1, gap.0)]].concat()),
            }
        }
        [a, b, c, d, ..] => {
            let given = [a, b, c, d];
            let ends = given.map(SideCurve::ends);
            let (found, second) = arrange(&ends);
            let used = options.choice.unwrap_or(found);
            (choice, alternative) = (Some(used), second);
            let placed = [0, 1, 2, 3].map(|k| {
                let side = given[used.order[k]];
                if used.reversed[k] { side.reversed() } else { side.clone() }
            });
            let corners = (0..4).map(|k| corner(&placed[(k + 3) % 4], &placed[k])).collect();
            (four(placed, spans), corners)
        }
        _ => return None,
    };
    if job.is_cancelled() {
        return None;
    }
    let normals = normals(&grid);
    let (m, n) = (grid.m(), grid.n());
    let d = options
        .slab
        .unwrap_or_else(|| slab::default_distance([grid[(0, 0)], grid[(m, 0)], grid[(m, n)], grid[(0, n)]]));
    let mean: DVec3 = normals.values().iter().sum();
    let folded = normals.values().iter().any(|x| x.dot(mean) < 0.0);
    let samples = set.filter(|s| sides.len() >= 4 && !s.is_empty()).map(|set| {
        let mut scratch = Scratch::default();
        Grid::from_fn(m, n, |i, j| project(set, grid[(i, j)], normals[(i, j)], d, &mut scratch))
    });
    Some(Preview { grid, normals, choice, alternative, corners, samples, slab: d, folded })
}

fn corner(a: &SideCurve, b: &SideCurve) -> (DVec3, f64) {
    let (p, q) = (a.ends()[1], b.ends()[0]);
    (0.5 * (p + q), p.distance(q))
}

/// Sides in loop order and direction, their corners moved together.
fn four(sides: [SideCurve; 4], spans: usize) -> Grid<DVec3> {
    let corners = [0, 1, 2, 3].map(|k| corner(&sides[(k + 3) % 4], &sides[k]).0);
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| sides[k].with_ends([corners[k], corners[(k + 1) % 4]]));
    coons(&a.samples(spans), &b.samples(spans), &c.reversed().samples(spans), &d.reversed().samples(spans))
}

fn triangle(sides: [SideCurve; 3], spans: usize) -> Grid<DVec3> {
    let [a, b, c] = &sides;
    let apex = a.ends()[0];
    let (bottom, right) = (a.samples(spans), b.with_ends([a.ends()[1], b.ends()[1]]).samples(spans));
    let top = c.with_ends([right[spans], apex]).reversed().samples(spans);
    coons(&bottom, &right, &top, &vec![apex; spans + 1])
}

/// The order and directions of three sides with the smallest gaps at the two corners between them; with it the
/// gap between the open ends and its middle.
fn best_three(sides: [&SideCurve; 3]) -> ((f64, DVec3), [SideCurve; 3]) {
    let mut best: Option<(f64, [SideCurve; 3])> = None;
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2]] {
        for bits in 0..8 {
            let [a, b, c] = [0, 1, 2].map(|k| {
                let side = sides[order[k]];
                if bits >> k & 1 == 1 { side.reversed() } else { side.clone() }
            });
            let sum = corner(&a, &b).1 + corner(&b, &c).1;
            if best.as_ref().is_none_or(|x| sum < x.0) {
                best = Some((sum, [a, b, c]));
            }
        }
    }
    let chosen = best.map_or_else(|| sides.map(SideCurve::clone), |b| b.1);
    let (middle, gap) = corner(&chosen[2], &chosen[0]);
    ((gap, middle), chosen)
}

/// Two sides: ruled, or spanned from a common corner.
fn two(a: &SideCurve, b: &SideCurve, spans: usize) -> (Grid<DVec3>, Vec<(DVec3, f64)>) {
    let turned = |s: &SideCurve, turn: bool| if turn { s.reversed() } else { s.clone() };
    let near = 0.05 * a.length().min(b.length());
    for bits in 0..4 {
        let (a, b) = (turned(a, bits & 1 == 1), turned(b, bits & 2 == 2));
        let gap = a.ends()[0].distance(b.ends()[0]);
        if gap <= near {
            let middle = 0.5 * (a.ends()[0] + b.ends()[0]);
            let (p, q) = (a.samples(spans), b.samples(spans));
            return (Grid::from_fn(spans, spans, |i, j| p[i] + q[j] - middle), vec![(middle, gap)]);
        }
    }
    let apart = |b: &SideCurve| (0..2).map(|k| a.ends()[k].distance(b.ends()[k])).sum::<f64>();
    let b = turned(b, apart(&b.reversed()) < apart(b));
    let (p, q) = (a.samples(spans), b.samples(spans));
    (Grid::from_fn(spans, spans, |i, j| p[i].lerp(q[i], j as f64 / spans as f64)), Vec::new())
}
