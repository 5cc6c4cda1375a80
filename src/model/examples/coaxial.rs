//! Two nearly coaxial cylinders of equal radius (thesis 8.2, Table 8.4, Figs 8.3 and 8.4), whose angle a slider changes.
//!
//! The axes cross in the middle at an angle theta, so the cylinders meet in two ellipses in the planes that bisect the
//! axes, for every theta; the ellipses cross at (1, 0, 0) and (-1, 0, 0). The thesis does not give the length.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::kernel::geom::{Knots, Surface};
use crate::model::document::{Document, EntityId, Shape, Unit};

/// The name of the example.
pub const NAME: &str = "nearly_coaxial_cylinders";
/// What it shows.
pub const ABOUT: &str = "Thesis Figs 8.3 and 8.4: two cylinders at an angle that a slider changes";
/// The angle it starts with, in degrees.
pub const START: f64 = 1.0;
/// The smallest and the largest angle of the slider, in degrees.
pub const RANGE: [f64; 2] = [1e-5, 10.0];

const NAMES: [&str; 2] = ["coaxial cylinder", "turned cylinder"];
const RADIUS: f64 = 1.0;
const HALF_LENGTH: f64 = 3.0;

/// The model at the angle it starts with.
pub fn document() -> Document {
    let mut document = Document::new(Unit::Metre);
    for (name, degrees) in NAMES.into_iter().zip([0.0, START]) {
        if let Some(surface) = cylinder(degrees) {
            document.add(name, Shape::Surface(Arc::new(surface)), None);
        }
    }
    document
}

/// Whether a document is this example.
pub fn is_demo(document: &Document) -> bool {
    let names: Vec<&str> = document.entities().iter().map(|e| e.name.as_str()).collect();
    names.starts_with(&NAMES) && document.surfaces().count() >= 2
}

/// The angle between the axes, in degrees.
pub fn angle(document: &Document) -> Option<f64> {
    if !is_demo(document) {
        return None;
    }
    let mut axes = document.surfaces().map(|(_, s)| axis(s));
    let (a, b) = (axes.next()?, axes.next()?);
    // The sine keeps its digits where the cosine has none.
    Some(a.cross(b).length().atan2(a.dot(b)).to_degrees())
}

/// The second cylinder at another angle, with its entity.
pub fn turned(document: &Document, degrees: f64) -> Option<(EntityId, Surface)> {
    let (id, _) = document.surfaces().nth(1).filter(|_| is_demo(document))?;
    Some((id, cylinder(degrees.clamp(RANGE[0], RANGE[1]))?))
}

/// A cylinder about the z axis turned about the x axis: nine rational points around, straight along.
fn cylinder(degrees: f64) -> Option<Surface> {
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let around = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for z in [-HALF_LENGTH, HALF_LENGTH] {
        for (k, &(x, y)) in around.iter().enumerate() {
            points.push(DVec3::new(RADIUS * f64::from(x), RADIUS * f64::from(y), z));
            weights.push(if k % 2 == 1 { w } else { 1.0 });
        }
    }
    let circle = Knots::clamped(2, &[0.0, 0.25, 0.5, 0.75, 1.0], 2).ok()?;
    let straight = Knots::bezier(1, 0.0, 1.0).ok()?;
    let surface = Surface::new(circle, straight, points, Some(weights)).ok()?;
    Some(surface.transformed(&DAffine3::from_rotation_x(degrees.to_radians())))
}

/// From the middle of the first rim to that of the second.
fn axis(surface: &Surface) -> DVec3 {
    let [nu, nv] = surface.counts();
    // Every second point of the first four pairs lies on the circle; opposite ones have its middle between them.
    let middle = |j: usize| 0.5 * (surface.point(0, j) + surface.point(4.min(nu - 1), j));
    middle(nv - 1) - middle(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::job::Job;
    use crate::kernel::ssi::result::JunctionKind;
    use crate::kernel::ssi::{SsiOptions, intersect};

    #[test]
    fn the_slider_reads_back_the_angle_it_set() {
        let document = document();
        assert!(is_demo(&document) && !is_demo(&Document::default()));
        assert!((angle(&document).unwrap() - START).abs() < 1e-12);
        for degrees in [10.0, 0.3, 1e-3, 1e-5] {
            let (id, surface) = turned(&document, degrees).unwrap();
            let mut next = document.clone();
            next.edit(id, |e| e.shape = Shape::Surface(Arc::new(surface)));
            assert!((angle(&next).unwrap() / degrees - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn two_ellipses_cross_at_two_points_for_every_angle() {
        for degrees in [1.0, 1e-3] {
            let (a, b) = (cylinder(0.0).unwrap(), cylinder(degrees).unwrap());
            let found = intersect(&[(0, &a)], &[(1, &b)], &SsiOptions::default(), &Job::new()).unwrap();
            assert!(found.complete);
            let crossings: Vec<_> = found.junctions.iter().filter(|j| j.kind == JunctionKind::X).collect();
            assert_eq!(crossings.len(), 2, "{degrees}");
            for j in crossings {
                assert!((j.xyz.abs() - DVec3::X).length() < 1e-6 / degrees.to_radians() * 1e-6 + 1e-7, "{}", j.xyz);
            }
        }
    }
}
