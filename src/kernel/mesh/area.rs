//! The area of a surface or face by Gauss quadrature of |Su x Sv| over the parameter plane.
//!
//! A whole surface is measured span by span, a face on the triangles of its tessellation; inside them the surface itself is measured (the six-point rule of degree
//! 4, Strang and Fix, *An Analysis of the Finite Element Method*, 1973). Along the loops, what lies between a straight piece
//! of a triangle and the parameter curve is added by Green's theorem. Cost: six evaluations a triangle.

use glam::DVec2;

use super::face_mesh::tessellate_face;
use super::tessellate::TessellateOptions;
use crate::kernel::geom::trim::{FaceEdge, Sheet};
use crate::kernel::geom::{Basis, Surface};

/// The chord tolerance, as a fraction of the size.
const CHORD: f64 = 1e-4;
/// Barycentric coordinates and weights of the six points, one of three permutations each.
const RULE: [(f64, f64, f64); 2] = [
    (0.108_103_018_168_070_23, 0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
    (0.816_847_572_980_458_5, 0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
];

/// The area.
pub fn area(sheet: &Sheet) -> f64 {
    let surface = sheet.surface();
    let Some(face) = sheet.face() else { return whole(surface) };
    let density = |uv: DVec2| surface.jet(surface.clamped(uv), 1).cross().length();
    let options = TessellateOptions::new((CHORD * sheet.bounds().diagonal()).max(f64::MIN_POSITIVE));
    let made = tessellate_face(face, &options, &[Vec::new(), Vec::new()]);
    let mut sum = 0.0;
    for (ring, lines) in face.rings().iter().zip(&made.edges) {
        for (edge, line) in ring.edges.iter().zip(lines).filter(|(e, _)| e.pcurve.knots().degree() > 1) {
            let sign = if edge.reversed { -1.0 } else { 1.0 };
            for pair in line.vertices.windows(2) {
                sum += sign * sliver(edge, [pair[0], pair[1]]) * density(edge.uv(0.5 * (pair[0] + pair[1])));
            }
        }
    }
    for t in made.mesh.triangles.iter().chain(&made.collapsed) {
        let [a, b, c]: [DVec2; 3] = t.map(|k| made.mesh.uv[k as usize]);
        let flat = 0.5 * (b - a).perp_dot(c - a).abs();
        let points = RULE.iter().flat_map(|&(p, q, w)| [(p, q, q, w), (q, p, q, w), (q, q, p, w)]);
        sum += flat * points.map(|(p, q, r, w)| w * density(a * p + b * q + c * r)).sum::<f64>();
    }
    sum
}

/// Nodes and weights of Gauss-Legendre with eight points on [-1, 1], positive half (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// The area of a whole surface: eight by eight points in every half of every knot span.
fn whole(surface: &Surface) -> f64 {
    let nodes = |k: usize| -> Vec<(Basis, f64)> {
        let knots = &surface.knots()[k];
        let mut out = Vec::new();
        for pair in knots.breaks().windows(2) {
            let h = 0.25 * (pair[1] - pair[0]);
            for center in [pair[0] + h, pair[1] - h] {
                for (x, w) in GAUSS {
                    out.extend([-x, x].map(|x| (knots.basis(center + h * x, 1), w * h)));
                }
            }
        }
        out
    };
    let (u, v) = (nodes(0), nodes(1));
    let row = |(bv, wv): &(Basis, f64)| -> f64 {
        u.iter().map(|(bu, wu)| wu * surface.jet_from(bu, bv, 1).cross().length()).sum::<f64>() * wv
    };
    v.iter().map(row).sum()
}

/// The area between a piece of a parameter curve and its chord; positive to the right of the curve.
fn sliver(edge: &FaceEdge, [from, to]: [f64; 2]) -> f64 {
    // Gauss-Legendre with three points on either half: exact for cubics, whose product has degree 5.
    const THREE: [(f64, f64); 3] =
        [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
    let start = edge.uv(from);
    let mut sum = 0.0;
    for half in 0..2 {
        let step = 0.25 * (to - from);
        let center = from + step * f64::from(1 + 2 * half);
        for (x, w) in THREE {
            let [p, d, ..] = edge.pcurve.derivatives(center + step * x, 1);
            sum += w * step * (p.truncate() - start).perp_dot(d.truncate());
        }
    }
    0.5 * sum
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::kernel::geom::sweep;

    #[test]
    fn a_sphere_has_its_area() {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X * 3.0, DVec3::Z * 3.0, -FRAC_PI_2, FRAC_PI_2).unwrap();
        let sphere = sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap();
        let found = area(&Sheet::Whole(Arc::new(sphere)));
        assert!((found / (36.0 * PI) - 1.0).abs() < 1e-6, "{found}");
    }
}
