//! Level of detail: how fine the triangles and lines of an item have to be in a view.

use glam::DVec2;

use super::display::Extent;
use super::scene::Item;
use super::viewport::View;
use crate::kernel::mesh::tri_tree::first_hit;

/// How far triangles and lines may be from the truth, in pixels.
pub(super) const PIXELS: f64 = 0.3;
/// How many vertices are looked at to see how large an item is in the picture.
const VERTICES: usize = 1000;

/// The smallest pixel on what the picture shows of an item: infinite when it shows nothing. The box alone says how small
/// it could be; where that is too pessimistic (the eye is inside the box), the present triangles say how small
/// it is, by their vertices in or near the picture and by nine lines of sight.
pub(super) fn smallest_pixel(item: &Item, view: &View) -> f64 {
    let by_box = view.pixel_size_in(&item.bounds);
    let Some(display) = item.display.as_ref().filter(|d| d.chord_tol > PIXELS * by_box && !d.mesh.points.is_empty())
    else {
        return by_box;
    };
    let size = DVec2::new(view.viewport.width, view.viewport.height);
    let step = display.mesh.points.len().div_ceil(VERTICES);
    let seen = display.mesh.points.iter().step_by(step).filter_map(|&p| {
        let at = view.project(p).filter(|at| at.depth >= view.near)?;
        let inside = at.pixel.cmpge(-0.5 * size).all() && at.pixel.cmple(1.5 * size).all();
        inside.then_some(at.depth)
    });
    let hit = (0..9).filter_map(|k| {
        let pixel = size * DVec2::new(f64::from(k % 3), f64::from(k / 3)) * 0.5;
        let ray = view.ray(pixel);
        let t = match display.extent {
            Extent::All => display.tree.first_hit(ray.origin, ray.direction, f64::INFINITY)?.t,
            _ => first_hit(&display.mesh.points, &display.mesh.triangles, ray.origin, ray.direction)?,
        };
        Some(view.depth(ray.at(t)))
    });
    let depth = seen.chain(hit).fold(f64::INFINITY, f64::min);
    if depth == f64::INFINITY { f64::INFINITY } else { view.pixel_size_at(depth).max(by_box) }
}

/// The next smaller power of four.
pub(super) fn level(tol: f64) -> f64 {
    4.0_f64.powf(tol.log(4.0).floor())
}
