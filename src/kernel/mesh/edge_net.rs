//! Which borders of several surfaces are one edge, and which must be divided alike.
//!
//! Two borders are one edge where their ends and seven points between, at equal fractions of their arc lengths, are
//! within the joining tolerance. Opposite borders of a surface need the same number of points if it is to carry a
//! structured grid, and so do borders that are one edge: these two relations, followed to their ends, make the
//! classes of edges that are divided alike (HJR99 3.7: "edge counts propagate through opposite sides"). Each
//! relation knows whether the two borders run the same way; a class that would have to be divided in both
//! directions (a Moebius strip) is marked, and wants a division that is its own mirror image.
//!
//! Cost: pairs of borders whose middles are near in x. Borders without length (poles) are edges of their own.

use std::sync::Arc;

use glam::DVec3;

use crate::kernel::geom::arc_length::ArcLength;
use crate::kernel::geom::{Curve, Side, Surface};

/// Fractions of the arc length at which two borders are compared.
const COMPARED: usize = 9;

/// One border of one surface.
#[derive(Clone, Debug)]
pub struct Border {
    /// The curve, in increasing parameter of its surface.
    pub curve: Curve,
    /// Its arc length.
    pub arc: ArcLength,
}

/// A relation: to what, and whether it runs against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Along {
    /// The edge or class.
    pub of: usize,
    /// Whether the border runs against it.
    pub reversed: bool,
}

/// Two borders that are one edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// The borders: surface number times four plus the place of the side in [`Side::ALL`].
    pub borders: [usize; 2],
    /// How far they are apart at most, where compared.
    pub gap: f64,
}

/// All borders with their relations.
#[derive(Clone, Debug, Default)]
pub struct EdgeNet {
    /// Four borders for each surface, in the order of [`Side::ALL`].
    pub borders: Vec<Border>,
    /// The edge that each is: the number of the first border that is the same edge.
    pub edge: Vec<Along>,
    /// The class that each is divided with.
    pub class: Vec<Along>,
    /// Whether a class must be its own mirror image.
    pub mirrored: Vec<bool>,
    /// The vertex at the start and end of each border; equal vertices have equal numbers.
    pub vertices: Vec<[usize; 2]>,
    /// The borders that are one edge.
    pub seams: Vec<Seam>,
}

/// Disjoint sets whose members run along or against each other.
struct Sets {
    parent: Vec<Along>,
    mirrored: Vec<bool>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).map(|of| Along { of, reversed: false }).collect(), mirrored: vec![false; count] }
    }

    fn find(&self, at: usize) -> Along {
        let mut found = Along { of: at, reversed: false };
        while self.parent[found.of].of != found.of {
            let next = self.parent[found.of];
            found = Along { of: next.of, reversed: found.reversed ^ next.reversed };
        }
        found
    }

    fn unite(&mut self, a: usize, b: usize, reversed: bool) {
        let (x, y) = (self.find(a), self.find(b));
        let reversed = reversed ^ x.reversed ^ y.reversed;
        if x.of == y.of {
            self.mirrored[x.of] |= reversed;
            return;
        }
        // The lower number leads.
        let (lead, follow) = (x.of.min(y.of), x.of.max(y.of));
        self.parent[follow] = Along { of: lead, reversed };
        self.mirrored[lead] |= self.mirrored[follow];
    }
}

