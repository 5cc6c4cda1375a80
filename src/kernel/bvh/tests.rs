//! Properties of whole hierarchies on random surfaces.

use glam::{DVec2, DVec3};

use super::*;
use crate::kernel::geom::{Knots, Surface};
use crate::kernel::job::Job;

/// Deterministic numbers in 0..1 (splitmix64).
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }

    pub(crate) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// What is special about a random surface.
#[derive(Clone, Copy, Debug, Default)]
struct Kind {
    degree: [usize; 2],
    spans: [usize; 2],
    rational: bool,
    pole: bool,
    flat: bool,
    aspect: f64,
    away: f64,
}

fn random_surface(kind: Kind, random: &mut Random) -> Surface {
    let knots = |k: usize| {
        let breaks: Vec<f64> = (0..=kind.spans[k]).map(|i| i as f64).collect();
        Knots::clamped(kind.degree[k], &breaks, 1).unwrap()
    };
    let (u, v) = (knots(0), knots(1));
    let (nu, nv) = (u.control_count(), v.control_count());
    let height = if kind.flat { 1e-9 } else { 0.3 };
    let aspect = if kind.aspect > 0.0 { kind.aspect } else { 1.0 };
    let diagonal = aspect.max(1.0) * 1.5;
    let away = random.vector().normalize() * (kind.away * diagonal);
    let mut points = Vec::new();
    for j in 0..nv {
        for i in 0..nu {
            let (x, y) = (i as f64 / (nu - 1) as f64, j as f64 / (nv - 1) as f64);
            let p = DVec3::new(x, y, 0.0) + random.vector() * DVec3::new(0.2, 0.2, height);
            points.push(p * DVec3::new(aspect, 1.0, 1.0) + away);
        }
    }
    if kind.pole {
        for i in 1..nu {
            points[(nv - 1) * nu + i] = points[(nv - 1) * nu];
        }
    }
    let weights = kind.rational.then(|| (0..nu * nv).map(|_| 10.0_f64.powf(1.5 * random.signed())).collect());
    Surface::new(u, v, points, weights).unwrap()
}

fn kinds() -> Vec<Kind> {
    let base = Kind { degree: [3, 3], spans: [1, 1], ..Kind::default() };
    let mut kinds = vec![
        base,
        Kind { spans: [3, 2], ..base },
        Kind { pole: true, ..base },
        Kind { flat: true, ..base },
        Kind { aspect: 1e4, ..base },
        Kind { away: 1e4, ..base },
        Kind { rational: true, ..base },
        Kind { rational: true, pole: true, degree: [2, 2], ..base },
        Kind { rational: true, spans: [2, 2], away: 1e4, ..base },
    ];
    for p in 1..=7 {
        kinds.push(Kind { degree: [p, 8 - p], ..base });
        kinds.push(Kind { degree: [p, p], rational: p < 5, aspect: 10.0, ..base });
    }
    kinds
}

fn samples(surface: &Surface, count: usize, random: &mut Random) -> Vec<DVec2> {
    let [u, v] = surface.domain();
    let at = |[low, high]: [f64; 2], t: f64| low + (high - low) * t;
    (0..count)
        .map(|i| {
            // Corners and borders too.
            let snap = |t: f64| if i % 3 == 0 { (t * 4.0).round() / 4.0 } else { t };
            DVec2::new(at(u, snap(random.next())), at(v, snap(random.next())))
        })
        .collect()
}

#[test]
fn every_volume_holds_what_it_bounds() {
    let mut random = Random(1);
    for kind in kinds() {
        for _ in 0..3 {
            let surface = random_surface(kind, &mut random);
            let tree = SurfaceTree::new(&surface, &BvhOptions { height: 5, ..BvhOptions::default() }).unwrap();
            let samples = samples(&surface, 60, &mut random);
            validate(&surface, &tree, samples).unwrap_or_else(|broken| panic!("{kind:?}: {broken}"));
        }
    }
}

#[test]
fn lazy_full_plain_and_wide_builds_agree_to_the_byte() {
    let mut random = Random(2);
    for kind in [kinds()[1], kinds()[6], kinds()[9]] {
        let surface = random_surface(kind, &mut random);
        let options = BvhOptions { height: 3, ..BvhOptions::default() };
        let build = |options: &BvhOptions, full: bool| {
            let tree = SurfaceTree::new(&surface, options).unwrap();
            if full {
                assert!(tree.build_all(true, &Job::new()).unwrap());
            }
            tree
        };
        let lazy = build(&options, false);
        let full = build(&options, true);
        let plain = build(&BvhOptions { instructions: Instructions::Plain, ..options }, true);
        let narrow = build(&BvhOptions { instructions: Instructions::Narrow, ..options }, true);
        for (at, patch) in full.patches().iter().enumerate() {
            for index in 1..2 * patch.first_leaf() {
                let bits = |tree: &SurfaceTree| format!("{:?}", tree.patches()[at].node(index));
                assert_eq!(bits(&full), bits(&plain));
                assert_eq!(bits(&full), bits(&narrow));
                assert_eq!(bits(&full), bits(&lazy));
                let bits = |tree: &SurfaceTree| format!("{:?}", tree.patches()[at].torus(index));
                if index >= patch.first_leaf() {
                    assert_eq!(bits(&full), bits(&plain));
                    assert_eq!(bits(&full), bits(&narrow));
                    assert_eq!(bits(&full), bits(&lazy));
                }
            }
        }
    }
}
