//! A trimmed face as triangles: constrained Delaunay in the parameter plane.
//!
//! Edges are sampled by their curve in space and the chord tolerance alone, so that faces which share an edge get the same
//! points on it, to the last bit, whatever their surfaces: no crack can open. Inside, the grid lines of the surface's own
//! tessellation ([`super::tessellate`]) are used where they cross inside the loops. The triangulation happens in
//! parameters that count grid cells, so that triangles become as long as cells are and not longer. Where an edge's
//! straight piece would leave its parameter curve by more than the tolerance, vertices are added on the edge; the
//! neighbour does not have these, but they lie on its straight piece within the tolerance.
//!
//! A triangle counts where an odd number of edges separates it from the outside, so loops that touch or cross do no harm
//! beyond themselves. Cost: about two microseconds a vertex. It cannot fail; edges that the
//! triangulation could not keep are counted in [`FaceMesh::lost`].

mod delaunay;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use self::delaunay::triangulated;
use super::tessellate::{SurfaceMesh, TessellateOptions, curve_parameters, grid_lines};
use crate::kernel::geom::Surface;
use crate::kernel::geom::trim::{EdgeRole, Face, FaceEdge};

/// How near to an edge no vertex of the grid is used, in cells.
const CLEAR: f64 = 0.2;
/// How often a piece of an edge may be halved to follow its parameter curve.
const MAX_DEPTH: usize = 6;
/// The most segments of one edge.
const MAX_SEGMENTS: usize = 8192;

/// An edge as a polyline.
#[derive(Clone, Debug, Default)]
pub struct EdgeLine {
    /// Points on it, in the direction of its curve.
    pub points: Vec<DVec3>,
    /// Their parameters on the curve.
    pub t: Vec<f64>,
    /// The parameters of all vertices on it: those and the ones that its parameter curve needed besides.
    pub vertices: Vec<f64>,
}

/// A face as triangles and lines.
#[derive(Clone, Debug, Default)]
pub struct FaceMesh {
    /// The triangles. `lines` are those of the whole surface; the vertices are no grid.
    pub mesh: SurfaceMesh,
    /// The edges, loop by loop.
    pub edges: Vec<Vec<EdgeLine>>,
    /// Triangles that collapse in space but not in the parameter plane, at poles; they are not among the others.
    pub collapsed: Vec<[u32; 3]>,
    /// Pieces of edges that cross others.
    pub lost: usize,
}

/// Parameters that count the cells between grid lines.
struct Cells<'a> {
    lines: &'a [Vec<f64>; 2],
}

impl Cells<'_> {
    fn of(&self, uv: DVec2) -> DVec2 {
        let one = |k: usize| {
            let lines = &self.lines[k];
            let cell = lines.partition_point(|&x| x <= uv[k]).clamp(1, lines.len() - 1) - 1;
            cell as f64 + (uv[k] - lines[cell]) / (lines[cell + 1] - lines[cell])
        };
        DVec2::new(one(0), one(1))
    }
}

/// The edge as a polyline within the chord tolerance; the same for every face that shares it.
fn edge_line(edge: &FaceEdge, chord_tol: f64) -> (EdgeLine, bool) {
    let (t, capped) = curve_parameters(&edge.curve, chord_tol, MAX_SEGMENTS);
    if edge.role == EdgeRole::Pole {
        let p = edge.curve.points()[0];
        return (EdgeLine { points: vec![p; t.len()], t, vertices: Vec::new() }, capped);
    }
    let mut points: Vec<DVec3> = t.iter().map(|&t| edge.curve.eval(t)).collect();
    let last = points.len() - 1;
    (points[0], points[last]) = (rounded(points[0]), rounded(points[last]));
    (EdgeLine { points, t, vertices: Vec::new() }, capped)
}

/// The ends of edges that meet in a corner differ by rounding: on a lattice of 2^-40 of their coordinates they are one
/// point, and so are the vertices of all faces there.
fn rounded(p: DVec3) -> DVec3 {
    let size = p.abs().max_element();
    if !(size > 0.0 && size.is_finite()) {
        return p;
    }
    let step = 2f64.powi(size.log2().floor() as i32 - 40);
    (p / step).round() * step
}

