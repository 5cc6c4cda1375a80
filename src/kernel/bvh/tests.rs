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
pub(super) struct Kind {
    degree: [usize; 2],
    spans: [usize; 2],
    rational: bool,
    pole: bool,
    flat: bool,
    aspect: f64,
    away: f64,
}

pub(super) fn random_surface(kind: Kind, random: &mut Random) -> Surface {
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

pub(super) fn kinds() -> Vec<Kind> {
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

pub(super) fn samples(surface: &Surface, count: usize, random: &mut Random) -> Vec<DVec2> {
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

/// A quarter turn about the z axis of a quadratic profile (radius, height, weight).
fn revolved(profile: [(f64, f64, f64); 3]) -> Surface {
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (radius, height, wp) in profile {
        for (x, y, wq) in [(1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)] {
            points.push(DVec3::new(radius * x, radius * y, height));
            weights.push(wp * wq);
        }
    }
    let k = || Knots::bezier(2, 0.0, 1.0).unwrap();
    Surface::new(k(), k(), points, Some(weights)).unwrap()
}

#[test]
fn spheres_and_cylinders_are_their_own_osculating_tori() {
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let sphere = revolved([(2.0, 0.0, 1.0), (2.0, 2.0, w), (0.0, 2.0, 1.0)]);
    let cylinder = revolved([(2.0, 0.0, 1.0), (2.0, 1.5, 1.0), (2.0, 3.0, 1.0)]);
    for surface in [sphere, cylinder] {
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 3, ..BvhOptions::default() }).unwrap();
        for leaf in tree.level(3) {
            let torus = tree.torus(leaf).unwrap();
            assert!(torus.k.iter().all(|k| k.abs() < 1e-6 || (k.abs() - 0.5).abs() < 1e-6), "{torus:?}");
            // The stored bound is of fourth order, the truth is the rounding of f32.
            let [low, high] = tree.rectangle(leaf);
            for uv in [low, 0.5 * (low + high), high] {
                assert!(torus.distance(surface.eval(uv)).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn the_deviation_falls_as_the_cube_of_the_size() {
    let mut random = Random(11);
    for kind in [kinds()[0], kinds()[6], kinds()[14]] {
        let surface = random_surface(kind, &mut random);
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 7, ..BvhOptions::default() }).unwrap();
        let mean = |level: u32| {
            let nodes = tree.level(level);
            let sum: f64 = nodes.iter().map(|&id| tree.torus(id).unwrap().deviation.ln()).sum();
            (sum / nodes.len() as f64).exp()
        };
        let (coarse, fine) = (mean(5), mean(7));
        assert!((40.0..110.0).contains(&(coarse / fine)), "{kind:?}: {coarse} / {fine}");
    }
}

#[test]
fn the_hausdorff_bound_holds_both_ways() {
    let mut random = Random(12);
    for kind in kinds() {
        let surface = random_surface(kind, &mut random);
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 5, ..BvhOptions::default() }).unwrap();
        for level in [3, 5] {
            for uv in samples(&surface, 12, &mut random) {
                let id = tree.node_over(level, uv);
                let bound = tree.patches()[id.patch as usize].hausdorff(id.index).unwrap();
                let torus = tree.torus(id).unwrap();
                let [low, high] = tree.rectangle(id);
                for (s, t) in [(0.0, 0.3), (1.0, 1.0), (random.next(), random.next())] {
                    let local = DVec2::new(s, t);
                    // The same parameters on both: that bounds either one-sided distance.
                    let gap = surface.eval(low + (high - low) * local).distance(torus.eval(torus.matched(local)));
                    let rounding = 1e-14 * surface.bounds().max_abs();
                    assert!(gap <= bound + rounding, "{kind:?} level {level}: {gap} > {bound}");
                }
            }
        }
    }
}

#[test]
fn a_toroidal_cover_reaches_its_tolerance_or_says_where_not() {
    let surface = random_surface(kinds()[0], &mut Random(13));
    let tree = SurfaceTree::new(&surface, &BvhOptions { height: 8, ..BvhOptions::default() }).unwrap();
    let cover = tree.toroidal_cover(1e-3, &Job::new());
    assert!(cover.complete && cover.missed.is_empty() && cover.largest <= 1e-3);
    let area = |id: &NodeId| 1.0 / f64::from(1_u32 << id.depth());
    assert_eq!(cover.tori.iter().map(area).sum::<f64>(), 1.0);
    let coarse = SurfaceTree::new(&surface, &BvhOptions { height: 1, ..BvhOptions::default() }).unwrap();
    let cover = coarse.toroidal_cover(1e-9, &Job::new());
    assert_eq!((cover.tori.len(), cover.missed.len()), (0, 4));
    let stopped = Job::new();
    stopped.cancel();
    assert!(!tree.toroidal_cover(1e-3, &stopped).complete);
}

#[test]
fn the_closest_point_is_the_nearest_of_all() {
    let mut random = Random(18);
    for kind in kinds() {
        let surface = random_surface(kind, &mut random);
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 5, ..BvhOptions::default() }).unwrap();
        let bounds = surface.bounds();
        let dense: Vec<DVec3> = samples(&surface, 1500, &mut random).iter().map(|&uv| surface.eval(uv)).collect();
        for _ in 0..12 {
            let p = bounds.center() + random.vector() * bounds.size();
            let found = tree.closest(&surface, p, f64::INFINITY).unwrap();
            let distance = found.foot.distance;
            assert_eq!(surface.eval(found.foot.uv), found.foot.point);
            let slow = dense.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
            let rounding = 1e-14 * bounds.max_abs();
            assert!(distance <= slow + rounding, "{kind:?}: {distance} {slow}");
            assert!(found.lower <= distance && found.lower <= slow, "{kind:?}");
            // The bound is as good as the leaves are small.
            let size = 2.0 * tree.node(found.leaf).sphere_radius();
            assert!(found.lower >= distance - size - rounding, "{kind:?}: {found:?} {size}");
            assert!(tree.closest(&surface, p, 0.999 * found.lower - rounding).is_none());
        }
    }
}

