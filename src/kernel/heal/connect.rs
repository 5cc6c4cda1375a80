//! How several patches hang together, HJR99 3.7: shared corners and boundary curves, and the rules for them.
//!
//! Corners within the joining tolerance are one vertex (their mean). Two sides with the same vertices that stay
//! within that tolerance of each other are one edge; its curve, its boundary mode, its number of spans, its
//! samples and its Bezier points exist once, so that neighbours agree bit for bit. Opposite sides of a patch have
//! equally many spans, which ties edges into chains; each chain has one number, not the whole model.
//!
//! Refused by name: more than two patches at an edge, a corner inside another patch's side (the full-face rule),
//! and neighbours that disagree about the mode of their common edge.

use glam::DVec3;

use super::boundary_loop::{BoundaryLoop, distance_to_polyline};
use super::report::BoundaryMode;
use super::side::SideCurve;

/// Which rule a set of patches breaks. Sides count from 1 as they were given.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConnectError {
    /// Three or more patches share an edge.
    #[error("more than two patches share one boundary curve near {at}: {}; leave one of them out", listed(patches))]
    Bifurcation {
        /// Their names.
        patches: Vec<String>,
        /// The middle of the edge.
        at: DVec3,
    },
    /// A corner lies inside a side.
    #[error(
        "a corner of patch \"{corner_of}\" lies inside side {side} of patch \"{patch}\", at {at}: corners may only \
         meet corners (full-face rule); split that side there or move the corner"
    )]
    FullFace {
        /// The patch with the corner.
        corner_of: String,
        /// The patch with the side.
        patch: String,
        /// Which side.
        side: usize,
        /// Where.
        at: DVec3,
    },
    /// Neighbours disagree.
    #[error(
        "patches \"{}\" (side {}) and \"{}\" (side {}) share a boundary but one keeps it and the other projects it",
        patches[0], sides[0], patches[1], sides[1]
    )]
    Mode {
        /// Their names.
        patches: [String; 2],
        /// Their sides.
        sides: [usize; 2],
    },
}

fn listed(names: &[String]) -> String {
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}

/// A boundary curve, shared or not.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Its curve, from `ends[0]` to `ends[1]`.
    pub curve: SideCurve,
    /// Its vertices.
    pub ends: [usize; 2],
    /// What becomes of it.
    pub mode: BoundaryMode,
    /// The patches at it, at most two.
    pub uses: Vec<Use>,
    /// Its chain of opposite sides.
    pub chain: usize,
}

/// One patch at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// Which patch.
    pub patch: usize,
    /// Which of its sides: 0 is v = 0, 1 is u = 1, 2 is v = 1, 3 is u = 0.
    pub slot: usize,
    /// Whether the side's increasing parameter runs against the edge.
    pub reversed: bool,
}

/// Vertices, edges, and which belong to which patch.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Where the vertices are.
    pub vertices: Vec<DVec3>,
    /// The edges.
    pub edges: Vec<Edge>,
    /// Per patch, for the sides v = 0, u = 1, v = 1, u = 0 in increasing parameter: the edge, and whether the side
    /// runs against it.
    pub patches: Vec<[(usize, bool); 4]>,
    /// Per patch, the vertices at (0,0), (1,0), (1,1), (0,1).
    pub corners: Vec<[usize; 4]>,
    /// How many chains of opposite sides there are.
    pub chains: usize,
}

/// The corners at both ends of a slot, in increasing parameter.
const SLOT_CORNERS: [[usize; 2]; 4] = [[0, 1], [1, 2], [3, 2], [0, 3]];
/// Spans of the polylines that are compared.
const CHECK: usize = 128;

