//! Critical points of a fitted gap in a cell: at most one, or a valley whose floor decides.

use glam::DVec2;

use super::contact::{Critical, Findings, SLACK, Seed, Sub};
use super::correct::PointPair;
use super::gap_fit::Contact;

/// What was found out about the critical points of a cell.
pub(super) enum Critic {
    /// Everything.
    Said,
    /// Nothing.
    Unknown,
    /// The fit is not good enough to tell.
    TooCoarse,
}

impl Contact {
    /// Says everything about a cell that holds at most one critical point.
    pub(super) fn one_critical(&self, sub: &Sub, contact: f64, found: &mut Findings) -> Critic {
        let [xx, xy, yy] = sub.g.hessian_range();
        let slack = 6000.0 * self.error;
        let grown = |r: [f64; 2], w: f64| [r[0] - slack * w, r[1] + slack * w];
        let xx = grown(xx, sub.size.x * sub.size.x);
        let xy = grown(xy, sub.size.x * sub.size.y);
        let yy = grown(yy, sub.size.y * sub.size.y);
        let products = [xx[0] * yy[0], xx[0] * yy[1], xx[1] * yy[0], xx[1] * yy[1]];
        let (least, most) = products.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let square_most = xy[0].abs().max(xy[1].abs()).powi(2);
        let cross = [xy[0] * xy[0], xy[0] * xy[1], xy[1] * xy[1]];
        let square_least = cross.iter().copied().fold(f64::INFINITY, f64::min);
        let extremum = least > square_most;
        let saddle = most < square_least;
        if !extremum && !saddle {
            return Critic::Unknown;
        }
        // Newton from the middle; the Hessian is regular everywhere.
        let mut p = DVec2::splat(0.5);
        let mut steps = 0;
        let critical = loop {
            let v = sub.g.eval(p.x, p.y);
            let det = v.h[0] * v.h[2] - v.h[1] * v.h[1];
            let step = DVec2::new(v.h[2] * v.d[0] - v.h[1] * v.d[1], v.h[0] * v.d[1] - v.h[1] * v.d[0]) / det;
            p -= step * (0.5 / step.length()).min(1.0);
            steps += 1;
            if step.length() < 1e-9 {
                break Some(p);
            }
            if (p - 0.5).abs().max_element() > 1.5 {
                break None;
            }
            if steps > 40 || !p.is_finite() {
                return Critic::Unknown;
            }
        };
        // Accept a little outside: the neighbour may see the same point from its own side of the border.
        let margin = 0.01;
        let Some(p) = critical.filter(|p| p.min_element() > -margin && p.max_element() < 1.0 + margin) else {
            self.border_seeds(sub, found);
            return Critic::Said;
        };
        let gap = sub.g.value(p.x, p.y);
        let place = sub.low + sub.size * p;
        let upward = xx[0] > 0.0;
        if extremum && ((gap > contact + self.error && upward) || (gap < -contact - self.error && !upward)) {
            return Critic::Said; // the bowl does not reach the other surface
        }
        // A bowl shallower than the fit is good decides about a whole loop.
        if extremum && gap.abs() <= 2.0 * self.error && self.error > 0.25 * contact {
            return Critic::TooCoarse;
        }
        let near = gap.abs() <= (4.0 * (contact + self.error)).max(1e-9);
        if near {
            found.criticals.push(Critical { pa: self.pa, pb: self.pb, at: self.pair(place), extremum });
        }
        let before = found.seeds.len();
        self.border_seeds(sub, found);
        if extremum && found.seeds.len() == before && gap.abs() > self.error {
            // A loop inside the cell: along a ray from the extremum the gap changes sign exactly once.
            let sign = gap.signum();
            for direction in [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y] {
                let value = |t: f64| {
                    let q = p + direction * t;
                    sub.g.value(q.x, q.y) * sign
                };
                let reach =
                    if direction.x + direction.y > 0.0 { (DVec2::ONE - p).dot(direction) } else { p.dot(-direction) };
                if !(reach > 0.0) || value(reach) >= 0.0 {
                    continue;
                }
                let (mut low, mut high) = (0.0, reach);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if value(middle) > 0.0 { low = middle } else { high = middle }
                }
                self.seed(sub.low + sub.size * (p + direction * high), found);
                break;
            }
        }
        Critic::Said
    }

    /// Whether the cell is a valley (or crest) whose floor decides: the second derivative across it keeps its sign.
    pub(super) fn ridge(&self, sub: &Sub, contact: f64, found: &mut Findings) -> bool {
        let v = sub.g.eval(0.5, 0.5);
        let angle = 0.5 * (2.0 * v.h[1]).atan2(v.h[0] - v.h[2]);
        let mut e = DVec2::from_angle(angle);
        let curvature = |e: DVec2, h: [f64; 3]| e.x * e.x * h[0] + 2.0 * e.x * e.y * h[1] + e.y * e.y * h[2];
        if curvature(e.perp(), v.h).abs() > curvature(e, v.h).abs() {
            e = e.perp();
        }
        let [xx, xy, yy] = sub.g.hessian_range();
        let (cx, cy, cxy) = (e.x * e.x, e.y * e.y, 2.0 * e.x * e.y);
        let pick = |r: [f64; 2], c: f64| if c >= 0.0 { [r[0] * c, r[1] * c] } else { [r[1] * c, r[0] * c] };
        let parts = [pick(xx, cx), pick(xy, cxy), pick(yy, cy)];
        let slack = 6000.0 * self.error * sub.size.max_element().powi(2);
        let least = parts.iter().map(|r| r[0]).sum::<f64>() - slack;
        let most = parts.iter().map(|r| r[1]).sum::<f64>() + slack;
        if !(least > 0.0 || most < 0.0) {
            return false;
        }
        let upward = if least > 0.0 { 1.0 } else { -1.0 };
        let (mut inside, mut values) = (Vec::new(), Vec::new());
        for k in -6..=6 {
            let mut p = DVec2::splat(0.5) + e.perp() * (f64::from(k) * 0.12);
            let mut settled = false;
            for _ in 0..12 {
                let v = sub.g.eval(p.x, p.y);
                let step = (v.d[0] * e.x + v.d[1] * e.y) / curvature(e, v.h);
                p -= e * step.clamp(-0.5, 0.5);
                if (p - 0.5).abs().max_element() > 1.5 {
                    break;
                }
                if step.abs() < 1e-9 {
                    settled = true;
                    break;
                }
            }
            if settled && p.min_element() > -0.05 && p.max_element() < 1.05 {
                inside.push(p);
                values.push(sub.g.value(p.x, p.y) * upward);
            }
        }
        let limit = contact + self.error;
        let (min, max) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let small = sub.size.max_element() < 1.0 / 64.0;
        if values.is_empty() {
            // No floor inside: the zero set is a graph across e, but a sample may have missed the floor.
            if !small {
                return false;
            }
            self.border_seeds(sub, found);
            return true;
        }
        if min >= -limit && max <= limit {
            // From the middle outwards, the first place that lies on B.
            let mut order: Vec<usize> = (0..inside.len()).collect();
            order.sort_by_key(|&k| k.abs_diff(inside.len() / 2));
            let places = order.into_iter().map(|k| self.pair(sub.low + sub.size * inside[k]));
            let on_b = |at: &PointPair| at.st.min_element() >= -SLACK && at.st.max_element() <= 1.0 + SLACK;
            found.ridges.extend(places.into_iter().find(on_b).map(|at| Seed { pa: self.pa, pb: self.pb, at }));
            return true;
        }
        if min > limit && min > 0.5 * max {
            return true;
        }
        if max < -limit && max < 0.5 * min {
            self.border_seeds(sub, found);
            return true;
        }
        false
    }
}
