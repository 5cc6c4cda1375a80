//! Defects of edges and loops: free, apart, shared by too many, open, crossing.

use glam::DVec3;
use rayon::prelude::*;

use super::{Defect, DefectKind, DefectOptions};
use crate::kernel::geom::Aabb;
use crate::kernel::geom::trim::{Face, Sheet};
use crate::kernel::job::Job;
use crate::kernel::mesh::face_mesh::tessellate_face;
use crate::kernel::mesh::tessellate::TessellateOptions;
use crate::model::document::Document;
use crate::model::topology::{self, EdgeAt, Meets};

/// How finely loops are sampled where they are looked at for crossings, as a fraction of the face's size.
const CHORD: f64 = 1e-3;

/// Finds them.
pub fn find(document: &Document, sheets: &[Sheet], options: &DefectOptions, job: &Job) -> Vec<Defect> {
    let mut out = Vec::new();
    for edge in topology::edges(document, options.joining, job) {
        let mut faces = vec![edge.at.face];
        faces.extend(edge.with.iter().map(|at| at.face));
        faces.dedup();
        let mut all = vec![edge.at];
        all.extend(edge.with.iter().copied());
        let mut add = |kind, size| {
            let (faces, edges) = (faces.clone(), all.clone());
            let reach = 0.5 * edge.length;
            out.push(Defect { kind, faces, entities: Vec::new(), edges, at: edge.place, reach, size, depth: None });
        };
        match edge.meets {
            Meets::Free | Meets::Partly { .. } => add(DefectKind::FreeEdge, edge.length),
            // Each pair is listed once, under its first edge.
            Meets::Shared { gap } if gap > options.tolerance && edge.with.iter().all(|other| edge.at < *other) => {
                add(DefectKind::Gap, gap);
            }
            _ => {}
        }
        // Three faces along the whole edge; two of one face are a seam.
        if edge.by_file && edge.with.len() > 1 && edge.with.iter().all(|other| edge.at < *other) {
            add(DefectKind::NonManifold, (1 + edge.with.len()) as f64);
        }
    }
    let loops: Vec<Vec<Defect>> = sheets
        .par_iter()
        .enumerate()
        .map(|(k, sheet)| sheet.face().filter(|_| !job.is_cancelled()).map_or(Vec::new(), |f| of_loops(k, f, options)))
        .collect();
    out.extend(loops.into_iter().flatten());
    out
}

/// Loops that do not close, or cross.
fn of_loops(number: usize, face: &Face, options: &DefectOptions) -> Vec<Defect> {
    let mut out = Vec::new();
    for (ring, r) in face.rings().iter().enumerate() {
        let ends: Vec<[DVec3; 2]> = r.edges.iter().map(|e| e.range().map(|t| e.curve.eval(t))).collect();
        let count = ends.len();
        let widest =
            (0..count).map(|k| (ends[k][1].distance(ends[(k + 1) % count][0]), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((gap, edge)) = widest.filter(|(gap, _)| *gap > options.joining) {
            out.push(Defect {
                kind: DefectKind::OpenLoop,
                faces: vec![number],
                entities: Vec::new(),
                edges: vec![EdgeAt { face: number, ring, edge }],
                at: 0.5 * (ends[edge][1] + ends[(edge + 1) % count][0]),
                reach: gap,
                size: gap,
                depth: None,
            });
        }
    }
    let size = face.bounds().diagonal();
    let mesh = tessellate_face(face, &TessellateOptions::new(CHORD * size), &[Vec::new(), Vec::new()]);
    if mesh.lost > 0 {
        let bounds = Aabb::of(mesh.edges.iter().flatten().flat_map(|line| line.points.iter().copied()));
        out.push(Defect {
            kind: DefectKind::CrossingLoop,
            faces: vec![number],
            entities: Vec::new(),
            edges: Vec::new(),
            at: 0.5 * (bounds.min + bounds.max),
            reach: 0.5 * bounds.diagonal(),
            size: mesh.lost as f64,
            depth: None,
        });
    }
    out
}
