//! A surface as triangles on a tensor grid that follows its knot spans (HJR99 3.3).
//!
//! Each knot span is cut evenly, into as many parts as keep the triangles within a chord tolerance of the
//! surface: over a cell of hu x hv a triangle errs by at most (hu^2 Muu + 2 hu hv Muv + hv^2 Mvv) / 8 (Filip,
//! Magedson and Markot, *Surface algorithms using bounds on derivatives*, 1986), where M bound the second
//! derivatives over the span. Polynomial pieces bound them by their control nets, which is rigorous; rational
//! pieces by samples, which is not, with a margin. One grid has no cracks: neighbours share vertices, a row
//! that collapses to a pole and the two sides of a closed seam get identical coordinates (but their own uv).
//!
//! What an adaptive triangulation would save, in cells for the same tolerance (1e-4 of each surface's diagonal, all polynomial
//! surfaces of a file, vertices on sides of neighbours not counted): parts of spans halved one by one, each in the direction
//! that bends more, 0.28 (airliner), 0.26 (nacelle), 0.41 (wing), 0.44 (car body), 0.50 (crossing patches of entity 114),
//! 0.58 (rear screen), 0.79 (headlamp), 0.8 to 0.9 (single smooth patches); halved in both directions at once (a quadtree)
//! 0.4 to 2.9; counts for each span with stitched borders 0.6 to 1.0. So direction matters, place hardly does. The grid stays
//! because its lines are iso-lines and knot lines of the display, and because the intersection of triangulations finds
//! more starting points that cannot be refined on the longer triangles, and then hands over whole pairs of surfaces.
//!
//! Cost: linear in the number of vertices. It cannot fail; where the cap on cells cut the grid short,
//! [`SurfaceMesh::capped`] says so.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::kernel::geom::{Basis, BezierPatch, Curve, Knots, Surface};

/// How finely to tessellate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TessellateOptions {
    /// How far a triangle may be from the surface, in model units.
    pub chord_tol: f64,
    /// The fewest parts of a knot span of degree 2 or more. Default 2.
    pub min_per_span: usize,
    /// The most parts along one direction of the whole surface. Default 2048.
    pub max_parts: usize,
}

impl TessellateOptions {
    /// The defaults at a chord tolerance.
    pub fn new(chord_tol: f64) -> Self {
        Self { chord_tol, min_per_span: 2, max_parts: 2048 }
    }
}

/// The triangles of one surface. Vertex (i, j) of the grid has index `j * lines[0].len() + i`.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// The vertices; those of a mesh are its own.
    pub points: Arc<Vec<DVec3>>,
    /// Their surface parameters.
    pub uv: Vec<DVec2>,
    /// Their unit normals (Su x Sv); a vertex where it vanishes takes the nearest defined one of its column or
    /// row. Zero only where the whole surface has none.
    pub normals: Vec<DVec3>,
    /// Vertex indices, counter-clockwise in uv. Triangles that collapse to an edge or a point are left out.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// The parameters of the grid lines along u and v.
    pub lines: [Vec<f64>; 2],
    /// Whether `max_parts` made the grid coarser than the tolerance asks for.
    pub capped: bool,
}

/// Tessellates a surface.
pub fn tessellate(surface: &Surface, options: &TessellateOptions) -> SurfaceMesh {
    let (lines, capped) = grid_lines(surface, options);
    tessellate_on(surface, lines, capped)
}

/// Tessellates a surface on given increasing grid lines along u and v, at least two each.
pub fn tessellate_on(surface: &Surface, lines: [Vec<f64>; 2], capped: bool) -> SurfaceMesh {
    let basis = |k: usize| -> Vec<Basis> { lines[k].iter().map(|&t| surface.knots()[k].basis(t, 1)).collect() };
    let (bu, bv) = (basis(0), basis(1));
    let (nu, nv) = (bu.len(), bv.len());
    let mut mesh = SurfaceMesh { capped, ..SurfaceMesh::default() };
    let mut points = Vec::with_capacity(nu * nv);
    let mut bare = false;
    for (j, bv) in bv.iter().enumerate() {
        for (i, bu) in bu.iter().enumerate() {
            let jet = surface.jet_from(bu, bv, 1);
            points.push(jet.p());
            mesh.uv.push(DVec2::new(lines[0][i], lines[1][j]));
            let normal = jet.normal();
            bare |= normal.is_none();
            mesh.normals.push(normal.unwrap_or(DVec3::ZERO));
        }
    }
    mesh.lines = lines;
    close_seams_and_poles(&mut points, nu, nv);
    if bare {
        fill_normals(&mut mesh.normals, nu, nv);
    }
    mesh.triangles = Arc::new(triangles(&points, nu, nv));
    mesh.points = Arc::new(points);
    mesh
}

