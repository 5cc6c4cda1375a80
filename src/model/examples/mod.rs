//! The bundled example models, made by formulas: the situations of HJR99 Figs 8 to 13, each with the patches that
//! heal it.
//!
//! `cargo run -- examples assets` writes them to `assets/` again; a test compares what is there with what comes
//! out here.

mod car;
pub mod coaxial;
pub mod cross_cap;
mod simple;
mod wing;

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use super::document::{Document, Shape, Unit};
use super::spec::{BoundaryMode, HealSpec, IsoAt, PatchSpec, Piece};
use crate::kernel::geom::{Side, Surface};
use crate::kernel::heal::fit::{Twist, bezier_net, bezier_row, surface};
use crate::kernel::heal::grid::Grid;

/// A faulty model and what heals it.
#[derive(Clone, Debug)]
pub struct Example {
    /// The name of its files.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// The model.
    pub document: Document,
    /// The patches.
    pub spec: HealSpec,
}

/// All examples, the simplest first.
pub fn all() -> Vec<Example> {
    vec![
        simple::part_of_a_patch(),
        simple::surfaces_with_gap(),
        simple::intersecting_surfaces(),
        simple::oscillating_surfaces(),
        car::car_body(),
        wing::wing_body(),
    ]
}

/// A model that demonstrates something and has nothing to heal.
#[derive(Clone, Copy, Debug)]
pub struct Demo {
    /// Its name.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// Makes the model.
    pub document: fn() -> Document,
}

/// All demonstrations.
pub fn demos() -> [Demo; 2] {
    [
        Demo { name: coaxial::NAME, about: coaxial::ABOUT, document: coaxial::document },
        Demo { name: cross_cap::NAME, about: cross_cap::ABOUT, document: cross_cap::document },
    ]
}

/// A model under construction.
struct Builder {
    document: Document,
    surfaces: Vec<Arc<Surface>>,
}

/// What moves a sheet a little out of place.
fn shifted(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

impl Builder {
    fn new(unit: Unit) -> Self {
        Self { document: Document::new(unit), surfaces: Vec::new() }
    }

    /// Adds a surface and returns its number.
    fn add(&mut self, name: &str, surface: Surface) -> usize {
        let surface = Arc::new(surface);
        self.document.add(name, Shape::Surface(Arc::clone(&surface)), None);
        self.surfaces.push(surface);
        self.surfaces.len() - 1
    }

    /// Adds the C1 bicubic through (m + 1) x (n + 1) points of f over [0, 1]^2.
    fn sheet(&mut self, name: &str, size: [usize; 2], f: impl Fn(f64, f64) -> DVec3) -> usize {
        self.add(name, sheet(size, f))
    }

    /// The same with a rectangle left out: four surfaces, below, above, before and behind it (in v, v, u, u).
    fn with_hole(&mut self, name: &str, whole: &Surface, hole_u: [f64; 2], hole_v: [f64; 2]) -> [usize; 4] {
        let parts = [
            ("below", [0.0, 1.0], [0.0, hole_v[0]]),
            ("above", [0.0, 1.0], [hole_v[1], 1.0]),
            ("before", [0.0, hole_u[0]], hole_v),
            ("behind", [hole_u[1], 1.0], hole_v),
        ];
        parts.map(|(part, u, v)| {
            let piece = whole.restricted(u, v).unwrap_or_else(|_| whole.clone()); // the ranges are fixed and good
            self.add(&format!("{name} {part}"), piece)
        })
    }

    fn eval(&self, surface: usize, u: f64, v: f64) -> DVec3 {
        self.surfaces[surface].eval(DVec2::new(u, v))
    }

    fn finish(self, name: &'static str, about: &'static str, settings: Settings, patches: Vec<PatchSpec>) -> Example {
        let spec = HealSpec {
            joining_tol: Some(settings.joining_tol),
            tol: Some(settings.tol),
            slab: settings.slab,
            patches,
            ..HealSpec::default()
        };
        Example { name, about, document: self.document, spec }
    }
}

/// What a heal of an example works with.
struct Settings {
    joining_tol: f64,
    tol: f64,
    slab: Option<f64>,
}

/// The C1 bicubic through points of f over [0, 1]^2, rounded to 1e-9 so that every machine writes the same bytes.
fn sheet([m, n]: [usize; 2], f: impl Fn(f64, f64) -> DVec3) -> Surface {
    through(&Grid::from_fn(m, n, |i, j| f(i as f64 / m as f64, j as f64 / n as f64)))
}

fn through(points: &Grid<DVec3>) -> Surface {
    let (m, n) = (points.m(), points.n());
    let (bottom, top) = (bezier_row(points.row(0)), bezier_row(points.row(n)));
    let (left, right) = (bezier_row(&points.column(0)), bezier_row(&points.column(m)));
    let real = points.map(|_| true);
    let net = bezier_net(points, &real, [&bottom, &right, &top, &left], Twist::Scheme);
    let net = net.map(|p| (*p * 1e9).round() / 1e9);
    // The formulas are finite everywhere; a plane stands in for what cannot happen.
    surface(&net).unwrap_or_else(|_| through(&Grid::from_fn(2, 2, |i, j| DVec3::new(i as f64, j as f64, 0.0))))
}

fn iso_u(surface: usize, c: f64, from: f64, to: f64) -> Piece {
    Piece::Iso { surface, at: IsoAt::U(rounded(c)), from: rounded(from), to: rounded(to) }
}

fn iso_v(surface: usize, c: f64, from: f64, to: f64) -> Piece {
    Piece::Iso { surface, at: IsoAt::V(rounded(c)), from: rounded(from), to: rounded(to) }
}

fn edge(face: usize, side: Side) -> Piece {
    Piece::Edge { face, ring: 0, edge: side as usize, from: 0.0, to: 1.0 }
}

fn line(a: DVec3, b: DVec3) -> Piece {
    Piece::Line(tuple(a), tuple(b))
}

fn polyline(points: &[DVec3]) -> Piece {
    Piece::Polyline(points.iter().map(|&p| tuple(p)).collect())
}

fn rounded(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

fn tuple(p: DVec3) -> (f64, f64, f64) {
    (rounded(p.x), rounded(p.y), rounded(p.z))
}

fn patch(name: &str, sides: [Vec<Piece>; 4]) -> PatchSpec {
    PatchSpec { name: name.into(), sides, ..PatchSpec::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::job::Job;
    use crate::model::resolve::resolve;

    #[test]
    fn every_specification_fits_its_model() {
        for example in all() {
            let resolved = resolve(&example.spec, &example.document, &Job::new()).unwrap();
            assert_eq!(resolved.patches.len(), example.spec.patches.len(), "{}", example.name);
        }
    }
}