/// Two wavy graphs that cross.
fn crossing() -> [Surface; 2] {
    let mut random = Random(21);
    let kind = Kind { degree: [3, 3], spans: [3, 2], ..Kind::default() };
    [random_surface(kind, &mut random), random_surface(kind, &mut random)]
}

#[test]
fn the_traversal_finds_every_overlapping_leaf_pair() {
    let [a, b] = crossing();
    let options = BvhOptions { height: 2, ..BvhOptions::default() };
    let (ta, tb) = (SurfaceTree::new(&a, &options).unwrap(), SurfaceTree::new(&b, &options).unwrap());
    let margin = 0.01;
    let traverse_options = TraverseOptions { margin, ..TraverseOptions::default() };
    let found = traverse(&ta, &tb, &traverse_options, |_| Verdict::Descend, &Job::new());
    assert!(found.complete && found.leaf_pairs == found.pairs.len());
    let set: std::collections::HashSet<Pair> = found.pairs.iter().copied().collect();
    assert_eq!(set.len(), found.pairs.len());
    // Volumes of children may stick out of their parent's, so the oracle is the surfaces themselves.
    let points = |surface: &Surface, tree: &SurfaceTree, id: NodeId| -> Vec<DVec3> {
        let [low, high] = tree.rectangle(id);
        let at = |k: u32| DVec2::new(f64::from(k % 4) / 3.0, f64::from(k / 4) / 3.0);
        (0..16).map(|k| surface.eval(low + (high - low) * at(k))).collect()
    };
    let of_b: Vec<(NodeId, Vec<DVec3>)> = tb.level(2).into_iter().map(|id| (id, points(&b, &tb, id))).collect();
    let mut near = 0;
    for x in ta.level(2) {
        let of_a = points(&a, &ta, x);
        for (y, of_b) in &of_b {
            if of_a.iter().any(|p| of_b.iter().any(|q| p.distance(*q) <= margin)) {
                near += 1;
                assert!(set.contains(&Pair { a: x, b: *y }), "{x:?} {y:?}");
            }
        }
    }
    assert!(near >= 10, "{near}");
    // What is reported does overlap, but for the corners that the quick test does not see.
    let overlap = |pair: &&Pair| {
        let place = |tree: &SurfaceTree, id| {
            let mut r = tree.node(id).rectangle();
            r.center += tree.origin(id);
            (r, tree.node(id).radius())
        };
        let ((p, rp), (q, rq)) = (place(&ta, pair.a), place(&tb, pair.b));
        p.distance(&q) <= rp + rq + margin * 1.001
    };
    let tight = found.pairs.iter().filter(overlap).count();
    assert!(10 * tight > 8 * found.pairs.len(), "{tight} of {}", found.pairs.len());
}