/// The grid lines along both directions, and whether the cap cut them short.
pub fn grid_lines(surface: &Surface, options: &TessellateOptions) -> ([Vec<f64>; 2], bool) {
    let breaks = [surface.knots()[0].breaks(), surface.knots()[1].breaks()];
    let (mu, mv) = (breaks[0].len() - 1, breaks[1].len() - 1);
    let bounds: Vec<[f64; 3]> = surface.bezier_patches().iter().map(second_derivative_bounds).collect();
    // The tolerance is shared: a third each for uu, vv and uv. A direction that needs nothing leaves its share.
    let tol = options.chord_tol.max(f64::MIN_POSITIVE);
    let share = |m: f64| (m * 3.0 / (8.0 * tol)).sqrt().ceil().max(1.0);
    let mut parts = [vec![1.0_f64; mu], vec![1.0_f64; mv]];
    for (at, m) in bounds.iter().enumerate() {
        parts[0][at % mu] = parts[0][at % mu].max(share(m[0]));
        parts[1][at / mu] = parts[1][at / mu].max(share(m[2]));
    }
    for (k, parts) in parts.iter_mut().enumerate() {
        if surface.knots()[k].degree() > 1 {
            parts.iter_mut().for_each(|n| *n = n.max(options.min_per_span as f64));
        }
    }
    for (at, m) in bounds.iter().enumerate() {
        let (a, b) = (at % mu, at / mu);
        let need = m[1] * 6.0 / (8.0 * tol);
        let have = parts[0][a] * parts[1][b];
        if need > have {
            let grow = (need / have).sqrt();
            parts[0][a] = (parts[0][a] * grow).ceil();
            parts[1][b] = (parts[1][b] * grow).ceil();
        }
    }
    let mut capped = false;
    let lines = [0, 1].map(|k| {
        let total: f64 = parts[k].iter().sum();
        let scale = (options.max_parts.max(1) as f64 / total).min(1.0);
        capped |= scale < 1.0;
        let mut line = vec![breaks[k][0]];
        for (pair, &n) in breaks[k].windows(2).zip(&parts[k]) {
            let n = (n * scale).floor().max(1.0) as usize;
            line.extend((1..n).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / n as f64));
            line.push(pair[1]);
        }
        line.dedup();
        line
    });
    (lines, capped)
}

/// Puts `extra` among increasing grid lines. A line that is as good as there is moved: two lines a hair apart
/// would make slivers.
pub fn add_lines(line: &mut Vec<f64>, extra: &[f64]) {
    let width = line[line.len() - 1] - line[0];
    for &t in extra {
        match line.iter().position(|x| (x - t).abs() < 1e-9 * width) {
            Some(at) => line[at] = t,
            None => line.push(t),
        }
    }
    line.sort_by(f64::total_cmp);
}

/// Parameters along a curve whose polyline keeps the chord tolerance, and whether the cap cut them short. They depend
/// on nothing but the curve, the tolerance and the cap.
pub fn curve_parameters(curve: &Curve, chord_tol: f64, max_segments: usize) -> (Vec<f64>, bool) {
    let breaks = curve.knots().breaks();
    let straight = curve.knots().degree() == 1;
    let tol = chord_tol.max(f64::MIN_POSITIVE);
    let parts: Vec<f64> = breaks
        .windows(2)
        .map(|pair| {
            // A polynomial piece of degree 1 is straight; a rational one is as well, only unevenly run.
            if straight {
                return 1.0;
            }
            let h = pair[1] - pair[0];
            let bend =
                (0..=8).map(|i| curve.derivatives(pair[0] + h * f64::from(i) / 8.0, 2)[2].length()).fold(0.0, f64::max);
            (1.2 * bend * h * h / (8.0 * tol)).sqrt().ceil().max(2.0)
        })
        .collect();
    let total: f64 = parts.iter().sum();
    let scale = (max_segments as f64 / total).min(1.0);
    let mut out = vec![breaks[0]];
    for (pair, n) in breaks.windows(2).zip(&parts) {
        let n = (n * scale).floor().max(1.0) as usize;
        out.extend((1..n).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / n as f64));
        out.push(pair[1]);
    }
    (out, scale < 1.0)
}

