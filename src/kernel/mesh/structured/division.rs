//! How an edge is divided: into how many pieces, how they are spaced, and where on each of its borders the points lie.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::super::edge_net::EdgeNet;
use super::super::tessellate::{TessellateOptions, grid_lines};
use super::{Counts, GridOptions, Spacing};
use crate::kernel::geom::{Side, Surface};

/// The division of one border.
pub(super) struct Division {
    /// Parameters along the border.
    pub(super) t: Vec<f64>,
    /// The points on the border.
    pub(super) own: Vec<DVec3>,
}

/// The number of points of every border, equal within a class, and whether the cap cut one short.
pub(super) fn counts(surfaces: &[Arc<Surface>], net: &EdgeNet, options: &GridOptions) -> (Vec<usize>, bool) {
    let Counts::ChordTolerance(tol) = options.counts else {
        let Counts::Points(n) = options.counts else { return (Vec::new(), false) };
        return (vec![n; net.borders.len()], false);
    };
    let wanted: Vec<[usize; 2]> = surfaces
        .par_iter()
        .map(|surface| {
            let options = TessellateOptions { max_parts: options.most, ..TessellateOptions::new(tol) };
            let (lines, _) = grid_lines(surface, &options);
            [0, 1].map(|k| {
                // As many even parts as make none longer than the shortest that is asked for.
                let [start, end] = surface.domain()[k];
                let shortest = lines[k].windows(2).map(|p| p[1] - p[0]).fold(end - start, f64::min);
                ((end - start) / shortest * (1.0 - 1e-9)).ceil().max(1.0) as usize
            })
        })
        .collect();
    let mut of_class: BTreeMap<usize, usize> = BTreeMap::new();
    for (b, class) in net.class.iter().enumerate() {
        let parts = of_class.entry(class.of).or_insert(1);
        *parts = (*parts).max(wanted[b / 4][b % 2]);
    }
    let capped = of_class.values().any(|&n| n + 1 > options.most);
    (net.class.iter().map(|c| (of_class[&c.of] + 1).min(options.most)).collect(), capped)
}

/// The fractions 0..=1 of an edge at which it is divided, in the direction of a border.
fn distribution(net: &EdgeNet, border: usize, n: usize, options: &GridOptions) -> Vec<f64> {
    let class = net.class[border];
    let [mut at_start, mut at_end] = [false; 2];
    for &(surface, side) in &options.clusters {
        // Lines gather at the ends of the two borders that run towards the side.
        let (across, end) = match side {
            Side::UMin => ([0, 2], false),
            Side::UMax => ([0, 2], true),
            Side::VMin => ([1, 3], false),
            Side::VMax => ([1, 3], true),
        };
        for k in across {
            let other = net.class[4 * surface + k];
            if other.of == class.of {
                let end = end ^ other.reversed ^ class.reversed;
                (at_start, at_end) = (at_start | !end, at_end | end);
            }
        }
    }
    if net.mirrored[border] && (at_start || at_end) {
        (at_start, at_end) = (true, true);
    }
    let even = |k: usize| k as f64 / (n - 1) as f64;
    let Spacing::Tanh(d) = options.spacing else { return (0..n).map(even).collect() };
    let towards_start = |x: f64| 1.0 + (d * (x - 1.0)).tanh() / d.tanh();
    let f = |x: f64| match (at_start, at_end) {
        (false, false) => x,
        (true, false) => towards_start(x),
        (false, true) => 1.0 - towards_start(1.0 - x),
        (true, true) => 0.5 * (1.0 + (d * (x - 0.5)).tanh() / (0.5 * d).tanh()),
    };
    let mut out: Vec<f64> = (0..n).map(|k| f(even(k))).collect();
    (out[0], out[n - 1]) = (0.0, 1.0);
    out
}

pub(super) fn divide(net: &EdgeNet, b: usize, n: usize, options: &GridOptions) -> Division {
    let border = &net.borders[b];
    let [start, end] = border.curve.domain();
    let length = border.arc.length();
    let by_parameter = options.spacing == Spacing::Uniform || !(length > 0.0);
    let fractions = distribution(net, b, n, options);
    let t: Vec<f64> = fractions
        .iter()
        .enumerate()
        .map(|(k, f)| match k {
            0 => start,
            k if k + 1 == n => end,
            _ if by_parameter => start + (end - start) * f,
            _ => border.arc.parameter_at(&border.curve, f * length),
        })
        .collect();
    let own = t.iter().map(|&t| border.curve.eval(t)).collect();
    Division { t, own }
}

/// The fraction of the arc length at a parameter.
pub(super) fn fraction_at(net: &EdgeNet, b: usize, t: f64) -> f64 {
    let border = &net.borders[b];
    let length = border.arc.length();
    if length > 0.0 { border.arc.length_at(&border.curve, t) / length } else { 0.0 }
}