#[test]
fn neither_threads_nor_laziness_change_a_traversal() {
    let [a, b] = crossing();
    let run = |threads: usize, full: bool, parallel: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let tree = |s| SurfaceTree::new(s, &BvhOptions { height: 4, ..BvhOptions::default() }).unwrap();
            let (ta, tb) = (tree(&a), tree(&b));
            if full {
                assert!(ta.build_all(true, &Job::new()).unwrap() && tb.build_all(true, &Job::new()).unwrap());
            }
            let options = TraverseOptions { parallel, ..TraverseOptions::default() };
            let found = traverse(&ta, &tb, &options, |pair| early_exit(&ta, &tb, pair), &Job::new());
            let bytes: Vec<String> =
                found.pairs.iter().map(|p| format!("{:?}{:?}", ta.node(p.a), tb.node(p.b))).collect();
            (found, bytes)
        })
    };
    let plain = run(1, true, false);
    assert!(plain.0.pairs.len() > 20 && plain.0.leaf_pairs < plain.0.pairs.len());
    assert_eq!(plain, run(2, true, true));
    assert_eq!(plain, run(2, false, true));
    assert_eq!(plain, run(1, false, false));
}

#[test]
fn a_cancelled_traversal_says_so() {
    let [a, b] = crossing();
    let tree = |s| SurfaceTree::new(s, &BvhOptions { height: 6, ..BvhOptions::default() }).unwrap();
    let (ta, tb) = (tree(&a), tree(&b));
    let job = Job::new();
    job.cancel();
    let options = TraverseOptions { margin: 0.1, ..TraverseOptions::default() };
    assert!(!traverse(&ta, &tb, &options, |_| Verdict::Descend, &job).complete);
    assert!(!ta.build_all(false, &job).unwrap());
}

#[test]
fn boxes_and_hulls_never_miss_and_hulls_are_tightest() {
    let [a, b] = crossing();
    let options = BvhOptions { height: 3, ..BvhOptions::default() };
    let count = |kind| {
        let tree = |s| VolumeTree::build(s, &options, kind, &Job::new()).unwrap();
        tree(&a).overlap(&tree(&b), None, 0.0, &Job::new())
    };
    let (boxes, hulls) = (count(VolumeKind::Aabb), count(VolumeKind::Hull));
    let boxes_set: std::collections::HashSet<Pair> = boxes.pairs.iter().copied().collect();
    assert!(hulls.pairs.len() < boxes.pairs.len());
    assert!(hulls.pairs.iter().all(|p| boxes_set.contains(p)));
    // Every point of one that lies on the other is in a pair.
    let (ta, tb) = (SurfaceTree::new(&a, &options).unwrap(), SurfaceTree::new(&b, &options).unwrap());
    let found = traverse(&ta, &tb, &TraverseOptions::default(), |_| Verdict::Descend, &Job::new());
    assert!(hulls.pairs.len() <= found.pairs.len());
}

#[test]
fn flatness_cuts_where_the_surface_is_flat_enough() {
    let surface = random_surface(kinds()[0], &mut Random(14));
    let options = BvhOptions { flatness: Some(2e-3), ..BvhOptions::default() };
    let tree = SurfaceTree::new(&surface, &options).unwrap();
    let leaves = tree.level(6);
    assert!(leaves.len() < 4096 && leaves.len() > 16);
    for &leaf in &leaves {
        assert!(tree.children(leaf).is_none());
        assert!(leaf.depth() == 12 || tree.node(leaf).radius() <= 2e-3);
        assert!(tree.torus(leaf).is_some());
        if leaf.depth() > 2 {
            let above = NodeId { index: leaf.index / 4, ..leaf };
            assert!(tree.node(above).radius() > 2e-3);
        }
    }
    assert!(tree.build_all(true, &Job::new()).unwrap());
    assert!(tree.memory().total() < 4096 * 2 * 64);
    validate(&surface, &tree, samples(&surface, 50, &mut Random(15))).unwrap();
}