/// Finds what the loops share and checks the rules. `names` and `modes` (by given side) belong to the loops.
pub fn connect(
    loops: &[BoundaryLoop],
    names: &[String],
    modes: &[[BoundaryMode; 4]],
    tolerance: f64,
) -> Result<Topology, ConnectError> {
    let (vertices, corners) = merge_corners(loops, tolerance);
    let mut edges: Vec<Edge> = Vec::new();
    let mut lines: Vec<Vec<DVec3>> = Vec::new();
    let mut patches = Vec::new();
    for (p, closed) in loops.iter().enumerate() {
        let mut own = [(0, false); 4];
        for slot in 0..4 {
            let side = if slot < 2 { closed.sides[slot].clone() } else { closed.sides[slot].reversed() };
            let ends = SLOT_CORNERS[slot].map(|c| corners[p][c]);
            let mode = modes[p][closed.choice.order[slot]];
            let line = side.samples(CHECK);
            let same = |k: &usize| {
                let e = &edges[*k];
                (e.ends == ends || e.ends == [ends[1], ends[0]]) && follows(&line, &lines[*k], tolerance)
            };
            if let Some(k) = (0..edges.len()).find(same) {
                let reversed = edges[k].ends != ends;
                let given = |u: &Use| (names[u.patch].clone(), loops[u.patch].choice.order[u.slot] + 1);
                let this = Use { patch: p, slot, reversed };
                if edges[k].uses.len() >= 2 {
                    let patches = edges[k].uses.iter().chain([&this]).map(|u| given(u).0).collect();
                    return Err(ConnectError::Bifurcation { patches, at: lines[k][CHECK / 2] });
                }
                if edges[k].mode != mode {
                    let (a, b) = (given(&edges[k].uses[0]), given(&this));
                    return Err(ConnectError::Mode { patches: [a.0, b.0], sides: [a.1, b.1] });
                }
                edges[k].uses.push(this);
                own[slot] = (k, reversed);
            } else {
                let curve = side.with_ends(ends.map(|v| vertices[v]));
                own[slot] = (edges.len(), false);
                edges.push(Edge { curve, ends, mode, uses: vec![Use { patch: p, slot, reversed: false }], chain: 0 });
                lines.push(line);
            }
        }
        patches.push(own);
    }
    full_faces(loops, names, &vertices, &corners, &edges, &lines, tolerance)?;
    let chains = number_chains(&mut edges, &patches);
    Ok(Topology { vertices, edges, patches, corners, chains })
}

/// Corners closer than the tolerance become one, at their mean.
fn merge_corners(loops: &[BoundaryLoop], tolerance: f64) -> (Vec<DVec3>, Vec<[usize; 4]>) {
    let mut clusters: Vec<Vec<DVec3>> = Vec::new();
    let corners = loops
        .iter()
        .map(|closed| {
            closed.corners.map(|p| match clusters.iter().position(|c| c.iter().any(|q| q.distance(p) <= tolerance)) {
                Some(k) => {
                    clusters[k].push(p);
                    k
                }
                None => {
                    clusters.push(vec![p]);
                    clusters.len() - 1
                }
            })
        })
        .collect();
    // Around the first point, so that equal corners keep their bits.
    let mean = |c: &Vec<DVec3>| c[0] + c.iter().map(|p| *p - c[0]).sum::<DVec3>() / c.len() as f64;
    (clusters.iter().map(mean).collect(), corners)
}

/// Whether two polylines stay within the tolerance of each other.
fn follows(a: &[DVec3], b: &[DVec3], tolerance: f64) -> bool {
    // Chords of curves of different parametrization differ by their own error.
    let chord = |l: &[DVec3]| l.windows(3).map(|w| w[1].distance(0.5 * (w[0] + w[2]))).fold(0.0, f64::max);
    let near = tolerance + chord(a).max(chord(b));
    let within = |a: &[DVec3], b: &[DVec3]| a.iter().step_by(4).all(|&p| distance_to_polyline(p, b) <= near);
    within(a, b) && within(b, a)
}

fn full_faces(
    loops: &[BoundaryLoop],
    names: &[String],
    vertices: &[DVec3],
    corners: &[[usize; 4]],
    edges: &[Edge],
    lines: &[Vec<DVec3>],
    tolerance: f64,
) -> Result<(), ConnectError> {
    for (v, &at) in vertices.iter().enumerate() {
        for (edge, line) in edges.iter().zip(lines) {
            if edge.ends.contains(&v) || distance_to_polyline(at, line) > tolerance {
                continue;
            }
            let owner = corners.iter().position(|c| c.contains(&v)).unwrap_or(0);
            let user = edge.uses[0];
            return Err(ConnectError::FullFace {
                corner_of: names[owner].clone(),
                patch: names[user.patch].clone(),
                side: loops[user.patch].choice.order[user.slot] + 1,
                at,
            });
        }
    }
    Ok(())
}

