//! The live preview: a surface from the sides picked so far, and where it folds.
//!
//! Two sides that face each other make a ruled surface, two that meet a translational one, three or four a bilinear
//! Coons patch (HJR99 (4)), with the open fourth side straight. It costs microseconds, so it is made anew after every
//! event. The coarse projection that follows the fourth side is a job ([`super::Effect::Project`]).

use glam::DVec3;

use super::arrange::{Layout, Order, SideLine};
use super::corners::Corner;
use crate::kernel::heal::coons;

/// Cells along one direction: the grid on which folds are looked for.
pub const CELLS: usize = 16;

/// What kind of surface the preview is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PreviewKind {
    /// Straight lines between two sides.
    Ruled,
    /// One side carried along the other.
    Translational,
    /// Three sides and a straight one.
    CoonsOpen,
    /// Four sides.
    Coons,
}

/// A grid of points, u fastest, with its folds.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// What it is.
    pub kind: PreviewKind,
    /// `(CELLS + 1)^2` points.
    pub points: Vec<DVec3>,
    /// Cells (along u, along v) that face the other way than most of the surface.
    pub folds: Vec<[usize; 2]>,
}

impl Preview {
    /// The triangles of its cells, two each.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let row = (CELLS + 1) as u32;
        (0..CELLS as u32 * CELLS as u32)
            .flat_map(|k| {
                let a = k / CELLS as u32 * row + k % CELLS as u32;
                [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
            })
            .collect()
    }

    /// The corner of the loop (0 to 3) nearest to its folds.
    pub fn fold_corner(&self) -> Option<usize> {
        let n = self.folds.len() as f64;
        let middle = self.folds.iter().fold([0.0, 0.0], |m, f| [m[0] + f[0] as f64 / n, m[1] + f[1] as f64 / n]);
        let half = 0.5 * (CELLS - 1) as f64;
        (!self.folds.is_empty()).then_some(match (middle[0] > half, middle[1] > half) {
            (false, false) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, true) => 3,
        })
    }
}

/// The preview of a layout; `None` for fewer than two sides.
pub fn preview(layout: &Layout, lines: &[Option<SideLine>; 4], corners: &[Corner]) -> Option<Preview> {
    let n = CELLS + 1;
    let side = |order: &Order, place: usize| -> Option<Vec<DVec3>> {
        Some(lines[order.sides[place]].as_ref()?.resampled(n, order.reversed[place]))
    };
    let (kind, points) = match layout {
        Layout::Nothing => return None,
        Layout::Facing(order) => {
            let (a, b) = (side(order, 0)?, side(order, 1)?);
            (PreviewKind::Ruled, grid(|i, j| a[i].lerp(b[i], j as f64 / CELLS as f64)))
        }
        Layout::Meeting(order) => {
            let (a, b) = (side(order, 0)?, side(order, 1)?);
            (PreviewKind::Translational, grid(|i, j| a[i] + (b[j] - b[0])))
        }
        Layout::Open(order) => {
            let (a, b, c) = (side(order, 0)?, side(order, 1)?, side(order, 2)?);
            let (from, to) = (c[CELLS], a[0]);
            let d = (0..n).map(|k| from.lerp(to, k as f64 / CELLS as f64)).collect();
            let middle = [0.5 * (a[CELLS] + b[0]), 0.5 * (b[CELLS] + c[0])];
            (PreviewKind::CoonsOpen, coons([a, b, c, d], [to, middle[0], middle[1], from]))
        }
        Layout::Loop(order, _) => {
            let sides = [side(order, 0)?, side(order, 1)?, side(order, 2)?, side(order, 3)?];
            let at = |k: usize| corners.get(k).map_or(sides[k][0], Corner::point);
            let corners = [at(0), at(1), at(2), at(3)];
            (PreviewKind::Coons, coons(sides, corners))
        }
    };
    let folds = folds(&points);
    Some(Preview { kind, points, folds })
}

fn grid(f: impl Fn(usize, usize) -> DVec3) -> Vec<DVec3> {
    (0..(CELLS + 1) * (CELLS + 1)).map(|k| f(k % (CELLS + 1), k / (CELLS + 1))).collect()
}

