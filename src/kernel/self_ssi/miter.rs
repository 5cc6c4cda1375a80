//! Miter points: where Su x Sv vanishes, with certainty.
//!
//! A cell is done when a window test proves it regular, when the Bezier net of Su x Sv has a direction with which all
//! its coefficients have a positive product, or when the cross-cap window test proves that it holds one miter point at
//! most and Newton has found it. Newton works on cos(phi) Su + sin(phi) Sv = 0 in (u, v, phi), whose Jacobian is
//! regular exactly at cross-caps. At a zero with a singular Jacobian [`super::degenerate`] tells isolated miter points and
//! those with two branches; where zeros go on along the kernel they are a cusp edge ([`super::cusp`]), reported as a curve.
//!
//! Cost: a few cells for each miter point; a cusp edge is met once and its cells are then skipped.

use glam::{DMat3, DVec2, DVec3};

use super::chart::{Value, near};
use super::cusp::{CuspEdge, follow};
use super::degenerate;
use super::hull::{Hull, Rect, range};
use super::sheet::Sheet;
use super::window;
use crate::kernel::job::Job;

/// What a miter point is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum MiterKind {
    /// Generic: one branch starts here.
    CrossCap,
    /// No branch starts here.
    Isolated,
    /// A branch starts on one or both sides along a direction.
    Degenerate(DVec2, [bool; 2]),
}

/// One miter point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MiterPoint {
    pub at: DVec2,
    /// The angle of the null direction.
    pub phi: f64,
    pub kind: MiterKind,
    /// Su, Sv.
    pub first: [DVec3; 2],
    /// Suu, Suv, Svv.
    pub second: [DVec3; 3],
    /// For degenerate points: the kernel direction in the domain.
    pub along: DVec2,
}

impl MiterPoint {
    pub fn null(&self) -> DVec2 {
        DVec2::from_angle(self.phi)
    }
}

/// All that was found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Miters {
    pub points: Vec<MiterPoint>,
    /// Curves along which Su x Sv vanishes.
    pub cusps: Vec<CuspEdge>,
    /// Cells that could not be decided.
    pub open: Vec<Rect>,
    /// Cells that were looked at.
    pub cells: usize,
}

/// The smallest cell.
const SMALLEST: f64 = 1e-7;
/// The most cells.
const CAP: usize = 40_000;
/// With more undecided cells than this the search gives up.
const MANY_OPEN: usize = 1000;
/// Cells smaller than this are skipped beside a cusp edge.
const CUSP_CELL: f64 = 1.0 / 64.0;

/// Finds all miter points and cusp edges.
pub(crate) fn find(sheet: &Sheet, job: &Job) -> Miters {
    let mut out = Miters::default();
    let mut level: Vec<(usize, Rect)> =
        (0..sheet.pieces.len()).map(|k| (k, Rect::new(sheet.pieces[k].low, sheet.pieces[k].high))).collect();
    while !level.is_empty() {
        let mut next = Vec::new();
        for (piece, rect) in level {
            out.cells += 1;
            if job.is_cancelled() || out.cells > CAP || out.open.len() > MANY_OPEN {
                out.open.push(rect);
                continue;
            }
            let excluded = match sheet.pole_at(&rect) {
                // Su x Sv vanishes in the pole itself: divide by the distance from it.
                Some(_) => one_sided(sheet.window_frames(&rect).iter().map(|[u, v]| u.cross(*v)).collect()),
                None => regular(sheet, &sheet.hull_on(piece, &rect)),
            };
            if excluded {
                continue;
            }
            if decided(sheet, piece, &rect, &mut out, job) {
                continue;
            }
            let size = rect.size();
            if size.max_element() < SMALLEST {
                out.open.push(rect);
                continue;
            }
            let d = usize::from(size.y * sheet.pieces[piece].size().x > size.x * sheet.pieces[piece].size().y);
            let middle = rect.center()[d];
            let (mut low, mut high) = (rect, rect);
            low.high[d] = middle;
            high.low[d] = middle;
            next.extend([(piece, low), (piece, high)]);
        }
        level = next;
    }
    out.points.sort_by(|a, b| (a.at.y, a.at.x).partial_cmp(&(b.at.y, b.at.x)).unwrap_or(std::cmp::Ordering::Equal));
    out
}

/// Whether the net of Su x Sv is on one side of a plane through the origin.
fn regular(sheet: &Sheet, hull: &Hull) -> bool {
    let normals: Vec<DVec3> = if sheet.rational {
        hull.du.iter().flat_map(|u| hull.dv.iter().map(move |v| u.cross(*v))).collect()
    } else {
        cross_net(&hull.du, &hull.dv, sheet.degree)
    };
    one_sided(normals)
}

