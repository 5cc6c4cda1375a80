//! Parametric splines: piecewise cubics in power basis, curves (112) and surfaces (114), as exact B-splines.
//!
//! A piece `sum c_a s^a`, s = t - t_i in 0..=h, has the Bezier points `b_i = sum_{a<=i} C(i,a)/C(3,a) c_a h^a`. The
//! pieces share the points at their joints, where inner knots are triple: no smoothness is claimed that the file
//! only has up to rounding. Joints where the file's pieces miss each other by no more than its own resolution take
//! the mean; at larger ones the spline is cut in two.

use glam::DVec3;

use super::params::{ParamError, Params};
use crate::kernel::geom::{Curve, Knots, Surface};

/// C(i, a) / C(3, a).
const TO_BEZIER: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0 / 3.0, 0.0, 0.0], [1.0, 2.0 / 3.0, 1.0 / 3.0, 0.0], [1.0, 1.0, 1.0, 1.0]];

/// Rounding of a joint, as a fraction of the largest coordinate.
const ROUNDING: f64 = 1e-12;

/// The Bezier points of one cubic over 0..=h.
fn bezier(c: [DVec3; 4], h: f64) -> [DVec3; 4] {
    let scaled = [c[0], c[1] * h, c[2] * (h * h), c[3] * (h * h * h)];
    TO_BEZIER.map(|row| (0..4).map(|a| scaled[a] * row[a]).sum())
}

/// Breakpoints, which must not decrease.
fn breaks(params: &mut Params<'_>, pieces: usize, what: &'static str) -> Result<Vec<f64>, String> {
    let breaks: Vec<f64> =
        (0..=pieces).map(|_| params.real(what)).collect::<Result<_, _>>().map_err(|e| e.to_string())?;
    match breaks.windows(2).position(|w| !(w[0] <= w[1] && w[0].is_finite() && w[1].is_finite())) {
        Some(at) => Err(format!("breakpoint {} is {}, after {}", at + 1, breaks[at + 1], breaks[at])),
        None => Ok(breaks),
    }
}

/// What a joint may miss and still be closed: rounding in any case, the resolution of the file if that is more.
fn closable(size: f64, resolution: f64) -> f64 {
    (ROUNDING * size).max(resolution.min(1e-4 * size))
}

/// The curves of a record: one, or several where its pieces miss each other.
pub(super) fn curve(params: &mut Params<'_>, resolution: f64, notes: &mut Vec<String>) -> Result<Vec<Curve>, String> {
    let text = |e: ParamError| e.to_string();
    for _ in 0..3 {
        params.next(); // kind, smoothness, dimension: they follow from the numbers
    }
    let pieces = params.count("pieces", 13).map_err(text)?;
    let breaks = breaks(params, pieces, "a breakpoint")?;
    let mut coefficient = || params.real_or(0.0, "a coefficient").map_err(text);
    let mut segments = Vec::with_capacity(pieces);
    for pair in breaks.windows(2) {
        let mut c = [DVec3::ZERO; 4];
        for axis in 0..3 {
            for c in &mut c {
                c[axis] = coefficient()?;
            }
        }
        if pair[0] < pair[1] {
            segments.push((*pair.first_chunk::<2>().unwrap_or(&[0.0; 2]), bezier(c, pair[1] - pair[0])));
        }
    }
    for _ in 0..12 {
        params.next(); // the derivatives at the end, once more
    }
    if segments.len() < pieces {
        notes.push(format!("{} pieces of no length were left out", pieces - segments.len()));
    }
    let size = segments.iter().flat_map(|(_, b)| b).fold(0.0f64, |m, p| m.max(p.abs().max_element()));
    let closable = closable(size, resolution);
    let mut curves = Vec::new();
    let (mut breaks, mut points): (Vec<f64>, Vec<DVec3>) = (Vec::new(), Vec::new());
    let mut worst = 0.0f64;
    let flush = |breaks: &mut Vec<f64>, points: &mut Vec<DVec3>, curves: &mut Vec<Curve>| -> Result<(), String> {
        if breaks.len() > 1 {
            let knots = Knots::clamped(3, breaks, 3).map_err(|e| e.to_string())?;
            curves.push(Curve::new(knots, std::mem::take(points), None).map_err(|e| e.to_string())?);
        }
        breaks.clear();
        points.clear();
        Ok(())
    };
    for ([t0, t1], b) in segments {
        if let Some(last) = points.last_mut() {
            let miss = last.distance(b[0]);
            if miss <= closable {
                worst = worst.max(miss);
                *last = 0.5 * (*last + b[0]);
            } else {
                notes.push(format!("cut in two at {t0}, where its pieces miss each other by {miss:.3e}"));
                flush(&mut breaks, &mut points, &mut curves)?;
            }
        }
        if points.is_empty() {
            points.push(b[0]);
            breaks.push(t0);
        }
        points.extend_from_slice(&b[1..]);
        breaks.push(t1);
    }
    flush(&mut breaks, &mut points, &mut curves)?;
    note_worst(worst, size, notes);
    if curves.is_empty() { Err("it has no piece of positive length".into()) } else { Ok(curves) }
}

fn note_worst(worst: f64, size: f64, notes: &mut Vec<String>) {
    if worst > ROUNDING * size {
        notes.push(format!("its pieces miss each other by up to {worst:.3e}; the means were taken"));
    }
}