/// The bilinear Coons patch of four sides in loop order, whose ends are moved to the corners first.
fn coons(sides: [Vec<DVec3>; 4], corners: [DVec3; 4]) -> Vec<DVec3> {
    let mut k = 0;
    let [a, b, mut c, mut d] = sides.map(|side| {
        let ends = [corners[k], corners[(k + 1) % 4]];
        let (from, to) = (ends[0] - side[0], ends[1] - side[CELLS]);
        k += 1;
        let mut moved: Vec<DVec3> =
            side.iter().enumerate().map(|(i, p)| *p + from.lerp(to, i as f64 / CELLS as f64)).collect();
        (moved[0], moved[CELLS]) = (ends[0], ends[1]);
        moved
    });
    c.reverse();
    d.reverse();
    coons::coons(&a, &b, &c, &d).values().to_vec()
}

/// Cells that face the other way. A surface may bend as far as it likes along one direction; what counts is whether a
/// cell turns over against its neighbour (followed over the whole grid; the smaller part is the fold), and
/// whether the direction of u turns back along v, or that of v along u, as it does in a twisted strip. There it does so
/// along most of the side; a side that winds around something turns back in places and folds nothing.
fn folds(points: &[DVec3]) -> Vec<[usize; 2]> {
    let mut out = overturned(points);
    let at = |i: usize, j: usize| points[j * (CELLS + 1) + i];
    let step = |i: usize, j: usize| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        [(b - a + d - c).normalize_or_zero(), (c - a + d - b).normalize_or_zero()]
    };
    let turns = |[u, v]: [DVec3; 2], [u0, v0]: [DVec3; 2]| [u.dot(u0) < 0.0, v.dot(v0) < 0.0];
    // A ring turns both directions alike; a twisted strip only the one across.
    let across = |i: usize, j: usize| turns(step(i, j), step(i, 0)) == [true, false];
    let along = |i: usize, j: usize| turns(step(i, j), step(0, j)) == [false, true];
    let last = CELLS - 1;
    let most = |turned: &dyn Fn(usize) -> bool| 2 * (0..CELLS).filter(|&k| turned(k)).count() > CELLS;
    let twisted = [most(&|i| across(i, last)), most(&|j| along(last, j))];
    for j in 0..CELLS {
        for i in 0..CELLS {
            let here = (twisted[0] && across(i, j)) || (twisted[1] && along(i, j));
            if here && !out.contains(&[i, j]) {
                out.push([i, j]);
            }
        }
    }
    out
}

