//! Measures that share nothing with the kernel's own.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use glam::{DVec2, DVec3};
use patchwright::kernel::geom::Surface;

/// The distance of a point to a surface near given parameters, by projection steps.
pub fn distance(s: &Surface, p: DVec3, start: DVec2) -> f64 {
    let mut uv = start;
    for _ in 0..20 {
        let jet = s.jet(uv, 1);
        let r = p - jet.p();
        let (e, f, g) = (jet.u().length_squared(), jet.u().dot(jet.v()), jet.v().length_squared());
        let det = e * g - f * f;
        if det <= 0.0 {
            break;
        }
        let (x, y) = (jet.u().dot(r), jet.v().dot(r));
        uv = s.clamped(uv + DVec2::new(g * x - f * y, e * y - f * x) / det);
    }
    s.eval(uv).distance(p)
}