/// A vertex of a loop.
#[derive(Clone, Copy)]
struct Corner {
    uv: DVec2,
    point: DVec3,
}

/// The vertices of an edge in the direction of its loop, with those that its parameter curve needs besides.
fn corners(surface: &Surface, edge: &FaceEdge, line: &mut EdgeLine, chord_tol: f64) -> Vec<Corner> {
    let at = |t: f64| Corner { uv: edge.uv(t), point: edge.curve.eval(t) };
    let mut out: Vec<Corner> =
        line.points.first().map(|&point| Corner { uv: edge.uv(line.t[0]), point }).into_iter().collect();
    let bends = edge.pcurve.knots().degree() > 1;
    let mut inner = line.t.clone();
    for (t, points) in line.t.windows(2).zip(line.points.windows(2)) {
        let end = Corner { uv: edge.uv(t[1]), point: points[1] };
        if bends {
            let mut stack = vec![([t[0], t[1]], MAX_DEPTH)];
            while let Some(([a, b], depth)) = stack.pop() {
                let middle = 0.5 * (a + b);
                let chord = 0.5 * (edge.uv(a) + edge.uv(b));
                let apart =
                    surface.eval(surface.clamped(chord)).distance(surface.eval(surface.clamped(edge.uv(middle))));
                if depth > 0 && apart > 2.0 * chord_tol {
                    stack.push(([middle, b], depth - 1));
                    stack.push(([a, middle], depth - 1));
                } else if b < t[1] {
                    out.push(at(b));
                    inner.push(b);
                }
            }
        }
        out.push(end);
    }
    inner.sort_by(f64::total_cmp);
    line.vertices = inner;
    if edge.reversed {
        out.reverse();
    }
    out
}

/// Tessellates a face. `extra` are lines of the surface that the grid must have.
pub fn tessellate_face(face: &Face, options: &TessellateOptions, extra: &[Vec<f64>; 2]) -> FaceMesh {
    let surface = face.surface();
    let (mut lines, mut capped) = grid_lines(surface, options);
    for (line, extra) in lines.iter_mut().zip(extra) {
        super::tessellate::add_lines(line, extra);
    }
    let cells = Cells { lines: &lines };
    let mut out = FaceMesh::default();
    let mut vertices: Vec<Corner> = Vec::new();
    let mut places: Vec<DVec2> = Vec::new();
    let mut segments: Vec<[u32; 2]> = Vec::new();
    for ring in face.rings() {
        let first = vertices.len();
        let mut ring_lines = Vec::with_capacity(ring.edges.len());
        for edge in &ring.edges {
            let (mut line, cut_short) = edge_line(edge, options.chord_tol);
            capped |= cut_short;
            for corner in corners(surface, edge, &mut line, options.chord_tol) {
                let place = cells.of(corner.uv);
                // The end of one edge is the beginning of the next.
                if vertices.len() > first && places[places.len() - 1].distance(place) <= 1e-9 {
                    continue;
                }
                vertices.push(corner);
                places.push(place);
            }
            ring_lines.push(line);
        }
        if vertices.len() > first + 1 && places[first].distance(places[places.len() - 1]) <= 1e-9 {
            vertices.pop();
            places.pop();
        }
        let last = vertices.len();
        segments.extend((first..last).map(|k| [k as u32, (if k + 1 < last { k + 1 } else { first }) as u32]));
        out.edges.push(ring_lines);
    }
    let outline: Vec<[DVec2; 2]> = segments.iter().map(|s| s.map(|k| places[k as usize])).collect();
    for place in grid_inside(&outline, [lines[0].len(), lines[1].len()]) {
        let uv = DVec2::new(lines[0][place[0]], lines[1][place[1]]);
        vertices.push(Corner { uv, point: surface.eval(uv) });
        places.push(DVec2::new(place[0] as f64, place[1] as f64));
    }
    let triangles = triangulated(&places, &segments, &mut vertices, &mut out.lost, &lines, surface);
    let mesh = &mut out.mesh;
    mesh.uv = vertices.iter().map(|c| c.uv).collect();
    mesh.points = Arc::new(vertices.iter().map(|c| c.point).collect());
    mesh.normals = vertices.iter().map(|c| normal(surface, c.uv)).collect();
    let (whole, collapsed) = triangles.into_iter().partition(|t| {
        let [a, b, c] = t.map(|k| mesh.points[k as usize]);
        a != b && b != c && c != a
    });
    (mesh.triangles, out.collapsed) = (Arc::new(whole), collapsed);
    fill_normals(mesh);
    mesh.capped = capped;
    mesh.lines = lines;
    out
}