impl EdgeNet {
    /// Finds the edges of surfaces whose borders may be `joining` apart.
    pub fn new(surfaces: &[Arc<Surface>], joining: f64) -> Self {
        let borders: Vec<Border> = surfaces
            .iter()
            .flat_map(|s| Side::ALL.map(|side| s.border(side)))
            // A border of a valid surface is a valid curve; an empty list is what remains of one that is not.
            .filter_map(Result::ok)
            .map(|curve| Border { arc: ArcLength::new(&curve), curve })
            .collect();
        if borders.len() != 4 * surfaces.len() {
            return Self::default();
        }
        let count = borders.len();
        let points: Vec<[DVec3; COMPARED]> = borders
            .iter()
            .map(|b| std::array::from_fn(|k| b.arc.point(&b.curve, k as f64 / (COMPARED - 1) as f64)))
            .collect();
        let (mut edges, mut classes, mut vertices) = (Sets::new(count), Sets::new(count), Sets::new(2 * count));
        for s in 0..surfaces.len() {
            classes.unite(4 * s, 4 * s + 2, false);
            classes.unite(4 * s + 1, 4 * s + 3, false);
            // Ends of the four borders that are the same corner of the surface.
            for (a, b) in [((0, 0), (3, 0)), ((0, 1), (1, 0)), ((2, 0), (3, 1)), ((2, 1), (1, 1))] {
                vertices.unite(2 * (4 * s + a.0) + a.1, 2 * (4 * s + b.0) + b.1, false);
            }
        }
        let middle = COMPARED / 2;
        let mut by_x: Vec<usize> = (0..count).filter(|&k| borders[k].arc.length() > 0.0).collect();
        by_x.sort_by(|&a, &b| points[a][middle].x.total_cmp(&points[b][middle].x).then(a.cmp(&b)));
        let mut seams = Vec::new();
        for (place, &a) in by_x.iter().enumerate() {
            let near = by_x[place + 1..].iter().take_while(|&&b| points[b][middle].x - points[a][middle].x <= joining);
            for &b in near {
                let gap = |reversed: bool| {
                    let q = |k: usize| if reversed { points[b][COMPARED - 1 - k] } else { points[b][k] };
                    (0..COMPARED).map(|k| points[a][k].distance(q(k))).fold(0.0, f64::max)
                };
                let (along, against) = (gap(false), gap(true));
                let (gap, reversed) = if along <= against { (along, false) } else { (against, true) };
                if gap <= joining {
                    edges.unite(a, b, reversed);
                    classes.unite(a, b, reversed);
                    for end in 0..2 {
                        vertices.unite(2 * a + end, 2 * b + (end ^ usize::from(reversed)), false);
                    }
                    seams.push(Seam { borders: [a.min(b), a.max(b)], gap });
                }
            }
        }
        seams.sort_by_key(|s| s.borders);
        Self {
            edge: (0..count).map(|k| edges.find(k)).collect(),
            class: (0..count).map(|k| classes.find(k)).collect(),
            mirrored: (0..count).map(|k| classes.mirrored[classes.find(k).of]).collect(),
            vertices: (0..count).map(|k| [0, 1].map(|end| vertices.find(2 * k + end).of)).collect(),
            borders,
            seams,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tile over [x, x + 1] x [y, y + 1], turned so that its u runs against y.
    fn tile(x: f64, y: f64, turned: bool) -> Arc<Surface> {
        let c = |i: f64, j: f64| DVec3::new(x + i, y + j, 0.0);
        let plain = [c(0.0, 0.0), c(1.0, 0.0), c(0.0, 1.0), c(1.0, 1.0)];
        let around = [c(0.0, 1.0), c(0.0, 0.0), c(1.0, 1.0), c(1.0, 0.0)];
        Arc::new(Surface::bilinear(if turned { around } else { plain }).unwrap())
    }

    #[test]
    fn neighbours_share_edges_vertices_and_classes() {
        // Three tiles in a row, the second one turned.
        let net = EdgeNet::new(&[tile(0.0, 0.0, false), tile(1.0, 0.0, true), tile(2.0, 0.0, false)], 1e-6);
        assert_eq!(net.seams.len(), 2);
        assert!(net.seams.iter().all(|s| s.gap < 1e-15));
        // One class runs through all three across the row, and each has one of its own along it.
        let classes: std::collections::BTreeSet<usize> = net.class.iter().map(|c| c.of).collect();
        assert_eq!(classes.len(), 4);
        let vertices: std::collections::BTreeSet<usize> = net.vertices.iter().flatten().copied().collect();
        assert_eq!(vertices.len(), 8);
        // The first tile's u = max is the turned tile's v = min, run backwards.
        assert_eq!(net.edge[4], Along { of: 1, reversed: true });
        assert!(net.mirrored.iter().all(|m| !m));
    }

    #[test]
    fn a_moebius_strip_is_its_own_mirror_image() {
        let at = |k: usize, side: f64| {
            let angle = std::f64::consts::TAU * k as f64 / 3.0;
            let (s, c) = (0.5 * angle).sin_cos();
            let radius = 2.0 + 0.5 * side * c;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.5 * side * s)
        };
        let strip: Vec<Arc<Surface>> = (0..3)
            .map(|k| Arc::new(Surface::bilinear([at(k, -1.0), at(k + 1, -1.0), at(k, 1.0), at(k + 1, 1.0)]).unwrap()))
            .collect();
        let net = EdgeNet::new(&strip, 1e-9);
        assert_eq!(net.seams.len(), 3);
        assert_eq!(net.mirrored.iter().filter(|m| **m).count(), 6, "the six borders across the strip");
    }

    #[test]
    fn gaps_within_the_tolerance_are_edges_and_measured() {
        let lifted =
            |z: f64| Arc::new(tile(1.0, 0.0, false).transformed(&glam::DAffine3::from_translation(DVec3::Z * z)));
        let net = EdgeNet::new(&[tile(0.0, 0.0, false), lifted(1e-4)], 1e-3);
        assert!((net.seams[0].gap - 1e-4).abs() < 1e-15 && net.seams.len() == 1);
        assert!(EdgeNet::new(&[tile(0.0, 0.0, false), lifted(2e-3)], 1e-3).seams.is_empty());
    }
}
