//! Degenerate miter points: isolated ones, and those through which two branches pass (thesis 4.2.1).
//!
//! Where the miter system F(m, phi, 0) = 0 has a double zero, with kernel direction t in the domain, the third
//! derivative along the null direction leads out of the Jacobian's range: by (n, phi, rho = r^2), n across t, F is regular,
//! and every t has one solution with rho(t) = -(a / b) t^2 + ... A positive rho on one side is a branch there. Both
//! negative: isolated; both positive: two branches; one of each: one branch, which the thesis takes for isolated and which
//! is traced here. Two miter points closer than about 1e-6 to each other are one degenerate point to rounding.
//!
//! A window is settled by the test of cuspidal edges ([`super::cusp`]), with the signs of rho measured along t.

use glam::{DMat3, DVec2, DVec3};

use super::chart::near;
use super::cusp::{CuspNode, uniquely_solved};
use super::hull::Rect;
use super::miter::{MiterKind, MiterPoint, at, kernel};
use super::sheet::Sheet;
use crate::kernel::num::linear;

/// A degenerate zero: its place, the kernel direction in the domain, and on which sides of it a branch starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Double {
    pub node: CuspNode,
    pub along: DVec2,
    pub branches: [bool; 2],
}

impl Double {
    pub fn kind(&self) -> MiterKind {
        match self.branches {
            [false, false] => MiterKind::Isolated,
            _ => MiterKind::Degenerate(self.along, self.branches),
        }
    }
}

/// The double zero close to a zero whose Jacobian is nearly singular; `None` where two simple zeros are apart or zeros
/// form a curve.
pub(crate) fn polish(sheet: &Sheet, start: [f64; 3]) -> Option<Double> {
    let mut y = DVec3::from(start);
    let frame = |y: DVec3| {
        let value = at(sheet, y.into());
        (DMat3::from_cols(value.j[0], value.j[1], value.j[2]), value.f)
    };
    for _ in 0..12 {
        let (jacobian, f) = frame(y);
        let (n, w) = (kernel(&jacobian), kernel(&jacobian.transpose()));
        let (u, v) = w.any_orthonormal_pair();
        const STEP: f64 = 1e-5;
        let slope = |z: DVec3| w.dot(frame(z).0 * n);
        let by = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| (slope(y + e * STEP) - slope(y - e * STEP)) / (2.0 * STEP));
        let row = |a: DVec3| (jacobian.transpose() * a).to_array();
        let d = linear::solve([row(u), row(v), by], [-u.dot(f), -v.dot(f), -slope(y)])?;
        let d = DVec3::from(d);
        if d.length() > 0.05 {
            return None;
        }
        y += d;
        if d.length() < 1e-11 {
            break;
        }
    }
    let (jacobian, f) = frame(y);
    let size = jacobian.x_axis.length().max(jacobian.y_axis.length()).max(jacobian.z_axis.length());
    let along = kernel(&jacobian).truncate();
    if f.length() > 1e-11 * size || along.length() < 1e-3 || y.distance(start.into()) > 0.02 {
        return None;
    }
    let node = CuspNode { at: y.truncate(), phi: y.z };
    let along = along.normalize();
    let side = |sign: f64| {
        let found = [1e-3, 4e-3, 1.6e-2].map(|t| beside(sheet, node, along, sign * t).map(|s| s.rho / (t * t)));
        let [a, b, c] = [found[0]?, found[1]?, found[2]?];
        let sure = a.abs() > 1e-4 && (a > 0.0) == (b > 0.0) && (a > 0.0) == (c > 0.0);
        sure.then_some(a > 0.0)
    };
    Some(Double { node, along, branches: [side(1.0)?, side(-1.0)?] })
}

/// The solution at a distance along the kernel direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside {
    pub at: DVec2,
    pub phi: f64,
    /// The square of half the distance of the two points, to leading order; negative where there are none.
    pub rho: f64,
}

/// Newton on F(m, phi, 0) + rho D^3 S / 6 = 0 with the distance `t` along the kernel direction held.
pub(crate) fn beside(sheet: &Sheet, node: CuspNode, along: DVec2, t: f64) -> Option<Beside> {
    const REACH: f64 = 1e-2;
    let third = (near(sheet, node.at, node.phi, REACH).f - near(sheet, node.at, node.phi, 0.0).f) / (REACH * REACH);
    let across = along.perp();
    let (mut s, mut phi, mut rho) = (0.0, node.phi, 0.0);
    for _ in 0..20 {
        let value = near(sheet, node.at + along * t + across * s, phi, 0.0);
        let f = value.f + third * rho;
        let columns = [value.j[0] * across.x + value.j[1] * across.y, value.j[2], third];
        let rows = [0, 1, 2].map(|k| columns.map(|c| c[k]));
        let d = linear::solve(rows, [-f.x, -f.y, -f.z])?;
        (s, phi, rho) = (s + d[0], phi + d[1], rho + d[2]);
        if d[0].abs().max(d[1].abs()) < 1e-14 {
            break;
        }
    }
    (s.abs() <= t.abs() && (phi - node.phi).abs() < 0.5).then_some(Beside {
        at: node.at + along * t + across * s,
        phi,
        rho,
    })
}

/// Whether a window holds a degenerate miter point and its branches only.
pub(crate) fn settled(sheet: &Sheet, rect: &Rect, miter: &MiterPoint) -> bool {
    let (along, branches) = match miter.kind {
        MiterKind::Degenerate(along, branches) => (along, branches),
        MiterKind::Isolated => (miter.along, [false; 2]),
        MiterKind::CrossCap => return false,
    };
    let node = CuspNode { at: miter.at, phi: miter.phi };
    let window = rect.union(&Rect::new(node.at, node.at)).grown(0.05);
    if !uniquely_solved(sheet, &window, &window.grown(1.0), node, along.perp()) {
        return false;
    }
    let corners =
        [window.low, window.high, DVec2::new(window.low.x, window.high.y), DVec2::new(window.high.x, window.low.y)];
    let reach = corners.iter().map(|c| along.dot(*c - node.at).abs()).fold(0.0, f64::max);
    // Closer to the point than 1e-4 rounding decides; the leading term was measured when the point was found.
    [0.1, 0.3, 0.6, 1.0].into_iter().map(|x| x * reach).filter(|t| *t > 1e-4).all(|t| {
        (0..2).all(|k| {
            let found = beside(sheet, node, along, if k == 0 { t } else { -t });
            found.is_some_and(|s| (s.rho > 0.0) == branches[k])
        })
    })
}