/// The normal, from a little further inside where the place itself has none.
fn normal(surface: &Surface, uv: DVec2) -> DVec3 {
    let uv = surface.clamped(uv);
    let [u, v] = surface.domain();
    let middle = DVec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
    let tries = [0.0, 1e-6, 1e-3].into_iter();
    tries.filter_map(|s| surface.jet(uv.lerp(middle, s), 1).normal()).next().unwrap_or(DVec3::ZERO)
}

/// Vertices that have no normal still get that of a triangle.
fn fill_normals(mesh: &mut SurfaceMesh) {
    if mesh.normals.iter().all(|n| *n != DVec3::ZERO) {
        return;
    }
    for t in mesh.triangles.iter() {
        let [a, b, c] = t.map(|k| mesh.points[k as usize]);
        let n = (b - a).cross(c - a).normalize_or_zero();
        for k in t.map(|k| k as usize) {
            if mesh.normals[k] == DVec3::ZERO {
                mesh.normals[k] = n;
            }
        }
    }
}

/// Where the outline crosses the lines of one direction, sorted, line by line.
fn crossings(outline: &[[DVec2; 2]], across: usize, count: usize) -> Vec<Vec<f64>> {
    let mut out = vec![Vec::new(); count];
    for [a, b] in outline {
        let (low, high) = if a[across] < b[across] { (a, b) } else { (b, a) };
        let first = low[across].ceil().max(0.0) as usize;
        for (k, line) in out.iter_mut().enumerate().skip(first) {
            let at = k as f64;
            // Half open, so that a corner on the line counts once where the outline passes.
            if at >= high[across] {
                break;
            }
            let s = (at - low[across]) / (high[across] - low[across]);
            line.push(low[1 - across] + s * (high[1 - across] - low[1 - across]));
        }
    }
    out.iter_mut().for_each(|line| line.sort_by(f64::total_cmp));
    out
}