/// Bounds of |Suu|, |Suv|, |Svv| of a Bezier piece in its own [0, 1]^2.
fn second_derivative_bounds(patch: &BezierPatch) -> [f64; 3] {
    let [p, q] = patch.degree;
    let net: Vec<DVec3> = patch.control_points().collect();
    let at = |i: usize, j: usize| net[j * (p + 1) + i];
    if patch.rational {
        return sampled_bounds(patch);
    }
    let mut m = [0.0_f64; 3];
    for j in 0..=q {
        for i in 0..=p {
            if i + 2 <= p {
                m[0] = m[0].max((at(i, j) - at(i + 1, j) * 2.0 + at(i + 2, j)).length());
            }
            if j + 2 <= q {
                m[2] = m[2].max((at(i, j) - at(i, j + 1) * 2.0 + at(i, j + 2)).length());
            }
            if i < p && j < q {
                m[1] = m[1].max((at(i, j) - at(i + 1, j) - at(i, j + 1) + at(i + 1, j + 1)).length());
            }
        }
    }
    let (p, q) = (p as f64, q as f64);
    [m[0] * p * (p - 1.0), m[1] * p * q, m[2] * q * (q - 1.0)]
}

/// The same for a rational piece, from a grid of samples with a margin of a half.
fn sampled_bounds(patch: &BezierPatch) -> [f64; 3] {
    let knots = |degree| Knots::bezier(degree, 0.0, 1.0);
    let points = patch.control_points().collect();
    let weights = Some(patch.points.iter().map(|p| p.w).collect());
    let (Ok(ku), Ok(kv)) = (knots(patch.degree[0]), knots(patch.degree[1])) else { return [0.0; 3] };
    let Ok(surface) = Surface::new(ku, kv, points, weights) else { return [0.0; 3] };
    let steps = |degree: usize| 2 * degree + 1;
    let mut m = [0.0_f64; 3];
    for j in 0..=steps(patch.degree[1]) {
        for i in 0..=steps(patch.degree[0]) {
            let uv = DVec2::new(i as f64 / steps(patch.degree[0]) as f64, j as f64 / steps(patch.degree[1]) as f64);
            for (m, d) in m.iter_mut().zip(surface.jet(uv, 2).second()) {
                *m = m.max(1.5 * d.length());
            }
        }
    }
    m
}

/// Rows and columns that collapse to a point, and opposite borders that coincide, get the same coordinates to
/// the last bit, so that rays and closest points meet no slit there.
fn close_seams_and_poles(points: &mut [DVec3], nu: usize, nv: usize) {
    let size = crate::kernel::geom::Aabb::of(points.iter().copied());
    let eps = 1e-12 * (size.diagonal() + size.max_abs());
    let border = |side: usize, k: usize| match side {
        0 => k,
        1 => (nv - 1) * nu + k,
        2 => k * nu,
        _ => k * nu + nu - 1,
    };
    for side in 0..4 {
        let count = if side < 2 { nu } else { nv };
        let first = points[border(side, 0)];
        if (0..count).all(|k| points[border(side, k)].distance(first) <= eps) {
            (0..count).for_each(|k| points[border(side, k)] = first);
        }
    }
    for pair in [[0, 1], [2, 3]] {
        let count = if pair[0] == 0 { nu } else { nv };
        if (0..count).all(|k| points[border(pair[0], k)].distance(points[border(pair[1], k)]) <= eps) {
            (0..count).for_each(|k| points[border(pair[1], k)] = points[border(pair[0], k)]);
        }
    }
}

/// Gives every vertex without a normal that of the nearest vertex of its column, else of its row.
fn fill_normals(normals: &mut [DVec3], nu: usize, nv: usize) {
    let given = normals.to_vec();
    let nearest = |start: usize, stride: usize, count: usize, k: usize| {
        (1..count).find_map(|d| {
            let low = k.checked_sub(d).map(|k| given[start + k * stride]);
            let high = (k + d < count).then(|| given[start + (k + d) * stride]);
            low.into_iter().chain(high).find(|n| *n != DVec3::ZERO)
        })
    };
    for j in 0..nv {
        for i in 0..nu {
            if given[j * nu + i] == DVec3::ZERO {
                let found = nearest(i, nu, nv, j).or_else(|| nearest(j * nu, 1, nu, i));
                normals[j * nu + i] = found.unwrap_or(DVec3::ZERO);
            }
        }
    }
    // A vertex whose column and row are bare as well (the corner of two poles) takes any normal there is.
    if let Some(&any) = normals.iter().find(|n| **n != DVec3::ZERO) {
        normals.iter_mut().filter(|n| **n == DVec3::ZERO).for_each(|n| *n = any);
    }
}

