//! Defects of single faces: slivers, bad parametrizations, and faces that run through themselves.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::strips::borders;
use super::{Defect, DefectKind, DefectOptions};
use crate::kernel::geom::trim::Sheet;
use crate::kernel::job::Job;
use crate::kernel::mesh::area::area;
use crate::kernel::self_ssi::{self, SelfIntersectOptions, SelfIntersection};

/// Places along each direction at which a parametrization is looked at.
const PLACES: usize = 12;
/// A face is a sliver when it is this many times longer than wide, and narrower than the joining tolerance.
const THIN: f64 = 20.0;

fn defect(kind: DefectKind, face: usize, at: DVec3, reach: f64, size: f64) -> Defect {
    Defect { kind, faces: vec![face], entities: Vec::new(), edges: Vec::new(), at, reach, size, depth: None }
}

/// Finds slivers and bad parametrizations.
pub fn find(sheets: &[Sheet], options: &DefectOptions, job: &Job) -> Vec<Defect> {
    job.phase("Looking at each face");
    let found: Vec<Vec<Defect>> = sheets
        .par_iter()
        .enumerate()
        .map(|(k, sheet)| {
            if job.is_cancelled() {
                return Vec::new();
            }
            let mut out = Vec::new();
            out.extend(sliver(k, sheet, options));
            out.extend(parametrization(k, sheet, options));
            out
        })
        .collect();
    job.progress(1.0);
    found.into_iter().flatten().collect()
}

/// A strip's width is twice its area by its perimeter.
fn sliver(number: usize, sheet: &Sheet, options: &DefectOptions) -> Option<Defect> {
    let perimeter: f64 = borders(sheet)
        .iter()
        .flat_map(|border| border.curve.sampled(8).windows(2).map(|w| w[0].1.distance(w[1].1)).collect::<Vec<_>>())
        .sum();
    let width = 2.0 * area(sheet) / perimeter;
    if !(width < options.joining && 0.5 * perimeter > THIN * width) {
        return None;
    }
    let bounds = sheet.bounds();
    let at = 0.5 * (bounds.min + bounds.max);
    Some(defect(DefectKind::Sliver, number, at, 0.5 * bounds.diagonal(), width))
}

/// The place inside where the parameter lines are nearest to each other in direction, when that is too near. A
/// derivative that vanishes inside counts as an angle of 0.
fn parametrization(number: usize, sheet: &Sheet, options: &DefectOptions) -> Option<Defect> {
    let surface = sheet.surface();
    let [u, v] = match sheet.face() {
        None => surface.domain(),
        Some(face) => {
            let [low, high] = face.extent();
            [[low.x, high.x], [low.y, high.y]]
        }
    };
    let size = sheet.bounds().diagonal();
    let mut worst: Option<(f64, DVec3)> = None;
    for k in 0..PLACES * PLACES {
        let at = |[a, b]: [f64; 2], i: usize| a + (b - a) * (i as f64 + 0.5) / PLACES as f64;
        let uv = DVec2::new(at(u, k % PLACES), at(v, k / PLACES));
        if !sheet.reaches(uv, 0.0) {
            continue;
        }
        let jet = surface.jet(surface.clamped(uv), 1);
        let (su, sv) = (jet.u(), jet.v());
        let (du, dv) = (su.length() * (u[1] - u[0]), sv.length() * (v[1] - v[0]));
        let vanishes = du.min(dv) <= 1e-9 * size;
        let angle = if vanishes { 0.0 } else { su.cross(sv).length().atan2(su.dot(sv).abs()).to_degrees() };
        if worst.is_none_or(|(least, _)| angle < least) {
            worst = Some((angle, jet.p()));
        }
    }
    let (angle, at) = worst.filter(|(angle, _)| *angle < options.angle_deg)?;
    Some(defect(DefectKind::Parametrization, number, at, 0.25 * size, angle))
}

/// Faces that run through themselves, and a line for each that could not be decided.
pub fn self_intersections(sheets: &[Sheet], job: &Job) -> (Vec<Defect>, Vec<String>) {
    job.phase("Intersecting faces with themselves");
    let surfaces: Vec<_> = sheets.iter().enumerate().map(|(k, s)| (k, std::sync::Arc::clone(s.surface()))).collect();
    let (mut found, mut notes) = (Vec::new(), Vec::new());
    let all = match self_ssi::model::self_intersect_all(&surfaces, &SelfIntersectOptions::default(), job) {
        Ok(all) => all,
        Err(error) => return (found, vec![format!("self-intersections were not looked for: {error}")]),
    };
    for ((number, SelfIntersection { result, .. }), sheet) in all.into_iter().enumerate().zip(sheets) {
        if !result.complete && !job.is_cancelled() {
            notes.push(format!("surface {number}: some self-intersections could not be decided"));
        }
        // Of a trimmed face, what lies inside with both preimages.
        let inside = |p: &crate::kernel::ssi::result::CurvePoint| sheet.reaches(p.uv, 0.0) && sheet.reaches(p.st, 0.0);
        let (mut length, mut places) = (0.0, Vec::new());
        for curve in &result.curves {
            for pair in curve.points.windows(2).filter(|w| w.iter().all(inside)) {
                length += pair[0].xyz.distance(pair[1].xyz);
                places.push(pair[0].xyz);
            }
        }
        if let Some(&at) = places.get(places.len() / 2).filter(|_| length > 0.0) {
            found.push(defect(DefectKind::SelfIntersection, number, at, 0.5 * length, length));
        }
    }
    (found, notes)
}
