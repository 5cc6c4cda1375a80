//! The gap between two surfaces as a field on one of them, and the magnitude of Su x Sv as another.
//!
//! The eye cannot judge a gap of 1e-4 of the model: colours go in steps of a factor of ten from a floor up, blue where
//! the surface lies below the other and red where above, and the shaded mesh may be drawn with its gap exaggerated.
//! The gap is the distance to the true closest point with the sign of (A - B) . n, n the normal of A, as in the kernel
//! (ALGORITHMS 4); where the other surface lies sideways or far away there is no gap and the field has a hole. |Su x
//! Sv| vanishes at miter points, cusps and poles.

use std::sync::Arc;

use glam::DVec3;

use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::SurfaceSet;
use crate::kernel::mesh::tessellate::{SurfaceMesh, tessellate_on};
use crate::view::deviation::deviation;

/// Grid lines of the field along each direction: for each span, at least, at most.
const LINES: [usize; 3] = [8, 64, 160];
/// Beyond this fraction of the size of the model nothing is a gap.
const FAR: f64 = 0.25;
/// Chord tolerance of the other side's tessellation, as a fraction of the size; feet are exact whatever it is.
const CHORD: f64 = 1e-4;
/// What is exaggerated is moved by at most this fraction of the size.
const MOST_MOVED: f64 = 0.1;

/// A field over a surface.
#[derive(Clone, Debug, Default)]
pub struct FieldMesh {
    /// The surface's number.
    pub number: usize,
    /// Its triangles.
    pub mesh: SurfaceMesh,
    /// One number for each vertex; NaN where there is none.
    pub values: Vec<f64>,
}

impl FieldMesh {
    /// The largest magnitude; 0 when there is no value.
    pub fn largest(&self) -> f64 {
        self.values.iter().filter(|v| v.is_finite()).fold(0.0, |m, v| m.max(v.abs()))
    }

    /// The vertices, each moved along its normal so that its gap looks `factor` times as large; by `size` times a tenth
    /// at most. Also how many were held back by that limit.
    pub fn exaggerated(&self, factor: f64, size: f64) -> (Vec<DVec3>, usize) {
        let limit = MOST_MOVED * size;
        let mut held = 0;
        let points = self.mesh.points.iter().zip(&self.mesh.normals).zip(&self.values).map(|((p, n), v)| {
            let by = if v.is_finite() { (factor - 1.0) * v } else { 0.0 };
            held += usize::from(by.abs() > limit);
            *p + *n * by.clamp(-limit, limit)
        });
        let points = points.collect();
        (points, held)
    }
}

fn grid(surface: &Surface) -> SurfaceMesh {
    let [per_span, least, most] = LINES;
    let lines = [0, 1].map(|k| {
        let breaks = surface.knots()[k].breaks();
        let spans = breaks.len() - 1;
        // Whole parts of spans: knots are grid lines, so that no crease is cut across.
        let parts = per_span.max(least.div_ceil(spans)).min((most / spans).max(1));
        let mut line: Vec<f64> = breaks
            .windows(2)
            .flat_map(|b| (0..parts).map(move |i| b[0] + (b[1] - b[0]) * i as f64 / parts as f64))
            .collect();
        line.push(breaks[spans]);
        line
    });
    tessellate_on(surface, lines, false)
}

/// The gap of each of the surfaces `of` to the surfaces `to`. A cancelled job leaves out what was not done.
pub fn gaps(of: &[(usize, Arc<Surface>)], to: &[(usize, Arc<Surface>)], size: f64, job: &Job) -> Vec<FieldMesh> {
    job.phase("Measuring the gap");
    let set = SurfaceSet::new(to.to_vec(), CHORD * size, job);
    let mut out = Vec::new();
    for (done, (number, surface)) in of.iter().enumerate() {
        if job.is_cancelled() {
            break;
        }
        let mesh = grid(surface);
        let measured = deviation(&mesh, &set, FAR * size, 1e-9 * size, job);
        let values = measured.values.iter().map(|&v| f64::from(v)).collect();
        out.push(FieldMesh { number: *number, mesh, values });
        job.progress((done + 1) as f64 / of.len() as f64);
    }
    out
}

/// |Su x Sv| over surfaces, as a fraction of the largest on the surface.
pub fn area_elements(of: &[(usize, Arc<Surface>)], job: &Job) -> Vec<FieldMesh> {
    let mut out = Vec::new();
    for (number, surface) in of {
        if job.is_cancelled() {
            break;
        }
        let mesh = grid(surface);
        let raw: Vec<f64> = mesh.uv.iter().map(|&uv| surface.jet(uv, 1).cross().length()).collect();
        let most = raw.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        out.push(FieldMesh { number: *number, mesh, values: raw.into_iter().map(|v| v / most).collect() });
    }
    out
}