/// Two triangles a cell along its shorter diagonal.
fn triangles(points: &[DVec3], nu: usize, nv: usize) -> Vec<[u32; 3]> {
    let mut out = Vec::with_capacity(2 * (nu - 1) * (nv - 1));
    for j in 0..nv - 1 {
        for i in 0..nu - 1 {
            let a = j * nu + i;
            let [a, b, c, d] = [a, a + 1, a + nu + 1, a + nu];
            let rising = points[a].distance_squared(points[c]) <= points[b].distance_squared(points[d]);
            let pair = if rising { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            for t in pair {
                let [p, q, r] = t.map(|k| points[k]);
                if p != q && q != r && r != p {
                    out.push(t.map(|k| k as u32));
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::*;

    /// The unit sphere as one rational biquadratic surface: u around (closed seam), v from pole to pole.
    fn sphere() -> Surface {
        let w = FRAC_1_SQRT_2;
        let circle: Vec<(DVec2, f64)> = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
            .iter()
            .enumerate()
            .map(|(i, &(x, y))| (DVec2::new(f64::from(x), f64::from(y)), if i % 2 == 1 { w } else { 1.0 }))
            .collect();
        let arc = [(0.0, -1.0, 1.0), (1.0, -1.0, w), (1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)];
        let mut points = Vec::new();
        let mut weights = Vec::new();
        for (r, z, wv) in arc {
            for (c, wu) in &circle {
                points.push(DVec3::new(r * c.x, r * c.y, z));
                weights.push(wu * wv);
            }
        }
        let ku = Knots::clamped(2, &[0.0, 1.0, 2.0, 3.0, 4.0], 2).unwrap();
        let kv = Knots::clamped(2, &[0.0, 1.0, 2.0], 2).unwrap();
        Surface::new(ku, kv, points, Some(weights)).unwrap()
    }

    #[test]
    fn a_sphere_keeps_its_chord_tolerance_poles_and_seam() {
        let tol = 1e-3;
        let mesh = tessellate(&sphere(), &TessellateOptions::new(tol));
        assert!(!mesh.capped);
        for t in mesh.triangles.iter() {
            let [a, b, c] = t.map(|k| mesh.points[k as usize]);
            // Points of a triangle lie inside the ball; the deepest is nearest to the centre.
            for p in [(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)] {
                assert!(1.0 - p.length() <= tol && p.length() <= 1.0 + 1e-12, "{}", p.length());
            }
            for k in t.map(|k| k as usize) {
                let (n, p) = (mesh.normals[k], mesh.points[k]);
                // The parametrization's Su x Sv points outwards here. At a pole the normal is a neighbour's.
                let pole = p.z.abs() > 1.0 - 1e-9;
                assert!(n.dot(p) > if pole { 0.9 } else { 1.0 - 1e-9 }, "{n} at {p}");
            }
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "orientation");
        }
    }

    #[test]
    fn a_closed_surface_has_no_crack() {
        let mesh = tessellate(&sphere(), &TessellateOptions::new(1e-2));
        let key = |k: u32| mesh.points[k as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut edges: HashMap<_, i32> = HashMap::new();
        for t in mesh.triangles.iter() {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let (a, b) = (key(a), key(b));
                *edges.entry(if a < b { (a, b) } else { (b, a) }).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&n| n == 0), "every edge is used once in each direction");
    }

    #[test]
    fn a_twisted_bilinear_patch_needs_both_directions_and_a_plane_needs_none() {
        let corners = |z: f64| [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, z)];
        let flat = tessellate(&Surface::bilinear(corners(0.0)).unwrap(), &TessellateOptions::new(1e-6));
        assert_eq!(flat.triangles.len(), 2);
        let tol = 1e-4;
        let twisted = tessellate(&Surface::bilinear(corners(1.0)).unwrap(), &TessellateOptions::new(tol));
        for t in twisted.triangles.iter() {
            let [a, b, c] = t.map(|k| twisted.points[k as usize]);
            for p in [(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)] {
                assert!((p.z - p.x * p.y).abs() <= tol);
            }
        }
    }

    #[test]
    fn lines_contain_every_knot_and_the_cap_is_recorded() {
        let options = TessellateOptions { chord_tol: 1e-12, min_per_span: 2, max_parts: 40 };
        let mesh = tessellate(&sphere(), &options);
        assert!(mesh.capped);
        for (k, line) in mesh.lines.iter().enumerate() {
            assert!(line.len() <= 42);
            assert!(sphere().knots()[k].breaks().iter().all(|b| line.contains(b)));
        }
    }
}
