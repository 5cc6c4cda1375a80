//! A cross-cap: the surface (x, x y, y^2 + x^2 / 4), which meets itself along the half line (0, 0, t^2), t > 0, and whose
//! miter point is the origin. Planes through it show the three types of sections of thesis Fig. 8.8.

use std::sync::Arc;

use glam::DVec3;

use crate::kernel::geom::{Knots, Surface};
use crate::model::document::{Document, Shape, Unit};

/// The name of the example.
pub const NAME: &str = "cross_cap";
/// What it shows.
pub const ABOUT: &str = "Thesis Fig. 8.8: a surface that meets itself along a curve with a miter point";

/// The model.
pub fn document() -> Document {
    let mut document = Document::new(Unit::Metre);
    if let Some(surface) = surface() {
        document.add("cross-cap", Shape::Surface(Arc::new(surface)), None);
    }
    document
}

/// Over [-1, 1]^2; biquadratic, so that it is exact.
fn surface() -> Option<Surface> {
    // Polar values of x, y, x y, x^2 and y^2 at the ends and the middle of [-1, 1].
    let line = [-1.0, 0.0, 1.0];
    let square = [1.0, -1.0, 1.0];
    let points = (0..9).map(|k| {
        let (i, j) = (k % 3, k / 3);
        DVec3::new(line[i], line[i] * line[j], square[j] + 0.25 * square[i])
    });
    let knots = Knots::bezier(2, -1.0, 1.0).ok()?;
    Surface::new(knots.clone(), knots, points.collect(), None).ok()
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn it_is_the_formula_and_meets_itself_on_the_axis() {
        let s = surface().unwrap();
        for (x, y) in [(0.3, -0.8), (-1.0, 0.5), (0.0, 0.9)] {
            assert!(s.eval(DVec2::new(x, y)).distance(DVec3::new(x, x * y, y * y + 0.25 * x * x)) < 1e-14);
        }
        assert!(s.eval(DVec2::new(0.0, 0.6)).distance(s.eval(DVec2::new(0.0, -0.6))) < 1e-14);
    }
}