/// Whether vectors lie strictly on one side of a plane through the origin.
fn one_sided(normals: Vec<DVec3>) -> bool {
    let mean: DVec3 = normals.iter().sum();
    // Not merely above zero: a singular point on the cell's border must not be lost to rounding.
    let [low, high] = range(mean.normalize_or_zero(), &normals);
    mean != DVec3::ZERO && low > 1e-11 * high
}

/// The Bezier net of the cross product of nets of degrees (p - 1, q) and (p, q - 1).
fn cross_net(du: &[DVec3], dv: &[DVec3], [p, q]: [usize; 2]) -> Vec<DVec3> {
    let binomial = |n: usize| -> Vec<f64> {
        let mut row = vec![1.0; n + 1];
        for k in 1..=n {
            row[k] = row[k - 1] * (n - k + 1) as f64 / k as f64;
        }
        row
    };
    let (pu, pv, pp) = (binomial(p - 1), binomial(p), binomial(2 * p - 1));
    let (qu, qv, qq) = (binomial(q), binomial(q - 1), binomial(2 * q - 1));
    let width = 2 * p;
    let mut out = vec![DVec3::ZERO; width * 2 * q];
    for j in 0..=q {
        for i in 0..p {
            let a = du[j * p + i] * (pu[i] * qu[j]);
            for l in 0..q {
                for k in 0..=p {
                    out[(j + l) * width + i + k] += a.cross(dv[l * (p + 1) + k]) * (pv[k] * qv[l]);
                }
            }
        }
    }
    for (at, n) in out.iter_mut().enumerate() {
        *n /= pp[at % width] * qq[at / width];
    }
    out
}

/// Looks for the miter point of a cell; true when the cell needs no further splitting.
fn decided(sheet: &Sheet, piece: usize, rect: &Rect, out: &mut Miters, job: &Job) -> bool {
    let size = rect.size().max_element();
    let beside = |cusps: &[CuspEdge]| {
        let grown = rect.grown(0.6);
        cusps.iter().flat_map(CuspEdge::nodes).any(|c| grown.contains(c.at))
    };
    if size <= CUSP_CELL && beside(&out.cusps) {
        return true;
    }
    let Some((y, value)) = newton(sheet, rect.center()) else { return false };
    let m = DVec2::new(y[0], y[1]);
    if !rect.grown(1.0).contains(m) {
        return false;
    }
    let jet = sheet.jet(m, 2);
    let frame = DMat3::from_cols(value.j[0], value.j[1], value.j[2]);
    if determinant(&frame) < 1e-2 && size <= CUSP_CELL {
        if let Some(settled) = cusp_here(sheet, y, &frame, out, job) {
            return settled && beside(&out.cusps);
        }
        // Newton stops short of a double zero, where its Jacobian still looks regular: look for the double zero itself.
        if let Some(double) = degenerate::polish(sheet, y) {
            let DVec2 { x, y } = double.node.at;
            let at = DVec2::new(x, y);
            let known = out.points.iter().position(|k| sheet.wrapped(k.at).distance(sheet.wrapped(at)) < 1e-6);
            let known = known.or_else(|| {
                let jet = sheet.jet(at, 2);
                let point = MiterPoint {
                    at,
                    phi: double.node.phi,
                    kind: double.kind(),
                    first: jet.d,
                    second: jet.dd,
                    along: double.along,
                };
                in_domain(sheet, at).then(|| {
                    out.points.push(point);
                    out.points.len() - 1
                })
            });
            return known.is_some_and(|k| degenerate::settled(sheet, rect, &out.points[k]));
        }
    }
    let generic = is_regular(&frame);
    let known = out.points.iter().any(|k| sheet.wrapped(k.at).distance(sheet.wrapped(m)) < 1e-8);
    let here = in_domain(sheet, m);
    if generic {
        let around = rect.union(&Rect::new(m, m)).grown(0.02);
        let null = DVec2::from_angle(y[2]);
        let alone = window::cross_cap(&around, &sheet.jets_on(piece, &around), null, jet.d, jet.dd);
        if here && !known && (alone || size < 1e-3) {
            let kind = MiterKind::CrossCap;
            out.points.push(MiterPoint { at: m, phi: y[2], kind, first: jet.d, second: jet.dd, along: DVec2::ZERO });
        }
        return alone;
    }
    false
}

/// Looks for a cusp edge through a zero: whether it is a new edge, or `None` where zeros do not go on.
fn cusp_here(sheet: &Sheet, y: [f64; 3], frame: &DMat3, out: &mut Miters, job: &Job) -> Option<bool> {
    let cusp = follow(sheet, y, frame, job)?;
    // Where the whole edge is one point it is a pole, not an edge.
    let s = sheet.point(DVec2::new(y[0], y[1]));
    let edge = cusp.nodes().iter().any(|c| sheet.point(c.at).distance(s) > 1e-9);
    if edge {
        out.cusps.push(cusp);
    }
    Some(edge)
}