/// The smaller part of the cells when the grid is cut where neighbours turn over against each other.
fn overturned(points: &[DVec3]) -> Vec<[usize; 2]> {
    let at = |i: usize, j: usize| points[j * (CELLS + 1) + i];
    let normal =
        |i: usize, j: usize| (at(i + 1, j + 1) - at(i, j)).cross(at(i, j + 1) - at(i + 1, j)).normalize_or_zero();
    let mut sign = [[0_i8; CELLS]; CELLS];
    for seed in 0..CELLS * CELLS {
        if sign[seed / CELLS][seed % CELLS] != 0 || normal(seed % CELLS, seed / CELLS) == DVec3::ZERO {
            continue;
        }
        sign[seed / CELLS][seed % CELLS] = 1;
        let mut stack = vec![[seed % CELLS, seed / CELLS]];
        while let Some([i, j]) = stack.pop() {
            let here = normal(i, j);
            for (di, dj) in [(1, 0), (0, 1), (-1_isize, 0), (0, -1_isize)] {
                let (Some(a), Some(b)) = (i.checked_add_signed(di), j.checked_add_signed(dj)) else { continue };
                if a >= CELLS || b >= CELLS || sign[b][a] != 0 {
                    continue;
                }
                let dot = here.dot(normal(a, b));
                if dot != 0.0 {
                    sign[b][a] = if dot > 0.0 { sign[j][i] } else { -sign[j][i] };
                    stack.push([a, b]);
                }
            }
        }
    }
    let count = |s: i8| sign.iter().flatten().filter(|&&x| x == s).count();
    let minor = if count(1) < count(-1) { 1 } else { -1 };
    let mut out = Vec::new();
    for (j, row) in sign.iter().enumerate() {
        out.extend(row.iter().enumerate().filter(|(_, s)| **s == minor).map(|(i, _)| [i, j]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::arrange::{chain, layout};
    use super::super::piece::Picked;
    use super::*;

    fn of(sides: &[[(f64, f64, f64); 2]], flipped: [bool; 4]) -> Preview {
        let mut lines = [None, None, None, None];
        for (slot, [a, b]) in lines.iter_mut().zip(sides) {
            let p = |t: &(f64, f64, f64)| DVec3::new(t.0, t.1, t.2);
            *slot = chain(&[Picked::line(p(a), p(b)).unwrap()]);
        }
        let ends = [0, 1, 2, 3].map(|k: usize| lines[k].as_ref().map(SideLine::ends));
        preview(&layout(&ends, flipped), &lines, &[]).unwrap()
    }

    const SQUARE: [[(f64, f64, f64); 2]; 4] = [
        [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)],
        [(2.0, 0.0, 0.0), (2.0, 1.0, 1.0)],
        [(2.0, 1.0, 1.0), (0.0, 1.0, 0.0)],
        [(0.0, 1.0, 0.0), (0.0, 0.0, 0.0)],
    ];

    #[test]
    fn two_three_and_four_straight_sides_make_the_same_bilinear_patch() {
        let facing = [SQUARE[0], SQUARE[2]];
        for (sides, kind) in [
            (&SQUARE[..], PreviewKind::Coons),
            (&SQUARE[..3], PreviewKind::CoonsOpen),
            (&facing[..], PreviewKind::Ruled),
        ] {
            let made = of(sides, [false; 4]);
            assert_eq!(made.kind, kind);
            assert!(made.folds.is_empty());
            for p in &made.points {
                // z = (x / 2) y on the bilinear patch through these corners.
                assert!((p.z - 0.5 * p.x * p.y).abs() < 1e-12, "{kind:?} {p}");
            }
        }
        let made = of(&SQUARE[..2], [false; 4]);
        assert_eq!(made.kind, PreviewKind::Translational);
    }

    #[test]
    fn a_side_flipped_the_wrong_way_folds_and_says_where() {
        let wrong = of(&[SQUARE[0], SQUARE[2]], [false, true, false, false]);
        // A bow tie: half of it faces the other way (the middle row of cells may go either way).
        assert!(wrong.folds.len() >= CELLS * CELLS / 4);
        assert!(wrong.fold_corner().is_some());
    }

    #[test]
    fn three_quarters_of_a_ring_do_not_fold() {
        let arc = |r: f64| -> Vec<DVec3> {
            (0..=64).map(|k| f64::from(k) / 64.0 * 4.7).map(|a| DVec3::new(r * a.cos(), r * a.sin(), 0.0)).collect()
        };
        let lines = [
            chain(&[Picked::polyline(&arc(1.0)).unwrap()]),
            chain(&[Picked::polyline(&arc(2.0)).unwrap()]),
            None,
            None,
        ];
        let ends = [0, 1, 2, 3].map(|k: usize| lines[k].as_ref().map(SideLine::ends));
        assert!(preview(&layout(&ends, [false; 4]), &lines, &[]).unwrap().folds.is_empty());
    }

    #[test]
    fn a_surface_that_bends_all_the_way_round_does_not_fold() {
        let circle: Vec<DVec3> =
            (0..=64).map(|k| f64::from(k) / 64.0 * 5.5).map(|a| DVec3::new(a.cos(), a.sin(), 0.0)).collect();
        let up: Vec<DVec3> = circle.iter().map(|p| *p + DVec3::Z).collect();
        let lines =
            [chain(&[Picked::polyline(&circle).unwrap()]), chain(&[Picked::polyline(&up).unwrap()]), None, None];
        let ends = [0, 1, 2, 3].map(|k: usize| lines[k].as_ref().map(SideLine::ends));
        let made = preview(&layout(&ends, [false; 4]), &lines, &[]).unwrap();
        assert_eq!(made.kind, PreviewKind::Ruled);
        assert!(made.folds.is_empty());
        assert_eq!(made.triangles().len(), 2 * CELLS * CELLS);
    }

    #[test]
    fn two_hairpins_whose_bends_face_each_other_askew_do_not_fold() {
        // The sections of a thick leaf: around its nose, which comes earlier along one side than along the other.
        let hairpin = |lead: f64, z: f64| -> Vec<DVec3> {
            let r = 0.3;
            let mut points = vec![DVec3::new(-lead, r, z)];
            let turn = |a: f64| DVec3::new(r * a.sin(), r * a.cos(), z);
            points.extend((0..=32).map(|k| turn(f64::from(k) / 32.0 * std::f64::consts::PI)));
            points.push(DVec3::new(-(2.0 - lead), -r, z));
            points
        };
        let lines = [
            chain(&[Picked::polyline(&hairpin(1.0, 0.0)).unwrap()]),
            chain(&[Picked::polyline(&hairpin(1.35, 1.0)).unwrap()]),
            None,
            None,
        ];
        let ends = [0, 1, 2, 3].map(|k: usize| lines[k].as_ref().map(SideLine::ends));
        let made = preview(&layout(&ends, [false; 4]), &lines, &[]).unwrap();
        assert!(made.folds.is_empty(), "{:?}", made.folds);
    }
}
