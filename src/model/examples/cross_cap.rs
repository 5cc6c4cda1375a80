//! A cross-cap: the surface (x, x y, y^2 + x^2 / 4 + x^3 / 25), which meets itself along the half line (0, 0, t^2), t > 0, and whose
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

/// Over [-1, 1]^2; of degrees 3 and 2, so that it is exact. Without the cubic term the sections at the parabolic tilts
/// would be straight lines that count twice.
fn surface() -> Option<Surface> {
    // Control values over [-1, 1]: of x, x^2, x^3 in degree 3, of y and y^2 in degree 2.
    let x = [[-1.0, 1.0, -1.0], [-1.0 / 3.0, -1.0 / 3.0, 1.0], [1.0 / 3.0, -1.0 / 3.0, -1.0], [1.0; 3]];
    let y = [[-1.0, 1.0], [0.0, -1.0], [1.0; 2]];
    let points = (0..12).map(|k| {
        let ([x, xx, xxx], [y, yy]) = (x[k % 4], y[k / 4]);
        DVec3::new(x, x * y, yy + 0.25 * xx + 0.04 * xxx)
    });
    let [u, v] = [Knots::bezier(3, -1.0, 1.0).ok()?, Knots::bezier(2, -1.0, 1.0).ok()?];
    Surface::new(u, v, points.collect(), None).ok()
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn it_is_the_formula_and_meets_itself_on_the_axis() {
        let s = surface().unwrap();
        for (x, y) in [(0.3, -0.8), (-1.0, 0.5), (0.0, 0.9)] {
            assert!(
                s.eval(DVec2::new(x, y)).distance(DVec3::new(x, x * y, y * y + 0.25 * x * x + 0.04 * x.powi(3)))
                    < 1e-14
            );
        }
        assert!(s.eval(DVec2::new(0.0, 0.6)).distance(s.eval(DVec2::new(0.0, -0.6))) < 1e-14);
    }
}
