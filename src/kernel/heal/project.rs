//! Samples onto the originals along their segments a-b, HJR99 3.3 and (8)-(10).
//!
//! All hits are on surface and segment (see [`crate::kernel::mesh::surface_set`]); the one nearest to x counts.

use glam::{DVec2, DVec3};

use super::slab;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};

/// What became of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// One original was hit.
    Hit,
    /// Several were hit, the nearest counts.
    Several,
    /// None was hit: the point was made by Hardy's method (a gap).
    Artificial,
    /// A boundary sample that stays on its picked curve, away from the originals.
    Kept,
}

impl Status {
    /// Whether the sample lies on an original.
    pub fn is_projected(self) -> bool {
        matches!(self, Self::Hit | Self::Several)
    }
}

/// A sample after projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// y (projected, kept) or z (artificial).
    pub point: DVec3,
    /// What it is.
    pub status: Status,
    /// t of (10): the place on the segment, 0 at a, 1 at b, 1/2 at x.
    pub t: f64,
    /// The original and its parameters, of projected samples.
    pub on: Option<(usize, DVec2)>,
}

/// Projects x along n within the distance d. `None` when nothing is hit.
pub fn project(set: &SurfaceSet, x: DVec3, n: DVec3, d: f64, scratch: &mut Scratch) -> Option<Sample> {
    let [a, b] = slab::segment(x, n, d);
    if a == b {
        return None;
    }
    let hits = set.segment(a, b, scratch);
    // Equal distances on both sides go to the first, which is on the side of the normal.
    let nearest = hits.iter().min_by(|p, q| (p.t - 0.5).abs().total_cmp(&(q.t - 0.5).abs()))?;
    let status = if hits.len() > 1 { Status::Several } else { Status::Hit };
    Some(Sample { point: nearest.point, status, t: nearest.t, on: Some((nearest.surface, nearest.uv)) })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::Surface;
    use crate::kernel::job::Job;

    #[test]
    fn the_hit_nearest_to_x_counts_and_misses_are_misses() {
        let plane = |z: f64| {
            let c = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, z));
            Arc::new(Surface::bilinear(c).unwrap())
        };
        let set = SurfaceSet::new(vec![(0, plane(0.3)), (1, plane(-0.2))], 1e-4, &Job::new());
        let mut scratch = Scratch::default();
        let x = DVec3::new(0.4, 0.6, 0.0);
        let s = project(&set, x, DVec3::Z, 0.5, &mut scratch).unwrap();
        assert_eq!((s.status, s.on.unwrap().0), (Status::Several, 1));
        assert!((s.t - 0.7).abs() < 1e-15 && (s.point.z + 0.2).abs() < 1e-15);
        let s = project(&set, x, DVec3::Z, 0.25, &mut scratch).unwrap();
        assert_eq!((s.status, s.on.unwrap().0), (Status::Hit, 1));
        assert!(project(&set, x, DVec3::Z, 0.1, &mut scratch).is_none());
        assert!(project(&set, x + DVec3::X, DVec3::Z, 0.5, &mut scratch).is_none());
        assert!(project(&set, x, DVec3::ZERO, 0.5, &mut scratch).is_none());
    }
}