/// The grid points inside the outline and clear of it.
fn grid_inside(outline: &[[DVec2; 2]], counts: [usize; 2]) -> Vec<[usize; 2]> {
    let rows = crossings(outline, 1, counts[1]);
    let columns = crossings(outline, 0, counts[0]);
    let clear = |line: &[f64], x: f64| {
        let at = line.partition_point(|&c| c < x);
        let near = |k: usize| line.get(k).is_some_and(|c| (c - x).abs() < CLEAR);
        !(near(at) || at > 0 && near(at - 1))
    };
    let mut out = Vec::new();
    for (j, row) in rows.iter().enumerate() {
        for pair in row.chunks_exact(2) {
            let first = (pair[0] + CLEAR).ceil().max(0.0) as usize;
            for (i, column) in columns.iter().enumerate().skip(first) {
                if i as f64 > pair[1] - CLEAR {
                    break;
                }
                if clear(column, j as f64) {
                    out.push([i, j]);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    use std::sync::Arc;

    use std::collections::HashMap;

    use super::*;
    use crate::kernel::geom::ring::{EdgeInput, RingOptions, face};
    use crate::kernel::geom::trim::{Sheet, SurfaceKind};
    use crate::kernel::geom::{Curve, sweep};

    fn input(id: u64, curve: &Arc<Curve>, reversed: bool) -> EdgeInput {
        EdgeInput { id, curve: Some(Arc::clone(curve)), guide: None, reversed }
    }

    fn made(surface: Surface, rings: &[Vec<EdgeInput>]) -> Face {
        let options = RingOptions { oriented: true, ..RingOptions::default() };
        face(&Arc::new(surface), SurfaceKind::Spline, rings, &options).unwrap().face
    }

    fn area(mesh: &SurfaceMesh) -> f64 {
        let one = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.points[k as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        mesh.triangles.iter().map(one).sum()
    }

    /// The area by quadrature on the surface.
    fn measured(face: Face) -> f64 {
        crate::kernel::mesh::area::area(&Sheet::Trimmed(Arc::new(face)))
    }

    fn mesh(face: &Face, tol: f64) -> SurfaceMesh {
        let made = tessellate_face(face, &TessellateOptions::new(tol), &[Vec::new(), Vec::new()]);
        assert_eq!(made.lost, 0);
        let slack = 1e-9 * area(&made.mesh);
        for t in made.mesh.triangles.iter() {
            let [a, b, c] = t.map(|k| made.mesh.points[k as usize]);
            let n = made.mesh.normals[t[0] as usize];
            assert!((b - a).cross(c - a).dot(n) > -slack, "turned over: {a} {b} {c}");
        }
        made.mesh
    }

    fn plane(half: f64, z: f64) -> Surface {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        Surface::bilinear([p(-half, -half), p(half, -half), p(-half, half), p(half, half)]).unwrap()
    }

    fn circle(center: DVec3, r: f64) -> Arc<Curve> {
        Arc::new(sweep::arc(center, DVec3::X * r, DVec3::Y * r, 0.0, TAU).unwrap())
    }

    fn cylinder(r: f64, low: f64, high: f64) -> Surface {
        let line = Curve::segment(DVec3::new(r, 0.0, low), DVec3::new(r, 0.0, high)).unwrap();
        sweep::revolved(&line, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap()
    }

    #[test]
    fn a_plate_with_holes_has_its_area() {
        let square: Vec<Arc<Curve>> = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]
            .iter()
            .zip([[2.0, -2.0], [2.0, 2.0], [-2.0, 2.0], [-2.0, -2.0]])
            .map(|(a, b)| Arc::new(Curve::segment(DVec3::new(a[0], a[1], 0.0), DVec3::new(b[0], b[1], 0.0)).unwrap()))
            .collect();
        let outer = square.iter().enumerate().map(|(k, c)| input(k as u64, c, false)).collect();
        let hole = |id: u64, x: f64| vec![input(id, &circle(DVec3::X * x, 0.5), id == 10)];
        let face = made(plane(3.0, 0.0), &[hole(10, -1.0), outer, hole(11, 1.0)]);
        let mesh = mesh(&face, 1e-5);
        let exact = 16.0 - 2.0 * PI * 0.25;
        assert!((area(&mesh) - exact).abs() < 1e-4, "{} {exact}", area(&mesh));
        assert!((measured(face.clone()) - exact).abs() < 1e-5);
        assert!(face.contains(DVec2::splat(0.5)) && !face.contains(DVec2::new(2.0 / 6.0, 0.5)));
        assert_eq!(face.rings()[0].edges.len(), 4, "the outer loop comes first");
    }

    #[test]
    fn a_cylinder_and_its_caps_close_whether_or_not_the_file_has_a_seam() {
        let (low, high) = (circle(DVec3::ZERO, 1.0), circle(DVec3::Z * 3.0, 1.0));
        let seam = Arc::new(Curve::segment(DVec3::X, DVec3::X + DVec3::Z * 3.0).unwrap());
        let with_seam =
            vec![vec![input(0, &low, false), input(2, &seam, false), input(1, &high, true), input(2, &seam, true)]];
        let seam_first =
            vec![vec![input(2, &seam, false), input(1, &high, true), input(2, &seam, true), input(0, &low, false)]];
        let without = vec![vec![input(1, &high, true)], vec![input(0, &low, false)]];
        for rings in [with_seam, seam_first, without] {
            let side = made(cylinder(1.0, -0.1, 3.1), &rings);
            let bottom = made(plane(1.5, 0.0), &[vec![input(0, &low, true)]]);
            let top = made(plane(1.5, 3.0), &[vec![input(1, &high, false)]]);
            let mut edges: HashMap<_, i32> = HashMap::new();
            let mut total = 0.0;
            for (face, sign) in [(&side, 1), (&bottom, -1), (&top, 1)] {
                let mesh = mesh(face, 1e-4);
                total += area(&mesh);
                let key = |k: u32| mesh.points[k as usize].to_array().map(|x| (x + 0.0).to_bits());
                for t in mesh.triangles.iter() {
                    for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                        let (a, b) = (key(a), key(b));
                        *edges.entry(if a < b { (a, b) } else { (b, a) }).or_default() +=
                            if a < b { sign } else { -sign };
                    }
                }
            }
            assert!((total - TAU * 4.0).abs() < 1e-2, "{total}");
            let open = edges.values().filter(|&&n| n != 0).count();
            assert_eq!(open, 0, "every edge is used once in each direction");
        }
    }

    #[test]
    fn a_cap_of_a_sphere_reaches_its_pole_and_a_whole_one_closes_along_a_seam() {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, -FRAC_PI_2, FRAC_PI_2).unwrap();
        let sphere = sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap();
        let rim = circle(DVec3::Z * 0.6, 0.8);
        for (reversed, exact) in [(false, TAU * 0.4), (true, TAU * 1.6)] {
            let face = made(sphere.clone(), &[vec![input(0, &rim, reversed)]]);
            assert!((area(&mesh(&face, 1e-3)) - exact).abs() < 1e-2 * exact, "{reversed}");
            assert!((measured(face) - exact).abs() < 1e-5 * exact, "{reversed}");
        }
        let seam = Arc::new(meridian);
        let whole = made(sphere, &[vec![input(0, &seam, false), input(0, &seam, true)]]);
        assert!((area(&mesh(&whole, 1e-3)) - 2.0 * TAU).abs() < 0.1);
        assert!((measured(whole) - 2.0 * TAU).abs() < 1e-4);
    }

    #[test]
    fn a_window_across_the_seam_is_one_piece() {
        let at = |a: f64, z: f64| DVec3::new(a.cos(), a.sin(), z);
        let arc = |a: f64, b: f64, z: f64| Arc::new(sweep::arc(DVec3::Z * z, DVec3::X, DVec3::Y, a, b).unwrap());
        let line = |a: DVec3, b: DVec3| Arc::new(Curve::segment(a, b).unwrap());
        let ring = vec![
            input(0, &arc(-0.5, 0.5, 0.0), false),
            input(1, &line(at(0.5, 0.0), at(0.5, 1.0)), false),
            input(2, &arc(-0.5, 0.5, 1.0), true),
            input(3, &line(at(-0.5, 1.0), at(-0.5, 0.0)), false),
        ];
        let face = made(cylinder(1.0, -1.0, 2.0), &[ring]);
        assert!((area(&mesh(&face, 1e-4)) - 1.0).abs() < 1e-3);
        assert!((measured(face) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_torus_quarter_follows_both_closed_directions() {
        let circle = sweep::arc(DVec3::X * 3.0, DVec3::X, DVec3::Z, 0.0, TAU).unwrap();
        let torus = sweep::revolved(&circle, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap();
        let tube = |a: f64| {
            let x = DVec3::new(a.cos(), a.sin(), 0.0);
            Arc::new(sweep::arc(x * 3.0, x, DVec3::Z, 0.0, TAU).unwrap())
        };
        // Two circles around the tube, a quarter turn apart: no seam in the file.
        let rings = vec![vec![input(0, &tube(0.5), false)], vec![input(1, &tube(0.5 - FRAC_PI_2), true)]];
        let face = made(torus, &rings);
        let exact = FRAC_PI_2 * 3.0 * TAU;
        assert!((area(&mesh(&face, 1e-2)) - exact).abs() < 1e-2 * exact);
        let found = measured(face);
        assert!((found - exact).abs() < 1e-5 * exact, "{found} {exact}");
    }
}