/// The cross-cap that Newton finds from a point of the domain; `None` where there is none.
pub(crate) fn polished(sheet: &Sheet, from: DVec2) -> Option<MiterPoint> {
    let (y, value) = newton(sheet, from)?;
    let m = DVec2::new(y[0], y[1]);
    let jet = sheet.jet(m, 2);
    let generic = is_regular(&DMat3::from_cols(value.j[0], value.j[1], value.j[2]));
    (generic && in_domain(sheet, m)).then_some(MiterPoint {
        at: m,
        phi: y[2],
        kind: MiterKind::CrossCap,
        first: jet.d,
        second: jet.dd,
        along: DVec2::ZERO,
    })
}

fn in_domain(sheet: &Sheet, m: DVec2) -> bool {
    (0..2).all(|d| sheet.periodic[d] || (-1e-10..=1.0 + 1e-10).contains(&m[d]))
}

pub(crate) fn at(sheet: &Sheet, y: [f64; 3]) -> Value {
    near(sheet, DVec2::new(y[0], y[1]), y[2], 0.0)
}

/// Newton from a point of the domain, by damped least squares where the Jacobian is singular.
fn newton(sheet: &Sheet, from: DVec2) -> Option<([f64; 3], Value)> {
    let jet = sheet.jet(from, 1);
    let (e, f, g) = (jet.d[0].length_squared(), jet.d[0].dot(jet.d[1]), jet.d[1].length_squared());
    // The direction that the first form shrinks most.
    let phi = 0.5 * (2.0 * f).atan2(e - g) + std::f64::consts::FRAC_PI_2;
    let mut y = [from.x, from.y, phi];
    let scale = (e + g).sqrt();
    for round in 0..40 {
        let value = at(sheet, y);
        let frame = DMat3::from_cols(value.j[0], value.j[1], value.j[2]);
        let d = damped(&frame, value.f)?;
        let longest = DVec2::new(d.x, d.y).length().max(0.5 * d.z.abs());
        let cut = if longest > 0.25 { 0.25 / longest } else { 1.0 };
        for k in 0..3 {
            y[k] -= cut * d[k];
        }
        if !y.iter().all(|x| x.abs() < 1e3) || (y[0] - 0.5).abs() > 1.5 || (y[1] - 0.5).abs() > 1.5 {
            return None;
        }
        if longest < 1e-13 || (round > 12 && longest < 1e-10) {
            break;
        }
    }
    let value = at(sheet, y);
    (value.f.length() <= 1e-11 * scale).then_some((y, value))
}

/// The determinant over the cube of the longest column.
fn determinant(frame: &DMat3) -> f64 {
    let longest = frame.x_axis.length().max(frame.y_axis.length()).max(frame.z_axis.length());
    if longest > 0.0 { frame.determinant().abs() / longest.powi(3) } else { 0.0 }
}

/// Whether the miter system's Jacobian is far from singular, both for its columns and in absolute terms (a column that
/// vanishes but for rounding has a direction, too).
fn is_regular(frame: &DMat3) -> bool {
    let lengths = [frame.x_axis.length(), frame.y_axis.length(), frame.z_axis.length()];
    let largest = lengths[0].max(lengths[1]).max(lengths[2]);
    let det = frame.determinant().abs();
    det > 1e-7 * lengths[0] * lengths[1] * lengths[2] && det > 1e-10 * largest * largest * largest
}

/// Solves a 3 x 3 system; near-singular ones in the sense of damped least squares.
pub(crate) fn damped(frame: &DMat3, f: DVec3) -> Option<DVec3> {
    if is_regular(frame) {
        return Some(frame.inverse() * f);
    }
    let normal = frame.transpose() * *frame;
    let trace = normal.x_axis.x + normal.y_axis.y + normal.z_axis.z;
    if trace.is_nan() || trace <= 0.0 {
        return None;
    }
    let d = (normal + DMat3::from_diagonal(DVec3::splat(1e-10 * trace))).inverse() * (frame.transpose() * f);
    d.is_finite().then_some(d)
}

/// The kernel of a (nearly) singular matrix.
pub(crate) fn kernel(frame: &DMat3) -> DVec3 {
    let rows = [frame.row(0), frame.row(1), frame.row(2)];
    let candidates = [rows[0].cross(rows[1]), rows[1].cross(rows[2]), rows[2].cross(rows[0])];
    candidates
        .into_iter()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(DVec3::X)
        .normalize_or_zero()
}
