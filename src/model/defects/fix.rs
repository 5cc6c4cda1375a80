//! The sides of a patch that would mend a defect, as a specification that the picking tool starts with.
//!
//! A gap between two faces with four edges each is closed by one patch over both: the edges across from the gap and the
//! edges along it, chained over the gap (HJR99, section 3.8, "surfaces with a gap"). A free edge is the beginning of a loop
//! of free edges; the loop becomes four sides by its four sharpest corners, and loops of fewer than four edges are
//! split at the middles of their longest pieces. Other defects have no sides that follow from them.

use glam::DVec3;

use super::{Defect, DefectKind, DefectOptions};
use crate::kernel::geom::Curve;
use crate::kernel::geom::trim::{EdgeRole, Sheet};
use crate::kernel::job::Job;
use crate::model::document::Document;
use crate::model::spec::{PatchSpec, Piece};
use crate::model::topology::{self, EdgeAt, Meets};

/// Why there is no such patch. Each is a whole sentence for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FixError {
    /// The kind of defect says nothing about sides.
    #[error("no sides follow from this kind of defect; pick them by hand around the place")]
    Kind,
    /// A face has another number of edges.
    #[error("one of the two faces does not have four edges; pick the sides by hand")]
    NotFourSided,
    /// The free edges end somewhere.
    #[error("the free edges here do not close to a loop; pick the sides by hand")]
    Open,
    /// The document has changed.
    #[error("the edge is no longer there; look for defects again")]
    Gone,
}

/// The edges of the outer loop of a sheet that are curves, in order around it.
fn outer(sheet: &Sheet, face: usize) -> Vec<(EdgeAt, Curve)> {
    let Some(trimmed) = sheet.face() else {
        let sides = crate::kernel::geom::Side::ALL.iter().enumerate();
        let of = |(edge, side): (usize, &crate::kernel::geom::Side)| {
            sheet.surface().border(*side).ok().map(|curve| (EdgeAt { face, ring: 0, edge }, curve))
        };
        return sides.filter_map(of).collect();
    };
    let Some(ring) = trimmed.rings().first() else { return Vec::new() };
    let edges = ring.edges.iter().enumerate().filter(|(_, e)| e.role == EdgeRole::Model);
    edges.map(|(edge, e)| (EdgeAt { face, ring: 0, edge }, e.curve.as_ref().clone())).collect()
}

fn curve_at(sheets: &[Sheet], at: EdgeAt) -> Option<Curve> {
    let sheet = sheets.get(at.face)?;
    match sheet.face() {
        Some(face) => face.edge(at.ring, at.edge).map(|e| e.curve.as_ref().clone()),
        None => sheet.surface().border(*crate::kernel::geom::Side::ALL.get(at.edge)?).ok(),
    }
}

fn piece(at: EdgeAt, from: f64, to: f64) -> Piece {
    Piece::Edge { face: at.face, ring: at.ring, edge: at.edge, from, to }
}

/// The patch that would mend a defect.
pub fn patch_for(
    document: &Document,
    defect: &Defect,
    options: &DefectOptions,
    job: &Job,
) -> Result<PatchSpec, FixError> {
    let sheets: Vec<Sheet> = document.sheets().map(|(_, s)| s).collect();
    let sides = match (defect.kind, defect.edges.as_slice()) {
        (DefectKind::Gap, [a, b]) => across(&sheets, [*a, *b])?,
        (DefectKind::FreeEdge, [first, ..]) => around(document, &sheets, *first, options, job)?,
        _ => return Err(FixError::Kind),
    };
    Ok(PatchSpec { name: "Mend".to_owned(), sides, ..PatchSpec::default() })
}

/// One patch over both faces of a gap.
fn across(sheets: &[Sheet], edges: [EdgeAt; 2]) -> Result<[Vec<Piece>; 4], FixError> {
    let mut rings = Vec::new();
    for at in edges {
        let ring = outer(sheets.get(at.face).ok_or(FixError::Gone)?, at.face);
        if ring.len() != 4 {
            return Err(FixError::NotFourSided);
        }
        let place = ring.iter().position(|(other, _)| *other == at).ok_or(FixError::NotFourSided)?;
        rings.push((place, ring));
    }
    let [(i, a), (j, b)] = [&rings[0], &rings[1]];
    let at = |ring: &[(EdgeAt, Curve)], k: usize| piece(ring[k % 4].0, 0.0, 1.0);
    let middle = |ring: &[(EdgeAt, Curve)], k: usize| {
        let [start, end] = ring[k % 4].1.ends();
        0.5 * (start + end)
    };
    // The edge along the gap's side that leads on from the one of the other face is the nearer one.
    let straight = middle(a, i + 1).distance(middle(b, j + 1)) + middle(a, i + 3).distance(middle(b, j + 3));
    let crossed = middle(a, i + 1).distance(middle(b, j + 3)) + middle(a, i + 3).distance(middle(b, j + 1));
    let (first, second) = if straight <= crossed { (j + 1, j + 3) } else { (j + 3, j + 1) };
    Ok([vec![at(a, i + 2)], vec![at(a, i + 1), at(b, first)], vec![at(b, j + 2)], vec![at(a, i + 3), at(b, second)]])
}