/// The surfaces of a record: one, or several where its patches miss each other.
pub(super) fn surface(
    params: &mut Params<'_>,
    resolution: f64,
    notes: &mut Vec<String>,
) -> Result<Vec<Surface>, String> {
    let text = |e: ParamError| e.to_string();
    for _ in 0..2 {
        params.next(); // kind, patch kind
    }
    let m = params.count("patches along u", 1).map_err(text)?;
    let n = params.count("patches along v", 1).map_err(text)?;
    params.room(params.index, "coefficients", m.saturating_mul(n), 48).map_err(text)?;
    let tu = breaks(params, m, "a breakpoint along u")?;
    let tv = breaks(params, n, "a breakpoint along v")?;
    // Every row ends with one more patch of arbitrary values, the grid with one more row of them. Some writers
    // leave them out.
    let padded = params.values_left() >= 48 * (m * (n + 1) - usize::from(m > 0));
    if !padded && !params.is_closed() {
        return Err("its record is cut off: it ends without a delimiter".into());
    }
    let mut grid = Grid { m, n, bezier: Vec::with_capacity(m * n) };
    for i in 0..m {
        for j in 0..n {
            let mut c = [[DVec3::ZERO; 4]; 4]; // c[b][a] belongs to s^a t^b
            for axis in 0..3 {
                for c in c.iter_mut().flatten() {
                    c[axis] = params.real("a coefficient").map_err(text)?;
                }
            }
            let along_u = c.map(|row| bezier(row, tu[i + 1] - tu[i]));
            let mut b = [[DVec3::ZERO; 4]; 4];
            for a in 0..4 {
                let column = bezier(std::array::from_fn(|k| along_u[k][a]), tv[j + 1] - tv[j]);
                for k in 0..4 {
                    b[k][a] = column[k];
                }
            }
            grid.bezier.push(b);
        }
        if padded {
            for _ in 0..48 {
                params.next();
            }
        }
    }
    if padded {
        for _ in 0..48 * (n + 1) {
            if params.ended() {
                break;
            }
            params.next();
        }
    } else {
        notes.push("the values that follow each row of patches are missing".into());
    }
    grid.surfaces(&tu, &tv, resolution, notes)
}

/// The Bezier nets of m x n patches, `bezier[i * n + j][row along v][column along u]`.
struct Grid {
    m: usize,
    n: usize,
    bezier: Vec<[[DVec3; 4]; 4]>,
}

impl Grid {
    fn at(&self, i: usize, j: usize) -> &[[DVec3; 4]; 4] {
        &self.bezier[i * self.n + j]
    }

    fn surfaces(
        &self,
        tu: &[f64],
        tv: &[f64],
        resolution: f64,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Surface>, String> {
        let size = self.bezier.iter().flatten().flatten().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
        let closable = closable(size, resolution);
        // What the patches miss along each inner line of the grid.
        let miss_u = |i: usize| {
            let miss = |j: usize| (0..4).map(move |k| self.at(i - 1, j)[k][3].distance(self.at(i, j)[k][0]));
            (0..self.n).flat_map(miss).fold(0.0f64, f64::max)
        };
        let miss_v = |j: usize| {
            let miss = |i: usize| (0..4).map(move |k| self.at(i, j - 1)[3][k].distance(self.at(i, j)[0][k]));
            (0..self.m).flat_map(miss).fold(0.0f64, f64::max)
        };
        let mut worst = 0.0f64;
        let mut blocks = |count: usize, miss: &dyn Fn(usize) -> f64, breaks: &[f64], along: &str| {
            let mut starts = vec![0];
            for i in 1..count {
                let miss = miss(i);
                if miss > closable {
                    starts.push(i);
                    notes.push(format!("cut in two at {along} = {}, where its patches miss by {miss:.3e}", breaks[i]));
                } else {
                    worst = worst.max(miss);
                }
            }
            starts.push(count);
            starts
        };
        let (rows, columns) = (blocks(self.m, &miss_u, tu, "u"), blocks(self.n, &miss_v, tv, "v"));
        note_worst(worst, size, notes);
        let mut surfaces = Vec::new();
        for u in rows.windows(2) {
            for v in columns.windows(2) {
                surfaces.extend(self.block(u[0]..u[1], v[0]..v[1], tu, tv)?);
            }
        }
        if surfaces.is_empty() { Err("it has no patch of positive size".into()) } else { Ok(surfaces) }
    }

    /// One surface of the patches in `us` x `vs`; `None` when nothing of it has size in the parameter plane.
    fn block(
        &self,
        us: std::ops::Range<usize>,
        vs: std::ops::Range<usize>,
        tu: &[f64],
        tv: &[f64],
    ) -> Result<Option<Surface>, String> {
        let us: Vec<usize> = us.filter(|&i| tu[i] < tu[i + 1]).collect();
        let vs: Vec<usize> = vs.filter(|&j| tv[j] < tv[j + 1]).collect();
        if us.is_empty() || vs.is_empty() {
            return Ok(None);
        }
        let (nu, nv) = (3 * us.len() + 1, 3 * vs.len() + 1);
        let mut points = vec![DVec3::ZERO; nu * nv];
        let mut hits = vec![0.0; nu * nv];
        for (a, &i) in us.iter().enumerate() {
            for (b, &j) in vs.iter().enumerate() {
                for (row, line) in self.at(i, j).iter().enumerate() {
                    for (column, point) in line.iter().enumerate() {
                        let at = (3 * b + row) * nu + 3 * a + column;
                        // The running mean leaves values that agree exactly as they are.
                        hits[at] += 1.0;
                        points[at] = points[at] + (*point - points[at]) / hits[at];
                    }
                }
            }
        }
        let knots = |pieces: &[usize], t: &[f64]| {
            let mut breaks: Vec<f64> = pieces.iter().map(|&i| t[i]).collect();
            breaks.extend(pieces.last().map(|&i| t[i + 1]));
            Knots::clamped(3, &breaks, 3).map_err(|e| e.to_string())
        };
        Surface::new(knots(&us, tu)?, knots(&vs, tv)?, points, None).map(Some).map_err(|e| e.to_string())
    }
}