#[test]
fn knots_that_are_not_clamped_repeat_or_run_around_are_normal_input() {
    let mut random = Random(19);
    let open = Knots::new(3, (0..10).map(f64::from).collect()).unwrap();
    let repeated = Knots::new(2, vec![-1.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0]).unwrap();
    for periodic in [false, true] {
        let (nu, nv) = (open.control_count(), repeated.control_count());
        let mut points: Vec<DVec3> = (0..nu * nv)
            .map(|at| {
                let angle = (at % nu) as f64 * std::f64::consts::TAU / 3.0;
                DVec3::new(angle.cos(), angle.sin(), (at / nu) as f64) + random.vector() * 0.1
            })
            .collect();
        if periodic {
            // Uniform knots and the first three columns again: closed with continuous curvature.
            for at in 0..nu * nv {
                if at % nu >= 3 {
                    points[at] = points[at - 3];
                }
            }
        }
        let surface = Surface::new(open.clone(), repeated.clone(), points, None).unwrap();
        let [u, v] = surface.domain();
        let seam = surface.eval(DVec2::new(u[0], v[0])).distance(surface.eval(DVec2::new(u[1], v[0])));
        assert_eq!(seam < 1e-14, periodic);
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 4, ..BvhOptions::default() }).unwrap();
        assert_eq!(tree.grid(), [3, 2]);
        validate(&surface, &tree, samples(&surface, 80, &mut random)).unwrap_or_else(|broken| panic!("{broken}"));
    }
}

#[test]
fn memory_is_counted_to_the_byte() {
    let surface = random_surface(kinds()[0], &mut Random(16));
    let tree = SurfaceTree::new(&surface, &BvhOptions::default()).unwrap();
    tree.build_all(true, &Job::new()).unwrap();
    let memory = tree.memory();
    assert_eq!((memory.nodes, memory.tori), (8191, 4096));
    assert!(memory.node_bytes >= 8192 * 64 && memory.torus_bytes >= 4096 * size_of::<LeafTorus>());
    assert!(size_of::<Node>() <= 80 && size_of::<LeafTorus>() <= 100);
    assert!(memory.total() < 1_200_000, "{memory:?}");
}

#[test]
fn nodes_and_parameters_find_each_other() {
    let mut random = Random(17);
    let surface = random_surface(kinds()[1], &mut random);
    let tree = SurfaceTree::new(&surface, &BvhOptions { height: 4, ..BvhOptions::default() }).unwrap();
    for level in 0..=4 {
        let nodes = tree.level(level);
        assert_eq!(nodes.len(), 6 << (2 * level));
        for &id in nodes.iter().step_by(7) {
            let [low, high] = tree.rectangle(id);
            assert_eq!(tree.node_over(level, 0.5 * (low + high)), id);
        }
    }
    let [[u0, u1], [v0, v1]] = surface.domain();
    assert_eq!(tree.rectangle(tree.root()), [DVec2::new(u0, v0), DVec2::new(u1, v1)]);
}

#[test]
fn what_cannot_be_bounded_is_named() {
    let k = || Knots::bezier(1, 0.0, 1.0).unwrap();
    let line = (0..4).map(|i| DVec3::X * f64::from(i)).collect();
    let line = Surface::new(k(), k(), line, None).unwrap();
    let error = SurfaceTree::new(&line, &BvhOptions::default()).unwrap_err();
    assert!(matches!(error, BvhError::Extent { patch: 0, area: 0.0, .. }), "{error}");
    let huge =
        Surface::new(k(), k(), [0.0, 1e200, 2e200, 1e201].map(|x| DVec3::new(x, x * x.sin(), 1.0)).to_vec(), None);
    let error = SurfaceTree::new(&huge.unwrap(), &BvhOptions::default()).unwrap_err();
    assert!(error.to_string().contains("1e30") || error.to_string().contains("1000000"), "{error}");
    let square = Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]).unwrap();
    let options = BvhOptions { height: 16, ..BvhOptions::default() };
    assert_eq!(SurfaceTree::new(&square, &options).unwrap_err(), BvhError::Height { got: 16, limit: 15 });
    let options = BvhOptions { height: 15, ..BvhOptions::default() };
    let tree = SurfaceTree::new(&square, &options).unwrap();
    let error = tree.build_all(true, &Job::new()).unwrap_err();
    assert!(matches!(error, BvhError::Memory { height: 15, patches: 1, limit, .. } if limit == 4 << 30), "{error}");
    let options = BvhOptions { flatness: Some(f64::NAN), ..BvhOptions::default() };
    assert!(matches!(SurfaceTree::new(&square, &options), Err(BvhError::Flatness { .. })));
}