/// A stretch of an edge as it is walked along.
#[derive(Clone, Debug)]
struct Stretch {
    at: EdgeAt,
    curve: Curve,
    reversed: bool,
    /// Fractions of the edge's length.
    range: [f64; 2],
    length: f64,
}

impl Stretch {
    /// The direction at its start (0) or end (1), as it is walked along.
    fn direction(&self, end: usize) -> DVec3 {
        let [a, b] = self.curve.domain();
        let forwards = (end == 0) != self.reversed;
        // A little inside, where poles and kinks of the ends are behind.
        let t = if forwards { a + 1e-3 * (b - a) } else { b - 1e-3 * (b - a) };
        let d = self.curve.derivatives(t, 1)[1].normalize_or_zero();
        if self.reversed { -d } else { d }
    }
}

/// The loop of free edges that one belongs to, as four sides.
fn around(
    document: &Document,
    sheets: &[Sheet],
    first: EdgeAt,
    options: &DefectOptions,
    job: &Job,
) -> Result<[Vec<Piece>; 4], FixError> {
    let free: Vec<(EdgeAt, Curve, f64)> = topology::edges(document, options.joining, job)
        .into_iter()
        .filter(|e| matches!(e.meets, Meets::Free | Meets::Partly { .. }))
        .filter_map(|e| Some((e.at, curve_at(sheets, e.at)?, e.length)))
        .collect();
    let start = free.iter().position(|e| e.0 == first).ok_or(FixError::Gone)?;
    let stretch = |k: usize, reversed: bool| {
        let (at, curve, length) = free[k].clone();
        Stretch { at, curve, reversed, range: [0.0, 1.0], length }
    };
    let mut used = vec![false; free.len()];
    used[start] = true;
    let mut walked = vec![stretch(start, false)];
    let [origin, mut tip] = free[start].1.ends();
    while tip.distance(origin) > options.joining {
        let near = |k: usize| {
            let [a, b] = free[k].1.ends();
            (tip.distance(a).min(tip.distance(b)), tip.distance(b) < tip.distance(a))
        };
        let next = (0..free.len())
            .filter(|&k| !used[k])
            .map(|k| (near(k), k))
            .filter(|((distance, _), _)| *distance <= options.joining)
            .min_by(|a, b| a.0.0.total_cmp(&b.0.0).then(a.1.cmp(&b.1)));
        let Some(((_, reversed), k)) = next else { return Err(FixError::Open) };
        used[k] = true;
        let ends = free[k].1.ends();
        tip = ends[usize::from(!reversed)];
        walked.push(stretch(k, reversed));
    }
    while walked.len() < 4 {
        let longest = (0..walked.len()).max_by(|&a, &b| walked[a].length.total_cmp(&walked[b].length).then(b.cmp(&a)));
        let Some(k) = longest else { return Err(FixError::Open) };
        let mut halves = [walked[k].clone(), walked[k].clone()];
        let [from, to] = walked[k].range;
        let middle = 0.5 * (from + to);
        let [low, high] = [[from, middle], [middle, to]];
        (halves[0].range, halves[1].range) = if walked[k].reversed { (high, low) } else { (low, high) };
        halves.iter_mut().for_each(|h| h.length *= 0.5);
        walked.splice(k..=k, halves);
    }
    // Corner k is where stretch k begins.
    let count = walked.len();
    let turn = |k: usize| walked[(k + count - 1) % count].direction(1).angle_between(walked[k].direction(0));
    let mut corners: Vec<usize> = (0..count).collect();
    if count > 4 {
        corners.sort_by(|&a, &b| turn(b).total_cmp(&turn(a)).then(a.cmp(&b)));
        corners.truncate(4);
        corners.sort_unstable();
    }
    Ok(std::array::from_fn(|side| {
        let (from, to) = (corners[side], corners[(side + 1) % 4]);
        let length = (to + count - from) % count;
        (0..if length == 0 { count } else { length })
            .map(|k| {
                let s = &walked[(from + k) % count];
                piece(s.at, s.range[0], s.range[1])
            })
            .collect()
    }))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::Surface;
    use crate::model::document::{Shape, Unit};

    fn model(tiles: &[[f64; 3]]) -> Document {
        let mut out = Document::new(Unit::Millimetre);
        for (k, &[x, y, z]) in tiles.iter().enumerate() {
            let c = |i: f64, j: f64| DVec3::new(x + i, y + j, z);
            let s = Surface::bilinear([c(0.0, 0.0), c(1.0, 0.0), c(0.0, 1.0), c(1.0, 1.0)]).unwrap();
            out.add(format!("s{k}"), Shape::Surface(Arc::new(s)), None);
        }
        out
    }

    fn heals(document: &Document, patch: PatchSpec) -> crate::model::healing::Healing {
        let text = "(patches: [])";
        let spec = crate::model::spec::HealSpec {
            patches: vec![patch],
            ..crate::model::spec::HealSpec::from_ron(text).unwrap()
        };
        crate::model::healing::run(document, &spec, &Job::new()).unwrap()
    }

    #[test]
    fn a_gap_is_mended_by_one_patch_over_both_faces() {
        let document = model(&[[0.0, 0.0, 0.0], [1.0, 0.0, 1e-3]]);
        let options = DefectOptions::of(&document);
        let defects = super::super::find(&document, &options, &Job::new());
        let gap = defects.of(DefectKind::Gap).next().unwrap();
        let patch = patch_for(&document, gap, &options, &Job::new()).unwrap();
        assert_eq!(patch.sides.each_ref().map(Vec::len), [1, 2, 1, 2]);
        let healed = heals(&document, patch);
        let bounds = healed.patches[0].1.surface.bounds();
        assert!((bounds.max.x - bounds.min.x - 2.0).abs() < 1e-9, "{bounds:?}");
    }

    #[test]
    fn a_hole_in_a_ring_of_tiles_is_closed_by_its_four_edges() {
        let around = (0..9).filter(|k| *k != 4).map(|k| [f64::from(k % 3), f64::from(k / 3), 0.0]);
        let document = model(&around.collect::<Vec<_>>());
        let options = DefectOptions::of(&document);
        let defects = super::super::find(&document, &options, &Job::new());
        let inner = defects.of(DefectKind::FreeEdge).find(|d| d.at.distance(DVec3::new(1.5, 1.5, 0.0)) < 0.6).unwrap();
        let patch = patch_for(&document, inner, &options, &Job::new()).unwrap();
        assert_eq!(patch.sides.each_ref().map(Vec::len), [1; 4]);
        let surface = &heals(&document, patch).patches[0].1.surface;
        let box_of = surface.bounds();
        assert!(
            box_of.min.distance(DVec3::new(1.0, 1.0, 0.0)) < 1e-9
                && box_of.max.distance(DVec3::new(2.0, 2.0, 0.0)) < 1e-9
        );
        // The outer border has twelve edges; its corners are the four right angles.
        let outer = defects.of(DefectKind::FreeEdge).find(|d| d.at.y < 1e-9).unwrap();
        let patch = patch_for(&document, outer, &options, &Job::new()).unwrap();
        assert_eq!(patch.sides.each_ref().map(Vec::len), [3; 4]);
        let edges: BTreeSet<String> = patch.sides.iter().flatten().map(|p| format!("{p:?}")).collect();
        assert_eq!(edges.len(), 12, "no edge twice");
    }

    #[test]
    fn defects_without_sides_say_so() {
        let document = model(&[[0.0, 0.0, 0.0]]);
        let options = DefectOptions::of(&document);
        let defect = Defect {
            kind: DefectKind::Sliver,
            faces: vec![0],
            entities: Vec::new(),
            edges: Vec::new(),
            at: DVec3::ZERO,
            reach: 1.0,
            size: 1.0,
            depth: None,
        };
        assert_eq!(patch_for(&document, &defect, &options, &Job::new()), Err(FixError::Kind));
        let edges = vec![EdgeAt { face: 7, ring: 0, edge: 0 }];
        let gone = Defect { kind: DefectKind::FreeEdge, edges, ..defect };
        assert_eq!(patch_for(&document, &gone, &options, &Job::new()), Err(FixError::Gone));
    }
}
