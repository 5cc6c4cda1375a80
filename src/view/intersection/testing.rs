//! Small models for the tests of this folder.
#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::sync::Arc;

use glam::DVec3;

use super::{Found, Picks, Task, compute::Request, compute::compute};
use crate::kernel::geom::{Knots, Surface};
use crate::kernel::job::Job;
use crate::model::document::{Document, Shape, Unit};

/// The square of half size 1 in a plane with these two directions.
pub fn square(center: DVec3, u: DVec3, v: DVec3) -> Surface {
    Surface::bilinear([center - u - v, center + u - v, center - u + v, center + u + v]).unwrap()
}

/// z = f(x, y) for f of degree 2 over [-1, 1]^2, from its values at -1, 0, 1.
pub fn graph(f: impl Fn(f64, f64) -> f64) -> Surface {
    let knots = || Knots::bezier(2, -1.0, 1.0).unwrap();
    // The middle control value of a quadratic through a, b, c is 2 b - (a + c) / 2.
    let middle = |[a, b, c]: [f64; 3]| [a, 2.0 * b - 0.5 * (a + c), c];
    let rows = [-1.0, 0.0, 1.0].map(|y| middle([-1.0, 0.0, 1.0].map(|x| f(x, y))));
    let mut points = Vec::new();
    let columns: [[f64; 3]; 3] = std::array::from_fn(|i| middle([rows[0][i], rows[1][i], rows[2][i]]));
    for j in 0..3 {
        for (i, column) in columns.iter().enumerate() {
            points.push(DVec3::new(i as f64 - 1.0, j as f64 - 1.0, column[j]));
        }
    }
    Surface::new(knots(), knots(), points, None).unwrap()
}

/// A document of surfaces.
pub fn document(surfaces: impl IntoIterator<Item = Surface>) -> Document {
    let mut document = Document::new(Unit::Millimetre);
    for (k, surface) in surfaces.into_iter().enumerate() {
        document.add(format!("surface {k}"), Shape::Surface(Arc::new(surface)), None);
    }
    document
}

/// Two squares that cross along the x axis.
pub fn two_planes() -> Document {
    document([square(DVec3::ZERO, DVec3::X, DVec3::Y), square(DVec3::ZERO, DVec3::X, DVec3::Z)])
}

/// The first surface with the second.
pub fn met(document: &Document) -> Found {
    let ids: Vec<_> = document.entities().iter().map(|e| e.id).collect();
    let mut picks = Picks::new(Task::Sets, &[]);
    picks.click(ids[0], false);
    picks.click(ids[1], false);
    let request = Request::new(&picks, document).unwrap();
    compute(&request, &Job::new()).unwrap()
}
