//! A small model for the tests: nine unit tiles in the plane z = 0 without the middle one.

use std::sync::Arc;

use glam::DVec3;

use crate::kernel::geom::{Aabb, Surface};
use crate::model::document::{Document, Shape, Unit};
use crate::view::camera::{Axis, Camera};
use crate::view::scene::Scene;
use crate::view::viewport::{View, Viewport};

/// The length of a tile's side.
pub(super) const TILE: f64 = 1.0;

/// The document and its scene with displays. Tiles 0, 1, 2 are the row y = 0; 3 and 4 stand left and right of the hole;
/// 5, 6, 7 are the row y = 2.
pub(super) fn tiles() -> (Document, Scene) {
    let mut document = Document::new(Unit::Millimetre);
    for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
        let corner = |i: i32, j: i32| DVec3::new(f64::from(x + i), f64::from(y + j), 0.0) * TILE;
        let surface = Surface::bilinear([corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)]).unwrap();
        document.add(format!("tile {x} {y}"), Shape::Surface(Arc::new(surface)), None);
    }
    (document.clone(), scene_of(&document))
}

/// The scene of a document, seen from above.
pub(super) fn scene_of(document: &Document) -> Scene {
    let mut scene = Scene::default();
    scene.sync(document);
    let mut camera = Camera::default();
    camera.look_along(Axis::Top);
    let viewport = Viewport::new(800.0, 600.0);
    camera.frame(&scene.bounds(), viewport);
    scene.refine(&View::new(&camera, viewport, &Aabb::EMPTY));
    scene
}
