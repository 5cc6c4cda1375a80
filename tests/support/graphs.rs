//! Spline graphs whose heights come from a fixed sequence, for tests and benchmarks.

use glam::DVec3;
use patchwright::kernel::geom::{Knots, Surface};

/// A bicubic spline graph of `n` x `n` spans whose heights come from a fixed sequence.
pub fn spline_graph(n: usize, seed: u64, border: f64) -> Option<Surface> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state ^ (state >> 29)) >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    };
    let size = n as f64;
    let breaks: Vec<f64> = (0..=n).map(|k| -border + (size + 2.0 * border) * k as f64 / size).collect();
    let knots = Knots::clamped(3, &breaks, 1).ok()?;
    let at = knots.greville();
    let places = at.iter().flat_map(|&y| at.iter().map(move |&x| (x, y)));
    let points = places.map(|(x, y)| DVec3::new(x, y, 0.85 * random())).collect();
    Surface::new(knots.clone(), knots, points, None).ok()
}