/// Ties opposite sides together and numbers the chains from 0.
fn number_chains(edges: &mut [Edge], patches: &[[(usize, bool); 4]]) -> usize {
    let mut parent: Vec<usize> = (0..edges.len()).collect();
    fn root(parent: &[usize], mut k: usize) -> usize {
        while parent[k] != k {
            k = parent[k];
        }
        k
    }
    for own in patches {
        for [a, b] in [[0, 2], [1, 3]] {
            let (a, b) = (root(&parent, own[a].0), root(&parent, own[b].0));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut numbers = vec![usize::MAX; edges.len()];
    let mut count = 0;
    for k in 0..edges.len() {
        let r = root(&parent, k);
        if numbers[r] == usize::MAX {
            numbers[r] = count;
            count += 1;
        }
        edges[k].chain = numbers[r];
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Curve;
    use crate::kernel::heal::boundary_loop::close;

    /// The loop of a rectangle in the plane, sides in the given order.
    fn rectangle(low: (f64, f64), high: (f64, f64)) -> BoundaryLoop {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let c = [p(low.0, low.1), p(high.0, low.1), p(high.0, high.1), p(low.0, high.1)];
        let side = |k: usize| SideCurve::chain(&[Curve::segment(c[k], c[(k + 1) % 4]).unwrap()], 1e-6).unwrap();
        close(&[side(0), side(1), side(2), side(3)], 1e-3, None).unwrap()
    }

    fn run(loops: &[BoundaryLoop], modes: &[[BoundaryMode; 4]]) -> Result<Topology, ConnectError> {
        let names: Vec<String> = (0..loops.len()).map(|k| format!("p{k}")).collect();
        connect(loops, &names, modes, 1e-3)
    }

    const KEEP: [BoundaryMode; 4] = [BoundaryMode::Keep; 4];

    #[test]
    fn a_row_of_patches_shares_edges_and_one_chain_across() {
        let loops: Vec<_> = (0..3).map(|k| rectangle((f64::from(k), 0.0), (f64::from(k) + 1.0, 1.0))).collect();
        let t = run(&loops, &[KEEP; 3]).unwrap();
        assert_eq!((t.vertices.len(), t.edges.len(), t.chains), (8, 10, 4));
        let vertical: Vec<usize> =
            t.patches.iter().flat_map(|p| [t.edges[p[1].0].chain, t.edges[p[3].0].chain]).collect();
        assert!(vertical.iter().all(|&c| c == vertical[0]));
        assert_eq!(t.edges.iter().filter(|e| e.uses.len() == 2).count(), 2);
    }

    #[test]
    fn slightly_different_corners_become_one_vertex() {
        let loops = [rectangle((0.0, 0.0), (1.0, 1.0)), rectangle((1.0004, 0.0004), (2.0, 1.0))];
        let t = run(&loops, &[KEEP; 2]).unwrap();
        assert_eq!((t.vertices.len(), t.edges.len()), (6, 7));
        for e in &t.edges {
            assert_eq!(e.curve.ends(), e.ends.map(|v| t.vertices[v]));
        }
    }

    #[test]
    fn broken_rules_are_named() {
        let square = rectangle((0.0, 0.0), (1.0, 1.0));
        let loops = [square.clone(), rectangle((1.0, 0.0), (2.0, 1.0)), square];
        match run(&loops, &[KEEP; 3]) {
            // The square twice is fine for its own edges, but its right one would have three patches.
            Err(ConnectError::Bifurcation { patches, .. }) => assert_eq!(patches, ["p0", "p1", "p2"]),
            other => panic!("{other:?}"),
        }
        let loops = [rectangle((0.0, 0.0), (1.0, 1.0)), rectangle((1.0, 0.0), (2.0, 2.0))];
        match run(&loops, &[KEEP; 2]) {
            Err(ConnectError::FullFace { corner_of, patch, side: 4, .. }) => {
                assert_eq!((corner_of.as_str(), patch.as_str()), ("p0", "p1"));
            }
            other => panic!("{other:?}"),
        }
        let loops = [rectangle((0.0, 0.0), (1.0, 1.0)), rectangle((1.0, 0.0), (2.0, 1.0))];
        let mut modes = [KEEP; 2];
        modes[1][3] = BoundaryMode::Project;
        match run(&loops, &modes) {
            Err(ConnectError::Mode { sides: [2, 4], .. }) => {}
            other => panic!("{other:?}"),
        }
    }
}
