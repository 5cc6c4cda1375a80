//! The box of influence: offset points a, b of HJR99 (6), their distance d (7), and the box clip of 3.3.
//!
//! The box around all a and b stands for their convex hull. Surfaces that miss it are left out before they are
//! tessellated. Triangles need no clipping against it: the segments a-b lie inside, so a hit does too.

use glam::DVec3;

use super::grid::Grid;
use crate::kernel::geom::Aabb;
use crate::kernel::mesh::body::Body;

/// HJR99 (7): an eighth of the sum of the corner chords.
pub fn default_distance(corners: [DVec3; 4]) -> f64 {
    (0..4).map(|k| corners[k].distance(corners[(k + 1) % 4])).sum::<f64>() / 8.0
}

/// HJR99 (6): the ends a = x + d n and b = x - d n of a sample's segment.
pub fn segment(x: DVec3, n: DVec3, d: f64) -> [DVec3; 2] {
    [x + n * d, x - n * d]
}

/// The box around all a and b.
pub fn influence(points: &Grid<DVec3>, normals: &Grid<DVec3>, d: f64) -> Aabb {
    Aabb::of(points.values().iter().zip(normals.values()).flat_map(|(&x, &n)| segment(x, n, d)))
}

/// The bodies whose control points or vertices reach into one of the boxes.
pub fn clip(bodies: &[(usize, Body)], boxes: &[Aabb]) -> Vec<(usize, Body)> {
    let reaches = |body: &Body| {
        let bounds = body.bounds();
        boxes.iter().any(|b| b.overlaps(&bounds))
    };
    bodies.iter().filter(|(_, s)| reaches(s)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::Surface;

    #[test]
    fn the_unit_square_has_half_a_unit_and_its_box_is_the_slab() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        assert_eq!(default_distance(corners), 0.5);
        let points = Grid::from_fn(3, 3, |i, j| DVec3::new(i as f64 / 3.0, j as f64 / 3.0, 0.0));
        let normals = points.map(|_| DVec3::Z);
        let b = influence(&points, &normals, 0.25);
        assert_eq!((b.min, b.max), (DVec3::new(0.0, 0.0, -0.25), DVec3::new(1.0, 1.0, 0.25)));
        let lifted = |z: f64| {
            let c = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)].map(|p| p + DVec3::Z * z);
            Body::from(Arc::new(Surface::bilinear(c).unwrap()))
        };
        let kept = clip(&[(0, lifted(0.2)), (1, lifted(0.3)), (2, lifted(-0.25))], &[b]);
        assert_eq!(kept.iter().map(|k| k.0).collect::<Vec<_>>(), [0, 2]);
    }
}