/// Steps of a factor of ten from a floor to a top, on both sides of zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogScale {
    /// The largest magnitude with a colour: a power of ten.
    pub top: f64,
    /// How many powers of ten below it have colours of their own.
    pub decades: usize,
}

impl LogScale {
    /// The scale that holds magnitudes up to `largest`.
    pub fn fitting(largest: f64, decades: usize) -> Self {
        let top =
            if largest > 0.0 && largest.is_finite() { 10.0_f64.powf((largest.log10() - 1e-9).ceil()) } else { 1.0 };
        Self { top, decades: decades.clamp(1, 15) }
    }

    /// Magnitudes below it count as zero.
    pub fn floor(&self) -> f64 {
        self.top * 10.0_f64.powi(-(self.decades as i32))
    }

    /// Where a value is on the scale: from -decades to decades, 0 below the floor.
    pub fn place(&self, value: f64) -> f64 {
        if value.is_nan() {
            return f64::NAN;
        }
        let steps = (value.abs() / self.floor()).log10().max(0.0);
        steps.copysign(value)
    }

    /// The magnitudes at which steps end, from the floor to the top.
    pub fn borders(&self) -> Vec<f64> {
        (0..=self.decades).map(|k| self.top * 10.0_f64.powi(k as i32 - self.decades as i32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::intersection::testing::{graph, square};

    #[test]
    fn the_gap_over_a_plane_is_the_height() {
        let bowl = Arc::new(graph(|x, y| 1e-4 * (x * x + y * y) - 5e-5));
        let floor = Arc::new(square(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0));
        let field = &gaps(&[(0, bowl)], &[(1, floor)], 4.0, &Job::new())[0];
        assert_eq!(field.values.len(), field.mesh.points.len());
        for (p, v) in field.mesh.points.iter().zip(&field.values) {
            assert!((p.z - v).abs() < 1e-7 * 1e-4, "{} {v}", p.z);
        }
        assert!((field.largest() - 1.5e-4).abs() < 1e-9);
        let (moved, held) = field.exaggerated(1000.0, 4.0);
        assert_eq!(held, 0);
        for (p, q) in field.mesh.points.iter().zip(&moved) {
            // The normal leans by 2e-4 at most, so the height grows by the factor but for 1e-7 of it.
            assert!((q.z - 1000.0 * p.z).abs() < 1e-7, "{p} {q}");
        }
        assert!(field.exaggerated(1e9, 4.0).1 > 0, "the limit is counted");
    }

    #[test]
    fn where_there_is_nothing_below_there_is_no_gap() {
        let wide = Arc::new(square(DVec3::ZERO, DVec3::X, DVec3::Y));
        let narrow = Arc::new(square(DVec3::Z * 0.01, DVec3::X * 0.3, DVec3::Y * 0.3));
        let field = &gaps(&[(0, wide)], &[(1, narrow)], 2.0, &Job::new())[0];
        for (p, v) in field.mesh.points.iter().zip(&field.values) {
            let over = p.x.abs() <= 0.3 && p.y.abs() <= 0.3;
            assert!(!over || (v + 0.01).abs() < 1e-9, "{p} {v}");
            assert!(over || p.x.abs().max(p.y.abs()) < 0.32 || v.is_nan(), "{p} {v}");
        }
    }

    #[test]
    fn steps_are_powers_of_ten_and_mirror_each_other() {
        let scale = LogScale::fitting(3.2e-4, 6);
        assert!((scale.top - 1e-3).abs() < 1e-15 && (scale.floor() / 1e-9 - 1.0).abs() < 1e-9);
        for (v, place) in [(1e-3, 6.0), (1e-6, 3.0), (1e-9, 0.0), (1e-12, 0.0), (-1e-4, -5.0)] {
            assert!((scale.place(v) - place).abs() < 1e-9, "{v}");
        }
        assert!(scale.place(f64::NAN).is_nan());
        assert_eq!(scale.borders().len(), 7);
        assert_eq!(LogScale::fitting(1e-3, 6).top, 1e-3, "a power of ten holds itself");
    }

    #[test]
    fn the_area_element_of_a_collapsed_edge_vanishes_there() {
        let surface =
            Arc::new(Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y]).unwrap_or_else(|_| unreachable!()));
        let field = &area_elements(&[(3, surface)], &Job::new())[0];
        assert_eq!(field.number, 3);
        for (uv, v) in field.mesh.uv.iter().zip(&field.values) {
            assert!((v - (1.0 - uv.y)).abs() < 1e-12);
        }
    }
}
