//! Whether two convex hulls of points are farther apart than a length.
//!
//! Gilbert, Johnson, Keerthi: A fast procedure for computing the distance between complex objects, 1988. The point of
//! the Minkowski difference that is closest to the origin is approached by simplices of support points. Every support
//! point gives a lower bound of the distance; the answer "apart" rests on that bound alone, so rounding or an
//! iteration that does not settle can only answer "not apart".

use glam::DVec3;

const ITERATIONS: usize = 48;

/// Points are triples of `f32`, those of `b` moved by `shift`.
pub(crate) fn apart(a: &[f32], b: &[f32], shift: DVec3, reach: f64) -> bool {
    let point = |p: &[f32]| DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    let extreme = |points: &[f32], direction: DVec3| {
        let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
        for p in points.chunks_exact(3).map(point) {
            let along = p.dot(direction);
            if along > best.0 {
                best = (along, p);
            }
        }
        best.1
    };
    let mut simplex: Vec<DVec3> = Vec::with_capacity(4);
    let mut v = point(a) - (point(b) + shift);
    for _ in 0..ITERATIONS {
        let w = extreme(a, -v) - (extreme(b, v) + shift);
        let length = v.length();
        if w.dot(v) > reach * length && length > 0.0 {
            return true;
        }
        // No progress towards the origin, or the origin is reached: they are not farther apart than that.
        if length == 0.0 || length * length - w.dot(v) <= 1e-12 * length * length || simplex.len() == 4 {
            return false;
        }
        simplex.push(w);
        v = closest(&mut simplex);
    }
    false
}

/// The point of a simplex of up to four points that is closest to the origin; the simplex is cut down to the face
/// that it lies in.
fn closest(simplex: &mut Vec<DVec3>) -> DVec3 {
    let mut best = (f64::INFINITY, DVec3::ZERO, 0_u32);
    for subset in 1..1_u32 << simplex.len() {
        let face: Vec<DVec3> = (0..simplex.len()).filter(|k| subset >> k & 1 == 1).map(|k| simplex[k]).collect();
        if let Some(p) = inner_closest(&face) {
            let length = p.length_squared();
            if length < best.0 {
                best = (length, p, subset);
            }
        }
    }
    let mut k = 0;
    simplex.retain(|_| {
        k += 1;
        best.2 >> (k - 1) & 1 == 1
    });
    best.1
}

/// The closest point of the plane through a face, if it lies within the face.
fn inner_closest(face: &[DVec3]) -> Option<DVec3> {
    let a = face[0];
    match *face {
        [_] => Some(a),
        [_, b] => {
            let d = b - a;
            let t = -a.dot(d) / d.length_squared();
            (t > 0.0 && t < 1.0).then(|| a + d * t)
        }
        [_, b, c] => {
            let n = (b - a).cross(c - a);
            let nn = n.length_squared();
            let p = n * (a.dot(n) / nn);
            let s = (p - a).cross(c - a).dot(n) / nn;
            let t = (b - a).cross(p - a).dot(n) / nn;
            (nn > 0.0 && s > 0.0 && t > 0.0 && s + t < 1.0).then_some(p)
        }
        [_, b, c, d] => {
            let volume = (b - a).dot((c - a).cross(d - a));
            let part = |x: DVec3, y: DVec3, z: DVec3| x.dot(y.cross(z)) / volume;
            let inside = part(b, c, d) > 0.0 && part(a, d, c) > 0.0 && part(a, b, d) > 0.0 && part(a, c, b) > 0.0;
            (volume != 0.0 && inside).then_some(DVec3::ZERO)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

    fn cube(center: DVec3, half: f64) -> Vec<f32> {
        (0..8)
            .flat_map(|k| {
                let sign = |bit: u32| if k >> bit & 1 == 1 { half } else { -half };
                (center + DVec3::new(sign(0), sign(1), sign(2))).as_vec3().to_array()
            })
            .collect()
    }

    #[test]
    fn cubes_are_apart_by_their_gap() {
        let mut random = Random(5);
        for _ in 0..2000 {
            let center = random.vector() * 4.0;
            let (a, b) = (cube(DVec3::ZERO, 1.0), cube(DVec3::ZERO, 0.5));
            let gap = (center.abs() - 1.5).max(DVec3::ZERO).length();
            assert!(!apart(&a, &b, center, gap * 1.000_01 + 1e-6));
            if gap > 1e-3 {
                assert!(apart(&a, &b, center, gap * 0.999_9));
            }
        }
    }
}
